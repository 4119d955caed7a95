"""The command `laws`: what laws, objectives and other plug-ins there are, with their parameters and sources."""

from collections.abc import Iterator
from typing import Any

import click

from hpcclear.cli.options import of_one_process, show
from hpcclear.ranks.stopping import Exit

_LAWS = {"contact": "normal force", "friction": "friction"}


@click.command(short_help="List laws, objectives and other plug-ins, with their sources.")
@of_one_process
def laws() -> int:
    """List what a scene may name: laws of contact and friction, objectives, distributions, surrogates and searches.

    Laws with formula, parameters, units, bounds, range and source. Those of installed packages are among them.
    One of your own: docs/extending.md.

    Example: hpcclear laws
    """
    from hpcclear.cli.printing import console, table
    from hpcclear.scene.laws import known_laws

    for kind, title in _LAWS.items():
        show(f"effects.{kind}.law ({title})")
        for name, law in known_laws(kind).items():
            console().print(table(name, list(_rows(law))))
    for title, rows in _others():
        console().print(table(title, rows))
    return Exit.DONE


def _others() -> Iterator[tuple[str, list[tuple[str, str]]]]:
    """What else is known by a name: where it is written, and each with what it is or the package that it comes from."""
    from hpcclear.plugins import DISTRIBUTIONS, OBJECTIVES, SEARCHES, SURROGATES

    places = {
        "study.objective": OBJECTIVES,
        "study.random.*.distribution": DISTRIBUTIONS,
        "study.surrogate.model": SURROGATES,
        "study.swarm.algorithm": SEARCHES,
    }
    for place, registry in places.items():
        ours = registry.ours()
        rows = [
            (name, _objective(registry, name) if registry is OBJECTIVES else "built-in")
            for name in ours
        ]
        for name in registry.names()[len(ours) :]:
            found = (
                _objective(registry, name)
                if registry is OBJECTIVES
                else _first_line(registry.get(name))
            )
            rows.append((name, "; ".join(filter(None, (found, registry.origin(name))))))
        if rows:
            yield f"{place} ({registry.kind})", rows


def _objective(registry: Any, name: str) -> str:
    one = registry.get(name)
    return ", ".join(filter(None, (one.words, one.unit, one.source)))


def _first_line(value: Any) -> str:
    """What a plug-in says of itself first."""
    return ((value.__doc__ or "").strip().splitlines() or [""])[0]


def _rows(law: Any) -> list[tuple[str, str]]:
    texts = {"what": law.words, "formula": law.formula, "valid": law.valid, "source": law.source}
    rows = [(label, text) for label, text in texts.items() if text]
    for one in law.parameters:
        unit = f" in {one.unit}" if one.unit else ""
        default = "" if one.default is None else f", default {one.default:g}"
        bounds = one.bounds()
        rows.append((one.name, f"{one.words}{unit}" + (f", {bounds}" if bounds else "") + default))
    return rows

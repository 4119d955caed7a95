"""The command `laws`: what laws, objectives and other plug-ins there are, with their parameters and sources."""

from typing import Any

import click

from hpcclear.cli.options import of_one_process, show
from hpcclear.ranks.stopping import Exit

_TITLES = {
    "contact": "effects.contact.law (normal force)",
    "geometry": "effects.contact.geometry (shapes that touch; left out, spheres)",
    "friction": "effects.friction.law (friction)",
    "film": "film.model of a joint with clearance (oil films)",
}


@click.command(short_help="List laws, objectives and other plug-ins, with their sources.")
@of_one_process
def laws() -> int:
    """List what a scene may name: laws, geometries of contact, objectives, distributions, surrogates and searches.

    Laws are listed with formula, parameters, units, bounds, range and source, those of installed packages too.
    To write your own, see docs/extending.md.

    Example: hpcclear laws
    """
    from hpcclear import plugins
    from hpcclear.cli.terminal import console, table
    from hpcclear.scene.laws import known_laws

    registries = {"contact": plugins.CONTACT_LAWS, "friction": plugins.FRICTION_LAWS}
    for kind, title in _TITLES.items():
        show(title)
        offered = registries[kind].names() if kind in registries else ()
        for name, law in known_laws(kind).items():
            origin = registries[kind].origin(name) if name in offered else ""
            console().print(table(name, list(_rows(law, origin))))
    for place, others in _OTHERS.items():
        _list(place, getattr(plugins, others))
    return Exit.DONE


_OTHERS = {
    "study.objective": "OBJECTIVES",
    "study.random.*.distribution": "DISTRIBUTIONS",
    "study.surrogate.model": "SURROGATES",
    "study.swarm.algorithm": "SEARCHES",
}
"""Registries by the entries that name what is in them."""


def _list(place: str, registry: Any) -> None:
    """Print the names of a registry; of objectives and of what packages offer, what they are."""
    from hpcclear.cli.terminal import console, table

    names, ours = registry.names(), registry.ours()
    show(f"{place} ({registry.kind}): {', '.join(names)}")
    listed = names if place == "study.objective" else names[len(ours) :]
    rows = [(name, "; ".join(filter(None, _described(registry, name)))) for name in listed]
    if rows:
        console().print(table(f"{registry.kind}s", rows))


def _described(registry: Any, name: str) -> tuple[str, ...]:
    """What a plug-in is, and the package that it comes from."""
    one = registry.get(name)
    origin = registry.origin(name)
    if hasattr(one, "words"):
        return one.words, one.unit, one.source, origin
    return (*(one.__doc__ or "").strip().splitlines()[:1], origin)


def _rows(law: Any, origin: str) -> list[tuple[str, str]]:
    texts = {"what": law.words, "formula": law.formula, "valid": law.valid, "source": law.source}
    texts["package"] = origin
    rows = [(label, text) for label, text in texts.items() if text]
    for one in law.parameters:
        unit = f" in {one.unit}" if one.unit else ""
        default = "" if one.default is None else f", default {one.default:g}"
        bounds = one.bounds()
        rows.append((one.name, f"{one.words}{unit}" + (f", {bounds}" if bounds else "") + default))
    return rows

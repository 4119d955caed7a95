"""`show`: what a scene may name, the schema of scene files, how to cite."""

from collections.abc import Iterator
from typing import Any

import click

from hpcclear import __version__
from hpcclear.cli import options as cli


@cli.command("start", "Show laws, the schema of scene files, or how to cite.")
@click.argument("what", type=click.Choice(["laws", "schema", "citation"]))
@cli.DETAILS
def run(what: str) -> None:
    """Show what this version knows.

    laws: laws, geometries of contact, objectives, distributions, surrogates and searches that a scene may name, those of
    installed packages too; with --details formulas, parameters, units, bounds, ranges and sources of the laws. To write your
    own, see docs/extending.md.

    schema: the JSON schema of scene files, for editors.

    citation: BibTeX entries of this version and of the paper whose method it implements.

    Example: hpcclear show citation > hpcclear.bib
    """
    {"laws": _laws, "schema": _schema, "citation": _citation}[what]()


def _schema() -> None:
    import json

    from hpcclear.scene import scene_schema

    cli.show(json.dumps(scene_schema(), indent=2))


PROGRAM = f"""@software{{hpcclear,
  author  = {{{{The hpcclear developers}}}},
  title   = {{hpcclear: MPI-parallel robust design of mechanisms with clearance joints}},
  version = {{{__version__}}},
  license = {{BSD-3-Clause}},
}}"""


def _citation() -> None:
    from hpcclear.scene.describing import BIBTEX

    cli.show(f"{PROGRAM}\n\n{BIBTEX}")


_TITLES = {
    "contact": "effects.contact.law (normal force)",
    "geometry": "effects.contact.geometry (shapes that touch; left out, spheres)",
    "friction": "effects.friction.law (friction)",
    "film": "film.model of a joint with clearance (oil films)",
}

_OTHERS = {
    "study.objective": "OBJECTIVES",
    "study.random.*.distribution": "DISTRIBUTIONS",
    "study.surrogate.model": "SURROGATES",
    "study.swarm.algorithm": "SEARCHES",
}
"""Registries by the entries that name what is in them."""


def _laws() -> None:
    if not cli.detailed():
        _names()
        return
    from hpcclear import plugins
    from hpcclear.cli.tables import console, table
    from hpcclear.scene.laws import known_laws

    registries = {"contact": plugins.CONTACT_LAWS, "friction": plugins.FRICTION_LAWS}
    for kind, title in _TITLES.items():
        cli.show(title)
        offered = registries[kind].names() if kind in registries else ()
        for name, law in known_laws(kind).items():
            origin = registries[kind].origin(name) if name in offered else ""
            console().print(table(name, _rows(law, origin)))
    for place, others in _OTHERS.items():
        _list(place, getattr(plugins, others))


def _names() -> None:
    from hpcclear import plugins
    from hpcclear.cli.terminal import show_rows
    from hpcclear.scene.laws import known_laws

    every = {title.partition(" ")[0]: known_laws(kind) for kind, title in _TITLES.items()}
    every |= {place: getattr(plugins, others).names() for place, others in _OTHERS.items()}
    show_rows("", [(place, ", ".join(names)) for place, names in every.items()])
    cli.show("--details prints formulas, parameters with units and bounds, ranges and sources.")


def _list(place: str, registry: Any) -> None:
    """Print the names of a registry; of objectives and of what packages offer, what they are."""
    from hpcclear.cli.tables import console, table

    names, ours = registry.names(), registry.ours()
    cli.show(f"{place} ({registry.kind}): {', '.join(names)}")
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


def _rows(law: Any, origin: str) -> Iterator[tuple[str, str]]:
    texts = {"what": law.words, "formula": law.formula, "valid": law.valid, "source": law.source}
    texts["package"] = origin
    yield from ((label, text) for label, text in texts.items() if text)
    for one in law.parameters:
        unit = f" in {one.unit}" if one.unit else ""
        default = "" if one.default is None else f", default {one.default:g}"
        bounds = one.bounds()
        yield one.name, f"{one.words}{unit}" + (f", {bounds}" if bounds else "") + default

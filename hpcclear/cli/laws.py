"""The command `laws`: what laws of contact and friction there are, with their parameters and sources."""

from typing import Any

import click

from hpcclear.cli.options import of_one_process, show
from hpcclear.ranks.stopping import Exit

_TITLES = {
    "contact": "effects.contact.law (normal force)",
    "geometry": "effects.contact.geometry (shapes that touch; left out, spheres)",
    "friction": "effects.friction.law (friction)",
}


@click.command(short_help="List laws of contact and friction, with their sources.")
@of_one_process
def laws() -> int:
    """List the laws and contact geometries that a scene may name in effects.contact and effects.friction.

    Each with its formula, parameters, units, bounds, range and source. A law of your own: docs/extending.md.

    Example: hpcclear laws
    """
    from hpcclear.cli.printing import console, table
    from hpcclear.scene.laws import known_laws

    for kind, title in _TITLES.items():
        show(title)
        for name, law in known_laws(kind).items():
            console().print(table(name, list(_rows(law))))
    return Exit.DONE


def _rows(law: Any) -> list[tuple[str, str]]:
    texts = {"what": law.words, "formula": law.formula, "valid": law.valid, "source": law.source}
    rows = [(label, text) for label, text in texts.items() if text]
    for one in law.parameters:
        unit = f" in {one.unit}" if one.unit else ""
        default = "" if one.default is None else f", default {one.default:g}"
        bounds = one.bounds()
        rows.append((one.name, f"{one.words}{unit}" + (f", {bounds}" if bounds else "") + default))
    return rows

"""`compare`: a response beside measurements."""

import math
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hpcclear.base.errors import InputError
from hpcclear.cli import options as cli

if TYPE_CHECKING:
    from hpcclear.report.compare import Alignment, ComparedSignal


MOST = 16
"""Quantities that are printed without ``--details``, those with the largest errors."""


@cli.command("look", "Compare a response with measurements.")
@click.argument("file", type=cli.PATH)
@click.argument("measured", type=cli.PATH)
@cli.option("-o --output", "Draw both to this file (png, svg, pdf).", type=cli.PATH)
@cli.option(
    "--align", "Alignment in phase. By default by angle if the table has one, else by the largest correlation.",
    "auto", type=click.Choice(["auto", "angle", "correlation", "none"]),
)  # fmt: skip
@cli.option(
    "--name COLUMN=QUANTITY", name="names",
    words="Quantity of the response that a column measures. Repeatable. By default columns have the names of quantities.",
)  # fmt: skip
@cli.DETAILS
def run(
    file: Path, measured: Path, output: Path | None, align: "Alignment", names: tuple[str, ...]
) -> None:
    """Compare a response with measured series (CSV, xlsx); print error norms in the units of the measurement.

    The first column is time or crank_angle, the others are quantities as exported tables name them, such as
    "contact_force crank_rod [kN]". The averaged revolutions are repeated
    periodically and compared with the measurement.

    Example: hpcclear compare results/response.nc measured.csv -o results/overlay.pdf
    """
    from hpcclear.cli.tables import console, table
    from hpcclear.cli.terminal import show_rows
    from hpcclear.report.compare import NOT_ALIGNED, compare
    from hpcclear.results import dataset

    chosen = dict[str, str]()
    for pair in names:
        column, quantity = (word.strip() for word in pair.rpartition("=")[::2])
        if not (column and quantity) or column in chosen:
            reason = "is no pair" if column not in chosen else f"{column} has a quantity already"
            raise InputError("--name", pair, reason, "Write COLUMN=QUANTITY, once for each column")
        chosen[column] = quantity
    found = compare(dataset.read(file, "response"), measured, align, chosen)
    angular = found.axis == "angle"
    moved = f"{math.degrees(found.shift):.4g} deg" if angular else f"{found.shift:.4g} s"
    picked = "as it stands" if found.aligned == NOT_ALIGNED else "the one that correlates best"
    rows = [
        ("measured points", str(len(found.x))),
        ("aligned", f"{found.aligned}, shifted by {moved}"),
        ("simulated revolutions", f"{found.revolutions} averaged ones, repeated periodically"),
        ("first point", f"in revolution {found.revolution} of these, {picked}"),
    ]
    show_rows("Comparison", rows)
    if cli.detailed():
        for one in found.quantities:
            console().print(table(one.name, _norms(one)))
    else:
        import numpy as np

        # the largest first; those of a quantity that is zero throughout, NaN, last
        order = sorted(found.quantities, key=lambda one: -np.nan_to_num(one.norms["relative_rms"]))
        rows = [(one.name, " ".join(_norms(one)[0])) for one in order[:MOST]]
        more = len(order) - len(rows)
        show_rows("", rows + [("", f"and {more} with less (--details)")] * bool(more))
    if output is not None:
        from hpcclear.report import overlay_figure, save

        cli.show(f"figure   {save(overlay_figure(found), cli.place_of(output))}")


def _norms(one: "ComparedSignal") -> list[tuple[str, str]]:
    """Error norms of a quantity in the unit of its measurement."""
    from hpcclear.report.figures.compared import scale

    unit, norms = scale(one.shown, one.unit), one.norms

    def shown(name: str) -> str:
        return f"{norms[name] * unit.factor:+.4g} {unit.unit}"

    least, most = (pick(one.by_revolution) * unit.factor for pick in (min, max))
    share = f"{norms['relative_rms']:.3g} of the measured RMS"
    share = share if one.measured.any() else "where all that was measured is 0"
    return [
        ("RMS error", f"{shown('rms').lstrip('+')}, {share}"),
        ("RMS error by revolution", f"{least:.4g} to {most:.4g} {unit.unit}"),
        ("largest error", shown("largest").lstrip("+")),
        ("error of the mean", shown("mean")),
        ("error of the peak", f"{shown('peak')} at the measured points"),
        ("correlation coefficient", f"{norms['correlation']:.4f}"),
    ]

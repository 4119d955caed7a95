"""Commands that take results elsewhere: `export`, `plot`; and beside measurements: `compare`."""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hpcclear.base.errors import InputError, nearest
from hpcclear.cli.options import (
    PATH,
    TRUST,
    Amount,
    directory_option,
    flag,
    of_one_process,
    place_of,
    say,
    show,
)
from hpcclear.ranks.stopping import Exit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hpcclear.report.compare import Quantity
    from hpcclear.report.html.content import Content
    from hpcclear.results.content import Results

FILE = click.argument("file", type=PATH)
UNITS = click.option(
    "--unit",
    "units",
    multiple=True,
    metavar="UNIT",
    help='Unit for all quantities of its kind, such as kN. Repeatable. "SI" gives SI units. Default: those of the scene.',
)


@click.command(short_help="Write results as a table for Excel, MATLAB or pandas.")
@click.argument("files", type=PATH, nargs=-1, required=True, metavar="FILE...")
@directory_option("Table to write: its name ends in .csv, .xlsx, .mat or .parquet.")
@UNITS
@flag(
    "--statistics",
    "Write statistics of samples instead: for each file columns of value and interval.",
)
@click.option(
    "--beyond",
    multiple=True,
    metavar="NAME=VALUE",
    help="With --statistics, share of samples beyond this value. Repeatable.",
)
@of_one_process
def export(
    files: tuple[Path, ...],
    output: Path,
    units: tuple[str, ...],
    statistics: bool,
    beyond: tuple[str, ...],
) -> int:
    """Write a result file as a table: one row per design or instant, joints as columns.

    Headings are names with units. Quantities have the units that the scene file uses, otherwise SI units.
    With --statistics, the table compares several samples, such as those of several fits.

    Example: hpcclear export results/samples.nc -o results/samples.xlsx
    """
    from hpcclear.report import export as writing
    from hpcclear.report.spread import rows_of, side_by_side

    writing.check_format(output)
    if statistics:
        samples = writing.read_samples(files)
        lines = side_by_side(samples, beyond)
        table = writing.statistics(samples, place_of(output), lines, units)
        _print_rows(["statistic", *samples], rows_of(lines))
    else:
        _check_one(files, beyond)
        table = writing.export(files[0], place_of(output), units)
        for name in table.attrs["left_out"]:
            say(f"Note: {name} is left out: it has too many columns. It stands in {files[0]}")
    show(f"written  {output}: {len(table)} rows, {len(table.columns)} columns")
    return Exit.DONE


def _check_one(files: tuple[Path, ...], beyond: tuple[str, ...]) -> None:
    if len(files) > 1 or beyond:
        reason = "a table holds one result"
        raise InputError(
            "export", f"{len(files)} files", reason, "Add --statistics, or export each by itself"
        )


def _print_rows(headings: list[str], rows: list[list[str]]) -> None:
    """Print a table of texts, its columns as wide as the terminal allows."""
    from rich import box
    from rich.table import Table

    from hpcclear.cli.terminal import console

    made = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in headings:
        made.add_column(heading, overflow="fold")
    for row in rows:
        made.add_row(*row)
    console().print(made)


@click.command(short_help="Compare a response with measurements.")
@FILE
@click.argument("measured", type=PATH)
@click.option("-o", "--output", type=PATH, help="Draw both to this file (png, svg, pdf).")
@click.option(
    "--align",
    type=click.Choice(["auto", "angle", "correlation", "none"]),
    default="auto",
    show_default=True,
    help="Alignment in phase. By default by angle if the table has one, else by the largest correlation.",
)
@click.option(
    "--name",
    "names",
    multiple=True,
    metavar="COLUMN=QUANTITY",
    help="Quantity of the response that a column measures. Repeatable. By default columns have the names of quantities.",
)
@of_one_process
def compare(
    file: Path, measured: Path, output: Path | None, align: Any, names: tuple[str, ...]
) -> int:
    """Compare a response with measured series (CSV, xlsx); print error norms in the units of the measurement.

    The first column is time or crank_angle, the others are quantities as exported tables name them, such as
    "contact_force crank_rod [kN]". The averaged revolutions are repeated
    periodically and compared with the measurement.

    Example: hpcclear compare results/response.nc measured.csv -o results/overlay.pdf
    """
    from hpcclear.cli.terminal import console, table
    from hpcclear.report.compare import NOT_ALIGNED
    from hpcclear.report.compare import compare as compared
    from hpcclear.results import dataset

    pairs = (one.rpartition("=")[::2] for one in names)
    chosen = {column.strip(): quantity.strip() for column, quantity in pairs}
    found = compared(dataset.read(file, "response"), measured, align, chosen)
    out = console()
    angular = found.axis == "angle"
    moved = f"{math.degrees(found.shift):.4g} deg" if angular else f"{found.shift:.6g} s"
    picked = "as it stands" if found.aligned == NOT_ALIGNED else "the one that correlates best"
    rows = [
        ("measured points", str(len(found.x))),
        ("aligned", f"{found.aligned}, shifted by {moved}"),
        ("simulated revolutions", f"{found.revolutions} averaged ones, repeated periodically"),
        ("first point", f"in revolution {found.revolution} of these, {picked}"),
    ]
    out.print(table("Comparison", rows))
    for one in found.quantities:
        out.print(table(one.name, _norms(one)))
    if output is not None:
        from hpcclear.report import overlay_figure, save

        show(f"figure   {save(overlay_figure(found), place_of(output))}")
    return Exit.DONE


def _norms(one: "Quantity") -> list[tuple[str, str]]:
    """Error norms of a quantity in the unit of its measurement."""
    from hpcclear.report.figures.compared import scale

    unit, norms = scale(one.shown, one.unit), one.norms

    def shown(name: str) -> str:
        return f"{norms[name] * unit.factor:+.4g} {unit.unit}"

    least, most = (pick(one.by_revolution) * unit.factor for pick in (min, max))
    return [
        (
            "RMS error",
            f"{shown('rms').lstrip('+')}, {norms['relative_rms']:.3g} of the measured RMS",
        ),
        ("RMS error by revolution", f"{least:.4g} to {most:.4g} {unit.unit}"),
        ("largest error", shown("largest").lstrip("+")),
        ("error of the mean", shown("mean")),
        ("error of the peak", f"{shown('peak')} at the measured points"),
        ("correlation coefficient", f"{norms['correlation']:.4f}"),
    ]


@click.command(short_help="Draw figures and films of results.")
@click.argument("place", type=PATH)
@click.option(
    "--figure",
    "names",
    multiple=True,
    metavar="NAME",
    help="Figure to draw. Repeatable. Default: all. Without -o the names are listed.",
)
@click.option(
    "-o", "--output", type=PATH, help="File for one figure (png, svg, pdf), otherwise a directory."
)
@click.option(
    "--format",
    "kind",
    type=click.Choice(["png", "svg", "pdf"]),
    default="png",
    show_default=True,
    help="Format of figures in a directory.",
)
@click.option(
    "--animation", type=PATH, metavar="FILE", help="Film of the motion: .gif, or .mp4 with ffmpeg."
)
@click.option(
    "--seconds", type=Amount(min=0.0), default=6.0, show_default=True, help="Length of the film."
)
@click.option(
    "--revolutions",
    type=click.IntRange(min=1),
    default=2,
    show_default=True,
    help="Revolutions in the film, the last ones of the response.",
)
@TRUST
@of_one_process
def plot(
    place: Path,
    names: tuple[str, ...],
    output: Path | None,
    kind: str,
    animation: Path | None,
    seconds: float,
    revolutions: int,
    trust: bool,
) -> int:
    """Draw figures of a result file or of a directory of results, and films of the motion.

    Example: hpcclear plot results/response.nc --figure orbit -o orbit.pdf
    """
    from hpcclear.plugins import trusting
    from hpcclear.report.figures.animation import animate
    from hpcclear.report.figures.catalogue import drawings
    from hpcclear.report.html.content import read

    content = read(place)
    if animation is not None:
        show(
            f"film     {animate(_moving(content, place), place_of(animation), seconds, revolutions)}"
        )
    with trusting(trust):
        every = drawings(content.files, content.responses)
        if output is not None:
            _draw({name: known(name, every) for name in names} or every, output, kind, bool(names))
        elif animation is None:
            show(f"figures of {place}: {', '.join(every)}")
    return Exit.DONE


def _moving(content: "Content", place: Path) -> "Results":
    """The response that a film shows."""
    if content.response is None:
        reason = "it holds no response, so there is no motion to show"
        raise InputError("file", str(place), reason, "Make one with hpcclear simulate")
    return content.response


def known(name: str, every: "Mapping[str, Callable[[], Figure]]") -> "Callable[[], Figure]":
    """What draws the figure of a name; raises InputError where the results do not allow it."""
    if name not in every:
        raise InputError(
            "--figure", name, "these results have no such figure", nearest(name, list(every))
        )
    return every[name]


def _draw(
    figures: "Mapping[str, Callable[[], Figure]]", output: Path, kind: str, chosen: bool
) -> None:
    """Draw to a file, or each to a file of a directory; of all figures, those that need more are named."""
    from hpcclear.report import save

    single = len(figures) == 1 and output.suffix != ""
    if not single:
        output.mkdir(parents=True, exist_ok=True)
    for name, draw in figures.items():
        try:
            show(
                f"figure   {save(draw(), place_of(output) if single else output / f'{name}.{kind}')}"
            )
        except InputError as error:
            if chosen or error.key in ("figure", "matplotlib", "output"):
                raise
            say(f"Note: no {name}: {error.reason}. {error.remedy}")


COMMANDS = (export, compare, plot)

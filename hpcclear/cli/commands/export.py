"""`export`: a result as a table."""

from pathlib import Path

import click

from hpcclear.base.errors import InputError
from hpcclear.base.plain import counted
from hpcclear.cli import options as cli


@cli.command("keep", "Write results as a table for Excel, MATLAB or pandas.")
@click.argument("files", type=cli.PATH, nargs=-1, required=True, metavar="FILE...")
@cli.option(
    "-o --output", "Table to write: its name ends in .csv, .xlsx, .mat or .parquet.", type=cli.PATH, required=True,
)  # fmt: skip
@cli.option(
    "--unit UNIT", name="units",
    words='Unit for all quantities of its kind, such as kN. Repeatable. "SI" gives SI units. Default: those of the scene.',
)  # fmt: skip
@cli.flag(
    "--statistics", "Write statistics of samples instead: for each file columns of value and interval."
)  # fmt: skip
@cli.option("--beyond NAME=VALUE", "With --statistics, share of samples beyond it. Repeatable.")
def run(
    files: tuple[Path, ...],
    output: Path,
    units: tuple[str, ...],
    statistics: bool,
    beyond: tuple[str, ...],
) -> None:
    """Write a result file as a table: one row per design or instant, joints as columns.

    Headings are names with units. Quantities have the units that the scene file uses, otherwise SI units.
    With --statistics, the table compares several samples, such as those of several fits.

    Example: hpcclear export results/samples.nc -o results/samples.xlsx
    """
    from hpcclear.cli.tables import console, table
    from hpcclear.report import export as writing
    from hpcclear.report.spread import rows_of, side_by_side

    cli.check_mode("--statistics", statistics, its_own=("beyond",))
    writing.check_format(output)
    if statistics:
        samples = writing.read_samples(files)
        lines = side_by_side(samples, beyond)
        made = writing.statistics(samples, cli.place_of(output), lines, units)
        console().print(table("", rows_of(lines), ["statistic", *samples]))
    else:
        if len(files) > 1:
            reason = "a table holds one result"
            remedy = "Add --statistics, or export each by itself"
            raise InputError("export", f"{len(files)} files", reason, remedy)
        made = writing.export(files[0], cli.place_of(output), units)
        if left := list(made.attrs["left_out"]):
            more = f" and {len(left) - 3} more" if len(left) > 3 else ""
            named = f"{', '.join(left[:3])}{more}"
            cli.say(f"Note: left out, with too many columns for a table: {named} (in {files[0]})")
    rows, columns = counted(len(made), "row"), counted(len(made.columns), "column")
    cli.show(f"written  {output}: {rows}, {columns}")

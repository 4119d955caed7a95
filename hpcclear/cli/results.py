"""Commands that take results elsewhere: `export`."""

from pathlib import Path

import click

from hpcclear.cli.options import PATH, directory_option, of_one_process, place_of, say, show
from hpcclear.ranks.stopping import Exit

FILE = click.argument("file", type=PATH)
UNITS = click.option(
    "--unit",
    "units",
    multiple=True,
    metavar="UNIT",
    help='Unit of all quantities that it fits, such as kN. Repeatable. "SI" gives SI units. Default: those of the scene.',
)


@click.command(short_help="Write results as a table for Excel, MATLAB or pandas.")
@FILE
@directory_option("Table to write: its name ends in .csv, .xlsx, .mat or .parquet.")
@UNITS
@of_one_process
def export(file: Path, output: Path, units: tuple[str, ...]) -> int:
    """Write a result file as a table: one row per design or instant, joints as columns.

    Headings are names with units. Quantities have the units that the scene file uses, otherwise SI units.

    Example: hpcclear export results/samples.nc -o results/samples.xlsx
    """
    from hpcclear.report.export import check_format
    from hpcclear.report.export import export as export_file

    check_format(output)
    table = export_file(file, place_of(output), units)
    for name in table.attrs["left_out"]:
        say(f"Note: {name} is left out: it has too many columns. It stands in {file}")
    show(f"written  {output}: {len(table)} rows, {len(table.columns)} columns")
    return Exit.DONE


COMMANDS = (export,)

"""`identify`: unknowns with their intervals, the fit, growth, and what to measure."""

from pathlib import Path
from typing import Any

import click

from hpcclear.cli import options as cli
from hpcclear.ranks.stopping import Exit


@cli.command("compute", "Identify clearances from a measured signal.", ranks=True)
@cli.with_scene
@cli.output_option("NetCDF file to write.")
@click.option(
    "--unknown", multiple=True, required=True, metavar="PATH=LO:HI",
    help="Entry to identify and its bounds. Repeatable.",
)  # fmt: skip
@click.option(
    "--signal", multiple=True, type=cli.PATH,
    help="Measured table: time or crank angle, then signals. Repeatable, one for each date.",
)  # fmt: skip
@click.option(
    "--of", multiple=True, default=("crank_moment",), show_default=True, metavar="SIGNAL",
    help="Signal to use: a series of a response, frame_force_x, acceleration_x BODY.POINT, impacts JOINT. Repeatable.",
)  # fmt: skip
@click.option(
    "--date", multiple=True, metavar="YYYY-MM-DD", help="Date of each signal, in their order."
)
@click.option(
    "--limit",
    metavar="VALUE",
    help="Value of the unknowns; the time until it is reached is printed.",
)
@click.option("--band", metavar="LO:HI", help="Frequencies that the sensor passes, in Hz.")
@click.option(
    "--resonance", metavar="HZ[:Q]", help="Mounting resonance of the sensor and its quality factor."
)
@click.option(
    "--gain-error", type=cli.Amount(min=0.0), default=0.0, metavar="SHARE",
    help="Standard deviation of the sensor's calibration factor, relative.",
)  # fmt: skip
@click.option(
    "--angle-error", default="0 deg", metavar="ANGLE",
    help="Standard deviation of the crank-angle reference.",
)  # fmt: skip
@click.option(
    "--noise", type=cli.Amount(min=0.0, min_open=True), metavar="SHARE",
    help="Standard deviation of the sensor's noise, relative to the RMS of the signal. With it the scatter between "
         "revolutions is used too.",
)  # fmt: skip
@click.option(
    "--pressure", default="", metavar="COLUMN=AREA",
    help="Measured pressure on the slider as a known load: a column of the first table and the piston's area.",
)  # fmt: skip
@cli.flag("--advise", "Compare signals: half-widths to expect, by number of revolutions.")
@click.option(
    "--members", type=click.IntRange(min=32), metavar="N",
    help="Simulations, rounded up to a power of two. By default 256, doubled by each further unknown.",
)  # fmt: skip
@cli.with_how
def run(written: cli.Written, output: Path, how: cli.How, **settings: Any) -> int:
    """Identify unknown clearances from a measured signal, with calibrated intervals.

    Random inputs of the scene's study are unknown too, within their distributions. Exit code 4 if the model does not
    explain a signal; the file is written all the same.

    Example: mpiexec -n 2 hpcclear identify jobs/identify.toml --signal measured.csv
    --unknown joints.crank_rod.clearance=10um:150um -o results/identify.nc
    """

    with cli.on_ranks(how.time_limit) as ranks:
        scene = cli.read_scene(written)
        from hpcclear.cli.printing import describe_run
        from hpcclear.identify.answer import run_identify
        from hpcclear.identify.settings import Settings

        place, made = cli.place_of(output), Settings(**settings)
        found = run_identify(scene, place, ranks, made, how.options())
        describe_run(found, "identify")
        content = found.content
        explained = "explained" not in content or bool(content["explained"].values.all())
        return Exit.DONE if explained else Exit.TARGET_MISSED
    return Exit.DONE

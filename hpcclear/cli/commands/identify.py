"""`identify`: unknowns with their intervals, the fit, growth, and what to measure."""

from pathlib import Path
from typing import Any

import click

from hpcclear.cli import loaded, options as cli
from hpcclear.ranks.stopping import Exit


@cli.command("compute", "Identify clearances from a measured signal.", ranks=True)
@cli.with_scene
@cli.output_option("NetCDF file to write.")
@cli.option("--unknown PATH=LO:HI", "Entry to identify and its bounds. Repeatable.", required=True)
@cli.option(
    "--signal", "Measured table: time or crank angle, then signals. Repeatable, one for each date.",
    multiple=True, type=cli.PATH,
)  # fmt: skip
@cli.option(
    "--of SIGNAL", shown=("crank_moment",),
    words="Signal to use: a series of a response, frame_force_x, acceleration_x BODY.POINT, impacts JOINT. Repeatable.",
)  # fmt: skip
@cli.option("--date YYYY-MM-DD", "Date of each signal, in their order.", multiple=True)
@cli.option("--limit VALUE", "Value of the unknowns; the time until it is reached is printed.")
@cli.option("--band LO:HI", "Frequencies that the sensor passes, in Hz.")
@cli.option("--resonance HZ[:Q]", "Mounting resonance of the sensor and its quality factor.")
@cli.option(
    "--gain-error SHARE", "Standard deviation of the sensor's calibration factor, relative.",
    type=cli.Share(min=0.0), default=0.0,
)  # fmt: skip
@cli.option("--angle-error ANGLE", "Standard deviation of the angle reference.", default="0 deg")
@cli.option(
    "--noise SHARE", type=cli.Share(min=0.0, min_open=True),
    words="Standard deviation of the sensor's noise, relative to the RMS of the signal. With it the scatter between "
          "revolutions is used too.",
)  # fmt: skip
@cli.option(
    "--pressure COLUMN=AREA", default="",
    words="Measured pressure on the slider as a known load: a column of the first table and the piston's area.",
)  # fmt: skip
@cli.flag("--advise", "Compare signals: half-widths to expect, by number of revolutions.")
@cli.option(
    "--members N", "Simulations, rounded up to a power of two. By default 256, doubled by each further unknown.",
    type=click.IntRange(min=32),
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
        scene = loaded(written)
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

"""`wear`: service lives of joints that wear."""

from pathlib import Path

from hpcclear.cli import loaded, options as cli
from hpcclear.ranks.stopping import Exit


@cli.command("compute", "Simulate wear over the service life.", ranks=True)
@cli.with_scene
@cli.output_option("NetCDF file to write.")
@cli.with_how
def run(written: cli.Written, output: Path, how: cli.How) -> int:
    """Simulate wear over the service life, for many mechanisms with random inputs.

    Results are clearance, f and peak force against revolutions, and the survival curve with confidence intervals.

    Exit code 1 if every service life failed; the file is written all the same.

    Example: mpiexec -n 2 hpcclear wear jobs/wear.toml -o results/wear.nc --set wear.lives=8
    """

    with cli.on_ranks(how.time_limit) as ranks:
        scene = loaded(written)
        from hpcclear.cli.printing import describe_run
        from hpcclear.ensemble.wear import run_wear
        from hpcclear.report.screens.lives import followed

        found = run_wear(scene, cli.place_of(output), ranks, how.options())
        describe_run(found, "wear")
        if followed(found.content).any():
            return Exit.DONE
        cli.say("Error: every service life failed")
    return Exit.FAILED

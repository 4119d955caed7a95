"""`wear`: service lives of joints that wear."""

import sys
from pathlib import Path

from hpcclear.cli.options import (
    How,
    Written,
    command,
    on_ranks,
    output_option,
    place_of,
    remarked,
    with_how,
    with_scene,
)  # fmt: skip
from hpcclear.ranks.stopping import Exit


@command("compute", "Simulate wear over the service life.", ranks=True)
@with_scene
@output_option("NetCDF file to write.")
@with_how
def run(written: Written, output: Path, how: How) -> int:
    """Simulate wear over the service life, for many mechanisms with random inputs.

    Results are clearance, f and peak force against revolutions, and the survival curve with confidence intervals.

    Exit code 1 if every service life failed; the file is written all the same.

    Example: mpiexec -n 2 hpcclear wear jobs/wear.toml -o results/wear.nc --set wear.lives=8
    """

    with on_ranks(how.time_limit) as ranks:
        from hpcclear.cli.wear import describe
        from hpcclear.ensemble.wear import run_wear
        from hpcclear.scene import load_scene

        scene = remarked(load_scene(*written))
        sys.exit(describe(run_wear(scene, place_of(output), ranks, how.options())))
    return Exit.DONE

"""`check`: whether a scene is valid, what would be simulated, and how long a sample takes."""

import sys
from contextlib import nullcontext
from pathlib import Path

import click

from hpcclear.cli import options as cli
from hpcclear.ranks.launcher import is_launched
from hpcclear.ranks.stopping import Exit


@cli.command("start", "Validate an input file and estimate run time.", ranks=True)
@cli.with_scene
@click.option("--cost/--no-cost", default=True, help="Simulate one sample and report its run time.")
@cli.option(
    "--sketch FIGURE", "Draw the mechanism with names, axes and signs to this file (png, svg, pdf).",
    type=cli.PATH,
)  # fmt: skip
@cli.DETAILS
def run(written: cli.Written, cost: bool, sketch: Path | None) -> int:
    """Validate an input file and estimate run time.

    If the design in the file cannot turn, the exit code is 1 if the study varies its geometry, and 2 otherwise.
    Under mpiexec or srun the command also tests that all ranks connect: exit code 2 if the launcher belongs to another MPI.

    Example: hpcclear check jobs/slider_crank.toml --no-cost --sketch sketch.png
    """

    from hpcclear.ranks.boundary import alone

    here = cli.on_ranks(ahead=(), resumes=False) if is_launched() else nullcontext(alone())
    with here as ranks:
        from hpcclear.scene import load_scene

        scene = load_scene(*written)
        from hpcclear.cli import check  # not for a scene that is refused

        turns = check.describe_scene(scene, cost, ranks)
        if scene.study is not None and scene.study.variables:
            check.describe_corners(scene, cost)
        if sketch is not None:
            check.draw(scene, sketch)
        sys.exit(Exit.DONE if turns else Exit.FAILED)

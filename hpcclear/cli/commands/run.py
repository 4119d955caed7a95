"""`run`: a whole study."""

from pathlib import Path

from hpcclear.cli import loaded, options as cli
from hpcclear.ranks.terminal import Style


@cli.command("compute", "Run a complete study.", ranks=True)
@cli.with_scene
@cli.option("-o --output", "Directory for the results.", type=cli.PATH, required=True)
@cli.FRESH
@cli.LIMIT
@cli.PROGRESS
def run(
    written: cli.Written, output: Path, fresh: bool, time_limit: float | None, progress: Style
) -> None:
    """Run a complete study: sensitivity analysis, surrogates, robust optimisation, verification of the designs.

    Example: mpiexec -n 2 hpcclear run jobs/quickstart.toml -o results/quickstart
    """

    with cli.on_ranks(time_limit, cli.STUDYING) as ranks:
        scene = loaded(written)
        from hpcclear.cli.printing import describe
        from hpcclear.report.html.content import read
        from hpcclear.study import run_study

        place = run_study(
            scene, cli.place_of(output), ranks, fresh=fresh, progress_style=progress, notify=cli.say
        )
        describe(read(place), place / "verification.nc")

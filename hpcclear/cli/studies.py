"""Commands about a whole study: `run`, what its accuracy costs (`accuracy`), what it will take (`plan`)."""

from pathlib import Path
from typing import Any

import click

from hpcclear.cli.options import (
    FRESH,
    LIMIT,
    PROGRESS,
    STUDYING,
    Amount,
    Written,
    command,
    directory_option,
    flag,
    on_ranks,
    place_of,
    remarked,
    say,
    with_scene,
)
from hpcclear.ranks.stopping import Exit


@command(short_help="Run a complete study.")
@with_scene
@directory_option("Directory for the results.")
@FRESH
@LIMIT
@PROGRESS
def run(
    written: Written,
    output: Path,
    fresh: bool,
    time_limit: float | None,
    progress: Any,
) -> int:
    """Run a complete study: sensitivity analysis, surrogates, robust optimisation, verification of the designs.

    Example: mpiexec -n 2 hpcclear run jobs/quickstart.toml -o results/quickstart
    """

    with on_ranks(time_limit, STUDYING) as ranks:
        from hpcclear.cli.printing import describe_study
        from hpcclear.scene import load_scene
        from hpcclear.study import run_study

        place = run_study(
            remarked(load_scene(*written)),
            place_of(output),
            ranks,
            fresh=fresh,
            progress_style=progress,
            notify=lambda text: say(text),
        )
        describe_study(place)
    return Exit.DONE


@command(short_help="Plot accuracy against run time.")
@with_scene
@directory_option("Directory for accuracy.nc and the figures.")
@flag("--quick", "Measure with fewer points, in about a minute.")
@FRESH
@LIMIT
def accuracy(
    written: Written,
    output: Path,
    quick: bool,
    fresh: bool,
    time_limit: float | None,
) -> int:
    """Plot accuracy against run time, for each setting that costs time: tolerance, revolutions, points of the surrogate,
    Monte Carlo samples and number of ranks.

    Each figure is written as soon as its panel is measured. After a stop the same command resumes.

    Example: mpiexec -n 2 hpcclear accuracy jobs/slider_crank.toml -o results/accuracy --quick
    """

    with on_ranks(time_limit) as ranks:
        from hpcclear.accuracy.profile import PROFILES
        from hpcclear.accuracy.run import run_accuracy
        from hpcclear.cli.accuracy import describe
        from hpcclear.ensemble.session import Options
        from hpcclear.scene import load_scene

        def notify(text: str) -> None:
            say(f"accuracy: {text}")

        profile = PROFILES["quick" if quick else "full"]
        scene, place = remarked(load_scene(*written)), place_of(output)
        describe(*run_accuracy(scene, place, ranks, profile, notify, Options(fresh=fresh)))
    return Exit.DONE


@command(short_help="Estimate the cost of a run.")
@with_scene
@click.option(
    "--error",
    type=Amount(0.0, 0.5, min_open=True),
    metavar="RELATIVE",
    help="Target error of the objective, relative. By default the settings of the file are used.",
)
@click.option(
    "--ranks",
    "workers",
    type=click.IntRange(min=1),
    metavar="N",
    help="Number of ranks to plan for. By default those of this run.",
)
def plan(written: Written, error: float | None, workers: int | None) -> int:
    """Estimate core-hours and wall time of a run from a few measured samples.

    Example: hpcclear plan jobs/quickstart.toml --error 1e-3 --ranks 16
    """

    with on_ranks(resumes=False) as ranks:
        from hpcclear.accuracy.plan import ladder, measure
        from hpcclear.cli.plan import describe, preview
        from hpcclear.scene import load_scene

        planned = ranks.size if workers is None else workers
        scene = remarked(load_scene(*written))
        made = measure(
            scene, ranks, ladder(scene, error), planned, say,
            lambda plan: say(preview(plan, planned)), "auto",
        )  # fmt: skip
        describe(made, str(written.file), error, planned)
    return Exit.DONE

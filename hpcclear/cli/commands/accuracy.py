"""`accuracy`: what accuracy costs in time, measured in full, or estimated for the job of a run."""

from pathlib import Path

import click

from hpcclear.cli import loaded, options as cli


@cli.command("compute", "Plot accuracy against run time; plan the job of a run.", ranks=True)
@cli.with_scene
@cli.option("-o --output", "Directory for accuracy.nc and the figures.", type=cli.PATH)
@cli.flag("--quick", "Measure with fewer points, in about a minute.")
@cli.FRESH
@cli.LIMIT
@cli.flag("--plan", "Estimate core-hours and wall time of a run instead, with Slurm options.")
@cli.option(
    "--error RELATIVE",
    "With --plan, target error of the objective, relative. By default the settings of the file are used.",
    type=cli.Share(0.0, 0.5, min_open=True),
)
@cli.option(
    "--ranks N", "With --plan, number of ranks to plan for. By default those of this run.",
    name="workers", type=click.IntRange(min=1),
)  # fmt: skip
def run(
    written: cli.Written,
    output: Path | None,
    quick: bool,
    fresh: bool,
    time_limit: float | None,
    plan: bool,
    error: float | None,
    workers: int | None,
) -> None:
    """Plot accuracy against run time, for each setting that costs time: tolerance, revolutions, points of the surrogate,
    Monte Carlo samples and number of ranks.

    Each figure is written as soon as its panel is measured. After a stop the same command resumes.

    With --plan, estimate core-hours and wall time of a run from a few measured samples; no file is written.

    Example: mpiexec -n 2 hpcclear accuracy jobs/slider_crank.toml -o results/accuracy --quick

    Example: hpcclear accuracy jobs/quickstart.toml --plan --error 1e-3 --ranks 16
    """
    cli.check_mode("--plan", plan, ("output", "quick", "fresh", "time_limit"), ("error", "workers"))
    if plan:
        _plan(written, error, workers)
    elif output is None:
        raise click.UsageError("Missing option '-o' / '--output'.")
    else:
        _measure(written, output, quick, fresh, time_limit)


def _measure(
    written: cli.Written, output: Path, quick: bool, fresh: bool, time_limit: float | None
) -> None:
    with cli.on_ranks(time_limit) as ranks:
        scene = loaded(written)
        from hpcclear.accuracy.profile import QUICK, Profile
        from hpcclear.accuracy.run import run_accuracy
        from hpcclear.cli.printing import describe
        from hpcclear.ensemble.session import Options
        from hpcclear.ranks.terminal import announce
        from hpcclear.report.html.content import Content

        def notify(text: str) -> None:
            announce(f"accuracy: {text}")

        profile = QUICK if quick else Profile()
        place = cli.place_of(output)
        found, drawn = run_accuracy(scene, place, ranks, profile, notify, Options(fresh=fresh))
        describe(Content(place, {"accuracy": found}), *list(drawn.values())[:1])


def _plan(written: cli.Written, error: float | None, workers: int | None) -> None:
    with cli.on_ranks(resumes=False) as ranks:
        scene = loaded(written)
        from hpcclear.accuracy.plan import Plan, ladder, measure
        from hpcclear.cli.plan import describe, preview
        from hpcclear.ranks.terminal import announce

        planned = ranks.size if workers is None else workers

        def show(plan: Plan) -> None:
            (cli.say if plan.first else announce)(preview(plan))

        made = measure(scene, ranks, ladder(scene, error), planned, announce, show, "auto")
        describe(made, str(written.file), error)

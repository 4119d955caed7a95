"""The commands. Each parses its words, calls one function of the package, and prints what a person wants to know.

Exit codes: 0 done, 1 failed, 2 bad input, 3 stopped early (the same command goes on from there), 4 done, but f is not
known to the target error.
"""

import contextlib
import functools
import io
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hpcclear import __version__
from hpcclear.base.errors import InputError, StorageError, mendable
from hpcclear.ranks.launcher import is_launched, launched_rank, pin_threads
from hpcclear.ranks.stopping import Exit, StopSwitch

if TYPE_CHECKING:
    from hpcclear.ranks.team import Ranks
    from hpcclear.scene import Scene

_ROOT_ALONE = ("init", "check", "simulate", "merge", "report", "schema")
"""Commands for which no rank goes into MPI: the others have left when root begins."""

_FILE = click.argument("file", type=click.Path(path_type=Path))
_SET = click.option(
    "--set",
    "overrides",
    multiple=True,
    metavar="KEY.PATH=VALUE",
    help="Override an entry of the file; repeatable.",
)


def _output(words: str) -> Callable[[Any], Any]:
    """The option that names where results go."""
    return click.option(
        "-o", "--output", type=click.Path(path_type=Path), required=True, help=words
    )


_FRESH = click.option(
    "--fresh", is_flag=True, help="Start anew beside earlier results, never over them."
)
_LIMIT = click.option(
    "--time-limit",
    type=click.FloatRange(min=0.0, min_open=True),
    metavar="SECONDS",
    help="Stop early, resumable, after this time.",
)
_INTERVAL = click.option(
    "--checkpoint-interval",
    "interval",
    type=click.FloatRange(min=0.0),
    default=5.0,
    show_default=True,
    metavar="SECONDS",
    help="Save finished samples this often: what a crash costs at most.",
)
_POINTS = click.option(
    "--points",
    type=click.Path(path_type=Path),
    help="CSV table of designs instead of the study's sampling.",
)
_PROGRESS = click.option(
    "--progress",
    type=click.Choice(["auto", "bar", "log", "quiet"]),
    default="auto",
    show_default=True,
    help="How progress is shown.",
)


@dataclass(frozen=True)
class _How:
    """How a run is carried out: four options of a command, one argument of its function."""

    fresh: bool
    time_limit: float | None
    interval: float
    progress: Any


def _with_how(command: Callable[..., int]) -> Callable[..., int]:
    @_FRESH
    @_LIMIT
    @_INTERVAL
    @_PROGRESS
    @functools.wraps(command)
    def gathered(**values: Any) -> int:
        how = _How(**{field.name: values.pop(field.name) for field in fields(_How)})
        return command(how=how, **values)

    return gathered


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="hpcclear")
def cli() -> None:
    """Robust design of mechanisms with clearance joints.

    Scenes are TOML files; results are NetCDF files that open in xarray. Start sample, run, accuracy
    and plan under mpiexec to use more than one core:

        mpiexec -n 4 hpcclear sample jobs/quickstart.toml -o results/samples.nc
    """


def _scene(file: Path, overrides: tuple[str, ...], warn: bool = True) -> "Scene":
    """The scene; what looks like a slip of units is said, unless the caller says it."""
    from hpcclear.scene import load_scene
    from hpcclear.scene.plausibility import implausible

    scene = load_scene(file, overrides)
    for text in implausible(scene) if warn else ():
        _say(f"Warning: {text}")
    return scene


def _place(output: Path) -> Path:
    """The place for results, made if it lies below here or beside what is there; else a slip of the pen is likelier."""
    parent = output.parent
    if not output.is_absolute() or parent.parent.is_dir():
        with contextlib.suppress(OSError):  # said, with a remedy, by what writes there
            parent.mkdir(parents=True, exist_ok=True)
    return output


def _check_free(path: Path) -> None:
    """Raise InputError if something is there: what a user wrote is not written over."""
    if path.exists():
        raise InputError("file", str(path), "is there already", "Choose another name")


def _is_root() -> bool:
    return launched_rank() in (0, None)


def _on_ranks(program: "Callable[[Ranks], int | None]", time_limit: float | None = None) -> int:
    """Run a command that uses every rank."""
    from hpcclear.ranks.boundary import run_on_ranks

    stop: StopSwitch = click.get_current_context().obj
    if time_limit is not None:
        stop.limit_time(time_limit)
    return run_on_ranks(program, stop)


@cli.command(short_help="Write a starter scene.")
@click.argument("file", type=click.Path(path_type=Path))
def init(file: Path) -> int:
    """Write an engine to start from: every table, each number with its unit, and a small study.

    An existing file is never overwritten.

    Example: hpcclear init engine.toml
    """
    if not _is_root():
        return Exit.DONE
    from importlib import resources

    from hpcclear.results import files

    _check_free(file)
    files.probe(_place(file))
    text = resources.files(__package__).joinpath("starter.toml").read_text(encoding="utf-8")
    files.write_bytes(file, text.replace(" FILE", f" {file}").encode())
    click.echo(f"written  {file}\nnext     put your numbers in, then: hpcclear check {file}")
    return Exit.DONE


@cli.command(short_help="Say what a file would simulate, at what cost.")
@_FILE
@_SET
@click.option("--cost/--no-cost", default=True, help="Simulate one sample to measure its cost.")
@click.option(
    "--sketch",
    type=click.Path(path_type=Path),
    metavar="FIGURE",
    help="Draw the mechanism to this file (png, svg, pdf): names, axes, signs.",
)
def check(file: Path, overrides: tuple[str, ...], cost: bool, sketch: Path | None) -> int:
    """Validate a scene or study and say what would be simulated.

    Example: hpcclear check jobs/slider_crank.toml --no-cost --sketch sketch.png
    """
    if not _is_root():
        return Exit.DONE
    from hpcclear.cli.printing import describe_scene

    scene = _scene(file, overrides, warn=False)
    describe_scene(scene, cost)
    if sketch is not None:
        from hpcclear.report import save, sketch_figure

        poses = None
        if scene.is_planar:
            from hpcclear.dynamics.planar.problem import poses_at_start

            poses = poses_at_start(scene)
        click.echo(f"sketch   {save(sketch_figure(scene, poses), _place(sketch))}")
    return Exit.DONE


@cli.command(short_help="Simulate one response.")
@_FILE
@_SET
@_output("NetCDF file to write.")
def simulate(file: Path, overrides: tuple[str, ...], output: Path) -> int:
    """Simulate one response: time series, forces, energies, objective.

    Exit code 1 if the simulation did not reach its end, 4 if f is not known to numerics.target_error; what there is
    of it is written.

    Example: hpcclear simulate jobs/slider_crank.toml -o results/response.nc
    """
    if not _is_root():
        return Exit.DONE
    from hpcclear.base.outcome import Flag, Status
    from hpcclear.cli.printing import describe_response
    from hpcclear.dynamics.response import simulate as simulate_scene
    from hpcclear.dynamics.steady.telling import why_missed
    from hpcclear.results import dataset, files, netcdf

    scene = _scene(file, overrides)
    files.probe(_place(output), netcdf.SEAL)
    began = time.perf_counter()
    response = simulate_scene(scene)
    dataset.write(response, output)
    describe_response(response, output, time.perf_counter() - began)
    status = Status(int(response["status"]))
    if status.valid and int(response["flags"]) & Flag.TARGET_MISSED:
        click.echo(f"Target missed: {why_missed(response, scene.numerics.target_error)}", err=True)
        return Exit.TARGET_MISSED
    if status.valid:
        return Exit.DONE
    click.echo(f"Error: {status.name.lower()}: {status.message}. {status.remedy}", err=True)
    return Exit.FAILED


def _check_kind(
    points: Path | None, statistics: bool, raw: Path | None, part: str | None, fresh: bool
) -> None:
    """Raise InputError where options name two kinds of sampling at once."""
    if part is not None and (statistics or fresh):
        reason = "parts of samples are merged, under the names they were given"
        raise InputError("--part", part, reason, "Drop --statistics and --fresh")
    if statistics and points is not None:
        reason = "--statistics makes the study's Monte Carlo points on demand"
        raise InputError("--points", str(points), reason, "Drop one of the two")
    if raw is not None and not statistics:
        reason = "without --statistics the samples are what is written"
        raise InputError("--raw", str(raw), reason, "Drop it, or add --statistics")


@cli.command(short_help="Simulate many designs.")
@_FILE
@_SET
@_output("NetCDF file to write.")
@_POINTS
@click.option(
    "--statistics",
    is_flag=True,
    help="Keep mean, deviation and histogram of Monte Carlo samples, not the samples.",
)
@click.option(
    "--raw",
    type=click.Path(path_type=Path),
    help="With --statistics: directory for the samples themselves.",
)
@click.option(
    "--part",
    metavar="K/N",
    help="Only part K of N, into a file of its own beside the output: for job arrays; see merge.",
)
@_with_how
def sample(
    file: Path,
    overrides: tuple[str, ...],
    output: Path,
    points: Path | None,
    statistics: bool,
    raw: Path | None,
    part: str | None,
    how: _How,
) -> int:
    """Send the study's points, or a table of yours, through the dynamics.

    Example: mpiexec -n 2 hpcclear sample jobs/quickstart.toml -o results/samples.nc
    """

    def program(ranks: "Ranks") -> None:
        _check_kind(points, statistics, raw, part, how.fresh)
        from hpcclear.cli.printing import describe_samples, describe_statistics
        from hpcclear.ensemble.samples import run_sample
        from hpcclear.ensemble.session import Options
        from hpcclear.ensemble.split import Part
        from hpcclear.ensemble.statistics import run_statistics

        chosen = None if part is None else Part.parse(part)
        scene, place = _scene(file, overrides), _place(output)
        options = Options(how.fresh, how.interval, how.progress)
        if statistics:
            kept = None if raw is None else _place(raw)
            describe_statistics(run_statistics(scene, place, ranks, raw=kept, options=options))
        else:
            found = run_sample(scene, place, ranks, table=points, part=chosen, options=options)
            describe_samples(found)

    return _on_ranks(program, how.time_limit)


@cli.command(short_help="Put parts of a design together.")
@_FILE
@_SET
@_output("NetCDF file to write: the name that was given with each part.")
@_POINTS
def merge(file: Path, overrides: tuple[str, ...], output: Path, points: Path | None) -> int:
    """Write what sample --part 1/N to N/N made as one file: the bytes that a single run would have written.

    Scene, --set and --points are those of the parts, which stay; parts that are missing are named.

    Example: hpcclear merge jobs/quickstart.toml -o results/samples.nc
    """
    if not _is_root():
        return Exit.DONE
    from hpcclear.cli.printing import describe_samples
    from hpcclear.ensemble.samples import design
    from hpcclear.ensemble.split import run_merge
    from hpcclear.ranks.boundary import alone

    scene = _scene(file, overrides)
    describe_samples(run_merge(scene, design(scene, points), output, alone()))
    return Exit.DONE


@cli.command("map", short_help="Show where the motion does what.")
@_FILE
@_SET
@_output("NetCDF file to write.")
@click.option(
    "--x", "x", required=True, metavar="PATH=LO:HI:N", help="First entry, its limits, its cells."
)
@click.option("--y", "y", metavar="PATH=LO:HI:N", help="Second entry.")
@_with_how
def map_command(
    file: Path, overrides: tuple[str, ...], output: Path, x: str, y: str | None, how: _How
) -> int:
    """Judge the motion over a line or a grid of one or two entries of the scene: growth of a kick (largest Lyapunov
    exponent, per revolution), period, kinds of motion from several starts, f and its limit.

    Example: mpiexec -n 2 hpcclear map jobs/hunt_crossley.toml --x C=0.1mm:1mm:40 -o results/map.nc
    """

    def program(ranks: "Ranks") -> None:
        from hpcclear.cli.printing import describe_map
        from hpcclear.ensemble.maps import run_map
        from hpcclear.ensemble.session import Options

        axes = (x,) if y is None else (x, y)
        options = Options(how.fresh, how.interval, how.progress)
        describe_map(run_map(_scene(file, overrides), axes, _place(output), ranks, options))

    return _on_ranks(program, how.time_limit)


@cli.command(short_help="Follow lives of joints that wear.")
@_FILE
@_SET
@_output("NetCDF file to write.")
@_with_how
def wear(file: Path, overrides: tuple[str, ...], output: Path, how: _How) -> int:
    """Follow lives of a mechanism whose joints wear: clearance, f and peak force against revolutions, how long lives last and
    how sure that is.

    Exit code 1 if every life failed; what there is of them is written.

    Example: mpiexec -n 2 hpcclear wear jobs/wear.toml -o results/wear.nc --set wear.lives=8
    """

    def program(ranks: "Ranks") -> int:
        from hpcclear.cli.wear import describe
        from hpcclear.ensemble.session import Options
        from hpcclear.ensemble.wear import run_wear

        options = Options(how.fresh, how.interval, how.progress)
        return describe(run_wear(_scene(file, overrides), _place(output), ranks, options))

    return _on_ranks(program, how.time_limit)


@cli.command(short_help="Say which effects a scene can do without.")
@_FILE
@_SET
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="NetCDF file to write; by default NAME-effects.nc here.",
)
@click.option(
    "--tolerance",
    default="1%",
    show_default=True,
    metavar="CHANGE",
    help="Relative change of what the study asks that is allowed.",
)
@click.option(
    "--samples",
    type=click.IntRange(min=64),
    metavar="N",
    help="Samples of a variant at most; by default as many as a twentieth of the study allows.",
)
@click.option(
    "--forces",
    is_flag=True,
    help="Hold peak contact forces to the tolerance, too, not only tell them.",
)
@click.option(
    "--scene",
    "reduced",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Write the cheapest scene there, whole.",
)
@_with_how
def effects(
    file: Path,
    overrides: tuple[str, ...],
    output: Path | None,
    tolerance: str,
    samples: int | None,
    forces: bool,
    reduced: Path | None,
    how: _How,
) -> int:
    """Measure what each effect of a scene changes and costs (play in each joint, friction, gravity, loads, ...), and print
    the cheapest scene that stays within the tolerance.

    Example: mpiexec -n 2 hpcclear effects jobs/quickstart.toml --tolerance 2% -o results/effects.nc
    """

    def program(ranks: "Ranks") -> int:
        from hpcclear.cli.effects import describe, tolerance_of
        from hpcclear.ensemble.effects import run_effects
        from hpcclear.ensemble.session import Options
        from hpcclear.study.extent import certificate_samples

        allowed = tolerance_of(tolerance)
        scene = _scene(file, overrides)
        if reduced is not None:
            _check_free(reduced)
        found = run_effects(
            scene,
            _place(output or Path(f"{file.stem}-effects.nc")),
            ranks,
            Options(how.fresh, how.interval, how.progress),
            tolerance=allowed,
            samples=certificate_samples(scene) if samples is None else samples,
            forces=forces,
        )
        code = describe(found, scene, file)
        if reduced is not None:
            from hpcclear.results import files

            files.write_bytes(_place(reduced), found.content.attrs["reduced_scene"].encode())
        return code

    return _on_ranks(program, how.time_limit)


@cli.command(short_help="Carry a whole study.")
@_FILE
@_SET
@_output("Directory for the results.")
@_FRESH
@_LIMIT
@_PROGRESS
def run(
    file: Path,
    overrides: tuple[str, ...],
    output: Path,
    fresh: bool,
    time_limit: float | None,
    progress: Any,
) -> int:
    """Carry a whole study: sensitivity, surrogates, robust optimisation, verified designs.

    Example: mpiexec -n 2 hpcclear run jobs/quickstart.toml -o results/quickstart
    """

    def program(ranks: "Ranks") -> None:
        from hpcclear.cli.printing import describe_study
        from hpcclear.study import run_study

        place = run_study(
            _scene(file, overrides),
            _place(output),
            ranks,
            fresh=fresh,
            progress_style=progress,
            tell=lambda text: click.echo(text, err=True),
        )
        describe_study(place)

    return _on_ranks(program, time_limit)


@cli.command(short_help="Show what accuracy costs in time.")
@_FILE
@_SET
@_output("Directory for accuracy.nc and the figures.")
@click.option(
    "--quick", is_flag=True, help="A look in about a minute instead of the whole picture."
)
@_FRESH
@_LIMIT
def accuracy(
    file: Path,
    overrides: tuple[str, ...],
    output: Path,
    quick: bool,
    fresh: bool,
    time_limit: float | None,
) -> int:
    """Show what accuracy costs in time: tolerance and revolutions, integration, averaging, surrogates, Monte Carlo, ranks.

    Each figure is written when its panel is done, and what is done is kept: the same command goes on from there.

    Example: mpiexec -n 2 hpcclear accuracy jobs/slider_crank.toml -o results/accuracy --quick
    """

    def program(ranks: "Ranks") -> None:
        from hpcclear.accuracy.profile import PROFILES
        from hpcclear.accuracy.run import run_accuracy
        from hpcclear.cli.accuracy import describe
        from hpcclear.ensemble.session import Options

        def tell(text: str) -> None:
            click.echo(f"accuracy: {text}", err=True)

        profile = PROFILES["quick" if quick else "full"]
        scene, place = _scene(file, overrides), _place(output)
        describe(*run_accuracy(scene, place, ranks, profile, tell, Options(fresh=fresh)))

    return _on_ranks(program, time_limit)


@cli.command(short_help="Say what a run will cost.")
@_FILE
@_SET
@click.option(
    "--error",
    type=click.FloatRange(0.0, 0.5, min_open=True),
    metavar="RELATIVE",
    help="Error of the objective to plan for; by default the settings of the file.",
)
@click.option(
    "--ranks",
    "workers",
    type=click.IntRange(min=1),
    metavar="N",
    help="Ranks to plan for; by default those it runs on.",
)
def plan(file: Path, overrides: tuple[str, ...], error: float | None, workers: int | None) -> int:
    """Measure some samples and say what a run costs: settings, core-hours, ranks, wall time.

    Example: hpcclear plan jobs/quickstart.toml --error 1e-3 --ranks 16
    """

    def program(ranks: "Ranks") -> None:
        from hpcclear.accuracy.plan import ladder, measure
        from hpcclear.cli.plan import describe

        planned = ranks.size if workers is None else workers
        scene = _scene(file, overrides)
        made = measure(scene, ranks, ladder(scene, error), planned)
        describe(made, str(file), error, planned)

    return _on_ranks(program)


@cli.command(short_help="Write figures and an HTML page.")
@click.argument("directory", type=click.Path(path_type=Path))
def report(directory: Path) -> int:
    """Write figures and a self-contained HTML page about a directory of results.

    Example: hpcclear report results/quickstart
    """
    if not _is_root():
        return Exit.DONE
    from hpcclear.report.html.page import write_report

    click.echo(f"report  {write_report(directory)}")
    return Exit.DONE


@cli.command()
def schema() -> int:
    """Print the JSON schema of scene files, for editors.

    Example: hpcclear schema > hpcclear.schema.json
    """
    import json

    from hpcclear.scene import scene_schema

    click.echo(json.dumps(scene_schema(), indent=2))
    return Exit.DONE


def _check_words(words: Sequence[str]) -> None:
    """Raise UsageError where a word is no text: it would have to stand in result files, which hold text only."""
    for word in words:
        if not word.isascii() and word != word.encode("utf-8", "replace").decode():
            raise click.UsageError(f"{word!r} is no text in UTF-8. Choose another name")


def _refused(error: click.ClickException) -> int:
    """Say what is wrong with the words of a command; ranks that got other words do not wait for this one."""
    context = getattr(error, "ctx", None)
    if is_launched() and (context is None or context.command.name not in _ROOT_ALONE):
        from hpcclear.ranks.boundary import refuse_together

        text = io.StringIO()
        error.show(text)
        return refuse_together(text.getvalue().rstrip())
    if _is_root():
        error.show()
    return Exit.BAD_INPUT


def _say(text: str) -> None:
    """An error message, from root only."""
    if _is_root():
        click.echo(text, err=True)


def main(arguments: list[str] | None = None) -> None:
    """Entry point of both ``hpcclear`` and ``python -m hpcclear``; ends the process with the exit code."""
    pin_threads()  # before numpy is imported: ranks fill the cores, not threads
    with StopSwitch(ends_process=True) as stop:
        try:
            _check_words(sys.argv[1:] if arguments is None else arguments)
            code = cli.main(arguments, prog_name="hpcclear", standalone_mode=False, obj=stop)
        except click.ClickException as error:
            code = _refused(error)
        except (click.Abort, KeyboardInterrupt):
            code = Exit.STOPPED
        except InputError as error:
            _say(f"Error: {error}")
            code = Exit.BAD_INPUT
        except StorageError as error:
            _say(f"Error: {error}")
            code = Exit.FAILED
        except BrokenPipeError:  # the reader of a pipe has seen enough
            sys.stderr.close()
            code = Exit.DONE
        except (MemoryError, OSError, ImportError, SystemError) as error:
            known = mendable(error)
            if known is None:
                raise
            _say(f"Error: {known}")
            code = Exit.BAD_INPUT if isinstance(known, InputError) else Exit.FAILED
    sys.exit(int(code or 0))

"""Commands about one scene: `init`, `simulate`, `schema`, `check`; about results: `report`, `reproduce`, `crate`."""

import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hpcclear.cli.options import (
    PATH,
    Written,
    check_free,
    flag,
    of_one_process,
    on_ranks,
    output_option,
    place_of,
    say,
    show,
    with_scene,
)
from hpcclear.ranks.launcher import is_launched
from hpcclear.ranks.stopping import Exit

if TYPE_CHECKING:
    from hpcclear.ranks.team import Ranks
    from hpcclear.scene import Scene


@click.command(short_help="Write a starter scene.")
@click.argument("file", type=PATH)
@flag(
    "--four-stroke",
    "A gas force against two turns of the crank, in an engine written as a linkage.",
)
@of_one_process
def init(file: Path, four_stroke: bool) -> int:
    """Write an engine to start from: every table, each number with its unit, and a small study.

    An existing file is never overwritten.

    Example: hpcclear init engine.toml --four-stroke
    """
    from importlib import resources

    from hpcclear.results import files

    check_free(file)
    files.probe(place_of(file))
    name = "four_stroke.toml" if four_stroke else "starter.toml"
    text = resources.files(__package__).joinpath(name).read_text(encoding="utf-8")
    files.write_bytes(file, text.replace(" FILE", f" {file}").encode())
    show(f"written  {file}\nnext     put your numbers in, then: hpcclear check {file}")
    return Exit.DONE


@click.command(short_help="Say what a file would simulate, at what cost.")
@with_scene
@click.option("--cost/--no-cost", default=True, help="Simulate one sample to measure its cost.")
@click.option(
    "--sketch",
    type=PATH,
    metavar="FIGURE",
    help="Draw the mechanism to this file (png, svg, pdf): names, axes, signs.",
)
def check(written: Written, cost: bool, sketch: Path | None) -> int:
    """Validate a scene or study and say what would be simulated.

    Exit code 1 if the file's own design cannot turn while its study varies that, 2 if none can.
    Under mpiexec or srun all ranks meet in MPI first: a launcher that does not belong to the MPI library ends with exit code 2.

    Example: hpcclear check jobs/slider_crank.toml --no-cost --sketch sketch.png
    """

    def program(ranks: "Ranks") -> int:
        from hpcclear.cli.printing import describe_scene

        scene = written.scene(warn=False)
        turns = describe_scene(scene, cost, ranks)
        if scene.study is not None and scene.study.variables:
            from hpcclear.cli.corners import describe

            describe(scene, cost)
        if sketch is not None:
            _draw(scene, sketch)
        return Exit.DONE if turns else Exit.FAILED

    if is_launched():
        return on_ranks(program, ahead=(), resumes=False)
    from hpcclear.ranks.boundary import alone

    return program(alone())


def _draw(scene: "Scene", sketch: Path) -> None:
    """Draw the mechanism to a file and print where it is."""
    from hpcclear.dynamics.planar.problem import poses_at_start
    from hpcclear.report import save, sketch_figure

    poses = poses_at_start(scene, 0.0 if scene.template is None else scene.template.DRAWN_AT)
    show(f"sketch   {save(sketch_figure(scene, poses), place_of(sketch))}")


@click.command(short_help="Simulate one response.")
@with_scene
@output_option("NetCDF file to write.")
@of_one_process
def simulate(written: Written, output: Path) -> int:
    """Simulate one response: time series, forces, energies, objective.

    Exit code 1 if the simulation did not reach its end, 4 if f is not known to numerics.target_error; what there is
    of it is written.

    Example: hpcclear simulate jobs/slider_crank.toml -o results/response.nc
    """
    from hpcclear.base.outcome import Flag, Status
    from hpcclear.cli.printing import describe_response
    from hpcclear.dynamics.response import simulate as simulate_scene
    from hpcclear.dynamics.steady.telling import why_missed
    from hpcclear.ensemble.session import DEFAULT_OPTIONS, Place, Session
    from hpcclear.ranks.boundary import alone
    from hpcclear.results import dataset

    scene = written.scene()
    place = Place.of_response(place_of(output))
    with Session(place, {"command": "simulate"}, alone(), DEFAULT_OPTIONS):
        if output.exists():
            dataset.read(output, "response")  # an earlier response is replaced, and nothing else
        began = time.perf_counter()
        response = simulate_scene(scene)
        dataset.write(response, output)
    describe_response(response, output, time.perf_counter() - began)
    status = Status(int(response["status"]))
    if status.valid and int(response["flags"]) & Flag.TARGET_MISSED:
        say(f"Target missed: {why_missed(response, scene.numerics.target_error)}")
        return Exit.TARGET_MISSED
    if status.valid:
        return Exit.DONE
    said = response.attrs.get("ended", f"{status.name.lower()}: {status.message}")
    say(f"Error: {said}. {status.remedy}")
    return Exit.FAILED


@click.command(short_help="Write figures and an HTML page.")
@click.argument("directory", type=PATH)
@of_one_process
def report(directory: Path) -> int:
    """Write figures and a self-contained HTML page about a directory of results.

    Example: hpcclear report results/quickstart
    """
    from hpcclear.report.html.page import write_report

    show(f"report  {write_report(directory)}")
    return Exit.DONE


@click.command(short_help="Simulate again, and compare bit by bit.")
@click.argument("place", type=PATH)
@click.option(
    "--samples",
    type=click.IntRange(1),
    default=16,
    show_default=True,
    help="Samples of each file, spread over it.",
)
@of_one_process
def reproduce(place: Path, samples: int) -> int:
    """Simulate some of what result files hold again, from the scenes they carry, and compare to the last bit.

    PLACE is a file or a directory of results. Versions and processors that differ from those that made them are named. Exit
    code 1 if anything is different or cannot be read.

    Example: hpcclear reproduce results/quickstart
    """
    from hpcclear.ensemble.repeating import repeated

    found = list(repeated(place, samples))
    for one in found:
        said = "not the same: " + ", ".join(one.differing) if one.differing else "the same"
        show(f"{one.file}: {one.told}" + ("" if one.told.startswith("not") else f": {said}"))
    for text in dict.fromkeys(text for one in found for text in one.changed):
        show(f"made by another {text}")
    if not found:
        show("no samples and no responses: nothing was simulated again")
    return Exit.FAILED if any(one.differing or one.unread for one in found) else Exit.DONE


@click.command(short_help="Describe results for an archive.")
@click.argument("directory", type=PATH)
@of_one_process
def crate(directory: Path) -> int:
    """Write what a directory of results is, and what made it, as a Process Run Crate: DIRECTORY/ro-crate-metadata.json.

    A file that is damaged is left out and named; the exit code is 1 then.

    Example: hpcclear crate results/quickstart
    """
    from hpcclear.results.crate import write_crate

    left_out: list[str] = []
    show(f"crate  {write_crate(directory, left_out.append)}")
    for text in left_out:
        say(f"Error: {text}")
    return Exit.FAILED if left_out else Exit.DONE


@click.command()
def schema() -> int:
    """Print the JSON schema of scene files, for editors.

    Example: hpcclear schema > hpcclear.schema.json
    """
    import json

    from hpcclear.scene import scene_schema

    show(json.dumps(scene_schema(), indent=2))
    return Exit.DONE

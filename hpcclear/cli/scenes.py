"""Commands about one scene: `init`, `import`, `simulate`, `schema`, `check`; about results: `report`, `reproduce`, `crate`."""

import contextlib
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hpcclear.cli.options import (
    PATH,
    TRUST,
    Written,
    check_free,
    command,
    flag,
    of_one_process,
    on_ranks,
    output_option,
    place_of,
    remarked,
    say,
    show,
    with_scene,
)
from hpcclear.ranks.launcher import is_launched
from hpcclear.ranks.stopping import Exit

if TYPE_CHECKING:
    from hpcclear.scene import Scene


@click.command(short_help="Write a starter scene.")
@click.argument("file", type=PATH)
@flag(
    "--four-stroke",
    "A four-stroke engine, written as a linkage; its gas force repeats every two turns of the crank.",
)
@flag(
    "--compressor",
    "A piston compressor with fits by ISO 286, and a sample of machines as they are made.",
)
@flag("--jobs", "All example scenes and Slurm scripts, in a new directory of this name.")
@of_one_process
def init(file: Path, four_stroke: bool, compressor: bool, jobs: bool) -> int:
    """Write a starter scene: an engine with every table, a unit on each number, and a small study.

    With --jobs, write the scenes and scripts that the documentation names, as a directory. Nothing is overwritten.

    Example: hpcclear init engine.toml --four-stroke
    """
    from importlib import resources

    from hpcclear.results import files

    check_free(file)
    if jobs:
        _copy_jobs(file)
        return Exit.DONE
    files.probe(place_of(file))
    name = (
        "four_stroke.toml" if four_stroke else "compressor.toml" if compressor else "starter.toml"
    )
    text = resources.files(__package__).joinpath(name).read_text(encoding="utf-8")
    files.write_bytes(file, text.replace(" FILE", f" {file}").encode())
    show(f"written  {file}\nnext     put your numbers in, then: hpcclear check {file}")
    return Exit.DONE


def _copy_jobs(place: Path) -> None:
    """Write the example scenes and the scripts that need no clone to a new directory."""
    from importlib import resources

    from hpcclear.results import files

    with resources.as_file(resources.files(__package__).joinpath("jobs")) as source:
        kinds = ("*.toml", "linkages/*.toml", "machines/*.toml", "*.slurm", "until_done.sh")
        found = sorted(path for kind in kinds for path in source.glob(kind))
        for path in found:
            target = place / path.relative_to(source)
            target.parent.mkdir(parents=True, exist_ok=True)
            files.write_bytes(target, path.read_bytes())
    show(
        f"written  {len(found)} files in {place}\nnext     hpcclear check {place / 'quickstart.toml'}"
    )


@click.command("import", short_help="Write a linkage from a table of points or a drawing.")
@click.argument("source", type=PATH)
@click.argument("file", type=PATH)
@click.option(
    "--unit",
    default="",
    metavar="UNIT",
    help="Of lengths, where the source states none, such as mm. It overrides the unit of a DXF drawing, which is noted.",
)
@click.option(
    "--sketch",
    type=PATH,
    metavar="FIGURE",
    help="Draw the linkage with names, axes and signs to this file (png, svg, pdf).",
)
@of_one_process
def import_(source: Path, file: Path, unit: str, sketch: Path | None) -> int:
    """Write a linkage from a table of points, a DXF drawing, a PMKS+ project or a Linkage document.

    A table (CSV, Excel) has the columns name, x [mm], y [mm] and bodies; points that bodies share are pins, "ground"
    stands still. Without bodies the points are a chain of bars between the first and the last. In a DXF drawing a
    layer is a body. FILE is the scene to write; masses in it are placeholders. An existing file is never overwritten.

    Example: hpcclear import points.csv linkage.toml --sketch linkage.png
    """
    from hpcclear.results import files
    from hpcclear.scene import importers, load_scene

    check_free(file)
    drawing = importers.drawing_of(source, unit)
    content = importers.scene_of(drawing, str(source))
    scene = load_scene(content)
    mechanism = content["mechanism"]
    files.write_bytes(file, importers.text_of(content, source.name, drawing.notes).encode())
    show(f"written  {file}: {len(mechanism['bodies'])} bodies, {len(mechanism['joints'])} joints")
    for label, text in importers.summary(content, drawing):
        show(f"{label:8} {text}")
    if sketch is not None:
        _draw(scene, sketch)
    show(f"next     put masses and the speed in, then: hpcclear check {file}")
    return Exit.DONE


@command(short_help="Validate an input file and estimate run time.")
@with_scene
@click.option("--cost/--no-cost", default=True, help="Simulate one sample and report its run time.")
@click.option(
    "--sketch",
    type=PATH,
    metavar="FIGURE",
    help="Draw the mechanism with names, axes and signs to this file (png, svg, pdf).",
)
def check(written: Written, cost: bool, sketch: Path | None) -> int:
    """Validate an input file and estimate run time.

    If the design in the file cannot turn, the exit code is 1 if the study varies its geometry, and 2 otherwise.
    Under mpiexec or srun the command also tests that all ranks connect: exit code 2 if the launcher belongs to another MPI.

    Example: hpcclear check jobs/slider_crank.toml --no-cost --sketch sketch.png
    """

    from hpcclear.ranks.boundary import alone

    launched = is_launched()
    with (
        on_ranks(ahead=(), resumes=False) if launched else contextlib.nullcontext(alone()) as ranks
    ):
        from hpcclear.cli.check import describe_scene
        from hpcclear.scene import load_scene

        scene = load_scene(*written)
        turns = describe_scene(scene, cost, ranks)
        if scene.study is not None and scene.study.variables:
            from hpcclear.cli.corners import describe

            describe(scene, cost)
        if sketch is not None:
            _draw(scene, sketch)
        sys.exit(Exit.DONE if turns else Exit.FAILED)


def _draw(scene: "Scene", sketch: Path) -> None:
    """Draw the mechanism to a file and print where it is."""
    from hpcclear.dynamics.planar.problem import poses_at_start
    from hpcclear.report import save, sketch_figure

    poses = poses_at_start(scene, 0.0 if scene.template is None else scene.template.DRAWN_AT)
    show(f"sketch   {save(sketch_figure(scene, poses), place_of(sketch))}")


@command(short_help="Simulate one design.")
@with_scene
@output_option("NetCDF file to write.")
@click.option(
    "--keep",
    type=click.IntRange(1),
    metavar="N",
    help="Store the time series of the last N revolutions only.",
)
@of_one_process
def simulate(written: Written, output: Path, keep: int | None) -> int:
    """Simulate one design: objective, and time series of bearing forces, torque, motion and energies.

    Exit code 1 if the simulation failed, 4 if f was not as accurate as numerics.target_error. The file is written all the same.

    Example: hpcclear simulate jobs/slider_crank.toml -o results/response.nc
    """
    from hpcclear.base.outcome import Flag, Status
    from hpcclear.cli.response import describe_response
    from hpcclear.dynamics import sizing
    from hpcclear.dynamics.evaluation.steady.wording import why_missed
    from hpcclear.dynamics.response import simulated
    from hpcclear.ensemble.session import DEFAULT_OPTIONS, Place, Session
    from hpcclear.ranks.boundary import alone
    from hpcclear.results import dataset
    from hpcclear.scene import load_scene

    if keep is not None:
        written = written._replace(
            overrides=(*written.overrides, f"output.keep_revolutions={keep}")
        )
    scene = remarked(load_scene(*written))
    if sizing.stored_bytes(scene) > sizing.LARGE:
        say(f"Time series: {sizing.words(scene)}. Shorter with --keep N")
    place = Place.of_response(place_of(output))
    with Session(place, {"command": "simulate"}, alone(), DEFAULT_OPTIONS):
        if output.exists():
            dataset.read(output, "response")  # an earlier response is replaced, and nothing else
        began = time.perf_counter()
        response = simulated(scene)
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
@click.argument("places", type=PATH, nargs=-1, required=True, metavar="DIRECTORY | FILE...")
@click.option(
    "-o", "--output", type=PATH, help="Page to write. Default: report.html beside the results."
)
@TRUST
@of_one_process
def report(places: tuple[Path, ...], output: Path | None, trust: bool) -> int:
    """Write figures and a self-contained HTML page from a directory of results, or from chosen files.

    Example: hpcclear report results/quickstart
    """
    from hpcclear.plugins import trusting
    from hpcclear.report.html.page import write_report

    with trusting(trust):
        show(f"report  {write_report(*places, output=output and place_of(output))}")
    return Exit.DONE


@click.command(short_help="Repeat simulations and compare bit by bit.")
@click.argument("place", type=PATH)
@click.option(
    "--samples",
    type=click.IntRange(1),
    default=16,
    show_default=True,
    help="Number of samples to repeat of each file.",
)
@TRUST
@of_one_process
def reproduce(place: Path, samples: int, trust: bool) -> int:
    """Repeat some simulations of a result from the scene in its file, and compare bit by bit.

    PLACE is a result file or a directory of results. Versions and processors that differ from those of the result are listed.
    Exit code 1 if anything differs or cannot be read.

    Example: hpcclear reproduce results/quickstart
    """
    from hpcclear.ensemble.repeating import repeated
    from hpcclear.plugins import trusting

    with trusting(trust):
        found = list(repeated(place, samples))
    for one in found:
        said = "not the same: " + ", ".join(one.differing) if one.differing else "the same"
        show(f"{one.file}: {one.extent}" + ("" if one.extent.startswith("not") else f": {said}"))
    for text in dict.fromkeys(text for one in found for text in one.changed):
        show(f"made by another {text}")
    if not found:
        show("no samples and no responses: nothing was simulated again")
    return Exit.FAILED if any(one.differing or one.unread for one in found) else Exit.DONE


@click.command(short_help="Describe results for an archive.")
@click.argument("directory", type=PATH)
@of_one_process
def crate(directory: Path) -> int:
    """Write a description of the results and their origin for an archive: a Process Run Crate.

    The file is DIRECTORY/ro-crate-metadata.json. Damaged result files are left out and listed, with exit code 1.

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

"""`init`: the first scene: a starter, all examples, or a linkage from a table of points or a drawing."""

import shutil
from pathlib import Path

import click

from hpcclear.cli import options as cli


@cli.command("start", "Write a starter scene, or a linkage from points or a drawing.")
@click.argument("source", type=cli.PATH, nargs=-1, metavar="[SOURCE]")
@click.argument("file", type=cli.PATH)
@cli.flag(
    "--four-stroke",
    "A four-stroke engine, written as a linkage; its gas force repeats every two turns of the crank.",
)
@cli.flag(
    "--compressor", "A piston compressor with fits by ISO 286, and a sample of machines as they are made."
)  # fmt: skip
@cli.flag("--jobs", "All example scenes and Slurm scripts, in a new directory of this name.")
@cli.option(
    "--import", "A linkage from SOURCE: a table of points, a drawing, or a file of another program.",
    name="imports", is_flag=True,
)  # fmt: skip
@cli.option(
    "--unit UNIT", default="",
    words="Of lengths, where the source states none, such as mm. It overrides the unit of a DXF drawing, which is noted.",
)  # fmt: skip
@cli.option(
    "--sketch FIGURE", "Draw the imported linkage with names, axes and signs to this file (png, svg, pdf).",
    type=cli.PATH,
)  # fmt: skip
def run(
    source: tuple[Path, ...],
    file: Path,
    four_stroke: bool,
    compressor: bool,
    jobs: bool,
    imports: bool,
    unit: str,
    sketch: Path | None,
) -> None:
    """Write a starter scene: an engine with every table, a unit on each number, and a small study.

    With --jobs, write the scenes and scripts that the documentation names, as a directory.

    With --import, write a linkage from a table of points, a DXF drawing, a PMKS+ project or a Linkage document.
    A table (CSV, Excel) has the columns name, x [mm], y [mm] and bodies; points that bodies share are pins, "ground"
    stands still. Without bodies the points are a chain of bars between the first and the last. In a DXF drawing a
    layer is a body. Masses in the scene are placeholders.

    FILE is the scene to write. Nothing is overwritten.

    Example: hpcclear init engine.toml --four-stroke

    Example: hpcclear init --import points.csv linkage.toml --sketch linkage.png
    """
    cli.check_mode("--import", imports, ("four_stroke", "compressor", "jobs"), ("unit", "sketch"))
    cli.check_mode("--jobs", jobs, ("four_stroke", "compressor"))
    cli.check_mode("--compressor", compressor, ("four_stroke",))
    if imports and not source:
        raise click.UsageError("Missing argument 'SOURCE'.")
    if len(source) > imports:
        extra = " ".join(map(str, source[imports:]))
        raise click.UsageError(f"Got unexpected extra argument ({extra})")
    cli.check_free(file)
    if imports:
        _import(source[0], file, unit, sketch)
    elif jobs:
        _copy_jobs(file)
    else:
        name = "four_stroke" if four_stroke else "compressor" if compressor else "starter"
        _write_starter(file, name)


def _write_starter(file: Path, name: str) -> None:
    from importlib import resources

    from hpcclear.results import files

    files.probe(cli.place_of(file))
    text = resources.files("hpcclear.cli").joinpath(f"{name}.toml").read_text(encoding="utf-8")
    files.write_bytes(file, text.replace(" FILE", f" {file}").encode())
    cli.show(f"written  {file}\nnext     put your numbers in, then: hpcclear check {file}")


def _copy_jobs(place: Path) -> None:
    """Write the example scenes and the scripts that need no clone to a new directory."""
    from importlib import resources

    from hpcclear.results import files

    with resources.as_file(resources.files("hpcclear.cli").joinpath("jobs")) as source:
        kinds = ("*.toml", "linkages/*.toml", "machines/*.toml", "*.slurm", "until_done.sh")
        found = sorted(path for kind in kinds for path in source.glob(kind))
        try:
            for path in found:
                target = cli.place_of(place / path.relative_to(source))
                files.write_bytes(target, path.read_bytes())
        except BaseException:  # a part of them would stand in the way of the next attempt
            shutil.rmtree(place, ignore_errors=True)
            raise
    cli.show(f"written  {len(found)} files in {place}")
    cli.show(f"next     hpcclear check {place / 'quickstart.toml'}")


def _import(source: Path, file: Path, unit: str, sketch: Path | None) -> None:
    from hpcclear.cli.check import draw
    from hpcclear.results import files
    from hpcclear.scene import importers, load_scene

    drawing = importers.drawing_of(source, unit)
    content = importers.scene_of(drawing, str(source))
    scene = load_scene(content)
    mechanism = content["mechanism"]
    text = importers.text_of(content, source.name, drawing.notes)
    files.write_bytes(cli.place_of(file), text.encode())
    cli.show(
        f"written  {file}: {len(mechanism['bodies'])} bodies, {len(mechanism['joints'])} joints"
    )
    for label, text in importers.summary(content, drawing):
        cli.show(f"{label:8} {text}")
    if sketch is not None:
        draw(scene, sketch)
    cli.show(f"next     put masses and the speed in, then: hpcclear check {file}")

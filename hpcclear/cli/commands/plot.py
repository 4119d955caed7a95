"""`plot`: figures and films of results."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from hpcclear.base.errors import InputError, nearest
from hpcclear.cli import options as cli

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hpcclear.report.html.content import Content

One = TypeVar("One")
KINDS = ("png", "svg", "pdf")


@cli.command("look", "Draw figures and films of results.")
@click.argument("places", nargs=-1, required=True, metavar="PLACE...", type=cli.PATH)
@cli.option(
    "--figure NAME", "Figure to draw. Repeatable. Default: all. Without -o the names are listed.",
    name="names",
)  # fmt: skip
@cli.option("-o --output", "File of one figure (png, svg, pdf), or a directory.", type=cli.PATH)
@cli.option(
    "--format", "Format of figures in a directory.", "png",
    type=click.Choice(KINDS), name="kind",
)  # fmt: skip
@cli.option(
    "--design NAME", "Design of which responses are drawn. Repeatable. Default: all, beside each other.",
    name="designs",
)  # fmt: skip
@cli.option("--size LENGTH", "Width, 85mm, or both sides, '85mm x 60mm'.", default="")
@cli.option("--font NAME", "Installed font of words and formulas.", default="")
@cli.option(
    "--label NAME=TEXT", name="texts",
    words="Words for an axis, by its entry of the scene, variable or former words. Repeatable. The unit stays.",
)  # fmt: skip
@cli.option("--style FILE", "Style sheet of matplotlib (.mplstyle).", name="sheet", type=cli.PATH)
@cli.option("--theme", "Colours of page and curves.", "light", type=click.Choice(["light", "dark"]))
@cli.option("--animation FILE", "Film of the motion: .gif, or .mp4 with ffmpeg.", type=cli.PATH)
@cli.option("--seconds", "Length of the film.", 6.0)
@cli.option(
    "--revolutions", "Revolutions in the film, the last ones of the response.", 2,
    type=click.IntRange(min=1),
)  # fmt: skip
@cli.TRUST
def run(
    places: tuple[Path, ...],
    names: tuple[str, ...],
    output: Path | None,
    kind: str,
    designs: tuple[str, ...],
    texts: tuple[str, ...],
    animation: Path | None,
    seconds: float,
    revolutions: int,
    trust: bool,
    **look: Any,
) -> None:
    """Draw figures of result files or of a directory of results, and films of the motion. Figures of responses show several
    designs: those of a directory, or of several files.

    Example: hpcclear plot results/response.nc --figure orbit --size 85mm -o orbit.pdf
    """
    from hpcclear.plugins import trusting
    from hpcclear.report import save
    from hpcclear.report.figures.catalogue import drawings
    from hpcclear.report.figures.labels import in_units_of
    from hpcclear.report.figures.printing import printing
    from hpcclear.report.html.content import read

    cli.check_mode("--animation", animation is not None, its_own=("seconds", "revolutions"))
    cli.check_mode("--output", output is not None, its_own=("kind", "texts", "names", *look))
    content = read(*places)
    for text in content.troubles:
        cli.say(f"Warning: {text}")
    for name in designs:
        _known("--design", name, content.responses)
    responses = {n: one for n, one in content.responses.items() if n in designs or not designs}
    if animation is not None:
        _film(content, animation, seconds, revolutions)
    with trusting(trust), in_units_of(content.attribute("scene")):
        every = drawings(content.files, responses)
        chosen = {name: _known("--figure", name, every) for name in names} or every
        if output is None:
            if animation is None:
                cli.show(f"figures of {', '.join(map(str, places))}: {', '.join(every)}")
            return
        single = _is_single(output, len(chosen), kind)
        with printing(texts=dict(map(_label, texts)), **look):
            drawn = _drawn(chosen, bool(names))
        if not single:
            output.mkdir(parents=True, exist_ok=True)
        for name, figure in drawn.items():
            place = cli.place_of(output) if single else output / f"{name}.{kind}"
            cli.show(f"figure   {save(figure, place)}")


def _film(content: "Content", place: Path, seconds: float, revolutions: int) -> None:
    from hpcclear.report.figures.animation import animate

    if content.response is None:
        reason = "it holds no response, so there is no motion to show"
        raise InputError("file", str(content.directory), reason, "Make one with hpcclear simulate")
    cli.show(f"film     {animate(content.response, cli.place_of(place), seconds, revolutions)}")


def _known(option: str, name: str, every: Mapping[str, One]) -> One:
    """What stands under a name; raises InputError of the option where nothing does."""
    if name not in every:
        reason = f"these results have no such {option.removeprefix('--')}"
        raise InputError(option, name, reason, nearest(name, list(every)))
    return every[name]


def _label(text: str) -> tuple[str, str]:
    name, sign, words = text.partition("=")
    if not (name.strip() and sign and words.strip()):
        raise InputError("--label", text, "it names no words", 'Write NAME="words"')
    return name.strip(), words.strip()


def _drawn(figures: "Mapping[str, Callable[[], Figure]]", chosen: bool) -> "dict[str, Figure]":
    """The figures; of all that there may be, those that need more are named."""
    drawn = {}
    for name, draw in figures.items():
        try:
            drawn[name] = draw()
        except InputError as error:
            if chosen or error.key in ("figure", "matplotlib"):
                raise
            cli.say(f"Note: no {name}: {error.reason}. {error.remedy}")
    return drawn


def _is_single(output: Path, figures: int, kind: str) -> bool:
    """Whether an output is the file of one figure, not a directory; raises InputError where its name contradicts others."""
    ending = output.suffix.lower().removeprefix(".")
    if ending in KINDS and figures > 1 and not output.is_dir():
        reason = f"is the name of one figure, and there are {figures}"
        raise InputError("--output", str(output), reason, "Name a directory, or one --figure")
    if figures == 1 and ending and cli.is_given("kind") and ending != kind:
        raise InputError("--format", kind, f"{output} is of another format", "Drop --format")
    return figures == 1 and bool(ending)

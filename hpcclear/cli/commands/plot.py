"""`plot`: figures and films of results."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import click

from hpcclear.base.errors import InputError, nearest
from hpcclear.cli import options as cli
from hpcclear.ranks.stopping import Exit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hpcclear.report.html.content import Content

    Drawings = Mapping[str, Callable[[], Figure]]

One = TypeVar("One")


@cli.command("look", "Draw figures and films of results.")
@click.argument("places", nargs=-1, required=True, metavar="PLACE...", type=cli.PATH)
@click.option(
    "--figure",
    "names",
    multiple=True,
    metavar="NAME",
    help="Figure to draw. Repeatable. Default: all. Without -o the names are listed.",
)
@click.option(
    "-o",
    "--output",
    type=cli.PATH,
    help="File for one figure (png, svg, pdf), otherwise a directory.",
)
@click.option(
    "--format",
    "kind",
    type=click.Choice(["png", "svg", "pdf"]),
    default="png",
    show_default=True,
    help="Format of figures in a directory.",
)
@click.option(
    "--design",
    "designs",
    multiple=True,
    metavar="NAME",
    help="Design of which responses are drawn. Repeatable. Default: all, beside each other.",
)
@click.option(
    "--size", default="", metavar="LENGTH", help="Width, 85mm, or both sides, '85mm x 60mm'."
)
@click.option("--font", default="", metavar="NAME", help="Installed font of words and formulas.")
@click.option(
    "--label",
    "texts",
    multiple=True,
    metavar="NAME=TEXT",
    help="Words for an axis, by its entry of the scene, variable or former words. Repeatable. The unit stays.",
)
@click.option(
    "--style", "sheet", type=cli.PATH, metavar="FILE", help="Style sheet of matplotlib (.mplstyle)."
)
@click.option(
    "--theme",
    type=click.Choice(["light", "dark"]),
    default="light",
    show_default=True,
    help="Colours of page and curves.",
)
@click.option(
    "--animation",
    type=cli.PATH,
    metavar="FILE",
    help="Film of the motion: .gif, or .mp4 with ffmpeg.",
)
@click.option(
    "--seconds",
    type=cli.Amount(min=0.0),
    default=6.0,
    show_default=True,
    help="Length of the film.",
)
@click.option(
    "--revolutions",
    type=click.IntRange(min=1),
    default=2,
    show_default=True,
    help="Revolutions in the film, the last ones of the response.",
)
@cli.TRUST
def run(
    places: tuple[Path, ...],
    names: tuple[str, ...],
    output: Path | None,
    kind: str,
    designs: tuple[str, ...],
    size: str,
    font: str,
    texts: tuple[str, ...],
    sheet: Path | None,
    theme: str,
    animation: Path | None,
    seconds: float,
    revolutions: int,
    trust: bool,
) -> int:
    """Draw figures of result files or of a directory of results, and films of the motion. Figures of responses show several
    designs: those of a directory, or of several files.

    Example: hpcclear plot results/response.nc --figure orbit --size 85mm -o orbit.pdf
    """
    from hpcclear.plugins import trusting
    from hpcclear.report.figures.catalogue import drawings
    from hpcclear.report.figures.labels import in_units_of
    from hpcclear.report.figures.printing import printing
    from hpcclear.report.html.content import read

    content = read(*places)
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
            return Exit.DONE
        with printing(size, font, sheet, theme, dict(map(_label, texts))):
            drawn = _drawn(chosen, bool(names))
        _save(drawn, output, kind)
    return Exit.DONE


def _film(content: "Content", place: Path, seconds: float, revolutions: int) -> None:
    """A film of the first response."""
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
    """Name and words of a label."""
    name, sign, words = text.partition("=")
    if not (name.strip() and sign and words.strip()):
        raise InputError("--label", text, "it names no words", 'Write NAME="words"')
    return name.strip(), words.strip()


def _drawn(figures: "Drawings", chosen: bool) -> "dict[str, Figure]":
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


def _save(figures: "Mapping[str, Figure]", output: Path, kind: str) -> None:
    """Write one figure to a file, or each to a file of a directory."""
    from hpcclear.report import save

    single = len(figures) == 1 and output.suffix != ""
    if not single:
        output.mkdir(parents=True, exist_ok=True)
    for name, figure in figures.items():
        place = cli.place_of(output) if single else output / f"{name}.{kind}"
        cli.show(f"figure   {save(figure, place)}")

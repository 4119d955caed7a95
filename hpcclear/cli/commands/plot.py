"""`plot`: figures and films of results."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hpcclear.base.errors import InputError, nearest
from hpcclear.cli import options as cli
from hpcclear.ranks.stopping import Exit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hpcclear.report.html.content import Content
    from hpcclear.results.content import Results


@cli.command("look", "Draw figures and films of results.")
@click.argument("place", type=cli.PATH)
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
    place: Path,
    names: tuple[str, ...],
    output: Path | None,
    kind: str,
    animation: Path | None,
    seconds: float,
    revolutions: int,
    trust: bool,
) -> int:
    """Draw figures of a result file or of a directory of results, and films of the motion.

    Example: hpcclear plot results/response.nc --figure orbit -o orbit.pdf
    """
    from hpcclear.plugins import trusting
    from hpcclear.report.figures.animation import animate
    from hpcclear.report.figures.catalogue import drawings
    from hpcclear.report.html.content import read

    content = read(place)
    if animation is not None:
        cli.show(
            f"film     {animate(_moving(content, place), cli.place_of(animation), seconds, revolutions)}"
        )
    with trusting(trust):
        every = drawings(content.files, content.responses)
        if output is not None:
            _draw({name: known(name, every) for name in names} or every, output, kind, bool(names))
        elif animation is None:
            cli.show(f"figures of {place}: {', '.join(every)}")
    return Exit.DONE


def _moving(content: "Content", place: Path) -> "Results":
    """The response that a film shows."""
    if content.response is None:
        reason = "it holds no response, so there is no motion to show"
        raise InputError("file", str(place), reason, "Make one with hpcclear simulate")
    return content.response


def known(name: str, every: "Mapping[str, Callable[[], Figure]]") -> "Callable[[], Figure]":
    """What draws the figure of a name; raises InputError where the results do not allow it."""
    if name not in every:
        raise InputError(
            "--figure", name, "these results have no such figure", nearest(name, list(every))
        )
    return every[name]


def _draw(
    figures: "Mapping[str, Callable[[], Figure]]", output: Path, kind: str, chosen: bool
) -> None:
    """Draw to a file, or each to a file of a directory; of all figures, those that need more are named."""
    from hpcclear.report import save

    single = len(figures) == 1 and output.suffix != ""
    if not single:
        output.mkdir(parents=True, exist_ok=True)
    for name, draw in figures.items():
        try:
            cli.show(
                f"figure   {save(draw(), cli.place_of(output) if single else output / f'{name}.{kind}')}"
            )
        except InputError as error:
            if chosen or error.key in ("figure", "matplotlib", "output"):
                raise
            cli.say(f"Note: no {name}: {error.reason}. {error.remedy}")

"""Every figure that a directory of results allows, with its caption."""

import base64
import functools
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.base.objectives import ENDS
from hpcclear.report.figures import catalogue, designs, labels, motion, response, style
from hpcclear.report.html.content import Content
from hpcclear.report.html.guard import attempt
from hpcclear.report.parts import FigureOf, SectionOf, declared
from hpcclear.results.content import Results

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def figures(content: Content, troubles: list[str]) -> list[dict[str, str]] | None:
    """All figures: their pictures (PNG, base64) and captions; in `troubles`, why one was left out."""
    made = [attempt(f"The figure “{what}”", draw, troubles) for what, draw in _drawings(content)]
    return [figure for figure in made if figure is not None] or None


Maker = Callable[[], dict[str, str] | None]


def _drawings(content: Content) -> Iterator[tuple[str, Maker]]:
    """Every figure that there may be: what it shows, and what makes its picture and caption."""
    for one in declared(FigureOf):
        if one.kind in content.files and not one.apart:
            about = one.captioned(content.files)
            yield about, functools.partial(_tried, one.of(content.files), about)
    found = content.responses
    for first in range(0, len(ENDS), 2):  # two columns a picture
        pair = ENDS[first : first + 2]
        shown = {name: r for name, r in found.items() if designs.end_of(name) in ("", *pair)}
        asked = first == 0 or any(designs.end_of(name) for name in shown)
        if asked and len(shown) > 1:
            yield "responses of the designs", functools.partial(_comparison, shown)
    if found:
        name = "original" if "original" in found else next(iter(found))
        of = f"{'baseline' if name == 'original' else name}: " if len(found) > 1 else ""
        if len(found) == 1:
            yield "response", lambda: _response_alone(found[name])
        for one in catalogue.of_response(found[name]):
            about = of + one.captioned({"response": found[name]})
            about = f"{about[0].upper()}{about[1:]}."
            yield about, functools.partial(picture, one.draw, found[name], about)


def _comparison(found: Mapping[str, Results]) -> dict[str, str]:
    caption = f"Responses of the designs, two revolutions{_clearances(*found.values())}."
    return _shown(designs.comparison_figure(found), caption)


def _response_alone(found: Results) -> dict[str, str]:
    caption = f"Response over two revolutions{_clearances(found)}."
    return _shown(response.response_figure(found), caption)


def _shown(figure: "Figure", caption: str) -> dict[str, str]:
    """A picture with its caption, for the template."""
    picture = base64.b64encode(style.render(figure, dpi=220)).decode("ascii")
    return {"png": picture, "caption": caption}


def _clearances(*responses: Results) -> str:
    """At which clearances these were simulated, where that is the same for all."""
    parts = []
    for joint, name in enumerate(motion.joints(responses[0]).values()):
        known = [motion.clearances(one)[joint] for one in responses]
        shown = {labels.quantity(float(c), "m") for c in known if np.isfinite(c)}
        if len(shown) == 1:
            parts.append(f"{shown.pop()} in {name}")
    return f", at radial clearances of {' and '.join(parts)}" if parts else ""


def picture(
    draw: "Callable[[Results], Figure]", found: Results, caption: str
) -> dict[str, str] | None:
    """Draw a figure of one file with its caption; None if the file has not what it needs (no Sobol indices, say)."""
    return _tried(functools.partial(draw, found), caption)


def _tried(draw: "Callable[[], Figure]", caption: str) -> dict[str, str] | None:
    try:
        made = draw()
    except InputError as error:
        if error.key == "matplotlib":
            raise
        return None
    return _shown(made, caption)


PARTS = (SectionOf(100, "figures", "Figures", "figures.html", figures, each=True, piecewise=True),)

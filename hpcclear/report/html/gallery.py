"""Every figure that a directory of results allows, with its caption."""

import base64
import functools
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.base.objectives import ENDS
from hpcclear.report.figures import (
    catalogue,
    designs,
    effects,
    fits,
    labels,
    motion,
    response,
    style,
    surrogates,
)
from hpcclear.report.html.content import Content
from hpcclear.report.html.guard import attempt
from hpcclear.results.content import Results

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_FITS = (
    surrogates.sensitivity_figure,
    surrogates.fit_figure,
    surrogates.surfaces_figure,
    surrogates.parity_figure,
)
"""Figures of surrogates: the captions name those that do not fit."""


_ELSEWHERE = ("timing", "accuracy")
"""Kinds whose figures stand in sections of their own."""


def figures(content: Content, troubles: list[str]) -> list[dict[str, str]] | None:
    """All figures: their pictures (PNG, base64) and captions; in `troubles`, why one was left out."""
    made = [attempt(f"The figure “{what}”", draw, troubles) for what, draw in _drawings(content)]
    return [figure for figure in made if figure is not None] or None


Maker = Callable[[], dict[str, str] | None]


def _drawings(content: Content) -> Iterator[tuple[str, Maker]]:
    """Every figure that there may be: what it shows, and what makes its picture and caption."""
    for one in catalogue.RESULTS:
        if one.kind in _ELSEWHERE:
            continue
        fit = _warnings(one.kind, content.get(one.kind)) if one.draw in _FITS else ""
        yield from _of_file(one.draw, content.get(one.kind), one.caption + fit)
    certificate, times = content.get("effects"), content.get("timing")
    if certificate is not None:
        about = effects.caption(certificate, times)
        yield about, lambda: _shown(effects.effects_figure(certificate, times), about)
    front = content.get("front")
    if front is not None:
        verified = content.get("verification")
        caption = (
            "Pareto fronts of all runs as predicted by the surrogate, and the simulated designs."
        )
        yield caption, lambda: _shown(designs.front_figure(front, verified), caption)
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
        for one in catalogue.RESPONSE:
            caption = of + one.caption
            yield from _of_file(one.draw, found[name], f"{caption[0].upper()}{caption[1:]}.")


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


def _of_file(
    draw: "Callable[[Results], Figure]", found: Results | None, caption: str
) -> Iterator[tuple[str, Maker]]:
    """A figure of one file, unless that is missing."""
    if found is not None:
        yield caption, functools.partial(picture, draw, found, caption)


def _warnings(kind: str, content: Results | None) -> str:
    """Which surrogates do not fit, behind a caption."""
    found = fits.warnings(kind, content)
    return f" Warning: {'; '.join(found)}." if found else ""


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
    try:
        made = draw(found)
    except InputError as error:
        if error.key == "matplotlib":
            raise
        return None
    return _shown(made, caption)

"""The figures of the page, each with its caption and the subject that it belongs to."""

import base64
import contextvars
import functools
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.report.figures import catalogue, designs, labels, motion, response, sketch, style
from hpcclear.report.figures.theme import WIDTH
from hpcclear.report.html.content import Content
from hpcclear.report.html.guard import attempt
from hpcclear.report.merit import recommended, role
from hpcclear.report.parts import FigureOf, declared
from hpcclear.report.screen import upper
from hpcclear.results.content import Results, texts_in

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SUBJECTS = {
    "wear": "lives",
    "identify": "identify",
    "front": "designs",
    "verification": "designs",
    "response": "bearings",
    "effects": "effects",
    "accuracy": "accuracy",
    "timing": "reproduce",
    "map": "quality",
    "bifurcation": "quality",
}
"""Subject of the page that a figure belongs to, by the kind of its file; of others sensitivities."""

MECHANISM = "mechanism"
"""Figure that stands above the moving mechanism."""

WIDE = ("accuracy", "bifurcation", "effects", "front", "map", "orbit", "samples")
"""Figures of several panels that take the width of the page where they stand on the first screen."""

OF_RESPONSE = ("orbit", "noise")
"""Figures of a response that the page has; `hpcclear plot` draws the others."""

DPI = 150

MOST_DRAWN = 4
"""Files of samples whose own figures stand on a page: each takes a second and up to 1 MB."""


def figures(
    content: Content,
    troubles: list[str],
    first: Sequence[str] = (),
    most: int | None = None,
    wide: Collection[str] = (),
) -> list[dict[str, str]]:
    """Figures, those named `first` before the others, at most so many, for the width of the page where named `wide`: name,
    subject, picture (PNG, base64) and caption; in `troubles`, why one was left out."""
    made: list[dict[str, str]] = []
    every = sorted(_drawings(content), key=lambda one: one[0] not in first)
    for name, kind, caption, draw in every:
        if len(made) == most:
            break
        here = contextvars.copy_context()
        here.run(style.column.set, WIDTH * (2.1 if name in wide else 1.0))
        make = functools.partial(here.run, _png, draw)
        drawn = attempt(f"The figure “{caption}”", make, troubles)
        if drawn:
            subject = SUBJECTS.get(kind, "sensitivities")
            made.append({"name": name, "subject": subject, "png": drawn, "caption": caption})
    return made


def _drawings(content: Content) -> Iterator[tuple[str, str, str, "Callable[[], Figure]"]]:
    """Every figure that there may be: name, kind of its file, caption, and what draws it."""
    several = content.each_of_samples() if len(content.samples) <= MOST_DRAWN else iter(())
    every = [(f"{name}: ", own) for name, own in several] if content.samples else [("", content)]
    for before, one in every:
        for figure in declared(FigureOf):
            if figure.kind in one.files:
                caption = before + figure.captioned(one.files)
                yield figure.name, figure.kind, caption, figure.of(one.files)
    verified = content.files.get("verification")
    best = ("", "") if verified is None else (recommended(verified), role(verified))
    yield from _of_responses(content.responses, *best)


def _of_responses(
    found: Mapping[str, Results], best: str, called: str
) -> Iterator[tuple[str, str, str, "Callable[[], Figure]"]]:
    if not found:
        return
    titles = {"original": "original", best: called} if best in found else {}
    shown = {titles[name]: found[name] for name in titles if name in found} or found
    if len(shown) > 1:
        caption = f"Responses of the designs, two revolutions{_clearances(*shown.values())}."
        draw = functools.partial(designs.comparison_figure, shown)
        yield "comparison", "response", caption, draw
    design, before = found.get(best), found.get("original")
    if design is None or design is before:
        design, before = before or next(iter(found.values())), None
    caption = "The mechanism to scale, with its dimensions."
    if before is not None:
        caption = f"{upper(called)} design: changed parts in orange, the baseline's outline dashed."
    draw = functools.partial(sketch.mechanism_figure, design, before)
    yield MECHANISM, "response", caption, draw
    name = "original" if "original" in found else next(iter(found))
    of = f"{'baseline' if name == 'original' else name}: " if len(found) > 1 else ""
    files = {"response": found[name]}
    if len(found) == 1:
        caption = f"Response over two revolutions{_clearances(found[name])}."
        draw = functools.partial(response.response_figure, found[name])
        yield "response", "response", caption, draw
    for one in catalogue.of_response(found[name]):
        if one.name in OF_RESPONSE:
            yield one.name, "response", f"{upper(of + one.captioned(files))}.", one.of(files)


def _png(draw: "Callable[[], Figure]") -> str | None:
    """A picture for the template; None if the file has not what it needs (no Sobol indices, say)."""
    try:
        made = draw()
    except InputError as error:
        if error.key == "matplotlib":
            raise
        return None
    return base64.b64encode(style.render(made, dpi=DPI)).decode("ascii")


def _clearances(*responses: Results) -> str:
    """At which clearances these were simulated, where that is the same for all."""
    if any("penetration" not in one for one in responses):  # of ideal joints
        return ""
    parts, known = list[str](), np.array([motion.clearances(one) for one in responses]).T
    for name, own in zip(texts_in(responses[0], "joint"), known, strict=True):
        shown = {labels.quantity(float(c), "m") for c in own if np.isfinite(c)}
        if len(shown) == 1:
            parts.append(f"{shown.pop()} in {name}")
    return f", at radial clearances of {' and '.join(parts)}" if parts else ""

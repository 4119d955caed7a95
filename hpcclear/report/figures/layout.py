"""Where the parts of a figure stand: labels broken to the length of their axes, legends no wider than their panels."""

import re
import textwrap
import warnings
from collections.abc import Iterator
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np
from matplotlib.layout_engine import ConstrainedLayoutEngine

from hpcclear.base.errors import InputError
from hpcclear.report.figures.printing import titles

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.text import Text

_WHOLE = re.compile(r"\$[^$]*\$|\([^()]*\)$")
"""Parts of a label that are not broken: formulas, and the unit."""

_MOST = 4
"""Layouts until labels and panels agree."""

_BLANK = "\N{NO-BREAK SPACE}"


class Fitting(ConstrainedLayoutEngine):
    """Matplotlib's layout, after which labels of axes and titles have as many lines as their panels ask for."""

    def __init__(self) -> None:
        super().__init__(w_pad=0.03, h_pad=0.03, wspace=0.02, hspace=0.02)
        self._lines: WeakKeyDictionary[Text, tuple[str, str]] = WeakKeyDictionary()
        """Of a label the text that was given, and what was made of it."""

    def execute(self, fig: "Figure") -> None:
        """Lay out, break labels, and lay out again where that changed any."""
        for _ in range(_MOST):
            super().execute(fig)
            changed = [self._broken(text, room) for text, room in _labels(fig)]
            if not any(changed):
                return

    def _broken(self, text: "Text", room: float) -> bool:
        """Break a label into lines that fit the room, in dots; whether that changed it."""
        before = text.get_text()
        given, made = self._lines.get(text, (before, before))
        given = given if before == made else before  # the user wrote another
        text.set_text(given)
        if given and length(text) > room:
            widest = max(map(len, given.split("\n")))
            for letters in range(max(int(widest * room / length(text)) + 1, 4), 3, -1):
                text.set_text("\n".join(_in_lines(one, letters) for one in given.split("\n")))
                if length(text) <= room:
                    break
        self._lines[text] = given, text.get_text()
        return text.get_text() != before

    def check(self, figure: "Figure") -> None:
        """Raise InputError where a label does not fit the figure or its axis; it names a size that they fit."""
        if not (cut := self._cut(figure)):
            return
        own = figure.get_size_inches() * 25.4
        larger = "a larger size"
        for factor in np.geomspace(1.15, 3.0, 6):
            figure.set_size_inches(*factor * own / 25.4)
            if not self._cut(figure):
                larger = "{:.0f}mm x {:.0f}mm, which they fit".format(*factor * own)
                break
        figure.set_size_inches(*own / 25.4)
        reason, size = f"labels of the figure do not fit this size: {cut}", "{:.0f}mm x {:.0f}mm"
        raise InputError("--size", size.format(*own), reason, f"Give {larger}, or a smaller font")

    def _cut(self, figure: "Figure") -> str:
        """Words that do not fit the figure or their axis; "" where all do."""
        with warnings.catch_warnings(record=True) as collapsed:
            self.execute(figure)
        for text, room in _labels(figure):
            if text.get_text() and length(text) > 1.2 * room:
                return repr(" ".join(text.get_text().split()))
        box, (width, height) = figure.get_tightbbox().padded(-0.01), figure.get_size_inches()
        inside = box.x0 >= 0.0 and box.y0 >= 0.0 and box.x1 <= width and box.y1 <= height
        return "" if inside and not collapsed else "panels have no room beside them"


def length(text: "Text") -> float:
    """How long a label is along its lines, dots."""
    box = text.get_window_extent()
    return box.height if text.get_rotation() == 90.0 else box.width


def _in_lines(words: str, letters: int) -> str:
    """Words in lines of so many letters, formulas and the unit each on one."""
    whole = _WHOLE.sub(lambda found: found[0].replace(" ", _BLANK), words)
    lines = textwrap.wrap(whole, letters, break_long_words=False, break_on_hyphens=False)
    return "\n".join(lines).replace(_BLANK, " ")


def _labels(figure: "Figure") -> "Iterator[tuple[Text, float]]":
    """Labels of axes and titles, and the room that each has, dots."""
    for axes in figure.axes:
        box = axes.get_window_extent()
        if axes.axison and box.width > 0.0 and box.height > 0.0:
            gap = 0.05 * figure.dpi
            yield axes.xaxis.label, box.width + gap
            yield axes.yaxis.label, box.height + gap
            for place in ("left", "center"):
                yield titles(axes)[place], box.width + gap
            for child in axes.child_axes:
                yield child.xaxis.label, box.width + gap

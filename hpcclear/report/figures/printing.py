"""Figures for print: size, fonts, colours and labels that a user wants."""

import logging
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hpcclear.base.errors import InputError, nearest
from hpcclear.base.holding import holding
from hpcclear.base.units import UnitError, to_si
from hpcclear.report.figures import theme as colours

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Text

SMALLEST, LARGEST = 20.0, 1000.0  # mm

_UNIT = re.compile(r"(.*?)(?:\s(\([^()]*\)))?", re.DOTALL)
"""Words of a label, and its unit."""
_FORMULA = re.compile(r"\s*\$[^$]*\$")


@dataclass(frozen=True)
class Printing:
    """What a user wants of figures; nothing of what is empty."""

    rc: Mapping[str, Any] = field(default_factory=dict)
    """Settings of matplotlib."""
    height: float | None = None
    """mm."""
    texts: Mapping[str, str] = field(default_factory=dict)
    """What to write for a label, by what it is called (see `renamed`)."""
    names: set[str] = field(default_factory=set)
    """What labels of the figures that were drawn are called."""
    used: set[str] = field(default_factory=set)
    """Those that a text of the user stands for."""


_USUAL = Printing()
wanted: ContextVar[Printing] = ContextVar("what a user wants of figures", default=_USUAL)


@contextmanager
def printing(
    size: str = "",
    font: str = "",
    sheet: str | Path | None = None,
    theme: str = "light",
    texts: Mapping[str, str] | None = None,
) -> Iterator[None]:
    """Draw figures within it as a journal or a talk wants them; they can be saved within it or later.

    `size`: width, ``"85mm"``, or width and height, ``"85mm x 60mm"``; `font`: name of an installed font; `sheet`: style sheet
    of matplotlib, before which `size`, `font` and `theme`, ``"light"`` or ``"dark"``, go; `texts`: what to write for a label,
    by the entry of the scene that it shows, the variable, or its words without the unit. Raises InputError: no such size, font,
    theme or style sheet; or no figure that was drawn has a label of that name.
    """
    rc: dict[str, Any] = {} if sheet is None else _sheet(Path(sheet))
    if theme not in colours.THEMES:
        known = list(colours.THEMES)
        raise InputError("--theme", theme, "there is no such theme", nearest(theme, known))
    rc |= colours.THEMES[theme] if theme != "light" else {}
    width, height = _size(size) if size else (None, None)
    if width is not None:
        rc["figure.figsize"] = (width * colours.MM, 60.0 * colours.MM)
    if font:
        rc |= _font(font)
    user = Printing(rc, height, dict(texts or {}))
    with holding(wanted, user):
        yield
    for name in user.texts:
        if name not in user.used:
            reason = "no axis of these figures is called so"
            raise InputError("--label", name, reason, nearest(name, sorted(user.names)))


def _size(text: str) -> tuple[float, float | None]:
    """Width and height of a figure, mm."""
    remedy = 'Give a width, "85mm", or width and height, "85mm x 60mm"'
    try:
        sides = [1e3 * to_si(side.strip(), "m") for side in re.split(r"\s*[x×]\s*", text)]
    except UnitError:
        raise InputError("--size", text, "it is no length with a unit", remedy) from None
    if len(sides) > 2 or not all(SMALLEST <= side <= LARGEST for side in sides):
        reason = f"width and height of a figure are {SMALLEST:g} to {LARGEST:g} mm"
        raise InputError("--size", text, reason, remedy)
    return sides[0], sides[1] if len(sides) > 1 else None


def _sheet(place: Path) -> dict[str, Any]:
    """The settings of a style sheet; raises InputError where there is none, or it has lines that matplotlib does not know."""
    if not place.is_file():
        remedy = "Give a style sheet of matplotlib"
        raise InputError("--style", str(place), "there is no such file", remedy)
    lines: list[str] = []
    log, listener = logging.getLogger("matplotlib"), logging.Handler(logging.WARNING)
    listener.emit = lambda record: lines.append(" ".join(record.getMessage().split()))  # type: ignore[method-assign]
    log.addHandler(listener)
    log.propagate = False
    read = colours.matplotlib().rc_params_from_file
    try:
        found = dict(read(str(place), use_default_template=False))
    except (OSError, UnicodeError) as error:
        lines.append(str(error))
    finally:
        log.removeHandler(listener)
        log.propagate = True
    if lines:
        reason = f"matplotlib cannot read it: {lines[0].partition(' You ')[0]}"
        raise InputError("--style", str(place), reason, "Mend that line, or remove it")
    return found


def _font(name: str) -> dict[str, Any]:
    """Settings of a font, for words and formulas; raises InputError where it is not installed."""
    from matplotlib.font_manager import FontProperties, fontManager

    try:
        fontManager.findfont(FontProperties(family=[name]), fallback_to_default=False)
    except ValueError:
        remedy = nearest(name, fontManager.get_font_names())
        raise InputError("--font", name, "this font is not installed", remedy) from None
    own = {"mathtext.rm": name, "mathtext.it": f"{name}:italic", "mathtext.bf": f"{name}:bold"}
    return {"font.family": [name, "DejaVu Sans"], "mathtext.fontset": "custom", **own}


def _plain(words: str) -> str:
    """What a label is found by: its words, without differences of case, line or underscore."""
    return " ".join(words.replace("\\$", "$").replace("_", " ").lower().split())


def renamed(
    figure: "Figure", panels: "Sequence[Axes]", paths: Mapping[str, str], user: Printing
) -> None:
    """Write a user's texts in place of labels, with the same units: of axes, their categories, legends and titles.

    Each is found by its words, or by the entry of the scene that it names (`paths`, by the words).
    """
    by_name = {_plain(name): (name, text) for name, text in user.texts.items()}
    known = {_plain(words): path for words, path in paths.items()}

    def changed(before: str) -> str:
        words, unit = _UNIT.fullmatch(before.strip()).groups()  # type: ignore[union-attr]
        names = {words, _FORMULA.sub("", words), known.get(_plain(words), words)} - {""}
        user.names.update(names)
        for name in names:
            if found := by_name.get(_plain(name)):
                user.used.add(found[0])
                return found[1] + (f" {unit}" if unit and not found[1].endswith(")") else "")
        return before

    if not by_name:
        return
    for text in _texts(figure, panels):
        text.set_text(changed(text.get_text()))
    for axis in (axis for panel in panels for axis in (panel.xaxis, panel.yaxis)):
        if type(axis.get_major_locator()).__name__ == "FixedLocator":
            axis.set_ticklabels([changed(one.get_text()) for one in axis.get_ticklabels()])


def _texts(figure: "Figure", panels: "Sequence[Axes]") -> "Iterator[Text]":
    for panel in panels:
        yield from (panel.xaxis.label, panel.yaxis.label, *titles(panel).values())
        yield from (child.xaxis.label for child in panel.child_axes)
    for legend in (*figure.legends, *(one for panel in panels if (one := panel.get_legend()))):
        yield from legend.get_texts()


def titles(axes: "Axes") -> "dict[str, Text]":
    """The titles of a panel by their places."""
    private: Any = axes
    return {"left": private._left_title, "center": axes.title}

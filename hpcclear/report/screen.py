"""The first screen of results: what the page opens with and what commands print, from the numbers and codes of the files.

Each kind of result makes its own, in a module of `hpcclear.report.screens`; nobody reads its words back.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import partial
from typing import NamedTuple

import numpy as np

from hpcclear.report.figures import labels

WORRIES, TILES = 6, 4
"""Lines on what to trust, and figures, of a first screen; a sheet has all."""

HEADER = "quantity", "value", "95 %, note"
"""Heads of figures; a table with the same ones follows them."""


class Level(IntEnum):
    """How far a result can be trusted, the worst first."""

    RED = 0
    AMBER = 1
    GREEN = 2


class Trust(NamedTuple):
    """A line on what to trust."""

    level: Level
    text: str
    place: str = ""
    """Subject of the page on which more is said."""


red, amber, green = (partial(Trust, level) for level in Level)
"""Make lines of each level, of a text and, where there is one, a subject."""


class Tile(NamedTuple):
    """A figure of the first screen: one number."""

    label: str
    value: str
    before: str = ""
    """Of the baseline."""
    change: str = ""
    """From the baseline: "-37 %"."""
    within: str = ""
    """Half-width or interval of the value, not of its change: "± 0.24 %"."""
    good: bool | None = None
    """Whether the change is for the better; None where that is not decided."""


class Span(NamedTuple):
    """Where a value lies in its range, from 0 to 1."""

    before: float
    after: float
    bound: str = ""
    """The end that it sits on: "lower", "upper"; "" for none."""

    @property
    def words(self) -> str:
        """The same in words."""
        where = "at" if round(self.after, 4) in (0.0, 1.0) else "near"
        return self.bound and f"{where} its {self.bound} bound"


class ScreenRow(NamedTuple):
    """A line of the table of the first screen."""

    label: str
    cells: tuple[str, ...]
    span: Span | None = None


class ShareBar(NamedTuple):
    """A share with its half-width."""

    label: str
    share: float
    half: float


@dataclass(frozen=True)
class Screen:
    """A first screen."""

    headline: str
    """What an engineer repeats."""
    about: tuple[str, ...] = ()
    """What was simulated, in a few words each."""
    doubt: str = ""
    """Why the headline is not to be relied on; "" where nothing is known against it."""
    tiles: tuple[Tile, ...] = ()
    """The most important first."""
    header: tuple[str, ...] = HEADER
    rows: tuple[ScreenRow, ...] = ()
    """header and rows: the table beside, and its heads; the rows' label is the first."""
    remark: str = ""
    """Below the table."""
    trust: tuple[Trust, ...] = ()
    """Red first."""
    bars: tuple[ShareBar, ...] = ()
    """What the scatter comes from."""
    causes: str = ""
    """What to do about it."""
    steps: tuple[str, ...] = ()
    """What to do next, the most useful first."""
    figures: tuple[str, ...] = ()
    """Names of the figures that stand beside, as `hpcclear plot` calls them."""
    limits: tuple[str, ...] = ()
    """What the intervals cover."""
    title: str = ""
    """What the scene says that it is about."""

    def shown(self) -> "Screen":
        """Return what a first screen has room for."""
        return replace(self, tiles=self.tiles[:TILES], trust=self.trust[:WORRIES])

    def tables(self) -> "list[list[Sequence[str]]]":
        """Return figures and design in rows, heads first: one table where both stand beside today's, else one each."""
        if self.header[1:2] == ("today",):
            tiles = ((t.label, t.before, t.value, t.change, t.within) for t in self.tiles)
            ends = (row.span.words if row.span else "" for row in self.rows)
            design = zip(self.rows, ends, strict=True)
            rows = [(row.label, *row.cells, "", end) for row, end in design]
            return [[("", *self.header[1:], "change", "95 %, note"), *tiles, *rows]]
        own: dict[Sequence[str], list[Sequence[str]]] = {HEADER: [], self.header: []}
        own[HEADER] += ((one.label, one.value, one.within) for one in self.tiles)
        own[self.header] += ((row.label, *row.cells) for row in self.rows)
        return [[head, *rows] for head, rows in own.items() if rows]


def trusted(lines: Iterable[Trust], outside: bool = False) -> tuple[Trust, ...]:
    """Return the lines on what to trust, red first; of simulations outside the range of the contact model what is green
    holds for the model alone, and says so."""
    found = sorted(lines, key=lambda one: one.level)
    good = [one for one in found if one.level is Level.GREEN]
    if outside and good:
        text = "; ".join(f"{one.text[0].lower()}{one.text[1:]}" for one in good)
        found[-len(good) :] = [good[0]._replace(text=f"Within the model: {text}")]
    return tuple(found)


def plus_minus(share: float) -> str:
    """Return a half-width relative to its value, in words, rounded up to two digits; "" where it is not known or zero."""
    if not np.isfinite(share):
        return ""
    half = 100.0 * share
    step = 10.0 ** (np.floor(np.log10(half)) - 1.0) if half > 0.0 else 1.0
    return f"± {np.ceil(half / step - 1e-9) * step:.6g} %" if half else ""


def change(after: Sequence[float], before: Sequence[float]) -> tuple[str, bool | None]:
    """Return a change in words, and whether it is significantly downwards (None: undecided), of values with their intervals.

    The interval is that of independent estimates, which is no narrower than that of simulations at common random numbers.
    """
    (new, *ends), (old, *old_ends) = after, before
    if not (np.isfinite([new, old]).all() and old):
        return "", None
    moved = (new - old) / abs(old)  # upwards where it grows, of negative values, too
    halves = [float(np.ptp(one)) / 2.0 for one in (ends, old_ends)]  # NaN where not known
    reach = np.hypot(halves[0], new / old * halves[1]) / abs(old)
    if abs(moved) <= reach or abs(moved) < 1e-4:
        return "no significant change", None
    share = f"{100.0 * moved:+.{'0f' if abs(moved) > 0.0095 else '1g'}} %"
    return share.replace("-", "\N{MINUS SIGN}"), moved < 0.0


def upper(text: str) -> str:
    """Return a text as the beginning of a sentence."""
    return f"{text[:1].upper()}{text[1:]}"


def lower(text: str) -> str:
    """Return a change in a sentence: "38 % lower"; "" where it is none."""
    number = text.removesuffix(" %")
    return f"{number[1:]} % {'lower' if number[0] != '+' else 'higher'}" if number != text else ""


def within(value: float, low: float, high: float, unit: str) -> str:
    """Return the interval of a value: relative to it, or its ends where these are of another sign or far apart."""
    if not np.isfinite([value, low, high]).all():
        return "interval not known"
    if value and (high - low) < abs(value):
        return plus_minus((high - low) / 2.0 / abs(value))
    return labels.stated(value, low, high, unit)[1] if low < high else ""

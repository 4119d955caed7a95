"""Words for axes: what is drawn, its symbol and a unit of a readable size."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hpcclear.base.arrays import Array
from hpcclear.base.holding import holding
from hpcclear.base.objectives import MEAN_GAP
from hpcclear.base.outcome import Flag
from hpcclear.base.units import factor
from hpcclear.base.written import Texts, other_unit, reading, text_of
from hpcclear.report.html.content import scene_in
from hpcclear.results.content import Results, Variable, number_in, text_in
from hpcclear.results.names import DESIGN_VARIABLES
from hpcclear.scene.paths import described

_PREFIXES = {-9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


FLAGS = {
    Flag.LATCHED: "a joint stayed in contact for a whole revolution: its damping uses the last impact velocity, and "
    "results may depend on the integration tolerance (hunt-crossley avoids it)",
    Flag.BEYOND_HERTZ: "indentation beyond the range of the contact law (Hertz: 25 % of the clearance): forces are indicative",
    Flag.STIFF: "the implicit method was used for part of the run",
}
"""What flags of a sample say."""


class Scale(NamedTuple):
    """A unit to show numbers in: multiply by `factor`, write `unit` behind."""

    factor: float
    unit: str

    def __call__(self, values: ArrayLike | Variable) -> Array:
        """Numbers in SI, or a variable of a file, in this unit."""
        return np.asarray(values, float) * self.factor

    def label(self, words: str) -> str:
        """An axis label."""
        return f"{words} ({self.unit})"


@contextmanager
def in_units_of(text: str) -> Iterator[None]:
    """Within it, quantities are shown as the text of a scene has them, others in its units."""
    scene = scene_in(text)
    with reading(Texts() if scene is None else scene.written):
        yield


def plain(units: str) -> str:
    """A unit as the tables of this package write it: ``kg*m**2`` becomes kg m^2, none becomes 1."""
    return units.replace("**", "^").replace("*", " ").strip() or "1"


def pretty(units: str) -> str:
    """A unit as it is printed: ``kg m^2`` becomes kg m², a bare number a dash."""
    units = plain(units)
    if units == "1":
        return "–"
    return re.sub(r"\^(-?\d+)", lambda match: match[1].translate(_SUPERSCRIPTS), units)


def scale(units: str, values: ArrayLike) -> Scale:
    """A unit in which the largest of the values (of any shape) reads as 1 to 999; one of another system that the user wrote.

    Only a unit that begins with m, N, J, W, Pa or s takes a prefix (its power counts); masses stay in kg, inertias
    go to kg mm^2, and lengths from a tenth of a millimetre on to mm, as drawings have them.
    """
    units = plain(units)
    if own := other_unit(units):
        return Scale(1.0 / float(factor(own, units)), pretty(own))
    finite = np.abs(np.asarray(values, dtype=float))
    finite = finite[np.isfinite(finite)]
    largest = float(finite.max()) if finite.size else 0.0
    if units == "kg m^2" and 0.0 < largest < 0.1:
        return Scale(1e6, "kg mm²")
    if units == "m" and 1e-4 <= largest < 1.0:
        return Scale(1e3, "mm")
    match = re.match(r"(m|N|J|W|Pa|s)(?:\^(\d))?(?![A-Za-z^])", units)
    if match is None or not largest > 0.0 or units == "m/s":
        return Scale(1.0, pretty(units))
    power = int(match[2] or 1)
    exponent = int(np.floor(np.log10(largest) / (3 * power) + 1e-9)) * 3
    # lengths above a metre stay in metres
    most = 9 if match[1] != "m" else 3 if "/" in units else 0
    exponent = min(max(exponent, -9), most)
    return Scale(10.0 ** (-exponent * power), pretty(_PREFIXES[exponent] + units))


PLAIN = 1e6
"""Numbers below it are printed without an exponent."""


def quantity(value: float, units: str, digits: int = 4) -> str:
    """A number with its unit as it was written (`in_units_of`) or in a readable size, a dash where there is none."""
    if not np.isfinite(value):
        return "–"
    if text := text_of(value, units):
        return text
    chosen = scale(units, value)
    unit = "" if chosen.unit == "–" else f" {chosen.unit}"
    return f"{_shown(value * chosen.factor, digits)}{unit}"


def _shown(number: float, digits: int) -> str:
    text = f"{number:.{digits}g}"
    return f"{float(text):.0f}" if "e+" in text and abs(float(text)) < PLAIN else text


def value(one: Variable) -> str:
    """A design variable of a design as it is printed: with its unit, or the name of the row of a table."""
    number, names = float(one), options(one)
    if names and np.isfinite(number):
        return names[int(number)]
    return quantity(number, str(one.attrs["units"]))


def quantities(values: Sequence[float], units: str, digits: int = 4) -> list[str]:
    """Numbers as `quantity` prints them, in one unit where they stand beside each other."""
    texts = [quantity(one, units, digits) for one in values]
    if len({text.partition(" ")[2] for text in texts if text != "–"}) < 2:
        return texts
    factor, unit = scale(units, values)
    shown = (f"{_shown(one * factor, digits)} {unit}" for one in values)
    return [text if np.isfinite(one) else "–" for text, one in zip(shown, values, strict=True)]


def alike(*ones: Variable) -> list[str]:
    """A design variable of several designs as it is printed, in one unit."""
    if options(ones[0]):
        return [value(one) for one in ones]
    return quantities([float(one) for one in ones], str(ones[0].attrs["units"]))


def options(variable: Variable) -> list[str]:
    """Names of the rows of a table that a design variable chooses from; none of one that is a number."""
    return [one for one in str(variable.attrs.get("options", "")).split("; ") if one]


NOT_CHECKED = "not checked"
"""What stands in place of a half-width that nobody simulated."""

_MOST_DIGITS = 6


def with_half_width(value: float, half_width: float, units: str) -> str:
    """A number with its half-width, "20.9 ± 1.2 µm": no more digits than two of the half-width; without one `NOT_CHECKED`."""
    if not np.isfinite(value):
        return "–"
    if not np.isfinite(half_width):
        return f"{quantity(value, units)}, {NOT_CHECKED}"
    chosen = scale(units, value)
    unit = "" if chosen.unit == "–" else f" {chosen.unit}"
    return f"{paired(value * chosen.factor, half_width * chosen.factor)}{unit}"


def paired(value: float, half_width: float) -> str:
    """Two finite numbers as "20.9 ± 1.2": no more digits than two of the half-width, which is rounded up."""

    def places(number: float, digits: int) -> int:
        return digits - 1 - int(np.floor(np.log10(number))) if number > 0.0 else digits

    decimals = max(places(abs(value), _MOST_DIGITS), 0)
    if half_width > 0.0:
        decimals = min(places(half_width, 2), decimals)  # negative: tens are rounded, too
    step = 10.0**-decimals
    rounded = abs(np.ceil(half_width / step - 1e-9)) * step  # up: it is no narrower than it is
    near, shown = round(value, decimals) + 0.0, max(decimals, 0)  # 0 has no sign
    return f"{near:.{shown}f} ± {rounded:.{shown}f}"


def between(low: float, high: float, units: str) -> str:
    """Return the ends of an interval in words, with enough digits to differ; one value where they are equal."""
    for digits in range(4, 8 if low < high else 5):
        ends = quantities((low, high), units, digits)
        if ends[0] != ends[1]:
            break
    unit = " ".join(["", *ends[1].split(" ")[1:]])
    return ends[1] if ends[0] == ends[1] else f"{ends[0].removesuffix(unit)} to {ends[1]}"


def stated(
    value: float, low: float, high: float, units: str, chosen: Scale | None = None
) -> tuple[str, str]:
    """Return a value and its confidence interval in words, in one unit, to two digits of half its width, outwards, and four of
    all; `chosen`: the unit of all that stand beside each other."""
    if not np.isfinite(value):
        return "–", "–"
    chosen, digits = chosen or scale(units, (value, low, high)), 4
    numbers = np.array([value, low, high]) * chosen.factor
    if low < high:
        sizes = np.log10([(numbers[2] - numbers[1]) / 2.0, abs(numbers).max()])
        step, digits = 10.0 ** (np.floor(sizes) - [1.0, 3.0]).max(), 7
        value, low, high = numbers / step
        numbers = np.array([np.round(value), np.floor(low + 1e-9), np.ceil(high - 1e-9)]) * step
    shown, *ends = (_shown(one, digits) for one in numbers)
    unit = "" if chosen.unit == "–" else f" {chosen.unit}"
    return f"{shown}{unit}", f"{' to '.join(dict.fromkeys(ends))}{unit}"


def of(variable: Variable) -> Scale:
    """The scale of a variable of a dataset."""
    return scale(str(variable.attrs.get("units", "1")), variable.values)


def words(variable: Variable) -> str:
    """What a variable is called in a sentence; a design variable by its short name or scene path."""
    return str(variable.attrs.get("scene_path", variable.attrs.get("long_name", variable.name)))


_paths: ContextVar[dict[str, str] | None] = ContextVar("entries on axes", default=None)


@contextmanager
def called() -> Iterator[dict[str, str]]:
    """Collect within it what entries of the scene stand on axes: their paths, by their words there."""
    found: dict[str, str] = {}
    with holding(_paths, found):
        yield found


def axis(variable: Variable) -> str:
    """What a variable is called on an axis, in words: "radial clearance of the joint A"."""
    words = str(variable.attrs.get("long_name", ""))
    if path := str(variable.attrs.get("scene_path", "")):
        return entry(path, words)
    return literal(words or variable.name.replace("_", " "))


def entry(path: str, words: str = "") -> str:
    """What an entry of a scene is called on an axis, by its path or short name and its words, where a file has some."""
    _, short, label = DESIGN_VARIABLES.get(path, ("", "", ""))
    if short and words in ("", short):
        made = label or short
    else:
        if words in ("", f"design variable {path}"):
            words = described([path]) if "." in path else path.replace("_", " ")
        made = literal(words)
    return noted(path, made)


def noted(path: str, words: str) -> str:
    """Return the words that an entry of a scene has in a figure; `called` collects them."""
    if (found := _paths.get()) is not None:
        found[words] = path
    return words


def objective(content: Results) -> str:
    """What f is in a file of results, in words."""
    return str(content.attrs.get("objective", MEAN_GAP.words))


def sentence(text: str, content: Results) -> str:
    """A sentence that says what f is where it comes first, and does without " of f" from then on."""
    words = re.split(", of | between ", objective(content))[0]
    first = r"\b(?:mean of )?f\b" if words.startswith("mean ") else r"\bf\b"
    head, *rest = re.split(first, text, maxsplit=1)
    said = words.join([head, *(re.sub(r" of f\b", "", one) for one in rest)])
    return f"{said[:1].upper()}{said[1:]}"


def design_variables(content: Results) -> list[Variable]:
    """The design variables of a dataset in its order."""
    return [v for v in content.data_vars.values() if v.attrs.get("role") == "design_variable"]


def clearance(content: Results) -> Variable | None:
    """The design variable that is a clearance, if there is one."""
    named = ((str(v.attrs.get("long_name")), v) for v in design_variables(content))
    return next((v for words, v in named if words.startswith("radial clearance")), None)


def literal(text: str) -> str:
    """Text from a file so that matplotlib prints it as it is, without reading formulas into it."""
    return text.replace("$", r"\$")


def is_printed(one: Results) -> bool:
    """Whether one design of a dataset of kind ``verification`` is one that a publication prints."""
    return "mean_paper" in one and bool(np.isfinite(one["mean_paper"]))


def is_baseline(one: Results) -> bool:
    """Whether one design of a dataset of kind ``verification`` is the baseline of its case."""
    return text_in(one, "design").rpartition(" ")[2] == "original"


def estimate(one: Results, stem: str) -> tuple[float, float, float]:
    """A simulated value of a design and the ends of its confidence interval; NaN where they are not known."""
    value = float(one[stem if stem in one else f"{stem}_true"])
    return value, number_in(one, f"{stem}_lower"), number_in(one, f"{stem}_upper")

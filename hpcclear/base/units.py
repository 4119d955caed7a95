"""Strings with a unit ("0.3 mm", "5000 rpm") to numbers in SI.

The grammar is deliberately small: a decimal number, then unit names with powers (whole, or as in N/mm^1.4 and N/m^(7/5)),
products, quotients and brackets. Scene files come from anywhere, and a general expression parser would evaluate whatever
stands in them. `unit_names` reads units without numbers.

An angle is a dimension of its own here; plain dimensional analysis takes a turn a second for 6.28 Hz. Three quantities have a
unit of 1/s, and each entry declares its own: "rad/s" an angular speed, "Hz" a frequency in cycles, "1/s" a rate that counts
nothing. A turn is a cycle. An angular speed in 1/min means revolutions, as on nameplates, and that reading is noted (`noting`);
in Hz or 1/s it may be turns or radians, and is refused.
"""

import itertools
import re
import unicodedata
from collections.abc import Callable
from contextlib import AbstractContextManager
from contextvars import ContextVar
from decimal import Decimal
from fractions import Fraction
from functools import lru_cache
from math import isfinite, pi

from hpcclear.base import unit_names
from hpcclear.base.holding import holding
from hpcclear.base.unit_names import HEADS, LONGEST, TAILS, UNITS, NoUnit, UnitError as UnitError

_NUMBER = r"[+-]?(?:\d{1,40}\.?\d{0,40}|\.\d{1,40})(?:[eE][+-]?\d{1,3})?"
_QUANTITY = re.compile(rf"\s*({_NUMBER})\s*(\S.*?)?\s*", re.DOTALL)
_DIGITS = re.compile(r"[+-]?[.,]?[0-9](?:[0-9.,'\u2019_\s]*[0-9])?")
_GROUPS = re.compile(
    r"([+-]?[1-9][0-9]{0,2}(?:([.,'\u2019_\s])[0-9]{3})(?:\2[0-9]{3})*)(?:(?!\2)[.,]([0-9]+))?"
)
_POWER_OF_TEN = re.compile(
    r"\s*[xX*·×⋅]\s*10(?:(?:\^|\*\*)\s*\(?\s*([+-]?\d{1,3})\)?|([⁺⁻]?[⁰¹²³⁴⁵⁶⁷⁸⁹]{1,3}))"
)
_THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2}[.,][0-9]{3}")
_TURN = Fraction(2 * pi)
_MINUTES = {"min", "minute", "minutes"}


def _respelled(unit: str, fits: Callable[[str], bool]) -> list[str]:
    """The unit with the letters of its names small or capital as in units that are known: those that fit."""
    try:
        factors = unit_names.factors_of(unit_names.tidy(unit))
    except NoUnit:
        return []
    known = {name: name for name in UNITS}
    known |= {head + tail: f"{head}*{tail}" for head, tail in itertools.product(HEADS, TAILS)}
    alike: dict[str, list[str]] = {}
    for one, symbol in known.items():
        if one.isascii():
            alike.setdefault(one.casefold(), []).append(symbol)
    choices = [(name, *alike.get(name.casefold(), ())) for name, _, _ in factors]
    found = []
    for names in itertools.islice(itertools.product(*choices), 64):
        text = ""
        for name, (_, power, side) in zip(names, factors, strict=True):
            sign = ("1/" if not text else "/") if side < 0 else ("*" if text else "")
            shown = f"^{power}" if power.denominator == 1 else f"^({power})"
            text += sign + name + (shown if power != 1 else "")
        if text not in found and fits(text):
            found.append(text)
    return found


@lru_cache(maxsize=256)
def _fitting(unit: str, target: str) -> Fraction | None:
    """What one `unit` is in `target`; None where they are of different quantities. Raises ValueError."""
    scale, base, names = unit_names.parsed(unit)
    own, wanted = unit_names.dimensions(target)
    angle, expected_angle = (one.get("radian", 0) for one in (base, wanted))
    alike = {**base, "radian": 0} == {**wanted, "radian": 0}
    hertz = {"second": -1} in names.values()
    if not alike or (hertz and target in ("1/s", "rad/s")):  # a rate counts no cycles
        return None
    if angle == expected_angle and (target or names.keys() <= {"%", "‰", "dimensionless"}):
        return scale / own
    if target == "Hz" and angle == 1:
        return scale / _TURN
    if target == "rad/s" and names.keys() <= _MINUTES:
        return scale * _TURN
    return None


def fits(unit: str, target: str) -> bool:
    """Whether a unit is one of the quantity of `target`."""
    try:
        return _fitting(unit, target) is not None
    except ValueError:
        return False


def factor(unit: str, target: str) -> Fraction:
    """What one `unit` is in `target`, the unit of an entry; raises UnitError when they are of different quantities."""
    what = f"a quantity in {target}" if target else "a number without a unit"
    reason = f"the unit {unit!r} does not fit: this is {what}"
    try:
        found = _fitting(unit, target)
        if found is not None:
            return found
    except UnitError:
        raise
    except NoUnit:
        reason = f"{unit!r} cannot be read as a unit"
    except ValueError as error:
        reason = str(error)
    raise UnitError(reason, _remedy(unit, target))


def _remedy(unit: str, target: str) -> str:
    """What to write in place of a unit that does not fit."""
    if not target:
        return "Write a plain number"
    if target == "rad/s" and ("hz" in unit.casefold() or fits(unit, "Hz")):
        return f"{unit} may count turns or radians, 2 pi apart: write rpm, rad/s or turn/s"
    with_force = re.sub(r"\b(kg|lb|oz)(?!f)", r"\1f", unit_names.SPELLINGS.get(unit, unit))
    near = _respelled(unit, lambda text: text != unit and fits(text, target))
    if not near and with_force != unit and fits(with_force, target):
        near = [with_force]
    if near:
        return f"Did you mean {' or '.join(map(repr, near[:3]))}?"
    return f"Write it in {target}, or as a plain number in {target}"


TEXTS: ContextVar[dict[tuple[float, str], str] | None] = ContextVar("texts", default=None)
"""What was written for numbers, by their values and units in SI: of the scene that is read or shown (`base.written`)."""

_NOTED: ContextVar[Callable[[str, str], None] | None] = ContextVar("noted", default=None)


def noting(take: Callable[[str, str], None]) -> AbstractContextManager[None]:
    """Within it, `take` gets each text that leaves its unit open, and a sentence that says how it is read."""
    return holding(_NOTED, take)


def note(text: str, read: str) -> None:
    """Note how a text of an entry is read, where that is not plain from the text."""
    take = _NOTED.get()
    if take is not None:
        take(text.strip(), read)


def note_turns(text: str, number: str, unit: str, target: str) -> None:
    """Note how `text` is read, where `number` of `unit`, which fits the target, is an angular speed in turns by time alone."""
    if target == "rad/s" and "radian" not in unit_names.parsed(unit)[1]:
        turns = float(60 * Fraction(number) * factor(unit, target) / _TURN)
        note(text, f"{turns:.6g} rpm, revolutions per minute; for radians write rad/s")


_EXAMPLES = {
    "m": '"0.3 mm"', "rad/s": '"5000 rpm"', "Pa": '"206.8 GPa"', "rad": '"30 deg"', "Hz": '"20 Hz"',
}  # fmt: skip


def to_si(text: str, target: str, decided: bool = False) -> float:
    """Read a quantity such as ``"0.3 mm"`` as a float in the SI unit `target`, ``""`` for a number without one.

    `decided`: it is known that a point stands before decimals, also in "3.000".
    Raises UnitError if the text is not a number with a unit, it may be read in two ways, or the unit has another dimension.
    """
    number, unit = quantity(text, target, decided)
    value = _product(Fraction(number), factor(unit, target), target)
    keep(value, target, text)
    note_turns(text.strip(), number, unit, target)
    return value


def quantity(text: str, target: str, decided: bool = False) -> tuple[str, str]:
    """Number and unit of a text, as `to_si` reads it."""
    found = _QUANTITY.fullmatch(text.replace("\u2212", "-")) if len(text) <= LONGEST else None
    number, unit = found.groups() if found else ("", "")
    if not decided:
        check_thousands(text)
    bare = f"a number in {target}" if target else "a number"
    if found is None or (unit is not None and not _is_written(text, unit)):
        hint = f", such as {_EXAMPLES[target]}" if target in _EXAMPLES else ""
        reason = "the text is not a number" + (f" with a unit of {target}" if target else "")
        units = f", or a string with a unit{hint}" if target else ""
        raise UnitError(reason, mended(text) or f"Write {bare}{units}")
    if unit is None:
        raise UnitError("a number in quotes has no unit", f"Drop the quotes of {bare}")
    return number, unit


def spelled(target: str) -> str:
    """A unit of SI in one spelling: kg*m**2 as kg m^2."""
    return target.replace("**", "^").replace("*", " ")


def keep(value: float, target: str, text: str) -> None:
    """Keep what was written for a number (SI) of an entry with a unit: the first text that has one."""
    texts, key = TEXTS.get(), (value, spelled(target))
    if texts is not None and target and (key not in texts or not is_written_in(texts[key])):
        texts[key] = text.strip()


def is_written_in(text: str) -> str:
    """The unit of a text that is a quantity, as it stands there; "" for none."""
    found = _QUANTITY.fullmatch(text.replace("\u2212", "-"))
    return (found and found[2]) or ""


def _product(number: Fraction | Decimal, size: Fraction, target: str = "") -> float:
    upper, lower = number.as_integer_ratio()
    try:
        value = upper * size.numerator / (lower * size.denominator)
    except OverflowError:
        raise UnitError("it is too large", f"Write a finite number in {target or '1'}") from None
    if upper and not value:
        raise UnitError("it is too small", f"Write 0, or a larger number in {target or '1'}")
    return value


def scaled(value: float, size: Fraction) -> float:
    """The nearest float to the shortest decimal number of `value` times `size`; raises UnitError where there is none."""
    return value if size == 1 or not isfinite(value) else _product(Decimal(repr(value)), size)


def written(value: float, unit: str) -> float | str:
    """A number of a unit as an entry of a scene, whose point nobody takes for a sign of thousands."""
    text = repr(value).removesuffix(".0")
    return f"{text}{'0' * may_be_thousands(text)} {unit}" if unit else value


def _digits(text: str) -> tuple[str, str]:
    """The number that a text begins with, with whatever stands between its digits, and the rest of the text."""
    text = text.strip()[:LONGEST].replace("\u2212", "-")
    found = _DIGITS.match(text)
    return (found[0], text[found.end() :]) if found else ("", text)


def may_be_thousands(number: str) -> bool:
    """Whether three digits after the only comma or point of a number may be decimals or thousands."""
    return _THOUSANDS.fullmatch(number) is not None


def check_thousands(text: str) -> None:
    """Raise UnitError where the number of a text may be read in two ways."""
    number, rest = _digits(text)
    raised = re.match(r"[eE][+-]?\d", rest) or _POWER_OF_TEN.match(rest)
    if raised or not _THOUSANDS.fullmatch(number):
        return
    decimal, whole = number.replace(",", "."), re.sub("[.,]", "", number)
    short = decimal.rstrip("0").rstrip(".")
    short = f"{decimal}0" if short == decimal else short
    reason = f"may be {decimal}{rest} or {whole}{rest}"
    raise UnitError(reason, f"Write {short}{rest} or {whole}{rest}")


def is_unit(text: str) -> bool:
    """Whether a text is a unit, of whatever quantity."""
    try:
        return bool(unit_names.parsed(text))
    except ValueError:
        return False


def _is_written(text: str, unit: str) -> bool:
    """Whether what follows the number of a text is made of names, powers and signs; "1/min" after a space only."""
    if unit.startswith("1") and not text[: text.rindex(unit)][-1:].isspace():
        return False
    try:
        return bool(unit_names.factors_of(unit_names.tidy(unit)))
    except NoUnit:
        return False


def mended(text: str) -> str:
    """What to write where signs stand between the digits of a number: "0,3 mm", "1,234.5 rpm", "1.2·10^-3 m"."""
    number, rest = _digits(text)
    if raised := _POWER_OF_TEN.match(rest):
        power = int(unicodedata.normalize("NFKC", raised[1] or raised[2]).replace("\u2212", "-"))
        rest = f"e{power}{rest[raised.end() :]}"
    whole = raised is None and not re.match(r"[eE][+-]?\d", rest)
    between = "Write the digits of a number without signs or spaces between them"
    grouped = _GROUPS.fullmatch(number)
    # before a power of ten they are decimals
    if grouped and (whole or not may_be_thousands(number)):
        decimals = f".{grouped[3]}" if grouped[3] else ""
        return f"{between}: {re.sub(r'[^0-9+-]', '', grouped[1])}{decimals}{rest}"
    if re.fullmatch(r"[+-]?\d*,\d+", number):
        return f"Write a decimal point: {number.replace(',', '.')}{rest}"
    if raised:
        return f"Write powers of ten with an e, as in {number}{rest}"
    signs = re.search(r"\d[^\d]+\d.*[^\d]|\d[^\d.]+\d|\.\.", number)
    return between if signs or rest[:1].isdigit() else ""


def shows_point(text: object) -> bool:
    """Whether the number of a text has a point before decimals: one that nobody takes for a sign of thousands."""
    number = _digits(text)[0] if isinstance(text, str) else ""
    return re.fullmatch(r"[+-]?\d*\.\d+", number) is not None and not may_be_thousands(number)

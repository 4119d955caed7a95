"""Strings with a unit ("0.3 mm", "5000 rpm") to numbers in SI.

The grammar is deliberately small: a decimal number, then unit names with powers (whole, or as in N/mm^1.4 and N/m^(7/5)),
products, quotients and brackets. Scene files come from anywhere, and a general expression parser would evaluate whatever
stands in them. `unit_names` has the names.

An angle is a dimension of its own here; plain dimensional analysis takes a turn a second for 6.28 Hz. Three quantities have a
unit of 1/s, and each entry declares its own: "rad/s" an angular speed, "Hz" a frequency in cycles, "1/s" a rate that counts
nothing. A turn is a cycle. An angular speed in 1/min means revolutions, as on nameplates, and that reading is noted (`noting`).
"""

import itertools
import re
import unicodedata
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from decimal import Decimal, localcontext
from fractions import Fraction
from functools import lru_cache
from math import pi
from typing import TYPE_CHECKING, Any

from hpcclear.scene.unit_names import (
    HEADS,
    REFUSED,
    SPELLINGS,
    TAILS,
    TURNS_BY_TIME,
    UNITS,
    Dimensions,
    Unit,
)

if TYPE_CHECKING:
    from pint import UnitRegistry

_NUMBER = r"[+-]?(?:\d{1,40}\.?\d{0,40}|\.\d{1,40})(?:[eE][+-]?\d{1,3})?"
_QUANTITY = re.compile(rf"\s*({_NUMBER})\s*(\S.*?)?\s*", re.DOTALL)
_TOKEN = re.compile(
    r"\s*(?:(?P<name>[A-Za-zμ%‰°\"]{1,20})\.?(?![A-Za-z])"
    r"(?:(?:\^|\*\*)(?:\((?P<ratio>-?\d{1,3}/[1-9]\d{0,2})\)|\(?(?P<decimal>-?\d\.\d{1,6})\)?)(?!\d)"
    r"|(?:\^|\*\*)?\(?(?P<power>-?\d)\)?(?!\d))?|(?P<sign>\*\*?|[/()]))\s*"
)
_CRANK_ANGLE = re.compile(r"(deg|°)\s*(CA|KW|crank|[ab][TB]DC|[AB]TDC)\b")
_FOREIGN = str.maketrans(
    {**dict.fromkeys("·⋅∙•‧・×", "*"), **dict.fromkeys("−–‐‑", "-"), "º": "°", "″": '"', "⁻": "-"}
    | dict.fromkeys("\u200b\u2060\ufeff")
)
"""Signs that word processors put in place of those of a keyboard; of no width: dropped."""
_GROUPED = re.compile(r"[.,'\u2019\s]\s*\d")
_LONGEST = 80
_TURN = Fraction(2 * pi)


class UnitError(ValueError):
    """A string that is no quantity of the expected unit; `remedy` says what to write."""

    def __init__(self, reason: str, remedy: str) -> None:
        self.reason = reason
        self.remedy = remedy
        super().__init__(reason, remedy)


class _NoUnit(ValueError):
    """A text that is not made of names, powers and signs."""


@lru_cache(maxsize=1)
def _registry() -> "UnitRegistry[Any]":
    # Imported here because it costs about half a second, and most scenes need the names of `unit_names` alone. Exact
    # fractions make "0.3 mm" the same float as 3e-4, so that the spelling of a number cannot change
    # a result.
    from pint import UnitRegistry

    return UnitRegistry(non_int_type=Fraction)


def _named(name: str) -> list[tuple[str, Unit]]:
    """Units that a name stands for, two of "Nm"; raises ValueError."""
    name = SPELLINGS.get(name, name)
    if name in REFUSED:
        raise UnitError(f"{name!r} may mean more than one unit", REFUSED[name])
    if name in UNITS:
        return [(name, UNITS[name])]
    for cut in range(1, len(name)):
        if name[:cut] in HEADS and name[cut:] in TAILS:
            return [(part, UNITS[part]) for part in (name[:cut], name[cut:])]
    return [(name, _of_registry(name))]


def _of_registry(name: str) -> Unit:
    from pint import UndefinedUnitError
    from pint.errors import DefinitionSyntaxError, OffsetUnitCalculusError

    scale: Any
    try:
        scale, base = _registry().get_root_units(_registry().parse_units(name))
    except UndefinedUnitError:
        raise ValueError(f"{name!r} is not a known unit") from None
    except (
        OffsetUnitCalculusError, DefinitionSyntaxError, ValueError, AttributeError, TypeError, KeyError,
    ):  # fmt: skip
        raise ValueError(f"{name!r} cannot be read as a unit") from None
    exponents: Mapping[Any, Any] = base._units
    return Fraction(scale), {str(key): Fraction(power) for key, power in exponents.items()}


def _tidy(text: str) -> str:
    """A unit in the characters of a keyboard: "N·m²" as "N*m2"."""
    plain = unicodedata.normalize("NFKC", text.translate(_FOREIGN)).translate(_FOREIGN)
    plain = re.sub(r"(?<=\w)\s+per\s+(?=\w)", "/", plain.strip().replace("''", '"'))
    plain = _CRANK_ANGLE.sub(
        "deg", plain if plain in TURNS_BY_TIME else SPELLINGS.get(plain, plain)
    )
    # a dot or hyphen between two names is a product: "N.m", "ft-lbf"
    return re.sub(r"(?<=[A-Za-z\d])[.-](?=[A-Za-z])", "*", plain)


def _factors(text: str) -> list[tuple[str, Fraction, int]]:
    """Names, powers, and 1 or -1 for above or below the line, of a unit in the characters of a keyboard; raises _NoUnit."""
    tokens, at = list[re.Match[str]](), 0
    text = re.sub(r"^1\s*(?=/)", "", text)
    while at < len(text):
        found = _TOKEN.match(text, at)
        if found is None:
            raise _NoUnit
        tokens.append(found)
        at = found.end()
    factors, sides, side, awaited = list[tuple[str, Fraction, int]](), [1], 1, True
    for token in tokens:
        sign = token["sign"]
        if sign is None:
            power = Fraction(token["ratio"] or token["decimal"] or token["power"] or 1)
            factors.append((token["name"], power, sides[-1] * side))
            side, awaited = 1, False
        elif sign == "(":
            sides.append(sides[-1] * side)
            side, awaited = 1, True
        elif sign == ")" and len(sides) > 1 and not awaited:
            sides.pop()
        elif sign in ("*", "/") and (not awaited or (sign == "/" and token is tokens[0])):
            side, awaited = (-1 if sign == "/" else 1), True
        else:
            raise _NoUnit
    if awaited or len(sides) > 1:
        raise _NoUnit
    return factors


def _raised(size: Fraction, power: Fraction) -> Fraction:
    """A size to a power: exact of whole ones, else to so many digits that the nearest float is the same."""
    if power.denominator == 1:
        return size ** int(power)
    with localcontext(prec=50):
        base, exponent = (Decimal(one.numerator) / one.denominator for one in (size, power))
        return Fraction(base**exponent)


@lru_cache(maxsize=256)
def _parsed(unit: str) -> tuple[Fraction, Dimensions, dict[str, Dimensions]]:
    """Factor to base units, dimensions, and those of each unit named; ValueError says why there are none."""
    scale, powers, names = Fraction(1), dict[str, Fraction](), dict[str, Dimensions]()
    factors = _factors(_tidy(unit))
    for name, power, side in factors:
        *before, last = _named(name)
        for (part, (size, own)), raised in ((last, power), *((one, Fraction(1)) for one in before)):
            scale *= _raised(size, raised * side)
            names[part] = own
            for base, exponent in own.items():
                powers[base] = powers.get(base, Fraction(0)) + exponent * raised * side
    if any(name in TURNS_BY_TIME for name, _, _ in factors) and powers.get("second", 0) >= 0:
        raise ValueError(f"{unit!r} is not a known unit")
    return scale, {base: power for base, power in powers.items() if power}, names


def _respelled(unit: str, fits: Callable[[str], bool]) -> list[str]:
    """The unit with the letters of its names small or capital as in units that are known: those that fit."""
    try:
        factors = _factors(_tidy(unit))
    except _NoUnit:
        return []
    known = {name: name for name in UNITS}
    known |= {head + tail: f"{head}*{tail}" for head, tail in itertools.product(HEADS, TAILS)}
    choices = [
        (
            name,
            *(known[one] for one in known if one.isascii() and one.casefold() == name.casefold()),
        )
        for name, _, _ in factors
    ]
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
    scale, base, names = _parsed(unit)
    own, wanted = _parsed(target)[:2] if target else (Fraction(1), {})
    angle, expected_angle = (one.get("radian", 0) for one in (base, wanted))
    alike = {**base, "radian": 0} == {**wanted, "radian": 0}
    hertz = {"second": -1} in names.values()
    if not alike or (hertz and target in ("1/s", "rad/s")):  # a rate counts no cycles
        return None
    if angle == expected_angle and (target or names.keys() <= {"%", "‰", "dimensionless"}):
        return scale / own
    if target == "Hz" and angle == 1:
        return scale / _TURN
    if target == "rad/s" and all(one == {"second": 1} for one in names.values()):
        return scale * _TURN
    return None


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
    except _NoUnit:
        reason = f"{unit!r} cannot be read as a unit"
    except ValueError as error:
        reason = str(error)
    raise UnitError(reason, _remedy(unit, target))


def _remedy(unit: str, target: str) -> str:
    """What to write in place of a unit that does not fit."""

    def fits(text: str) -> bool:
        try:
            return text != unit and _fitting(text, target) is not None
        except ValueError:
            return False

    if not target:
        return "Write a plain number"
    if target == "rad/s" and "hz" in unit.casefold():  # readings differ by 2 pi
        return "Hz is ambiguous for an angular speed: write rpm, rad/s or turn/s"
    with_force = re.sub(r"\b(kg|lb|oz)(?!f)", r"\1f", SPELLINGS.get(unit, unit))
    near = _respelled(unit, fits) or ([with_force] if fits(with_force) else [])
    if near:
        return f"Did you mean {' or '.join(map(repr, near[:3]))}?"
    return f"Write it in {target}, or as a plain number in {target}"


_NOTED: ContextVar[Callable[[str, str], None] | None] = ContextVar("noted", default=None)


@contextmanager
def noting(take: Callable[[str, str], None]) -> Iterator[None]:
    """Within it, `take` gets each text that leaves its unit open, and a sentence that says how it is read."""
    token = _NOTED.set(take)
    try:
        yield
    finally:
        _NOTED.reset(token)


def note(text: str, read: str) -> None:
    """Note how a text of an entry is read, where that is not plain from the text."""
    take = _NOTED.get()
    if take is not None:
        take(text.strip(), read)


def note_turns(text: str, number: str, unit: str, target: str) -> None:
    """Note how `text` is read, where `number` of `unit`, which fits the target, is an angular speed in turns by time alone."""
    if target == "rad/s" and "radian" not in _parsed(unit)[1]:
        turns = float(60 * Fraction(number) * factor(unit, target) / _TURN)
        note(text, f"{turns:.6g} rpm, revolutions per minute; for radians write rad/s")


_EXAMPLES = {
    "m": '"0.3 mm"',
    "rad/s": '"5000 rpm"',
    "Pa": '"206.8 GPa"',
    "rad": '"30 deg"',
    "Hz": '"20 Hz"',
}


def to_si(text: str, target: str) -> float:
    """Read a quantity such as ``"0.3 mm"`` as a float in `target`.

    Parameters
    ----------
    text : str
        A decimal number and a unit.
    target : str
        The SI unit expected, ``""`` for a number without one.

    Raises
    ------
    UnitError
        If the text is not a number with a unit, or the unit has another dimension.
    """
    shown = target or "1"
    found = _QUANTITY.fullmatch(text.replace("\u2212", "-")) if len(text) <= _LONGEST else None
    number, unit = found.groups() if found else ("", "")
    if found is None or (unit is not None and not _is_written(text, unit)):
        hint = f", such as {_EXAMPLES[target]}" if target in _EXAMPLES else ""
        raise UnitError(
            f"the text is not a number with a unit of {shown}",
            _mended(number, unit)
            or f"Write a number in {shown}"
            + (f", or a string with a unit{hint}" if target else ""),
        )
    if unit is None:
        raise UnitError(
            "a number in quotes has no unit", f"Drop the quotes for a number in {shown}"
        )
    try:
        value = float(Fraction(number) * factor(unit, target))
        note_turns(text.strip(), number, unit, target)
        return value
    except OverflowError:
        raise UnitError("the number is too large", f"Write a finite number in {shown}") from None


def is_unit(text: str) -> bool:
    """Whether a text is a unit, of whatever quantity."""
    try:
        return bool(_parsed(text))
    except ValueError:
        return False


def _is_written(text: str, unit: str) -> bool:
    """Whether what follows the number of a text is made of names, powers and signs; "1/min" after a space only."""
    if unit.startswith("1") and not text[: text.rindex(unit)][-1:].isspace():
        return False
    try:
        return bool(_factors(_tidy(unit)))
    except _NoUnit:
        return False


def _mended(number: str, rest: str) -> str:
    """What to write where digits follow the number: "0,3 mm", "5 000 rpm", "1.2·10^-3 m"."""
    if re.match(r",\s*\d", rest) and "." not in number:
        return f"Write a decimal point: {number}.{rest[1:].lstrip()}"
    if re.match(r"[xX*·×⋅]\s*10", rest):
        return f"Write powers of ten as in {number}e-3"
    if _GROUPED.match(rest) or rest[:1].isdigit():
        return "Write the digits of a number without signs or spaces between them"
    return ""

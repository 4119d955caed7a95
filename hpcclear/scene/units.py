"""Strings with a unit ("0.3 mm", "5000 rpm") to numbers in SI.

The grammar is deliberately small: a decimal number, then unit names with whole powers. Scene files
come from anywhere, and a general expression parser would evaluate whatever stands in them.

An angle is a dimension of its own here; plain dimensional analysis takes a turn a second for 6.28 Hz. Three quantities have a
unit of 1/s, and each entry declares its own: "rad/s" an angular speed, "Hz" a frequency in cycles, "1/s" a rate that counts
nothing. A turn is a cycle. An angular speed in 1/min means revolutions, as on nameplates, and that reading is noted (`noting`).
"""

import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from fractions import Fraction
from functools import lru_cache
from math import isfinite, pi
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pint import UnitRegistry

_NUMBER = r"[+-]?(?:\d{1,40}\.?\d{0,40}|\.\d{1,40})(?:[eE][+-]?\d{1,3})?"
_NAME = r"[A-Za-zµμ°%]{1,20}+(?:(?:\^|\*\*)-?\d|⁻?[¹²³])?"
_UNIT = rf"(?:(?:(?<=\s)1\s*)?/\s*)?{_NAME}(?:\s*[*/·]?\s*{_NAME}){{0,7}}"  # "1/min" and "/min" too
_QUANTITY = re.compile(rf"\s*({_NUMBER})\s*({_UNIT})?\s*")
_RAISED = re.compile("(⁻?)([¹²³])")
_TURNS = re.compile(r"\b(?:rev|r|U|tr)(?=\s*/)")  # on nameplates: r/min, U/min, tr/min
_LONGEST = 80
_TURN = Fraction(2 * pi)


class UnitError(ValueError):
    """A string that is no quantity of the expected unit; `remedy` says what to write."""

    def __init__(self, reason: str, remedy: str) -> None:
        self.reason = reason
        self.remedy = remedy
        super().__init__(reason, remedy)


@lru_cache(maxsize=1)
def _registry() -> "UnitRegistry[Any]":
    # Imported here because it costs about half a second, and most scenes are plain numbers. Exact
    # fractions make "0.3 mm" the same float as 3e-4, so that the spelling of a number cannot change
    # a result.
    from pint import UnitRegistry

    return UnitRegistry(non_int_type=Fraction)


# The usual ones, known without the registry, because importing it takes longer than a simulation.
_COMMON = {
    ("m", "m"): Fraction(1),
    ("cm", "m"): Fraction(1, 100),
    ("mm", "m"): Fraction(1, 1000),
    ("um", "m"): Fraction(1, 10**6),
    ("kg", "kg"): Fraction(1),
    ("g", "kg"): Fraction(1, 1000),
    ("GPa", "Pa"): Fraction(10**9),
    ("MPa", "Pa"): Fraction(10**6),
    ("kg*m^2", "kg*m**2"): Fraction(1),
    ("N", "N"): Fraction(1),
    ("kN", "N"): Fraction(1000),
    ("N/m", "N/m"): Fraction(1),
    ("N/mm", "N/m"): Fraction(1000),
    ("N*s/m", "N*s/m"): Fraction(1),
    ("m/s", "m/s"): Fraction(1),
    ("mm/s", "m/s"): Fraction(1, 1000),
    ("Hz", "Hz"): Fraction(1),
    ("1/s", "1/s"): Fraction(1),
    ("rpm", "rad/s"): _TURN / 60,
    ("rad/s", "rad/s"): Fraction(1),
    ("deg", "rad"): Fraction(pi) / 180,
}


Dimensions = dict[str, Fraction]
"""Exponents of base units, the radian among them."""


def _rooted(unit: Any) -> tuple[Fraction, Dimensions]:
    """Factor to base units, and their exponents."""
    scale: Any
    scale, base = _registry().get_root_units(unit)
    exponents: Mapping[Any, Any] = base._units
    return Fraction(scale), {str(name): Fraction(power) for name, power in exponents.items()}


@lru_cache(maxsize=256)
def _parsed(unit: str) -> tuple[Fraction, Dimensions, dict[str, Dimensions]]:
    """Factor to base units, dimensions, and those of each unit named; ValueError says why there are none."""
    from pint import UndefinedUnitError
    from pint.errors import DefinitionSyntaxError, OffsetUnitCalculusError

    plain = _RAISED.sub(lambda m: f"**{'-' if m[1] else ''}{'¹²³'.index(m[2]) + 1}", unit.strip())
    plain = _TURNS.sub("turn", plain.replace("·", "*").replace("%", "percent"))
    try:
        source = _registry().parse_units(f"1{plain}" if plain.startswith("/") else plain)
        scale, base = _rooted(source)
        names = {str(name): _rooted(name)[1] for name in source._units}
        return scale, base, names
    except UndefinedUnitError:
        raise ValueError(f"{unit!r} is not a known unit") from None
    except (
        OffsetUnitCalculusError, DefinitionSyntaxError, ValueError, AttributeError, TypeError, KeyError,
    ):  # fmt: skip
        raise ValueError(f"{unit!r} cannot be read as a unit") from None


@lru_cache(maxsize=256)
def factor(unit: str, target: str) -> Fraction:
    """What one `unit` is in `target`, the unit of an entry; raises UnitError when they are of different quantities."""
    if (unit, target) in _COMMON:
        return _COMMON[unit, target]
    expected = (
        f"Write it in {target}, or as a plain number in {target}"
        if target
        else "Write a plain number"
    )
    try:
        scale, base, names = _parsed(unit)
    except ValueError as error:
        raise UnitError(str(error), expected) from None
    own, wanted, _ = _parsed(target or "dimensionless")
    angle, expected_angle = (one.get("radian", 0) for one in (base, wanted))
    alike = {**base, "radian": 0} == {**wanted, "radian": 0}
    hertz = {"second": -1} in names.values()
    if target == "rad/s" and alike and hertz:  # off by 2 pi in every reader's mind
        raise UnitError("Hz is ambiguous for an angular speed", "Write rpm, rad/s or turn/s")
    if alike and not (target == "1/s" and hertz):  # a rate counts no cycles
        if angle == expected_angle and (target or names.keys() <= {"percent", "dimensionless"}):
            return scale / own
        if target == "Hz" and angle == 1:
            return scale / _TURN
        if target == "rad/s" and all(one == {"second": 1} for one in names.values()):
            return scale * _TURN
    what = f"a quantity in {target}" if target else "a number without a unit"
    raise UnitError(f"the unit {unit!r} does not fit: this is {what}", expected)


_NOTED: ContextVar[Callable[[str, str], None] | None] = ContextVar("noted", default=None)


@contextmanager
def noting(take: Callable[[str, str], None]) -> Iterator[None]:
    """Within it, `take` gets each text that leaves its unit open, and a sentence that says how it is read."""
    token = _NOTED.set(take)
    try:
        yield
    finally:
        _NOTED.reset(token)


def note_turns(text: str, number: str, unit: str, target: str) -> None:
    """Note how `text` is read, where `number` of `unit`, which fits the target, is an angular speed in turns by time alone."""
    take = _NOTED.get()
    if take is None or target != "rad/s" or (unit, target) in _COMMON:
        return
    if "radian" not in _parsed(unit)[1]:
        turns = float(60 * Fraction(number) * factor(unit, target) / _TURN)
        take(text, f"{turns:.6g} rpm, revolutions per minute; for radians write rad/s")


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
    found = _QUANTITY.fullmatch(text) if len(text) <= _LONGEST else None
    if found is None:
        example = {
            "m": '"0.3 mm"',
            "rad/s": '"5000 rpm"',
            "Pa": '"206.8 GPa"',
            "rad": '"30 deg"',
            "Hz": '"20 Hz"',
        }.get(target)
        hint = f", such as {example}" if example else ""
        raise UnitError(
            f"the text is not a number with a unit of {shown}",
            f"Write a number in {shown}" + (f", or a string with a unit{hint}" if target else ""),
        )
    number, unit = found.groups()
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


def decimal(text: str) -> float:
    """A decimal number without a unit; raises UnitError (for "nan" and "inf" too)."""
    if re.fullmatch(_NUMBER, text) is None or not isfinite(float(text)):
        raise UnitError("is not a finite decimal number", "Write a number such as 0.21")
    return float(text)

"""Strings with a unit ("0.3 mm", "5000 rpm") to numbers in SI.

The grammar is deliberately small: a decimal number, then unit names with whole powers. Scene files
come from anywhere, and a general expression parser would evaluate whatever stands in them.
"""

import re
from fractions import Fraction
from functools import lru_cache
from math import isfinite, pi
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pint import UnitRegistry

_NUMBER = r"[+-]?(?:\d{1,40}\.?\d{0,40}|\.\d{1,40})(?:[eE][+-]?\d{1,3})?"
_NAME = r"[A-Za-zµμ°%]{1,20}(?:(?:\^|\*\*)-?\d)?[²³]?"
_QUANTITY = re.compile(rf"\s*({_NUMBER})\s*({_NAME}(?:\s*[*/·]?\s*{_NAME}){{0,7}})?\s*")
_LONGEST = 80


class UnitError(ValueError):
    """A string that is no quantity of the expected unit; `remedy` says what to write."""

    def __init__(self, reason: str, remedy: str) -> None:
        self.reason = reason
        self.remedy = remedy
        super().__init__(reason, remedy)


@lru_cache(maxsize=1)
def _registry() -> "UnitRegistry":
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
    ("Hz", "1/s"): Fraction(1),
    ("1/s", "1/s"): Fraction(1),
    ("rpm", "rad/s"): Fraction(2 * pi) / 60,
    ("rad/s", "rad/s"): Fraction(1),
    ("deg", "rad"): Fraction(pi) / 180,
}


@lru_cache(maxsize=256)
def factor(unit: str, target: str) -> Fraction:
    """What one `unit` is in `target` (SI), exactly; raises UnitError when the dimensions differ."""
    if (unit, target) in _COMMON:
        return _COMMON[unit, target]
    from pint import DimensionalityError, UndefinedUnitError
    from pint.errors import DefinitionSyntaxError, OffsetUnitCalculusError

    registry = _registry()
    plain = unit.replace("·", "*").replace("²", "**2").replace("³", "**3").replace("%", "percent")
    expected = (
        f"Write it in {target}, or as a plain number in {target}"
        if target
        else "Write a plain number"
    )
    try:
        source = registry.parse_units(plain)
        magnitude = registry.Quantity(Fraction(1), source).to(target or "dimensionless").magnitude
    except UndefinedUnitError:
        raise UnitError(f"{unit!r} is not a known unit", expected) from None
    except (DimensionalityError, OffsetUnitCalculusError):
        what = f"a quantity in {target}" if target else "a number without a unit"
        raise UnitError(f"the unit {unit!r} does not fit: this is {what}", expected) from None
    except (DefinitionSyntaxError, ValueError, AttributeError, TypeError, KeyError):
        raise UnitError(f"{unit!r} cannot be read as a unit", expected) from None
    # One hertz passes for one radian a second in dimensional analysis, and is off by 2 pi in every
    # reader's mind.
    names = {str(name) for name in source._units}
    if "rad" in target and any(name.endswith("hertz") for name in names):
        raise UnitError("Hz is ambiguous for an angular speed", "Write rpm, rad/s or turn/s")
    if target == "" and not names <= {"percent", "dimensionless"}:
        raise UnitError(
            f"the unit {unit!r} does not fit: this is a number without a unit", expected
        )
    return Fraction(magnitude)


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
        return float(Fraction(number) * factor(unit, target))
    except OverflowError:
        raise UnitError("the number is too large", f"Write a finite number in {shown}") from None


def decimal(text: str) -> float:
    """A decimal number without a unit; raises UnitError (for "nan" and "inf" too)."""
    if re.fullmatch(_NUMBER, text) is None or not isfinite(float(text)):
        raise UnitError("is not a finite decimal number", "Write a number such as 0.21")
    return float(text)

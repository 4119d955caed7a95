"""Numbers with units, as Pint has them: what functions of laws and objectives are run on to check their units."""

from functools import lru_cache
from typing import Any

import numpy as np

from hpcclear.base.unit_names import UNITS, parts
from hpcclear.laws.declared import Function
from hpcclear.laws.translate import LawError

Quantity = Any
"""Of Pint, which has no types here, or a plain number."""


@lru_cache(maxsize=1)
def registry() -> Any:
    """Pint's units."""
    from pint import UnitRegistry

    return UnitRegistry()


def _pure(x: Quantity) -> Quantity:
    return x.to("").magnitude if hasattr(x, "magnitude") else x


def _size_and_sign(x: Quantity, y: Quantity) -> Quantity:
    size = y.magnitude if hasattr(y, "magnitude") else y
    return -abs(x) if size < 0 else abs(x)


def _of_pure(function: Function) -> Function:
    def of(x: Quantity) -> Quantity:
        if np.iscomplexobj(pure := _pure(x)):
            raise ValueError("complex number")
        return registry().Quantity(float(function(pure)), "")

    return of


WORDS = {
    "sqrt": lambda x: x**0.5,
    "fabs": abs,
    "absolute": abs,
    "copysign": _size_and_sign,
    "pow": lambda x, y: x ** _pure(y),
    "power": lambda x, y: x ** _pure(y),
    "minimum": min,
    "maximum": max,
    **{name: _of_pure(getattr(np, name)) for name in ("exp", "log", "tanh", "arctan")},
    "atan": _of_pure(np.arctan),
}
"""What functions may call, for such numbers."""

_NAMED = {
    frozenset(dimensions.items()): name
    for name, dimensions in (
        ("newton", UNITS["N"][1]), ("pascal", UNITS["Pa"][1]), ("joule", UNITS["J"][1]), ("watt", UNITS["W"][1]),
    )
}  # fmt: skip
"""Pint's names of units, so that fractional powers of one cancel to the last digit."""


def unit_of(unit: str, name: str) -> Quantity:
    """One of a unit, as pint has it; LawError says of which number it is not known."""
    made = registry().Quantity(1.0, "")
    if not isinstance(unit, str):
        raise LawError(f"the unit of {name} is {unit!r}", 'Write it in quotes, "s/m"')
    try:
        for _, (size, own), power in parts(unit) if unit else ():
            known = _NAMED.get(frozenset(own.items()))
            powers = (
                {base: float(one) for base, one in own.items()} if known is None else {known: 1.0}
            )
            scale = size if known is None else size / 1000
            one = registry().Quantity(float(scale), registry().UnitsContainer(powers))
            made = made * one ** float(power)
    except ValueError:
        reason = f"the unit {unit!r} of {name} is not known"
        raise LawError(reason, "Write, say, s/m") from None
    return made

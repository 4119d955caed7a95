"""What a value of a design variable costs: by a law of its width, by IT grades of a fit, or option by option.

Sources: M. F. Spotts, "Allocation of tolerances to minimize cost of assembly", J. Eng. Ind. 95 (1973), for the reciprocal of
the square; F. H. Speckhart, "Calculation of tolerance based on a minimum cost approach", J. Eng. Ind. 94 (1972), for the
exponential; K. W. Chase and W. H. Greenwood, "Design issues in mechanical tolerance analysis", Manuf. Rev. 1 (1988), for both.
"""

import re
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal

import numpy as np

from hpcclear.base.errors import at
from hpcclear.scene.fields import Quantity, Table, invalid

_COST = Quantity("", least=0)
_GRADES = re.compile(r"[A-Za-z]{1,2}(\d+)\s*/\s*[A-Za-z]{1,2}(\d+)\s*$")


class Cost(Table):
    """A cost that decreases with the value, or one cost for each option."""

    law: Literal["reciprocal", "exponential"] | None = None
    """"reciprocal": fixed + cost (at / value)^power; "exponential": fixed + cost exp((at - value) / scale)."""
    at: float | None = None
    """Reference value, SI, at which the cost is `cost`."""
    cost: Annotated[float, _COST] | None = None
    """Cost at the reference value `at`, in addition to `fixed`."""
    fixed: Annotated[float, Quantity("")] = 0.0
    """Cost that does not depend on the value."""
    power: Annotated[float, Quantity("", above=0, most=10)] = 1.0
    """Exponent of the law "reciprocal"."""
    scale: float | None = None
    """For the law "exponential": increase of the value that reduces the cost to 1/e, SI."""
    options: tuple[float, ...] | None = None
    """Cost of each option of the variable, in their order."""

    @classmethod
    def in_si(cls, given: object, unit: str, fits: Sequence[object] = ()) -> Any:
        """A cost as a file has it, as the entries of this table: a list for all options, for fits a table by IT grades; errors
        for validators."""
        if isinstance(given, (list, tuple)):
            return {"options": _converted(given)}
        if not isinstance(given, Mapping) or "options" in given:
            return given
        if fits:
            return {"options": _by_grades(given, fits)}
        made = dict(given)
        for key in ("at", "scale"):
            if key in made:
                with at(f"cost.{key}", made[key]):
                    made[key] = Quantity(unit, above=0).convert(made[key])
        return made

    def _check(self) -> None:
        if self.options is not None:
            return
        needed = {"reciprocal": ("at", "cost"), "exponential": ("at", "cost", "scale")}
        if self.law is None:
            raise invalid(
                "the law of the cost is missing",
                'Write law = "reciprocal" or "exponential", or a list with the cost of each option',
                "law", None,
            )  # fmt: skip
        for key in needed[self.law]:
            if getattr(self, key) is None:
                raise invalid(f"the law {self.law!r} needs it", "Add it", key, None)
        if self.law == "reciprocal" and self.scale is not None:
            raise invalid('belongs to "exponential"', "Remove it", "scale")

    def of(self, values: Any, options: Sequence[float] | None) -> Any:
        """Costs of values, a number or (n,)."""
        if self.options is not None:
            assert options is not None  # by validation
            away = abs(np.asarray(values)[..., None] - np.asarray(options))
            return np.array(self.options)[away.argmin(axis=-1)]
        assert self.at is not None
        assert self.cost is not None  # both by validation
        if self.law == "reciprocal":
            return self.fixed + self.cost * (self.at / values) ** self.power
        return self.fixed + self.cost * np.exp((self.at - values) / self.scale)


def _converted(given: Sequence[object]) -> list[float]:
    found = []
    for k, one in enumerate(given):
        with at(f"cost.{k}", one):
            found.append(Quantity("").convert(one))
    return found


def _by_grades(given: Mapping[str, object], fits: Sequence[object]) -> list[float]:
    """Costs of fits: that of the hole's grade and that of the shaft's."""
    found = []
    for fit in fits:
        grades = _GRADES.search(str(fit))
        total = 0.0
        for grade in grades.groups() if grades else ():
            if f"IT{grade}" not in given:
                raise invalid(
                    f"has no cost of IT{grade}, which {fit!r} needs", f"Add IT{grade} = ...", "cost"
                )
            total += _converted([given[f"IT{grade}"]])[0]
        found.append(total)
    return found

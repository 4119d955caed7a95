"""Variables that take some values only: numbers of a list or a grid, rows of a catalogue, fits by ISO 286; and their costs.

The column of a catalogue or of fits holds the number of a row, from 0 on; what the row stands for is put in its place where
designs are simulated (`expanded`).

Sources of the laws of cost: M. F. Spotts, "Allocation of tolerances to minimize cost of assembly", J. Eng. Ind. 95 (1973), for
the reciprocal of the square; F. H. Speckhart, "Calculation of tolerance based on a minimum cost approach", J. Eng. Ind. 94
(1972), for the exponential; K. W. Chase and W. H. Greenwood, "Design issues in mechanical tolerance analysis", Manuf. Rev. 1
(1988), for both.
"""

import re
from collections.abc import Mapping, Sequence
from typing import Annotated, Literal

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import at, nearest
from hpcclear.scene.fields import Entries, Number, Quantity, Table, check_known, invalid
from hpcclear.scene.fits import fit_of
from hpcclear.scene.paths import flatten, quantities

MOST = 1000
"""Values of a variable at most."""

OF_RANDOM = "random."
"""What entries of random inputs begin with, as paths of variables."""

OF_INPUT = {
    "half_width": True, "deviation": True, "mean": True, "scale": True, "location": True, "shape": False, "fit": False,
    "bore.cp": False, "bore.cpk": False, "pin.cp": False, "pin.cpk": False,
}  # fmt: skip
"""Entries of random inputs that a variable may drive, and whether they have the unit of the input."""


class CatalogueRow(Table):
    """A row of a catalogue: the values of all entries if it is chosen."""

    name: str
    cost: Annotated[float, Quantity("")] | None = None
    """Cost of this row, in one unit for all costs of the study."""
    entries: dict[str, float | str]
    """Values by path: numbers of the scene, SI, and entries of random inputs."""

    @classmethod
    def _of_file(cls, row: Entries) -> Entries:
        """Paths beside the name, as a file has them, as `entries` in SI."""
        if "entries" in row:
            return row
        kept = {key: row[key] for key in ("name", "cost") if key in row}
        rest = {key: value for key, value in row.items() if key not in kept}
        entries = dict(flatten(rest))  # quoted, or as nested tables
        for path, value in entries.items():
            if path.startswith(OF_RANDOM):
                input_entry(path)
                continue
            if path not in quantities():
                remedy = nearest(path, tuple(quantities()))
                raise invalid("is not a physical number of a scene", remedy, path, value)
            with at("", value):
                entries[path] = quantities()[path].convert(value, path)
        if not entries:
            raise invalid("has no entry", 'Write "joints.crank_rod.clearance" = "20 um", say')
        return {**kept, "entries": entries}


def input_entry(path: str) -> tuple[str, str]:
    """Name and entry of the random input of a path such as "random.C12.half_width"; an error for validators if it is none."""
    _, _, rest = path.partition(".")
    name, _, entry = rest.partition(".")
    check_known(entry, OF_INPUT, "is no entry of a random input that a variable may drive", "path")
    return name, entry


def rows_of_fits(fits: Sequence[str], follows: Sequence[str]) -> tuple[CatalogueRow, ...]:
    """Fits as rows: clearance and bearing radius of the joints that have them, and what random inputs follow them."""
    rows = []
    for text in fits:
        fit, entries = fit_of(text), dict[str, float | str]()
        for path in follows:
            owner = path.removesuffix(".fit")
            if path.startswith(OF_RANDOM):
                entries[path] = text
            else:
                entries[f"{owner}.clearance"] = fit.clearance
                entries[f"{owner}.bearing_radius"] = fit.bearing_radius
        rows.append(CatalogueRow(name=text, entries=entries))
    return tuple(rows)


def checked_names(names: Sequence[str], key: str) -> None:
    """An error for validators unless there are two or more, all different."""
    if not 2 <= len(names) <= MOST:
        raise invalid(f"from 2 to {MOST} of them are expected here", "Write a list", key)
    twice = next((name for name in names if list(names).count(name) > 1), None)
    if twice is not None:
        raise invalid(f"{twice!r} stands there twice", "Remove one", key)


def grid(lower: float, upper: float, step: float) -> tuple[float, ...]:
    """Values from `lower` on by `step`, up to `upper`; an error for validators if there are too few or too many."""
    count = int(np.floor((upper - lower) / step * (1 + 1e-12) + 1e-9)) + 1 if step > 0.0 else 0
    if not 2 <= count <= MOST:
        raise invalid(f"gives {count} values, from 2 to {MOST} are expected", "Correct it", "step")
    return tuple(lower + step * k for k in range(count))


_COST = Quantity("", least=0)
_GRADES = re.compile(r"[A-Za-z]{1,2}(\d+)\s*/\s*[A-Za-z]{1,2}(\d+)\s*$")


class Cost(Table):
    """A cost that decreases with the value, or one cost for each option."""

    law: Literal["reciprocal", "exponential"] | None = None
    """"reciprocal": fixed + cost (at / value)^power; "exponential": fixed + cost exp((at - value) / scale)."""
    at: Number = None
    """Reference value, SI, at which the cost is `cost`."""
    cost: Annotated[float, _COST] | None = None
    """Cost at the reference value `at`, in addition to `fixed`."""
    fixed: Annotated[float, Quantity("")] = 0.0
    """Cost that does not depend on the value."""
    power: Annotated[float, Quantity("", above=0, most=10)] = 1.0
    """Exponent of the law "reciprocal"."""
    scale: Number = None
    """For the law "exponential": increase of the value that reduces the cost to 1/e, SI."""
    options: tuple[float, ...] | None = None
    """Cost of each option of the variable, in their order."""

    @classmethod
    def in_si(cls, given: object, unit: str, fits: Sequence[object] = ()) -> object:
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
                made[key] = Quantity(unit, above=0).convert(made[key], f"cost.{key}")
        return made

    def _check(self) -> None:
        if self.options is not None:
            return
        needed = {"reciprocal": ("at", "cost"), "exponential": ("at", "cost", "scale")}
        if self.law is None:
            remedy = 'Write law = "reciprocal" or "exponential", or a list with each option\'s cost'
            raise invalid("the law of the cost is missing", remedy, "law")
        for key in needed[self.law]:
            if getattr(self, key) is None:
                raise invalid(f"the law {self.law!r} needs it", "Add it", key)
        if self.law == "reciprocal" and self.scale is not None:
            raise invalid('belongs to "exponential"', "Remove it", "scale")

    def of(self, values: Array | float, options: Sequence[float] | None) -> Array | float:
        """Costs of values, a number or (n,)."""
        if self.options is not None:
            assert options is not None  # by validation
            away = abs(np.asarray(values)[..., None] - np.asarray(options))
            return np.array(self.options)[away.argmin(axis=-1)]
        assert self.at is not None
        assert self.cost is not None  # both by validation
        if self.law == "reciprocal":
            return self.fixed + self.cost * (self.at / values) ** self.power
        assert self.scale is not None
        return self.fixed + self.cost * np.exp((self.at - values) / self.scale)


def _converted(given: Sequence[object]) -> list[float]:
    return [Quantity("").convert(one, f"cost.{k}") for k, one in enumerate(given)]


def _by_grades(given: Mapping[str, object], fits: Sequence[object]) -> list[float]:
    """Costs of fits: that of the hole's grade and that of the shaft's."""
    found = []
    for fit in fits:
        grades = _GRADES.search(str(fit))
        total = 0.0
        for grade in grades.groups() if grades else ():
            if f"IT{grade}" not in given:
                raise invalid(f"has no cost of IT{grade} ({fit!r})", f"Add IT{grade} = ...", "cost")
            total += _converted([given[f"IT{grade}"]])[0]
        found.append(total)
    return found

"""Tables of pairs in scenes: loads against an angle or the time, motions of drives, laws of distance, speed or depth."""

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pydantic.json_schema import JsonSchemaValue

from hpcclear.base.pieces import Rows
from hpcclear.base.units import shows_point
from hpcclear.scene.fields import LONGEST_CURVE, OF_FILE, Converted, Quantity, invalid

Curve = float | Rows
"""A constant, or pairs (crank angle in rad, value), repeated every revolution. Between two rows lies a monotone cubic."""
MOST_ROWS = 16
"""Rows of a table whose corners count in each step of the integration."""
NEAREST = 1e-9
"""Of the range of such a table: distance of two rows between which steps can end."""


@dataclass(frozen=True)
class Pairs(Converted):
    """A table ``[[x, y], ...]`` in two units, x rising; or a constant, where that is allowed."""

    x: str
    unit: str
    words: tuple[str, str] = ("x", "y")
    constant: bool = False
    fewest: int = 2
    most: int = MOST_ROWS
    """Rows; more than `MOST_ROWS` may come from a file."""
    least: float | None = None
    """Of the first numbers."""

    @property
    def _shown(self) -> str:
        return f"[[{self.words[0]} in {self.x}, {self.words[1]} in {self.unit}], ...]"

    def convert(self, value: object) -> Any:
        """A number, or a tuple of pairs in SI; an error for validators where it is none."""
        if isinstance(value, Mapping) and "file" in value:
            reason = "files are read where a scene is loaded, and this came another way"
            raise invalid(reason, "Load a scene with it, or give pairs")
        if self.constant and not isinstance(value, (list, tuple)):
            return Quantity(self.unit).convert(value)
        number = f"a number in {self.unit}, or " if self.constant else ""
        remedy = f"Write {number}pairs {self._shown}"
        if not isinstance(value, (list, tuple)) or not self.fewest <= len(value) <= self.most:
            raise invalid(f"a table of {self.fewest} to {self.most} pairs is expected here", remedy)
        if any(not isinstance(row, (list, tuple)) or len(row) != 2 for row in value):
            raise invalid(f"every row of a table is a pair [{', '.join(self.words)}]", remedy)
        first, second = Quantity(self.x), Quantity(self.unit)
        # a point before decimals of one number shows what those of the others are
        point = any(shows_point(one) for row in value for one in row)
        rows = tuple((first.convert(x, "", point), second.convert(y, "", point)) for x, y in value)
        if any(b[0] <= a[0] for a, b in itertools.pairwise(rows)):
            reason = f"the {self.words[0]}s must rise from row to row"
            raise invalid(reason, f"Sort the rows, each {self.words[0]} once")
        least = NEAREST * (rows[-1][0] - rows[0][0])
        if self.most == MOST_ROWS and any(b[0] - a[0] < least for a, b in itertools.pairwise(rows)):
            reason = f"two rows are nearer to each other than {NEAREST:g} of the table's range"
            raise invalid(reason, f"Write them {least:.1g} {self.x} or more apart")
        if self.least is not None and rows[0][0] < self.least:
            raise invalid(f"the first number is below {self.least:g}", remedy)
        return rows

    def json_schema(self) -> JsonSchemaValue:
        """Pairs, a file of them, or a number."""
        number, text = {"type": "number"}, {"type": "string"}
        pair = {"type": "array", "items": {"anyOf": [number, text]}, "minItems": 2, "maxItems": 2}
        table = {"type": "array", "items": pair, "minItems": self.fewest, "maxItems": self.most}
        choices = [*([number, text] if self.constant else []), table]
        choices += [OF_FILE] if self.most > MOST_ROWS else []
        words = f"{self.unit}; constant, or {self._shown}" if self.constant else self._shown
        return {"anyOf": choices, "description": words}


def by_angle(unit: str) -> Pairs:
    """A constant or a table against an angle, which may come from a file; such an entry may be varied while it is constant."""
    return Pairs("rad", unit, ("angle", "value"), constant=True, most=LONGEST_CURVE)


def by_time(unit: str, value: str = "value", fewest: int = 2) -> Pairs:
    """A table against the time in s, from 0 s on, which may come from a file."""
    return Pairs("s", unit, ("time", value), fewest=fewest, most=LONGEST_CURVE, least=0.0)


LONGER = "For more turns give its drive `turns`, 2 for the 720 degrees of a four-stroke engine"


def check_period(pairs: Rows, turns: int, key: str) -> None:
    """An error for validators unless a table against the angle repeats within so many turns."""
    span, turn = pairs[-1][0] - pairs[0][0], 2 * math.pi * turns
    length = "one turn" if turns == 1 else f"{turns} turns"
    if span > turn * (1 + 1e-12):
        remedy = f"Give {length} ({2 * turns} pi rad, {360 * turns} deg); it repeats. {LONGER}"
        raise invalid(f"the table is longer than {length}", remedy, key)
    if span > turn * (1 - 1e-12) and pairs[-1][1] != pairs[0][1]:
        reason = f"the curve repeats every {length}, but its last value differs from its first"
        raise invalid(reason, "Make both equal, or leave the last row out", key)

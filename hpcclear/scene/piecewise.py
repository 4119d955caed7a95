"""Tables that run straight from row to row and stay level beyond both ends."""

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import GetJsonSchemaHandler
from pydantic_core import CoreSchema

from hpcclear.scene.fields import LONGEST_CURVE, OF_FILE, Converted, Quantity, invalid, pairs_in

MOST_ROWS = 16
"""Rows of a table: every one costs each step."""


@dataclass(frozen=True)
class Piecewise(Converted):
    """A table ``[[x, y], ...]`` in two units, straight from row to row, level beyond; or a constant, where that is allowed."""

    x: str
    unit: str
    constant: bool = False
    most: int = MOST_ROWS
    least: float | None = None
    """Of the first numbers."""

    def convert(self, value: object) -> Any:
        """A number, or a tuple of pairs in SI; an error for validators where it is none."""
        if self.constant and not isinstance(value, (list, tuple)):
            return Quantity(self.unit).convert(value)
        if isinstance(value, Mapping) and "file" in value:
            raise invalid(
                "files are read where a scene is loaded, and this came another way",
                "Load a scene with it, or give pairs",
            )
        remedy = f"Write pairs [[x in {self.x}, y in {self.unit}], ...], x rising"
        if not isinstance(value, (list, tuple)) or not 2 <= len(value) <= self.most:
            raise invalid(f"a table of 2 to {self.most} pairs is expected here", remedy)
        rows = pairs_in(value, self.x, self.unit, "[x, y]", remedy)
        if any(b[0] <= a[0] for a, b in itertools.pairwise(rows)):
            raise invalid("the first numbers must rise from row to row", "Sort the rows")
        if self.least is not None and rows[0][0] < self.least:
            raise invalid(f"the first number is below {self.least:g}", remedy)
        return rows

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        entry = {"type": ["number", "string"]}
        pair = {"type": "array", "items": entry, "minItems": 2, "maxItems": 2}
        table = {"type": "array", "items": pair, "minItems": 2, "maxItems": self.most}
        words = f"[[x in {self.x}, y in {self.unit}], ...]"
        if self.constant:
            return {"anyOf": [entry, table], "description": f"{self.unit}; constant, or {words}"}
        if self.most > MOST_ROWS:
            return {"anyOf": [table, OF_FILE], "description": words}
        return {**table, "description": words}


def by_time(unit: str) -> Piecewise:
    """A table against the time in s, from 0 s on, which may come from a file."""
    return Piecewise("s", unit, most=LONGEST_CURVE, least=0.0)

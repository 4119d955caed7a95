"""Tables of loads that follow a law of their own; `hpcclear.dynamics.linkage.loads` has the physics."""

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import GetJsonSchemaHandler, model_validator
from pydantic_core import CoreSchema

from hpcclear.scene.fields import LONGEST_CURVE, OF_FILE, Converted, Quantity, Table, invalid
from hpcclear.scene.places import Angle

MOST_ROWS = 16
"""Rows of a table: every one costs each step."""


@dataclass(frozen=True)
class Law(Converted):
    """A table ``[[x, y], ...]`` in two units, straight from row to row, level beyond; or a constant, where that is allowed."""

    x: str
    unit: str
    constant: bool = False
    most: int = MOST_ROWS
    least: float | None = None
    """Of the first numbers."""

    def convert(self, value: object) -> Any:
        """A number, or a tuple of pairs in SI; raises PydanticCustomError."""
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
        if any(not isinstance(row, (list, tuple)) or len(row) != 2 for row in value):
            raise invalid("every row of a table is a pair", remedy)
        first, second = Quantity(self.x), Quantity(self.unit)
        rows = tuple((first.convert(x), second.convert(y)) for x, y in value)
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


def by_time(unit: str) -> Law:
    """A table against the time in s, from 0 s on, which may come from a file."""
    return Law("s", unit, most=LONGEST_CURVE, least=0.0)


class TorsionSpringLoad(Table):
    """A spring, a damper and end stops on the angle of a body."""

    name: str
    kind: Literal["torsion-spring"]
    body: str
    """Body on which it acts."""
    other: str | None = None
    """Second body, on which the reaction acts; default: the ground."""
    stiffness: Annotated[float, Quantity("N*m/rad", least=0)] = 0.0
    """Stiffness, N m/rad."""
    angle: Angle = 0.0
    """Angle at which it exerts no torque, rad: from the x axis, or relative to the other body."""
    damping: Annotated[float, Quantity("N*m*s/rad", least=0)] = 0.0
    """Damping, N m s/rad."""
    lower: Angle | None = None
    """Lower stop, rad: below this angle `stop_stiffness` acts in addition."""
    upper: Angle | None = None
    """Upper stop, rad: above this angle `stop_stiffness` acts in addition."""
    stop_stiffness: Annotated[float, Quantity("N*m/rad", least=0)] = 0.0
    """Stiffness of the stops, N m/rad."""

    @model_validator(mode="after")
    def _stops(self) -> "TorsionSpringLoad":
        stops = self.lower is not None or self.upper is not None
        if stops != (self.stop_stiffness > 0.0):
            raise invalid(
                "stops and their stiffness go together",
                "Give lower or upper, and stop_stiffness above 0",
                key="stop_stiffness",
                value=self.stop_stiffness,
            )
        if self.lower is not None and self.upper is not None and self.lower >= self.upper:
            raise invalid("is not below the upper stop", "Swap both", key="lower", value=self.lower)
        return self


class CylinderLoad(Table):
    """A force between two points by a law of their distance: cylinder, gas spring, end stop, cable."""

    name: str
    kind: Literal["cylinder"]
    first: str
    """``body.point``, or ``ground.point``."""
    second: str
    """``body.point``, or ``ground.point``."""
    force: Annotated[Any, Law("m", "N", constant=True)]
    """Force that pushes both points apart (negative: together), N; constant or ``[[distance, force], ...]``."""
    damping: Annotated[float, Quantity("N*s/m", least=0)] = 0.0
    """Damping along the line between both points, N s/m."""


class DragLoad(Table):
    """A torque that resists the rotation of a body."""

    name: str
    kind: Literal["drag"]
    body: str
    """Body whose rotation relative to the ground is resisted."""
    linear: Annotated[float, Quantity("N*m*s/rad", least=0)] = 0.0
    """Torque per angular speed, N m s/rad."""
    quadratic: Annotated[float, Quantity("N*m*s**2/rad**2", least=0)] = 0.0
    """Torque per square of the angular speed, N m s2/rad2, as of a fan."""

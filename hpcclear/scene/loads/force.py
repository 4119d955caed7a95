"""A force at a point: gas, wind, the resistance of a workpiece."""

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import StrictBool

from hpcclear.base.arrays import Array
from hpcclear.base.pieces import Rows
from hpcclear.base.terms import Acting, Term
from hpcclear.scene.curves import Curve, by_angle, by_time
from hpcclear.scene.fields import Angle, PairTable, Quantity, invalid
from hpcclear.scene.loads.declared import SizedLoad


class Components(PairTable):
    """A force by its components along the ground's axes, N. ``[x, y]`` is a short form."""

    x: Annotated[float, Quantity("N")]
    """x component, N."""
    y: Annotated[float, Quantity("N")]
    """y component, N."""


class ForceLoad(SizedLoad):
    """A force at a point: by its components along the ground's axes, or by size and direction."""

    kind: Literal["force"]
    place: str
    """``body.point`` on which the force acts."""
    force: Components | None = None
    size: Annotated[Curve, by_angle("N")] | None = None
    """Force along `direction`, N; constant, or a table against the angle of the body that defines the period. The angle
    is measured counter-clockwise from the x axis and includes `start_angle`, for both directions of rotation."""
    size_by_time: Annotated[Rows, by_time("N")] | None = None
    """Instead of `size`: ``[[time, size], ...]``, s and N, from 0 s on; smooth between the rows, constant after the last."""
    direction: Angle = 0.0
    """Angle of the force from the ground's x axis, rad."""
    follows: StrictBool = False
    """Whether the force rotates with the body. Components and direction then refer to the axes of the body."""

    size_entry: ClassVar[str] = "size"
    unit: ClassVar[str] = "N"

    def _check(self) -> None:
        remedy = "Write force = [x, y], or size and direction"
        self.check_one_of(remedy, "force", "size", "size_by_time")
        if self.force is not None and self.direction:
            raise invalid("is that of a size, and [x, y] has its own", remedy, "direction")

    def components(self) -> tuple[Array | float, Array | float]:
        """Force along x and y, N; where a curve has its size, the direction. Numbers or arrays of samples."""
        if self.force is not None:
            return self.force.x, self.force.y
        parts = np.array([np.cos(self.direction), np.sin(self.direction)])
        parts[np.abs(parts) < 1e-15] = 0.0  # a quarter turn is one, to the last bit
        return self.constant * parts[0], self.constant * parts[1]

    def numbers(self) -> dict[str, Array | float]:
        """Its components."""
        x, y = self.components()
        return {f"{self.name}_force_x": x, f"{self.name}_force_y": y}

    def act(self, on: Acting) -> Term:
        """The force at its place."""
        now = on.curve() if self.table else on.one
        parts = zip("xy", self.components(), strict=True)
        given = (on.parameter(f"force_{axis}") if part else on.zero for axis, part in parts)
        force = on.vector(self.name, *(part * now for part in given))
        if self.follows:
            body = self.place.partition(".")[0]
            force = on.vector(self.name, *on.along_ground(body, force))
        on.push(self.place, force)
        return on.power(self.place, force)

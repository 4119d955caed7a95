"""Tables of a planar linkage as a file would hold them: bodies, ground, joints, drives, loads.

Only read, not yet part of a scene: `load_scene` knows the slider-crank alone. `dynamics/planar.py` makes the mechanism.
"""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from hpcclear.scene.fields import (
    Converted,
    Curve,
    CurveOf,
    Length,
    Mass,
    NamedRows,
    PositiveLength,
    Quantity,
    Speed,
    Table,
    invalid,
    nearest,
)
from hpcclear.scene.mechanism import Material, check_journal

Pair = tuple[Length, Length]
Angle = Annotated[float, Quantity("rad")]
Rows = NamedRows()


class Points(Converted):
    """``{name = [x, y], ...}`` in m, kept in file order as pairs of name and place, because a dict would not be frozen."""

    def convert(self, value: Any) -> tuple[tuple[str, tuple[float, float]], ...]:
        """The points; raises PydanticCustomError."""
        if isinstance(value, tuple):
            return value
        if not isinstance(value, Mapping):
            raise invalid("named points are expected here", "Write { name = [x, y] }")
        length = Quantity("m")
        found = []
        for name, place in value.items():
            if not isinstance(place, (list, tuple)) or len(place) != 2:
                raise invalid("a point is a pair [x, y]", "Write [x, y] in m", key=str(name))
            found.append((str(name), (length.convert(place[0]), length.convert(place[1]))))
        return tuple(found)


NamedPoints = Annotated[tuple[tuple[str, tuple[float, float]], ...], Points()]


class PlanarBody(Table):
    """A rigid body."""

    name: str
    mass: Mass
    """kg."""
    inertia: Annotated[float, Quantity("kg*m**2", least=0)] = 0.0
    """About its mass centre, kg m2; of no consequence where it cannot turn."""
    center: Pair = (0.0, 0.0)
    """Mass centre in the body's own axes, m."""
    points: NamedPoints = ()
    """Where joints and loads act, in the body's own axes, m."""
    start_angle: Angle = 0.0
    """Rough angle at the start, rad: assembly starts from it."""


class Ground(Table):
    """What stands still."""

    points: NamedPoints = (("o", (0.0, 0.0)),)
    """m."""


class PlanarRevolute(Table):
    """A pin without play."""

    name: str
    kind: Literal["revolute"]
    journal: str
    """``body.point``"""
    bearing: str
    """``body.point``"""


class Materials(Table):
    """Of both partners of a contact."""

    bearing: Material
    journal: Material


class PlanarClearance(Table):
    """A journal in a bearing larger than itself."""

    name: str
    kind: Literal["clearance"]
    journal: str
    bearing: str
    clearance: PositiveLength
    """R_B - R_J, m."""
    bearing_radius: PositiveLength
    """R_B, m."""
    materials: Materials
    start_eccentricity: Pair = (0.0, 0.0)
    """Journal centre minus bearing centre at the start, m."""

    @model_validator(mode="after")
    def _journal_fits(self) -> "PlanarClearance":
        check_journal(self.clearance, self.bearing_radius)
        return self


class Rubbing(Table):
    """Friction of a guide."""

    coefficient: Annotated[float, Quantity("", least=0)]
    ramp_speed: Speed = 0.01
    """m/s."""


class PlanarSlide(Table):
    """A guide on the ground or on a body."""

    name: str
    kind: Literal["slide"]
    point: str
    """``body.point`` that moves along the line."""
    line: str
    """``body.point``, or ``ground.point``, on the line."""
    angle: Angle = 0.0
    """Direction of the line in its carrier's axes, rad."""
    friction: Rubbing | None = None


class PlanarFixed(Table):
    """A body held on the ground."""

    name: str
    kind: Literal["fixed"]
    point: str
    line: str
    angle: Angle = 0.0


PlanarJoint = Annotated[
    PlanarRevolute | PlanarClearance | PlanarSlide | PlanarFixed, Field(discriminator="kind")
]


class PlanarSpeed(Table):
    """A body turns at a constant speed."""

    name: str
    kind: Literal["constant-speed"]
    body: str
    speed: Annotated[float, Quantity("rad/s")]
    period: bool = False
    """Whether its turn is the revolution."""


class PlanarHarmonic(Table):
    """A body swings: mean + amplitude sin(2 pi frequency t + phase)."""

    name: str
    kind: Literal["harmonic"]
    body: str
    amplitude: Angle
    frequency: Annotated[float, Quantity("1/s", above=0)]
    mean: Angle = 0.0
    phase: Angle = 0.0
    period: bool = False


class PlanarTorque(Table):
    """A torque acts on a free body."""

    name: str
    kind: Literal["torque"]
    body: str
    torque: Annotated[Curve, CurveOf("N*m")]
    """N m, constant or over a turn of the body."""
    initial_speed: Annotated[float, Quantity("rad/s")]
    flywheel_inertia: Annotated[float, Quantity("kg*m**2", least=0)] = 0.0
    period: bool = False


PlanarDrive = Annotated[PlanarSpeed | PlanarHarmonic | PlanarTorque, Field(discriminator="kind")]


class ForceLoad(Table):
    """A force at a point, along the ground's axes."""

    name: str
    kind: Literal["force"]
    place: str
    force: tuple[Annotated[float, Quantity("N")], Annotated[float, Quantity("N")]]


class TorqueLoad(Table):
    """A torque on a body."""

    name: str
    kind: Literal["torque"]
    body: str
    torque: Annotated[float, Quantity("N*m")]


class SpringLoad(Table):
    """A spring and damper between two points."""

    name: str
    kind: Literal["spring"]
    first: str
    second: str
    stiffness: Annotated[float, Quantity("N/m", least=0)]
    length: Annotated[float, Quantity("m", least=0)] = 0.0
    damping: Annotated[float, Quantity("N*s/m", least=0)] = 0.0


PlanarLoad = Annotated[ForceLoad | TorqueLoad | SpringLoad, Field(discriminator="kind")]


class Planar(Table):
    """A planar linkage."""

    kind: Literal["planar"] = "planar"
    bodies: Annotated[tuple[PlanarBody, ...], Rows]
    ground: Ground = Ground()
    joints: Annotated[tuple[PlanarJoint, ...], Rows]
    drives: Annotated[tuple[PlanarDrive, ...], Rows] = ()
    loads: Annotated[tuple[PlanarLoad, ...], Rows] = ()

    @model_validator(mode="before")
    @classmethod
    def _alike(cls, data: Any) -> Any:
        """Entries of a body or joint that is ``like`` another, written out."""
        if not isinstance(data, Mapping):
            return data
        written = dict(data)
        for table in ("bodies", "joints"):
            rows = data.get(table)
            if isinstance(rows, Mapping):
                written[table] = {name: _with_model(table, name, rows) for name in rows}
        return written


def _with_model(table: str, name: str, rows: Mapping[str, Any]) -> Any:
    row = rows[name]
    if not isinstance(row, Mapping) or "like" not in row:
        return row
    model = rows.get(row["like"]) if isinstance(row["like"], str) else None
    if not isinstance(model, Mapping) or "like" in model:
        others = [other for other in rows if other != name and "like" not in rows[other]]
        raise invalid(
            "there is no such row to be like, or it is like another one itself",
            nearest(str(row["like"]), others),
            key=f"{table}.{name}.like",
            value=row["like"],
        )
    return {**model, **{key: value for key, value in row.items() if key != "like"}}

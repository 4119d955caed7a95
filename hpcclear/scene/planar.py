"""Tables of a planar linkage: bodies, ground, joints, drives, loads. `dynamics/planar/tables.py` makes a mechanism of them."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from hpcclear.scene.bending import Bending, check_bars
from hpcclear.scene.fields import (
    Count,
    Curve,
    CurveOf,
    Length,
    Mass,
    MotionTable,
    NamedRows,
    PositiveLength,
    Quantity,
    Speed,
    Table,
    check_period,
    invalid,
    nearest,
)
from hpcclear.scene.film import Film, check_film
from hpcclear.scene.mechanism import Material, check_journal, slender_inertia
from hpcclear.scene.roundness import OutOfRound, check_waves
from hpcclear.scene.wear import Wear

Angle = Annotated[float, Quantity("rad")]
Rows = NamedRows()


class PairTable(Table):
    """Two components along x and y; ``[x, y]`` in the file is the same."""

    @model_validator(mode="before")
    @classmethod
    def _from_pair(cls, data: Any) -> Any:
        if not isinstance(data, (list, tuple)):
            return data
        if len(data) != 2:
            raise invalid("a pair [x, y] is expected here", "Write [x, y]")
        return {"x": data[0], "y": data[1]}


class Place(PairTable):
    """A place or an offset, m."""

    x: Length
    y: Length


class NamedPlace(Place):
    """A point of a body, in its own axes, m."""

    name: str


class PlaceRows(NamedRows):
    """``{name = [x, y]}`` as named rows."""

    def rows(self, value: Any) -> Any:
        """``{name: [x, y]}`` as ``[{"name": name, "x": x, "y": y}]``; raises PydanticCustomError."""
        if not isinstance(value, (Mapping, tuple)):
            raise invalid("named points are expected here", "Write { name = [x, y] }")
        if isinstance(value, Mapping):
            for name, place in value.items():
                if isinstance(place, (list, tuple)) and len(place) != 2:
                    raise invalid("a point is a pair [x, y]", "Write [x, y] in m", key=str(name))
            value = {
                name: {"x": place[0], "y": place[1]} if isinstance(place, (list, tuple)) else place
                for name, place in value.items()
            }
        return super().rows(value)


NamedPlaces = Annotated[tuple[NamedPlace, ...], PlaceRows()]
NOWHERE = Place(x=0.0, y=0.0)


class PlanarBody(Table):
    """A body, rigid unless it is a bar that bends."""

    name: str
    mass: Mass
    """kg."""
    inertia: Annotated[float, Quantity("kg*m**2", least=0)] = 0.0
    """About its mass centre, kg m2; of no consequence where it cannot turn."""
    inertia_ratio: Annotated[float, Quantity("", above=0)] | None = None
    """Of a bar, in place of its inertia: this over that of a slender bar, m L^2/12, so that it follows mass and length."""
    length: Annotated[float, Quantity("m", above=0)] | None = None
    """Of a bar: it has the points a, at its origin, and b, so far along its x axis, m."""
    mass_center: Length | None = None
    """Of a bar: distance of its mass centre from a towards b, m; its middle unless said otherwise."""
    center: Place = NOWHERE
    """Mass centre in the body's own axes, m."""
    points: NamedPlaces = ()
    """Where joints and loads act, in the body's own axes, m."""
    start_angle: Angle = 0.0
    """Rough angle at the start, rad: assembly starts from it. Of a driven body, its angle at the start."""
    bending: Bending | None = None
    """Of a bar between two pins: how it bends; left out, it is rigid."""

    @property
    def own_inertia(self) -> Any:
        """Its inertia, kg m2, however that is stated."""
        if self.inertia_ratio is None:
            return self.inertia
        return self.inertia_ratio * slender_inertia(self.mass, self.length)

    @model_validator(mode="after")
    def _bar_or_points(self) -> "PlanarBody":
        if self.length is None:
            if self.mass_center is not None:
                raise invalid(
                    "is measured along a bar, and this body has no length",
                    "Give its length, or write center = [x, y]",
                    key="mass_center",
                    value=self.mass_center,
                )
            if self.inertia_ratio is not None:
                raise invalid(
                    "is over that of a slender bar, and this body has no length",
                    "Give its length, or write inertia",
                    key="inertia_ratio",
                    value=self.inertia_ratio,
                )
            return self
        if self.inertia_ratio is not None and self.inertia:
            raise invalid(
                "stands beside the inertia itself",
                "Remove one of the two",
                key="inertia_ratio",
                value=self.inertia_ratio,
            )
        if (self.center.x, self.center.y) != (0.0, 0.0):
            raise invalid(
                "a bar's mass centre is given by mass_center",
                "Write mass_center, or leave length out and give points",
                key="center",
                value=[self.center.x, self.center.y],
            )
        for point in self.points:
            if point.name in ("a", "b"):
                raise invalid(
                    "is a point that a bar has anyway",
                    "Give it another name",
                    key=f"points.{point.name}",
                )
        return self


class Ground(Table):
    """What stands still."""

    points: NamedPlaces = (NamedPlace(name="o", x=0.0, y=0.0),)
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
    start_eccentricity: Place = NOWHERE
    """Journal centre minus bearing centre at the start, m."""
    wear: Wear | None = None
    """How its surfaces wear; left out, they do not."""
    film: Film | None = None
    """Oil between its surfaces; left out, the joint is dry."""
    out_of_round: OutOfRound | None = None
    """Waves around its surfaces; left out, they are round."""

    @model_validator(mode="after")
    def _journal_fits(self) -> "PlanarClearance":
        check_journal(self.clearance, self.bearing_radius)
        check_film(self.film, self.clearance, self.bearing_radius)
        check_waves(self.out_of_round, self.clearance, self.film)
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
    turns: Annotated[int, Count(least=1, most=64)] = 1
    """Of a revolution: 2 for the 720 degrees of a four-stroke engine."""


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


class PlanarTable(Table):
    """A body follows a table of angles."""

    name: str
    kind: Literal["table"]
    body: str
    angle: Annotated[tuple[tuple[float, float], ...], MotionTable()]
    """``[[time, angle], ...]``, s and rad: the first time is 0, and the motion repeats at the last, where the angle is the
    first one again or a turn further on. A cubic spline between, smooth where it repeats."""
    period: bool = False


class PlanarTorque(Table):
    """A torque acts on a free body."""

    name: str
    kind: Literal["torque"]
    body: str
    torque: Annotated[Curve, CurveOf("N*m", cycles=True)]
    """N m, constant or over a revolution of the body that gives the period."""
    initial_speed: Annotated[float, Quantity("rad/s", above=0, why="the body has to start turning")]
    flywheel_inertia: Annotated[float, Quantity("kg*m**2", least=0)] = 0.0
    period: bool = False
    turns: Annotated[int, Count(least=1, most=64)] = 1


PlanarDrive = Annotated[
    PlanarSpeed | PlanarHarmonic | PlanarTable | PlanarTorque, Field(discriminator="kind")
]


class Components(PairTable):
    """A force by its components, N."""

    x: Annotated[float, Quantity("N")]
    y: Annotated[float, Quantity("N")]


class ForceLoad(Table):
    """A force at a point: by its components along the ground's axes, or by size and direction."""

    name: str
    kind: Literal["force"]
    place: str
    force: Components | None = None
    size: Annotated[Curve, CurveOf("N", cycles=True)] | None = None
    """N along `direction`, constant or against the angle of the body that gives the period."""
    direction: Angle = 0.0
    """From the ground's x axis, rad."""

    @model_validator(mode="after")
    def _one_of_both(self) -> "ForceLoad":
        if (self.force is None) == (self.size is None):
            raise invalid(
                "is given twice, or not at all",
                "Write force = [x, y], or size and direction",
                key="force",
                value=None if self.force is None else [self.force.x, self.force.y],
            )
        return self


class TorqueLoad(Table):
    """A torque on a body."""

    name: str
    kind: Literal["torque"]
    body: str
    torque: Annotated[Curve, CurveOf("N*m", cycles=True)]
    """N m, constant or against the angle of the body that gives the period."""


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
    followed: str | None = None
    """``body.point`` whose acceleration and path responses tell of."""

    @model_validator(mode="after")
    def _followed_is_a_point(self) -> "Planar":
        if self.followed is not None:
            places = [
                f"{body.name}.{point}" for body in self.bodies for point in names_of_points(body)
            ]
            if self.followed not in places:
                raise invalid(
                    "is no point of a body",
                    nearest(self.followed, places),
                    key="followed",
                    value=self.followed,
                )
        return self

    @model_validator(mode="after")
    def _bars_may_bend(self) -> "Planar":
        check_bars(self)
        return self

    @model_validator(mode="after")
    def _curves_repeat(self) -> "Planar":
        turns = turns_of(self) if self.drives else 1
        for table in ("drives", "loads"):
            for row in getattr(self, table):
                for entry in ("torque", "size"):
                    curve = getattr(row, entry, None)
                    if isinstance(curve, tuple):
                        check_period(curve, turns, f"{table}.{row.name}.{entry}")
        return self

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


def names_of_points(body: PlanarBody) -> tuple[str, ...]:
    """Points of a body; a bar has a and b besides those that are written."""
    own = () if body.length is None else ("a", "b")
    return (*own, *(point.name for point in body.points))


def turns_of(planar: Planar) -> int:
    """Turns of the driven body in a revolution."""
    main = next((drive for drive in planar.drives if drive.period), planar.drives[0])
    return getattr(main, "turns", 1)

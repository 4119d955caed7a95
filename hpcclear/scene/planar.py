"""Tables of a planar linkage: bodies, also bars that bend, ground, joints. `driving` has drives, `loads` loads, and
`dynamics/planar/tables.py` makes a mechanism of them."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar, Union

from pydantic import Field

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError, at
from hpcclear.scene import fields
from hpcclear.scene.contacts import KINDS as LOOSE
from hpcclear.scene.curves import check_period
from hpcclear.scene.driving import PlanarDrive
from hpcclear.scene.fields import Count, Entries, NamedRows, Quantity, Table, invalid, nearest
from hpcclear.scene.joints import PlanarFixed, PlanarRevolute
from hpcclear.scene.loads import AnyLoad


class BarBending(Table):
    """Bending of a bar between two pins, in modes of a beam that is held at both ends."""

    stiffness: Annotated[float, Quantity("N*m**2", above=0)]
    """Bending stiffness E I in the plane, N m2: Young's modulus times second moment of the section."""
    modes: Annotated[int, Count(least=1, most=4)] = 2
    """Number of bending modes; mode i has i half waves along the bar."""
    damping: Annotated[float, Quantity("", least=0, below=1)] = 0.0
    """Structural damping of each mode, relative to critical damping."""


def _check_bar(planar: "Planar", body: "PlanarBody") -> None:
    """An error for validators unless a body that bends is a bar that pins alone hold, at both its ends."""
    if body.length is None:
        raise invalid("a body of no length cannot bend", "Give its length, or leave bending out")
    if body.points:
        further = f"the bar has a further point, {body.points[0].name}"
        reason = f"{further}, but bending is modelled for its two ends only"
        raise invalid(reason, "Leave out its points, or bending")
    for row in planar.drives:
        if row.body == body.name:
            reason = f"{row.name} drives the bar and clamps it, but the modes are of pinned ends"
            raise invalid(reason, "Leave bending out, or drive another body")
    for row in planar.loads:
        if getattr(row, "body", None) == body.name:
            reason = f"the torque {row.name} has no point of application on the bar"
            raise invalid(reason, "Leave bending out, or replace it by two forces")
    held = set()
    for joint in planar.joints:
        entries = ("journal", "bearing", "point", "line")
        places = [(getattr(joint, name, "") or "").partition(".") for name in entries]
        ends = [point for own, _, point in places if own == body.name]
        held.update(ends)
        if ends and joint.kind in ("slide", "fixed"):
            reason = f"{joint.name} guides the bar, but the modes are those of pinned ends"
            raise invalid(reason, "Leave bending out")
        if ends and getattr(joint, "out_of_round", None) is not None:
            reason = f"surfaces of {joint.name} are out of round, which needs rigid bodies"
            raise invalid(reason, "Leave out bending, or out_of_round")
    for end in ("a", "b"):
        if end not in held:
            reason = f"its end {end} is free, but the modes are those of pinned ends"
            raise invalid(reason, "Leave bending out, or join both ends")


Numbers = TypeVar("Numbers", float, Array, float | Array)


def slender_inertia(mass: Numbers, length: Numbers) -> Numbers:
    """Inertia m L^2/12 of a uniform thin rod about its middle, kg m2: the least a bar of that mass would have."""
    return mass * length**2 / 12


class PlanarBody(Table):
    """A body, rigid unless it is a bar that bends."""

    name: str
    mass: fields.Mass
    """Mass, kg."""
    inertia: Annotated[float, Quantity("kg*m**2", least=0)] = 0.0
    """Moment of inertia about the mass centre, kg m2; ignored if the body cannot rotate."""
    inertia_ratio: Annotated[float, Quantity("", above=0)] | None = None
    """For a bar, instead of `inertia`: inertia divided by that of a slender bar, m L^2/12. The inertia then follows
    mass and length."""
    length: Annotated[float, Quantity("m", above=0)] | None = None
    """Length of a bar, m. A bar has the points a at its origin and b at this distance along its x axis."""
    mass_center: fields.Length | None = None
    """For a bar: distance of its mass centre from a towards b, m; default: the middle."""
    center: fields.Position = fields.NOWHERE
    """Position of the mass centre in the body's own axes, m."""
    points: fields.NamedPlaces = ()
    """Points at which joints and loads act, in the body's own axes, m."""
    start_angle: fields.Angle = 0.0
    """Approximate angle at the start, rad, from which the assembly is computed. For a driven body it is the exact angle
    at the start, unless the drive prescribes the angle (harmonic, table); with `turns` = 2 of its drive, 360 degrees or
    more begins in the second turn."""
    bending: BarBending | None = None
    """Bending of a bar between two pins. Without it the bar is rigid."""

    @property
    def own_inertia(self) -> float:
        """Its inertia, kg m2, however that is stated."""
        if self.inertia_ratio is None or self.length is None:
            return self.inertia
        return self.inertia_ratio * slender_inertia(self.mass, self.length)

    @property
    def own_center(self) -> tuple[float, float]:
        """Its mass centre in its own axes, m, however that is stated."""
        if self.length is None:
            return self.center.x, self.center.y
        return (0.5 * self.length if self.mass_center is None else self.mass_center), 0.0

    @property
    def own_points(self) -> dict[str, tuple[float, float]]:
        """Its points in its own axes, m; a bar has a and b besides those that are written."""
        ends = {} if self.length is None else {"a": (0.0, 0.0), "b": (self.length, 0.0)}
        return ends | {point.name: (point.x, point.y) for point in self.points}

    def _check(self) -> None:
        if self.length is None:
            for key, meaning, instead in (
                ("mass_center", "is measured along a bar", "center = [x, y]"),
                ("inertia_ratio", "is over that of a slender bar", "inertia"),
            ):
                if getattr(self, key) is not None:
                    reason = f"{meaning}, and this body has no length"
                    raise invalid(reason, f"Give its length, or write {instead}", key)
            return
        if self.inertia_ratio is not None and self.inertia:
            raise invalid("stands beside the inertia", "Remove one of the two", "inertia_ratio")
        if (self.center.x, self.center.y) != (0.0, 0.0):
            reason = "a bar's mass centre is given by mass_center"
            remedy = "Write mass_center, or leave length out and give points"
            raise invalid(reason, remedy, "center", [self.center.x, self.center.y])
        for point in self.points:
            if point.name in ("a", "b"):
                raise invalid("is a point of every bar", "Rename it", f"points.{point.name}")


class Ground(Table):
    """The ground, which does not move."""

    points: fields.NamedPlaces = (fields.NamedPlace(name="o", x=0.0, y=0.0),)
    """Named points of the ground, m."""


JOINTS: dict[str, type[Table]] = {"revolute": PlanarRevolute, **LOOSE, "fixed": PlanarFixed}
"""Tables of joints by their kinds."""
if TYPE_CHECKING:
    PlanarJoint = Any
else:
    PlanarJoint = Annotated[Union[tuple(JOINTS.values())], Field(discriminator="kind")]  # noqa: UP007


def is_loose(joint: object) -> bool:
    """Whether a joint has clearance."""
    return getattr(joint, "clearance", None) is not None


class Planar(Table):
    """A planar linkage."""

    kind: Literal["planar"] = "planar"
    bodies: Annotated[tuple[PlanarBody, ...], NamedRows()]
    """The moving bodies. ``like = "NAME"`` copies the entries of another body."""
    ground: Ground = Ground()
    joints: Annotated[tuple[PlanarJoint, ...], NamedRows()]
    """The joints. ``like = "NAME"`` copies the entries of another joint."""
    drives: Annotated[tuple[PlanarDrive, ...], NamedRows()] = ()
    """Drives of the mechanism; one is sufficient."""
    loads: Annotated[tuple[AnyLoad, ...], NamedRows()] = ()
    """Forces, torques and springs. Gravity is an entry of `effects`."""
    followed: str | None = None
    """``body.point`` whose acceleration and path responses contain."""

    def _check(self) -> None:
        if self.followed is not None:
            places = [f"{body.name}.{point}" for body in self.bodies for point in body.own_points]
            if self.followed not in places:
                raise invalid("is no point of a body", nearest(self.followed, places), "followed")

        for body in self.bodies:
            if body.bending is not None:
                with at(f"bodies.{body.name}.bending", None):
                    _check_bar(self, body)
        turns = turns_of(self) if self.drives else 1
        for table in ("drives", "loads"):
            for row in getattr(self, table):
                entry = getattr(row, "size_entry", "torque")
                if isinstance(curve := getattr(row, entry, None), tuple):
                    by_another = getattr(row, "angle_of", None) is not None
                    check_period(curve, 1 if by_another else turns, f"{table}.{row.name}.{entry}")

    @classmethod
    def _of_file(cls, row: Entries) -> Entries:
        """Entries of a body or joint that is ``like`` another, written out; tables among them, such as materials, take over
        what they do not say, points are a body's own."""
        written = dict(row)
        for table in ("bodies", "joints"):
            if isinstance(rows := row.get(table), Mapping):
                written[table] = {name: _with_model(table, name, rows) for name in rows}
        return written


def _with_model(table: str, name: str, rows: Mapping[str, object]) -> object:
    row = rows[name]
    if not isinstance(row, Mapping) or "like" not in row:
        return row
    model = rows.get(row["like"]) if isinstance(row["like"], str) else None
    if not isinstance(model, Mapping) or "like" in model:
        tables = {other: one for other, one in rows.items() if isinstance(one, Mapping)}
        others = [other for other, one in tables.items() if other != name and "like" not in one]
        reason = "there is no such row, or it refers to another one itself"
        remedy = nearest(str(row["like"]), others)
        raise invalid(reason, remedy, f"{table}.{name}.like", row["like"])
    made = dict(model)
    for key, value in row.items():
        own = isinstance(value, Mapping) and isinstance(model.get(key), Mapping) and key != "points"
        made[key] = {**model[key], **value} if own else value
    return {key: value for key, value in made.items() if key != "like"}


def turns_of(planar: Planar) -> int:
    """Turns, in a revolution, of the body whose drive gives the period; raises InputError if nothing is driven."""
    if not planar.drives:
        raise InputError(
            "mechanism.drives", None, "nothing drives the mechanism",
            'Add [mechanism.drives.NAME] with a kind, say "constant-speed", and a body. For a mechanism that is let go: '
            'kind = "free", a body, and interval = "1 s", which replaces the revolution',
        )  # fmt: skip
    return next((drive for drive in planar.drives if drive.period), planar.drives[0]).turns

"""A planar mechanism as data, refused by the name of the joint, body, drive or load where it makes none."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.base.outcome import MAX_JOINTS
from hpcclear.dynamics.linkage import parts
from hpcclear.dynamics.linkage.parts import GROUND, Body, Contact, Drive, Joint, LoadTerms, Pair

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


@dataclass(frozen=True)
class Mechanism:
    """Bodies, ground points, joints, drives and loads that make one mechanism.

    Raises InputError if they do not: the joint, body, drive or load is named.
    """

    bodies: tuple[Body, ...]
    joints: tuple[Joint, ...]
    drives: tuple[Drive, ...]
    ground: Mapping[str, Pair] = field(default_factory=lambda: {"o": (0.0, 0.0)})
    loads: tuple[LoadTerms, ...] = ()

    def __post_init__(self) -> None:
        for check in (_names, _places, _idle, _numbers, _connected, _drives, _sizes):
            check(self)

    def body(self, name: str) -> Body:
        """The body of that name."""
        return next(body for body in self.bodies if body.name == name)

    def at(self, place: str) -> Pair:
        """Where a place is, in its body's axes, m."""
        name, point = parts.split(place)
        return self.ground[point] if name == GROUND else self.body(name).points[point]

    @property
    def clearances(self) -> tuple[Joint, ...]:
        """The joints with clearance, in file order."""
        return tuple(joint for joint in self.joints if parts.is_loose(joint))

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """Their contacts, joint by joint."""
        each = ((joint, joint.contacts().items()) for joint in self.clearances)
        return tuple(Contact(part, joint, *at) for joint, items in each for part, at in items)

    @property
    def ideal(self) -> tuple[Joint, ...]:
        """The joints without."""
        return tuple(joint for joint in self.joints if not parts.is_loose(joint))

    @property
    def period(self) -> Drive:
        """The drive whose turn is the revolution."""
        return next((drive for drive in self.drives if drive.period), self.drives[0])

    @property
    def free(self) -> bool:
        """Whether torques alone drive it."""
        return all(drive.kind in ("torque", "free") for drive in self.drives)

    @property
    def clocked(self) -> bool:
        """Whether a load or drive goes by the time since the start."""
        by_drive = any(drive.kind == "run-up" for drive in self.drives)
        return by_drive or any(load.seconds for load in self.loads)

    def drive_of(self, body: str) -> Drive | None:
        """What drives a body."""
        return next((drive for drive in self.drives if drive.body == body), None)


def with_numbers(mechanism: Mechanism, **tables: object) -> Mechanism:
    """A mechanism with other numbers, arrays among them, which its checks are not made for."""
    made = object.__new__(Mechanism)
    for one in fields(Mechanism):
        object.__setattr__(made, one.name, tables.get(one.name, getattr(mechanism, one.name)))
    return made


def straight(mechanism: Mechanism) -> Mechanism:
    """The same of rigid bodies alone."""
    if all(body.bending is None for body in mechanism.bodies):
        return mechanism
    bodies = tuple(replace(body, bending=None) for body in mechanism.bodies)
    return with_numbers(mechanism, bodies=bodies)


def uncentred(mechanism: Mechanism) -> Mechanism:
    """The same with mass centres at the origins of the bodies' axes: where it stands does not depend on masses."""
    bodies = tuple(replace(body, center=(0.0, 0.0)) for body in mechanism.bodies)
    return with_numbers(mechanism, bodies=bodies)


def modes_of(mechanism: Mechanism) -> int:
    """How many modes of bending there are."""
    return sum(body.bending.modes for body in mechanism.bodies if body.bending is not None)


def joined(mechanism: Mechanism, kinds: tuple[str, ...] = ()) -> list[set[str]]:
    """Which bodies hang together by joints of some kinds: sets of names, the ground's first.

    Guides with clearance, which let their sliders turn, have no kind of their own.
    """
    groups = [{GROUND}, *({body.name} for body in mechanism.bodies)]
    for joint in mechanism.ideal if kinds else mechanism.joints:
        if not kinds or joint.kind in kinds:
            groups = _merged(groups, {parts.split(place)[0] for place in parts.places_of(joint)})
    return sorted(groups, key=lambda group: GROUND not in group)


def _merged(groups: list[set[str]], names: set[str]) -> list[set[str]]:
    apart = [group for group in groups if not group & names]
    return [*apart, set().union(*(group for group in groups if group & names))]


def _records(m: Mechanism) -> Iterator[tuple[str, Any]]:
    for table in ("bodies", "joints", "drives", "loads"):
        for one in getattr(m, table):
            yield f"{table}.{one.name}", one


def _names(m: Mechanism) -> None:
    for key, one in _records(m):
        if not _NAME.fullmatch(one.name) or one.name == GROUND:
            reason = "is not a valid name"
            raise InputError(
                key, one.name, reason, "Use letters a to z, digits and _, and not 'ground'"
            )
        if "center" in getattr(one, "points", ()):
            reason = "is reserved for the mass centre"
            remedy = "Give the point another name"
            raise InputError(f"{key}.points.center", one.points["center"], reason, remedy)
    if not m.bodies:
        remedy = "Add [mechanism.bodies.NAME] with its mass"
        raise InputError("bodies", None, "there is no body", remedy)


def _places(m: Mechanism) -> None:
    """Joints and loads act on bodies and points that there are."""
    known = {GROUND: set(m.ground)} | {body.name: set(body.points) for body in m.bodies}
    for key, one in _records(m):
        for entry in ("journal", "bearing", "point", "line", "place", "first", "second"):
            place = getattr(one, entry, None)
            if place is None:
                continue
            body, point = parts.split(place)
            if body not in known:
                reason, words = f"there is no body {body!r}", set(known)
            elif point not in known[body]:
                reason, words = f"the body {body!r} has no point {point!r}", known[body]
            else:
                continue
            listed = ", ".join(sorted(words)) or "none yet"
            raise InputError(f"{key}.{entry}", place, reason, f"Known are: {listed}")
        for entry in ("body", "other", "angle_of"):
            acted_on = getattr(one, entry, None)
            if acted_on is not None and acted_on not in known.keys() - {GROUND}:
                remedy = f"Known are: {', '.join(sorted(known.keys() - {GROUND}))}"
                raise InputError(f"{key}.{entry}", acted_on, "there is no such moving body", remedy)
    _turned(m)
    for joint in m.joints:
        first, second = (parts.split(place)[0] for place in parts.places_of(joint))
        if first == second:
            reason, remedy = "joins a body to itself", "Name two bodies"
            raise InputError(f"joints.{joint.name}", first, reason, remedy)
        if joint.kind == "fixed" and second != GROUND:
            reason = "a body can be fixed to the ground only"
            remedy = "Name a point of the ground, or make one body of the two"
            raise InputError(f"joints.{joint.name}.line", joint.line, reason, remedy)
        if joint.kind == "slide" and first == GROUND:
            reason = "the ground cannot be the sliding body"
            remedy = "Swap point and line"
            raise InputError(f"joints.{joint.name}.point", joint.point, reason, remedy)


def _idle(m: Mechanism) -> None:
    """Loads act between bodies that can move against each other, or on one that can move."""
    for load in m.loads:
        for entry, other, kinds in (
            ("place", "", ("fixed",)), ("second", "first", ("fixed",)), ("other", "body", ("slide", "fixed")),
        ):  # fmt: skip
            if (place := getattr(load, entry, None)) is None:
                continue
            ends = {parts.split(place)[0], parts.split(getattr(load, other, GROUND))[0]}
            if any(ends <= group for group in joined(m, kinds)):
                reason, remedy = "a load that acts here moves nothing", "Name a body that moves"
                raise InputError(f"loads.{load.name}.{entry}", place, reason, remedy)


def coupled(m: Mechanism) -> list[set[str]]:
    """Bodies whose angles the joints or loads compare with one another, the ground's first: sets of names."""
    groups = joined(m, ("slide", "fixed"))
    for load in m.loads:
        if load.by_angle and (other := getattr(load, "other", None)):
            groups = _merged(groups, {str(getattr(load, "body", "")), other})
    return sorted(groups, key=lambda names: GROUND not in names)


def gain_of(m: Mechanism, drive: Drive) -> parts.Number:
    """By how much the body of a prescribed drive, or of the one that gives the period, turns in a revolution, rad."""
    main, own = m.period, next(one for one in m.drives if one.name == drive.name)
    if own is main or not main.prescribed:
        return main.advance
    return own.advance * np.round(main.seconds / own.seconds)


def _turned(m: Mechanism) -> None:
    """Bodies whose angles loads act by can turn, and the angle does not go round and round with the revolutions: that of one
    body, or between two."""
    still, *_ = joined(m, ("slide", "fixed"))
    gains: dict[str, set[parts.Number]] = {}
    for names in coupled(m):
        driven = [d for d in m.drives if d.body in names and (d.prescribed or d is m.period)]
        gains |= {name: {gain_of(m, drive) for drive in driven} for name in names}
    for load in m.loads:
        body, other = (getattr(load, entry, None) for entry in ("body", "other"))
        for entry in ("body", "other", "angle_of"):
            if (name := getattr(load, entry, None)) in still:
                reason = "this body cannot rotate"
                remedy = "Name a body that does"
                raise InputError(f"loads.{load.name}.{entry}", name, reason, remedy)
        if load.by_angle and other is None and gains[str(body)] - {0.0}:
            reason = "this body goes round with every revolution, so that its angle has no end"
            remedy = "Name a body that swings, or another one with `other` that goes round with it"
            raise InputError(f"loads.{load.name}.body", body, reason, remedy)
        if load.by_angle and other is not None and len(gains[str(body)]) > 1:
            raise InputError(
                f"loads.{load.name}.other", other,
                f"drives turn this body and {body!r} by different angles in a revolution, so that the angle between them has "
                "no end",
                "Couple bodies that go round together",
            )  # fmt: skip


def _numbers(m: Mechanism) -> None:
    """Inertias that have to be there, motion at all, and reactions that are known."""
    light = massless_angles(m)
    for body in m.bodies:
        if body.name in light:
            raise InputError(
                f"bodies.{body.name}.inertia", body.inertia, "a body that may rotate about its mass centre needs an inertia",
                "Write the moment of inertia about its mass centre in kg m2, or put an ideal pin off its mass centre",
            )  # fmt: skip
    for drive in m.drives:
        if drive.kind == "harmonic" and drive.amplitude == 0:
            key = f"drives.{drive.name}.amplitude"
            raise InputError(key, 0.0, "there would be no motion", "Write an amplitude")
    for joint in m.ideal:
        if joint.kind == "revolute" and joint.friction is not None and modes_of(m):
            raise InputError(
                f"joints.{joint.name}.friction", joint.friction.coefficient,
                "reactions of pins are not modelled where a bar bends", "Remove it, or bending",
            )  # fmt: skip


def massless(m: Mechanism) -> set[str]:
    """Names of bodies without inertia or a flywheel."""
    flywheels = {drive.body for drive in m.drives if getattr(drive, "flywheel_inertia", 0.0)}
    return {body.name for body in m.bodies if body.inertia == 0.0} - flywheels


def massless_angles(m: Mechanism) -> set[str]:
    """Names of bodies without inertia that may turn while no mass moves, so that the mass matrix is singular.

    An ideal pin off the mass centre, or a guide, to a body that cannot makes it regular.
    """
    found = massless(m) & turning(m)
    left = len(m.bodies) + 1
    while len(found) < left:
        left = len(found)
        for joint in m.ideal:
            (one, point), (two, other) = map(parts.split, parts.places_of(joint))
            for body, here, carrier in ((one, point, two), (two, other, one)):
                if body not in found or carrier in found:
                    continue
                if parts.is_pin(joint):
                    held = tuple(m.body(body).points[here]) != tuple(m.body(body).center)
                else:
                    held = joint.kind in ("slide", "fixed")
                found -= {body} if held else set()
    return found


def turning(m: Mechanism, held_by: tuple[str, ...] | None = None) -> set[str]:
    """Names of bodies whose angle is neither prescribed, or prescribed by such drives, nor that of the ground."""
    by = [d for d in m.drives if (d.prescribed if held_by is None else d.kind in held_by)]
    held = {drive.body for drive in by}
    still: set[str] = set()
    for group in joined(m, ("slide", "fixed")):
        if GROUND in group or group & held:
            still |= group
    return {body.name for body in m.bodies} - still


def _connected(m: Mechanism) -> None:
    first, *rest = joined(m)
    if rest:
        name = next(body.name for body in m.bodies if body.name in rest[0])
        others = sorted(rest[0] - {name})
        alone = f" (nor are {', '.join(others)})" if others else ""
        reason = f"no joints lead from it to the ground{alone}"
        remedy = f"Add a joint to {' or '.join(sorted(first)[:4])}"
        raise InputError(f"bodies.{name}", name, reason, remedy)


def _drives(m: Mechanism) -> None:
    groups = joined(m, ("slide", "fixed"))
    driven: dict[int, str] = {}
    for drive in m.drives:
        group = next(k for k, names in enumerate(groups) if drive.body in names)
        if GROUND in groups[group] and drive.kind != "free":
            reason = "this body cannot rotate, since it is on a prismatic joint"
            remedy = "Drive a body on a revolute joint"
            raise InputError(f"drives.{drive.name}.body", drive.body, reason, remedy)
        if group in driven:
            reason = f"its angle is driven by {driven[group]!r} already"
            raise InputError(f"drives.{drive.name}.body", drive.body, reason, "Remove one of them")
        driven[group] = drive.name
    _one_period(m)


def _one_period(m: Mechanism) -> None:
    """One drive's turn is the revolution; what the others prescribe has to repeat within it."""
    named = [drive for drive in m.drives if drive.period]
    if len(named) > 1:
        reason = f"{named[0].name!r} defines the period already"
        remedy = "Leave period = true with one drive"
        raise InputError(f"drives.{named[1].name}.period", True, reason, remedy)
    main = m.period
    for drive in [one for one in m.drives if one is not main]:
        if drive.prescribed and not main.prescribed:
            reason = f"prescribes an angle by time, but {main.name!r}, whose speed is free, defines the period"
            raise InputError(f"drives.{drive.name}.period", False, reason, "Set period = true here")
        if drive.kind == "table" and drive.advance:
            reason = "goes round by full turns, but another drive defines the period"
            remedy = "End it at the angle where it began, or set period = true here"
            gained = f"{drive.advance:.4g} rad"
            raise InputError(f"drives.{drive.name}.angle", gained, reason, remedy)
        if drive.turns != 1:
            reason, remedy = f"{main.name!r} defines the revolution", "Remove it, or write it there"
            raise InputError(f"drives.{drive.name}.turns", drive.turns, reason, remedy)
        if not drive.prescribed:
            continue
        times = main.seconds / drive.seconds
        if abs(times - round(times)) > 1e-9 * times or round(times) < 1:
            reason = f"does not repeat within the period of {main.name!r} ({main.seconds:g} s)"
            remedy = "Make the longest one the period, and the others whole fractions of it"
            raise InputError(f"drives.{drive.name}", f"{drive.seconds:.4g} s", reason, remedy)


def freedom(m: Mechanism) -> int:
    """Degrees of freedom by counting (Gruebler), the drives' counted off: bodies 3, pins and guides 2, held bodies 3."""
    ideal = sum(joint.holds for joint in m.ideal)
    return 3 * len(m.bodies) - ideal - sum(drive.prescribed for drive in m.drives)


def _sizes(m: Mechanism) -> None:
    free = freedom(m)
    if free < 0:
        last = m.ideal[-1].name if m.ideal else m.drives[-1].name
        raise InputError(
            f"joints.{last}", -free, "the mechanism is overconstrained: ideal joints and drives remove "
            f"{-free} too many degrees of freedom",
            "Give a joint clearance, remove one, or remove a drive",
        )  # fmt: skip
    if len(m.contacts) > MAX_JOINTS:
        reason = f"more than {MAX_JOINTS} contacts in joints (four in a guide, two in a slot)"
        raise InputError("joints", len(m.contacts), reason, "Make some of the joints ideal")

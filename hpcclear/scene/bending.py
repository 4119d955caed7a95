"""A bar that bends, as in the scene file."""

from collections.abc import Mapping
from typing import Annotated, Any

from hpcclear.scene.fields import Count, Quantity, Table, invalid


class Bending(Table):
    """Bending of a bar between two pins, in modes of a beam that is held at both ends."""

    stiffness: Annotated[float, Quantity("N*m**2", above=0)]
    """Bending stiffness E I in the plane, N m2: Young's modulus times second moment of the section."""
    modes: Annotated[int, Count(least=1, most=4)] = 2
    """Number of bending modes; mode i has i half waves along the bar."""
    damping: Annotated[float, Quantity("", least=0, below=1)] = 0.0
    """Structural damping of each mode, relative to critical damping."""


def check_bars(planar: Any) -> None:
    """An error for validators unless every body of a linkage that bends is a bar that pins alone hold, at both its ends."""
    for body in planar.bodies:
        if body.bending is not None:
            _check_bar(planar, body)


def _check_bar(planar: Any, body: Any) -> None:
    key = f"bodies.{body.name}.bending"
    if body.length is None:
        raise invalid(
            "only a bar can bend, and this body has no length",
            "Give its length, or leave bending out", key=key, value=None,
        )  # fmt: skip
    if body.points:
        raise invalid(
            f"the bar has a further point, {body.points[0].name}, but bending is modelled for its two ends only",
            "Leave out its points, or bending", key=key, value=None,
        )  # fmt: skip
    for row in planar.drives:
        if row.body == body.name:
            raise invalid(
                f"{row.name} drives the bar and clamps it, but the modes are those of pinned ends",
                "Leave bending out, or drive another body", key=key, value=None,
            )  # fmt: skip
    for row in planar.loads:
        if getattr(row, "body", None) == body.name:
            raise invalid(
                f"the torque {row.name} has no point of application on the bar",
                "Leave bending out, or replace it by two forces", key=key, value=None,
            )  # fmt: skip
    held = set()
    for joint in planar.joints:
        places = [
            getattr(joint, name, "") or "" for name in ("journal", "bearing", "point", "line")
        ]
        ends = [point for own, _, point in (p.partition(".") for p in places) if own == body.name]
        held.update(ends)
        if ends and joint.kind in ("slide", "fixed"):
            raise invalid(
                f"{joint.name} guides the bar, but the modes are those of pinned ends",
                "Leave bending out", key=key, value=None,
            )  # fmt: skip
        if ends and getattr(joint, "out_of_round", None) is not None:
            raise invalid(
                f"surfaces of {joint.name} are out of round, which needs rigid bodies",
                "Leave out bending, or out_of_round", key=key, value=None,
            )  # fmt: skip
    for end in ("a", "b"):
        if end not in held:
            raise invalid(
                f"its end {end} is free, but the modes are those of pinned ends",
                "Leave bending out, or join both ends", key=key, value=None,
            )  # fmt: skip


def check_scene(scene: Any, bending: Mapping[str, Bending]) -> None:
    """An error for validators where a scene has what does not go with bending; `bending`: tables by their bodies' paths."""
    if bending and scene.wear is not None and scene.wear.waves and scene.worn_joints():
        raise invalid(
            "an angular wear profile needs rigid bodies, but a body bends",
            'Set it to "uniform", or leave bending out',
            key="wear.profile", value=scene.wear.profile,
        )  # fmt: skip

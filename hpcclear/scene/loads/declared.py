"""What a load declares: its table in a scene, its numbers, and the terms that it adds to a motion."""

import math
from collections.abc import Iterable
from types import NoneType
from typing import Any, ClassVar

import numpy as np
from pydantic import StrictBool

from hpcclear.base.arrays import Array
from hpcclear.base.pieces import Pieces, Rows, level, periodic
from hpcclear.base.terms import Acting, Term
from hpcclear.scene.fields import Table, invalid


def along(ex: float, ey: float, vx: float, vy: float) -> tuple[float, float, float, float]:
    """Direction, length and rate of the length of an offset; without length its direction is defined, and zero."""
    square = ex * ex + ey * ey + 1e-300
    inverse = 1.0 / np.sqrt(square)
    nx = ex * inverse
    ny = ey * inverse
    return nx, ny, square * inverse, vx * nx + vy * ny


def numbers_of(table: Table, name: str) -> dict[str, Array | float]:
    """Entries of a table that are numbers, ``NAME_ENTRY``; numbers or arrays of samples."""
    entries = {entry: getattr(table, entry, None) for entry in type(table).model_fields}
    others = (str, bool, tuple, Table, NoneType)
    return {f"{name}_{n}": one for n, one in entries.items() if not isinstance(one, others)}


class JointEffect(Table):
    """An effect of a joint: a table in that of the joint, which acts on the motion as a load does."""

    words: ClassVar[str]
    """What it is called in descriptions of a scene."""

    def act(self, on: Acting, joint: Any) -> Term:
        """As `Load.act`, in the joint that has it; parameters are its entries that are numbers."""
        raise NotImplementedError


class Load(Table):
    """A load of a linkage; each kind is a file beside this one.

    Entries `place`, `first` and `second` are places ``body.point``, `body` and `other` bodies that rotate; whether there are
    such is checked for all loads alike. A number that is zero in the scene and not varied is zero in every sample.
    """

    name: str

    table: ClassVar[bool] = False
    """Whether its size follows a curve over an angle or the time."""
    curves: ClassVar[tuple[str, ...]] = ()
    seconds: ClassVar[float] = 0.0
    """Length of its curve over the time, s; 0 where there is none."""
    by_angle: ClassVar[bool] = False
    """Whether it goes by the angle of a body, or between two, which must not go round with the revolutions."""
    acts_by: ClassVar[tuple[str, ...]] = ()
    """Entries of which one has to be given, since without any it has no effect."""

    def _check(self) -> None:
        if self.acts_by and self.model_fields_set.isdisjoint(self.acts_by):
            remedy = f"Write {' or '.join(self.acts_by)}"
            raise invalid(
                "is missing, and without it the load has no effect", remedy, self.acts_by[0], None
            )

    @property
    def straight(self) -> dict[str, Rows]:
        """Its tables that run straight from row to row (`Acting.piecewise`), by the names that their parameters begin with."""
        return {}

    def numbers(self) -> dict[str, Array | float]:
        """Parameters of its terms, ``NAME_ENTRY``, SI; numbers or arrays of samples: its entries that are numbers."""
        return numbers_of(self, self.name)

    def act(self, on: Acting) -> Term:
        """Add its forces and torques to a motion; return the power that it gives, W."""
        raise NotImplementedError


class JointLoad(Load):
    """An effect of a joint as a load of its linkage, whose name is that of the joint and of the effect's entry."""

    entry: str
    joint: Any
    effect: JointEffect

    def numbers(self) -> dict[str, Array | float]:
        """Those of the effect."""
        return numbers_of(self.effect, self.name)

    def act(self, on: Acting) -> Term:
        """As the effect does in its joint."""
        return self.effect.act(on, self.joint)


def loads_of(joints: Iterable[Any]) -> tuple[JointLoad, ...]:
    """Effects of joints, as loads."""
    made = JointLoad.model_construct
    return tuple(
        made(name=f"{joint.name}_{entry}", entry=entry, joint=joint, effect=effect)
        for joint in joints
        for entry in type(joint).model_fields
        if isinstance(effect := getattr(joint, entry), JointEffect)
    )


class SizedLoad(Load):
    """A load whose size is constant or follows a curve, over an angle in the entry of its `size`, or over the time."""

    size_entry: ClassVar[str]
    """Its entry; ``ENTRY_by_time`` has the curve over the time."""
    unit: ClassVar[str]

    repeats: StrictBool = False
    """Whether the table over time repeats after its last row."""
    angle_of: str | None = None
    """Another body against whose angle the table is read; it repeats with each turn of that body."""

    @property
    def constant(self) -> float:
        """Its size; 1 where a curve has it."""
        return 1.0 if self.table else getattr(self, self.size_entry)

    @property
    def timed(self) -> Rows | None:
        """Rows of its curve over the time; None where there is none."""
        return getattr(self, f"{self.size_entry}_by_time")

    @property
    def seconds(self) -> float:  # type: ignore[override]
        """Length of its curve over the time, s; 0 where there is none."""
        return 0.0 if self.timed is None else float(self.timed[-1][0])

    @property
    def table(self) -> bool:  # type: ignore[override]
        """Whether its size follows a curve."""
        return self.timed is not None or isinstance(getattr(self, self.size_entry), tuple)

    def curve(self, turns: int, interpolation: str) -> Pieces:
        """The curve that its size follows; `turns`: of the body that defines the period, until tables repeat."""
        if self.timed is not None:
            repeated = periodic(self.timed, self.seconds, interpolation) if self.repeats else None
            return repeated or level(self.timed, interpolation)
        turns = turns if self.angle_of is None else 1
        return periodic(getattr(self, self.size_entry), 2.0 * math.pi * turns, interpolation)

    def _check(self) -> None:
        entry, size, timed = self.size_entry, getattr(self, self.size_entry), self.timed
        if self.angle_of is not None and not isinstance(size, tuple):
            raise invalid(f"there is no table of {entry} against an angle", "Remove it", "angle_of")
        if not self.repeats:
            return
        if timed is None:
            raise invalid(f"there is no {entry}_by_time", "Remove it", "repeats")
        if timed[0][0] != 0.0 or timed[0][1] != timed[-1][1]:
            reason = "a table that repeats begins at 0 s, and ends at the value of its beginning"
            raise invalid(reason, "Make its first and last value equal", f"{entry}_by_time")

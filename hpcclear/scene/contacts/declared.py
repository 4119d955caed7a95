"""What a geometry of contact declares: the table of its joint in a scene, its numbers, and where its surfaces touch."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.terms import Term, Touching
from hpcclear.scene.fields import Length, PositiveLength, Table, invalid
from hpcclear.scene.loads.declared import numbers_of

Number = float | Array
"""One number, or those of samples (m,)."""
Get = Callable[[str], Array]
"""Values of an entry of the joint's table, (m,), by its name."""


@dataclass(frozen=True)
class Shape:
    """Numbers of a contact's samples, (m,), m.

    `clearance`, `bearing_radius` and `journal_radius` are what `touch` and `gap` read; `journal_radius` is that of the arc
    that touches. `radii` are what laws of contact get by these three names, and `radius` is that of the sphere on a
    plane that is as stiff.
    """

    clearance: Array
    bearing_radius: Array
    journal_radius: Array
    radii: tuple[Array, Array, Array]
    radius: Array

    @property
    def deepest(self) -> Array:
        """Depth beyond which a result is flagged, m, unless the law says otherwise.

        Hertz's contact radius is a = sqrt(R_B R_J d/c) here; a theory of small contacts has lost its ground when a exceeds
        half the journal's radius, a contact of 30 degrees to either side. That is d > 0.25 c R_J/R_B.
        """
        clearance, bearing, journal = self.radii
        return 0.25 * (journal / bearing) * clearance


class ContactGeometry(Table):
    """A joint that may have clearance; each geometry of contact is a file beside this one.

    Its entries `journal` and `bearing`, or `point` and `line` with an `angle`, are the places ``body.point`` that it joins.
    A `clearance` of None is that of a joint without.
    """

    noun: ClassVar[str] = "joint"
    """What it is called in descriptions of a scene."""
    round: ClassVar[bool] = False
    """Whether it is a journal in a round bearing: the kernel has its contact, with oil film and surfaces out of round."""
    corners: ClassVar[tuple[str, ...]] = ()
    """Words of a joint's contacts; none where it has one, which has the joint's name."""
    ordered: ClassVar[tuple[tuple[str, str, float, str], ...]] = ()
    """Entries of which the first, so many times, is less than the second; in samples, what is wrong where it is not."""
    holds: ClassVar[int] = 2
    """Degrees of freedom that it removes without clearance."""
    long_entry: ClassVar[tuple[str, str]] = ("length", "bearing")
    """Its entry for the length at right angles to the plane, and the part that has it."""

    def own(self, *entries: str) -> tuple[Any, ...]:
        """Values of entries that only some of its tables have."""
        return tuple(getattr(self, entry) for entry in entries)

    @property
    def length_path(self) -> str | None:
        """Where it has its length at right angles to the plane; None where it has none."""
        entry = self.long_entry[0]
        return None if getattr(self, entry, None) is None else entry

    def ideal(self) -> Table | None:
        """The table of the joint without clearance; None where there is no such joint."""
        return None

    def contacts(self) -> dict[str, tuple[str, str]]:
        """Places of journal and bearing of its contacts, by the words of `corners`."""
        return dict.fromkeys(self.corners or ("",), self.own("journal", "bearing"))

    def further_points(self, middle: tuple[float, float]) -> dict[str, tuple[float, float]]:
        """Further points that its contacts need of the body of `point`, in its axes, m; `middle`: the place of `point`."""
        return {}

    def start(self) -> tuple[Number, ...]:
        """What each constraint of the joint without clearance is off by at the start."""
        return (0.0,) * self.holds

    def gaps(self) -> tuple[Number, ...]:
        """Of its contacts at the start, m, below 0 in flight."""
        raise NotImplementedError

    @staticmethod
    def shape(get: Get) -> Shape:
        """Numbers of a contact's samples."""
        raise NotImplementedError

    def numbers(self) -> dict[str, Array | float]:
        """Parameters of its terms, ``NAME_ENTRY``, SI: its entries that are numbers."""
        (name,) = self.own("name")
        return numbers_of(self, name)

    def touch(self, on: Touching, word: str) -> tuple[Term, ...]:
        """Of one contact: the unit vector from the journal into the surface of the bearing, the gap below 0 in flight, m, and
        how far that surface is from the bearing's place along the vector, m."""
        raise NotImplementedError

    def gap(self, word: str, apart: Array, sizes: Sequence[Array]) -> Array:
        """Gap of a contact, (m,), by the vector (2, m) from the bearing's place, or its line, to the journal; `sizes`: the
        first three of `Shape`. The energy balance reads it."""
        gap: Array = np.hypot(*apart) - (sizes[1] - sizes[2])
        return gap


def before_wall(ex: float, ey: float, nx: float, ny: float, half: float, radius: float) -> float:
    """Gap of a circle at (ex, ey) before a wall at a distance from a line, along the unit vector to the wall, m."""
    return ex * nx + ey * ny - (half - radius)


class DryJoint(ContactGeometry):
    """A joint without wear, oil film or surfaces out of round: what most geometries are."""

    wear: ClassVar[None] = None
    film: ClassVar[None] = None
    out_of_round: ClassVar[None] = None


class AlongLine(DryJoint):
    """A joint along a line that may have clearance, with several contacts: what the tables of guides and slots share."""

    needed: ClassVar[tuple[str, ...]]
    """Entries that it has to have with clearance."""
    sides: ClassVar[dict[str, float]]
    """By the words of its contacts: 1 of a wall on the left of the line, -1 on its right."""
    long_entry: ClassVar[tuple[str, str]] = ("width", "slider")

    clearance: PositiveLength | None = None
    """Gap on either side of a slider or pin in the middle, m. Without it the joint is ideal."""
    width: PositiveLength | None = None
    """Width of slider, or of the slot's walls, at right angles to the plane, m. Line contact requires it."""
    start_offset: Length | None = None
    """Distance of the middle from the line at the start, positive to the left, m; default 0."""

    def ideal(self) -> Table:
        """The same joint without clearance."""
        entries = "name", "kind", "point", "line", "angle"
        return type(self).model_construct(**dict(zip(entries, self.own(*entries), strict=True)))

    def start(self) -> tuple[Number, ...]:
        """How far it is from the line."""
        return (0.0 if self.start_offset is None else self.start_offset,)

    def touch(self, on: Touching, word: str) -> tuple[Term, ...]:
        """An arc against a face that is parallel to the line."""
        across = on.across if self.sides[word] > 0.0 else -on.across
        sizes = on.bearing_radius, on.journal_radius
        (gap,) = on.call(before_wall, *on.apart, *across, *sizes, results=("gap",))
        return *across, gap, on.bearing_radius

    def _check(self) -> None:
        """It is one without clearance, or has all that clearance needs."""
        entries = (*self.needed, "width", "materials", "start_offset", "start_tilt")
        own = [name for name in entries if name in type(self).model_fields]
        given = [name for name in own if getattr(self, name) is not None]
        if self.clearance is None and given:
            reason = "belongs to a joint with clearance"
            raise invalid(reason, 'Add clearance = "0.1 mm" or so, or remove it', given[0])
        for name in own if self.clearance is not None else ():
            if name in (*self.needed, "materials") and name not in given:
                reason = "is missing, and a joint with clearance needs it"
                raise invalid(reason, "Add it, or remove clearance for a joint without", name)

"""A pin with clearance: a journal in a round bearing larger than itself, also with an oil film and surfaces out of round."""

from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.written import shown
from hpcclear.scene.contacts.declared import ContactGeometry, Get, Number, Shape
from hpcclear.scene.fields import NOWHERE, Entries, Position, PositiveLength, Quantity, invalid
from hpcclear.scene.fits import with_clearance
from hpcclear.scene.joints import Materials, PlanarRevolute
from hpcclear.scene.surfaces import Film, OutOfRound, Wear, check_film, check_waves


class PinInBearing(ContactGeometry):
    """A pin with clearance: a journal that moves freely within a larger bearing."""

    round: ClassVar[bool] = True
    ordered: ClassVar = (
        ("clearance", "bearing_radius", 1.0, "the clearance as large as the bearing"),
    )

    kind: Literal["clearance"]
    clearance: PositiveLength
    """Radial clearance c = R_B - R_J, m."""
    bearing_radius: PositiveLength
    """Radius of the bearing, m. It stays constant when the clearance varies."""
    length: PositiveLength | None = None
    """Length of the bearing along its axis, m. Line contact and pressures require it."""
    fit: str | None = None
    """Instead of `clearance` and `bearing_radius`: an ISO 286 fit such as "20 H7/f7". Both are then at the middle of
    their tolerances."""
    diametral_clearance: Annotated[float, Quantity("m", above=0)] | None = None
    """Instead of `clearance`: difference of the diameters of bearing and journal, m. It is twice the radial clearance."""
    start_eccentricity: Position = NOWHERE
    """Vector from the bearing centre to the journal centre at the start, m; default: centred."""
    wear: Wear | None = None
    """Wear of its surfaces. Without it they do not wear."""
    film: Film | None = None
    """Oil film between its surfaces. Without it the joint is dry."""
    out_of_round: OutOfRound | None = None
    """Waviness of its surfaces. Without it they are round."""

    @classmethod
    def _of_file(cls, row: Entries) -> Entries:
        return with_clearance(row)

    def _check(self) -> None:
        """A journal is left, and film and waves fit into the clearance."""
        if self.clearance >= self.bearing_radius:
            radius = shown(self.bearing_radius, "m")
            reason = f"must be smaller than the bearing radius ({radius}): no journal is left"
            raise invalid(reason, "Write the radial clearance R_B - R_J", "clearance")
        check_film(self.film, self.clearance, self.bearing_radius)
        check_waves(self.out_of_round, self.clearance, self.film)

    @property
    def length_path(self) -> str | None:
        """Its own length, or that of its film or wear."""
        parts = ("film", "wear")
        others = (f"{part}.length" for part in parts if getattr(self, part) is not None)
        return super().length_path or next(others, None)

    def start(self) -> tuple[Number, ...]:
        """The journal's eccentricity."""
        return self.start_eccentricity.x, self.start_eccentricity.y

    def gaps(self) -> tuple[Number, ...]:
        """Of the journal."""
        x, y = self.start()
        return (np.hypot(x, y) - self.clearance,)

    @staticmethod
    def shape(get: Get) -> Shape:
        """Numbers of a joint's samples.

        Paper eq. 4 as printed lacks R_J in the stiffness and is not dimensionally consistent; this is the form of the cited
        source, Lankarani and Nikravesh 1990 (doi:10.1115/1.2912617), for internal contact of spheres.
        """
        clearance, bearing = get("clearance"), get("bearing_radius")
        journal = bearing - clearance
        radii = (clearance, bearing, journal)
        return Shape(*radii, radii, bearing * journal / clearance)

    def gap(self, word: str, apart: Array, sizes: Sequence[Array]) -> Array:
        """How much further the journal is off than its clearance."""
        gap: Array = np.hypot(*apart) - sizes[0]
        return gap


class PlanarClearance(PinInBearing):
    """A pin with clearance: a journal within a larger bearing."""

    name: str
    journal: str
    """``body.point`` at the centre of the journal."""
    bearing: str
    """``body.point`` or ``ground.point`` at the centre of the bearing."""
    materials: Materials

    def ideal(self) -> PlanarRevolute:
        """A pin without clearance."""
        places = {entry: getattr(self, entry) for entry in ("name", "journal", "bearing")}
        return PlanarRevolute.model_construct(kind="revolute", **places)

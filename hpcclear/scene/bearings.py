"""A pin in a bearing, with clearance: what the tables of slider-cranks and linkages have in common."""

from typing import Annotated, Any, ClassVar, Literal

from pydantic import model_validator

from hpcclear.scene.fields import PositiveLength, Quantity, Table, invalid
from hpcclear.scene.film import Film, check_film
from hpcclear.scene.fits import with_clearance
from hpcclear.scene.places import NOWHERE, Place
from hpcclear.scene.roundness import OutOfRound, check_waves
from hpcclear.scene.wear import Wear


class Bearing(Table):
    """A pin with clearance: a journal that moves freely within a larger bearing."""

    geometry: ClassVar[str] = "pin_in_bearing"
    corners: ClassVar[tuple[str, ...]] = ()
    ordered: ClassVar = (
        ("clearance", "bearing_radius", 1.0, "the clearance as large as the bearing"),
    )
    """Entries of which the first, so many times, is less than the second; in samples, what is wrong where it is not."""

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
    start_eccentricity: Place = NOWHERE
    """Vector from the bearing centre to the journal centre at the start, m; default: centred."""
    wear: Wear | None = None
    """Wear of its surfaces. Without it they do not wear."""
    film: Film | None = None
    """Oil film between its surfaces. Without it the joint is dry."""
    out_of_round: OutOfRound | None = None
    """Waviness of its surfaces. Without it they are round."""

    @property
    def journal_radius(self) -> float:
        """R_J = R_B - c, m."""
        return self.bearing_radius - self.clearance

    _in_radii = model_validator(mode="before")(with_clearance)

    def _check(self) -> None:
        """A journal is left, and film and waves fit into the clearance."""
        if self.clearance >= self.bearing_radius:
            raise invalid(
                f"the clearance must be smaller than the bearing radius ({self.bearing_radius:g} m), or no journal is left",
                "Write the radial clearance R_B - R_J",
                key="clearance",
                value=self.clearance,
            )
        check_film(self.film, self.clearance, self.bearing_radius)
        check_waves(self.out_of_round, self.clearance, self.film)


def length_path(joint: Any) -> str | None:
    """Where a joint with clearance has its length at right angles to the plane: its own entry, or that of its film or wear."""
    if joint.corners:
        return None if joint.width is None else "width"
    if joint.length is not None:
        return "length"
    parts = ("film", "wear")
    return next((f"{part}.length" for part in parts if getattr(joint, part) is not None), None)

"""What lies on and between the surfaces of a joint with clearance, as in the scene file: wear, waves, an oil film."""

from typing import Annotated, Literal

from hpcclear.base.written import shown
from hpcclear.laws import laws
from hpcclear.laws.declared import FilmLaw
from hpcclear.scene.fields import Count, Length, PositiveLength, Quantity, Table, invalid
from hpcclear.scene.laws import LawName


class Film(Table):
    """Oil film between journal and bearing. It carries the load until the surfaces touch."""

    viscosity: Annotated[float, Quantity("Pa*s", least=0, most=1e4)]
    """Dynamic viscosity at the operating temperature of the bearing, Pa s."""
    length: PositiveLength
    """Length of the bearing along its axis, m."""
    model: Annotated[str, LawName("film")]
    """Solution of Reynolds' equation: for bearings much shorter than their diameter ("short", Ocvirk), much longer
    ("long", Sommerfeld), or for the actual length ("finite", solved once per bearing)."""
    roughness: PositiveLength = 1e-6
    """Combined roughness of both surfaces, m: the film thickness at which they touch."""

    @property
    def law(self) -> FilmLaw:
        """The model, as `hpcclear.laws.declared.FilmLaw`."""
        return laws("film")[self.model]  # type: ignore[no-any-return]


def check_film(film: Film | None, clearance: float, radius: float) -> None:
    """An error for validators unless rough surfaces leave a film in the clearance, m, and its model fits the bearing."""
    if film is None:
        return
    ratio, (least, most) = 0.5 * film.length / radius, film.law.lengths
    if film.law.further is not None and not least <= ratio <= most:
        reason = f"is for lengths of {least:g} to {most:g} diameters, and this is {ratio:.3g} long"
        raise invalid(reason, 'Take "short"' if ratio < 1.0 else 'Take "long"', "film.model")
    if 4.0 * film.roughness > clearance:
        most_rough = f"a quarter of the clearance ({shown(clearance, 'm')})"
        reason = f"must be at most {most_rough}, or no film is left"
        raise invalid(reason, "Write the roughness of both surfaces together", "film.roughness")


class SurfaceWaves(Table):
    """Depth of a surface below the round one, m: a Fourier series in the angle around it. The angle is measured from
    the x axis of the body; in a slider-crank this axis points from the first joint of a link to its second.
    """

    cosine_1: Length = 0.0
    sine_1: Length = 0.0
    cosine_2: Length = 0.0
    sine_2: Length = 0.0
    cosine_3: Length = 0.0
    sine_3: Length = 0.0
    cosine_4: Length = 0.0
    sine_4: Length = 0.0
    cosine_5: Length = 0.0
    sine_5: Length = 0.0
    cosine_6: Length = 0.0
    sine_6: Length = 0.0
    cosine_7: Length = 0.0
    sine_7: Length = 0.0
    cosine_8: Length = 0.0
    sine_8: Length = 0.0

    def given(self) -> int:
        """The number of the last wave that is not zero."""
        entries = [name for name in type(self).model_fields if getattr(self, name)]
        return max((int(name.rpartition("_")[2]) for name in entries), default=0)

    def deepest(self) -> float:
        """What the depth can come to at most, m."""
        return sum(abs(getattr(self, name)) for name in type(self).model_fields)


class OutOfRound(Table):
    """Waviness of the surfaces of a joint with clearance. A surface without an entry is round."""

    bearing: SurfaceWaves | None = None
    journal: SurfaceWaves | None = None


def check_waves(waves: OutOfRound | None, clearance: float, film: Film | None) -> None:
    """An error for validators unless some clearance is left everywhere around, m, and the joint is dry."""
    if waves is None:
        return
    if film is not None:
        raise invalid("an oil film needs round surfaces", "Remove it or film", "out_of_round", None)
    for name in ("bearing", "journal"):
        own = getattr(waves, name)
        if own is not None and own.deepest() >= clearance:
            high, given = shown(own.deepest(), "m"), shown(clearance, "m")
            reason = f"waves are {high} high, but the clearance is {given}: the journal may not fit"
            raise invalid(reason, "Make them smaller", f"out_of_round.{name}", high)


class WornSurface(Table):
    """Wear coefficient of one surface: `coefficient` in m2/N, or `dimensionless` together with the `hardness` of the
    surface."""

    coefficient: Annotated[float, Quantity("m**2/N", least=0)] | None = None
    """Wear coefficient k, m2/N: worn volume / (normal force x sliding distance) (Archard 1953)."""
    dimensionless: Annotated[float, Quantity("", least=0)] | None = None
    """Dimensionless wear coefficient K; k = K / hardness."""
    hardness: Annotated[float, Quantity("Pa", above=0)] | None = None
    """Hardness of this surface, Pa."""

    def _check(self) -> None:
        remedy = "Write coefficient = 1e-15 (m2/N), or dimensionless = 1e-6 and hardness"
        self.check_one_of(remedy, "coefficient", "dimensionless")
        if (self.dimensionless is None) != (self.hardness is None):
            reason = "a dimensionless coefficient needs a hardness, and one in m2/N must have none"
            raise invalid(reason, "Give both, or neither", "hardness")


class RunningIn(Table):
    """Faster wear of a new joint."""

    factor: Annotated[float, Quantity("", least=1)]
    """Initial factor on both wear coefficients."""
    work: Annotated[float, Quantity("J", above=0)]
    """Sliding work after which the excess wear rate has decayed to 1/e, J."""


class Wear(Table):
    """Archard wear of a joint; a surface that is left out does not wear."""

    length: PositiveLength
    """Length of the bearing along its axis, m."""
    bearing: WornSurface | None = None
    journal: WornSurface | None = None
    running_in: RunningIn | None = None
    threshold: Annotated[float, Quantity("Pa", above=0)] | None = None
    """Pressure below which there is no wear, Pa (normal force / (diameter x length)). The wear rate increases linearly
    to its full value at 1.1 times this pressure."""

    def _check(self) -> None:
        if self.bearing is None and self.journal is None:
            raise invalid("neither bearing nor journal wears", "Give one a coefficient", "bearing")


class WearLimits(Table):
    """Thresholds that end a service life; the first one that is passed counts. A clearance of a quarter of the bearing
    radius always ends it."""

    clearance: PositiveLength | None = None
    """Clearance of any worn joint, m."""
    peak_contact_force: Annotated[float, Quantity("N", above=0)] | None = None
    """Peak contact force of any joint, N."""
    objective: Annotated[float, Quantity("", above=0)] | None = None
    """Objective f, SI."""

    def given(self) -> dict[str, float]:
        """Those that are set, by name."""
        every = {name: getattr(self, name) for name in type(self).model_fields}
        return {name: value for name, value in every.items() if value is not None}


class Lives(Table):
    """Service lives for `hpcclear wear`, each with its own random inputs."""

    cycles: Annotated[float, Quantity("", above=0)] = 1e6
    """Revolutions of a service life."""
    lives: Annotated[int, Count(1, 10**6)] = 1
    """Number of service lives, each with its own random inputs; a single one uses the values of the scene."""
    tolerance: Annotated[float, Quantity("", above=0, most=0.2)] = 0.01
    """Relative error of an extrapolation jump, in each clearance and in f."""
    copies: Annotated[int, Count(2, 1024)] = 4
    """Number of replicas at a state of wear, perturbed by 1e-9 of the clearance. They diverge if the motion is chaotic."""
    most_copies: Annotated[int, Count(2, 1024)] = 32
    """Largest number of replicas, if the confidence intervals of wear rate and f exceed the tolerance."""
    profile: Literal["uniform", "angular"] = "uniform"
    """Distribution of wear around the surfaces: "uniform", or "angular" where they touch."""
    harmonics: Annotated[int, Count(1, 8)] = 3
    """Fourier components of an angular profile; more components resolve narrower grooves."""
    bins: Annotated[int, Count(4, 3600)] = 72
    """Angles at which an angular profile is stored."""
    points: Annotated[int, Count(2, 10**4)] = 41
    """Number of ages at which curves are stored."""
    limit: WearLimits = WearLimits()
    """Thresholds that end a service life."""
    beyond_limit: bool = False
    """Whether service lives continue beyond the thresholds in `limit`, to `cycles` or to a clearance of a quarter of
    the bearing radius."""

    @property
    def waves(self) -> int:
        """Fourier components of the wear profile; 0 for uniform wear."""
        return self.harmonics if self.profile == "angular" else 0

    def _check(self) -> None:
        if self.most_copies < self.copies:
            raise invalid("is below copies", "Raise it, or lower copies", "most_copies")

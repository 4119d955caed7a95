"""Wear of a joint with clearance, and the lives that `hpcclear wear` follows, as in the scene file."""

from typing import Annotated, Literal

from hpcclear.scene.fields import Count, PositiveLength, Quantity, Table, check_one_of, invalid


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
        check_one_of(
            "coefficient", self.coefficient, self.dimensionless,
            "Write coefficient = 1e-15 (m2/N), or dimensionless = 1e-6 and hardness",
        )  # fmt: skip
        if (self.dimensionless is None) != (self.hardness is None):
            raise invalid(
                "a dimensionless coefficient needs a hardness; a coefficient in m2/N must have none",
                "Give both, or neither",
                key="hardness",
                value=self.hardness,
            )


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
            raise invalid(
                "neither bearing nor journal wears",
                "Give one of them a coefficient",
                "bearing",
                None,
            )


class Limits(Table):
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
    limit: Limits = Limits()
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
            raise invalid(
                "copies is larger than most_copies",
                "Raise most_copies, or lower copies",
                "most_copies",
                self.most_copies,
            )

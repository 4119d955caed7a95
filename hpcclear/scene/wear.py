"""Wear of a joint with clearance, and the lives that `hpcclear wear` follows, as in the scene file."""

from typing import Annotated, Literal

from pydantic import model_validator

from hpcclear.scene.fields import Count, PositiveLength, Quantity, Table, check_one_of, invalid


class WornSurface(Table):
    """How fast one surface wears: a coefficient with a unit, or one without over the surface's hardness."""

    coefficient: Annotated[float, Quantity("m**2/N", least=0)] | None = None
    """k, worn volume over normal force times sliding distance, m2/N (Archard 1953)."""
    dimensionless: Annotated[float, Quantity("", least=0)] | None = None
    """K; k = K / hardness."""
    hardness: Annotated[float, Quantity("Pa", above=0)] | None = None
    """H of this surface, Pa."""

    @model_validator(mode="after")
    def _one_of_both(self) -> "WornSurface":
        check_one_of(
            "coefficient", self.coefficient, self.dimensionless,
            "Write coefficient = 1e-15 (m2/N), or dimensionless = 1e-6 and hardness",
        )  # fmt: skip
        if (self.dimensionless is None) != (self.hardness is None):
            raise invalid(
                "a dimensionless coefficient goes with a hardness, a coefficient in m2/N without",
                "Give both, or neither",
                key="hardness",
                value=self.hardness,
            )
        return self


class RunningIn(Table):
    """How much faster a joint wears while it is new."""

    factor: Annotated[float, Quantity("", least=1)]
    """Of both coefficients at first."""
    work: Annotated[float, Quantity("J", above=0)]
    """Sliding work of the joint in which what is too much of it falls to 1/e, J."""


class Wear(Table):
    """Archard wear of a joint; a surface that is left out does not wear."""

    length: PositiveLength
    """Of the bearing, at right angles to the plane, m."""
    bearing: WornSurface | None = None
    journal: WornSurface | None = None
    running_in: RunningIn | None = None
    threshold: Annotated[float, Quantity("Pa", above=0)] | None = None
    """Pressure (normal force over diameter times length) that wears nothing, Pa; from a tenth more on all of it counts."""

    @model_validator(mode="after")
    def _something_wears(self) -> "Wear":
        if self.bearing is None and self.journal is None:
            raise invalid(
                "neither bearing nor journal wears",
                "Give one of them a coefficient",
                "bearing",
                None,
            )
        return self


class Limits(Table):
    """What ends a life, whichever is passed first; a clearance of a quarter of its bearing's radius always does."""

    clearance: PositiveLength | None = None
    """Of any worn joint, m."""
    peak_contact_force: Annotated[float, Quantity("N", above=0)] | None = None
    """At any joint, N."""
    objective: Annotated[float, Quantity("", above=0)] | None = None
    """f, SI."""

    def given(self) -> dict[str, float]:
        """Those that are set, by name."""
        every = {name: getattr(self, name) for name in type(self).model_fields}
        return {name: value for name, value in every.items() if value is not None}


class Lives(Table):
    """What `hpcclear wear` follows: lives of so many revolutions, each with its own random inputs."""

    cycles: Annotated[float, Quantity("", above=0)] = 1e6
    """Revolutions of a life."""
    lives: Annotated[int, Count(1, 10**6)] = 1
    """Each with values of its own of all random inputs of the study; a single one is the scene as it stands."""
    tolerance: Annotated[float, Quantity("", above=0, most=0.2)] = 0.01
    """Of a jump in each clearance and in f, relative."""
    copies: Annotated[int, Count(2, 1024)] = 4
    """Simulations at a state of wear, kicked by 1e-9 of the clearance: where motion is chaotic they part."""
    most_copies: Annotated[int, Count(2, 1024)] = 32
    """Where the limits of rate and f are wider than the tolerance allows."""
    profile: Literal["uniform", "angular"] = "uniform"
    """Where surfaces wear: evenly, or where they touch."""
    harmonics: Annotated[int, Count(1, 8)] = 3
    """Waves around a surface that an angular profile is made of; the more, the narrower what a contact wears at a time."""
    bins: Annotated[int, Count(4, 3600)] = 72
    """Angles that an angular profile is told at."""
    points: Annotated[int, Count(2, 10**4)] = 41
    """Revolutions that curves are told at."""
    limit: Limits = Limits()
    """Values that end a life."""
    beyond_limit: bool = False
    """Whether lives go on past their limits to `cycles`, or until a clearance is a quarter of its bearing's radius."""

    @property
    def waves(self) -> int:
        """Waves around a surface that wears; 0 of one that wears evenly."""
        return self.harmonics if self.profile == "angular" else 0

    @model_validator(mode="after")
    def _copies_in_order(self) -> "Lives":
        if self.most_copies < self.copies:
            raise invalid(
                "there are more copies at first than at most",
                "Raise most_copies, or lower copies",
                "most_copies",
                self.most_copies,
            )
        return self

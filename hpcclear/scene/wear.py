"""Wear of a joint with clearance, and the lives that `hpcclear wear` follows, as in the scene file."""

from typing import Annotated

from pydantic import model_validator

from hpcclear.scene.fields import PositiveLength, Quantity, Table, invalid


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
        if (self.coefficient is None) == (self.dimensionless is None):
            raise invalid(
                "is given twice, or not at all",
                "Write coefficient = 1e-15 (m2/N), or dimensionless = 1e-6 and hardness",
                key="coefficient",
                value=self.coefficient,
            )
        if (self.dimensionless is None) != (self.hardness is None):
            raise invalid(
                "a dimensionless coefficient goes with a hardness, a coefficient in m2/N without",
                "Give both, or neither",
                key="hardness",
                value=self.hardness,
            )
        return self


class Wear(Table):
    """Archard wear of a joint; a surface that is left out does not wear."""

    length: PositiveLength
    """Of the bearing, at right angles to the plane, m."""
    bearing: WornSurface | None = None
    journal: WornSurface | None = None

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

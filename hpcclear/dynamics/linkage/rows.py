"""Where a generated text finds and leaves its numbers."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from hpcclear.dynamics import layout as at


@dataclass(frozen=True)
class Rows:
    """Where a text finds and leaves its numbers: first rows of `work`, rows of parameters, first row that is free."""

    coordinates: int = at.QS
    velocities: int = at.VS
    accelerations: int = at.ACC
    rates: int = at.RATE_NOW
    time: int = at.STAGE_TIME
    holds: int | None = None  # first of the multipliers, where they are asked for
    parameters: Mapping[str, int] = field(default_factory=dict)
    free: int = 0
    curves: Mapping[str, int] = field(default_factory=dict)  # tabulated values, by drive or load
    places: Mapping[str, int] = field(
        default_factory=dict
    )  # on straight tables; rates MAX_CURVES behind

    def behind(self, bristles: int) -> "Rows":
        """The same of a motion whose coordinates come after so many of bristles."""
        return replace(
            self,
            coordinates=self.coordinates + bristles,
            velocities=self.velocities + bristles,
            accelerations=self.accelerations + bristles,
        )

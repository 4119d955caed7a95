"""Where a generated text finds and leaves its numbers, and what it has in it."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from hpcclear.dynamics import layout as at


class On(NamedTuple):
    """Which effects and outputs a text has, besides the mechanism's own loads and drives."""

    friction: bool = False  # in the joints with clearance: of contact or of a film
    gravity: bool = False
    energies: bool = False  # energy balance
    series: bool = False  # drive moment, for time series
    responses: bool = False  # drive moment and what is followed
    impacts: bool = False  # force on the frame
    pins: bool = False  # forces of ideal pins
    follow: str = ""  # a guided body, or body.point
    objective: str = ""  # its rate: "joints", or "whole" of the mechanism
    waves: bool = False  # surfaces of the joints with clearance are out of round


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
    # on straight tables; rates MAX_CURVES behind
    places: Mapping[str, int] = field(default_factory=dict)

    def behind(self, bristles: int) -> "Rows":
        """The same of a motion whose coordinates come after so many of bristles."""
        moved = ("coordinates", "velocities", "accelerations")
        return replace(self, **{name: getattr(self, name) + bristles for name in moved})

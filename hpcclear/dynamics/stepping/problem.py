"""What is common to the samples of a run, as numbers: linkage, effects, method, tolerances, tables."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.outcome import Status
from hpcclear.base.pieces import Pieces, breaks
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout.curves import packed
from hpcclear.dynamics.layout.views import Outcome, Parameters, RunSettings, Start
from hpcclear.dynamics.linkage.linkage import Linkage
from hpcclear.dynamics.stepping.explicit.tableau import Tableau
from hpcclear.dynamics.stepping.sample import STRICT

if TYPE_CHECKING:
    from hpcclear.base.lowering.compiled import Compiled

TORN = 0.25
"""Penetration over a bearing's radius from which on a result is none: contact laws are of small ones, the softest bearing
(0.5 GPa) of the paper comes to 0.035, and no material takes strains of this size."""

THROWN_BACK = 0.0873
"""How far (5 degrees) from its start a body that a torque drives may turn back, rad, in its first revolution from rest:
the first impacts in its joints throw it."""

FOLLOWED = 0.1
"""Times the root of the relative tolerance: what part of a table's range may escape a step between two rows that end steps."""

IMPLICIT_USE = {"never": 0, "stiff": 1, "always": 2}
"""When lanes take implicit steps: never, where their motion is stiff, always."""


@dataclass(frozen=True)
class Problem:
    """Everything that is common to the samples of a run.

    Raises ValueError if the coordinates do not fit the kernel.
    """

    linkage: Linkage  # whose motion it is
    effects: at.Effects
    coordinates: int
    tableau: Tableau
    rtol: float
    atol: float  # of lengths, m; samples' parameters have those of all coordinates over it
    impact_floor: float  # least `latched` impact speed, m/s
    transient: int
    averaged: int
    max_steps: int
    implicit: str = "never"  # when lanes take implicit steps, a key of `IMPLICIT_USE`
    # turn of the driven body in a revolution, rad: < 0 clockwise, 0 of a swing
    cycle: float = at.TURN
    parameter_rows: int = at.OWN  # parameters of a sample
    curves: tuple[Pieces, ...] = ()  # its tables
    chosen: tuple[int, ...] = ()  # places of the joints whose gaps count for f; none for all
    from_rest: bool = False  # whether the body that a torque drives may begin at rest

    def __post_init__(self) -> None:
        n = self.coordinates
        if not 0 <= n <= at.MAX_COORDINATES:
            raise ValueError(f"the kernel holds {at.MAX_COORDINATES} coordinates at most, not {n}")

    def settings(self) -> RunSettings:
        """The numbers that the stepper's control reads."""
        s = RunSettings(np.zeros(RunSettings.size))
        s.rtol, s.atol = self.rtol, self.atol
        # An impact is located ten times better than positions are integrated, but not below round-off.
        s.gap_tolerance = max(0.1 * self.atol, 4e-15)
        s.angle_tolerance = max(self.rtol * 1e-3, 1e-13)
        s.impact_floor = self.impact_floor
        s.transient, s.averaged, s.max_steps = self.transient, self.averaged, self.max_steps
        s.smallest_step = 1e-14
        s.exponent = 1.0 / (min(self.tableau.order, self.tableau.error_order) + 1)
        s.beta = 0.04
        s.implicit = IMPLICIT_USE[self.implicit]
        s.senses = 1.0 if self.implicit != "never" or self.rtol > STRICT else 0.0
        s.cycle, s.parameter_rows = self.cycle, self.parameter_rows
        s.at_rest = THROWN_BACK if self.from_rest else 0.0
        s.profiled = at.wave_rows(self.effects) if self.effects.profile else 0
        s.chosen = 0.0 if self.chosen else 1.0
        s.chosen[list(self.chosen)] = 1.0
        return s

    def motion(self, effects: at.Effects, width: int) -> "Compiled":
        """The compiled motion of so many lanes with these effects (`rhs.compiled_motion`)."""
        from hpcclear.dynamics.linkage.rhs import compiled_motion  # loads the compiler

        return compiled_motion(self.linkage.module(effects), effects, width)

    def marked(self, outcome: Outcome, par: Array, start: Start) -> Outcome:
        """Outcomes (m) of samples (m, PARAMETERS), with the statuses that the kernel does not know: of those that failed at
        their starts (m), or were penetrated too deep."""
        if not np.isfinite(start.moving).all():
            failed = start.failed
            outcome.status[failed != Status.OK] = failed[failed != Status.OK]
        torn = (outcome.deepest > TORN * Parameters(par).bearing_radius).any(axis=-1)
        if torn.any():
            valid = np.isin(outcome.status, [status for status in Status if status.valid])
            outcome.status[valid & torn] = Status.TORN_THROUGH
        return outcome

    @cached_property
    def tables(self) -> Array:
        """The tabulated curves as the kernel reads them, shape (n,) (`layout.curves.packed`)."""
        return packed(self.curves, self.stops, self.linkage.bends)

    @cached_property
    def stops(self) -> tuple[Array, ...]:
        """Where steps end in each curve, shares of its length: at rows around which it bends (`base.pieces.breaks`)."""
        tolerance = FOLLOWED * math.sqrt(self.rtol)
        return tuple(breaks(curve, tolerance) for curve in self.curves)

    @property
    def stopping_curves(self) -> int:
        """How many tables a stepper watches: all of them, if steps end at rows of any."""
        bends = self.linkage.bends
        ending = bends or any(len(ends) for ends in self.stops)
        return len(self.curves) + len(bends) if ending else 0

"""How the steady mean of one design is found: a look at four copies, then as many revolutions of 32 copies as it takes."""

from collections.abc import Generator

from hpcclear.dynamics.evaluation.steady.effort import Effort, Mean, Sample, Segment
from hpcclear.dynamics.evaluation.steady.ensemble import LOOSEST, LOOSEST_LATCHED, ensemble
from hpcclear.dynamics.evaluation.steady.look import look
from hpcclear.dynamics.layout.views import Outcome, Parameters

USUAL = 1e-4
"""Clearance, m, down to which the initial tolerances of chaotic means were found good enough. At 0.02 mm means at 1e-6 were
off by 1 %, more than their difference from 1e-5."""


def steady_mean(sample: Sample, target: float, budget: int) -> Generator[Segment, Outcome, Mean]:
    """Find the steady mean of a design to a relative error (95 % CI), or report that it is missed or does not exist.

    `budget`: revolutions of all copies together, at most (a segment that is under way is finished). The mean of a failed
    simulation has its status.
    """
    effort = Effort(sample, budget)
    found, growth = yield from look(effort, target)
    if isinstance(found, Mean):
        return found
    return (yield from ensemble(effort, target, min(found, loosest(sample)), growth))


def loosest(sample: Sample) -> float:
    """Upper bound of an ensemble's first looser tolerance; tolerances are relative to positions, not to the clearance."""
    gaps = Parameters(sample.par).clearance
    narrow = min(float(gaps[gaps > 0.0].min()) / USUAL, 1.0)
    return narrow * (LOOSEST_LATCHED if sample.latched else LOOSEST)

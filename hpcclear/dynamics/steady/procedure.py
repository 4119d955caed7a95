"""How the steady mean of one design is found: a look at four copies, then as many revolutions of 32 copies as it takes."""

from collections.abc import Generator

from hpcclear.dynamics.steady.effort import Effort, Mean, Sample, Stretch
from hpcclear.dynamics.steady.ensemble import LOOSEST, LOOSEST_LATCHED, ensemble
from hpcclear.dynamics.steady.look import look
from hpcclear.dynamics.views import Outcome


def steady_mean(sample: Sample, target: float, budget: int) -> Generator[Stretch, Outcome, Mean]:
    """Find the steady mean of a design to a relative error, 95 % limits, or say that it is missed or does not exist.

    Parameters
    ----------
    sample : Sample
    target : float
    budget : int
        Revolutions of all copies together, at most (a stretch that is under way is finished).

    Returns
    -------
    Mean
        Of a failed simulation with its status.
    """
    effort = Effort(sample, budget)
    found, growth = yield from look(effort, target)
    if isinstance(found, Mean):
        return found
    loosest = LOOSEST_LATCHED if sample.latched else LOOSEST
    return (yield from ensemble(effort, target, min(found, loosest), growth))

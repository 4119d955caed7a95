"""A run by revolutions: mean gaps of each, every one started from the end of the last."""

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.dynamics.lanes import Lanes
from hpcclear.dynamics.layout import MAX_JOINTS
from hpcclear.dynamics.views import Start


def objective(gaps: Array) -> Array:
    """f (eq. 13), m, from mean gaps of all joints, m: shape (..., joints) to (...)."""
    total: Array = np.hypot(gaps[..., 0], gaps[..., 1])
    for k in range(2, gaps.shape[-1]):
        total = np.hypot(total, gaps[..., k])  # by 0 it stays what it is, to the last bit
    return total


def gaps_of_revolutions(lanes: Lanes, par: Array, start: Start, revolutions: int) -> Array:
    """Mean gaps of every revolution, shape (revolutions, samples, MAX_JOINTS), m; NaN from a failure on.

    Parameters
    ----------
    lanes : Lanes
        Empty, of a problem that averages one revolution without a transient.
    par : ndarray, shape (samples, PARAMETERS)
    start : Start
    revolutions : int
    """
    count = len(par)
    gaps = np.full((revolutions, count, MAX_JOINTS), np.nan)
    alive = np.arange(count)
    for revolution in range(revolutions):
        outcome = lanes.run(par[alive], start)
        good = outcome.status == 0
        alive, outcome = alive[good], outcome[good]
        gaps[revolution, alive] = outcome.mean_gap
        start = outcome.end()
    return gaps

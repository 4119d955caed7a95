"""A run told revolution by revolution: mean gaps of each, every one started from the end of the last."""

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.lanes import Lanes
from hpcclear.dynamics.stepping.lifecycle import STATE


def objective(gaps: Array) -> Array:
    """f (eq. 13), m, from mean gaps of both joints, m: shape (..., 2) to (...)."""
    return np.hypot(gaps[..., 0], gaps[..., 1])


def turn_by_turn(lanes: Lanes, par: Array, state: Array, revolutions: int) -> Array:
    """Mean gaps of every revolution, shape (revolutions, samples, 2 joints), m; NaN from a failure on.

    Parameters
    ----------
    lanes : Lanes
        Empty, of a problem that averages one revolution without a transient.
    par, state : ndarray
        Parameters and starts of the samples, as `hpcclear.dynamics.lowering` makes them.
    revolutions : int
    """
    count = len(par)
    gaps = np.full((revolutions, count, 2), np.nan)
    alive = np.arange(count)
    for revolution in range(revolutions):
        lanes.queue(par[alive], state, alive)
        while lanes.step(1 << 40):
            pass
        labels, rows, *_ = lanes.collect()
        rows = rows[np.argsort(labels)]
        good = rows[:, at.OUT_STATUS] == 0
        alive, rows = alive[good], rows[good]
        gaps[revolution, alive] = rows[:, [at.OUT_GAP_12, at.OUT_GAP_23]]
        state = ends(rows)
    return gaps


def ends(rows: Array) -> Array:
    """Ends of samples (m, OUT) as starts of the next revolution, shape (m, STATE)."""
    state = np.empty((len(rows), STATE))
    n = 2 * at.MAX_COORDINATES
    state[:, :n] = np.nan_to_num(rows[:, at.OUT_STATE : at.OUT_STATE + n])
    contact = [
        at.OUT_ACTIVE_12,
        at.OUT_ACTIVE_23,
        at.OUT_INVERSE_IMPACT_12,
        at.OUT_INVERSE_IMPACT_23,
    ]
    state[:, n:] = rows[:, contact]
    return state

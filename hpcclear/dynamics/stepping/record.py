"""The accepted steps of the first samples of a queue, of which time series are made. A record without rows keeps none."""

import numpy as np

from hpcclear.base.jit import lane_function
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout.arguments import Counter

# one row: time since the start of the run and of the revolution, its number, place of the sample in the queue, contact state,
# works, measures, then q, v, a
(TIME, TURN_TIME, REVOLUTION, SLOT, CONTACTS) = range(5)
JOINTS = at.MAX_JOINTS
DRIVE_WORK = CONTACTS + 2 * JOINTS
(ABS_DRIVE_WORK, DISSIPATED, LOAD_WORK, MEASURED) = range(DRIVE_WORK + 1, DRIVE_WORK + 5)
_FORCES = range(at.FORCE, at.FORCE + JOINTS)
_PLACES = np.array([
    k for k, one in enumerate(at.INTEGRATED) if one.rate in _FORCES or one.asked_by in ("impacts", "steps")
])  # fmt: skip
MEASURES = at.INTEGRATED_RATES[_PLACES]  # of impact and noise, whose integrals stand in a row
STATE = MEASURED + len(MEASURES)


def columns(n: int) -> int:
    """Length of a row for n coordinates."""
    return STATE + 3 * n


@lane_function
def record_step(record, counters, work, stages, book, n, W):
    """Append the new states of the first `KEPT` samples of the queue to `record`, in the order of their lanes.

    True when the next ones might not fit and the stepper must return. The steps of other samples are not recorded.
    """
    full = False
    if record.shape[0] > 0:
        for lane in range(W):
            moved = work[at.ACCEPT * W + lane] * work[at.RUNNING * W + lane] == 1.0
            if moved and book[at.SAMPLE * W + lane] < counters[Counter.KEPT]:
                row = counters[Counter.RECORDED]
                record[row, TIME] = book[at.ELAPSED * W + lane] + work[at.TIME * W + lane]
                record[row, TURN_TIME] = work[at.TIME * W + lane]
                record[row, REVOLUTION] = book[at.REVOLUTION * W + lane]
                record[row, SLOT] = book[at.SAMPLE * W + lane]
                for k in range(JOINTS):
                    record[row, CONTACTS + k] = work[(at.ACTIVE + k) * W + lane]
                    record[row, CONTACTS + JOINTS + k] = work[(at.INVERSE_IMPACT + k) * W + lane]
                for r in range(4):
                    done = book[(at.TOTAL + at.WORKS + r) * W + lane]
                    new = work[(at.INTEGRAL + at.DRIVE_POWER + r) * W + lane]
                    record[row, DRIVE_WORK + r] = done + new
                for r in range(len(MEASURES)):
                    done = book[(at.TOTAL + _PLACES[r]) * W + lane]
                    record[row, MEASURED + r] = done + work[(at.INTEGRAL + MEASURES[r]) * W + lane]
                for k in range(n):
                    record[row, STATE + k] = work[(at.Q + k) * W + lane]
                    record[row, STATE + n + k] = work[(at.V + k) * W + lane]
                    record[row, STATE + 2 * n + k] = stages[k * W + lane]
                counters[Counter.RECORDED] = row + 1
        full = counters[Counter.RECORDED] + counters[Counter.KEPT] > record.shape[0]
    return full

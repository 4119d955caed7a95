"""The accepted steps of one sample, of which time series are made. Ensembles pass a record without rows, which keeps none."""

import numpy as np

from hpcclear.base.jit import lane_function
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout.settings import RECORDED

# one row: time since the start of the run and of the revolution, contact state, works, measures, then q, v, a
(TIME, TURN_TIME, REVOLUTION, CONTACTS) = range(4)
JOINTS = at.MAX_JOINTS
DRIVE_WORK = CONTACTS + 2 * JOINTS
(ABS_DRIVE_WORK, DISSIPATED, LOAD_WORK, MEASURED) = range(DRIVE_WORK + 1, DRIVE_WORK + 5)
MEASURES = np.array([
    row + k
    for row, size in (
        (at.FORCE, JOINTS), (at.FORCE_SQUARES, JOINTS), (at.IMPACT_POWERS, JOINTS), (at.FLIGHTS, JOINTS),
        (at.BEGUN, JOINTS), (at.FRAME_X, 1), (at.FRAME_Y, 1), (at.FRAME_SQUARE, 1),
    )
    for k in range(size)
])  # fmt: skip
"""Measures of impact and noise whose integrals stand in a row."""
STATE = MEASURED + len(MEASURES)
_PLACES = np.array([at.place(int(rate)) for rate in MEASURES])


def columns(n: int) -> int:
    """Length of a row for n coordinates."""
    return STATE + 3 * n


@lane_function
def record_step(record, counters, work, stages, book, n, W):
    """Append the new state of the first sample of the queue, in lane 0, to `record`; True when it is full and the stepper must
    return. The steps of samples beside or behind it are not recorded."""
    full = False
    if record.shape[0] > 0:
        if work[at.ACCEPT * W] * work[at.RUNNING * W] == 1.0 and book[at.SAMPLE * W] == 0.0:
            row = counters[RECORDED]
            record[row, TIME] = book[at.ELAPSED * W] + work[at.TIME * W]
            record[row, TURN_TIME] = work[at.TIME * W]
            record[row, REVOLUTION] = book[at.REVOLUTION * W]
            for k in range(JOINTS):
                record[row, CONTACTS + k] = work[(at.ACTIVE + k) * W]
                record[row, CONTACTS + JOINTS + k] = work[(at.INVERSE_IMPACT + k) * W]
            for r in range(4):
                done = book[(at.TOTAL + at.WORKS + r) * W]
                record[row, DRIVE_WORK + r] = done + work[(at.INTEGRAL + at.DRIVE_POWER + r) * W]
            for r in range(len(MEASURES)):
                done = book[(at.TOTAL + _PLACES[r]) * W]
                record[row, MEASURED + r] = done + work[(at.INTEGRAL + MEASURES[r]) * W]
            for k in range(n):
                record[row, STATE + k] = work[(at.Q + k) * W]
                record[row, STATE + n + k] = work[(at.V + k) * W]
                record[row, STATE + 2 * n + k] = stages[k * W]
            counters[RECORDED] = row + 1
        full = counters[RECORDED] >= record.shape[0]
    return full

"""Numbers shared by all lanes of a run: the settings of its control, and the counters of its queue."""

import numpy as np

from hpcclear.base.arrays import Integers
from hpcclear.base.jit import lane_function
from hpcclear.dynamics import layout as at

(
    RTOL,
    GAP_TOLERANCE,  # m: an impact is located this well
    ANGLE_TOLERANCE,  # rad, likewise for the end of a revolution of a free crank
    IMPACT_FLOOR,  # m/s, least latched impact speed
    TRANSIENT,  # revolutions
    AVERAGED,  # revolutions
    MAX_STEPS,
    SMALLEST_STEP,  # relative to the time
    EXPONENT,
    BETA,
    IMPLICIT,  # 0 never, 1 where the motion is stiff, 2 always
    CYCLE,  # rad, by which the driven body turns in a revolution; negative clockwise
    PARAMETER_ROWS,  # how many parameters a sample has
    PROFILED,  # how many rates of profiles of wear there are to integrate
    AT_REST,  # rad, within which a crank that starts from rest may turn back
    SENSES,  # 1 where explicit steps look out for the edge of stability
    CHOSEN,  # of each joint: 1 where its gap counts for the objective
) = range(17)
ATOL = CHOSEN + at.MAX_JOINTS  # first of 2 * MAX_COORDINATES
WRAPS = (
    ATOL + 2 * at.MAX_COORDINATES
)  # rad, by which each coordinate is counted anew with a revolution; first of MAX_COORDINATES
SETTINGS = WRAPS + at.MAX_COORDINATES

STRICT = 1e-6
"""Relative tolerance of explicit steps that is never made stricter at the edge of stability."""

# ---- counters shared by all lanes
(NEXT_SLOT, SLOTS, FINISHED, RECORDED, KEPT) = range(5)
COUNTERS = 5

# ---- numbers by which a stepper asks for what is compiled apart from it
(
    ASKED, LANE, FOUND, WIDTH, COORDINATES, MEASURES, MOTION, MOTION_OF_EIGHT, OBSERVING, OBSERVING_EIGHT, PROFILE,
    RULES,  # the first of them
) = range(12)  # fmt: skip
NUMBERS = RULES + len(at.Rules._fields)


def numbers_of(rules: at.Rules, width: int, n: int, measures: int) -> Integers:
    """Those of a stepper of `width` lanes, whose motions have no addresses yet."""
    numbers = np.zeros(NUMBERS, np.int64)
    numbers[WIDTH], numbers[COORDINATES], numbers[MEASURES] = width, n, measures
    numbers[RULES:] = rules
    return numbers


@lane_function
def rules_in(numbers):
    """The rules among such numbers."""
    r = RULES
    return at.Rules(
        numbers[r], numbers[r + 1], numbers[r + 2], numbers[r + 3], numbers[r + 4], numbers[r + 5],
        numbers[r + 6], numbers[r + 7], numbers[r + 8],
    )  # fmt: skip

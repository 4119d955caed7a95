"""Numbers shared by all lanes of a run: the settings of its control, and the counters of its queue."""

from hpcclear.dynamics import layout as at

(
    RTOL,
    GAP_TOLERANCE,  # m: an impact is located this well
    ANGLE_TOLERANCE,  # rad, likewise for the end of a revolution of a free crank
    IMPACT_FLOOR,  # m/s, least latched impact speed
    TRANSIENT,  # revolutions
    AVERAGED,  # revolutions; at least so many if OBJECTIVE_TOLERANCE > 0
    AVERAGED_CAP,  # and at most so many
    OBJECTIVE_TOLERANCE,  # relative standard error of the objective to reach; 0: a fixed number
    MAX_STEPS,
    SMALLEST_STEP,  # relative to the time
    EXPONENT,
    BETA,
    IMPLICIT,  # 0 never, 1 where the motion is stiff, 2 always
    CYCLE,  # rad, by which the driven body turns in a revolution
    PARAMETER_ROWS,  # how many parameters a sample has
    CHOSEN,  # of each joint: 1 where its gap counts for the objective
) = range(16)
ATOL = CHOSEN + at.MAX_JOINTS  # first of 2 * MAX_COORDINATES
SETTINGS = ATOL + 2 * at.MAX_COORDINATES

# ---- counters shared by all lanes
(NEXT_SLOT, SLOTS, FINISHED, RECORDED) = range(4)
COUNTERS = 4

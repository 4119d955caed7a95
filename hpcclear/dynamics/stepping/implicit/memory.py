"""What the implicit method remembers of batches of eight samples, and its scratch: rows of eight, a column a sample.

It starts with a bank laid out like `work` with eight lanes and followed by their parameters, so that the functions that run on
lanes run on it too. The numbers that implicit steps decide by stand behind it, then a row for each number of a coordinate, of a
stage or of a matrix.
"""

from typing import NamedTuple

from hpcclear.base.arrays import Array
from hpcclear.dynamics import layout as at

COLUMNS = 8
N = at.MAX_COORDINATES
STAGES = 3
MIDDLE = 1  # the second stage

PAR = at.WORK  # row of the first parameter
NUMBERS = at.BANK  # row of the first of these numbers; where each begins, each for eight columns:
(
    TIME,  # s, since the start of the revolution
    STEP,  # s
    POLYNOMIAL_STEP,  # s, of the step whose stages are kept; 0 when there are none
    CONTINUES,  # 1 where that step ended at the start of this one, 0 where both have the same start
    KEPT_STEP,  # s, of the step before, should its stages be asked for again; 0 when there are none
    TRIED_ERROR,  # of the step last tried
    ACCEPTED_STEP,  # s, of the step last accepted, for the predictive control
    ACCEPTED_ERROR,
    CONTRACTION,  # of Newton's iteration, rate over 1 - rate
    RATE,  # its last rate of convergence
    RATE_SLOPE,  # 1/s, that rate over the step, when last seen with a new Jacobian; 0 when not since a kink
    NORM,  # estimate of the largest eigenvalue of the Jacobian, 1/s
    KINK_CUTS,  # how often the step at hand was cut at a kink its solution showed
    CEILING,  # s, of the next steps: some way below one that Newton's iteration failed on
    TOLERANCE,  # relative, of a step's error
    REACH,  # of a difference at most, as a part of LEAST
) = range(NUMBERS * COLUMNS, (NUMBERS + 16) * COLUMNS, COLUMNS)
OWNER = NUMBERS + 16  # 1 + lane of the sample in each column; 0 where there is none
KNOWN = OWNER + 1  # 1 where kink functions at the start are known from the step before
FOLLOWS = KNOWN + 1  # 1 where a step begins at the end of the step before
SHOWN = FOLLOWS + 1  # below 0 where a stage lies beyond a kink
ASKED = SHOWN + 1  # 1 for columns that the work at hand is for
ITERATIONS = ASKED + 1  # of Newton, as `control.rate_of` has it
CHANGE_BEFORE = ITERATIONS + 1  # size of its correction before
NOW = CHANGE_BEFORE + 1  # and of the last one; sum of the squares of the error estimate
# a row for each stage and coordinate, stage by stage
Z = NOW + 1  # increments of the velocities
KEPT = Z + STAGES * N  # the same of the step before
TRANSFORMED = KEPT + STAGES * N  # those of Z, decoupled
STAGE_ACC = TRANSFORMED + STAGES * N  # accelerations
CHANGE = STAGE_ACC + STAGES * N
# a row for each coordinate, then perhaps each velocity
START = CHANGE + STAGES * N  # accelerations at the start of the step
SHIFTED = START + N  # those at a start the error estimate has moved, and moves of velocities
INVERSE_SCALE = SHIFTED + 2 * N  # of tolerances
LEAST = INVERSE_SCALE + 2 * N  # sizes at which absolute and relative tolerance weigh the same
# matrices, row by row, N rows of eight each
BY_Q = LEAST + 2 * N  # the Jacobian
BY_V = BY_Q + N * N
REAL = BY_V + N * N  # inverse of the real system, and of the complex one
COMPLEX_RE = REAL + N * N
COMPLEX_IM = COMPLEX_RE + N * N
EXCHANGED = COMPLEX_IM + N * N  # 1 where two rows were exchanged
# of the kinks and of what is integrated
KINKS_A_JOINT = 4
ALL_KINKS = KINKS_A_JOINT * at.MAX_JOINTS
STAGE_KINKS = EXCHANGED + N * N  # kink functions, stage by stage
START_KINKS = STAGE_KINKS + STAGES * ALL_KINKS
MEAN = START_KINKS + ALL_KINKS  # of each rate over the step
GAP_ERROR = MEAN + at.RATES  # sums of the gaps weighted for the error of their integrals
MEMORY = (GAP_ERROR + at.MAX_JOINTS) * COLUMNS


class Moved(NamedTuple):
    """What is stepped: the addresses of its motions of eight lanes (`rhs.run_observed`), coordinates, tables."""

    observing: int
    motion: int
    n: int
    tables: Array

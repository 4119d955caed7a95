"""What the implicit method remembers of eight samples that step abreast, and its scratch: rows of eight, a column a sample.

It starts as the memory of one lane does (`memory`): with a bank, here of eight samples, and the numbers that implicit steps
decide by. Then each number of a coordinate, of a stage or of a matrix has a row of its own.
"""

from hpcclear.dynamics import layout as at
from hpcclear.dynamics.implicit import memory as mem

COLUMNS = mem.LANES
N = at.MAX_COORDINATES
STAGES = 3

OWNER = mem.NUMBERS + 18  # 1 + lane of the sample in each column; 0 where there is none
KNOWN = (
    OWNER + 1
)  # 1 where the kink functions at the start of the step are known from the step before
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
STAGE_KINKS = EXCHANGED + N * N  # kink functions, stage by stage
START_KINKS = STAGE_KINKS + STAGES * mem.ALL_KINKS
MEAN = START_KINKS + mem.ALL_KINKS  # of each rate over the step
GAP_ERROR = MEAN + at.RATES  # sums of the gaps weighted for the error of their integrals
MEMORY = (GAP_ERROR + at.MAX_JOINTS) * COLUMNS

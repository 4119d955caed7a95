"""What the implicit method remembers of a lane from step to step, and its scratch: one flat row of numbers a lane, in rows of
eight, each a vector.

It starts with two banks laid out like `work` with eight lanes and followed by the lane's parameters, so that the functions that
run on lanes run on them too. In the first the stages of a step stand side by side, in the second the displaced states that
the Jacobian's differences are taken from: eight evaluations take no longer than one. Behind them stand vectors over the
coordinates, each in `BLOCKS` rows: the linear algebra of a step is done on these.
"""

from typing import NamedTuple

from hpcclear.base.arrays import Array
from hpcclear.dynamics import layout as at

LANES = 8
BLOCKS = -(-at.MAX_COORDINATES // LANES)  # rows that a number of each coordinate takes
_N = at.MAX_COORDINATES

PAR = at.WORK  # row of the first parameter in a bank
NUMBERS = at.BANK  # row of the first of a lane's numbers, behind the first bank; where each begins, each for eight lanes:
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
    FACTORED_STEP,  # s, for which the inverses hold; 0 when they do not
    NEW_JACOBIAN,  # 1 while the Jacobian was evaluated within this step
    NORM,  # estimate of the largest eigenvalue of the Jacobian, 1/s
    KINK_CUTS,  # how often the step at hand was cut at a kink its solution showed
    CEILING,  # s, of the next steps: some way below one that Newton's iteration failed on
    TOLERANCE,  # relative, of a step's error
    REACH,  # of a difference at most, as a part of LEAST
) = range(NUMBERS * LANES, (NUMBERS + 18) * LANES, LANES)
SECOND = NUMBERS + 18  # row where the second bank starts
# rows:
NODE = SECOND + at.BANK  # where the stages stand in the step; the last one from END on
MATRIX = (
    NODE + 1
)  # three: coefficients of the velocities' increments in the stages of the coordinates
UNIT = MATRIX + 3  # three: the same in the stages of the velocities
MARK = UNIT + 3  # the unit matrix, and one row of noughts
HOLE = MARK + LANES + 1  # 1 less these
KINKS_A_JOINT = 4
ALL_KINKS = KINKS_A_JOINT * at.MAX_JOINTS
KINKS = HOLE + LANES + 1  # kink functions, joint by joint, lane by lane the stages
INCREMENT = KINKS + ALL_KINKS  # of the Jacobian's differences, by coordinates, then velocities
JACOBIAN = INCREMENT + 2 * BLOCKS  # its columns, vectors, by the n coordinates, then velocities
MIDDLE, END = (
    1,
    2,
)  # lanes of the second stage and of the last, at the end of the step, as those after it
# vectors over the coordinates:
Q = JACOBIAN + 2 * _N * BLOCKS  # at the start of the step
V = Q + BLOCKS
Z = V + BLOCKS  # increments of the velocities at the three stages
KEPT = Z + 3 * BLOCKS  # the same of the step before
TRANSFORMED = KEPT + 3 * BLOCKS  # those of Z, decoupled
CHANGE = TRANSFORMED + 3 * BLOCKS
START = CHANGE + 3 * BLOCKS  # accelerations at the start of the step
SHIFTED = START + BLOCKS  # those at a start the error estimate has moved, and moves of velocities
BASE = SHIFTED + 2 * BLOCKS  # accelerations at the state that the Jacobian holds for
INVERSE_SCALE = BASE + BLOCKS  # of tolerances of coordinates, then of velocities
LEAST = INVERSE_SCALE + 2 * BLOCKS  # sizes at which absolute and relative tolerance weigh the same
PIVOT = LEAST + 2 * BLOCKS  # rows that were exchanged of the real system, and of the complex one
COMPLEX_PIVOT = PIVOT + BLOCKS
REAL = COMPLEX_PIVOT + BLOCKS  # columns of the inverse of the real system
COMPLEX_RE = REAL + _N * BLOCKS  # and of the complex one's, real and imaginary part
COMPLEX_IM = COMPLEX_RE + _N * BLOCKS
START_KINKS = (COMPLEX_IM + _N * BLOCKS) * LANES  # kink functions at the start of the step
MEMORY = -(-(START_KINKS + ALL_KINKS) // LANES) * LANES


class Moved(NamedTuple):
    """What is stepped: the address of its motion of eight lanes, coordinates, rows of a vector over them, tables."""

    motion: int
    n: int
    blocks: int
    tables: Array

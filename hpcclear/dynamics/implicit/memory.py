"""What the implicit method remembers of a lane from step to step, and its scratch: one flat row of numbers a lane.

It starts with two banks of rows of eight, each laid out like `work` with eight lanes and followed by the lane's parameters, so
that the functions that run on lanes run on them too. In the first the stages of a step stand side by side, in the second
the displaced states that the Jacobian's differences are taken from: eight evaluations take no longer than one.
"""

from hpcclear.dynamics import layout as at

LANES = 8
_N = at.MAX_COORDINATES

PAR = at.WORK  # row of the first parameter in a bank
SECOND = PAR + at.PARAMETERS  # row where the second bank starts
NODE = 2 * SECOND  # row: where the stages stand in the step; the last one from END on
MATRIX = (
    NODE + 1
)  # rows: coefficients of the velocities' increments in the stages of the coordinates
UNIT = MATRIX + 3  # rows: the same in the stages of the velocities
MARK = UNIT + 3  # rows: the unit matrix
INCREMENT = MARK + LANES  # row: the increments of the Jacobian's differences
KINKS_A_JOINT = 4
ALL_KINKS = KINKS_A_JOINT * at.MAX_JOINTS
KINKS = INCREMENT + 1  # rows: kink functions, joint by joint, lane by lane the stages
COLUMNS = 6 * LANES  # of the Jacobian: by coordinates, then by velocities; the rest is not used
JACOBIAN = (KINKS + ALL_KINKS) * LANES  # d a_r by the k-th of them at r COLUMNS + k
SCALARS = JACOBIAN + _N * COLUMNS
MIDDLE, END = (
    1,
    2,
)  # lanes of the second stage and of the last, which stands at the end of the step, as do those after it
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
    FACTORED_STEP,  # s, for which the factors hold; 0 when they do not
    NEW_JACOBIAN,  # 1 while the Jacobian was evaluated within this step
    NORM,  # estimate of the largest eigenvalue of the Jacobian, 1/s
    KINK_CUTS,  # how often the step at hand was cut at a kink its solution showed
    CEILING,  # s, of the next steps: some way below one that Newton's iteration failed on
    TOLERANCE,  # relative, of a step's error
    REACH,  # of a difference at most, as a part of LEAST
) = range(SCALARS, SCALARS + 18)
Q = SCALARS + 18  # coordinates at the start of the step
V = Q + _N
Z = V + _N  # increments of the velocities at the stages, stage by stage
KEPT = Z + 3 * _N  # the same of the step before
TRANSFORMED = KEPT + 3 * _N  # those of Z, decoupled
CHANGE = TRANSFORMED + 3 * _N
START = CHANGE + 3 * _N  # accelerations at the start of the step
SHIFTED = (
    START + _N
)  # accelerations at a start that the error estimate has moved, and the moves of its velocities
BASE = SHIFTED + 2 * _N  # accelerations at the state that the Jacobian holds for
SCALE = BASE + _N  # tolerances of coordinates, then velocities
LEAST = SCALE + 2 * _N  # sizes at which absolute and relative tolerance weigh the same, likewise
REAL = LEAST + 2 * _N  # factors of the real system, then of the complex one
COMPLEX_RE = REAL + _N * _N
COMPLEX_IM = COMPLEX_RE + _N * _N
PIVOT = COMPLEX_IM + _N * _N
COMPLEX_PIVOT = PIVOT + _N
START_KINKS = COMPLEX_PIVOT + _N  # kink functions at the start of the step
MEMORY = -(-(START_KINKS + ALL_KINKS) // LANES) * LANES

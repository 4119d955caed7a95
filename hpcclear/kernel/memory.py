"""What the implicit method remembers of a lane from step to step, and its scratch: one row of numbers a lane.

It starts with rows like those of `work` with one lane, followed by the lane's parameters, so that the functions that
run on lanes run on it too.
"""

from . import layout as at

_N = at.MAX_COORDINATES
PAR = at.WORK
(
    POLYNOMIAL_STEP,  # s, of the step whose stages are kept; 0 when there are none
    TRIED_ERROR,  # of the step last tried
    ACCEPTED_STEP,  # s, of the step last accepted, for the predictive control
    ACCEPTED_ERROR,
    CONTRACTION,  # of Newton's iteration, rate over 1 - rate
    RATE,  # its last rate of convergence
    FACTORED_STEP,  # s, for which the factors hold; 0 when they do not
    NEW_JACOBIAN,  # 1 while the Jacobian was evaluated within this step
    NORM,  # estimate of the largest eigenvalue of the Jacobian, 1/s
    KINK_CUTS,  # how often the step at hand was cut at a kink its solution showed
    TOLERANCE,  # relative, of a step's error
) = range(PAR + at.PARAMETERS, PAR + at.PARAMETERS + 11)
Z = PAR + at.PARAMETERS + 11  # increments of the velocities at the stages, stage by stage
TRANSFORMED = Z + 3 * _N  # the same, decoupled
FORCE = TRANSFORMED + 3 * _N  # accelerations at the stages
CHANGE = FORCE + 3 * _N
START = CHANGE + 3 * _N  # accelerations at the start of the step
START_RATES = START + _N
STAGE_RATES = START_RATES + at.RATES
SCALE = STAGE_RATES + 3 * at.RATES  # tolerances of coordinates, then velocities
LEAST = SCALE + 2 * _N  # sizes at which absolute and relative tolerance weigh the same, likewise
BY_Q = LEAST + 2 * _N  # Jacobian
BY_V = BY_Q + _N * _N
REAL = BY_V + _N * _N  # factors of the real system, then of the complex one
COMPLEX_RE = REAL + _N * _N
COMPLEX_IM = COMPLEX_RE + _N * _N
PIVOT = COMPLEX_IM + _N * _N
COMPLEX_PIVOT = PIVOT + _N
KINKS_A_JOINT = 4
KINKS = COMPLEX_PIVOT + _N  # kink functions at the start and at the stages, joint by joint
MEMORY = KINKS + 4 * 2 * KINKS_A_JOINT

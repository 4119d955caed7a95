"""What implicit steps decide for a lane: tolerances, the next step, what a failure or a success leaves behind.

Its numbers stand in column i of the rows that `memory` names.
"""

import math

from hpcclear.base.exponentials import rough_exp2, rough_log2
from hpcclear.base.jit import lane_function, scalar_function
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout.views import RunSettings
from hpcclear.dynamics.stepping.implicit import memory as mem

RTOL = RunSettings.rtol
CHEAP_CONTRACTION, KEPT_TO = 0.002, 1.2
"""While Newton's iteration converges faster than this, a step that would grow by less keeps its size."""

BEST_RATE = 0.3
"""Of the iteration's convergence. Where friction sticks it goes with the step: the normal force changes, so does the slope."""

SLOPE_MEMORY = 0.5  # how much of that rate is still believed after a step that one iteration solved
FAILED_SHRINK = 0.1  # at most, after the iteration failed

CEILING, CEILING_GROWTH = 0.6, 1.05
"""Of the failed step, for those after it; and how that is forgotten, step by step."""

CALM_STIFFNESS, CALM_GROWTH = 2.0, 1.25
"""h |J| below which the explicit method would do; and growth of a step above which not: what that stirred up dies away."""

STEEP = 100.0
"""Friction coefficient over ramp speed, s/m, from which kinks decide how long implicit steps are, and "auto" is implicit."""

ERROR_IN_RAMP, DIFFERENCE_IN_RAMP = 0.03, 1e-3
"""Of a step, and of the Jacobian's differences, at most: as a part of friction's ramp."""

ERROR_IN_FILM, FILM_AT, LEAST_IN_FILM = 2e-3, 1e-6, 2e-11
"""Of a step at most, as a part of the speed at which a film is squeezed by the forces of inertia, where `rtol` is at least the
second number, and in proportion below; and the least that this comes to."""

LEAST_CUT = 0.02
"""A step is cut at a kink to this fraction at least: a kink that is nearer is stepped over."""

KINK_REACH, MOST_CUTS = 0.005, 12.0
"""A kink so near the end of a step, as a part of it, is left there; and how often a step is cut."""

MAX_ITERATIONS = 10

NEWTON_TOLERANCE = 0.005  # of the tolerance on the step's error: the energy balance closes no better than the iteration

STEP_SAFETY = 0.9
LARGEST_SHRINK, LARGEST_GROWTH = 0.2, 8.0


@scalar_function
def loosened(rtol, strictness, steep, smooth):
    """Relative tolerance for an error estimate of order 3 that makes the fifth-order result as good as rtol requires.

    Where the motion is smooth an exponent of 2/3 would do, as in RADAU5; but stiff segments are full of kinks, where
    the result is no better than the estimate, most of all where a steep friction ramp sticks and tears loose. There the
    energy balance closes as well as elsewhere only with an exponent of 1, which costs next to nothing: kinks hold the
    steps down anyway.
    `strictness`: square of how many times tighter this sample's tolerances are.
    """
    asked = rtol / math.sqrt(strictness)
    return 0.05 * asked if steep else 0.1 * asked ** (2.0 / 3.0 if smooth else 0.9)


@scalar_function
def fit_to_ramp(par, lane, W, m, i, settings):
    """Relative tolerance of implicit steps and reach of the Jacobian's differences: both keep well within friction's ramp.

    Where joints stick, the sliding speed lies within the ramp: an error as wide as the ramp would throw it to and fro,
    and every step would begin off the slow motion and end at a kink. A looser one costs more. A difference taken across the
    ramp's end would hide its slope. A film is squeezed as slowly where it carries: an error of that speed would be one of all
    forces, and the energy balance would not close.
    """
    steepest = 1e-300
    film = 1e-300
    slope = 0.0
    for k in range(at.MAX_JOINTS):
        block = at.JOINT_BLOCKS + k * at.JOINT_ROWS
        inverse = par[(block + at.INVERSE_RAMP) * W + lane]
        steepest = max(steepest, inverse)
        slope = max(slope, par[(block + at.STEEPNESS) * W + lane])
        film = max(film, par[(block + at.FILM_STEEPNESS) * W + lane])
    ramp = 1.0 / steepest
    speed = par[at.SPEED * W + lane] * par[at.DRIVEN_LENGTH * W + lane]
    strictness = par[at.STRICTNESS * W + lane]
    asked = min(settings[RTOL] / (FILM_AT * math.sqrt(strictness)), 1.0) ** 0.9
    squeezed = max(ERROR_IN_FILM / film * asked / (1.0 + speed), LEAST_IN_FILM)
    within = min(ERROR_IN_RAMP * ramp / (1.0 + speed), squeezed)
    smooth = film > 1e-300
    m[mem.TOLERANCE + i] = min(loosened(settings[RTOL], strictness, slope >= STEEP, smooth), within)
    m[mem.REACH + i] = DIFFERENCE_IN_RAMP * ramp


@lane_function
def forget(m, i):
    """Nothing is known of earlier steps: the lane comes from the explicit method or is new."""
    for number in (
        mem.POLYNOMIAL_STEP, mem.KEPT_STEP, mem.ACCEPTED_STEP, mem.RATE_SLOPE, mem.TRIED_ERROR, mem.KINK_CUTS
    ):  # fmt: skip
        m[number + i] = 0.0
    for number in (mem.CONTINUES, mem.CONTRACTION, mem.RATE):
        m[number + i] = 1.0
    m[mem.CEILING + i] = math.inf


@lane_function
def go_on(m, i):
    """The step before was accepted; its polynomial is kept by the caller."""
    m[mem.ACCEPTED_STEP + i] = m[mem.STEP + i]
    m[mem.ACCEPTED_ERROR + i] = max(m[mem.TRIED_ERROR + i], 1e-2)
    m[mem.KEPT_STEP + i] = m[mem.POLYNOMIAL_STEP + i]
    m[mem.CONTINUES + i] = 1.0


@lane_function
def forget_kinks(m, i):
    """A kink lies between the step before and this one: what was learnt from that no longer holds."""
    m[mem.RATE + i] = 1.0
    m[mem.RATE_SLOPE + i] = 0.0
    m[mem.CEILING + i] = math.inf
    m[mem.KEPT_STEP + i] = 0.0


@lane_function
def cut_again(lane, W, work, m, i, fraction):
    """The solution shows a kink that the guess did not: a good guess for the part before it."""
    m[mem.KINK_CUTS + i] += 1.0
    m[mem.RATE + i] = 1.0
    work[at.ERROR * W + lane] = 2.0
    work[at.NEXT_STEP * W + lane] = m[mem.STEP + i] * max(fraction, LEAST_CUT)


@lane_function
def begin_iteration(m, i):
    """What the iteration of the step before says about this one's."""
    m[mem.CONTRACTION + i] = rough_exp2(0.8 * rough_log2(max(m[mem.CONTRACTION + i], 1e-16)))
    m[mem.RATE + i] = 0.0


@scalar_function
def rate_of(m, i, iteration, change, before):
    """Take in the size of Newton's change, and of the one before. Returns how many iterations it took where it has converged,
    negative where it does not, 0 where it goes on."""
    contraction = m[mem.CONTRACTION + i]
    if iteration > 0:
        rate = change / before
        m[mem.RATE + i] = max(m[mem.RATE + i], rate)
        if not rate < 0.99:
            return -(iteration + 1)
        contraction = rate / (1.0 - rate)
        m[mem.CONTRACTION + i] = contraction
        left = MAX_ITERATIONS - 1 - iteration
        if contraction * change * rough_exp2(left * rough_log2(rate)) > NEWTON_TOLERANCE:
            return -(iteration + 1)
    if not change < 1e10:
        return -(iteration + 1)
    if contraction * change <= NEWTON_TOLERANCE:
        return iteration + 1
    return 0 if iteration + 1 < MAX_ITERATIONS else -MAX_ITERATIONS


@scalar_function
def give_up(lane, W, work, m, i):
    """The iteration failed: a shorter step by the polynomial of the step before (which the caller brings back), with a Jacobian
    that is nearer."""
    h = m[mem.STEP + i]
    m[mem.POLYNOMIAL_STEP + i] = m[mem.KEPT_STEP + i]
    m[mem.CONTINUES + i] = 1.0
    shrink = BEST_RATE / m[mem.RATE + i] if m[mem.RATE + i] > 0.0 else 0.0
    m[mem.RATE + i] = 1.0
    m[mem.CONTRACTION + i] = 1.0
    m[mem.CEILING + i] = CEILING * h
    work[at.ERROR * W + lane] = 1e6
    work[at.NEXT_STEP * W + lane] = min(max(shrink, FAILED_SHRINK), 0.5) * h


@scalar_function
def propose(lane, W, work, m, i, iterations):
    """The step to try next, and whether the explicit method could have taken this one."""
    h = m[mem.STEP + i]
    proposal = next_step(m, i, iterations)
    if iterations == 1:
        m[mem.RATE_SLOPE + i] *= SLOPE_MEMORY
    else:
        m[mem.RATE_SLOPE + i] = m[mem.RATE + i] / h
    if m[mem.RATE_SLOPE + i] > 0.0:
        proposal = min(proposal, BEST_RATE / m[mem.RATE_SLOPE + i])
    proposal = min(proposal, m[mem.CEILING + i])
    m[mem.CEILING + i] *= CEILING_GROWTH
    if m[mem.TRIED_ERROR + i] <= 1.0:
        if work[at.REJECTED * W + lane] == 1.0:
            proposal = min(proposal, h)
        if work[at.ENDING * W + lane] == 1.0:
            proposal = max(proposal, work[at.NEXT_STEP * W + lane])
        proposal = max(proposal, work[at.RESUMED * W + lane])
        if m[mem.RATE + i] <= CHEAP_CONTRACTION and h <= proposal <= KEPT_TO * h:
            proposal = h
        calm = h * m[mem.NORM + i] < CALM_STIFFNESS and proposal < CALM_GROWTH * h
        work[at.CALM * W + lane] = work[at.CALM * W + lane] + 1.0 if calm else 0.0
    work[at.NEXT_STEP * W + lane] = proposal


@scalar_function
def next_step(m, i, iterations):
    """Step size for the next try: by the error, and predictive after Gustafsson 1994 (doi:10.1145/198429.198437)."""
    h = m[mem.STEP + i]
    safety = STEP_SAFETY * (2.0 * MAX_ITERATIONS + 1.0) / (2.0 * MAX_ITERATIONS + iterations)
    error = max(m[mem.TRIED_ERROR + i], 1e-10)
    factor = safety / math.sqrt(math.sqrt(error))
    if error <= 1.0 and m[mem.ACCEPTED_STEP + i] > 0.0:
        before = math.sqrt(m[mem.ACCEPTED_ERROR + i]) / error
        trend = h / m[mem.ACCEPTED_STEP + i] * math.sqrt(before)
        factor = min(factor, STEP_SAFETY * trend)
    return h * min(max(factor, LARGEST_SHRINK), LARGEST_GROWTH)

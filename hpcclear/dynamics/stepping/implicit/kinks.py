"""Kinks of the forces: where sliding leaves or enters the friction ramp, and where a contact's force is cut at 0.

Across a kink the solution is hardly more than once differentiable and Newton's iteration with one Jacobian for all
stages does not converge, so an implicit step is cut to end just beyond the first kink its first guess shows, or its
solution. Each kink is the zero of a smooth function: three of the laws, which the motion writes down, and the gap.
"""

from hpcclear.base.eight import above, fetch, put, spread
from hpcclear.base.jit import lane_function, scalar_function
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.stepping.control import place
from hpcclear.dynamics.stepping.implicit import memory as mem
from hpcclear.dynamics.stepping.implicit.radau import BASIS, NODES

BEYOND = 1e-4  # how far beyond a kink a step ends, in units of the kink's function (of order 1)

GUESSED_BEYOND = 0.03
"""A guess shows a kink where a stage is so far beyond it; the solution shows whether a nearer one is real."""

NEAR = 5e-4  # a kink this near the start of a step, in these units, is stepped over

GAP_UNIT = 0.1
"""Of the clearance: the unit in which the gap, whose sign is a kink too, is of order 1."""


@lane_function
def kinks_of_joint(rules, m, p, row):
    """The four functions of joint p at the states of all lanes, into rows from `row` on; 0 where no kink can be felt."""
    gap = fetch(m, at.RATE_NOW + at.GAP + p)
    nothing = spread(0.0)
    # in flight no force is transmitted, and a change of the gap's sign is the stepper's to find: an impact to be located
    touching = above(fetch(m, at.ACTIVE + p), gap, nothing) if rules.latched else gap
    factor = above(touching, fetch(m, at.RATE_NOW + at.FORCE_KINKS + p), nothing)
    low = fetch(m, at.RATE_NOW + at.LOW_KINKS + p)
    high = fetch(m, at.RATE_NOW + at.HIGH_KINKS + p)
    put(m, row, factor)
    put(m, row + 1, above(factor, low, nothing))
    put(m, row + 2, above(factor, high, nothing))
    clearance = fetch(m, mem.PAR + at.JOINT_BLOCKS + at.JOINT_ROWS * p + at.CLEARANCE)
    put(m, row + 3, touching / (GAP_UNIT * clearance))


@scalar_function
def kink_functions(rules, m, first):
    """Kink functions of all open joints at the states of the first bank, as evaluated, into rows from `first` on."""
    for joint in range(rules.begin, rules.end):
        p = place(joint)
        kinks_of_joint(rules, m, p, first + mem.KINKS_A_JOINT * p)


@lane_function
def crossing(start, one, two, three, beyond):
    """Where a function with these values at the start of the step and at its stages gets `beyond` its zero; 2 if never."""
    if min(start * one, start * two, start * three) < 0.0:
        return crossing_between(start, one, two, three, beyond)
    return 2.0


@scalar_function
def crossing_between(start, one, two, three, beyond):
    """The same where its sign changes."""
    sign = 1.0 if start > 0.0 else -1.0
    if three == 0.0 or abs(start) < NEAR:
        return 2.0
    low = 0.0
    values = (one, two, three)
    for s in range(3):
        if values[s] == 0.0:
            return 2.0
        if values[s] * sign < -beyond:
            return bisect(start, values, low, NODES[s], sign)
        low = NODES[s]
    return 2.0


@scalar_function
def bisect(start, values, low, high, sign):
    """Upper end of a small bracket of the crossing between `low` and `high`."""
    for _ in range(30):
        x = 0.5 * (low + high)
        value = start
        for j in range(3):
            weight = x * (BASIS[j, 0] + x * (BASIS[j, 1] + x * BASIS[j, 2]))
            value += weight * (values[j] - start)
        if value * sign < -0.5 * BEYOND:
            high = x
        else:
            low = x
    return high

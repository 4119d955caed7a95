"""Kinks of the forces: where sliding leaves or enters the friction ramp, and where damping stops a contact's force.

Across a kink the solution is hardly more than once differentiable and Newton's iteration with one Jacobian for all
stages does not converge, so an implicit step is cut to end just beyond the first kink its first guess shows, or its
solution. Each kink is the zero of a smooth function: damping factor, sliding speed at one side of the ramp, at the other, gap.
"""

from ..jit import lane_function, scalar_function
from . import layout as at
from . import memory as mem
from .radau import BASIS, NODES

BEYOND = 1e-4
"""How far beyond a kink a step ends, in units of the kink's function (of order 1)."""

GAP_UNIT = 0.1
"""Of the clearance: the unit in which the gap, whose sign is a kink too, is of order 1."""

LEAST_CUT = 0.02
"""A step is cut to this fraction at least: a kink that is nearer is stepped over."""

_PER_JOINT = mem.KINKS_A_JOINT
_BOTH = 2 * _PER_JOINT


@lane_function
def damping_part(fixed, latched, m, joint, rate, active, inverse):
    """Damping factor of the normal force; 1 without damping or contact."""
    damping = m[mem.PAR + joint + at.DAMPING]
    if latched is not None:
        return 1.0 + damping * rate * m[inverse]
    elif fixed is not None:
        return 1.0 + damping * rate
    else:
        return 1.0


@lane_function
def in_contact(latched, m, gap, active):
    """Whether the joint transmits a force but for its damping."""
    if latched is not None:
        return gap > 0.0 and m[active] == 1.0
    else:
        return gap > 0.0


@lane_function
def impact_ahead(latched, m, active):
    """Whether a change of the gap's sign is the stepper's to find: an impact to be located."""
    if latched is not None:
        return m[active] == 0.0
    else:
        return False


@lane_function
def ramp_sides(coulomb, ambrosio, m, joint, sliding):
    """Functions that vanish where friction's ramp begins and ends."""
    inverse_ramp = m[mem.PAR + joint + at.INVERSE_RAMP]
    if coulomb is not None:
        return sliding * inverse_ramp + 1.0, sliding * inverse_ramp - 1.0
    elif ambrosio is not None:
        ramp = (abs(sliding) - m[mem.PAR + joint + at.DEAD_SPEED]) * inverse_ramp
        return ramp, ramp - 1.0
    else:
        return 0.0, 0.0


@lane_function
def kinks_of_joint(flag, effects, m, rates, k, out):
    """The four functions of joint k (0 or 1) from the rates at `rates` to `out`; 0 where no kink can be felt."""
    if flag is not None:
        joint = at.JOINT_12 if k == 0 else at.JOINT_23
        gap = m[rates + at.GAP_12 + 3 * k]
        factor = damping_part(
            effects.fixed,
            effects.latched,
            m,
            joint,
            m[rates + at.RATE_12 + 3 * k],
            at.ACTIVE_12 + k,
            at.INVERSE_IMPACT_12 + k,
        )
        touches = in_contact(effects.latched, m, gap, at.ACTIVE_12 + k)
        low, high = ramp_sides(
            effects.coulomb, effects.ambrosio, m, joint, m[rates + at.SLIDING_12 + k]
        )
        free = impact_ahead(effects.latched, m, at.ACTIVE_12 + k)
        m[out] = factor if touches else 0.0
        m[out + 1] = low if touches and factor > 0.0 else 0.0
        m[out + 2] = high if touches and factor > 0.0 else 0.0
        m[out + 3] = 0.0 if free else gap / (GAP_UNIT * m[mem.PAR + joint + at.CLEARANCE])


@scalar_function
def kinks_of_start(effects, m):
    """Functions at the start of the step; True where one has changed its sign, or come or gone, since they were kept."""
    changed = False
    before = (
        m[mem.KINKS],
        m[mem.KINKS + 1],
        m[mem.KINKS + 2],
        m[mem.KINKS + 3],
        m[mem.KINKS + 4],
        m[mem.KINKS + 5],
        m[mem.KINKS + 6],
        m[mem.KINKS + 7],
    )
    kinks_of_joint(effects.crank_rod, effects, m, mem.START_RATES, 0, mem.KINKS)
    kinks_of_joint(effects.rod_slider, effects, m, mem.START_RATES, 1, mem.KINKS + _PER_JOINT)
    for f in range(_BOTH):
        now = m[mem.KINKS + f]
        same = before[f] * now > 0.0 or (before[f] == 0.0 and now == 0.0)
        changed = changed or not same
    return changed


@scalar_function
def kink_fraction(effects, m):
    """Fraction of the step at which the first kink lies behind, by the cubics through the evaluated stages; 2 if none."""
    for s in range(3):
        rates = mem.STAGE_RATES + s * at.RATES
        out = mem.KINKS + (s + 1) * _BOTH
        kinks_of_joint(effects.crank_rod, effects, m, rates, 0, out)
        kinks_of_joint(effects.rod_slider, effects, m, rates, 1, out + _PER_JOINT)
    first = 2.0
    for f in range(_BOTH):
        first = min(first, crossing(m, mem.KINKS + f))
    return first


@scalar_function
def crossing(m, row):
    """Where one function, kept at `row` and every `_BOTH` rows after it, gets `BEYOND` its zero; 2 if it does not."""
    start = m[row]
    sign = 1.0 if start > 0.0 else -1.0
    if start == 0.0 or m[row + 3 * _BOTH] == 0.0:
        return 2.0
    low = 0.0
    for s in range(3):
        value = m[row + (s + 1) * _BOTH]
        if value == 0.0 or -BEYOND < value * sign < 0.0:
            return 2.0
        if value * sign < 0.0:
            return bisect(m, row, low, NODES[s], sign)
        low = NODES[s]
    return 2.0


@scalar_function
def bisect(m, row, low, high, sign):
    """Upper end of a small bracket of the crossing between `low` and `high`."""
    start = m[row]
    for _ in range(30):
        x = 0.5 * (low + high)
        value = start
        for j in range(3):
            weight = x * (BASIS[j, 0] + x * (BASIS[j, 1] + x * BASIS[j, 2]))
            value += weight * (m[row + (j + 1) * _BOTH] - start)
        if value * sign < -0.5 * BEYOND:
            high = x
        else:
            low = x
    return high

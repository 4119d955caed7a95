"""What the laws say of one contact, whatever its geometry: normal and tangential force, losses, and what is written down.

A geometry works out gap, rate of the gap and sliding speed; it applies the forces that it gets back. Rows are those of the
contact's place (`layout.Joint`).
"""

from hpcclear.base.jit import lane_function
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.physics.friction import share_of


@lane_function
def product(flag, a, b):
    """a b, or 0 with the effect off: a product with 0 is not dropped by the compiler, since b may be infinite."""
    return a * b if flag is not None else 0.0


@lane_function
def swept(spin, arm):
    """Speed at the end of an arm, 0 of what never turns (None)."""
    return product(spin, spin, arm)


@lane_function
def normal_force(effects, work, par, joint, depth, rate, i, W):
    """N, never below 0: of a depth that is not below 0, and the rate of the gap."""
    active = work[joint.active * W + i]
    inverse_impact = work[joint.inverse_impact * W + i]
    row = joint.block + at.CONTACT_NUMBERS
    normal = effects.contact.force(par, row, depth, rate, inverse_impact, active, i, W)
    return switched(effects.latched, normal, active)


@lane_function
def ratio_of(effects, work, par, joint, sliding, normal, i, W):
    """Tangential over normal force (N) of a joint's surfaces that slide at so many m/s; 0 without friction.

    Bristles have a coordinate of their own, whose velocity is the deflection and whose acceleration its rate.
    That goes by the sliding speed alone, in contact or not.
    """
    row = joint.block + at.FRICTION_NUMBERS
    if effects.bristled is not None:
        number = joint.place - effects.first
        deflection = work[(at.VS + number) * W + i]
        rate = effects.friction.deflection(par, row, sliding, normal, deflection, 0.0, i, W)
        work[(at.ACC + number) * W + i] = rate
        return effects.friction.ratio(par, row, sliding, normal, deflection, rate, i, W)
    if effects.friction is not None:
        return effects.friction.ratio(par, row, sliding, normal, 0.0, 0.0, i, W)
    return 0.0


@lane_function
def sides_of(law, par, row, sliding, i, W):
    """Functions of the sliding speed that vanish where friction's ramp begins and ends; 0 without."""
    if law is not None:
        low = law.low(par, row, sliding, 0.0, 0.0, 0.0, i, W)
        return low, law.high(par, row, sliding, 0.0, 0.0, 0.0, i, W)
    return 0.0, 0.0


@lane_function
def tangential_force(effects, work, par, joint, sliding, normal, i, W):
    """Friction, N, signed like the sliding speed; 0 without."""
    ratio = ratio_of(effects, work, par, joint, sliding, normal, i, W)
    return product(effects.friction, normal, ratio)


@lane_function
def damped(effects, work, par, joint, touch, normal, i, W):
    """Power that the damping of a contact loses, W; `touch`: depth, rate, sliding speed."""
    depth, rate, _ = touch
    active = work[joint.active * W + i]
    inverse_impact = work[joint.inverse_impact * W + i]
    row = joint.block + at.CONTACT_NUMBERS
    elastic = effects.contact.elastic(par, row, depth, rate, inverse_impact, active, i, W)
    elastic = switched(effects.latched, elastic, active)
    return (normal - elastic) * rate


@lane_function
def lost(effects, work, par, joint, touch, forces, i, W):
    """Power that a contact loses, W; `touch`: depth, rate, sliding speed; `forces`: normal and tangential."""
    normal, tangential = forces
    damping = damped(effects, work, par, joint, touch, normal, i, W)
    return damping + product(effects.friction, tangential, touch[2])


@lane_function
def store_impacts(effects, work, par, joint, touch, normal, i, W):
    """Write down what measures of impact are made of; the contact's force stands in its row already, a film's with it."""
    if effects.impacts is not None:
        force = work[(at.RATE_NOW + joint.force) * W + i]
        work[(at.RATE_NOW + at.FORCE_SQUARES + joint.place) * W + i] = force * force
        lost_now = damped(effects, work, par, joint, touch, normal, i, W)
        work[(at.RATE_NOW + at.IMPACT_POWERS + joint.place) * W + i] = lost_now


@lane_function
def store_contact(effects, work, par, joint, felt, i, W):
    """Write down what effects require of a contact; `felt`: touch and forces as of `lost`, direction of the normal."""
    touch, forces, direction = felt
    _, rate, sliding = touch
    normal, tangential = forces
    nx, ny = direction
    work[(at.RATE_NOW + joint.rate) * W + i] = rate
    store_rate(effects.series, work, joint.friction, tangential, i, W)
    store_rate(effects.objective, work, joint.friction, tangential, i, W)
    store_rate(effects.objective, work, joint.sliding_speed, sliding, i, W)
    store_rate(effects.objective, work, joint.normal_x, nx, i, W)
    store_rate(effects.objective, work, joint.normal_y, ny, i, W)
    store_impacts(effects, work, par, joint, touch, normal, i, W)
    store_kinks(effects, work, par, joint, touch, i, W)
    wearing = force_that_wears(effects.threshold, par, joint, normal, i, W)
    store_rate(effects.wear, work, at.SLIDING_POWERS + joint.place, wearing * abs(sliding), i, W)


@lane_function
def store_kinks(effects, work, par, joint, touch, i, W):
    """Write down the functions that change their signs where the laws' forces have kinks, for the implicit method."""
    if effects.sliding is not None:
        depth, rate, sliding = touch
        active = work[joint.active * W + i]
        inverse_impact = work[joint.inverse_impact * W + i]
        row = joint.block + at.CONTACT_NUMBERS
        cut = effects.contact.kink(par, row, depth, rate, inverse_impact, active, i, W)
        work[(at.RATE_NOW + at.FORCE_KINKS + joint.place) * W + i] = cut
        row = joint.block + at.FRICTION_NUMBERS
        low, high = sides_of(effects.friction, par, row, sliding, i, W)
        work[(at.RATE_NOW + at.LOW_KINKS + joint.place) * W + i] = low
        work[(at.RATE_NOW + at.HIGH_KINKS + joint.place) * W + i] = high


@lane_function
def force_that_wears(threshold, par, joint, normal, i, W):
    """The normal force, or 0 where its pressure is below a threshold, with a ramp between."""
    if threshold is not None:
        row = at.THRESHOLDS + 2 * joint.place
        share = par[row * W + i] * normal + par[(row + 1) * W + i]
        return normal * share_of(share)
    return normal


@lane_function
def store_rate(flag, work, row, value, i, W):
    """Write down a rate that an effect requires."""
    if flag is not None:
        work[(at.RATE_NOW + row) * W + i] = value


@lane_function
def switched(latched, force, active):
    """A `latched` contact is on or off for a whole step, so that a step ends exactly at an impact."""
    return force * active if latched is not None else force

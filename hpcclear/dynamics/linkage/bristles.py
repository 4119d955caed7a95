"""Friction by bristles in one open joint of a lane: its ratio to the normal force, from the deflection that is integrated."""

from hpcclear.base.jit import lane_function
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.physics.friction import (
    bristle_rate,
    bristle_ratio,
    friction_ratio,
    stribeck,
)


@lane_function
def ratio_of(effects, work, par, joint, sliding, i, W):
    """Tangential over normal force of a joint's surfaces that slide at so many m/s, whichever law is on; 0 without one.

    Bristles have a coordinate of their own, whose velocity is the deflection and whose acceleration its rate.
    That goes by the sliding speed alone, in contact or not: in flight too the deflection forgets what was within a few times
    the length on which bristles give way, and no force jumps when contact begins.
    """
    if effects.lugre is not None:
        number = joint.place - effects.first
        stiffness = par[at.BRISTLE_STIFFNESS * W + i]
        deflection = work[(at.VS + number) * W + i]
        held = stribeck(
            par[(joint.block + at.FRICTION) * W + i],
            par[at.BRISTLE_STATIC * W + i],
            par[at.BRISTLE_INVERSE_SPEED * W + i],
            sliding,
        )
        rate = bristle_rate(stiffness, held, deflection, sliding)
        work[(at.ACC + number) * W + i] = rate
        return bristle_ratio(
            stiffness, par[at.BRISTLE_DAMPING * W + i], par[at.BRISTLE_VISCOUS * W + i],
            deflection, rate, sliding,
        )  # fmt: skip
    else:
        return friction_ratio(
            effects.coulomb,
            effects.ambrosio,
            par[(joint.block + at.FRICTION) * W + i],
            par[(joint.block + at.DEAD_SPEED) * W + i],
            par[(joint.block + at.INVERSE_RAMP) * W + i],
            sliding,
        )

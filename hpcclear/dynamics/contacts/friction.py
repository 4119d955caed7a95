"""Friction in one open joint of a lane: its ratio to the normal force by the law that is on, perhaps with bristles."""

from hpcclear.base.jit import lane_function
from hpcclear.dynamics import layout as at


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
    elif effects.friction is not None:
        return effects.friction.ratio(par, row, sliding, normal, 0.0, 0.0, i, W)
    else:
        return 0.0


@lane_function
def sides_of(law, par, row, sliding, i, W):
    """Functions of the sliding speed that vanish where friction's ramp begins and ends; 0 without."""
    if law is not None:
        low = law.low(par, row, sliding, 0.0, 0.0, 0.0, i, W)
        return low, law.high(par, row, sliding, 0.0, 0.0, 0.0, i, W)
    else:
        return 0.0, 0.0

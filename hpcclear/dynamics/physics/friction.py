"""Friction as a fraction of the normal force (paper eqs. 9-10; eq. 10 prints no sign: friction opposes sliding)."""

import math

from hpcclear.base.jit import lane_function


@lane_function
def saturated(x):
    """Clip to [-1, 1] without a branch; NaN stays NaN."""
    return 0.5 * (abs(x + 1.0) - abs(x - 1.0))


@lane_function
def friction_ratio(coulomb, ambrosio, coefficient, dead_speed, inverse_ramp, sliding_speed):
    """Tangential over normal force, signed like the sliding speed (m/s); 0 with friction off.

    coulomb : linear ramp, full at ``|v| = 1/inverse_ramp``.
    ambrosio : zero up to ``dead_speed`` v0, then a ramp over v1 - v0 = 1/inverse_ramp (Ambrosio 2003,
        doi:10.1007/978-94-007-0203-5_4).
    """
    if coulomb is not None:
        return coefficient * saturated(sliding_speed * inverse_ramp)
    elif ambrosio is not None:
        ramp = (abs(sliding_speed) - dead_speed) * inverse_ramp
        return math.copysign(coefficient * 0.5 * (1.0 + abs(ramp) - abs(ramp - 1.0)), sliding_speed)
    else:
        return 0.0

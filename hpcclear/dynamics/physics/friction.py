"""Friction as a fraction of the normal force (paper eqs. 9-10; eq. 10 prints no sign: friction opposes sliding)."""

import math

from hpcclear.base.bits import falling, no_less, no_more
from hpcclear.base.jit import lane_function

_TINY = 1e-300  # keeps bristles that hold nothing from being divided by it


@lane_function
def saturated(x):
    """Clip to [-1, 1]; NaN stays NaN."""
    return no_less(no_more(x, 1.0), -1.0)


@lane_function
def share_of(x):
    """Clip to [0, 1]; NaN stays NaN."""
    return no_less(no_more(x, 1.0), 0.0)


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
        return math.copysign(coefficient * share_of(ramp), sliding_speed)
    else:
        return 0.0


@lane_function
def stribeck(sliding, static, inverse_speed, speed):
    """Stribeck's curve: friction over normal force, `static` at rest, `sliding` far beyond the speed 1/`inverse_speed`."""
    x = speed * inverse_speed
    return sliding + (static - sliding) * falling(x * x)


@lane_function
def bristle_rate(stiffness, held, deflection, speed):
    """Rate of the bristles' deflection, m/s, with LuGre's model (Canudas de Wit and others 1995, doi:10.1109/9.376053).

    They are drawn along with the sliding speed (m/s) and give way as they come near `held`/`stiffness`, where steady sliding
    keeps them; `stiffness`: friction over normal force for a metre; `held`: friction over normal force by `stribeck`.
    """
    return speed - stiffness * abs(speed) * deflection / (held + _TINY)


@lane_function
def bristle_ratio(stiffness, damping, viscous, deflection, rate, speed):
    """Tangential over normal force: the bristles' spring (1/m), their damper (s/m), and what goes with the speed (s/m)."""
    return stiffness * deflection + damping * rate + viscous * speed

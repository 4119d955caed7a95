"""Springs, dampers and harmonic drives, a lane at a time: what generated motions call besides the contact law."""

import math

from hpcclear.base.jit import lane_function
from hpcclear.dynamics.physics.angles import sincos

_TINY = 1e-300  # keeps the direction of a spring without length defined (and nought)


@lane_function
def spring_force(stiffness, damping, length, ex, ey, vx, vy):
    """Force of a spring and damper on its first place, whose offset and velocity from the second are given.

    Returns both components in N, and the power that both ends are given in W (what it stores and loses, negative).
    """
    square = ex * ex + ey * ey + _TINY
    inverse = 1.0 / math.sqrt(square)
    nx = ex * inverse
    ny = ey * inverse
    rate = vx * nx + vy * ny
    tension = stiffness * (square * inverse - length) + damping * rate
    return -tension * nx, -tension * ny, -tension * rate


@lane_function
def harmonic(mean, amplitude, rate, phase, time):
    """Angle (rad), angular velocity and acceleration of a harmonic drive, ``rate`` in rad/s."""
    s, c = sincos(rate * time + phase)
    return mean + amplitude * s, amplitude * rate * c, -amplitude * rate * rate * s

"""Springs, dampers and harmonic drives: what generated motions call besides the contact law. Uncompiled, they take arrays."""

import numpy as np

from hpcclear.base.jit import lane_function

_TINY = 1e-300  # keeps the direction of a spring without length defined (and nought)


@lane_function
def spring_force(stiffness, damping, length, ex, ey, vx, vy):
    """Force of a spring and damper on its first place, whose offset and velocity from the second are given.

    Returns both components in N, and the power that both ends are given in W (what it stores and loses, negative).
    """
    square = ex * ex + ey * ey + _TINY
    inverse = 1.0 / np.sqrt(square)
    nx = ex * inverse
    ny = ey * inverse
    rate = vx * nx + vy * ny
    tension = stiffness * (square * inverse - length) + damping * rate
    return -tension * nx, -tension * ny, -tension * rate


@lane_function
def sign_of(value):
    """1 for what is not negative, -1 for the rest."""
    return 1.0 if value >= 0.0 else -1.0


@lane_function
def harmonic(mean, amplitude, rate, sine, cosine):
    """Angle (rad), angular velocity and acceleration of a harmonic drive, ``rate`` in rad/s, at a phase."""
    return mean + amplitude * sine, amplitude * rate * cosine, -amplitude * rate * rate * sine

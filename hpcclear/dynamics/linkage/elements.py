"""Functions of generated motions besides the contact law: springs, drives, tables, near-singular loops. Plain, of arrays."""

import math
from collections.abc import Callable

import numpy as np

from hpcclear.base.bits import no_more
from hpcclear.base.jit import lane_function
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout.curves import (
    CUBICS,
    GRID,
    HALVINGS,
    HEAD,
    LAST,
    LAST_PIECE,
    REPEATS,
    STARTS,
)

_TINY = 1e-300  # keeps the direction of a spring without length defined (and zero)
_FLAT = 1e-8  # pivots of loops over those of an open one, from which on inertia alone goes on: 1e-4 rad from flat


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
def one_sided(side, stiffness, damping, length, ex, ey, vx, vy):
    """The same of a spring that acts on one side of its length: beyond it (`side` 1) or within it (-1); it never pulls back."""
    square = ex * ex + ey * ey + _TINY
    inverse = 1.0 / np.sqrt(square)
    nx = ex * inverse
    ny = ey * inverse
    rate = vx * nx + vy * ny
    beyond = side * (square * inverse - length)
    size = stiffness * beyond + damping * side * rate
    size = 0.5 * (size + abs(size))
    tension = side * size * (0.5 + 0.5 * np.sign(beyond))
    return -tension * nx, -tension * ny, -tension * rate


@lane_function
def along(ex, ey, vx, vy):
    """Direction, length and rate of the length of an offset."""
    square = ex * ex + ey * ey + _TINY
    inverse = 1.0 / np.sqrt(square)
    nx = ex * inverse
    ny = ey * inverse
    return nx, ny, square * inverse, vx * nx + vy * ny


@lane_function
def unit_vector(x, y):
    """Direction of a vector; 0 of one without length."""
    inverse = 1.0 / np.sqrt(x * x + y * y + _TINY)
    return x * inverse, y * inverse


@lane_function
def hinge(at, start, bend):
    """A line of slope `bend` beyond `start`, 0 before."""
    beyond = at - start
    return bend * (0.5 * (beyond + abs(beyond)))


@lane_function
def drag(linear, quadratic, spin):
    """Torque against the turning at a speed, N m."""
    return -(linear + quadratic * abs(spin)) * spin


@lane_function
def sign_of(value):
    """1 for what is not negative, -1 for the rest."""
    return 1.0 if value >= 0.0 else -1.0


@lane_function
def harmonic(mean, amplitude, rate, sine, cosine):
    """Angle (rad), angular velocity and acceleration of a harmonic drive, ``rate`` in rad/s, at a phase."""
    return mean + amplitude * sine, amplitude * rate * cosine, -amplitude * rate * rate * sine


@lane_function
def held_inverse(pivot, scale):
    """1 / pivot of a multiplier, both negative; in a singular configuration no more than 1e8 / scale.

    There one direction of the loop is not held, neither by geometry nor by its forces, which would be zero by zero: a
    free linkage goes on as its inertia has it until the loop holds again, some 1e-4 rad further on.
    """
    least = _FLAT * scale
    return 1.0 / (pivot if pivot < least else least)


@lane_function
def look_up(work, tables, curve, W):
    """Values of a tabulated curve (`layout.curves`) at the places of all lanes, cubic between two rows; level beyond both ends
    of one that does not repeat.

    A loop over the lanes for each of its parts, the halvings among them, so that each is vectorised.
    """
    head = HEAD * curve
    place, value = at.RATE_NOW + at.PLACES + curve, at.CURVES + curve
    repeats, last = tables[head + REPEATS], tables[head + LAST]
    grid, starts = int(tables[head + GRID]), int(tables[head + STARTS])
    cubics, pieces = int(tables[head + CUBICS]), tables[head + LAST_PIECE]
    for i in range(W):
        x = work[place * W + i]
        x = x - repeats * math.floor(x)
        work[place * W + i] = x
        interval = no_more(x * (last + 1.0), last)
        interval = interval if interval > 0.0 else 0.0  # what is no number as well
        work[value * W + i] = tables[grid + int(interval)]
    step = 1 << int(tables[head + HALVINGS])
    while step > 1:
        step = step >> 1
        for i in range(W):
            k = work[value * W + i]
            further = no_more(k + step, pieces)
            there = tables[starts + int(further)] <= no_more(work[place * W + i], 1.0)
            work[value * W + i] = further if there else k
    for i in range(W):
        row = int(work[value * W + i])
        s = no_more(work[place * W + i], 1.0) - tables[starts + row]
        c = cubics + 4 * row
        work[value * W + i] = tables[c] + s * (
            tables[c + 1] + s * (tables[c + 2] + s * tables[c + 3])
        )


def functions() -> dict[str, Callable[..., object]]:
    """All of them by name, as ordinary Python."""
    return {name: one.py_func for name, one in globals().items() if hasattr(one, "py_func")}

"""Functions of generated motions besides the contact law: springs, drives, tables, near-singular loops. Plain, of arrays."""

import math
from collections.abc import Callable

import numpy as np

from hpcclear.base.bits import no_more
from hpcclear.base.jit import lane_function

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
def table_value(table, first, cells, angle):
    """Value of a periodic table at an angle in rad: cubic cells on a uniform grid, 4 coefficients a cell, from `first` on."""
    turns = angle * (0.5 / math.pi)
    x = (turns - math.floor(turns)) * cells
    cell = min(int(x), cells - 1)
    s = x - cell
    k = first + 4 * cell
    return table[k] + s * (table[k + 1] + s * (table[k + 2] + s * table[k + 3]))


@lane_function
def table_until(table, first, cells, share):
    """The same of a table that does not repeat, at a share of its length not below 0; level beyond its end."""
    x = no_more(share, 1.0) * cells
    cell = min(int(x), cells - 1)
    s = x - cell
    k = first + 4 * cell
    return table[k] + s * (table[k + 1] + s * (table[k + 2] + s * table[k + 3]))


def functions() -> dict[str, Callable[..., object]]:
    """All of them by name, as ordinary Python."""
    return {name: one.py_func for name, one in globals().items() if hasattr(one, "py_func")}

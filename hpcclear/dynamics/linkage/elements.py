"""Functions of generated motions besides the contact law and those of loads: drives, tables, near-singular loops."""

import math
from collections.abc import Callable

import numpy as np

from hpcclear.base.bits import no_more
from hpcclear.base.jit import lane_function
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout.curves import CELL, CELLS, GRID, HALVINGS, HEAD, LAST_CELL, PLACES

_TINY = 1e-300  # keeps the direction of a vector without length defined (and zero)
_FLAT = 1e-8  # pivots of loops over those of an open one, from which on inertia alone goes on: 1e-4 rad from flat


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
def enter_table(work, curve, place, rate, repeats, intervals, i, W):
    """Leave the place on a tabulated curve (`layout.curves`), its rate and its interval where `look_up` and steps find them."""
    x = place - repeats * math.floor(place)
    interval = no_more(x * intervals, intervals - 1.0)
    work[(at.RATE_NOW + at.PLACES + curve) * W + i] = x
    work[(at.RATE_NOW + at.PLACE_RATES + curve) * W + i] = rate
    work[(at.CURVES + curve) * W + i] = interval if interval > 0.0 else 0.0  # what is no number too


@lane_function
def look_up(work, tables, curve, W):
    """Values of a curve at the places of all lanes, cubic between two rows; level beyond both ends of one that does not repeat.

    Lane by lane: a vector would gather its numbers one by one. What is the same for all rows stands before, in vectors.
    """
    place, value = at.RATE_NOW + at.PLACES + curve, at.CURVES + curve
    cells = int(tables[HEAD * curve + CELLS])
    if tables[HEAD * curve + HALVINGS] > 0.0:
        halve(work, tables, curve, W)
    for i in range(W):
        cell = (cells + CELL * int(work[value * W + i])) & PLACES
        s = no_more(work[place * W + i], 1.0) - tables[cell]
        c = cell + (5 if s >= 0.0 else 1)
        work[value * W + i] = tables[c] + s * (
            tables[c + 1] + s * (tables[c + 2] + s * tables[c + 3])
        )


@lane_function
def halve(work, tables, curve, W):
    """Go from the intervals that the places of all lanes are in to their cells, where that takes halvings."""
    head = HEAD * curve
    place, value = at.RATE_NOW + at.PLACES + curve, at.CURVES + curve
    grid, cells = int(tables[head + GRID]), int(tables[head + CELLS])
    for i in range(W):
        work[value * W + i] = tables[(grid + int(work[value * W + i])) & PLACES]
    step = 1 << int(tables[head + HALVINGS])
    while step > 1:
        step = step >> 1
        for i in range(W):
            k = work[value * W + i]
            further = no_more(k + step, tables[head + LAST_CELL])
            start = tables[(cells + CELL * int(further)) & PLACES]
            work[value * W + i] = further if start <= no_more(work[place * W + i], 1.0) else k


def functions() -> dict[str, Callable[..., object]]:
    """All of them by name, as ordinary Python."""
    return {name: one.py_func for name, one in globals().items() if hasattr(one, "py_func")}

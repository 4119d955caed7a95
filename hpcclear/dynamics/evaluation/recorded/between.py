"""States, rates and works of a recorded sample between its accepted steps."""

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.dynamics.evaluation.recorded.steps import Piece, Recorded
from hpcclear.dynamics.linkage.passage import cubic
from hpcclear.dynamics.planar.response import ResponseStates


def seen_between(sample: Recorded, piece: Piece, *, works: bool = False) -> ResponseStates:
    """What the motion is at the instants of a piece; `works`: those too, else there are none."""
    wraps = sample.problem.wraps
    q, v, share = _state(piece, wraps)
    steps, k = piece.steps, piece.k
    revolution, contacts = steps.revolution[k], steps.contacts[k]
    began = (steps.time - steps.turn_time)[k]
    turn_time = piece.times - began
    q = q - wraps * revolution[:, None]  # counted as the kernel does
    _, rates, pins = sample.observe(np.hstack([q, v]), contacts, turn_time, began)
    done = _works(sample, piece, share[:, None]) if works else np.zeros((len(k), 0))
    return ResponseStates(q, v, turn_time, revolution, contacts, rates, done, pins)


def _state(piece: Piece, wraps: Array) -> tuple[Array, Array, Array]:
    """Coordinates and velocities (t, n) at the instants, and how far each lies in its step, from 0 to 1 (t,).

    Positions by the quintic through position, velocity and acceleration at both ends of a step, which is as
    accurate as the integrator; angles that restart with every revolution, by `wraps` (n,), are unwrapped first.
    """
    steps, k = piece.steps, piece.k
    after = np.minimum(k + 1, len(steps.time) - 1)
    q0, q1 = (steps.q[row] + wraps * steps.revolution[row][:, None] for row in (k, after))
    h = (steps.time[after] - steps.time[k])[:, None]
    h = np.where(h > 0.0, h, 1.0)  # the last of a motion that stalled
    s = (piece.times - steps.time[k])[:, None] / h
    d = q1 - q0
    v0, v1 = h * steps.v[k], h * steps.v[after]
    a0, a1 = h * h * steps.a[k], h * h * steps.a[after]
    c3 = 10 * d - 6 * v0 - 4 * v1 - 1.5 * a0 + 0.5 * a1
    c4 = -15 * d + 8 * v0 + 7 * v1 + 1.5 * a0 - a1
    c5 = 6 * d - 3 * (v0 + v1) - 0.5 * (a0 - a1)
    position = q0 + s * (v0 + s * (0.5 * a0 + s * (c3 + s * (c4 + s * c5))))
    velocity = (v0 + s * (a0 + s * (3 * c3 + s * (4 * c4 + s * 5 * c5)))) / h
    return position, velocity, s[:, 0]


def _works(sample: Recorded, piece: Piece, s: Array) -> Array:
    """Works (t, 4) at shares (t, 1) of steps, by the cubic through works and powers at both ends of the step."""
    steps, k = piece.steps, piece.k
    after = np.minimum(k + 1, len(steps.time) - 1)
    rows, where = np.unique(np.concatenate([k, after]), return_inverse=True)
    ends = np.hstack([steps.q[rows], steps.v[rows]])
    turn_time = steps.turn_time[rows]
    began = steps.time[rows] - turn_time
    powers = sample.observe(ends, steps.contacts[rows], turn_time, began)[1].powers
    before, behind = np.split(powers[where], 2)
    h = (steps.time[after] - steps.time[k])[:, None]
    w0, w1 = steps.works[k], steps.works[after]
    p0, p1 = h * before, h * behind
    return cubic(w0, p0, w1, p1, s)

"""States and rates of a recorded sample between its accepted steps."""

from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.dynamics.evaluation.recorded.steps import Piece, Recorded
from hpcclear.dynamics.layout.views import Rates


class Between(NamedTuple):
    """Instants of a piece: coordinates in their revolution and velocities (t, n), time in the revolution, its number, contacts
    (t, 2 MAX_JOINTS), rates, how far each lies in its step, from 0 to 1 (t,), forces of ideal pins (t, 2, MAX_PINS)."""

    q: Array
    v: Array
    turn_time: Array
    revolution: Array
    contacts: Array
    rates: Rates
    share: Array
    pins: Array


def seen_between(sample: Recorded, piece: Piece) -> Between:
    """What the motion is at the instants of a piece."""
    problem, times = sample.problem, piece.times
    q, v, share = _state(piece, problem.wraps)
    steps, k = piece.steps, piece.k
    revolution, contacts = steps.revolution[k], steps.contacts[k]
    began = (steps.time - steps.turn_time)[k]
    turn_time = times - began
    q = q - problem.wraps * revolution[:, None]  # counted as the kernel does
    _, rates, pins = sample.observe(np.hstack([q, v]), contacts, turn_time, began)
    return Between(q, v, turn_time, revolution, contacts, rates, share, pins)


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

"""How a linkage without clearance gets through what its drives prescribe: walked once, before anything is simulated.

The coordinates are those of the trees, so few that a step is a small linear system. Steps follow the motion, not the instants
of an output. Where the determinant of the loop-closure constraints changes its sign, two branches of the motion cross: a change
point. The one with a continuous velocity is followed where it is determined; a dead centre, where the velocity grows without
bound, ends the walk.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array, Booleans
from hpcclear.base.outcome import Status
from hpcclear.dynamics.linkage.loops import Loops, State

LONGEST = 2 * math.pi / 72.6
"""Step of the walk at most, rad of the drive; no whole part of a turn, so that change points are seldom met."""
SHORTEST = 1e-8  # and at least: what needs shorter ones has come to a dead centre
FARTHEST, TURNED = 0.02, 0.1
"""How far Newton may go from where a step was to end, and by how much a step may change a velocity times its length (rad, or
of the typical length)."""
POOR = 1e-2
"""Smallest singular value over the largest seen, from which on a longer step is tried that passes a change point at once."""
FAST = 100.0  # velocity, rad (or typical lengths) per rad of the drive, from which on the end of a walk is a dead centre
BESIDE = 0.01
"""Of a change point, rad of the drive: nearer to it numbers are interpolated, since forces lose digits with the fourth power of
the distance (1e-8 of them there)."""
NEARER = 4.0  # by how much nearer than `BESIDE` a change point is looked at as well
CLEAR = 1e-2  # smallest singular value over the largest in `clear`, at least
MOST_ROUNDS = 64
_NEWTON = 8


class WalkPose(NamedTuple):
    """A pose of the walk: time in s, coordinates and velocities (n,), determinant, a bound of the smallest singular value."""

    time: float
    q: Array
    v: Array
    determinant: float
    margin: float


class Ended(NamedTuple):
    """How a walk ended, and the pose there."""

    status: Status
    node: WalkPose


@dataclass
class Passage:
    """A walk: its nodes, the change points that it passed (s), where it ended; `recurs`: after how many s it repeats itself.

    `unit`: s in which the drive turns by 1 rad.
    """

    loops: Loops
    unit: float
    nodes: list[WalkPose] = field(default_factory=list)
    changes: list[WalkPose] = field(default_factory=list)
    ended: Ended | None = None
    recurs: float = math.inf

    def at(self, times: Array) -> tuple[Array, Array]:
        """Coordinates and velocities (n, t) at instants (t,), s, before the walk's end and not beside a change point."""
        rounds = np.maximum(np.floor(times / self.recurs), 0.0)  # 0 where it does not recur
        local = times - rounds * min(self.recurs, 1e300)
        q = self._between(local)
        if rounds.any():
            q = q + rounds * (self.nodes[-1].q - self.nodes[0].q)[:, None]
        scales, rows = self.loops.scales[:, None], self.loops.row_scales[:, None]
        for _ in range(3):
            inverse, state = _inverse(self.loops, q, times)
            q = q - scales * np.einsum("tij,jt->it", inverse, state.error / rows)
        inverse, state = _inverse(self.loops, q, times)
        return q, -scales * np.einsum("tij,jt->it", inverse, state.rate / rows)

    def _between(self, times: Array) -> Array:
        """Cubics between the nodes, (n, t)."""
        known = np.array([node.time for node in self.nodes])
        q, v = (np.array([getattr(node, name) for node in self.nodes]) for name in "qv")
        k = np.clip(np.searchsorted(known, times, side="right") - 1, 0, max(len(known) - 2, 0))
        end = np.minimum(k + 1, len(known) - 1)
        h = (known[end] - known[k])[:, None]
        s = (times - known[k])[:, None] / np.where(h > 0.0, h, 1.0)
        return cubic(q[k], v[k] * h, q[end], v[end] * h, s).T

    def passed(self, times: Array) -> Array:
        """Those of rising instants (t,), s, from 0 that come before the walk's end, 0 at least."""
        if self.ended is None:
            return times
        room = BESIDE * self.unit if self.ended.status is Status.NEAR_SINGULAR else 0.0
        return times[: max(int((times < self.ended.node.time - room).sum()), 1)]

    def beside(self, times: Array) -> Array:
        """The change point that each instant (t,) is beside, s; NaN of the others."""
        found = np.full(len(times), np.nan)
        last = math.inf if self.ended is None else self.ended.node.time
        for change in (one for one in self.changes if one.time < last):
            every = self.recurs if math.isfinite(self.recurs) else 1e300
            centre = change.time + np.maximum(np.round((times - change.time) / every), 0) * every
            near = np.abs(times - centre) < BESIDE * self.unit
            found[near] = centre[near]
        return found


def cubic(q0: Array, v0: Array, q1: Array, v1: Array, s: Array) -> Array:
    """Values at shares `s` of an interval, from values and rates times its length at both ends; they broadcast."""
    d = q1 - q0
    return q0 + s * (v0 + s * (3 * d - 2 * v0 - v1 + s * (v0 + v1 - 2 * d)))


def _inverse(loops: Loops, q: Array, time: Array | float) -> tuple[Array, State]:
    """Inverses (..., n, n) of the scaled Jacobians, and the constraints, velocities at 0."""
    state = loops.at(q, np.zeros_like(q), time)
    # never singular to the last bit, which numpy would refuse for all of them
    regular = loops.scaled(state.jacobian) + 1e-15 * np.eye(loops.size)
    return np.asarray(np.linalg.inv(regular), float), state


def _margins(inverse: Array) -> Array:
    """Bounds from below of the smallest singular values of matrices, from their inverses (..., n, n)."""
    return 1.0 / np.sqrt((inverse**2).sum(axis=(-1, -2)) + 1e-300)


class _Walker:
    """Walks a linkage whose drives leave nothing free."""

    def __init__(self, loops: Loops, unit: float) -> None:
        self.loops, self.unit = loops, unit
        self.best = 0.0
        self.direct = -math.inf  # s, until when no change point is passed at once

    def pose(self, guess: Array, time: float) -> WalkPose | None:
        """The pose near a guess, by Newton's method; None where there is none."""
        loops, q = self.loops, guess
        for _ in range(_NEWTON):
            inverse, state = _inverse(loops, q, time)
            change = -inverse @ (state.error / loops.row_scales)
            q = q + loops.scales * change
            most = np.abs(change).max(initial=0.0)
            if not most < 1.0:
                return None
            if most < 1e-9:
                break
        else:
            return None
        inverse, state = _inverse(loops, q, time)
        v = -loops.scales * (inverse @ (state.rate / loops.row_scales))
        determinant = float(np.linalg.det(loops.scaled(state.jacobian)))
        return WalkPose(time, q, v, determinant, float(_margins(inverse)))

    def step(self, here: WalkPose, turn: Array, h: float) -> tuple[WalkPose, float] | None:
        """A step of so many s, and how much of what it may be off it is; None if it is further off. `turn`: v's rate."""
        guess = here.q + h * (here.v + 0.5 * h * turn)
        new = self.pose(guess, here.time + h)
        if new is None:
            return None
        scales = self.loops.scales
        off = np.abs((new.q - guess) / scales).max(initial=0.0) / FARTHEST
        off = max(off, np.abs((new.v - here.v) * h / scales).max(initial=0.0) / TURNED)
        return (new, float(off)) if off < 1.0 else None

    def changed(self, here: WalkPose, there: WalkPose) -> tuple[WalkPose, list[WalkPose]] | None:
        """The change point between two poses with determinants of either sign, and poses on both its sides; None unless one
        smooth motion leads through it, and no other one touches that."""
        loops, wide = self.loops, BESIDE * self.unit
        left, right = outer = here, there
        for reach in (wide, wide / NEARER):
            span = right.time - left.time
            zero = _zero(partial(self._determinant, left, right, span))
            time = left.time + zero * span
            sides = [(t, (t - left.time) / span) for t in (time - reach, time + reach)]
            one, two = (self.pose(self._along(left, right, share), t) for t, share in sides)
            if one is None or two is None or one.determinant * two.determinant >= 0.0:
                return None
            near = left, right = one, two
            outer = near if reach == wide else outer
        jumps = [np.abs((b.v - a.v) / loops.scales).max() * self.unit for a, b in (outer, near)]
        sizes = [abs(a.determinant) + abs(b.determinant) for a, b in (outer, near)]
        smooth = jumps[0] < 0.3 and jumps[1] < 0.5 * jumps[0] + 1e-5
        if not (smooth and 0.5 < NEARER * sizes[1] / sizes[0] < 2.0):
            return None
        middle = WalkPose(time, self._along(*near, 0.5), 0.5 * (near[0].v + near[1].v), 0.0, 0.0)
        return middle, list(outer)

    def _along(self, a: WalkPose, b: WalkPose, s: float) -> Array:
        h = b.time - a.time
        return cubic(a.q, a.v * h, b.q, b.v * h, np.asarray(s))

    def _determinant(self, a: WalkPose, b: WalkPose, h: float, s: float) -> float:
        q = self._along(a, b, s)
        jacobian = self.loops.at(q, np.zeros_like(q), a.time + s * h).jacobian
        return float(np.linalg.det(self.loops.scaled(jacobian)))

    def leap(
        self, here: WalkPose, turn: Array, h: float
    ) -> tuple[WalkPose, list[WalkPose], WalkPose] | None:
        """A change point within about a step, poses on both its sides, and the pose at the end; None if there is none."""
        for share in (1.0, 1.37, 1.73, 0.81, 0.6):
            found = self.step(here, turn, share * h)
            if found is None or found[0].margin < POOR * self.best:
                continue
            if found[0].determinant * here.determinant < 0.0:
                seen = self.changed(here, found[0])
                return None if seen is None else (*seen, found[0])
        return None


def _zero(function: Callable[[float], float]) -> float:
    """Where a function of 0 to 1 that changes its sign vanishes, by the Illinois variant of regula falsi."""
    a, b = 0.0, 1.0
    fa, fb = function(a), function(b)
    for _ in range(60):
        c = b - fb * (b - a) / (fb - fa) if fb != fa else 0.5 * (a + b)
        fc = function(c)
        if fc == 0.0 or abs(b - a) < 1e-15:
            return c
        if fc * fb < 0.0:
            a, fa = b, fb
        else:
            fa *= 0.5
        b, fb = c, fc
    return b


def walked(loops: Loops, start: Array, period: float, turns: int, rounds: int) -> Passage:
    """Walk from a start (n,) through revolutions of `period` s until the motion recurs, `rounds` of them at most."""
    unit = period / (2 * math.pi * turns)
    walker, found = _Walker(loops, unit), Passage(loops, unit)
    here = walker.pose(start, 0.0)
    if here is None:
        nowhere = WalkPose(0.0, start, np.zeros(loops.size), 0.0, 0.0)
        found.ended = Ended(Status.CANNOT_TURN, nowhere)
        return found
    found.nodes.append(here)
    for count in range(1, min(rounds, MOST_ROUNDS) + 1):
        here = _through(walker, found, here, count * period)
        if found.ended is not None:
            return found
        if _recurs(loops, found.nodes[0].q, here.q):
            found.recurs = count * period
            return found
    return found


def _recurs(loops: Loops, first: Array, last: Array, within: float = 1e-6) -> Booleans:
    """Whether poses (n, ...) are the same but for whole turns, shape (...)."""
    apart = ((last - first).T / loops.scales).T
    angles = [one.kind == "angle" for one in loops.forest.coordinates]
    apart[angles] -= 2 * math.pi * np.round(apart[angles] / (2 * math.pi))
    return np.abs(apart).max(axis=0, initial=0.0) < within


def _through(walker: _Walker, found: Passage, here: WalkPose, end: float) -> WalkPose:
    """To a time in s, or to where the walk ends."""
    unit, turn = walker.unit, np.zeros(walker.loops.size)
    h = LONGEST * unit
    while here.time < end - 1e-12 * end:
        walker.best = max(walker.best, here.margin)
        h = min(h, LONGEST * unit, end - here.time)
        step = walker.step(here, turn, h)
        flips = step is not None and step[0].determinant * here.determinant <= 0.0
        poor = step is None or step[0].margin < POOR * walker.best
        if (flips or poor) and here.time >= walker.direct:
            leap = walker.leap(here, turn, h)
            if leap is not None:
                change, sides, there = leap
                found.changes.append(change)
                found.nodes += [one for one in sides if here.time < one.time < there.time]
                found.nodes.append(there)
                here, turn = there, np.zeros(walker.loops.size)
                continue
            if flips:  # no crossing that can be passed: what is there is looked at in short steps
                walker.direct = here.time + 2 * h
        if step is None or flips:
            h *= 0.5
            if h < SHORTEST * unit:
                fast = np.abs(here.v / walker.loops.scales).max(initial=0.0) * unit > FAST
                found.ended = Ended(Status.CANNOT_TURN if fast else Status.NEAR_SINGULAR, here)
                return here
            continue
        new, off = step
        turn = (new.v - here.v) / h
        here = new
        found.nodes.append(new)
        h *= 1.7 if off < 0.2 else 1.0 if off < 0.6 else 0.6
    return here


def clear(loops: Loops, start: Array, seconds: Array, turns: int) -> Booleans:
    """Which samples (m,) turn once round without coming near a singular configuration, the others to be walked one by one.

    `loops`: of the trees, with the samples' numbers; `start` (n, m); `seconds` (m,): a revolution.
    """
    steps = 72 * turns
    h = seconds / steps
    scales, rows = loops.scales[:, None], loops.row_scales[:, None]
    q, v, turn = start, np.zeros_like(start), np.zeros_like(start)
    good = np.isfinite(start).all(axis=0)
    start = q = first = np.where(good, start, 0.0)
    best, sign = np.zeros(len(seconds)), np.zeros(len(seconds))
    worst = np.full(len(seconds), np.inf)
    for k in range(steps + 1):
        guess = q + h * (v + 0.5 * h * turn) if k else q
        inverse, state = _inverse(loops, guess, k * h)
        change = np.einsum("mij,jm->im", inverse, state.error / rows)
        new = -scales * np.einsum("mij,jm->im", inverse, state.rate / rows)
        signs = np.sign(np.linalg.det(inverse))
        size = _margins(inverse)
        best, worst = np.maximum(best, size), np.minimum(worst, size)
        good &= np.abs(change).max(axis=0, initial=0.0) < FARTHEST
        if k:
            turned = np.abs((new - v) * h / scales).max(axis=0, initial=0.0)
            good &= (signs == sign) & (turned < TURNED)
        # what is off already must not spoil the arithmetic of the others
        q = np.where(good, guess - scales * change, start)
        first = first if k else q
        turn = np.where(good, (new - v) / h, 0.0) if k > 0 else turn
        v, sign = np.where(good, new, 0.0), signs
    good &= worst > CLEAR * best
    return good & _recurs(loops, first, q, 1e-2)

"""One life: dynamics at a state of wear, a jump of many revolutions at the rate found there, dynamics again.

The state is the sliding work that each worn joint has done, w; a revolution adds E(w) to it, which copies of a
simulation estimate with Student's intervals. A jump of n revolutions is taken twice: at once, w + n E(w), and in two halves,
w + n/2 E(w) + n/2 E(w + n/2 E(w)). They differ by n/2 (E_half - E). The next state is twice the one less the other,
w + n E_half, whose error is an order smaller, so the difference bounds it. f is judged at the same states:
how far it is, half-way, from the middle between both ends. What the intervals of E and f leave open is not held against a jump.

Where profiles are followed (`relief`), the moments of the work go with it: of what is done in a jump they have the share
found at its start, or half-way.

Copies of odd number wait longer before they are measured. Where they differ from the others by more than both scatter, the
transient is not over: their difference widens the intervals, and is reported.
"""

import math
from collections.abc import Generator, Mapping
from dataclasses import dataclass, field

import numpy as np

from hpcclear.base.arrays import Array, Integers
from hpcclear.base.outcome import Status
from hpcclear.base.student import student
from hpcclear.dynamics.wear.curves import THROUGH, Life, WearState, first_passed, local_bounds
from hpcclear.dynamics.wear.law import Joints
from hpcclear.dynamics.wear.relief import FLAT, Relief

FIRST_GROWTH = 0.1  # of the clearance, relative, by the first jump
MOST_GROWTH = 0.5  # by any jump

BEYOND = 1.05
"""Of the revolutions to the end of a life, at the rate of its state: a jump goes there, so that the end lies within it."""

_SHRINK, _GROW, _SAFETY = 0.2, 4.0, 0.9


@dataclass(frozen=True)
class LifePlan:
    """How lives are followed."""

    cycles: float  # revolutions of a life
    tolerance: float  # of a jump in each clearance and in f, relative
    shortest: float  # revolutions of a jump, at least
    # simulations at a state of wear: at first, and where intervals are wider than the tolerance allows
    copies: int
    most_copies: int
    # what ends a life, by name as of `curves.first_passed`, SI
    limits: Mapping[str, float] = field(default_factory=dict)
    beyond: bool = False  # whether lives go on past these; none does once a bearing is worn through


@dataclass(frozen=True)
class WearOutcome:
    """What simulations at a state of wear came to.

    `work`: sliding work in a revolution of worn joints (copies, joints), J; `objective`: f (copies,); `peak`: peak forces
    of all joints of the scene (copies, joints), N; `status` (copies,); `moments`: of the work in a revolution (copies, joints,
    size), J, as of `Relief`, where profiles are followed.
    """

    work: Array
    objective: Array
    peak: Array
    status: Integers
    moments: Array | None = None


@dataclass(frozen=True)
class Asked:
    """Simulations at a state of wear: sliding work done so far (joints,), J, and the numbers of the copies.

    Those of odd number are to wait longer. `moments` as of `WearState`. `done`: about how much of the life's simulations lie
    behind it, from 0 to 1.
    """

    work: Array
    copies: range
    moments: Array | None = None
    done: float = 0.0


class _EndedError(Exception):
    """A life that cannot go on, and why."""

    def __init__(self, status: Status) -> None:
        self.status = status


Asking = Generator[Asked, WearOutcome, Life]
State = tuple[float, Array, Array]
"""Revolutions, work done (joints,), J, and its moments (joints, size)."""


def life(joints: Joints, plan: LifePlan, relief: Relief = FLAT) -> Asking:
    """Follow one life; yields what is to be simulated, is sent what came of it, returns the `Life`.

    `relief`: what profiles are made of; by default surfaces wear evenly.
    """
    nothing = np.zeros(len(joints.clearance))
    found = Life(nodes=[], limit=nothing, error=nothing)
    variance = np.zeros(len(joints.clearance))
    try:
        new = np.zeros((len(variance), relief.size))
        here = yield from _look(found, joints, plan, relief, (0.0, nothing, new), None)
        found.nodes.append(here)
        asked = _growing(joints, relief, here, FIRST_GROWTH)
        while not _is_over(found, joints, plan, relief) and here.cycle < plan.cycles:
            asked = min(asked, _growing(joints, relief, here, MOST_GROWTH))
            end_at = max(BEYOND * _to_end(joints, plan, relief, here), plan.shortest)
            length = min(asked, end_at, plan.cycles - here.cycle)
            if length < min(plan.shortest, plan.cycles - here.cycle):
                raise _EndedError(Status.JUMP_TOO_SHORT)
            half, end, error = yield from _jump(found, joints, plan, relief, here, length)
            asked = length * min(max(_SAFETY / math.sqrt(max(error, 1e-9)), _SHRINK), _GROW)
            if end is not None:
                found.halves.append(half)
                found.nodes.append(end)
                variance += joints.grown(here.work, length * half.rate_limit) ** 2
                # rates that rise and fall again within a jump are seen at its end as well
                apart = np.maximum(np.abs(half.rate - here.rate), np.abs(end.rate - half.rate))
                found.error = found.error + joints.grown(here.work, 0.5 * length * apart)
                found.error = found.error + _shifted(joints, relief, here, half, length)[0]
                here = end
    except _EndedError as stop:
        found.status = stop.status
    found.limit = np.sqrt(variance)
    if not found.reason:
        found.ended = found.nodes[-1].cycle if found.nodes else 0.0
        found.reason = THROUGH if found.status is Status.WORN_THROUGH else ""
    return found


def _is_over(found: Life, joints: Joints, plan: LifePlan, relief: Relief) -> bool:
    """Whether the last jump passed what ends the life, which then ends there."""
    limits = {} if plan.beyond else plan.limits
    cycle, reason = first_passed(found, joints, limits, relief, since=len(found.nodes) - 2)
    if reason:
        found.ended, found.reason = cycle, reason
        found.status = Status.WORN_THROUGH if reason == THROUGH else found.status
    return bool(reason)


def _speed(joints: Joints, relief: Relief, here: WearState) -> Array:
    """Growth of the largest clearance around each joint in a revolution, m."""
    grooves = relief.deepest(relief.waves(joints, here.share))
    crowded = 1.0 + grooves / np.maximum(joints.slope, 1e-300)
    return np.asarray(crowded * joints.speed(here.work) * here.rate)


def _to_end(joints: Joints, plan: LifePlan, relief: Relief, here: WearState) -> float:
    """Revolutions until a clearance ends the life at the rates of its state; 0 or more, no end where nothing wears."""
    local = joints.worn(here.work)[0] + relief.deepest(relief.waves(joints, here.moments))
    bounds = local_bounds(joints, {} if plan.beyond else plan.limits)
    speed = np.maximum(_speed(joints, relief, here), 1e-300)
    return float((np.maximum(bounds - local, 0.0) / speed).min())


def _done(joints: Joints, plan: LifePlan, relief: Relief, here: WearState) -> float:
    """How much of a life's jumps lie behind a state: each grows a clearance by about the same part of itself."""
    left = min(plan.cycles - here.cycle, _to_end(joints, plan, relief, here))
    now, new = joints.worn(here.work)[0], joints.clearance
    end = now + left * _speed(joints, relief, here)
    gone, whole = float(np.log(now / new).max()), float(np.log(end / new).max())
    return gone / whole if whole > 0.0 else here.cycle / plan.cycles


def _growing(joints: Joints, relief: Relief, here: WearState, growth: float) -> float:
    """Revolutions in which a clearance grows by that much where it does most, relative; no end where nothing wears."""
    speed = _speed(joints, relief, here) / joints.worn(here.work)[0]
    return growth / float(speed.max()) if speed.max() > 0.0 else math.inf


def _moved(joints: Joints, here: WearState, share: Array, work: Array) -> Array:
    """Moments (joints, size), J, once so much work is done, shared out around the surfaces like this."""
    counted: Array = joints.counted(work) - joints.counted(here.work)
    return here.moments + share * counted[:, None]


def _shifted(
    joints: Joints, relief: Relief, here: WearState, half: WearState, length: float
) -> tuple[Array, Array]:
    """By how much a jump at once and in two halves differ in what profiles add to the clearance, halved as the difference of
    their rates is, and what is open of it, m, (joints,)."""
    work = here.work + length * half.rate
    apart = 0.5 * (_moved(joints, here, half.share, work) - _moved(joints, here, here.share, work))
    counted = joints.counted(work) - joints.counted(here.work)
    open_ = 0.5 * np.hypot(half.share_limit, here.share_limit) * counted[:, None]
    aside = relief.around(relief.waves(joints, apart))
    spread: Array = np.sqrt(np.square(relief.waves(joints, open_)).sum(axis=-1))
    return np.abs(aside).max(axis=-1).sum(axis=-1), spread


def _jump(
    found: Life, joints: Joints, plan: LifePlan, relief: Relief, here: WearState, length: float
) -> Generator[Asked, WearOutcome, tuple[WearState, WearState | None, float]]:
    """Half-way, the end unless the jump is refused, and its error over the tolerance."""
    work = here.work + 0.5 * length * here.rate
    state = here.cycle + 0.5 * length, work, _moved(joints, here, here.share, work)
    half = yield from _look(found, joints, plan, relief, state, length)
    gone = here.work + length * half.rate
    clearance = joints.worn(gone)[0]
    allowed = plan.tolerance * clearance
    rates = np.abs(half.rate - here.rate), np.hypot(half.rate_limit, here.rate_limit)
    apart, open_ = (joints.grown(here.work, 0.5 * length * one) for one in rates)
    error = float((np.maximum(apart - open_, 0.0) / allowed).max())
    shifted, unknown = _shifted(joints, relief, here, half, length)
    error = max(error, float((np.maximum(shifted - unknown, 0.0) / allowed).max()))
    if error > 1.0:
        return half, None, error
    state = here.cycle + length, gone, _moved(joints, here, half.share, gone)
    end = yield from _look(found, joints, plan, relief, state, length)
    bent = abs(half.objective - 0.5 * (here.objective + end.objective))
    ends = here.objective_limit**2 + end.objective_limit**2
    known = math.sqrt(half.objective_limit**2 + 0.25 * ends)
    bend = max(bent - known, 0.0) / (plan.tolerance * abs(end.objective))
    grown = float(((clearance - joints.worn(here.work)[0]) / clearance).max())
    # where f leaps, its curve is right once the leap is placed to within the tolerance of the clearance
    if bend > 1.0 and grown > plan.tolerance:
        return half, None, bend
    return _placed(half, here, end, joints), end, max(error, min(bend, 1.0))


def _placed(half: WearState, here: WearState, end: WearState, joints: Joints) -> WearState:
    """The state half-way at the revolution at which it is passed: the half jump itself went at the rate of its start."""
    done = float((joints.slope * (half.work - here.work)).sum())
    whole = float((joints.slope * (end.work - here.work)).sum())
    share = min(max(done / whole, 0.05), 0.95) if whole > 0.0 else 0.5
    cycle = here.cycle + share * (end.cycle - here.cycle)
    return WearState(cycle, *list(vars(half).values())[1:])


def _look(
    found: Life, joints: Joints, plan: LifePlan, relief: Relief, state: State, length: float | None
) -> Generator[Asked, WearOutcome, WearState]:
    """Simulate a state of wear until its intervals are within what a jump of that length may be off, or copies run out.

    `state`: revolutions, work done and its moments.
    """
    _, work, moments = state
    clearance, radius = joints.worn(work)
    if (clearance >= radius).any():
        raise _EndedError(Status.WORN_THROUGH)
    seen: list[WearOutcome] = []
    done, wanted = 0, plan.copies
    while True:
        part = _done(joints, plan, relief, found.nodes[-1]) if found.nodes else 0.0
        answer = yield Asked(work, range(done, wanted), moments if relief.size else None, part)
        found.simulations += wanted - done
        failed = [s for s in answer.status.tolist() if not Status(s).valid]
        if failed:
            raise _EndedError(Status(failed[0]))
        seen.append(answer)
        done = wanted
        node = _node(state, seen)
        # what limit and drift of the rate leave open of the next jump
        if length is None:
            first = FIRST_GROWTH * clearance / np.maximum(node.rate, 1e-300)
            open_, drifted = first * node.rate_limit, first * node.drift[:-1] * node.rate
        else:
            open_ = joints.grown(work, length * node.rate_limit)
            drifted = joints.grown(work, length * node.drift[:-1] * node.rate)
        allowed = 0.5 * plan.tolerance * clearance
        sure = (open_ <= allowed).all()
        sure &= node.objective_limit <= plan.tolerance * abs(node.objective)
        # more copies do not end a transient
        moving = (drifted > allowed).any() or node.drift[-1] > plan.tolerance
        if sure or moving or done >= plan.most_copies:
            found.certain &= bool(sure)
            found.drift = max(found.drift, float(node.drift.max()))
            sharpest = relief.sharpest(relief.waves(joints, moments), clearance)
            found.sharpest = max(found.sharpest, sharpest)
            return node
        wanted = min(2 * done, plan.most_copies)


def _node(state: State, seen: list[WearOutcome]) -> WearState:
    cycle, work, moments = state
    rates = np.concatenate([one.work for one in seen])
    values = np.concatenate([one.objective for one in seen])
    peaks = np.concatenate([one.peak for one in seen])
    every = np.column_stack([rates, values])
    mean, scatter = every.mean(axis=0), every.std(axis=0, ddof=1)
    drift = _drift(every)
    sure = student(0.95, len(every) - 1) / math.sqrt(len(every))
    limit = np.hypot(sure * scatter, drift)
    none = np.zeros(moments.shape)
    done = [[none] * len(s.work) if s.moments is None else s.moments for s in seen]
    shares = np.concatenate(done) / np.maximum(rates, 1e-300)[..., None]
    return WearState(
        cycle, work, mean[:-1], limit[:-1], float(mean[-1]), float(limit[-1]), peaks.mean(axis=0),
        drift / np.maximum(np.abs(mean), 1e-300), moments,
        shares.mean(axis=0), sure * shares.std(axis=0, ddof=1),
    )  # fmt: skip


def _drift(values: Array) -> Array:
    """By how much means of copies (copies, n) that waited longer, those of odd number, and of the others differ beyond the 95 %
    intervals of their scatter, (n,); 0 of fewer than two each, whose scatter is not known."""
    groups = values[0::2], values[1::2]
    sizes = [len(one) for one in groups]
    if min(sizes) < 2:
        return np.zeros(values.shape[1])
    freedom = sum(sizes) - 2
    squares = [np.square(one - one.mean(axis=0)).sum(axis=0) for one in groups]
    error = np.sqrt(sum(squares) / freedom * sum(1.0 / size for size in sizes))
    apart = np.abs(groups[0].mean(axis=0) - groups[1].mean(axis=0))
    return np.maximum(apart - student(0.95, freedom) * error, 0.0)

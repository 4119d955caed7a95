"""How the steady mean of one design is found: a look at four copies (`look`); of an irregular motion perturbed copies at two
tolerances, as many revolutions as its interval needs."""

from collections.abc import Generator
from dataclasses import dataclass, field

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.outcome import Regime
from hpcclear.base.student import student
from hpcclear.dynamics.evaluation.steady import effort as given, judging
from hpcclear.dynamics.evaluation.steady.copies import PERTURBATION
from hpcclear.dynamics.evaluation.steady.effort import STRICTER, Effort, Mean, Sample, Segment
from hpcclear.dynamics.evaluation.steady.look import look
from hpcclear.dynamics.layout.views import Outcome, Parameters, Start

LOOSEST = 1e-5
"""Looser of the two tolerances at first, at most: at 1e-3 the mean was off by up to 209 % on nine chaotic scenes, at 1e-4 by
0.06 to 1.7 % on three of five, and a revolution at 1e-5 costs 5 to 25 % more than at 1e-4."""

LOOSEST_LATCHED = 1e-6  # likewise with a damping that keeps the impact speed

USUAL = 1e-4
"""Clearance, m, down to which these initial tolerances were found good enough. At 0.02 mm means at 1e-6 were off by 1 %, more
than their difference from 1e-5."""

LEVEL = 0.96
"""Of the intervals that are called 95 %: at 0.95 they hold 92 to 93 %, as a mean is looked at until they are narrow enough."""

SHIFT = 2e-3  # what the looser of these tolerances moves a mean by as a rule, relative

POOLED = 2.0  # standard errors (and `SHIFT`) up to which the rest of a difference between the tolerances is chance
LEFT = 0.3  # assumed residual bias of the tighter tolerance, as a fraction of an insignificant difference

DOUBTED = 3.5
"""Standard errors above which the looser tolerance is rejected; at 2.5 chance rejects more of them, at twice the cost."""

COPIES = 32  # copies of an ensemble at first, every other one at the stricter tolerance

SEGMENT = 4
"""Revolutions between two looks at an ensemble, and those that its peaks are reported for."""

PARTED = 12
"""Revolutions before the first look at an ensemble, from when the perturbations have grown to the size of the motion."""

FIRST = 4, 6  # segments before it, at least and at most

MEMORY, LONG_MEMORY = 3.0, 10.0
"""Revolutions over which a start that differs from the steady motion by the scatter of one may still be felt, unseen in what
copies scatter by; longer with a `latched` damping or a free crank. On six of nine scenes whose intervals had missed the mean,
means of the first 24 revolutions were off by 1 to 12 of them times that scatter: by memory, or by what weak chaos makes of a
tolerance. Intervals are widened by it as far as the target allows: no revolution is simulated for what cannot be seen."""

LASTING = 40
"""Segments before copies on different orbits are taken for what they seem: they may wander on from orbit to orbit."""

APPROACH = 0.85
"""Revolutions until the next look over those that seem to be needed: intervals scatter, and what is too much is not undone."""

LEAST = 0.05  # revolutions until the next look over those so far, at least: each look is another chance to stop too early
RESTLESS = 4  # doublings in a row over which the average moved no less than before, after which there is no steady mean


@dataclass
class _Copies:
    """Segments of all copies so far."""

    start: Start
    strictness: Array
    outcomes: list[Outcome] = field(default_factory=list)

    def kept(self, seen: "_Interval") -> Outcome:
        rows = np.stack([outcome.rows for outcome in self.outcomes[seen.first :]])
        return Outcome(rows if seen.pooled else rows[:, 1::2])


@dataclass
class _Interval:
    """What an ensemble says at a look: mean of f, its limit and standard error, m; what to do about it."""

    first: int  # segment that the average begins with
    pooled: bool  # whether both tolerances count, or the stricter alone
    f: float
    limit: float
    unseen: float  # memory of the start that the limit knows nothing of, m
    bias: float  # between the tolerances, m
    doubt: float  # its standard error
    regime: Regime
    moved: float  # by the average, over the latest quarter, m; 0 where it does not drift
    settling: float  # how far it still may move
    copies_count: bool  # more copies help, more revolutions do not
    short: bool  # too few segments to see a drift

    def half_width(self, most: float) -> float:
        """The limit that is stated, m: with what is unseen as far as that leaves it within `most`; NaN if there is none."""
        limit = self.limit + self.settling
        wide = float(np.hypot(self.limit, self.unseen)) + self.settling
        return np.nan if np.isinf(limit) else max(limit, min(wide, most))


def steady_mean(sample: Sample, target: float, budget: int) -> Generator[Segment, Outcome, Mean]:
    """Find the steady mean of a design to a relative error (95 % CI), or report that it is missed or does not exist.

    `budget`: revolutions of all copies together, at most (a segment that is under way is finished). The mean of a failed
    simulation has its status.
    """
    effort = Effort(sample, budget)
    found, growth = yield from look(effort, target)
    if isinstance(found, Mean):
        return found
    return (yield from ensemble(effort, target, min(found, loosest(sample)), growth))


def loosest(sample: Sample) -> float:
    """Upper bound of an ensemble's first looser tolerance; tolerances are relative to positions, not to the clearance."""
    gaps = Parameters(sample.par).clearance
    narrow = min(float(gaps[gaps > 0.0].min()) / USUAL, 1.0)
    return narrow * (LOOSEST_LATCHED if sample.latched else LOOSEST)


def ensemble(
    effort: Effort, target: float, rtol: float, growth: float
) -> Generator[Segment, Outcome, Mean]:
    """Simulate perturbed copies until the confidence interval of their mean is narrow enough, or the budget is spent."""
    copies = _new_copies(effort, COPIES)
    segments, moved, restless = _first(effort.sample, growth), 0.0, 0
    while True:
        yield from _extend(effort, copies, rtol, segments)
        if effort.failed is not None:
            return effort.failure(copies.outcomes[-1], rtol)
        seen = _interval(copies, effort.sample)
        level = target * seen.f
        spent = effort.revolutions >= effort.budget
        biased = abs(seen.bias) > max(DOUBTED * seen.doubt, 0.25 * level)  # by more than chance
        if biased and rtol / STRICTER >= given.TIGHTEST and not spent:
            if (yield from _tighten(effort, copies, rtol / STRICTER)):
                rtol = rtol / STRICTER
            segments = 0
            continue
        drifting = seen.settling > 0.5 * level
        restless = restless + 1 if drifting and seen.moved > given.STEADY * moved else 0
        moved = seen.moved
        early = seen.copies_count and len(copies.outcomes) < LASTING
        met = seen.limit + seen.settling <= level and not early
        unsteady = restless >= RESTLESS
        if unsteady or spent or met:
            regime = Regime.UNSTEADY if unsteady else Regime.SETTLING if drifting else seen.regime
            return effort.mean(
                regime=regime, limit=np.nan if unsteady else seen.half_width(level if met else np.inf),
                outcomes=copies.kept(seen), segment=SEGMENT, rtol=rtol, met=bool(met and not unsteady),
                growth=growth,
            )  # fmt: skip
        if early:
            segments = LASTING - len(copies.outcomes)
        elif drifting:
            segments = 1 if seen.short else len(copies.outcomes)
        else:
            segments = yield from _more(effort, copies, rtol, seen, level - seen.settling)


def _first(sample: Sample, growth: float) -> int:
    """Segments before the first look: fewer if perturbations grow fast, unless a speed or a `latched` damping lasts longer."""
    if sample.free or sample.latched or not growth > 0.0:
        return FIRST[1]
    parting = -np.log(PERTURBATION) / growth
    return int(np.clip(np.ceil((parting + PARTED) / SEGMENT), *FIRST))


def _new_copies(effort: Effort, count: int) -> _Copies:
    strictness = np.where(np.arange(count) % 2 == 0, 1.0, STRICTER)
    return _Copies(effort.more_starts(count), strictness)


def _tighten(effort: Effort, copies: _Copies, rtol: float) -> Generator[Segment, Outcome, bool]:
    """Put copies at a tenth of `rtol` in the place of those at the looser tolerance; False if the budget ends before.

    What was simulated at the stricter tolerance is kept: it is the looser one now.
    """
    total = len(copies.outcomes)
    new = _Copies(effort.more_starts(len(copies.start) // 2), copies.strictness[1::2])
    yield from _extend(effort, new, rtol, total)
    if len(new.outcomes) < total or effort.failed is not None:
        return False
    copies.start = Start(_woven(copies.start[1::2].rows, new.start.rows))
    pairs = zip(copies.outcomes, new.outcomes, strict=True)
    copies.outcomes = [Outcome(_woven(old[1::2].rows, added.rows)) for old, added in pairs]
    return True


def _woven(first: Array, second: Array) -> Array:
    """Rows of both (n, k) in turn, shape (2 n, k)."""
    return np.stack([first, second], axis=1).reshape(-1, first.shape[1])


def _extend(
    effort: Effort, copies: _Copies, rtol: float, segments: int
) -> Generator[Segment, Outcome, None]:
    for _ in range(segments):
        outcome = yield from effort.run(rtol, SEGMENT, copies.start, copies.strictness)
        copies.outcomes.append(outcome)
        copies.start = outcome.end()
        if effort.failed is not None or effort.revolutions >= effort.budget:
            return


def _more(
    effort: Effort, copies: _Copies, rtol: float, seen: _Interval, level: float
) -> Generator[Segment, Outcome, int]:
    """Add copies where their orbits differ for good; how many further segments to request."""
    used, total = len(copies.outcomes) - seen.first, len(copies.outcomes)
    missing = min((seen.limit / max(level, 1e-300)) ** 2, 1e6)
    count = len(copies.start)
    left = max(effort.budget - effort.revolutions, 0)
    if seen.copies_count:
        more = int(count * max(APPROACH * missing - 1.0, LEAST))
        wanted = min(more, 3 * count, left // (SEGMENT * total))
        wanted = max(wanted - wanted % 2, 2)
        new = _new_copies(effort, wanted)
        yield from _extend(effort, new, rtol, total)
        if len(new.outcomes) == total:
            _join(copies, new)
        return 0
    affordable = -(-left // (SEGMENT * count))
    wanted = int(np.ceil(used * max(APPROACH * missing - 1.0, LEAST)))
    return int(np.clip(wanted, 1, min(3 * total, max(affordable, 1))))


def _join(copies: _Copies, new: _Copies) -> None:
    """Take new copies in, which have gone as far."""
    copies.start = Start(np.concatenate([copies.start.rows, new.start.rows]))
    copies.strictness = np.concatenate([copies.strictness, new.strictness])
    pairs = zip(copies.outcomes, new.outcomes, strict=True)
    copies.outcomes = [Outcome(np.concatenate([a.rows, b.rows])) for a, b in pairs]


def _interval(copies: _Copies, sample: Sample) -> _Interval:
    speeds = sample.speeds(copies.outcomes)
    gaps = np.stack([outcome.mean_gap for outcome in copies.outcomes])
    y = judging.projected(gaps)  # (segments, copies)
    total = len(y)
    between = y.var(axis=1, ddof=1)
    chance = float(np.median(between[total // 2 :])) / y.shape[1]  # of the mean over copies
    parted = min(judging.parted(between), total // 2)
    first = max(judging.spin_up(y.mean(axis=1), chance), parted, 1)
    if speeds is not None:
        first = max(first, judging.spin_up(speeds.mean(axis=1)))
    first = min(first, total - 1)  # the budget may end at once
    kept = y[first:]
    loose, strict = kept[:, ::2], kept[:, 1::2]
    variance, freedom = judging.variance_of_mean([loose, strict])
    doubt = float(np.sqrt(2.0 * variance / strict.shape[1]))
    bias = float(loose.mean() - strict.mean())
    excess = _excess(bias, doubt, SHIFT * float(kept.mean()))
    pooled = excess <= doubt**2  # else the stricter alone are nearer
    if pooled:
        error = np.sqrt(variance / kept.shape[1] + 0.25 * excess)
    else:
        kept, between = strict, y[:, 1::2].var(axis=1, ddof=1)
        variance, freedom = judging.variance_of_mean([strict])
        error = np.sqrt(variance / strict.shape[1])
    mean, limit = float(kept.mean()), float(student(LEVEL, freedom) * error)
    if not pooled:
        limit = float(np.hypot(limit, LEFT * np.sqrt(excess)))
    memory = LONG_MEMORY if sample.latched or sample.free else MEMORY
    unseen = memory * float(error) * float(np.sqrt(kept.shape[1] / (SEGMENT * len(kept))))
    within = float(kept.var(axis=0, ddof=1).mean()) if len(kept) > 1 else np.nan
    apart = float(kept.mean(axis=0).var(ddof=1))
    coherent = len(kept) >= 3 and float(between[first:].mean()) < 0.3 * float(within)
    if coherent:  # copies have not parted: their mean scatters in time like one of them
        _, limit = judging.with_limit(kept.mean(axis=1))
    several = bool(len(kept) > 1 and apart > 4.0 * within / len(kept))
    regime = Regime.SEVERAL if several else Regime.CHAOTIC
    if coherent or max(apart, within if np.isfinite(within) else 0.0) < (1e-5 * mean) ** 2:
        regime = Regime.REGULAR
        limit += 0.5 * abs(bias)  # nothing else shows what tolerances do
    short = len(kept) < 3
    moved, settling = (0.0, np.inf) if short else judging.approach(kept)
    if speeds is not None and not short:
        by_speed = given.SPEED * mean / abs(float(speeds[first:].mean()))
        faster, further = judging.approach(speeds[first:])
        moved, settling = max(moved, by_speed * faster), max(settling, by_speed * further)
    return _Interval(
        first, pooled, mean, limit, unseen, bias, doubt, regime, moved, settling, several, short
    )


def _excess(bias: float, doubt: float, usual: float) -> float:
    """Square of what the tolerances differ by over what chance alone makes of a difference that is none, m^2."""
    excess = max(bias**2 - doubt**2, 0.0)
    if abs(bias) <= POOLED * np.hypot(doubt, usual):
        excess = min(excess, usual**2)
    return excess

"""How the steady mean of one design is found: a look at four copies, then as many revolutions of 32 copies as it takes.

Each procedure is a generator: it yields the `Stretch` it wants simulated, is sent its `Outcome`, and returns a `Mean`. So
that thousands of designs share the lanes, and a design's numbers depend on nothing but the design.
"""

from collections.abc import Generator
from dataclasses import dataclass, field

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.outcome import Regime, Status
from hpcclear.dynamics.revolutions import objective
from hpcclear.dynamics.steady import judging
from hpcclear.dynamics.steady.copies import KICK, kicked, separation
from hpcclear.dynamics.views import Outcome, Parameters, Start

SHARE = 0.1
"""First guess of rtol over the target error: on 200 random scenes of the paper's box (Hunt-Crossley, 0.5 s/m) the error of
f was below 10 rtol in 95 % for rtol from 5e-4 to 3e-5, and below 6 rtol at 1e-5."""

LOOSEST = 1e-3
"""Tolerance that a look starts with at most."""

LOOSEST_CHAOTIC = 1e-4
"""Likewise where motion is chaotic: at 1e-3 the mean was off by up to 209 % on nine chaotic scenes, at 1e-4 by less than a
standard error on all but one, whose damping is latched."""

LOOSEST_LATCHED = 1e-5
"""Likewise with a damping that keeps the impact speed."""

POOLED = 1.5
"""Standard errors that the means at both tolerances may differ by for both to be used."""

TIGHTEST = 1e-11
STRICTER = 10.0
"""How many times tighter than the others' the tolerances of half of the copies are."""

COPIES = 32
"""Copies of an ensemble at first, every other one at the stricter tolerance."""

STRETCH = 10
"""Revolutions between two looks at an ensemble, and those that its peaks are told for."""

CHECKPOINTS = (4, 6, 8, 12, 16, 24, 32, 48, 64)
"""Revolutions after which a look is judged; from then on at each doubling."""

PATIENCE = 16
"""Revolutions that copies have for coming together."""

FIRST = 6
"""Stretches before the first look at an ensemble."""

LASTING = 16
"""Stretches before copies on different orbits are taken for what they seem: they may wander on from orbit to orbit."""

RESTLESS = 4
"""Doublings in a row over which the average moved no less than before, after which there is no steady mean."""

STEADY = 0.8
"""Change of the average over a doubling of the revolutions, over that of the doubling before, that shows no settling."""


@dataclass(frozen=True)
class Sample:
    """A design to simulate: parameters (1, PARAMETERS), one start, what kicks are relative to (2 n,), kind of damping."""

    par: Array
    start: Start
    scale: Array
    latched: bool


@dataclass(frozen=True)
class Stretch:
    """Revolutions of some copies to simulate, the average over all of them.

    Parameters of a copy hold how many times stricter than `rtol` its own tolerance is.
    """

    rtol: float
    revolutions: int
    par: Array
    start: Start


@dataclass
class Mean:
    """What was found.

    Attributes
    ----------
    regime : Regime
    limit : float
        Half-width of the limits of f, m; NaN where there is no steady mean.
    outcomes : Outcome, shape (stretches, copies)
        What the average is made of.
    stretch : int
        Revolutions of each of these.
    rtol : float
        The looser of the two tolerances, the other one is `STRICTER` times tighter.
    period : int or None
    growth : float
        Of a kick, per revolution: mean of the logarithm, as far as the look told.
    growth_limit : float
        Half-width of its limits, if it was measured on purpose.
    attractors : int or None
        Kinds of motion found from several starts, if they were looked for.
    met : bool
    status : Status
    revolutions, evaluations : int
        All that was simulated.
    """

    regime: Regime
    limit: float
    outcomes: Outcome
    stretch: int
    rtol: float
    met: bool
    period: int | None = None
    growth: float = np.nan
    growth_limit: float = np.nan
    attractors: int | None = None
    status: Status = Status.OK
    revolutions: int = 0
    evaluations: float = 0.0

    @property
    def tightest(self) -> float:
        """The tightest tolerance among the copies."""
        return self.rtol / STRICTER if np.isnan(self.growth_limit) else self.rtol

    @property
    def gaps(self) -> Array:
        """Mean gaps, m, shape (2,)."""
        return self.outcomes.mean_gap.mean(axis=(0, 1))


@dataclass
class Effort:
    """What was simulated so far, and how a stretch of it is asked for."""

    sample: Sample
    budget: int
    revolutions: int = 0
    evaluations: float = 0.0
    failed: Status | None = None

    def run(
        self, rtol: float, revolutions: int, start: Start, strictness: Array
    ) -> Generator[Stretch, Outcome, Outcome]:
        """A stretch of each of these copies; how many times stricter each one's tolerance is, shape (copies,)."""
        par = np.repeat(self.sample.par, len(start), axis=0)
        Parameters(par).strictness = strictness**2  # squared, as the kernel keeps it
        outcome = yield Stretch(rtol, revolutions, par, start)
        self.revolutions += revolutions * len(start)
        self.evaluations += float(outcome.evaluations.sum())
        bad = outcome.status[outcome.status != Status.OK]
        if len(bad):
            self.failed = Status(int(bad[0]))
        return outcome

    def mean(self, **found: object) -> Mean:
        """What was found, with what it took."""
        return Mean(**found, revolutions=self.revolutions, evaluations=self.evaluations)  # type: ignore[arg-type]

    def failure(self, outcome: Outcome, rtol: float) -> Mean:
        """Some copy did not reach its end."""
        assert self.failed is not None
        return self.mean(
            regime=Regime.UNJUDGED, limit=np.nan, outcomes=outcome[None], stretch=1, rtol=rtol, met=False,
            status=self.failed,
        )  # fmt: skip


def steady_mean(sample: Sample, target: float, budget: int) -> Generator[Stretch, Outcome, Mean]:
    """Find the steady mean of a design to a relative error, 95 % limits, or say that it is missed or does not exist.

    Parameters
    ----------
    sample : Sample
    target : float
    budget : int
        Revolutions of all copies together, at most (a stretch that is under way is finished).

    Returns
    -------
    Mean
        Of a failed simulation with its status.
    """
    effort = Effort(sample, budget)
    found, growth = yield from _look(effort, target)
    if isinstance(found, Mean):
        return found
    loosest = LOOSEST_LATCHED if sample.latched else LOOSEST_CHAOTIC
    return (yield from _ensemble(effort, target, min(found, loosest), growth))


# ---- a look -----------------------------------------------------------------------------------


@dataclass
class _History:
    """Revolution after revolution of the four copies since the tolerance last changed."""

    outcomes: list[Outcome] = field(default_factory=list)
    apart: list[float] = field(default_factory=list)  # distance of the copies at one tolerance
    moved: dict[int, float] = field(default_factory=dict)  # by the average, at each checkpoint

    def window(self, revolutions: int) -> Outcome:
        """The latest revolutions of the stricter copies, shape (revolutions, 2)."""
        rows = np.stack([outcome.rows for outcome in self.outcomes[-revolutions:]])
        return Outcome(rows[:, 2:])

    def gaps(self) -> Array:
        return np.stack([outcome.mean_gap for outcome in self.outcomes])


def _is_checkpoint(revolutions: int) -> bool:
    last = CHECKPOINTS[-1]
    doubled = revolutions > last and revolutions % last == 0
    return revolutions in CHECKPOINTS or (doubled and (revolutions // last).bit_count() == 1)


def _growth(apart: list[float]) -> float:
    """Mean logarithm of the growth of a kick per revolution, until copies are as far apart as they still are at the end."""
    distance = np.array(apart)
    lasting = np.median(distance[len(distance) // 2 :])
    far = int(np.argmax(distance >= 0.3 * lasting)) or len(distance) - 1
    with np.errstate(divide="ignore"):
        return float(np.log(distance[far] / distance[0]) / far)


def _look(effort: Effort, target: float) -> Generator[Stretch, Outcome, tuple[Mean | float, float]]:
    """Four copies, revolution by revolution: a regular motion's mean, or the tolerance at which it turned out irregular."""
    sample, rtol = effort.sample, min(SHARE * target, LOOSEST)
    strictness = np.array([1.0, 1.0, STRICTER, STRICTER])
    start = kicked(sample.start, sample.scale, range(2))
    start = Start(np.concatenate([start.rows, start.rows]))
    history = _History(apart=[KICK])
    growth = np.nan
    while True:
        outcome = yield from effort.run(rtol, 1, start, strictness)
        if effort.failed is not None:
            return effort.failure(outcome, rtol), growth
        history.outcomes.append(outcome)
        start = outcome.end()
        history.apart.append(float(separation(start[2:3], start[3:4], sample.scale)[0]))
        revolutions = len(history.outcomes)
        spent = effort.revolutions >= effort.budget
        if not (_is_checkpoint(revolutions) or spent):
            continue
        growth = _growth(history.apart)
        step = _judge(history, target, rtol)
        if isinstance(step, _Found) and (step.final or spent):
            return effort.mean(
                regime=step.regime, limit=step.limit, outcomes=step.outcomes, stretch=1, rtol=rtol,
                met=step.met, period=step.period, growth=growth,
            ), growth  # fmt: skip
        if step == "irregular" or spent:
            return rtol, growth
        if step == "tighten":
            rtol /= STRICTER
            start = Start(np.concatenate([start.rows[2:], start.rows[2:]]))
            history = _History(apart=[history.apart[-1]])


@dataclass
class _Found:
    """A regular motion's mean so far."""

    regime: Regime
    limit: float
    outcomes: Outcome
    met: bool
    final: bool
    period: int | None


def _judge(history: _History, target: float, rtol: float) -> "_Found | str":
    """What a look shows at a checkpoint: a mean, or what to do next ("go on", "tighten", "irregular")."""
    gaps = history.gaps()
    revolutions = len(gaps)
    level = target * float(objective(gaps[-1, 2:]).mean())
    seen = judging.windows(
        gaps[:, 2:], 0.25 * level
    )  # of the stricter copies: the others only test the tolerance
    history.moved[revolutions] = seen.moved
    f = objective(seen.gaps)
    loose = objective(gaps[-seen.length :, :2].mean(axis=0))
    kick = float(abs(f[0] - f[1]))
    tolerance = float(np.abs(loose - f.mean()).max())
    if seen.apart > 0.25 * level and revolutions >= PATIENCE and not seen.joining:
        return "irregular"
    settled = seen.settling + kick <= 0.5 * level and (seen.period is not None or revolutions >= 32)
    if settled and tolerance > level and rtol / STRICTER >= TIGHTEST:
        return "tighten"
    if not settled and revolutions >= 4 * CHECKPOINTS[-1] and _drifts(history, level):
        return _unsteady(history)
    limit = seen.settling + kick + 0.5 * tolerance  # of the stricter copies, an order better
    return _Found(
        Regime.REGULAR if settled else Regime.SETTLING, limit, history.window(seen.length),
        met=bool(settled and limit <= level), final=settled, period=seen.period if settled else None,
    )  # fmt: skip


def _drifts(history: _History, level: float) -> bool:
    """Whether the average moves on with every doubling of the revolutions, by more than the target."""
    revolutions = len(history.outcomes)
    moved = [
        history.moved.get(n, np.nan) for n in (revolutions // 4, revolutions // 2, revolutions)
    ]
    return bool(
        moved[2] > 0.5 * level and moved[2] > STEADY * moved[1] and moved[1] > STEADY * moved[0]
    )


def _unsteady(history: _History) -> _Found:
    whole = history.window(len(history.outcomes))
    return _Found(Regime.UNSTEADY, np.nan, whole, met=False, final=True, period=None)


# ---- an ensemble -------------------------------------------------------------------------------


@dataclass
class _Copies:
    """Stretches of all copies so far."""

    start: Start
    strictness: Array
    outcomes: list[Outcome] = field(default_factory=list)

    def gaps(self) -> Array:
        """Shape (stretches, copies, 2)."""
        return np.stack([outcome.mean_gap for outcome in self.outcomes])

    def kept(self, seen: "_Limits") -> Outcome:
        rows = np.stack([outcome.rows for outcome in self.outcomes[seen.first :]])
        return Outcome(rows if seen.pooled else rows[:, 1::2])


@dataclass
class _Limits:
    """What an ensemble says at a look: mean of f, its limit and standard error, m; what to do about it."""

    first: int  # stretch that the average begins with
    pooled: bool  # whether both tolerances count, or the stricter alone
    f: float
    limit: float
    bias: float  # between the tolerances, m
    doubt: float  # its standard error
    regime: Regime
    moved: float  # by the average, over the latest quarter, m; 0 where it does not drift
    settling: float  # how far it still may move
    copies_count: bool  # more copies help, more revolutions do not

    def biased(self, least: float) -> bool:
        """Whether the tolerances differ by more than chance and than so much, m."""
        return abs(self.bias) > max(judging.DRIFT * self.doubt, least)


def _ensemble(
    effort: Effort, target: float, rtol: float, growth: float
) -> Generator[Stretch, Outcome, Mean]:
    """Go on with copies from kicked starts until the limits of their mean are narrow enough, or the budget is spent."""
    copies = _new_copies(effort.sample, range(COPIES))
    stretches, moved, restless = FIRST, 0.0, 0
    while True:
        yield from _extend(effort, copies, rtol, stretches)
        if effort.failed is not None:
            return effort.failure(copies.outcomes[-1], rtol)
        seen = _limits(copies)
        level = target * seen.f
        spent = effort.revolutions >= effort.budget
        if seen.biased(0.25 * level) and rtol / STRICTER >= TIGHTEST and not spent:
            # the looser tolerance is off: begin anew where the stricter copies are
            rtol, copies = rtol / STRICTER, _stricter(copies)
            stretches, moved, restless = FIRST, 0.0, 0
            continue
        drifting = seen.settling > 0.5 * level
        restless = restless + 1 if drifting and seen.moved > STEADY * moved else 0
        moved = seen.moved
        early = seen.copies_count and len(copies.outcomes) < LASTING
        met = seen.limit + seen.settling <= level and not early
        unsteady = restless >= RESTLESS
        if unsteady or spent or met:
            regime = Regime.UNSTEADY if unsteady else Regime.SETTLING if drifting else seen.regime
            limit = seen.limit + seen.settling
            return effort.mean(
                regime=regime, limit=np.nan if unsteady or np.isinf(limit) else limit,
                outcomes=copies.kept(seen), stretch=STRETCH, rtol=rtol, met=bool(met and not unsteady),
                growth=growth,
            )  # fmt: skip
        if drifting or early:
            stretches = max(len(copies.outcomes), LASTING - len(copies.outcomes))
        else:
            stretches = yield from _more(effort, copies, rtol, seen, level - seen.settling)


def _new_copies(sample: Sample, numbers: range) -> _Copies:
    strictness = np.where(np.arange(len(numbers)) % 2 == 0, 1.0, STRICTER)
    return _Copies(kicked(sample.start, sample.scale, numbers), strictness)


def _stricter(copies: _Copies) -> _Copies:
    """Two copies, one at each tolerance, from where each of the stricter ones is."""
    return _Copies(Start(np.repeat(copies.start[1::2].rows, 2, axis=0)), copies.strictness)


def _extend(
    effort: Effort, copies: _Copies, rtol: float, stretches: int
) -> Generator[Stretch, Outcome, None]:
    for _ in range(stretches):
        outcome = yield from effort.run(rtol, STRETCH, copies.start, copies.strictness)
        copies.outcomes.append(outcome)
        copies.start = outcome.end()
        if effort.failed is not None or effort.revolutions >= effort.budget:
            return


def _more(
    effort: Effort, copies: _Copies, rtol: float, seen: _Limits, level: float
) -> Generator[Stretch, Outcome, int]:
    """Add copies where their orbits differ for good; how many further stretches to ask for."""
    used, total = len(copies.outcomes) - seen.first, len(copies.outcomes)
    missing = min((seen.limit / max(level, 1e-300)) ** 2, 1e6)
    count = len(copies.start)
    left = max(effort.budget - effort.revolutions, 0)
    if seen.copies_count:
        wanted = min(int(count * (1.1 * missing - 1.0)), 3 * count, left // (STRETCH * total))
        wanted = max(wanted - wanted % 2, 2)
        new = _new_copies(effort.sample, range(count, count + wanted))
        yield from _extend(effort, new, rtol, total)
        if len(new.outcomes) == total:
            _join(copies, new)
        return 0
    affordable = -(-left // (STRETCH * count))
    wanted = int(np.ceil(used * (1.1 * missing - 1.0)))
    return int(np.clip(wanted, 1, min(3 * total, max(affordable, 1))))


def _join(copies: _Copies, new: _Copies) -> None:
    """Take new copies in, which have gone as far."""
    copies.start = Start(np.concatenate([copies.start.rows, new.start.rows]))
    copies.strictness = np.concatenate([copies.strictness, new.strictness])
    copies.outcomes = [
        Outcome(np.concatenate([a.rows, b.rows]))
        for a, b in zip(copies.outcomes, new.outcomes, strict=True)
    ]


def _limits(copies: _Copies) -> _Limits:
    gaps = copies.gaps()
    y = judging.projected(gaps)  # (stretches, copies)
    total = len(y)
    between = y.var(axis=1, ddof=1)
    first = max(judging.spin_up(y.mean(axis=1)), min(judging.parted(between), total // 2), 1)
    first = min(first, total - 1)  # the budget may end at once
    kept = y[first:]
    loose, strict = (kept[:, k::2].mean(axis=0) for k in (0, 1))
    doubt = float(
        np.hypot(*(np.std(part, ddof=1) / np.sqrt(len(part)) for part in (loose, strict)))
    )
    bias = float(loose.mean() - strict.mean())
    pooled = abs(bias) <= POOLED * doubt
    if not pooled:
        kept, between = kept[:, 1::2], y[:, 1::2].var(axis=1, ddof=1)
    mean, _, limit = judging.student(kept.mean(axis=0))
    within = float(kept.var(axis=0, ddof=1).mean()) if len(kept) > 1 else np.nan
    apart = float(kept.mean(axis=0).var(ddof=1))
    coherent = len(kept) >= 4 and float(between[first:].mean()) < 0.3 * float(within)
    if coherent:  # copies have not parted: their mean scatters in time like one of them
        limit = judging.student(kept.mean(axis=1))[2]
    moved, settling = judging.approach(kept) if len(kept) >= 4 else (0.0, np.inf)
    several = bool(len(kept) > 1 and apart > 4.0 * within / len(kept))
    regime = Regime.SEVERAL if several else Regime.CHAOTIC
    if coherent or max(apart, within if np.isfinite(within) else 0.0) < (1e-5 * mean) ** 2:
        regime = Regime.REGULAR
        limit += 0.5 * abs(bias)  # nothing else shows what tolerances do
    return _Limits(first, pooled, mean, limit, bias, doubt, regime, moved, settling, several)

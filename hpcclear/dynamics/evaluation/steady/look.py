"""A look at a design: four copies, revolution by revolution. A regular motion's mean, or word that it is irregular."""

from collections.abc import Generator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.outcome import Regime
from hpcclear.dynamics.evaluation.steady import effort as given, judging
from hpcclear.dynamics.evaluation.steady.copies import PERTURBATION, perturbed, separation
from hpcclear.dynamics.evaluation.steady.effort import Effort, Mean, Sample, Segment
from hpcclear.dynamics.evaluation.steady.judging import objective
from hpcclear.dynamics.layout.views import Outcome

SHARE = 0.1
"""First guess of rtol over the target error: on 200 random scenes of the paper's box (Hunt-Crossley, 0.5 s/m) the error of
f was below 10 rtol in 95 % for rtol from 5e-4 to 3e-5, and below 6 rtol at 1e-5."""

LOOSEST = 1e-3  # tolerance that a look starts with at most

SHARE_LATCHED = 1e-3
"""`SHARE` with such a damping: a tolerance moves a motion to another orbit, and at a looser one the four copies of a look can
agree on orbits that are off by 0.04 to 0.6 %."""

CHECKPOINTS = (4, 6, 8, 12, 16, 24, 32, 48, 64)
"""Revolutions after which a look is judged; from then on at each doubling."""

PATIENCE = 16  # revolutions that copies have for coming together

SWINGS = 2.0
"""What an average may still be off by, over the larger of its two latest movements: an approach that swings, or slows down
as a slower one takes over, comes to a rest for a quarter and goes on. Intervals from the last movement alone missed by
up to nine times their width."""

TOLERANCES = 10.0  # likewise, over the tolerance of the stricter copies, where these and the looser ones agree by chance

ORBITS, COARSE = 6e-3, 3e-3
"""Likewise, relative, with a damping that keeps the impact speed, where the target is no stricter than the second: at the
tolerances that serve it all copies may be caught by one orbit of several. Of 40 such scenes four had means that were off by
0.1 to 0.6 % so. As with irregular motions, what is unseen widens stated intervals as far as the target allows and buys no
revolution."""


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


def _is_checkpoint(revolutions: int) -> bool:
    last = CHECKPOINTS[-1]
    doubled = revolutions > last and revolutions % last == 0
    return revolutions in CHECKPOINTS or (doubled and (revolutions // last).bit_count() == 1)


def _growth(apart: list[float]) -> float:
    """Lyapunov exponent per revolution, until copies are as far apart as at the end."""
    distance = np.array(apart)
    far = judging.parted(distance) or len(distance) - 1
    with np.errstate(divide="ignore"):
        return float(np.log(distance[far] / distance[0]) / far)


def look(effort: Effort, target: float) -> Generator[Segment, Outcome, tuple[Mean | float, float]]:
    """Four copies, revolution by revolution: a regular motion's mean, or the tolerance at which it turned out irregular."""
    sample = effort.sample
    rtol = min((SHARE_LATCHED if sample.latched else SHARE) * target, LOOSEST)
    strictness = np.array([1.0, 1.0, given.STRICTER, given.STRICTER])
    start = perturbed(sample.start, sample.scale, range(2))[[0, 1, 0, 1]]
    history = _History(apart=[PERTURBATION])
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
        step = _judge(history, sample, target, rtol)
        if isinstance(step, dict) and (spent or step["regime"] is not Regime.SETTLING):
            return effort.mean(**step, segment=1, rtol=rtol, growth=growth), growth
        if step == "irregular" or spent:
            return rtol, growth
        if step == "tighten":
            rtol /= given.STRICTER
            start = start[[2, 3, 2, 3]]
            history = _History(apart=[history.apart[-1]])


def _judge(history: _History, sample: Sample, target: float, rtol: float) -> dict[str, Any] | str:
    """What a look shows at a checkpoint: what is known of a regular motion's `Mean`, or what to do next ("tighten",
    "irregular")."""
    gaps = np.stack([outcome.mean_gap for outcome in history.outcomes])
    revolutions = len(gaps)
    level = target * float(objective(gaps[-1, 2:]).mean())
    # of the stricter copies: the others only test the tolerance
    seen = judging.windows(gaps[:, 2:], 0.25 * level)
    history.moved[revolutions] = seen.moved
    f = objective(seen.gaps)
    loose = objective(gaps[-seen.length :, :2].mean(axis=0))
    perturbation = float(abs(f[0] - f[1]))
    tolerance = float(np.abs(loose - f.mean()).max())
    if seen.apart > 0.25 * level and revolutions >= PATIENCE and not seen.joining:
        return "irregular"
    settling = max(seen.settling, _of_speed(sample.speeds(history.outcomes), 0.5 * level, f.mean()))
    long = seen.period is not None or revolutions >= 32
    settled = settling + perturbation <= 0.5 * level and long
    if settled and tolerance > level and rtol / given.STRICTER >= given.TIGHTEST:
        return "tighten"
    if not settled and revolutions >= 4 * CHECKPOINTS[-1] and _drifts(history, level):
        whole = history.window(revolutions)
        return {"regime": Regime.UNSTEADY, "limit": np.nan, "outcomes": whole, "met": False}
    limit = settling + perturbation + 0.5 * tolerance  # of the stricter copies, an order better
    outcomes = history.window(seen.length)
    # as it is reported with its half-width
    mean = float(objective(outcomes.mean_gap.mean(axis=(0, 1))))
    met = bool(settled and limit <= target * mean)
    orbits = ORBITS if sample.latched and target >= COARSE else 0.0
    # what neither its approach nor its copies show
    unseen = max(SWINGS * seen.restless, max(TOLERANCES * rtol / given.STRICTER, orbits) * mean)
    half_width = max(limit, min(float(np.hypot(limit, unseen)), target * mean if met else np.inf))
    found = {"limit": half_width, "outcomes": outcomes, "met": met}
    if not settled:
        return {"regime": Regime.SETTLING, **found}
    return {"regime": Regime.REGULAR, "period": seen.period, **found}


def _of_speed(speeds: Array | None, level: float, f: float) -> float:
    """How far f still moves with the mean speed of a free crank, m, from speeds (revolutions, copies)."""
    if speeds is None:
        return 0.0
    return given.SPEED * f * judging.speed_settling(speeds, level / (given.SPEED * f))


def _drifts(history: _History, level: float) -> bool:
    """Whether the average moves on with every doubling of the revolutions, by more than the target."""
    revolutions = len(history.outcomes)
    ends = (revolutions // 4, revolutions // 2, revolutions)
    first, second, last = (history.moved.get(n, np.nan) for n in ends)
    grows = last > given.STEADY * second and second > given.STEADY * first
    return bool(last > 0.5 * level and grows)

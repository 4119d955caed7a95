"""One cell of a map: kind of motion, Lyapunov exponent, number of different motions that several starts reach."""

from collections.abc import Generator

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.outcome import Regime
from hpcclear.dynamics.evaluation.steady import judging
from hpcclear.dynamics.evaluation.steady.copies import perturbed
from hpcclear.dynamics.evaluation.steady.effort import Effort, Mean, Sample, Segment
from hpcclear.dynamics.evaluation.steady.judging import objective
from hpcclear.dynamics.layout.views import Outcome, Parameters, Start
from hpcclear.dynamics.planar.tolerances import LENGTH

RTOL = 1e-8  # tolerance of a map. The exponent of the paper's scene is -0.32 at 1e-11; this finds -0.31.

DISTANCE = 1e-4
"""Of a shadow from its copy, over scale. Less, and the steps of the two, which are not the same, part them by more than the
motion does (at 1e-6 it finds 2.2 where -0.32 is right); more, and it is not small beside a penetration."""

OWN, OTHER = 4, 4  # copies of the scene's own start, each with a shadow; and other starts

FAR = 0.2
"""Perturbation of the other starts over the smallest clearance (velocities: over as many m/s as mm); journals stay inside."""

SPIN_UP = 20
LOOKS = (20, 40, 80)
"""Revolutions after the spin-up at which the exponent is judged; the last one ends it."""

SURE = 0.1
"""Limit of an exponent that is narrow enough, over the exponent or a revolution, whichever is more: half of it takes four times
the revolutions of a chaotic cell."""

SAME = 1e-4  # relative difference of f between two starts that end in the same motion

REPEATS = 1e-5  # relative difference of f between two revolutions of a periodic motion that are a period apart


def mapped(sample: Sample, sure: float = SURE) -> Generator[Segment, Outcome, Mean]:
    """Judge the motion of one cell; `sure` as `SURE`. The growth of its `Mean` is the exponent.

    The other starts end with the first look at the exponent: by then they show where they end.

    Largest Lyapunov exponent per revolution: the mean logarithm by which the distance of a shadow grows over a revolution,
    after which it is set back along the same direction (Benettin et al. 1980, doi:10.1007/BF02128236).
    """
    effort = Effort(sample, budget=0)
    start = _starts(sample)
    shadow: Start | None = None
    logs: list[Array] = []
    outcomes: list[Outcome] = []
    others: list[Outcome] = []
    for revolution in range(1, SPIN_UP + LOOKS[-1] + 1):
        copies = len(start)
        rows = start.rows if shadow is None else np.concatenate([start.rows, shadow.rows])
        outcome = yield from effort.run(RTOL, 1, Start(rows), np.ones(len(rows)))
        if effort.failed is not None:
            return effort.failure(outcome, RTOL)
        end = outcome.end()
        start = end[:copies]
        if shadow is not None:
            outcomes.append(outcome[:OWN])
            if copies > OWN:
                others.append(outcome[OWN:copies])
            grown, shadow = _set_back(start[:OWN], end[copies:], sample.scale)
            logs.append(grown)
        elif revolution == SPIN_UP:
            shadow = _shadows(start[:OWN], sample.scale)
        if len(logs) in LOOKS:
            # of logarithms (revolutions, copies), in four segments of each copy
            pieces = [piece.mean(axis=0) for piece in np.array_split(np.array(logs), 4)]
            growth, limit = judging.with_limit(np.concatenate(pieces))
            start = start[:OWN]
            if limit <= sure * max(abs(growth), 1.0) or len(logs) == LOOKS[-1]:
                break
    return _judged(effort, outcomes, others, growth, limit)


def _starts(sample: Sample) -> Start:
    clearance = Parameters(sample.par).clearance
    far = FAR * float(clearance[clearance > 0.0].min()) / LENGTH
    own = perturbed(sample.start, sample.scale, range(OWN))
    other = perturbed(sample.start, sample.scale, range(OWN, OWN + OTHER), far)
    return Start(np.concatenate([own.rows, other.rows]))


def _shadows(start: Start, scale: Array) -> Start:
    """A copy beside each start, `DISTANCE` away."""
    each = ((start[k : k + 1], range(k + 1, k + 2)) for k in range(len(start)))
    beside = [perturbed(one, scale, number, DISTANCE) for one, number in each]
    return Start(np.concatenate([one.rows for one in beside]))


def _set_back(start: Start, shadow: Start, scale: Array) -> tuple[Array, Start]:
    """Logarithms of the growth of the distances (copies,), and shadows set back to where distances are as at first.

    A contact that only one of the two is in has no distance: the shadow takes the other's.
    """
    n = len(scale) // 2
    apart = (shadow.state(n) - start.state(n)) / scale
    distance = np.sqrt(np.mean(apart**2, axis=1))
    factor = DISTANCE / np.maximum(distance, 1e-300)
    back = Start(start.rows.copy())
    moved = apart * factor[:, None] * scale
    back.coordinates(n)[:] += moved[:, :n]
    back.velocities(n)[:] += moved[:, n:]
    alike = (shadow.active == start.active).all(axis=1)
    inverse = (shadow.inverse_impact - start.inverse_impact) * (factor * alike)[:, None]
    back.inverse_impact = start.inverse_impact + inverse
    return np.log(np.maximum(distance, 1e-300) / DISTANCE), back


def _judged(
    effort: Effort, outcomes: list[Outcome], others: list[Outcome], growth: float, doubt: float
) -> Mean:
    own = np.stack([outcome.mean_gap for outcome in outcomes])  # (revolutions, copies, 2)
    f = objective(own)
    mean = float(objective(own.mean(axis=(0, 1))))
    period = judging.period_of(f, REPEATS * mean)
    means, scatter = _averages(own)
    _, limit = judging.with_limit(means)
    several = bool(np.ptp(means) > 2.0 * SAME * mean + 6.0 * scatter.max())
    chaotic = growth > doubt and period is None
    regime = Regime.CHAOTIC if chaotic else Regime.SEVERAL if several else Regime.REGULAR
    further = _averages(np.stack([outcome.mean_gap for outcome in others]))
    every, doubts = (np.concatenate([means, further[0]]), np.concatenate([scatter, further[1]]))
    kinds = _kinds(every, doubts, mean)
    kept = Outcome(np.stack([outcome.rows for outcome in outcomes]))
    return effort.mean(
        regime=regime, limit=limit, outcomes=kept, segment=1, rtol=RTOL, met=True, period=period, growth=growth,
        growth_limit=doubt, attractors=kinds,
    )  # fmt: skip


def _averages(gaps: Array) -> tuple[Array, Array]:
    """f and its standard error of each copy, shape (copies,), from mean gaps (revolutions, copies, 2)."""
    scatter = objective(gaps).std(axis=0, ddof=1) / np.sqrt(len(gaps))
    return objective(gaps.mean(axis=0)), scatter


def _kinds(means: Array, scatter: Array, f: float) -> int:
    """How many kinds of motion the starts ended in: those whose averages differ by more than they scatter."""
    order = np.argsort(means)
    steps = np.diff(means[order])
    doubt = 4.0 * (scatter[order][1:] + scatter[order][:-1]) + SAME * f
    return 1 + int(np.count_nonzero(steps > doubt))

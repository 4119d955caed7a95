"""Error of a steady mean against time, with a tolerance and revolutions as the two ways to spend.

A mean over N revolutions at a tolerance is off by error^2 = bias(rtol)^2 + variance / N: the first buys a tighter tolerance
off, the second revolutions (Oliver et al. 2014, doi:10.1063/1.4866813). It costs (N + spin-up) revolutions of that
tolerance, which makes of every error a cheapest pair (Frontin and Darmofal 2022, arXiv:2210.07939). Perturbed replicas run at
every tolerance of a ladder; their means, cut short, are measured against the mean of all that agree, and the formula
against that.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from hpcclear.accuracy.averaging import doubling
from hpcclear.accuracy.methods import one_turn
from hpcclear.accuracy.profile import Variables
from hpcclear.base.arrays import Array
from hpcclear.base.outcome import MAX_JOINTS
from hpcclear.dynamics.evaluation.evaluator import DEFAULT_LANES
from hpcclear.dynamics.evaluation.steady import judging
from hpcclear.dynamics.evaluation.steady.copies import perturbed, scales
from hpcclear.dynamics.evaluation.steady.ensemble import POOLED
from hpcclear.dynamics.evaluation.steady.judging import objective
from hpcclear.dynamics.layout.views import Start
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.problem import problem_of
from hpcclear.dynamics.setup.start import start_states
from hpcclear.dynamics.stepping.lanes import Lanes
from hpcclear.scene import Scene

TOLERANCES = tuple(10.0**-k for k in range(3, 9))
COPIES = 32
"""At each tolerance: as many as lanes, each with a spin-up of its own."""

SEGMENT = 10
"""Revolutions at a time."""

FIRST = 8
"""Segments of all copies after which there is something to show; they are doubled from there."""

AIMS = (0.1, 0.03, 0.01, 0.003, 0.001)
"""Relative standard errors whose cheapest price is reported."""


@dataclass(frozen=True)
class Run:
    """Copies at every tolerance, and what they did so far."""

    gaps: Array
    """Shape (intervals, r, copies, joints)."""
    seconds: Array
    """Shape (r,): processor time so far."""
    start: Array
    """Shape (r, copies, Start.size): where they go on from."""

    @classmethod
    def of(cls, scene: Scene) -> "Run":
        """Nothing simulated yet: every copy of every tolerance has a perturbation of its own."""
        here = one_turn(scene)
        par = parameters(here)
        first, scale = start_states(here, par), scales(here, par[0])
        count = len(TOLERANCES)
        numbers = (range(k, k + COPIES) for k in range(1, count * COPIES, COPIES))
        starts = [perturbed(first, scale, own).rows for own in numbers]
        nothing = np.empty((0, count, COPIES, MAX_JOINTS))
        return cls(nothing, np.zeros(count), np.stack(starts))


def measure(
    scene: Scene, run: Run, segments: int, check: Callable[[], object] = lambda: None
) -> Iterator[Run]:
    """Go on until there are so many intervals of every copy; yields at every doubling.

    `check` is called between intervals, to raise what ends it. A copy that fails is NaN from there.
    """
    here = one_turn(scene)
    par = np.repeat(parameters(here), COPIES, axis=0)
    lanes = [_lanes(here, rtol) for rtol in TOLERANCES]
    while len(run.gaps) < segments:
        until = min(max(FIRST, 2 * len(run.gaps)), segments)
        gaps, seconds, start = list(run.gaps), run.seconds.copy(), run.start.copy()
        while len(gaps) < until:
            gaps.append(np.empty(run.gaps.shape[1:]))
            for k, one in enumerate(lanes):
                check()
                began = time.process_time()
                outcome = one.run(par, Start(start[k]))
                seconds[k] += time.process_time() - began
                gaps[-1][k] = np.where((outcome.status == 0)[:, None], outcome.mean_gap, np.nan)
                start[k] = outcome.end().rows
        run = Run(np.stack(gaps), seconds, start)
        yield run


def _lanes(scene: Scene, rtol: float) -> Lanes:
    changes = {"rtol": rtol, "atol": None, "averaged_revolutions": SEGMENT}
    here = scene.with_({f"numerics.{name}": value for name, value in changes.items()})
    lanes = Lanes(problem_of(here), DEFAULT_LANES)
    lanes.step(1)  # without samples it only compiles
    return lanes


def analyse(run: Run) -> Variables:
    """The panel of what was simulated so far; copies that failed are left out.

    `spent_error` is measured over disjoint means of so many revolutions, NaN where there are fewer than four; `spent_model` is
    by the formula. Biases are against the mean of the tightest tolerances that agree, NaN where they are that mean.
    """
    kept = [one[:, np.isfinite(one).all(axis=(0, 2))] for one in np.moveaxis(run.gaps, 1, 0)]
    spin_up = int(np.median([_spin_up(gaps) for gaps in kept]))
    kept = [gaps[spin_up:] for gaps in kept]
    means = [objective(gaps.mean(axis=0)) for gaps in kept]  # (copies,) each
    mean = np.array([np.mean(one) for one in means])
    errors = (np.var(one, ddof=1) / len(one) if len(one) > 2 else np.nan for one in means)
    square = np.array([*errors])
    truth, pool = _truth(mean, square)
    share = np.zeros(len(mean))
    share[pool:] = 1.0 / (len(mean) - pool)
    of_truth = float((share**2 * square).sum())
    bias_error = np.sqrt(np.maximum(square * (1.0 - 2.0 * share) + of_truth, 0.0)) / truth
    alone = share == 1.0
    bias = np.where(alone, np.nan, mean / truth - 1.0)
    bias_error = np.where(alone, np.nan, bias_error)
    turns = np.array([SEGMENT * gaps.shape[0] * gaps.shape[1] for gaps in kept])
    variance = square * turns / truth**2
    spent = doubling(int(turns.min()) // (4 * SEGMENT), start=1) * SEGMENT
    error = np.array([[_error(gaps, int(n) // SEGMENT, truth) for n in spent] for gaps in kept])
    model = np.sqrt(_known_bias(bias, bias_error)[:, None] ** 2 + variance[:, None] / spent)
    done = SEGMENT * COPIES * len(run.gaps)
    price, waited = run.seconds / done, float(SEGMENT * spin_up)
    found = {
        "tolerance": np.array(TOLERANCES),
        "spent": spent,
        "aim": np.array(AIMS),
        "spent_error": error,
        "spent_model": model,
        "spent_seconds": price[:, None] * (spent + COPIES * waited),
        "tolerance_bias": bias,
        "tolerance_bias_error": bias_error,
        "turn_variance": variance,
        "tolerance_seconds": price,
        "spin_up": np.array(waited),
    }
    names = ("cheapest_tolerance", "cheapest_revolutions", "cheapest_seconds")
    ways = np.array([cheapest(found, aim) for aim in AIMS]).T
    return {**found, **dict(zip(names, ways, strict=True))}


def cheapest(found: Variables, aim: float) -> tuple[float, float, float]:
    """Tolerance, revolutions and seconds that reach a relative standard error at the least cost by the formula.

    NaN where no tolerance is known to be off by less than the aim.
    """
    off, doubt = found["tolerance_bias"], found["tolerance_bias_error"]
    bias = _known_bias(off, doubt)
    doubtful = np.nan_to_num(np.abs(off)) + 2.0 * np.nan_to_num(doubt) > aim
    left = np.where((bias < aim) & ~doubtful, aim**2 - bias**2, np.nan)
    spent = np.maximum(found["turn_variance"] / left, 1.0)
    price = found["tolerance_seconds"] * (spent + COPIES * found["spin_up"])
    if np.isnan(price).all():
        return np.nan, np.nan, np.nan
    best = int(np.nanargmin(price))
    return float(found["tolerance"][best]), float(np.ceil(spent[best])), float(price[best])


def _spin_up(gaps: Array) -> int:
    """Intervals (intervals, copies, joints) to leave out: until copies have parted and their mean has settled, half at most."""
    if gaps.shape[1] < 3:
        return 0
    y = judging.projected(gaps)
    parted = min(judging.parted(y.var(axis=1, ddof=1)), len(y) // 2)
    return max(judging.spin_up(y.mean(axis=1)), parted, 1)


def _truth(mean: Array, square: Array) -> tuple[float, int]:
    """Mean of the tightest tolerances that agree, and the first of them."""
    pool = len(mean) - 1
    while pool > 0:
        inside = mean[pool:]
        doubt = np.sqrt(square[pool - 1] + square[pool:].mean() / len(inside))
        if not abs(mean[pool - 1] - inside.mean()) <= POOLED * doubt:
            break
        pool -= 1
    return float(mean[pool:].mean()), pool


def _known_bias(bias: Array, error: Array) -> Array:
    """Its size without what chance adds to it."""
    return np.sqrt(np.maximum(np.nan_to_num(bias) ** 2 - np.nan_to_num(error) ** 2, 0.0))


def _error(gaps: Array, segments: int, truth: float) -> float:
    """Relative error of means of so many intervals, from gaps (intervals, copies, joints): of one copy or of several."""
    length, copies = gaps.shape[:2]
    together = -(-segments // length)  # copies in a mean
    long = segments // together
    groups, pieces = copies // together, length // long
    if groups * pieces < 4:
        return np.nan
    used = gaps[: pieces * long, : groups * together]
    parts = used.reshape(pieces, long, groups, together, -1).mean(axis=(1, 3))
    return float(np.sqrt(np.mean((objective(parts) / truth - 1.0) ** 2)))

"""Objectives and constraints of a case: values with confidence intervals from simulations, or surrogate predictions."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np
from scipy.special import ndtr

from hpcclear.base.arrays import Array
from hpcclear.scene import Scene
from hpcclear.scene.cases import Case, Constraint, Goal
from hpcclear.scene.domain import to_physical
from hpcclear.scene.stages import MomentAccuracy
from hpcclear.scene.study import Study
from hpcclear.statistics.random import replicates, tail
from hpcclear.statistics.random.replicates import Limited

SMOOTH = 0.1
"""Standard deviations over which an exceedance is smoothed in the search on the surrogate, so that it has a slope near 0."""

SHARE_OF_MOST = 0.02
"""Half-width of a probability, over the largest that is allowed, at which it is known well enough though not decided."""


def goal_value(
    goal: Goal, values: Array, design: Mapping[str, float], confidence: float
) -> Limited:
    """An objective or constraint from values of f, (replicates, values), NaN where failed, and the design in SI; or from
    those of all responses, (k, replicates, values)."""
    values = values[goal.place] if values.ndim == 3 else values
    if goal.exact:
        value = float(goal.of_design(design))
        return Limited(value, np.zeros(len(values)), value, value)
    if goal.statistic == "quantile":
        return replicates.quantile(values, goal.order, confidence)
    if goal.statistic == "exceedance":
        assert goal.limit is not None  # by validation
        return replicates.exceedance(values, goal.limit, confidence)
    one = replicates.moments(values)[goal.statistic != "mean"]
    return Limited(one.value, one.shifts, *replicates.limits(one, confidence))


def wanted(goal: Goal, accuracy: MomentAccuracy) -> tuple[float, bool]:
    """Half-width of its confidence interval that is requested, and whether it is relative; a formula is known."""
    if goal.statistic == "mean":
        return accuracy.mean, True
    if goal.statistic == "deviation":
        return accuracy.deviation, True
    if goal.statistic == "quantile":
        return accuracy.quantile or accuracy.deviation, True
    if goal.statistic == "exceedance":
        usual = SHARE_OF_MOST * goal.most if isinstance(goal, Constraint) else 0.01
        return accuracy.exceedance or usual, False
    return 1e-6, True


def accurate(goal: Goal, one: Limited, accuracy: MomentAccuracy, part: float = 1.0) -> bool:
    """Whether its interval is as narrow as requested, or as a part of that."""
    share, relative = wanted(goal, accuracy)
    size = abs(one.value) if relative else 1.0
    return bool((one.upper - one.lower) / 2.0 <= share * part * size)


def excess(kept: Sequence[Constraint], values: Array, further: Array | float = 0.0) -> Array:
    """By how much constraints are broken, relative to their thresholds, the worst of them; (n, constraints) to (n,).

    At most 0 where all are kept, NaN where one is not known, -inf without any. `further` is added, (n, constraints): of
    `beyond`, since probabilities of 1 are all alike.
    """
    if not kept:
        return np.full(len(values), -np.inf)
    most = np.array([one.most for one in kept])
    broken = (values - most) / np.where(most != 0.0, abs(most), 1.0)
    return np.asarray((broken + further).max(axis=1))


def shortfall(goal: Goal, most: float, values: Array) -> Array:
    """By how much reliability indices of probabilities of failure fall short of what a constraint needs, f (n, s) to (n,);
    where all values fail, how far they lie beyond the limit counts."""
    assert goal.limit is not None  # by validation
    index = np.maximum(tail.index(values, goal.limit), -tail.ALL)
    return np.asarray(tail.of_share(most) - index + tail.beyond(values, goal.limit))


def beyond(goal: Goal, values: Array) -> float:
    """How far even the lowest values of f (k, replicates, n), NaN where failed, lie above the limit of a probability, over the
    limit; 0 of other constraints and of too few values."""
    if goal.statistic != "exceedance":
        return 0.0
    assert goal.limit is not None  # by validation
    own = values[goal.place] if values.ndim == 3 else values
    known = own[np.isfinite(own)]
    if len(known) < replicates.FEWEST:
        return 0.0
    return float(tail.beyond(known[None], goal.limit)[0])


def guessed(goal: Goal, drawn: Array, designs: Mapping[str, Array]) -> Array:
    """An objective or constraint by the surrogate, (n,): f at draws of the random inputs (n, s), design variables (n,) each."""
    if goal.exact:
        return np.broadcast_to(goal.of_design(designs), len(drawn))
    if goal.statistic == "mean":
        return np.asarray(drawn.mean(axis=1))
    if goal.statistic == "deviation":
        return np.asarray(drawn.std(axis=1))
    if goal.statistic == "quantile":
        return np.asarray(np.quantile(drawn, goal.order, axis=1, method="hazen"))
    assert goal.limit is not None  # by validation
    width = SMOOTH * drawn.std(axis=1, keepdims=True) + 1e-300
    return np.asarray(ndtr((drawn - goal.limit) / width).mean(axis=1))


def exact_in(scene: Scene, case: Case) -> list[Callable[[Array], Array] | None]:
    """Of each that a case makes small, sampling coordinates (n, d) to its values (n,) if it is exact, else None."""
    names = scene.required_study.design_variables(case.name)

    def exact(goal: Goal, points: Array) -> Array:
        designs = dict(zip(names, to_physical(scene, names, points).T, strict=True))
        return np.array(np.broadcast_to(goal.of_design(designs), len(points)))

    return [partial(exact, goal) if goal.exact else None for goal in case.goals]


def ends_in_all(study: Study) -> int:
    """How many ends the fronts of all cases have: one for each thing that a case makes small."""
    return sum(len(case.goals) for case in study.cases)


def most_of(cases: Sequence[Case]) -> int:
    """How many things a case makes small at most."""
    return max(len(case.goals) for case in cases)

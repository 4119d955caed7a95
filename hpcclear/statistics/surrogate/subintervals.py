"""Surrogates fitted box by box, until each is accepted or a limit is reached.

A box is accepted by R2 and RMAE on test points of its own; a refused one gets more training points,
then is cut in half across the input that varies fastest, down to a stated depth.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from hpcclear.statistics.surrogate.fitting import KrigingMethod
from hpcclear.statistics.surrogate.metrics import accuracy
from hpcclear.statistics.surrogate.piecewise import Leaf, Piecewise
from hpcclear.statistics.surrogate.regression import RegressionMethod
from hpcclear.statistics.surrogate.response_surface import Evaluate, latin_hypercube

Method = KrigingMethod | RegressionMethod
"""A kind of surrogate with its settings: it is fitted, and restored from stored arrays."""


@dataclass(eq=False)
class _Box:
    """A subinterval on its way to a model."""

    bounds: np.ndarray
    rng: np.random.Generator
    points: np.ndarray
    values: np.ndarray
    tests: np.ndarray
    truths: np.ndarray
    depth: int = 0
    resampled: int = 0
    wanted: list[np.ndarray] = field(default_factory=list)  # training and test points to evaluate


@dataclass(frozen=True)
class SubintervalSettings:
    """When a box is accepted, and what is done until it is."""

    samples: int = 200  # training points of a box
    test_samples: int = 100
    r2_min: float = 0.99  # a box is accepted with at least this on its test points
    rmae_max: float = 0.3  # and at most this
    max_resamples: int = 1  # how often a refused box gets `samples` further points before it is cut
    max_depth: int = 3  # how often it may be cut in half; refused there it stays, not accepted


def fit_subintervals(
    evaluate: Evaluate,
    bounds: np.ndarray,
    settings: SubintervalSettings,
    *,
    rng: np.random.Generator,
    names: Sequence[str] | None = None,
    method: Method,
    snap: Callable[[np.ndarray], np.ndarray] = np.asarray,
) -> Piecewise:
    """Fit models on subintervals of the domain `bounds` (d, 2) until each is accepted or a limit is reached.

    Boxes of one generation are evaluated in a single call, so that many ranks can share it.

    `evaluate`: the true function, points (n, d) to values (n,), NaN where it failed; `rng`: points in a box come from a stream
    of its own, spawned from this one; `method`: what is fitted; `snap`: points (n, d) to the nearest that exist. Raises
    InputError as the method's fit and `accuracy`: crossed bounds, or a box whose samples (nearly) all failed.
    """
    domain = np.asarray(bounds, dtype=np.float64)
    counts = settings.samples, settings.test_samples
    nothing = np.empty((0, len(domain))), np.empty(0)
    whole = _Box(domain, rng.spawn(1)[0], *nothing, *nothing)
    whole.wanted = [snap(latin_hypercube(n, domain, whole.rng)) for n in counts]
    pending, done = [whole], list[tuple[Leaf, bool]]()
    while pending:
        _evaluate_wanted(evaluate, pending)
        following: list[_Box] = []
        for box in pending:
            model = method.fit(box.points, box.values, box.bounds, rng=box.rng, names=names)
            reached = accuracy(box.truths, model.predict(box.tests))
            accepted = reached.meets(settings.r2_min, settings.rmae_max)
            if not accepted and box.resampled < settings.max_resamples:
                box.resampled += 1
                fresh = latin_hypercube(settings.samples, box.bounds, box.rng)
                box.wanted = [snap(fresh), box.tests[:0]]
                following.append(box)
            elif not accepted and box.depth < settings.max_depth:
                for half in _halves(box, model.steepest()):
                    half.wanted = [snap(latin_hypercube(n, half.bounds, half.rng)) for n in counts]
                    following.append(half)
            else:
                done.append((model, accepted))
        pending = following
    done.sort(key=lambda one: tuple(one[0].lower))
    models, good = zip(*done, strict=True)
    return Piecewise(models, np.array(good))


def _evaluate_wanted(evaluate: Evaluate, boxes: list[_Box]) -> None:
    """Evaluate what all boxes want in one call and add it to them."""
    batches = [batch for box in boxes for batch in box.wanted]
    values = np.asarray(evaluate(np.concatenate(batches)), dtype=np.float64)
    parts = iter(np.split(values, np.cumsum([len(batch) for batch in batches])[:-1]))
    for box in boxes:
        points, tests = box.wanted
        box.points = np.concatenate([box.points, points])
        box.values = np.concatenate([box.values, next(parts)])
        box.tests = np.concatenate([box.tests, tests])
        box.truths = np.concatenate([box.truths, next(parts)])
        box.wanted = []


def _halves(box: _Box, dim: int) -> list[_Box]:
    """The two halves of a box across one input; training points are kept, test points are not.

    (The parent's test points have decided that the box be cut, so they are no longer fresh; as
    training points they are welcome.)
    """
    middle = box.bounds[dim].mean()
    points = np.concatenate([box.points, box.tests])
    values = np.concatenate([box.values, box.truths])
    nothing, halves = (box.tests[:0], box.truths[:0]), []
    for side, rng in enumerate(box.rng.spawn(2)):
        bounds = box.bounds.copy()
        bounds[dim, 1 - side] = middle
        here = (points[:, dim] < middle) if side == 0 else (points[:, dim] >= middle)
        halves.append(_Box(bounds, rng, points[here], values[here], *nothing, box.depth + 1))
    return halves

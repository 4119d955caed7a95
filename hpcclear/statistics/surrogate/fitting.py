"""Kriging models fitted by maximum likelihood (`likelihood`); sources: `kriging`."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.statistics.surrogate.kernels import KERNELS, SQUARED_EXPONENTIAL, Kernel
from hpcclear.statistics.surrogate.kriging import Kriging, inside
from hpcclear.statistics.surrogate.likelihood import maximise

LENGTH_BOUNDS = (1e-2, 1e2)
"""Length scales in the unit cube; over 1e-5 to 1e5 noisy fits can collapse."""
SIGNAL_BOUNDS = (1e-3, 1e3)
"""Signal variance, in units of the variance of the values."""
NOISE_BOUNDS = (1e-8, 1e1)
"""Noise variance, in the same units; the lower end keeps the covariance matrix invertible."""


def fit_kriging(
    points: np.ndarray,
    values: np.ndarray,
    bounds: np.ndarray,
    *,
    rng: np.random.Generator,
    names: Sequence[str] | None = None,
    restarts: int = 3,
    lengths: tuple[float, float] = LENGTH_BOUNDS,
    kernel: Kernel = SQUARED_EXPONENTIAL,
) -> Kriging:
    """Fit a Kriging model by maximum likelihood.

    Parameters
    ----------
    points : (n, d) array
        Inputs, all inside `bounds`.
    values : (n,) array
        Outcomes; NaN marks a failed sample, which is left out and counted.
    bounds : (d, 2) array
        Lower and upper limit of each input: where the model will answer.
    rng : numpy Generator
        Draws the optimiser's further starting points.
    names : sequence of str, optional
        Names of the inputs, for messages and files (default x1, x2, ...).
    restarts : int
        Starting points of the likelihood's maximisation besides the first.
    lengths : (float, float)
        Between which the length scales are, in the unit cube.
    kernel : str
        "squared-exponential" or "matern-5/2".

    Returns
    -------
    Kriging

    Raises
    ------
    InputError
        Crossed bounds, points that are not finite or outside the bounds, infinite values, fewer
        valid samples than parameters to fit (d + 3), or a kernel that is not known.
    """
    if kernel not in KERNELS:
        raise InputError("kernel", kernel, "not known", f"take {' or '.join(KERNELS)}")
    points, values, bounds = (np.asarray(a, dtype=np.float64) for a in (points, values, bounds))
    labels = _check_shapes(points, values, bounds, names)
    valid = _check_samples(points, values, labels, bounds)
    inputs, outcomes = points[valid], values[valid]
    mean, scale = float(outcomes.mean()), float(outcomes.std())
    if scale <= 10 * np.finfo(float).eps * abs(mean):  # all equal but for round-off
        scale = 1.0
        outcomes = np.full_like(outcomes, mean)
    lower, upper = bounds.T
    unit = (inputs - lower) / (upper - lower)
    found = _maximise_likelihood(unit, (outcomes - mean) / scale, rng, restarts, lengths, kernel)
    samples = {"inputs": inputs, "values": values[valid], "dropped": int((~valid).sum())}
    return Kriging(labels, lower, upper, **found, mean=mean, scale=scale, **samples, kernel=kernel)


def _maximise_likelihood(
    unit: np.ndarray,
    normalised: np.ndarray,
    rng: np.random.Generator,
    restarts: int,
    lengths: tuple[float, float],
    kernel: Kernel,
) -> dict[str, Any]:
    """What `Kriging` calls so: length scales, variances and alpha, of normalised data in the unit cube."""
    from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

    dims = unit.shape[1]
    start = np.array([1.0, *np.full(dims, min(0.5, lengths[1])), 1e-3])
    bounds = np.array([SIGNAL_BOUNDS, *[lengths] * dims, NOISE_BOUNDS])
    seed = int(rng.integers(2**31))
    # One BLAS thread: more are slower at these sizes, and would change the last bits of the fit.
    with threadpool_limits(limits=1, user_api="blas"):
        found = maximise(unit, normalised, start, bounds, restarts, seed, kernel=kernel)
    return asdict(found)


def _check_shapes(
    points: np.ndarray, values: np.ndarray, bounds: np.ndarray, names: Sequence[str] | None
) -> tuple[str, ...]:
    """The inputs' names, after checking that the arrays fit together."""
    if points.ndim != 2 or points.shape[1] == 0:
        raise InputError("points", points.shape, "not a table of points", "give shape (n, d)")
    dims = points.shape[1]
    if values.shape != points.shape[:1]:
        raise InputError("values", values.shape, "not one per point", f"give {points.shape[0]}")
    if bounds.shape != (dims, 2):
        raise InputError("bounds", bounds.shape, "wrong shape", f"give shape ({dims}, 2)")
    labels = tuple(f"x{k + 1}" for k in range(dims)) if names is None else tuple(names)
    if len(labels) != dims or len(set(labels)) != dims:
        raise InputError("names", labels, "not one distinct name per input", f"give {dims} names")
    for name, (low, high) in zip(labels, bounds, strict=True):
        if not (np.isfinite(low) and np.isfinite(high) and low < high):
            raise InputError(
                name, (low, high), "bounds are crossed or not finite", "give lower < upper"
            )
    return labels


def _check_samples(
    points: np.ndarray, values: np.ndarray, names: Sequence[str], bounds: np.ndarray
) -> np.ndarray:
    """Which samples count, ``(n,)`` bool; NaN values are failed samples."""
    inside(points, names, *bounds.T)
    if np.isinf(values).any():
        index = int(np.isinf(values).argmax())
        raise InputError(
            f"values[{index}]", values[index], "infinite", "mark failed samples with NaN"
        )
    valid = np.isfinite(values)
    needed = points.shape[1] + 3  # length scales, signal, noise, mean
    if valid.sum() < needed:
        raise InputError(
            "values",
            int(valid.sum()),
            f"too few valid samples for {points.shape[1]} inputs ({values.size} given)",
            f"give at least {needed}, better ten times the number of inputs",
        )
    return valid

"""Kriging models fitted by maximum likelihood (`likelihood`); sources: `kriging`."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hpcclear.base.threads import one_thread
from hpcclear.statistics.surrogate.kernels import SQUARED_EXPONENTIAL, Errors, Kernel
from hpcclear.statistics.surrogate.kriging import Kriging
from hpcclear.statistics.surrogate.leaf import checked_samples
from hpcclear.statistics.surrogate.likelihood import maximise

LENGTH_BOUNDS = (1e-2, 1e2)
"""Length scales in the unit cube; over 1e-5 to 1e5 noisy fits can collapse."""
SIGNAL_BOUNDS = (1e-3, 1e3)
"""Signal variance, in units of the variance of the values."""
NOISE_BOUNDS = (1e-8, 1e1)
"""Noise variance, in the same units; the lower end keeps the covariance matrix invertible."""


@dataclass(frozen=True)
class KrigingMethod:
    """Kriging as a kind of surrogate; the settings are those of `fit_kriging`."""

    restarts: int = 3
    kernel: Kernel = SQUARED_EXPONENTIAL

    @property
    def label(self) -> str:
        """Kriging and its kernel, where that is not the squared exponential."""
        return "" if self.kernel == SQUARED_EXPONENTIAL else f"Kriging, {self.kernel}"

    def fit(
        self,
        points: np.ndarray,
        values: np.ndarray,
        bounds: np.ndarray,
        *,
        rng: np.random.Generator,
        names: Sequence[str] | None = None,
    ) -> Kriging:
        """Fit values (n,) at points (n, d); see `fit_kriging` for shapes and errors."""
        return fit_kriging(
            points, values, bounds, rng=rng, names=names, restarts=self.restarts, kernel=self.kernel
        )


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
    noise: tuple[float, float] | None = None,
    errors: Errors | None = None,
    like: Kriging | None = None,
) -> Kriging:
    """Fit a Kriging model by maximum likelihood.

    The points (n, d) are inside `bounds` (d, 2), where the model will answer. A value that is NaN marks a failed sample,
    which is left out and counted. `names`: of the inputs, x1, x2 and so on by default. The likelihood is maximised from
    `restarts` starting points besides the first, drawn by `rng`, with length scales (in the unit cube) between `lengths`, and
    the noise variance, in units of the variance of the values, between those of `noise`. `errors`: what is known of those of
    the values; else they are all alike. `like`: a model of nearly the same values, whose length scales and variances are the
    first starting point. Raises InputError: points outside the bounds, or fewer valid samples than parameters to fit (d + 3).
    """
    points, values, bounds = (np.asarray(a, dtype=np.float64) for a in (points, values, bounds))
    needed = points.shape[-1] + 3  # length scales, signal, noise, mean
    labels, valid = checked_samples(points, values, bounds, names, needed)
    inputs, outcomes = points[valid], values[valid]
    mean, scale = float(outcomes.mean()), float(outcomes.std())
    if scale <= 10 * np.finfo(float).eps * abs(mean):  # all equal but for round-off
        scale = 1.0
        outcomes = np.full_like(outcomes, mean)
    lower, upper = bounds.T
    unit = (inputs - lower) / (upper - lower)
    known = errors.of(valid, scale) if errors else None
    limits = noise or NOISE_BOUNDS
    dims = unit.shape[1]
    starts = [np.array([1.0, *np.full(dims, min(0.5, lengths[1])), np.clip(1e-3, *limits)])]
    box = np.array([SIGNAL_BOUNDS, *[lengths] * dims, limits])
    if like is not None:
        last = np.array([like.signal_variance, *like.length_scales, like.noise_variance])
        starts = [np.clip(last, *box.T)]
    seed = int(rng.integers(2**31))
    with one_thread():
        found = maximise(
            unit, (outcomes - mean) / scale, starts, box, restarts, seed, kernel=kernel, errors=known,
        )  # fmt: skip
    return Kriging(
        labels, lower, upper, **vars(found), mean=mean, scale=scale, inputs=inputs, values=values[valid],
        dropped=int((~valid).sum()), kernel=kernel, errors=known,
    )  # fmt: skip

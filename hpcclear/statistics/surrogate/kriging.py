"""Kriging: the model and what it predicts (fits: `fitting`).

The model is ordinary Kriging with a constant mean and a fitted noise term,

    y(x) = mean + scale * (z(x) + noise),
    cov(z(x), z(x')) = s2 k(r), r^2 = sum_d (x_d - x'_d)^2 / l_d^2,
    k(r) = exp(-r^2 / 2), or that of Matern of order 5/2, (1 + a + a^2 / 3) exp(-a) with a = sqrt(5) r,

in inputs scaled to the unit cube. A linear or a quadratic trend was tried on the clearance
objective in five inputs (200 points, five seeds) and gained nothing: median R2 0.9971 without,
0.9971 and 0.9961 with.

Sources: J. Sacks et al., "Design and analysis of computer experiments", Statistical Science 4
(1989), doi:10.1214/ss/1177012413; C. E. Rasmussen and C. K. I. Williams, "Gaussian Processes for
Machine Learning" (2006), section 2.2 and algorithm 2.1.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.spatial.distance import cdist

from hpcclear.base.arrays import Array
from hpcclear.statistics.surrogate.kernels import SQUARED_EXPONENTIAL, Errors, Kernel, correlation
from hpcclear.statistics.surrogate.leaf import Columns, inside
from hpcclear.statistics.surrogate.predictor import kernel_sum, pad

COLUMNS: Columns = {
    "weight": ("point", "alpha"),
    "length_scale": ("parameter", "length_scales"),
    "signal_variance": ("", "signal_variance"),
    "noise_variance": ("", "noise_variance"),
    "output_mean": ("", "mean"),
    "output_scale": ("", "scale"),
    "dropped": ("", "dropped"),
    "kernel": ("", "kernel"),
}
"""What the rows of a dataset hold of a model (`hpcclear.statistics.surrogate.leaf.Columns`)."""


@dataclass(frozen=True, eq=False)
class Kriging:
    """A fitted Kriging model of d inputs and n training points: arrays that suffice to predict."""

    names: tuple[str, ...]
    lower: np.ndarray
    upper: np.ndarray
    """lower and upper (d,): the box the model holds in; it refuses to answer outside."""
    length_scales: np.ndarray
    """In the unit cube (multiples of ``upper - lower``), (d,)."""
    signal_variance: float
    noise_variance: float
    """signal_variance and noise_variance: in units of ``scale**2``."""
    mean: float
    scale: float
    """mean and scale: average and standard deviation of the training values (scale 1 if they are all equal)."""
    inputs: np.ndarray
    values: np.ndarray
    """inputs (n, d) and values (n,): the training points that were used, in the user's units."""
    alpha: np.ndarray
    """``(K + noise I)^-1 (values - mean) / scale``, (n,)."""
    dropped: int = 0
    """Samples that had failed (NaN) and were left out of the fit."""
    kernel: Kernel = SQUARED_EXPONENTIAL
    errors: Errors | None = None
    """What is known of those of the training values, in units of ``scale``; not stored, for no prediction needs it."""

    def __post_init__(self) -> None:
        for name in ("lower", "upper", "length_scales", "inputs", "values", "alpha"):
            array = np.array(getattr(self, name), dtype=np.float64)
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @property
    def leaves(self) -> tuple["Kriging", ...]:
        """The models this one consists of: itself (see `hpcclear.statistics.surrogate.piecewise.Piecewise`)."""
        return (self,)

    @property
    def label(self) -> str:
        """The kernel, where it is not the squared exponential."""
        return "" if self.separable else self.kernel

    @property
    def separable(self) -> bool:
        """Whether the kernel is a product over the inputs, which tensor rules need."""
        return self.kernel == SQUARED_EXPONENTIAL

    @property
    def columns(self) -> Columns:
        """What is stored of it; the kernel is left out where it is the squared exponential."""
        return {k: v for k, v in COLUMNS.items() if k != "kernel" or not self.separable}

    def steepest(self) -> int:
        """The input with the shortest length scale."""
        return int(np.argmin(self.length_scales))

    def moments(self, points: np.ndarray) -> None:
        """None: averages of `predict`, where there is no tensor rule."""

    def to_unit(self, points: np.ndarray) -> np.ndarray:
        """Points ``(..., d)`` in the user's units as points of the unit cube."""
        return (points - self.lower) / (self.upper - self.lower)

    @cached_property
    def packed(self) -> tuple[np.ndarray, np.ndarray]:
        """Scaled training points ``(d, p)`` and weights ``(p,)`` for the compiled predictor."""
        weights = self.scale * self.signal_variance * self.alpha
        return pad(self.to_unit(self.inputs) / self.length_scales, weights)

    def predict(self, points: np.ndarray) -> np.ndarray:
        """Kriging mean (n,) at points (n, d), in the units of the training values and of `lower` and `upper`.

        Raises InputError: a point lies outside the box (or is NaN): the model does not extrapolate.
        """
        unit = self.to_unit(inside(points, self.names, self.lower, self.upper))
        scaled, weights = self.packed
        return kernel_sum(unit, scaled, self.length_scales, weights, self.mean, self.separable)

    def variance(self, points: np.ndarray) -> np.ndarray:
        """Kriging variance (n,) of the smooth part at points (n, d), in squared units of the training values. Raises InputError
        as in `predict`.
        """
        points = inside(points, self.names, self.lower, self.upper)
        cross = self._covariance(self._unit, self.to_unit(points))
        steps = self._solved(cross)
        known = np.einsum("ij,ij->j", steps, steps)
        return self.scale**2 * np.maximum(self.signal_variance - known, 0.0)

    def apart(self, points: np.ndarray, one: np.ndarray | None = None) -> np.ndarray:
        """Kriging variance (n,) of the differences of the smooth part at points (n, d) from that at `one` (d,), or at the
        nearest training point of each, in squared units of the training values."""
        unit, inputs = self.to_unit(inside(points, self.names, self.lower, self.upper)), self._unit
        cross = self._covariance(inputs, unit)
        steps = self._solved(cross)
        if one is None:
            steps -= self._steps[:, cross.argmax(axis=0)]
            shared = cross.max(axis=0)
        else:
            place = self.to_unit(one[None])
            steps -= self._solved(self._covariance(inputs, place))
            shared = self._covariance(unit, place)[:, 0]
        left = 2.0 * (self.signal_variance - shared) - np.einsum("ij,ij->j", steps, steps)
        return np.asarray(self.scale**2 * np.maximum(left, 0.0))

    def covariance(self, points: np.ndarray) -> np.ndarray:
        """Joint Kriging covariance (n, n) of the smooth part at points (n, d), in squared units of the training values."""
        unit = self.to_unit(inside(points, self.names, self.lower, self.upper))
        cross = self._covariance(self._unit, unit)
        steps = self._solved(cross)
        known = steps.T @ steps
        return np.asarray(self.scale**2 * (self._covariance(unit, unit) - known))

    @cached_property
    def _unit(self) -> Array:
        return self.to_unit(self.inputs)

    @cached_property
    def _steps(self) -> Array:
        """What is known at the training points themselves, as `apart` takes it, (n, n)."""
        return self._solved(self._covariance(self._unit, self._unit))

    def _solved(self, cross: Array) -> Array:
        """What multiplied by the factor gives covariances with the training values, (n, m)."""
        return np.asarray(solve_triangular(self._factor, cross, lower=True, check_finite=False))

    @cached_property
    def _factor(self) -> Array:
        """Cholesky factor of the covariance of the training values."""
        return np.asarray(cholesky(self._noisy_covariance(), lower=True))

    @property
    def error_variances(self) -> Array:
        """Variances of the errors of the training values, (n,), in squared units of these."""
        errors = self.errors or Errors(np.ones(len(self.values)))
        common = 0.0 if errors.common is None else np.diag(errors.common)
        return self.scale**2 * (self.noise_variance * errors.own + common)

    def leave_one_out(self) -> Array:
        """At each training point, what the model without that point predicts, shape (n,).

        Closed form: the error is the weight over the diagonal of the inverse covariance (Rasmussen
        and Williams, eq. 5.12).
        """
        inverse = np.linalg.inv(self._noisy_covariance())
        return self.values - self.scale * self.alpha / np.diag(inverse)

    def _noisy_covariance(self) -> Array:
        """Covariance of the training values, in units of ``scale**2``."""
        matrix = self._covariance(self._unit, self._unit)
        (self.errors or Errors(np.ones(len(matrix)))).added(matrix, self.noise_variance)
        return matrix

    def _covariance(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        squares = cdist(a / self.length_scales, b / self.length_scales, "sqeuclidean")
        return self.signal_variance * correlation(squares, self.kernel)

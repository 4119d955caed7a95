"""Kriging with a squared-exponential kernel: fitted by scikit-learn, used without it.

The model is ordinary Kriging with a constant mean and a fitted noise term,

    y(x) = mean + scale * (z(x) + noise),
    cov(z(x), z(x')) = s2 exp(-sum_d (x_d - x'_d)^2 / (2 l_d^2)),

in inputs scaled to the unit cube. A linear or a quadratic trend was tried on the clearance
objective in five inputs (200 points, five seeds) and gained nothing: median R2 0.9971 without,
0.9971 and 0.9961 with.

Sources: J. Sacks et al., "Design and analysis of computer experiments", Statistical Science 4
(1989), doi:10.1214/ss/1177012413; C. E. Rasmussen and C. K. I. Williams, "Gaussian Processes for
Machine Learning" (2006), section 2.2 and algorithm 2.1.
"""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from hpcclear.base.errors import InputError
from hpcclear.statistics.surrogate.predictor import kernel_sum, pad

LENGTH_BOUNDS = (1e-2, 1e2)
"""Length scales in the unit cube; over scikit-learn's own (1e-5 to 1e5) noisy fits can collapse."""
SIGNAL_BOUNDS = (1e-3, 1e3)
"""Signal variance, in units of the variance of the values."""
NOISE_BOUNDS = (1e-8, 1e1)
"""Noise variance, in the same units; the lower end keeps the covariance matrix invertible."""

FIELDS: dict[str, tuple[str, ...]] = {
    "names": ("parameter",),
    "lower": ("parameter",),
    "upper": ("parameter",),
    "length_scales": ("parameter",),
    "signal_variance": (),
    "noise_variance": (),
    "mean": (),
    "scale": (),
    "dropped": (),
    "inputs": ("training_point", "parameter"),
    "values": ("training_point",),
    "alpha": ("training_point",),
}
"""What a stored model consists of, and the dimensions of each array."""


@dataclass(frozen=True, eq=False)
class Kriging:
    """A fitted Kriging model: arrays that suffice to predict.

    Attributes
    ----------
    names : tuple of str
        Names of the d inputs.
    lower, upper : (d,) arrays
        The box the model holds in; it refuses to answer outside.
    length_scales : (d,) array
        In the unit cube (multiples of ``upper - lower``).
    signal_variance, noise_variance : float
        In units of ``scale**2``.
    mean, scale : float
        Average and standard deviation of the training values (scale 1 if they are all equal).
    inputs : (n, d) array
    values : (n,) array
        The training points that were used, in the user's units.
    alpha : (n,) array
        ``(K + noise I)^-1 (values - mean) / scale``.
    dropped : int
        Samples that had failed (NaN) and were left out of the fit.
    """

    names: tuple[str, ...]
    lower: np.ndarray
    upper: np.ndarray
    length_scales: np.ndarray
    signal_variance: float
    noise_variance: float
    mean: float
    scale: float
    inputs: np.ndarray
    values: np.ndarray
    alpha: np.ndarray
    dropped: int = 0

    def __post_init__(self) -> None:
        for name, dims in FIELDS.items():
            if dims and name != "names":
                array = np.array(getattr(self, name), dtype=np.float64)
                array.setflags(write=False)
                object.__setattr__(self, name, array)

    @property
    def leaves(self) -> tuple["Kriging", ...]:
        """The models this one consists of: itself (see `PiecewiseKriging`)."""
        return (self,)

    def to_unit(self, points: np.ndarray) -> np.ndarray:
        """Points ``(..., d)`` in the user's units as points of the unit cube."""
        return (points - self.lower) / (self.upper - self.lower)

    @cached_property
    def packed(self) -> tuple[np.ndarray, np.ndarray]:
        """Scaled training points ``(d, p)`` and weights ``(p,)`` for the compiled predictor."""
        weights = self.scale * self.signal_variance * self.alpha
        return pad(self.to_unit(self.inputs) / self.length_scales, weights)

    def predict(self, points: np.ndarray) -> np.ndarray:
        """Kriging mean.

        Parameters
        ----------
        points : (n, d) array
            In the units of `lower` and `upper`.

        Returns
        -------
        (n,) array
            In the units of the training values.

        Raises
        ------
        InputError
            A point lies outside the box (or is NaN): the model does not extrapolate.
        """
        points = inside(points, self.names, self.lower, self.upper)
        return kernel_sum(
            self.to_unit(points), self.packed[0], self.length_scales, self.packed[1], self.mean
        )

    def variance(self, points: np.ndarray, *, noise: bool = False) -> np.ndarray:
        """Kriging variance at ``(n, d)`` points, of the smooth part or of one noisy evaluation.

        Returns
        -------
        (n,) array
            In squared units of the training values.

        Raises
        ------
        InputError
            As in `predict`.
        """
        points = inside(points, self.names, self.lower, self.upper)
        train = self.to_unit(self.inputs)
        matrix = self._covariance(train, train)
        matrix[np.diag_indices_from(matrix)] += self.noise_variance
        cross = self._covariance(train, self.to_unit(points))
        known = np.einsum("ij,ij->j", cross, cho_solve(cho_factor(matrix, lower=True), cross))
        left = np.maximum(self.signal_variance - known, 0.0)
        return self.scale**2 * (left + (self.noise_variance if noise else 0.0))

    def _covariance(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        steps = (a[:, None, :] - b[None, :, :]) / self.length_scales
        return self.signal_variance * np.exp(-0.5 * np.einsum("ijk,ijk->ij", steps, steps))

    def to_arrays(self) -> dict[str, np.ndarray]:
        """The model as plain arrays, without pickle; `FIELDS` names their dimensions."""
        return {name: np.asarray(getattr(self, name)) for name in FIELDS}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, np.ndarray]) -> "Kriging":
        """The model that `to_arrays` stored; it predicts the same to the last bit.

        Raises
        ------
        InputError
            An array is missing, has the wrong shape, or is not finite.
        """
        sizes: dict[str, int] = {}
        for name, dims in FIELDS.items():
            _check_array(arrays, name, dims, sizes)
        lower, upper = np.asarray(arrays["lower"]), np.asarray(arrays["upper"])
        if not (lower < upper).all():
            raise InputError("lower", lower.tolist(), "not below upper", "use the file as written")
        positive = ("length_scales", "signal_variance", "noise_variance", "scale")
        for name in positive:
            if not (np.asarray(arrays[name]) > 0).all():
                raise InputError(name, arrays[name], "not positive", "use the file as written")
        fields: dict[str, Any] = {name: np.asarray(arrays[name]) for name in FIELDS}
        for name in (*positive[1:], "mean"):
            fields[name] = float(fields[name])
        fields["names"] = tuple(str(name) for name in fields["names"])
        fields["dropped"] = int(fields["dropped"])
        return cls(**fields)


def fit_kriging(
    points: np.ndarray,
    values: np.ndarray,
    bounds: np.ndarray,
    *,
    rng: np.random.Generator,
    names: Sequence[str] | None = None,
    restarts: int = 3,
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

    Returns
    -------
    Kriging

    Raises
    ------
    InputError
        Crossed bounds, points that are not finite or outside the bounds, infinite values, or fewer
        valid samples than parameters to fit (d + 3).
    """
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
    lengths, signal, noise, alpha = _maximise_likelihood(
        unit, (outcomes - mean) / scale, rng, restarts
    )
    return Kriging(
        names=labels,
        lower=lower,
        upper=upper,
        length_scales=lengths,
        signal_variance=signal,
        noise_variance=noise,
        mean=mean,
        scale=scale,
        inputs=inputs,
        values=values[valid],
        alpha=alpha,
        dropped=int((~valid).sum()),
    )


def _maximise_likelihood(
    unit: np.ndarray, normalised: np.ndarray, rng: np.random.Generator, restarts: int
) -> tuple[np.ndarray, float, float, np.ndarray]:
    """Length scales, signal and noise variance, and alpha, of normalised data in the unit cube."""
    # Imported here: only fitting needs scikit-learn, and loading it takes a second.
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
    from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

    dims = unit.shape[1]
    signal = ConstantKernel(1.0, SIGNAL_BOUNDS)
    kernel = signal * RBF(np.full(dims, 0.5), LENGTH_BOUNDS) + WhiteKernel(1e-3, NOISE_BOUNDS)
    seed = int(rng.integers(2**31))
    regressor = GaussianProcessRegressor(
        kernel, alpha=0.0, n_restarts_optimizer=restarts, random_state=seed
    )
    # One BLAS thread: more are slower at these sizes, and would change the last bits of the fit.
    with warnings.catch_warnings(), threadpool_limits(limits=1, user_api="blas"):
        # An input without influence rightly takes its length scale to the upper bound.
        warnings.simplefilter("ignore", ConvergenceWarning)
        regressor.fit(unit, normalised)
    product, white = regressor.kernel_.k1, regressor.kernel_.k2
    return (
        np.atleast_1d(product.k2.length_scale),
        float(product.k1.constant_value),
        float(white.noise_level),
        regressor.alpha_,
    )


def inside(
    points: np.ndarray, names: Sequence[str], lower: np.ndarray, upper: np.ndarray
) -> np.ndarray:
    """Points ``(n, d)`` as floats, after checking that none lies outside the box.

    Raises
    ------
    InputError
        Naming the first variable and value outside.
    """
    points = np.asarray(points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != lower.size:
        raise InputError(
            "points", points.shape, "wrong shape", f"give an array of shape (n, {lower.size})"
        )
    slack = 8 * np.finfo(float).eps * np.maximum(abs(lower), abs(upper))
    good = (points >= lower - slack) & (points <= upper + slack)  # False for NaN too
    if not good.all():
        row, column = np.argwhere(~good)[0]
        raise InputError(
            names[column],
            float(points[row, column]),
            f"outside the surrogate's domain [{lower[column]:.9g}, {upper[column]:.9g}]; "
            "it does not extrapolate",
            "ask inside the domain, or fit the surrogate on a wider one",
        )
    return points


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


def _check_array(
    arrays: Mapping[str, np.ndarray], name: str, dims: tuple[str, ...], sizes: dict[str, int]
) -> None:
    """Refuse a stored array that is missing, of the wrong shape or kind; note its dimensions."""
    remedy = "use a file written by this package"
    if name not in arrays:
        raise InputError(name, None, "missing from the stored model", remedy)
    array = np.asarray(arrays[name])
    if array.ndim != len(dims):
        raise InputError(name, array.shape, "wrong number of dimensions", remedy)
    for dim, size in zip(dims, array.shape, strict=True):
        if size == 0 or sizes.setdefault(dim, size) != size:
            raise InputError(name, array.shape, f"does not fit dimension {dim!r}", remedy)
    if name == "names":
        if array.dtype.kind not in "UOT":
            raise InputError(name, array.dtype, "not text", remedy)
    elif array.dtype.kind not in "fiu" or not np.isfinite(array).all():
        raise InputError(name, array, "not finite numbers", remedy)

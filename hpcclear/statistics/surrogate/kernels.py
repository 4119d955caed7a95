"""Covariance functions of Kriging, by the squared distance of two points over the length scales.

The squared exponential is smooth without end, the Matern function of order 5/2 can be differentiated twice: it suits what has
kinks, and is less sure of itself between points.

Sources: C. E. Rasmussen and C. K. I. Williams, "Gaussian Processes for Machine Learning" (2006), eqs. 4.9 and 4.17;
M. L. Stein, "Interpolation of Spatial Data" (1999), section 2.7.
"""

from typing import Literal, NamedTuple, get_args

import numpy as np

from hpcclear.base.arrays import Array, Booleans, Integers

Kernel = Literal["squared-exponential", "matern-5/2"]
SQUARED_EXPONENTIAL: Kernel = "squared-exponential"
"""A product over the inputs: moments under random inputs have tensor rules and a closed form."""
MATERN: Kernel = "matern-5/2"
"""A function of the distance over all inputs, and no product over them."""
KERNELS: tuple[Kernel, ...] = get_args(Kernel)


class Errors(NamedTuple):
    """What is known of the errors of n values."""

    own: Array
    """Variance of what each has for itself, over the noise variance that is sought, (n,)."""
    common: Array | None = None
    """Covariance of what they share, in squared units of the values, (n, n)."""

    def of(self, rows: Integers | Booleans, scale: float = 1.0) -> "Errors":
        """Those of some values, in units of `scale`."""
        common = None if self.common is None else self.common[np.ix_(rows, rows)] / scale**2
        return Errors(self.own[rows], common)

    def extended(self) -> "Errors":
        """Those of one more value, which shares nothing."""
        common = None if self.common is None else np.pad(self.common, (0, 1))
        return Errors(np.append(self.own, np.median(self.own)), common)

    def added(self, covariance: Array, noise: float) -> None:
        """Add them to a covariance matrix of the values, (n, n)."""
        covariance[np.diag_indices_from(covariance)] += noise * self.own
        if self.common is not None:
            covariance += self.common


def correlation(squares: Array, kernel: Kernel) -> Array:
    """Correlations at squared distances, arrays of one shape (...)."""
    if kernel == SQUARED_EXPONENTIAL:
        return np.asarray(np.exp(-0.5 * squares))
    steps = np.sqrt(5.0 * squares)
    return np.asarray((1.0 + steps + steps**2 / 3.0) * np.exp(-steps))


def with_slopes(exponents: Array, level: float, kernel: Kernel) -> tuple[Array, Array]:
    """Covariances (n, n) and what their derivatives by the length scales are made of (n, n); one array for the squared
    exponential.

    The derivative by the logarithm of a length scale is the second array times the squared difference of that input over its
    length scale. `exponents` (n, n), overwritten: minus half the squared distances, plus `level`, the logarithm of the
    variance, for the squared exponential.
    """
    if kernel == SQUARED_EXPONENTIAL:
        np.minimum(exponents, level, out=exponents)
        np.exp(exponents, out=exponents)
        np.fill_diagonal(exponents, np.exp(level))
        return exponents, exponents
    np.minimum(exponents, 0.0, out=exponents)
    steps = np.sqrt(-10.0 * exponents)
    falling = np.exp(level - steps)
    covariance = (1.0 + steps + steps**2 / 3.0) * falling
    np.fill_diagonal(covariance, np.exp(level))
    return covariance, (5.0 / 3.0) * (1.0 + steps) * falling

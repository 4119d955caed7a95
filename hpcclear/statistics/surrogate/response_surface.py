"""Polynomial response surfaces by least squares (eqs. 24 and 25), with standard errors.

The inputs are scaled to [-1, 1] over stated bounds; a surface never answers outside them.
With n inputs and total order m a surface has C(n + m, m) terms: 10 for a cubic in two inputs
(the count the paper prints), 20 in three, 56 in five, 120 in seven.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hpcclear.base.arrays import Array, Integers
from hpcclear.base.errors import InputError
from hpcclear.statistics.surrogate.metrics import ROUNDING, leave_one_out
from hpcclear.statistics.surrogate.polynomial import exponents_up_to, monomials, slopes
from hpcclear.statistics.surrogate.term_choice import choose_terms

Evaluate = Callable[[Array], Array]
"""True function: points of shape (n, d) -> values of shape (n,), NaN where it failed."""

OUTSIDE = 1e-9  # in half-lengths: how far rounding may carry a point past a bound


@dataclass(frozen=True)
class ResponseSurface:
    """A fitted polynomial ``f(x) = offset + sum coefficients * z**exponents`` of t terms, z in [-1, 1]."""

    bounds: Array
    """Lower and upper limit of every input, in its own unit, shape (d, 2)."""
    order: int
    """Total order."""
    exponents: Integers
    """Shape (t, d)."""
    coefficients: Array
    """Of the scaled inputs, in the unit of f, shape (t,); the offset is already in the constant term."""
    unscaled_covariance: Array
    """(X'X)^-1, shape (t, t); times `residual_variance` it is the covariance of the coefficients."""
    residual_variance: float
    """SSE / degrees of freedom, no less than the rounding of the values; NaN without any degrees of freedom. Of chosen terms no
    less than the mean square error at points left out of the choice."""
    degrees_of_freedom: int
    """Points that counted minus terms."""
    leave_one_out_errors: Array
    """Error at each point (n,) of the surface fitted without it, its terms as they stand."""
    leave_one_out_r2: float
    """1 - sum of squares of those errors / SST; NaN if the values do not vary. Of chosen terms that of points left out of the
    choice as well."""
    n_points: int
    """Points that counted, whose value was finite."""

    def predict(self, points: ArrayLike) -> Array:
        """Values at points of shape (n, d), in the unit of f, shape (n,).

        Raises InputError if a point is not finite or lies outside the bounds: a surface never extrapolates.
        """
        z = scale_inputs(points, self.bounds)
        return np.asarray(monomials(z, self.exponents) @ self.coefficients)

    def gradient(self, point: ArrayLike) -> tuple[Array, Array]:
        """First derivatives (d,) at one point inside the bounds and their standard errors (eq. 14), in units of f per unit of
        each input.

        The errors come from the residual variance: they hold for the polynomial's own scatter, not for terms it lacks; NaN
        without any degrees of freedom. Raises InputError as in `predict`.
        """
        z = scale_inputs(np.asarray(point, float)[np.newaxis], self.bounds)
        rows = np.vstack([slopes(z, self.exponents, j) for j in range(len(self.bounds))])
        rows *= (2.0 / np.ptp(self.bounds, axis=1))[:, np.newaxis]  # dz/dx
        spread = np.einsum("ij,jk,ik->i", rows, self.unscaled_covariance, rows)
        return rows @ self.coefficients, np.sqrt(self.residual_variance * spread)


def scale_inputs(points: ArrayLike, bounds: Array) -> Array:
    """Points of shape (n, d) in physical units, scaled to [-1, 1] over the bounds.

    Raises InputError if a coordinate is not finite, or a point lies outside.
    """
    x = np.asarray(points, float)
    z = (2.0 * x - bounds[:, 0] - bounds[:, 1]) / (bounds[:, 1] - bounds[:, 0])
    outside = ~(np.abs(z) <= 1.0 + OUTSIDE)  # true for NaN as well
    if outside.any():
        row = int(np.argmax(outside.any(axis=1)))
        reason = "a coordinate is not finite or lies outside the bounds"
        remedy = "a surface does not extrapolate: move the point or widen the bounds"
        raise InputError(f"points[{row}]", x[row].tolist(), reason, remedy)
    return z


def latin_hypercube(n: int, bounds: Array, rng: np.random.Generator) -> Array:
    """Latin hypercube of n points, shape (n, d): one point in each n-th of every input."""
    strata = np.stack([rng.permutation(n) for _ in bounds], axis=1)
    unit = (strata + rng.random(strata.shape)) / n
    return np.asarray(bounds[:, 0] + unit * (bounds[:, 1] - bounds[:, 0]))


def fit_response_surface(
    points: ArrayLike, values: ArrayLike, bounds: ArrayLike, order: int, *, chosen: bool = False
) -> ResponseSurface:
    """Least-squares polynomial of a total order through points (n, d) and values (n,); those that are not finite are dropped.

    The points lie inside `bounds` (d, 2), which fix the scaling. `chosen`: not with all terms up to that order, but with those
    that the values speak for (`hpcclear.statistics.surrogate.term_choice`): fewer points than terms will do then.

    Solved through the singular value decomposition, not the normal equations of section 4.2,
    which square the condition number. Values are taken relative to one of them, so that a
    constant gives coefficients of exactly 0.

    Raises InputError if fewer values than terms are finite, if the points do not determine every term (too few distinct
    values of an input, say), or if shapes, bounds or points cannot be used.
    """
    limits = np.asarray(bounds, float)
    z, y = scale_inputs(points, limits), np.asarray(values, float)
    finite = np.isfinite(y)
    z, y, n_dropped = z[finite], y[finite], int(np.count_nonzero(~finite))
    exponents, least = exponents_up_to(len(limits), order), 0.0
    if chosen:
        exponents, least = choose_terms(z, y, order)
    design, offset = monomials(z, exponents), y[0] if len(y) else 0.0
    left, singular, right = _decomposed(design, order, n_dropped)
    inverse = right.T / singular
    coefficients = inverse @ (left.T @ (y - offset))
    residuals = (y - offset) - design @ coefficients
    coefficients[0] += offset
    freedom = len(y) - len(exponents)
    rounding = (ROUNDING * np.abs(y).max()) ** 2
    errors = leave_one_out(residuals, np.sum(left**2, axis=1))
    total = float(np.sum((y - y.mean()) ** 2))
    missed = least * len(y) if chosen else np.sum(errors**2)
    variance = max(float(residuals @ residuals) / freedom, rounding, least) if freedom else np.nan
    return ResponseSurface(
        bounds=limits,
        order=order,
        exponents=exponents,
        coefficients=coefficients,
        unscaled_covariance=inverse @ inverse.T,
        residual_variance=float(variance),
        degrees_of_freedom=freedom,
        leave_one_out_errors=errors,
        leave_one_out_r2=float(1 - missed / total) if total > len(y) * rounding else float("nan"),
        n_points=len(y),
    )


def _decomposed(design: Array, order: int, n_dropped: int) -> tuple[Array, Array, Array]:
    """Singular value decomposition of a design matrix that determines every term."""
    n_points, terms = design.shape
    if n_points < terms:
        dropped = f"; {n_dropped} points failed and were dropped" if n_dropped else ""
        reason = f"too few: order {order} has {terms} terms{dropped}"
        remedy = f"take at least {terms} points, better twice as many, or a lower order"
        raise InputError("points", n_points, reason, remedy)
    left, singular, right = np.linalg.svd(design, full_matrices=False)
    if singular[-1] <= n_points * np.finfo(float).eps * singular[0]:
        reason = f"they do not determine all {terms} terms of order {order}"
        remedy = "give every input more distinct values than the order, or lower the order"
        raise InputError("points", n_points, reason, remedy)
    return left, singular, right

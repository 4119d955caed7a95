"""Terms of a response surface, chosen by the values: for more terms than there are points, or than are worth having.

The constant and all linear terms are always there, so that every input has a slope with a standard error. What they leave is
followed by least angle regression over products of Legendre polynomials, which hardly depend on each other over the box; with
each of them come the monomials it is made of, fitted by least squares. How far the path is followed is decided by
cross-validation of all of it, choice included: errors of the chosen terms on the points they were chosen by would be too
small. Surfaces with all terms up to an order stand beside it where there are points for them, by their leave-one-out errors.

Sources: B. Efron, T. Hastie, I. Johnstone, R. Tibshirani, "Least angle regression", Annals of Statistics 32 (2004),
doi:10.1214/009053604000000067; with least squares along the path G. Blatman and B. Sudret, "Adaptive sparse polynomial chaos
expansion based on least angle regression", J. Comput. Phys. 230 (2011), doi:10.1016/j.jcp.2010.12.021.
"""

import warnings
from itertools import product

import numpy as np
from scipy.linalg import solve_triangular

from hpcclear.base.arrays import Array, Booleans, Integers
from hpcclear.base.errors import InputError
from hpcclear.base.threads import one_thread
from hpcclear.statistics.surrogate.metrics import ROUNDING, leave_one_out
from hpcclear.statistics.surrogate.polynomial import exponents_up_to, monomials, n_terms

Term = tuple[int, ...]
"""Exponents of the inputs."""
FOLDS = 5
MOST_SHARE, MOST_TERMS = 0.8, 400
"""Terms at most: as a share of the points, and at all."""
DEPENDENT = 1e-8
"""Share of a term's length, beyond what other terms say, below which the points do not determine it."""


def choose_terms(z: Array, values: Array, order: int) -> tuple[Integers, float]:
    """Exponents (t, d) of the terms that finite values (n,) speak for, at points (n, d) scaled to [-1, 1], and how far off
    they are.

    The constant comes first, then all linear terms, then others up to the total order as they were found; the error is the
    mean square at points that had no part in the choice. Raises InputError: too few points to choose by.
    """
    count, dims = z.shape
    least = least_points(dims)
    if count < least:
        reason = f"too few to choose terms in {dims} inputs by"
        remedy = f"take at least {least}, better ten times the inputs"
        raise InputError("points", count, reason, remedy)
    linear = exponents_up_to(dims, min(order, 1))
    if order < 2 or np.linalg.matrix_rank(monomials(z, linear)) < len(linear):
        return linear, 0.0  # which the fit refuses if the points do not determine them
    with one_thread():
        fold = np.arange(count) % FOLDS
        found = [_followed(z, values, order, fold != k)[1] for k in range(FOLDS)]
        steps = min(len(errors) for errors in found)
        errors = np.mean([one[:steps] for one in found], axis=0)
        terms = _followed(z, values, order, np.ones(count, bool))[0]
        chosen = min(int(errors.argmin()), len(terms) - 1)
        return _or_all(z, values, order, float(errors[chosen]), terms[chosen])


def least_points(n_inputs: int) -> int:
    """Points without which no terms are chosen: each fold leaves enough for the linear ones and one more."""
    return int((n_inputs + 2) / MOST_SHARE * FOLDS / (FOLDS - 1)) + 1


def _or_all(
    z: Array, values: Array, order: int, least: float, best: Integers
) -> tuple[Integers, float]:
    """The chosen terms, whose mean square error is given, or all up to an order, if their own error is less; with the error."""
    for whole in range(2, order + 1):
        if n_terms(z.shape[1], whole) >= len(z):
            break
        exponents = exponents_up_to(z.shape[1], whole)
        basis, _ = np.linalg.qr(monomials(z, exponents))
        errors = leave_one_out(values - basis @ (basis.T @ values), np.sum(basis**2, axis=1))
        if np.mean(errors**2) < least:  # not where one is NaN
            best, least = exponents, float(np.mean(errors**2))
    return best, least


def _followed(
    z: Array, values: Array, order: int, train: Booleans
) -> tuple[list[Integers], list[float]]:
    """Terms after each step along the path of the training points, and the mean square error on the others, if any."""
    known = exponents_up_to(z.shape[1], 1)
    most = min(int(MOST_SHARE * train.sum()), MOST_TERMS)
    terms = dict.fromkeys(map(tuple, known.tolist()))  # in their order
    counts = [len(known)]
    for product_of in _path(z[train], values[train], known, order, most - len(known)):
        # each Legendre polynomial is even or odd
        terms |= dict.fromkeys(product(*(range(degree, -1, -2) for degree in product_of)))
        counts.append(min(len(terms), most))
        if len(terms) >= most:
            break
    found = np.array(list(terms))[:most]
    table = monomials(z, found)
    basis, factor = np.linalg.qr(table[train])
    while (lost := abs(np.diag(factor)) <= DEPENDENT * np.linalg.norm(table[train], axis=0)).any():
        first = int(lost.argmax())
        found, table = (np.delete(one, first, axis) for one, axis in ((found, 0), (table, 1)))
        counts = [count - (count > first) for count in counts]
        basis, factor = np.linalg.qr(table[train])
    # the fit by the first k columns of an orthonormal basis is the sum of its first k parts
    parts = solve_triangular(factor.T, table.T, lower=True).T * (basis.T @ values[train])
    squares = (values[:, None] - np.cumsum(parts, axis=1)) ** 2
    rounding = train.sum() * (ROUNDING * np.abs(values).max()) ** 2
    exact = [k for k, count in enumerate(counts) if squares[train, count - 1].sum() <= rounding]
    counts = counts[: exact[0] + 1] if exact else counts  # nothing is left to follow
    others = squares[~train]
    errors = [float(others[:, count - 1].sum() / max(len(others), 1)) for count in counts]
    return [found[:count] for count in counts], errors


def _path(z: Array, values: Array, known: Integers, order: int, steps: int) -> list[Term]:
    """Further terms by least angle regression, in their order; values (n,) are followed as far as known terms leave them."""
    from sklearn.exceptions import ConvergenceWarning  # loading it takes a second
    from sklearn.linear_model import lars_path

    further = exponents_up_to(z.shape[1], order)[len(known) :]
    basis, _ = np.linalg.qr(monomials(z, known))
    left = values - basis @ (basis.T @ values)
    if left @ left <= len(values) * (ROUNDING * np.abs(values).max()) ** 2:
        return []
    columns = _legendre(z, further)
    whole = np.linalg.norm(columns, axis=0)
    columns -= basis @ (basis.T @ columns)
    own = np.linalg.norm(columns, axis=0)
    distinct = own > DEPENDENT * whole
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # of terms that others make up: dropped
        unit = columns[:, distinct] / own[distinct]
        _, active, _ = lars_path(unit, left, method="lar", max_iter=steps, Gram=None)
    return [tuple(row) for row in further[distinct][active].tolist()]


def _legendre(z: Array, degrees: Integers) -> Array:
    """Products of Legendre polynomials of the inputs, degrees (t, d): shape (n, t)."""
    each = np.polynomial.legendre.legvander(z, int(degrees.max()))
    terms = np.ones((len(z), len(degrees)))
    for j in range(z.shape[1]):
        terms *= each[:, j, degrees[:, j]]
    return terms

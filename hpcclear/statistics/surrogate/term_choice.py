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

from hpcclear.base.arrays import Array, Booleans, Integers
from hpcclear.base.errors import InputError
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
    """Exponents of the terms that values speak for, and how far off such a surface is.

    Parameters
    ----------
    z : array, shape (n, d)
        Points, scaled to [-1, 1].
    values : array, shape (n,)
        Finite.
    order : int
        Total order at most.

    Returns
    -------
    array of int, shape (t, d)
        The constant first, all linear terms, then others as they were found.
    float
        Mean square error at points that had no part in the choice.

    Raises
    ------
    InputError
        Too few points to choose by.
    """
    from threadpoolctl import threadpool_limits

    count, dims = z.shape
    least = least_points(dims)
    if count < least:
        raise InputError(
            "points",
            count,
            f"too few to choose terms in {dims} inputs by",
            f"take at least {least}, better ten times the inputs",
        )
    linear = exponents_up_to(dims, min(order, 1))
    if order < 2 or np.linalg.matrix_rank(monomials(z, linear)) < len(linear):
        return linear, 0.0  # which the fit refuses if the points do not determine them
    with threadpool_limits(limits=1, user_api="blas"):  # the same bits on any machine of a kind
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
    z: Array, values: Array, order: int, least: float, chosen: list[Term]
) -> tuple[Integers, float]:
    """The chosen terms, whose mean square error is given, or all up to an order, if their own error is less; with the error."""
    best = np.array(chosen, dtype=np.int64)
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
) -> tuple[list[list[Term]], list[float]]:
    """Terms after each step along the path of the training points, and the mean square error on the others."""
    known = exponents_up_to(z.shape[1], 1)
    most = min(int(MOST_SHARE * train.sum()), MOST_TERMS)
    surface = _Grown(values, train, most)
    for term in known:
        surface.add(tuple(term), z)
    terms, errors = [list(surface.terms)], [surface.error()]
    if surface.is_exact():
        return terms, errors
    for term in _path(z[train], surface.residual[train], known, order, most - len(known)):
        for part in _parts(term):
            surface.add(part, z)
        terms.append(list(surface.terms))
        errors.append(surface.error())
        if surface.is_exact() or len(surface.terms) == most:
            break
    return terms, errors


def _path(z: Array, left: Array, known: Integers, order: int, steps: int) -> list[Term]:
    """Further terms by least angle regression, in their order; left (n,) is what the known ones leave of the values."""
    from sklearn.exceptions import ConvergenceWarning  # loading it takes a second
    from sklearn.linear_model import lars_path

    further = exponents_up_to(z.shape[1], order)[len(known) :]
    basis, _ = np.linalg.qr(monomials(z, known))
    columns = _legendre(z, further)
    whole = np.linalg.norm(columns, axis=0)
    columns -= basis @ (basis.T @ columns)
    own = np.linalg.norm(columns, axis=0)
    distinct = own > DEPENDENT * whole
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # of terms that others make up: dropped
        _, active, _ = lars_path(
            columns[:, distinct] / own[distinct], left, method="lar", max_iter=steps, Gram=None
        )
    return [tuple(row) for row in further[distinct][active].tolist()]


def _legendre(z: Array, degrees: Integers) -> Array:
    """Products of Legendre polynomials of the inputs, degrees (t, d): shape (n, t)."""
    each = np.polynomial.legendre.legvander(z, int(degrees.max()))
    terms = np.ones((len(z), len(degrees)))
    for j in range(z.shape[1]):
        terms *= each[:, j, degrees[:, j]]
    return terms


def _parts(degrees: Term) -> list[Term]:
    """Monomials that make up a product of Legendre polynomials: each is even or odd."""
    return list(product(*(range(degree, -1, -2) for degree in degrees)))


class _Grown:
    """A least-squares surface that takes in term by term, fitted to training points and known at all."""

    def __init__(self, values: Array, train: Booleans, most: int) -> None:
        self.terms: list[Term] = []
        self.residual = np.array(values, dtype=np.float64)
        self._train = train
        self._basis = np.empty((len(values), most))  # orthonormal over the training points
        self._rounding = train.sum() * (ROUNDING * np.abs(values).max()) ** 2

    def add(self, term: Term, z: Array) -> None:
        """Take in a term, unless it is there, the limit is reached, or the training points do not determine it."""
        if term in self.terms or len(self.terms) == self._basis.shape[1]:
            return
        column = monomials(z, np.array([term]))[:, 0]
        known, train = self._basis[:, : len(self.terms)], self._train
        whole = np.linalg.norm(column[train])
        for _ in range(2):  # once leaves rounding errors
            column = column - known @ (known[train].T @ column[train])
        own = np.linalg.norm(column[train])
        if own <= DEPENDENT * whole:
            return
        column /= own
        self._basis[:, len(self.terms)] = column
        self.residual -= column * (column[train] @ self.residual[train])
        self.terms.append(tuple(int(power) for power in term))

    def is_exact(self) -> bool:
        """Whether nothing but rounding is left at the training points."""
        left = self.residual[self._train]
        return bool(left @ left <= self._rounding)

    def error(self) -> float:
        """Mean square error at the other points; 0 if there are none."""
        others = self.residual[~self._train]
        return float(others @ others / max(len(others), 1))

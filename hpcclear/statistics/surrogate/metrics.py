"""How well a surrogate reproduces the true function on points it has not seen.

The paper prints two measures whose formulas and text disagree. Both forms of each are computed;
the first of each pair decides, the printed one stands beside it for comparison:

==================  ============================================  ===============
field               formula                                       source
==================  ============================================  ===============
``r2``              1 - sum (f - fhat)^2 / sum (f - mean f)^2     decides
``r2_explained``    sum (fhat - mean f)^2 / sum (f - mean f)^2    eq. 26, printed
``rmae``            max abs(f - fhat) / standard deviation of f   decides
``rmae_mean``       max abs(f - fhat) / abs(mean f)               eq. 27, printed
==================  ============================================  ===============

The printed R2 can pass 1: it rewards predictions that scatter more than the truth does.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError

ROUNDING = 32.0 * np.finfo(np.float64).eps
"""Relative rounding that computed values are taken to carry: differences below it mean nothing."""


@dataclass(frozen=True)
class Accuracy:
    """Accuracy on test points; see the module's table for the formulas.

    Attributes
    ----------
    r2, r2_explained, rmae, rmae_mean : float
        Without unit; NaN where the test values do not vary (or, for `rmae_mean`, have mean 0).
    rmse : float
        Root mean square error, in the unit of the function.
    n_test : int
        Test points that counted.
    constant : bool
        The test values are equal up to rounding, so that R2 and RMAE are undefined.
    scale : float
        Largest magnitude of the test values, in the unit of the function.
    """

    r2: float
    r2_explained: float
    rmae: float
    rmae_mean: float
    rmse: float
    n_test: int
    constant: bool
    scale: float

    def meets(self, r2_min: float, rmae_max: float) -> bool:
        """Whether ``r2 >= r2_min`` and ``rmae <= rmae_max``.

        A constant leaves nothing to explain: it is met by reproducing it up to rounding.
        """
        if self.constant:
            return bool(self.rmse <= 4.0 * ROUNDING * self.scale)
        return bool(self.r2 >= r2_min and self.rmae <= rmae_max)


def accuracy(values: ArrayLike, predictions: ArrayLike) -> Accuracy:
    """Compare predictions with simulated values (eqs. 26 and 27, both readings).

    Parameters
    ----------
    values : array_like, shape (n,)
        Simulated values; those that are not finite are failed simulations, which are dropped.
    predictions : array_like, shape (n,)
        Predictions at the same points, in the same unit.

    Returns
    -------
    Accuracy

    Raises
    ------
    InputError
        If fewer than two simulated values are finite.

    Notes
    -----
    The standard deviation divides by n, so that ``1 - r2 == (rmse / standard deviation)**2``.
    """
    true, predicted = np.asarray(values, float), np.asarray(predictions, float)
    finite = np.isfinite(true)
    n_dropped = int(np.count_nonzero(~finite))
    true, predicted = true[finite], predicted[finite]
    if true.size < 2:
        raise InputError(
            "test points",
            true.size,
            f"accuracy needs at least two finite test values, {n_dropped} failed",
            "use more test points or correct the failing simulations",
        )
    error, mean = true - predicted, float(true.mean())
    scale = float(np.abs(true).max())
    constant = bool(np.ptp(true) <= ROUNDING * scale)
    # dividing by NaN, not by 0: an undefined measure must not look like a number
    total = np.nan if constant else float(np.sum((true - mean) ** 2))
    deviation = np.sqrt(total / true.size)
    worst = float(np.abs(error).max())
    return Accuracy(
        r2=float(1.0 - np.sum(error**2) / total),
        r2_explained=float(np.sum((predicted - mean) ** 2) / total),
        rmae=float(worst / deviation),
        rmae_mean=worst / abs(mean) if mean != 0.0 else float("nan"),
        rmse=float(np.sqrt(np.mean(error**2))),
        n_test=int(true.size),
        constant=constant,
        scale=scale,
    )


def leave_one_out(residuals: ArrayLike, leverages: ArrayLike) -> Array:
    """Errors at each point of the linear least-squares fit made without it.

    No refit is needed: the error is ``residual / (1 - leverage)``, the leverage being the diagonal
    of the hat matrix (Allen 1974, DOI 10.1080/00401706.1974.10489157).

    Parameters
    ----------
    residuals, leverages : array_like, shape (n,)
        Residuals of the full fit in the unit of the function, and leverages in [0, 1].

    Returns
    -------
    numpy.ndarray, shape (n,)
        NaN where the leverage is 1: the fit without that point does not exist.
    """
    remaining = 1.0 - np.asarray(leverages, float)
    return np.asarray(residuals, float) / np.where(remaining > ROUNDING, remaining, np.nan)

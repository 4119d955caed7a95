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

    `r2`, `r2_explained`, `rmae` and `rmae_mean` have no unit, and are NaN where the test values do not vary (or, for
    `rmae_mean`, have mean 0); `rmse`: root mean square error, `scale`: largest magnitude of the test values, both in the unit
    of the function; `constant`: the test values are equal up to rounding, so that R2 and RMAE are undefined.
    """

    r2: float
    r2_explained: float
    rmae: float
    rmae_mean: float
    rmse: float
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
    """Compare predictions (n,) with simulated values (n,), eqs. 26 and 27, both readings; values that are not finite are
    dropped.

    The standard deviation divides by n, so that ``1 - r2 == (rmse / standard deviation)**2``. Raises InputError if fewer than
    two simulated values are finite.
    """
    true, predicted = np.asarray(values, float), np.asarray(predictions, float)
    finite = np.isfinite(true)
    n_dropped = int(np.count_nonzero(~finite))
    true, predicted = true[finite], predicted[finite]
    if true.size < 2:
        reason = f"accuracy needs at least two finite test values, {n_dropped} failed"
        remedy = "use more test points or correct the failing simulations"
        raise InputError("test points", true.size, reason, remedy)
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
        constant=constant,
        scale=scale,
    )


def leave_one_out(residuals: ArrayLike, leverages: ArrayLike) -> Array:
    """Errors (n,) at each point of the linear least-squares fit made without it; NaN where the leverage is 1: there is no
    such fit.

    No refit is needed: the error is ``residual / (1 - leverage)``, the leverage being the diagonal
    of the hat matrix (Allen 1974, DOI 10.1080/00401706.1974.10489157).
    """
    remaining = 1.0 - np.asarray(leverages, float)
    return np.asarray(residuals, float) / np.where(remaining > ROUNDING, remaining, np.nan)

"""The normal distribution cut off: what the sampling of scenes and the moments of surrogates share."""

import numpy as np

from hpcclear.base.arrays import Array

TAIL = 6.0
"""A normal input counts up to this many standard deviations: 2e-9 of it lies beyond, and is
clipped."""


def truncated_quantile(chance: Array, low: float, high: float) -> Array:
    """Quantiles of the standard normal truncated at two bounds, by inversion.

    Parameters
    ----------
    chance : array of any shape
        Probabilities, between 0 and 1.
    low, high : float
        The bounds, in standard deviations, low < 0 < high.

    Returns
    -------
    array of that shape
        In standard deviations, within the bounds.
    """
    from scipy.special import ndtr, ndtri  # a quarter of a second that a Latin hypercube saves

    below = ndtr(low)
    share = 1 - (below + ndtr(-high))
    return np.clip(ndtri(below + share * chance), low, high)

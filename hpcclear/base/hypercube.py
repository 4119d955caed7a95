"""Latin hypercubes: what designs of a scene and of a surrogate are drawn from."""

import numpy as np

from hpcclear.base.arrays import Array


def unit_lhs(samples: int, dimensions: int, rng: np.random.Generator) -> Array:
    """Return a Latin hypercube in the unit cube: each of `samples` equal strata of each axis holds one point.

    Parameters
    ----------
    samples, dimensions : int
        Shape (n, d) of the result.
    rng : Generator
        Source of randomness; it is advanced.

    References
    ----------
    McKay, Beckman, Conover (1979), doi:10.1080/00401706.1979.10489755.
    """
    from scipy.stats import qmc  # most of a second to import; a single response needs none of it

    return qmc.LatinHypercube(dimensions, rng=rng).random(samples)

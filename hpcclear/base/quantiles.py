"""Distributions by their quantile functions: what the sampling of scenes and the moments of surrogates share.

Whatever draws probabilities, independent, stratified or of a Sobol sequence, makes values of them here. Distributions by
a formula are cut off where a normal is (`TAIL`): 1e-9 of each lies beyond either way, and is clipped.

Sources: N. L. Johnson, S. Kotz and N. Balakrishnan, "Continuous Univariate Distributions" (1994, 1995); the functions
themselves are those of scipy.stats and scipy.special.
"""

from dataclasses import dataclass
from functools import cached_property
from math import inf
from typing import Any, Protocol

import numpy as np

from hpcclear.base.arrays import Array

TAIL = 6.0
"""A normal input counts up to this many standard deviations: 2e-9 of it lies beyond, and is clipped."""


class Quantiles(Protocol):
    """A distribution of a number or of its offset."""

    @property
    def span(self) -> tuple[float, float]:
        """Least and largest value that counts."""
        ...

    def __hash__(self) -> int: ...

    def __call__(self, chance: Array) -> Array:
        """Values below which a share `chance` lies, of any shape, strictly between 0 and 1."""
        ...


@dataclass(frozen=True)
class Uniform:
    """Uniform within `reach` of `middle`."""

    middle: float
    reach: float

    @property
    def span(self) -> tuple[float, float]:
        """Least and largest value."""
        return self.middle - self.reach, self.middle + self.reach

    def __call__(self, chance: Array) -> Array:
        """Quantiles, of any shape."""
        return self.middle + self.reach * (2 * chance - 1)


@dataclass(frozen=True)
class Normal:
    """Normal about `middle`, cut off at `reach` from it; infinite for the whole of it."""

    middle: float
    deviation: float
    reach: float = inf

    @property
    def span(self) -> tuple[float, float]:
        """Least and largest value that counts."""
        reach = TAIL * self.deviation if self.reach == inf else self.reach
        return self.middle - reach, self.middle + reach

    def __call__(self, chance: Array) -> Array:
        """Quantiles, of any shape."""
        from scipy.special import ndtr, ndtri  # a quarter of a second, which "lhs" does not need

        if self.reach == inf:
            return np.asarray(self.middle + self.deviation * np.clip(ndtri(chance), -TAIL, TAIL))
        cut = self.reach / self.deviation
        below = ndtr(-cut)
        normal = np.clip(ndtri(below + (1 - 2 * below) * chance), -cut, cut)
        return np.asarray(self.middle + self.deviation * normal)


@dataclass(frozen=True)
class Empirical:
    """Each of some values with equal chance, shape (n,), in rising order: the empirical quantile function."""

    values: tuple[float, ...]

    @property
    def span(self) -> tuple[float, float]:
        """Least and largest value."""
        return self.values[0], self.values[-1]

    def __call__(self, chance: Array) -> Array:
        """Quantiles, of any shape."""
        count = len(self.values)
        return np.array(self.values)[np.minimum((chance * count).astype(np.int64), count - 1)]


@dataclass(frozen=True)
class Scaled:
    """A distribution in shares of something of size `factor`."""

    law: Quantiles
    factor: float

    @property
    def span(self) -> tuple[float, float]:
        """Least and largest value."""
        low, high = self.law.span
        return self.factor * low, self.factor * high

    def __call__(self, chance: Array) -> Array:
        """Quantiles, of any shape."""
        return self.factor * self.law(chance)


class Cut:
    """A distribution in scipy's shape, truncated at two bounds."""

    lower: float
    upper: float
    """lower and upper: where it is cut off; infinite for the whole of it."""
    whole: Any
    """All of it: ``ppf``, and ``cdf`` where it is cut off; of arrays."""

    @cached_property
    def chances(self) -> tuple[float, float]:
        """Probabilities of lying below either limit."""
        if (self.lower, self.upper) == (-inf, inf):
            return 0.0, 1.0
        return float(self.whole.cdf(self.lower)), float(self.whole.cdf(self.upper))

    @cached_property
    def span(self) -> tuple[float, float]:
        """Least and largest value that counts."""
        from scipy.special import ndtr

        rare = ndtr(-TAIL)
        upper = self.whole.isf(rare) if hasattr(self.whole, "isf") else self.whole.ppf(1 - rare)
        return max(float(self.whole.ppf(rare)), self.lower), min(float(upper), self.upper)

    def __call__(self, chance: Array) -> Array:
        """Quantiles, of any shape."""
        below, above = self.chances
        return np.clip(self.whole.ppf(below + chance * (above - below)), *self.span)


@dataclass(frozen=True, eq=False)  # what a plug-in made need not be comparable
class Foreign(Cut):
    """One that a plug-in made."""

    whole: Any
    lower: float = -inf
    upper: float = inf


@dataclass(frozen=True)
class Named(Cut):
    """One of scipy.stats."""

    name: str
    parameters: tuple[tuple[str, float], ...]
    """By their names there."""
    lower: float = -inf
    upper: float = inf

    @cached_property
    def whole(self) -> Any:
        """All of it."""
        from scipy import stats  # most of a second, which few scenes need

        return getattr(stats, self.name)(**dict(self.parameters))

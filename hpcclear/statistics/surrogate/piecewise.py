"""A surrogate over a wide domain as a set of models, each on its own subinterval of the inputs.

The domain is cut into prod_i L_i / L'_i boxes (L_i the length of an input's interval, L'_i that of
its subintervals). A query uses the model of the box it is in. A single model is the case of one box.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hpcclear.statistics.surrogate.kriging import Kriging
from hpcclear.statistics.surrogate.leaf import inside
from hpcclear.statistics.surrogate.regression import Regression

Leaf = Kriging | Regression
"""A model fitted to points in a box."""


@dataclass(frozen=True, eq=False)
class Piecewise:
    """Models of one kind on boxes that tile a domain, all with the same names.

    `accepted` (leaves,): whether each met the targets on its own test points, a False is the best within the allowed number of
    pieces.
    """

    leaves: tuple[Leaf, ...]
    accepted: np.ndarray

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the inputs."""
        return self.leaves[0].names

    @cached_property
    def _corners(self) -> tuple[np.ndarray, np.ndarray]:
        return np.array([k.lower for k in self.leaves]), np.array([k.upper for k in self.leaves])

    @cached_property
    def lower(self) -> np.ndarray:
        """Lower corner of the domain, ``(d,)``."""
        return np.asarray(self._corners[0].min(axis=0))

    @cached_property
    def upper(self) -> np.ndarray:
        """Upper corner of the domain, ``(d,)``."""
        return np.asarray(self._corners[1].max(axis=0))

    def locate(self, points: np.ndarray) -> np.ndarray:
        """Index of the box that each of ``(n, d)`` points is in; a border belongs to the upper box.

        Raises InputError: a point lies outside the domain.
        """
        points = inside(points, self.names, self.lower, self.upper)
        points = np.clip(points, self.lower, self.upper)  # round-off beyond the outer border
        index = np.full(len(points), -1)
        for k, (low, high) in enumerate(zip(*self._corners, strict=True)):
            below = (points < high) | (high == self.upper)
            index[((points >= low) & below).all(axis=1)] = k
        return index

    @property
    def separable(self) -> bool:
        """Whether moments have a tensor rule: not where the model jumps between boxes."""
        return len(self.leaves) == 1 and self.leaves[0].separable

    def predict(self, points: np.ndarray) -> np.ndarray:
        """Values at ``(n, d)`` points, each by its box's model; InputError outside the domain."""
        if len(self.leaves) == 1:
            return self.leaves[0].predict(points)
        index = self.locate(points)
        points, out = np.asarray(points, dtype=np.float64), np.empty(len(index))
        for k in np.unique(index):
            leaf, here = self.leaves[k], index == k
            out[here] = leaf.predict(np.clip(points[here], leaf.lower, leaf.upper))
        return out

    def moments(self, points: np.ndarray) -> np.ndarray | None:
        """Mean and standard deviation of n designs, ``(n, s, d)`` to ``(n, 2)``, where a model in one piece has its own; else
        None."""
        return self.leaves[0].moments(points) if len(self.leaves) == 1 else None

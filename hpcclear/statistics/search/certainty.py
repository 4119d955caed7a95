"""Fronts of two objectives that are known with errors: what is surely better, and what is one."""

import moocore
import numpy as np

from hpcclear.base.arrays import Array, Booleans
from hpcclear.statistics.random.replicates import surely_less


class Compared:
    """Designs whose objectives were estimated from the same replicates, pair by pair.

    Parameters
    ----------
    values : array, shape (n, 2)
        Objectives, both minimised; a design with NaN is never on a front.
    shifts : array, shape (2, n, r)
        Influence of each replicate (`hpcclear.statistics.random.replicates.Estimate`).
    confidence : float
        Level of each comparison.

    Attributes
    ----------
    less : array, shape (2, n, n)
        Whether design i is surely less than design j in an objective.
    """

    def __init__(self, values: Array, shifts: Array, confidence: float) -> None:
        self.values = values
        self.less = np.stack([surely_less(values[:, j], shifts[j], confidence) for j in range(2)])
        self.known = np.isfinite(values).all(axis=1)

    @property
    def one(self) -> Booleans:
        """Whether two designs cannot be told apart in either objective, (n, n)."""
        either = self.less[0] | self.less[1]
        return ~(either | either.T)

    @property
    def traded(self) -> Booleans:
        """Whether each of two designs is surely better in one objective, (n, n)."""
        pairs: Booleans = self.less[0] & self.less[1].T
        return pairs | pairs.T

    @property
    def beaten(self) -> Booleans:
        """Whether another design is surely better in both objectives, (n,)."""
        both: Booleans = self.less[0] & self.less[1]
        return np.asarray(both.any(axis=0))

    def best(self, objective: int) -> int:
        """The design with the least of an objective; of those that cannot be told from it, the best in the other.

        Raises
        ------
        ValueError
            If no design has objectives.
        """
        own = np.where(self.known, self.values[:, objective], np.inf)
        least = int(own.argmin())
        level = self.known & ~self.less[objective][least]
        level[least] = True
        return int(np.where(level, self.values[:, 1 - objective], np.inf).argmin())

    def front(self, size: int) -> list[int]:
        """At most `size` designs, the two best first, each surely better than each other in one objective.

        Those between are the ones farthest from all that were taken, objectives scaled to their extent.
        """
        taken = [self.best(0)]
        if self.traded[taken[0], self.best(1)]:
            taken.append(self.best(1))
        rows = np.flatnonzero(self.known)
        rows = rows[moocore.is_nondominated(self.values[rows])]
        extent = np.ptp(self.values[taken], axis=0)
        places = self.values / np.where(extent > 0.0, extent, 1.0)
        while len(taken) < size:
            rows = rows[self.traded[np.ix_(rows, taken)].all(axis=1)]
            if len(rows) == 0:
                break
            gaps = np.linalg.norm(places[rows, None] - places[taken], axis=2).min(axis=1)
            taken.append(int(rows[gaps.argmax()]))
        return taken

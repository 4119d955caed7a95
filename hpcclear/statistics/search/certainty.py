"""Fronts of objectives that are known with errors: what is significantly better, and what is one."""

import moocore
import numpy as np

from hpcclear.base.arrays import Array, Booleans
from hpcclear.statistics.random.replicates import surely_less


class Compared:
    """Designs whose objectives were estimated from the same replicates, pair by pair.

    `values` (n, m): objectives, all minimised; a design with NaN is never on a front. `shifts` (m, n, r): influence of each
    replicate (`hpcclear.statistics.random.replicates.Estimate`). `confidence`: of each comparison. `near` (m,): by how much
    designs may differ in each objective to be called equally good, however little is known of them. `less` (m, n, n): whether
    design i is significantly less than design j in an objective.
    """

    def __init__(
        self, values: Array, shifts: Array, confidence: float, near: Array | None = None
    ) -> None:
        self.values, self._near = values, near
        self.less = np.stack(
            [surely_less(one, its, confidence) for one, its in zip(values.T, shifts, strict=True)]
        )
        self._any_less: Booleans = np.asarray(self.less.any(axis=0))
        self.known = np.isfinite(values).all(axis=1)

    @property
    def one(self) -> Booleans:
        """Whether two designs are statistically indistinguishable in any objective, (n, n)."""
        return ~(self._any_less | self._any_less.T)

    @property
    def traded(self) -> Booleans:
        """Whether each of two designs is significantly better in some objective, (n, n)."""
        return self._any_less & self._any_less.T

    @property
    def beaten(self) -> Booleans:
        """Whether another design is significantly better in all objectives, (n,)."""
        return np.asarray(self.less.all(axis=0).any(axis=0))

    def best(self, objective: int) -> int:
        """The design with the least of an objective; of those that are statistically indistinguishable from it, and no more
        than `near` above it, the best in the others, one after the other in their order. Raises ValueError if no design has
        objectives.
        """
        level = self.known
        *earlier, last = sorted(range(len(self.less)), key=lambda k: (k != objective, k))
        for k in earlier:
            least = int(np.where(level, self.values[:, k], np.inf).argmin())
            level = level & ~self.less[k][least]
            if self._near is not None:
                level &= self.values[:, k] <= self.values[least, k] + self._near[k]
            level[least] = True
        return int(np.where(level, self.values[:, last], np.inf).argmin())

    def front(self, size: int) -> list[int]:
        """At most `size` designs, the best of each objective first, each significantly better than each other in some
        objective.

        Those between are the ones farthest from all that were taken, objectives scaled to their extent.
        """
        taken = [self.best(0)]
        for objective in range(1, len(self.less)):
            best = self.best(objective)
            if self.traded[best, taken].all():
                taken.append(best)
        # one that is nowhere worse
        behind = (self._any_less & ~self._any_less.T)[self.known].any(axis=0)
        rows = np.flatnonzero(self.known & ~behind)
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

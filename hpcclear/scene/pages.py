"""Monte Carlo points of a study by index, made on request."""

from collections import OrderedDict

import numpy as np

from hpcclear.base.arrays import Array, Integers
from hpcclear.scene.points import Points
from hpcclear.scene.sampling import monte_carlo
from hpcclear.scene.scene import Scene

_PAGE = 4096  # points made at a time
_PAGES = 8  # pages kept, since neighbouring ranks ask for neighbouring points


class MonteCarloPoints:
    """The study's Monte Carlo points by index, generated on request and not stored.

    Parameters
    ----------
    scene : Scene
        With a study.
    total : int
        Number of points.
    """

    def __init__(self, scene: Scene, total: int) -> None:
        self._scene, self._total = scene, total
        self._pages: OrderedDict[int, Points] = OrderedDict()

    def __len__(self) -> int:
        return self._total

    def page(self, number: int) -> Points:
        """Points `number` * 4096 and on, at most 4096 of them."""
        if number not in self._pages:
            first = number * _PAGE
            count = min(_PAGE, self._total - first)
            self._pages[number] = monte_carlo(self._scene, count, first=first)
            if len(self._pages) > _PAGES:
                self._pages.popitem(last=False)
        self._pages.move_to_end(number)
        return self._pages[number]

    def __getitem__(self, index: Integers) -> Array:
        index = np.asarray(index, np.int64)
        values = np.empty((index.size, len(self.page(0).names)))
        numbers = index // _PAGE
        for number in np.unique(numbers).tolist():
            here = numbers == number
            values[here] = self.page(number).values[index[here] - number * _PAGE]
        return values

"""Children of the best designs known: where particles of the swarm continue from that leave their flight.

Positions (n, d) lie in the unit cube and stay there. Every function draws its numbers from `rng`, always as many for as
many rows.
"""

import numpy as np
from numpy.typing import NDArray

from hpcclear.base.arrays import Array

CROSSOVER_INDEX = 15.0
"""Of simulated binary crossover; larger is nearer to the parents."""
STEP = 0.5
"""Of the difference of two members, in steps along the front."""
DRAWN = 20
"""Members drawn at random of which the nearest is taken for a neighbour."""


def mixed(first: Array, second: Array, rng: np.random.Generator) -> Array:
    """Each coordinate (n, d) from either parent."""
    return np.where(rng.random(second.shape) < 0.5, first, second)


def crossed(first: Array, second: Array, rng: np.random.Generator) -> Array:
    """Simulated binary crossover (Deb & Agrawal 1995) of half the coordinates: the children (n, d) near `first`."""
    u = rng.random(first.shape)
    power = 1.0 / (CROSSOVER_INDEX + 1.0)
    spread = np.where(u < 0.5, 2.0 * u, 1.0 / (2.0 * (1.0 - u))) ** power
    child = 0.5 * ((1.0 + spread) * first + (1.0 - spread) * second)
    return np.clip(np.where(rng.random(first.shape) < 0.5, child, first), 0.0, 1.0)


def stepped(
    elite: Array, places: Array, first: NDArray[np.intp], rng: np.random.Generator
) -> Array:
    """A step from each row `first` (n,) of `elite` (k, d) along the set that the elite's designs make.

    The step is the difference of two neighbours, as in differential evolution (Storn & Price 1997,
    doi:10.1023/A:1008202821328): it goes along borders that no coordinate is parallel to, and shrinks as the
    set grows dense. Neighbours by `places` (k, m).
    """
    one, other = _neighbour(places, first, rng), _neighbour(places, first, rng)
    return np.clip(elite[first] + STEP * (elite[one] - elite[other]), 0.0, 1.0)


def _neighbour(places: Array, of: NDArray[np.intp], rng: np.random.Generator) -> NDArray[np.intp]:
    """A row near each row `of`: the nearest of a few drawn at random."""
    drawn = rng.integers(len(places), size=(len(of), DRAWN))
    away = ((places[drawn] - places[of][:, None]) ** 2).sum(axis=2)
    return drawn[np.arange(len(of)), away.argmin(axis=1)]


def mutated(unit: Array, index: float, rng: np.random.Generator) -> Array:
    """Polynomial mutation (Deb & Goyal 1996) of positions (n, d), in one coordinate on average."""
    hit = rng.random(unit.shape) < 1.0 / unit.shape[1]
    u = rng.random(unit.shape)[hit]
    x = unit[hit]
    power = 1.0 / (index + 1.0)
    down = (2.0 * u + (1.0 - 2.0 * u) * (1.0 - x) ** (index + 1.0)) ** power - 1.0
    up = 1.0 - (2.0 * (1.0 - u) + (2.0 * u - 1.0) * x ** (index + 1.0)) ** power
    result = unit.copy()
    result[hit] = np.clip(x + np.where(u < 0.5, down, up), 0.0, 1.0)
    return result


def renewed(unit: Array, share: float, rng: np.random.Generator) -> Array:
    """A share of the positions (n, d) with one coordinate anew from its whole range."""
    result = unit.copy()
    wild = np.flatnonzero(rng.random(len(unit)) < share)
    result[wild, rng.integers(unit.shape[1], size=len(wild))] = rng.random(len(wild))
    return result

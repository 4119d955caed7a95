"""Copies of a sample that start a little beside it, and how far they come apart.

Where motion is regular they come together again; where it is chaotic they part until each sees another segment of the
same motion, and their averages are independent of each other.
"""

from functools import cache

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.dynamics.layout.views import Parameters, Start
from hpcclear.dynamics.planar.tolerances import LENGTH
from hpcclear.dynamics.setup.problem import coordinate_count
from hpcclear.scene import Scene

PERTURBATION = 1e-5  # size of the perturbations, relative to `scales`: 10 nm, 10 um/s


def scales(scene: Scene, par: Array) -> Array:
    """Size of coordinates, then velocities, of a sample, (2 n,): 1 mm, 0.01 rad and what tolerances hold equal to these."""
    return LENGTH * Parameters(par).tolerances(coordinate_count(scene))


@cache
def direction(number: int, length: int) -> Array:
    """A random direction, shape (length,), the same for equal numbers."""
    drawn = np.random.default_rng([0x6B69636B, number]).standard_normal(length)
    return drawn / np.sqrt(np.mean(drawn**2))


def perturbed(start: Start, scale: Array, numbers: range, size: float = PERTURBATION) -> Start:
    """Copies of one start, perturbed in the directions of their numbers; number 0 stays as it is.

    `size`: root mean square of a perturbation over `scale` (2 n,), that of `scales`.
    """
    n = len(scale) // 2
    copies = Start(np.repeat(start.rows, len(numbers), axis=0))
    for row, number in enumerate(numbers):
        if number:
            perturbation = size * scale * direction(number, 2 * n)
            copies.coordinates(n)[row] += perturbation[:n]
            copies.velocities(n)[row] += perturbation[n:]
    return copies


def separation(first: Start, second: Start, scale: Array) -> Array:
    """Distance of two states over scale, root mean square, shape (rows,)."""
    n = len(scale) // 2
    return np.sqrt(np.mean(((second.state(n) - first.state(n)) / scale) ** 2, axis=-1))

"""How much is measured: a quick look in under a minute, or the whole picture."""

from dataclasses import dataclass

import numpy as np

Variables = dict[str, np.ndarray]
"""What a panel found: variables of a file of kind ``accuracy`` by their names, shapes as there."""


@dataclass(frozen=True)
class Profile:
    """Sizes of every panel; of the whole picture, unless said otherwise."""

    name: str = "full"
    tolerances: tuple[float, ...] = tuple(10.0**-k for k in range(3, 13))
    """Tolerances of the ladder, loosest first."""
    designs: int = 4
    """Designs near the scene that each method integrates; errors are root mean squares over them."""
    repeats: int = 7
    """Runs that each timing is the median of."""
    outside_repeats: int = 3
    """The same for methods written in Python."""
    more_methods: bool = True
    """Whether the methods that have to be compiled for this panel alone take part."""
    revolutions: int = 1000
    """Of the long runs of the averaging panel."""
    copies: int = 32
    """Long runs that differ by tiny perturbations at their start."""
    segments: int = 64
    """Of ten revolutions, of each copy at each tolerance, in the panel of tolerance and revolutions."""
    training: tuple[int, ...] = (25, 50, 100, 200, 400)
    """Sample sizes of the surrogates."""
    tests: int = 200
    """Points the surrogates are tested on."""
    draws: tuple[int, ...] = tuple(4**k for k in range(2, 10))
    """Monte Carlo sizes on the surrogate."""
    blocks: int = 32
    """Monte Carlo samples of each size; the error is their root mean square."""
    simulations: int = 8192
    """Direct simulations, shared out into samples of each size."""
    strong_seconds: float = 10.0
    """Core-seconds of the batch whose speed-up is measured."""


QUICK = Profile(
    name="quick",
    tolerances=tuple(10.0**-k for k in range(3, 12, 2)),
    designs=2,
    repeats=3,
    outside_repeats=1,
    more_methods=False,
    revolutions=160,
    copies=16,
    segments=16,
    training=(25, 50, 100),
    tests=100,
    draws=tuple(4**k for k in range(2, 7)),
    blocks=16,
    simulations=512,
    strong_seconds=1.0,
)

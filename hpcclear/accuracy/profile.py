"""How much is measured: a quick look in under a minute, or the whole picture."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Profile:
    """Sizes of every panel."""

    name: str
    rungs: tuple[float, ...]
    """Tolerances of the ladder, loosest first."""
    designs: int
    """Designs near the scene that each method integrates; errors are root mean squares over them."""
    repeats: int
    """Runs that each timing is the median of."""
    outside_repeats: int
    """The same for methods written in Python."""
    more_methods: bool
    """Whether the methods that have to be compiled for this panel alone take part."""
    revolutions: int
    """Of the long runs of the averaging panel."""
    copies: int
    """Long runs that differ by tiny kicks at their start."""
    stretches: int
    """Of ten revolutions, of each copy at each tolerance, in the panel of tolerance and revolutions."""
    training: tuple[int, ...]
    """Sample sizes of the surrogates."""
    tests: int
    """Points the surrogates are tested on."""
    draws: tuple[int, ...]
    """Monte Carlo sizes on the surrogate."""
    blocks: int
    """Monte Carlo samples of each size; the error is their root mean square."""
    simulations: int
    """Direct simulations, shared out into samples of each size."""
    strong_seconds: float
    """Core-seconds of the batch whose speed-up is measured."""


QUICK = Profile(
    name="quick",
    rungs=tuple(10.0**-k for k in range(3, 12, 2)),
    designs=2,
    repeats=3,
    outside_repeats=1,
    more_methods=False,
    revolutions=160,
    copies=16,
    stretches=16,
    training=(25, 50, 100),
    tests=100,
    draws=tuple(4**k for k in range(2, 7)),
    blocks=16,
    simulations=512,
    strong_seconds=1.0,
)

FULL = Profile(
    name="full",
    rungs=tuple(10.0**-k for k in range(3, 13)),
    designs=4,
    repeats=7,
    outside_repeats=3,
    more_methods=True,
    revolutions=1000,
    copies=32,
    stretches=64,
    training=(25, 50, 100, 200, 400),
    tests=200,
    draws=tuple(4**k for k in range(2, 10)),
    blocks=32,
    simulations=8192,
    strong_seconds=10.0,
)

PROFILES = {profile.name: profile for profile in (QUICK, FULL)}

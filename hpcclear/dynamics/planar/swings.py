"""How fast the modes of bars that bend swing, and what tolerances that requires."""

import numpy as np

from hpcclear.dynamics.linkage.bending import bar_of, numbers
from hpcclear.dynamics.linkage.mechanism import Mechanism

STIFF = 2e4
"""Radians that the fastest mode swings in a revolution, from which "auto" takes implicit steps.

Explicit ones are then limited to some 2 of these, and contacts need a thousand steps a revolution. Steps that switch are no
help: they come back too often."""


def swings(mechanism: Mechanism) -> tuple[float, ...]:
    """Angular frequencies of all modes, each of its bar held at both ends, rad/s, in the order of the coordinates."""
    found: list[float] = []
    for body in mechanism.bodies:
        if body.bending is not None:
            own = numbers(bar_of(body), body.bending.modes)
            modes = range(1, body.bending.modes + 1)
            found += [float(np.sqrt(own[f"stiffness_{k}"] / own["mass"])) for k in modes]
    return tuple(found)


def tolerances(mechanism: Mechanism, length: float, speed: float) -> tuple[float, ...]:
    """Absolute tolerances of amplitudes beside those of lengths (m) and velocities (m/s): however stiff a mode is, an error of
    its amplitude holds no more energy than one of its velocity."""
    return tuple(min(length, speed / rate) for rate in swings(mechanism))

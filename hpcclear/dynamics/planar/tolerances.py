"""Absolute tolerances of all coordinates, bristles of friction and modes of bending among them."""

import numpy as np

from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.bending import numbers
from hpcclear.dynamics.linkage.mechanism import Mechanism
from hpcclear.dynamics.planar.problem import driven_length, is_prescribed, linkage_of
from hpcclear.laws.numbers import evaluate
from hpcclear.scene import Scene

SMOOTH = 1e-299
"""Steepness of a film that bounds no step: with bristles, too, implicit steps go by the exponent of smooth motions. That halves
them, and leaves f within some 1e-7 and the energy balance within 1e-7 at rtol 1e-6."""

LENGTH = 1e-3  # m; what the absolute tolerance of lengths refers to

STIFF = 2e4
"""Radians that the fastest mode swings in a revolution, from which "auto" takes implicit steps.

Explicit ones are then limited to some 2 of these, and contacts need a thousand steps a revolution. Steps that switch are no
help: they come back too often."""


def absolute_tolerances(scene: Scene) -> tuple[float, ...]:
    """Absolute tolerances of coordinates, then velocities: a, 10 a/m, 1000 a/s, 50000 a/(m s) with a for lengths.

    With the default a = rtol times 1 mm they stand for 1 mm, 0.01 rad, 1 m/s and 50 rad/s. Where the driven body's points move
    slower than 25 m/s the velocities' are less in proportion: what is small is set by the mechanism's own speed.
    """
    if is_prescribed(scene):
        return ()
    linkage = linkage_of(scene)
    a = scene.numerics.absolute_tolerance
    angles = [one.kind == "angle" for one in linkage.forest.coordinates[scene.modes :]]
    speed = at.TURN / linkage.mechanism.period.seconds * float(driven_length(linkage.mechanism))
    rate = 1e3 * min(1.0, speed / 25.0)
    first, second = _of_bristles(scene, linkage.mechanism.period.seconds)
    # however stiff a mode is, an error of its amplitude holds no more energy than one of its velocity
    bent = [min(a, rate * a / swing) for swing in swings(linkage.mechanism)]
    sizes = (10.0 * a if angle else a for angle in angles)
    speeds = ((50.0 if angle else 1.0) * rate * a for angle in angles)
    return (*first, *bent, *sizes, *second, *(rate * a for _ in bent), *speeds)


def _of_bristles(scene: Scene, period: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Absolute tolerances of the bristles' coordinates, whose velocities are the deflections, and of these.

    The deflection's stand for the largest in steady sliding as those of lengths stand for 1 mm, so friction is as good as
    `rtol`. The coordinates themselves act on nothing: their tolerance is that times a revolution, which no step comes near.
    """
    table = scene.effects.friction
    if not scene.bristles or table.declared.largest is None:
        return (), ()
    largest = float(evaluate(table.declared.largest, table.values()))
    own = scene.numerics.absolute_tolerance / LENGTH * largest
    return (own * period,) * scene.bristles, (own,) * scene.bristles


def swings(mechanism: Mechanism) -> tuple[float, ...]:
    """Angular frequencies of all modes, each of its bar held at both ends, rad/s, in the order of the coordinates."""
    found: list[float] = []
    for body in mechanism.bodies:
        if body.bending is not None:
            own = numbers(body)
            modes = range(1, body.bending.modes + 1)
            found += [float(np.sqrt(own[f"stiffness_{k}"] / own["mass"])) for k in modes]
    return tuple(found)

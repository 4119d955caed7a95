"""Absolute tolerances of all coordinates, bristles of friction and modes of bending among them."""

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.bending import numbers
from hpcclear.dynamics.linkage.mechanism import Mechanism
from hpcclear.dynamics.linkage.parts import Number
from hpcclear.dynamics.planar.problem import linkage_of
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


def tolerances(scene: Scene, sample: Mechanism, p: Array, friction: dict[str, object]) -> Array:
    """Absolute tolerances of coordinates, then velocities, over that of lengths: 1, 10/m, 1000/s, 50000/(m s), (m, 2 n).

    With the default, rtol times 1 mm, they stand for 1 mm, 0.01 rad, 1 m/s and 50 rad/s. Where the driven body's points move
    slower than 25 m/s the velocities' are less in proportion: what is small is set by the sample's own speed.
    Of samples: their mechanisms, parameters (m, PARAMETERS), and numbers of the law of friction.
    """
    angles = [one.kind == "angle" for one in linkage_of(scene).forest.coordinates[scene.modes :]]
    rate = 1e3 * np.minimum(1.0, at.TURN / p[:, at.PERIOD] * p[:, at.DRIVEN_LENGTH] / 25.0)
    bristles = scene.bristles * [_of_bristles(scene, friction)]
    # however stiff a mode is, an error of its amplitude holds no more energy than one of its velocity
    bent = [np.minimum(1.0, rate / swing) for swing in swings(sample)]
    sizes = (10.0 if angle else 1.0 for angle in angles)
    speeds = ((50.0 if angle else 1.0) * rate for angle in angles)
    first = (one * p[:, at.PERIOD] for one in bristles)
    rows = *first, *bent, *sizes, *bristles, *(rate for _ in bent), *speeds
    return np.stack(np.broadcast_arrays(*rows), axis=-1)


def _of_bristles(scene: Scene, friction: dict[str, object]) -> Array | float:
    """The tolerance of the bristles' deflections, which are velocities of their coordinates, over that of lengths.

    It stands for the largest in steady sliding as those of lengths stand for 1 mm, so friction is as good as `rtol`. The
    coordinates themselves act on nothing: their tolerance is that times a revolution, which no step comes near.
    """
    largest = scene.effects.friction.declared.largest
    return 1.0 if largest is None else evaluate(largest, friction) / LENGTH


def swings(mechanism: Mechanism) -> tuple[Number, ...]:
    """Angular frequencies of all modes, each of its bar held at both ends, rad/s, in the order of the coordinates."""
    found: list[Number] = []
    for body in mechanism.bodies:
        if body.bending is not None:
            own = numbers(body)
            modes = range(1, body.bending.modes + 1)
            found += [np.sqrt(own[f"stiffness_{k}"] / own["mass"]) for k in modes]
    return tuple(found)

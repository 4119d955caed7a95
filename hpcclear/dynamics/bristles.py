"""Bristles of friction as a scene asks for them: their parameters, their tolerances, and whether there is room for them."""

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.dynamics import layout as at
from hpcclear.scene import Scene

LEAST_RATIO = 1e-3
"""Friction over normal force that the bristles' tolerances stand for where it is less."""

SMOOTH = 1e-299
"""Steepness of a film that limits no step: with bristles, too, implicit steps go by the exponent of smooth motions. That halves
them, and leaves f within some 1e-7 and the energy balance within 1e-7 at rtol 1e-6."""

LENGTH = 1e-3
"""m; what the absolute tolerance of lengths refers to."""


def fill(values: dict[str, Array], p: Array) -> None:
    """Write the rows of all bristles into parameters (m, PARAMETERS); `values`: entries of ``effects.friction`` by name, (m,).

    Bristles of a joint without friction hold nothing: neither their spring nor their damper is there.
    """
    static = values["static_coefficient"]
    holds = static > 0.0
    p[:, at.BRISTLE_STATIC] = static
    p[:, at.BRISTLE_STIFFNESS] = np.where(holds, values["bristle_stiffness"], 0.0)
    p[:, at.BRISTLE_DAMPING] = np.where(holds, values["bristle_damping"], 0.0)
    p[:, at.BRISTLE_INVERSE_SPEED] = 1.0 / values["stribeck_speed"]
    p[:, at.BRISTLE_VISCOUS] = values["viscous_coefficient"]


def tolerances(scene: Scene, period: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Absolute tolerances of the bristles' coordinates, whose velocities are the deflections, and of these.

    The deflection's stand for the largest in steady sliding as those of lengths stand for 1 mm, so friction is as good as
    `rtol`. The coordinates themselves act on nothing: their tolerance is that times a revolution, which no step comes near.
    """
    friction = scene.effects.friction
    if not scene.bristles:
        return (), ()
    assert friction.bristle_stiffness is not None
    assert friction.static_coefficient is not None
    largest = max(friction.static_coefficient, LEAST_RATIO) / friction.bristle_stiffness
    own = scene.numerics.absolute_tolerance / LENGTH * largest
    return (own * period,) * scene.bristles, (own,) * scene.bristles


def check_room(scene: Scene, others: int) -> None:
    """InputError if the kernel has no room for the bristles beside so many coordinates."""
    count = others + scene.bristles
    if scene.bristles and count > at.MAX_COORDINATES:
        raise InputError(
            "effects.friction.law", "lugre",
            f"takes a coordinate for each joint with clearance: {count} in all, and there is room for {at.MAX_COORDINATES}",
            'Take law = "coulomb", or make some of the joints ideal',
        )  # fmt: skip

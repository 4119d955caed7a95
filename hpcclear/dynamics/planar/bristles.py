"""Bristles of friction as a scene requires them: their tolerances, and whether all coordinates fit in the kernel."""

from hpcclear.base.errors import InputError
from hpcclear.dynamics import layout as at
from hpcclear.laws.numbers import evaluate
from hpcclear.scene import Scene

SMOOTH = 1e-299
"""Steepness of a film that bounds no step: with bristles, too, implicit steps go by the exponent of smooth motions. That halves
them, and leaves f within some 1e-7 and the energy balance within 1e-7 at rtol 1e-6."""

LENGTH = 1e-3
"""m; what the absolute tolerance of lengths refers to."""


def tolerances(scene: Scene, period: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Absolute tolerances of the bristles' coordinates, whose velocities are the deflections, and of these.

    The deflection's stand for the largest in steady sliding as those of lengths stand for 1 mm, so friction is as good as
    `rtol`. The coordinates themselves act on nothing: their tolerance is that times a revolution, which no step comes near.
    """
    if not scene.bristles:
        return (), ()
    table = scene.effects.friction
    largest = float(evaluate(table.declared.largest, table.values()))
    own = scene.numerics.absolute_tolerance / LENGTH * largest
    return (own * period,) * scene.bristles, (own,) * scene.bristles


def check_room(scene: Scene, others: int) -> None:
    """InputError if the kernel cannot hold so many coordinates, and the bristles beside them."""
    count = others + scene.bristles
    if count <= at.MAX_COORDINATES:
        return
    most = f"{count} coordinates, of {at.MAX_COORDINATES} at most"
    if others <= at.MAX_COORDINATES:
        raise InputError(
            "effects.friction.law", scene.effects.friction.law, f"needs one for each joint with clearance: {most}",
            'Write law = "coulomb", or make some of the joints ideal',
        )  # fmt: skip
    if scene.numerics.formulation == "baumgarte":
        raise InputError(
            "numerics.formulation", "baumgarte", f"has three for each body: {most}",
            'Write formulation = "minimal", or use fewer bodies',
        )  # fmt: skip
    bodies = len(scene.linkage.bodies)
    raise InputError(
        "mechanism.bodies", bodies, f"have {most}", "Use fewer bodies, joints with clearance or modes of bending"
    )  # fmt: skip

"""How large the time series of a response are, before it is simulated."""

from hpcclear.dynamics.planar.problem import linkage_of, rounds_of
from hpcclear.dynamics.planar.response import pins_of
from hpcclear.scene import Scene

IN_MEMORY = 4.0
"""Memory over what is stored, about: 0.69 GB for a file of 169 MB, of 1000 revolutions of one slider-crank."""

LARGE = 5e7  # bytes of a file from which on its size is printed before a simulation


def kept_revolutions(scene: Scene) -> int:
    """How many revolutions have time series."""
    count = rounds_of(scene)
    return min(count, scene.output.keep_revolutions or count)


def stored_bytes(scene: Scene) -> float:
    """About how many bytes the time series take; 0 where every step is stored, whose number is not known before."""
    mechanism = linkage_of(scene).mechanism
    of_joints = 5 * len(scene.joint_labels)
    if scene.template is not None:
        columns = 19 + of_joints
    else:
        points = sum(len(body.points) for body in mechanism.bodies)
        columns = 12 + of_joints + 6 * len(mechanism.bodies) + 2 * points
        columns += 2 * scene.modes
    columns += 0 if scene.modes else 2 * len(pins_of(mechanism))
    return 8.0 * columns * scene.output.instants_per_revolution * kept_revolutions(scene)


def words(scene: Scene) -> str:
    """The size of a response in words."""
    if scene.numerics.target_error is not None:
        return "of the last revolutions of a steady mean"
    size = stored_bytes(scene)
    if not size:
        return "every accepted step; their size is not known before"
    return (
        f"{kept_revolutions(scene)} revolutions of {scene.output.instants_per_revolution} instants: a file of about "
        f"{1e-6 * size:.3g} MB, about {1e-9 * (0.15e9 + IN_MEMORY * size):.2g} GB of memory (simulate)"
    )

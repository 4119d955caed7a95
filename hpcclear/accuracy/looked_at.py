"""What one revolution is judged by (a body at its end, the peak force, f), and the designs it is judged on."""

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.dynamics import views
from hpcclear.dynamics.bending import bent_motion
from hpcclear.dynamics.layout import TURN
from hpcclear.dynamics.linkage.mechanism import Mechanism
from hpcclear.dynamics.parameters import topology
from hpcclear.dynamics.planar.problem import linkage_of
from hpcclear.scene import Scene
from hpcclear.scene.points import Points

QUANTITIES = ("slider_position", "slider_velocity", "peak_contact_force", "objective")
"""Of a slider-crank."""

OF_A_BODY = ("body_position", "body_velocity", *QUANTITIES[2:])
"""Of a linkage."""

ALONG = (0.6, 0.8)
"""Direction in which a body of a linkage is looked at: along no axis that a guide is likely to have."""

_SLIDER_9 = 5  # slider position among the nine coordinates of the multiplier formulation


def quantities_of(scene: Scene) -> tuple[str, ...]:
    """Names of what methods are compared by, in the order of `methods.Outcome.values`."""
    return OF_A_BODY if scene.is_planar else QUANTITIES


def body_of(mechanism: Mechanism) -> str:
    """The body of a linkage that is looked at: the last one that no drive turns, the last of all if there is none."""
    driven = {drive.body for drive in mechanism.drives}
    free = [body.name for body in mechanism.bodies if body.name not in driven]
    return (free or [body.name for body in mechanism.bodies])[-1]


def neighbours(scene: Scene, count: int) -> Points:
    """The scene and designs beside it: masses growing by 2 % each, so that no result is one lucky number.

    Of the slider, or of the body of a linkage that is looked at.
    """
    path = "mechanism.slider.mass"
    if scene.is_planar:
        path = f"mechanism.bodies.{body_of(linkage_of(scene).mechanism)}.mass"
    mass = scene.number(path) * np.power(1.02, np.arange(count, dtype=float))
    return Points(("m3",), mass[:, None], ((path,),))


def end_of(scene: Scene, par: Array, q: Array, v: Array, phi: float = TURN) -> tuple[float, float]:
    """Position (m) and velocity (m/s) at the end of a revolution, from coordinates and velocities of shape (n,).

    Of the slider along its guide, or of a linkage's body `ALONG` a direction.
    """
    q, v = q[scene.bristles :], v[scene.bristles :]
    if scene.is_planar:
        linkage = linkage_of(scene)
        period = float(views.Parameters(par).period)
        pose, _ = linkage.poses.at(par, q[:, None], v[:, None], period)
        names = [body.name for body in linkage.mechanism.bodies]
        k, (x, y) = names.index(body_of(linkage.mechanism)), ALONG
        position = x * pose.x[k] + y * pose.y[k]
        return float(position[0]), float((x * pose.vx[k] + y * pose.vy[k])[0])
    if scene.numerics.formulation == "baumgarte":
        return float(q[_SLIDER_9]), float(v[_SLIDER_9])
    free = topology(scene)[2]
    omega = v[-1] if free else float(views.Parameters(par).speed)
    if free:
        phi, q, v = q[-1], q[:-1], v[:-1]
    angle, speed = np.array([phi]), np.array([omega])
    m, _ = bent_motion(scene, par, (angle, speed), q[:, None], v[:, None])
    return float(m.slider[0]), float(m.slider_speed[0])

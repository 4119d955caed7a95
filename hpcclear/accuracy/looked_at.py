"""What one revolution is judged by (a body at its end, the peak force, f), and the designs it is judged on."""

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.dynamics.layout import views
from hpcclear.dynamics.linkage.mechanism import Mechanism
from hpcclear.dynamics.planar.problem import linkage_of
from hpcclear.scene import Scene
from hpcclear.scene.points import Points

QUANTITIES = ("slider_position", "slider_velocity", "peak_contact_force", "objective")
"""Of a slider-crank."""

OF_A_BODY = ("body_position", "body_velocity", *QUANTITIES[2:])
"""Of a linkage whose series no template names."""

ALONG = (0.6, 0.8)
"""Direction in which a body of a linkage is looked at: along no axis that a guide is likely to have."""


def body_of(mechanism: Mechanism) -> str:
    """The body of a linkage that is looked at: the last one that no drive turns, the last of all if there is none."""
    driven = {drive.body for drive in mechanism.drives}
    free = [body.name for body in mechanism.bodies if body.name not in driven]
    return (free or [body.name for body in mechanism.bodies])[-1]


def mass_of(scene: Scene) -> str:
    """Path of the mass of the body that is looked at."""
    path = f"mechanism.bodies.{body_of(linkage_of(scene).mechanism)}.mass"
    return next(one for one in scene.numeric_paths() if scene.path_in_linkage(one) == path)


def neighbours(scene: Scene, count: int) -> Points:
    """The scene and designs beside it: masses growing by 2 % each, so that no result is one lucky number.

    Of the body that is looked at.
    """
    path = mass_of(scene)
    mass = scene.number(path) * np.power(1.02, np.arange(count, dtype=float))
    return Points(("m3",), mass[:, None], ((path,),))


def end_of(scene: Scene, par: Array, q: Array, v: Array) -> tuple[float, float]:
    """Position (m) and velocity (m/s) at the end of a revolution, from coordinates and velocities of shape (n,).

    Of the body that is looked at, `ALONG` a direction; of a slider-crank's slider along its guide, x.
    """
    q, v = q[scene.bristles :], v[scene.bristles :]
    linkage = linkage_of(scene)
    period = float(views.Parameters(par).period)
    pose, _ = linkage.poses.at(par, q[:, None], v[:, None], period)
    names = [body.name for body in linkage.mechanism.bodies]
    k = names.index(body_of(linkage.mechanism))
    x, y = ALONG if scene.template is None else (1.0, 0.0)
    position = x * pose.x[k] + y * pose.y[k]
    return float(position[0]), float((x * pose.vx[k] + y * pose.vy[k])[0])

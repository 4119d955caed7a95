"""Archard's law: from sliding work to worn depths and clearance.

The worn volume of a surface is V = k W, W the integral of F_N |v_t| dt in J and k in m2/N (J. F. Archard, "Contact and
rubbing of flat surfaces", J. Appl. Phys. 24 (1953), doi:10.1063/1.1721448; k = K/H with a dimensionless K and the
hardness H). It is spread evenly over the whole surface as it was when new: the depth is V / (2 pi R L), R_B for the
bearing and R_J for the journal. The true depth of a uniform layer differs from that by its share h / (2 R) of itself.

While a joint runs in, k is larger by a factor that falls with the work done, 1 + (a - 1) exp(-W / W0); of its integral,
W + (a - 1) W0 (1 - exp(-W / W0)), the depths are made.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.scene import Scene
from hpcclear.scene.points import Numbers, Points


@dataclass(frozen=True)
class Joints:
    """Worn joints of one life, or of several; arrays of shape (..., joints)."""

    clearance: Array  # when new, m, as the radius
    bearing_radius: Array
    bearing: Array  # depth of wear for each joule of sliding work, m/J, once run in
    journal: Array
    excess: Array  # a - 1 of running in, 0 without
    fading: Array  # its W0, J, 1 without

    def __getitem__(self, life: object) -> "Joints":
        return Joints(*(array[life] for array in vars(self).values()))

    @property
    def slope(self) -> Array:
        """Growth of the clearance for each joule once run in, m/J."""
        return self.bearing + self.journal

    def counted(self, work: Array) -> Array:
        """Sliding work (..., joints), J, that joints run in from the start would have to do for the same wear."""
        return work - self.excess * self.fading * np.expm1(-work / self.fading)

    def speed(self, work: Array) -> Array:
        """Growth of the clearance for each joule after `work` (..., joints), J, is done, m/J."""
        return self.slope * (1.0 + self.excess * np.exp(-work / self.fading))

    def grown(self, work: Array, more: Array) -> Array:
        """Growth of the clearance by `more` work after `work` is done, each (..., joints), J; m."""
        early = self.excess * self.fading * np.exp(-work / self.fading)
        return self.slope * (more - early * np.expm1(-more / self.fading))

    def worn(self, work: Array) -> tuple[Array, Array]:
        """Clearance and bearing radius after so much sliding work (J), each of the shape of `work`, m."""
        counted = self.counted(work)
        return self.clearance + self.slope * counted, self.bearing_radius + self.bearing * counted


def joints_of(scene: Scene, points: Points | None) -> Joints:
    """The worn joints of a scene, for each of its points; arrays of shape (points, joints)."""
    get = Numbers(scene, points)
    columns = []
    for name in scene.worn_joints():
        key = scene.joint_key(name)
        clearance, radius = get(f"{key}.clearance"), get(f"{key}.bearing_radius")
        around = 2.0 * math.pi * get(f"{key}.wear.length")
        sizes = ("bearing", radius), ("journal", radius - clearance)
        depths = [_coefficient(scene, get, name, of) / (around * size) for of, size in sizes]
        columns.append((clearance, radius, *depths, *_running_in(scene, get, name)))
    return Joints(*(np.stack(parts, axis=-1) for parts in zip(*columns, strict=True)))


def _running_in(scene: Scene, get: Numbers, joint: str) -> tuple[Array, Array]:
    """Excess factor and work (J) of a joint for each point."""
    wear: Any = scene.clearance_joint(joint).wear
    if wear.running_in is None:
        return np.zeros(get.size), np.ones(get.size)
    key = f"{scene.joint_key(joint)}.wear.running_in"
    return get(f"{key}.factor") - 1.0, get(f"{key}.work")


def _coefficient(scene: Scene, get: Numbers, joint: str, surface: str) -> Array:
    """k of a surface for each point, m2/N; 0 of one that does not wear."""
    wear: object = scene.clearance_joint(joint).wear
    table, key = getattr(wear, surface), f"{scene.joint_key(joint)}.wear.{surface}"
    if table is None:
        return np.zeros(get.size)
    if table.coefficient is not None:
        return get(f"{key}.coefficient")
    return get(f"{key}.dimensionless") / get(f"{key}.hardness")

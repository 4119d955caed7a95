"""Where the points of a linkage are."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.scene.planar import Planar

Pose = tuple[float, float, float]
"""Of a body: its mass centre, m, and its angle, rad."""


class Placed:
    """Where all points of a linkage are."""

    def __init__(self, mechanism: Planar, poses: Mapping[str, Pose]) -> None:
        self.centres = {name: np.array(pose[:2]) for name, pose in poses.items()}
        self.bodies: dict[str, dict[str, Array]] = {}
        self.angles: dict[str, float] = {"ground": 0.0}
        for body in mechanism.bodies:
            x, y, angle = poses[body.name]
            turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
            arms = {n: np.subtract(p, body.own_center) for n, p in body.own_points.items()}
            self.bodies[body.name] = {n: np.array([x, y]) + turn @ arm for n, arm in arms.items()}
            self.angles[body.name] = angle
        self.ground = {one.name: np.array([one.x, one.y]) for one in mechanism.ground.points}
        sliders: list[Any] = [j for j in mechanism.joints if getattr(j, "height", None)]
        ends = [(one, side) for one in sliders for side in (-0.5, 0.5)]
        self._sliders = [self.at(one.point) + side * one.length for one, side in ends]

    def at(self, place: str) -> Array:
        """A place (2,), ``"body.point"``, m."""
        owner, name = place.split(".")
        return self.ground[name] if owner == "ground" else self.bodies[owner][name]

    @property
    def everything(self) -> Array:
        """All points and corners about sliders, shape (points, 2)."""
        groups = [self.ground, *self.bodies.values()]
        return np.array([*(point for group in groups for point in group.values()), *self._sliders])

"""What is not known of a machine: unknowns within bounds, and nuisance inputs with distributions, as places in a unit cube."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.ensemble.api import paths_of
from hpcclear.ensemble.maps import range_of
from hpcclear.identify.signals import Sensor
from hpcclear.scene import Scene
from hpcclear.scene.paths import quantities
from hpcclear.scene.points import Points, check_apart, check_points
from hpcclear.scene.random_inputs import RandomInput
from hpcclear.scene.sampling import offsets


@dataclass(frozen=True)
class Unknown:
    """An entry of the scene to identify, uniform within bounds before anything is measured; SI."""

    name: str
    paths: tuple[str, ...]
    lower: float
    upper: float

    @property
    def unit(self) -> str:
        """SI unit."""
        return str(quantities()[self.paths[0]].unit) or "1"

    @classmethod
    def of(cls, scene: Scene, words: str) -> "Unknown":
        """Return that of ``PATH=LO:HI``; raises InputError where the words are another thing."""
        name, rest = map(str.strip, words.partition("=")[::2])
        ends = rest.split(":")
        if not name or len(ends) != 2:
            remedy = "For example joints.crank_rod.clearance=10um:150um"
            raise InputError("--unknown", words, "is not PATH=LO:HI", remedy)
        paths = paths_of(scene, name)
        return cls(name, paths, *range_of("--unknown", words, ends, scene.unit(paths[0])))


@dataclass(frozen=True)
class Inputs:
    """All that is not known: coordinates of a point of the unit cube are probabilities.

    `random`: inputs of the scene's study that are not known either. The last two coordinates are calibration errors of the
    sensor, where it has some.
    """

    scene: Scene = field(repr=False)
    unknowns: tuple[Unknown, ...]
    random: tuple[RandomInput, ...]

    @classmethod
    def of(cls, scene: Scene, unknowns: Sequence[str]) -> "Inputs":
        """Return the unknowns, and the random inputs of the scene's study that drive other entries.

        Raises InputError: there is no unknown, or two drive the same entry, or a bound makes no mechanism.
        """
        if not unknowns:
            remedy = "Give --unknown joints.crank_rod.clearance=10um:150um, say"
            raise InputError("--unknown", "", "nothing is to be identified", remedy)
        own = tuple(Unknown.of(scene, words) for words in unknowns)
        taken = [path for one in own for path in one.paths]
        check_apart("--unknown", "unknowns", unknowns, (one.paths for one in own))
        rows = () if scene.study is None else scene.study.random
        made = cls(scene, own, tuple(row for row in rows if not set(row.paths) & set(taken)))
        plain = scene.with_({"study": None})
        corners = np.full((3, made.size), 0.5)  # all at their medians; unknowns at their bounds
        corners[1:, : len(own)] = [[0.0], [1.0]]
        check_points(plain, made.points(corners), lambda row: "--unknown")
        return made

    @property
    def size(self) -> int:
        """Number of inputs of the mechanism."""
        return len(self.unknowns) + len(self.random)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the inputs."""
        return (*(one.name for one in self.unknowns), *(one.name for one in self.random))

    def values(self, places: Array) -> Array:
        """Return the inputs (n, size), SI, at places (n, size or more) of the unit cube."""
        count = len(self.unknowns)
        lower, upper = np.array([(one.lower, one.upper) for one in self.unknowns]).T
        own = lower + places[:, :count] * (upper - lower)
        chances = [np.clip(column, 1e-9, 1.0 - 1e-9) for column in places[:, count : self.size].T]
        names = [one.name for one in self.random]
        drawn = offsets(self.scene, names, chances).values() if names else ()
        centres = [0.0 if o.absolute else self.scene.number(o.paths[0]) for o in self.random]
        return np.column_stack([own, *map(np.add, centres, drawn)])

    def points(self, places: Array) -> Points:
        """Return the designs at places (n, size or more)."""
        paths = (*(one.paths for one in self.unknowns), *(one.paths for one in self.random))
        return Points(self.names, self.values(places), paths)

    def variants(self, places: Array) -> list[dict[str, float]]:
        """Return the entries of the scene at each of the places (n, size or more)."""
        points = self.points(places)
        driven = [(k, path) for k, paths in enumerate(points.paths) for path in paths]
        return [{path: float(row[k]) for k, path in driven} for row in points.values]

    def sensor_errors(self, places: Array, sensor: Sensor) -> tuple[Array, Array]:
        """Return gain and angle errors (n,) of a sensor at places (n, size + 2)."""
        from scipy.special import ndtri

        drawn = ndtri(np.clip(places[:, self.size : self.size + 2], 1e-9, 1.0 - 1e-9))
        return sensor.gain_error * drawn[:, 0], sensor.angle_error * drawn[:, 1]

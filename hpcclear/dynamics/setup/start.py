"""Where a scene's samples start: put together, with the velocities of the mechanism without clearance."""

from functools import lru_cache

import numpy as np

from hpcclear.base.arrays import Array, Booleans, Integers
from hpcclear.base.errors import InputError
from hpcclear.base.outcome import Status
from hpcclear.dynamics.layout.views import Start
from hpcclear.dynamics.linkage.assembly import Assembly, assemble_samples, coordinates
from hpcclear.dynamics.linkage.loops import Loops
from hpcclear.dynamics.linkage.mechanism import Mechanism, uncentred, with_numbers
from hpcclear.dynamics.linkage.numbers import values
from hpcclear.dynamics.linkage.passage import clear
from hpcclear.dynamics.linkage.trees import Forest
from hpcclear.dynamics.planar import problem as planar
from hpcclear.dynamics.planar.tables import mechanism_of
from hpcclear.dynamics.planar.turning import loops_of, passage, pinned, refused
from hpcclear.scene import Scene
from hpcclear.scene.points import Points


def start_states(
    scene: Scene, par: Array, points: Points | None = None, walk: bool = True
) -> Start:
    """Start of each sample, of parameters (samples, PARAMETERS) and the points they were made from.

    Put together with journals centred, or where ``start_eccentricity`` puts them, and velocities of ideal joints. Unless
    `walk` is off, a sample that does not close or cannot turn fails at the start (`Start.fail`). Raises InputError if the
    scene itself does not close.
    """
    trees = planar.linkage_of(scene).forest
    first = scene.bristles  # which begin undeflected
    n = len(trees.coordinates)
    start = Start.at_rest(len(par))
    places, speeds = start.coordinates(first + n)[:, first:], start.velocities(first + n)[:, first:]
    moved = () if points is None else tuple(map(scene.path_in_linkage, sum(points.paths, ())))
    samples = None
    if points is not None and any(map(planar.moves_geometry, moved)):
        samples = Samples(scene, points)
        places.T[:], speeds.T[:] = samples.coordinates(trees)
    elif any(map(planar.moves_start, moved)):  # mass centres alone
        found = coordinates(trees, _assembled(scene), planar.sample_of(scene, points))
        places.T[:], speeds.T[:] = (one.reshape(n, -1) for one in found)
    else:
        places[:], speeds[:] = _of_scene(scene)
    if samples is None:
        refusal = planar.refused_of(scene) if walk else None
        ended = np.full(len(par), int(Status.OK if refusal is None else refusal[0]))
    else:
        ended = _statuses(_twins(scene), samples, scene.effects.gravity, planar.rounds_of(scene))
    _start_contacts(scene, points, start)
    start.fail(ended)
    return start


@lru_cache(maxsize=16)
def _of_scene(scene: Scene) -> tuple[Array, Array]:
    """Coordinates and velocities (n,) that all samples start with whose geometry is the scene's."""
    mechanism = mechanism_of(scene.linkage)
    return coordinates(planar.linkage_of(scene).forest, _assembled(scene), mechanism)


@lru_cache(maxsize=16)
def _assembled(scene: Scene) -> Assembly:
    return planar.put_together(uncentred(mechanism_of(scene.linkage)))


class Samples:
    """Samples of a scene (m), put together: all at once, and one by one those that do not close from the rough angles.

    `numbers`: the mechanism with those of samples (m,); `closed` (m,): which of them close.
    """

    def __init__(self, scene: Scene, points: Points) -> None:
        self._scene, self._points = _without_study(scene), points
        structure = uncentred(planar.linkage_of(scene).mechanism)
        self.numbers = planar.sample_of(scene, points)
        bare = uncentred(self.numbers)
        self._made, self.closed = assemble_samples(structure, bare, len(points))
        self._single: dict[int, Assembly] = {}
        for row in np.flatnonzero(~self.closed).tolist():
            try:
                self._single[row] = planar.put_together(uncentred(self.mechanism(row)))
                self.closed[row] = True
            except InputError:
                continue

    def mechanism(self, row: int) -> Mechanism:
        """One sample by itself."""
        return mechanism_of(planar.scene_of(self._scene, self._points, row).linkage)

    def coordinates(self, forest: Forest) -> tuple[Array, Array]:
        """Coordinates and velocities (n, m) of a forest; NaN of samples that do not close."""
        q, v = coordinates(forest, self._made, self.numbers)
        q[:, ~self.closed] = v[:, ~self.closed] = np.nan
        for row, made in self._single.items():
            q[:, row], v[:, row] = coordinates(forest, made, self.mechanism(row))
        return q, v


def _statuses(loops: Loops | None, samples: Samples, gravity: float, rounds: int) -> Integers:
    """Statuses (m,) of samples: whether each can turn; `loops`: of `loops_of`, which take the samples' numbers, `rounds`:
    revolutions that one without clearance is walked through."""
    closed = samples.closed
    found = np.where(closed, int(Status.OK), int(Status.CANNOT_TURN))
    if loops is None or not closed.any():
        return found
    for row in np.flatnonzero(closed & ~_clear(loops, samples)).tolist():
        try:
            refusal = refused(passage(samples.mechanism(row), gravity, rounds))
        except InputError:
            refusal = None
        found[row] = int(Status.OK if refusal is None else refusal[0])
    return found


def _clear(loops: Loops, samples: Samples) -> Booleans:
    """Which samples (m,) are certain to turn."""
    sample = samples.numbers
    own = {name: getattr(sample, name) for name in ("bodies", "drives", "ground")}
    numbers = with_numbers(loops.mechanism, **own, joints=pinned(sample), loads=())
    loops.take(values(numbers))
    main = numbers.period
    seconds: Array = np.broadcast_to(np.asarray(main.seconds, float), len(samples.closed))
    start, _ = samples.coordinates(loops.forest)
    return clear(loops, start, seconds, main.turns)


@lru_cache(maxsize=16)
def _twins(scene: Scene) -> Loops | None:
    return loops_of(planar.linkage_of(scene).mechanism)


@lru_cache(maxsize=16)
def _without_study(scene: Scene) -> Scene:
    """The scene of which those of samples are made in less than half the time."""
    return scene if scene.study is None else scene.with_({"study": None})


def _start_contacts(scene: Scene, points: Points | None, start: Start) -> None:
    """What starts as deep as its surfaces or deeper starts in contact, at the least impact speed."""
    law = scene.effects.contact
    if law is None or not law.latched:
        return
    gaps = [gap for joint in planar.sample_of(scene, points).clearances for gap in joint.gaps()]
    for k, gap in zip(scene.open_places, gaps, strict=True):
        touching = np.asarray(gap) >= 0.0
        start.active[:, k] = touching
        start.inverse_impact[:, k] = touching / law.minimum_impact_speed

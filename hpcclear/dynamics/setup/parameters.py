"""Kernel parameters of a scene's samples."""

from typing import Any

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.joint_laws import fill, swing
from hpcclear.dynamics.laws import laws, numbers
from hpcclear.dynamics.planar import bristles
from hpcclear.dynamics.planar.prescribed import held_extremes
from hpcclear.dynamics.planar.problem import is_prescribed, linkage_of, parameters_of
from hpcclear.scene import Scene
from hpcclear.scene.points import Points

SAME_LENGTH = 0.01
"""By how much length over diameter may differ between samples of a film that is solved for one, relative: worn bearings are
wider."""


RAMP = 0.1
"""Of a threshold of wear, relative: beyond it by so much, all of the force wears."""

OF_RAMP, OF_FORCE = 0.5, 0.003
"""Of friction's ramp, and of the forces of inertia: what errors of explicit steps at the edge of stability may come to."""


class Numbers:
    """The scene's numbers, a column of the points where one drives the entry: ``numbers("drive.speed")``."""

    def __init__(self, scene: Scene, points: Points | None) -> None:
        self.scene = scene
        self.points = points
        self.size = 1 if points is None else len(points)
        self._columns = {}
        if points is not None:
            for k, paths in enumerate(points.paths):
                self._columns.update(dict.fromkeys(paths, points.values[:, k]))

    def __call__(self, path: str) -> Array:
        """Values of an entry, shape (size,), SI."""
        column = self._columns.get(path)
        return np.full(self.size, self.scene.number(path)) if column is None else column

    def known(self, path: str) -> Array:
        """The same, 0 of an entry that the scene has not."""
        there = path in self._columns or path in self.scene.numeric_paths()
        return self(path) if there else np.zeros(self.size)


def parameters(scene: Scene, points: Points | None = None) -> Array:
    """Kernel parameters of each sample, shape (samples, PARAMETERS)."""
    get = Numbers(scene, points)
    p = _parameters(scene, points, get)
    p[:, at.EDGE] = _needed_at_edge(scene, get, p)
    p = _with_waves(scene, get, p) if _has_waves(scene) else p
    return _with_further_numbers(scene, get, p) if further_rows(scene) else p


def _parameters(scene: Scene, points: Points | None, get: Numbers) -> Array:
    """But for further numbers of films."""
    p = parameters_of(scene, get, points)
    force = _inertia(scene, get, p)
    for k, contact in zip(scene.open_places, scene.contact_labels(), strict=True):
        block = at.JOINT_BLOCKS + k * at.JOINT_ROWS
        fill(scene, get, contact, force, p[:, block:])
        _film_parameters(scene, get, contact, p, block)
    held = scene.responses_asked() and is_prescribed(scene)
    p[:, at.HELD_MOMENT : at.HELD_PEAK + 1] = (
        held_extremes(scene, points, get.size) if held else np.nan
    )
    return p


def _film_parameters(scene: Scene, get: Numbers, joint: str, p: Array, block: int) -> None:
    """Fill what a joint's block of parameters (its first column) has of its film; without one its force is 0."""
    film, own = scene.films().get(joint), p[:, block:]
    own[:, at.FILM_SCALE : at.JOINT_ROWS] = 0.0
    own[:, at.FILM_FLOOR] = 0.5
    own[:, at.FILM_STEEPNESS] = bristles.SMOOTH if scene.bristles else 0.0
    if film is None:
        return
    key = scene.joint_key(joint)
    viscosity, length = get(f"{key}.film.viscosity"), get(f"{key}.film.length")
    clearance, radius = get(f"{key}.clearance"), get(f"{key}.bearing_radius")
    given = {"viscosity": viscosity, "film_length": length, "bearing_radius": radius}
    law = laws("film")[film.model]
    own[:, at.FILM_SCALE] = numbers.evaluate(law.scale, given | {"clearance": clearance})
    own[:, at.FILM_SHEAR] = at.TURN * viscosity * length * radius**3 / clearance
    own[:, at.FILM_FLOOR] = get(f"{key}.film.roughness") / clearance
    masses = [path for path in scene.numeric_paths() if path.endswith(".mass")]
    inertia = sum(get(path) for path in masses) * p[:, at.DRIVEN_LENGTH] * p[:, at.SPEED] ** 2
    own[:, at.FILM_STEEPNESS] = own[:, at.FILM_SCALE] / inertia


def _needed_at_edge(scene: Scene, get: Numbers, p: Array) -> Array:
    """One over the relative tolerance of velocities, shape (samples,), with which explicit steps at the edge of stability keep
    friction and contact forces.

    There errors grow until they meet the tolerance. Half of friction's ramp at most: beyond it the direction of friction is
    chance. And what swings in a contact under the forces of inertia, at the frequency w of small motions, w^2 = F'(d)/m,
    may add `OF_FORCE` of these.
    """
    pin = np.abs(p[:, at.SPEED]) * p[:, at.DRIVEN_LENGTH]
    mass, force = _mass(scene, get), _inertia(scene, get, p)
    needed = np.ones(len(p))
    for key in scene.joint_frictions():
        needed = np.maximum(needed, 1.0 / (OF_RAMP * get(f"{key}.ramp_speed")))
    for place in scene.open_places:
        own = p[:, at.JOINT_BLOCKS + place * at.JOINT_ROWS :]
        if scene.effects.friction.law != "none":
            needed = np.maximum(needed, own[:, at.INVERSE_RAMP] / OF_RAMP)
        frequency = np.sqrt(swing(scene, p, place, force) / mass)
        needed = np.maximum(needed, mass * frequency / (OF_FORCE * force))
    return (1.0 + pin) * needed


def _mass(scene: Scene, get: Numbers) -> Array:
    """All masses together, kg, (samples,)."""
    total: Array = sum(get(path) for path in scene.numeric_paths() if path.endswith(".mass"))  # type: ignore[assignment]
    return total


def _inertia(scene: Scene, get: Numbers, p: Array) -> Array:
    """What the forces of inertia come to, N, (samples,)."""
    turning = np.abs(p[:, at.SPEED])
    pin = turning * p[:, at.DRIVEN_LENGTH]
    return np.maximum(_mass(scene, get) * pin * turning, 1e-300)


def parameter_rows(scene: Scene) -> int:
    """Parameters of a sample."""
    waving = at.FURTHER if _has_waves(scene) else linkage_of(scene).parameter_rows
    return further_rows(scene) or waving


def _has_waves(scene: Scene) -> bool:
    """Whether there are parameters of waves or of thresholds of wear."""
    return any(scene.waves().values()) or scene.has_thresholds


def _with_waves(scene: Scene, get: Numbers, p: Array) -> Array:
    """With the waves of surfaces that are out of round, and thresholds of wear; of joints without the former are 0."""
    rows = np.zeros((len(p), at.FURTHER))
    rows[:, : p.shape[1]] = p
    for joint in scene.pins():
        own = rows[:, at.WAVES + 2 * waves_at(scene, joint)[0] :]
        paths = wave_paths(scene, joint)
        for k in range(len(paths) // 2):
            cosine, sine = (get.known(path) for path in paths[2 * k : 2 * k + 2])
            n = int(paths[2 * k].rpartition("_")[2])
            own[:, 4 * k : 4 * k + 4] = np.stack([cosine, sine, n * sine, -n * cosine], axis=-1)
    for joint, place in zip(scene.contact_labels(), scene.open_places, strict=True):
        row = at.THRESHOLDS + 2 * place
        rows[:, row : row + 2] = _share_that_wears(scene, get, joint)
    return rows


def _share_that_wears(scene: Scene, get: Numbers, joint: str) -> Array:
    """Slope, 1/N, and offset of the share of a joint's normal force that wears, shape (samples, 2); 0 and 1 for all of it."""
    key, wear = scene.joint_key(joint), scene.clearance_joint(joint).wear
    if wear is None or wear.threshold is None:
        return np.tile([0.0, 1.0], (get.size, 1))
    size = 2.0 * get(f"{key}.bearing_radius") * get(f"{key}.wear.length")
    slope = 1.0 / (RAMP * get(f"{key}.wear.threshold") * size)
    return np.stack([slope, np.full(get.size, -1.0 / RAMP)], axis=-1)


def waves_at(scene: Scene, joint: str) -> tuple[int, int]:
    """First row of a joint's waves among `layout.WAVE_ROWS`, and how many.

    Raises
    ------
    InputError
        If there are more than rows.
    """
    rows = 2 * sum(scene.waves().values())
    first = rows * _place(scene, joint)
    if first + rows > at.WAVE_ROWS:
        raise InputError(
            "wear.harmonics" if scene.wear is not None and scene.wear.waves else f"{scene.joint_key(joint)}.out_of_round",
            rows // 2, f"all joints together have more than {at.WAVE_ROWS // 2} waves",
            f"Take {at.WAVE_ROWS // 2 // (_place(scene, joint) + 1) // 2} around each surface at most",
        )  # fmt: skip
    return first, rows


def wave_paths(scene: Scene, joint: str) -> list[str]:
    """Entries of a joint's waves, in the order of their rows."""
    return [
        f"{scene.joint_key(joint)}.out_of_round.{surface}.{part}_{n + 1}"
        for surface, count in scene.waves().items()
        for n in range(count)
        for part in ("cosine", "sine")
    ]


def _solved_films(scene: Scene) -> dict[str, Any]:
    """Joints whose films have further numbers, and the functions that give these."""
    known = {name: laws("film")[film.model].further for name, film in scene.films().items()}
    return {name: further for name, further in known.items() if further is not None}


def further_rows(scene: Scene) -> int:
    """Parameters of a sample with films that have further numbers; 0 without such films."""
    last = max((_place(scene, joint) for joint in _solved_films(scene)), default=-1)
    return 0 if last < 0 else at.FURTHER + at.FURTHER_ROWS * (last + 1)


def _place(scene: Scene, joint: str) -> int:
    """Which place among the kernel's joints a joint has."""
    return scene.joint_labels.index(joint)


def _with_further_numbers(scene: Scene, get: Numbers, p: Array) -> Array:
    """With what films are solved for once a bearing."""
    rows = np.zeros((len(p), further_rows(scene)))
    rows[:, : p.shape[1]] = p
    for joint, further in _solved_films(scene).items():
        key, table = scene.joint_key(joint), scene.pin(joint)
        ratio = 0.5 * table.film.length / table.bearing_radius  # type: ignore[union-attr]
        varied = 0.5 * get(f"{key}.film.length") / get(f"{key}.bearing_radius")
        if (np.abs(varied / ratio - 1.0) > SAME_LENGTH).any():
            raise InputError(
                f"{key}.film.model", scene.films()[joint].model,
                "the samples differ in length over diameter, but the film is solved for one ratio",
                'Vary neither film.length nor bearing_radius, or take model = "short" or "long"',
            )  # fmt: skip
        first = at.FURTHER + at.FURTHER_ROWS * _place(scene, joint)
        rows[:, first : first + at.FURTHER_ROWS] = further(ratio)
    return rows

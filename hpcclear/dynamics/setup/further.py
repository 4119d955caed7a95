"""Kernel parameters that few scenes have: waves of surfaces, thresholds of wear, films that are solved for once a bearing."""

from collections.abc import Callable

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.planar.problem import linkage_of
from hpcclear.laws import laws
from hpcclear.scene import Scene
from hpcclear.scene.points import Numbers

SAME_LENGTH = 0.01
"""By how much length over diameter may differ between samples of a film that is solved for one, relative: worn bearings are
wider."""


RAMP = 0.1
"""Of a threshold of wear, relative: beyond it by so much, all of the force wears."""


def parameter_rows(scene: Scene) -> int:
    """Parameters of a sample."""
    waving = at.FURTHER if has_waves(scene) else linkage_of(scene).parameter_rows
    return further_rows(scene) or waving


def has_waves(scene: Scene) -> bool:
    """Whether there are parameters of waves or of thresholds of wear."""
    return any(scene.waves().values()) or scene.has_thresholds


def with_waves(scene: Scene, get: Numbers, p: Array) -> Array:
    """Parameters (m, PARAMETERS) with the waves of surfaces that are out of round, and thresholds of wear; of joints without
    the former are 0."""
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
    """First row of a joint's waves among `layout.WAVE_ROWS`, and how many. Raises InputError if there are more than rows."""
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


def _solved_films(scene: Scene) -> dict[str, Callable[[float], Array]]:
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


def with_further_numbers(scene: Scene, get: Numbers, p: Array) -> Array:
    """Parameters (m, PARAMETERS) with what films are solved for once a bearing.

    Raises InputError if samples differ in length over diameter of such a film.
    """
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

"""The corners of a study's ranges: which make no mechanism, and which fail in a few revolutions."""

from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array, Booleans
from hpcclear.base.errors import InputError
from hpcclear.dynamics.planar.problem import moves_geometry, poses_at_start, refused_of, scene_of
from hpcclear.scene import Scene
from hpcclear.scene.domain import box
from hpcclear.scene.points import Points, check_points, expanded, points_at, snapped
from hpcclear.scene.streams import generator

MOST = 64
"""Corners that are tried; of studies with more variables a selection in which each bound comes as often as the other."""

_BITS = 62

STEPS = 20_000
"""Steps of a corner at most: some hundred times what two revolutions take."""


class CornerOutcomes(NamedTuple):
    """What came of the corners."""

    points: Points
    refused: dict[int, str]
    """Why a corner makes no mechanism, by its row."""
    status: Array
    """Outcome of each corner (n,); -1 where it was not simulated."""


def corners(scene: Scene) -> Points:
    """Return the corners of the ranges of a study, all of them or `MOST`, SI."""
    region = box(scene)
    count = len(region.names)
    others = 2 ** min(count - 1, _BITS)  # corners at the lower bound of the last variable
    codes = np.arange(min(others, MOST // 2))
    if others > MOST // 2:  # all lower bounds, and some others
        rng = generator(scene.required_study.seed, "corners")
        codes[1:] = 1 + rng.choice(others - 1, len(codes) - 1, replace=False)
    half: Booleans = (codes[:, None] >> (np.arange(count) % _BITS)) & 1 == 1
    half[:, -1] = False
    upper = np.concatenate([half, ~half])
    coordinates = np.where(upper, region.upper, region.lower)
    study = scene.required_study
    coordinates = snapped(study, region.names, coordinates)
    return expanded(study, points_at(scene, region.names, coordinates))


def tried(scene: Scene, simulate: bool) -> CornerOutcomes:
    """What the corners of a study's ranges come to; with `simulate` those that make a mechanism run two revolutions."""
    points = corners(scene)
    plain = scene.with_({"study": None})
    own = (map(scene.path_in_linkage, paths) for paths in points.paths)
    moving = [any(map(moves_geometry, paths)) for paths in own]
    locked = dict[bytes, str]()  # by what decides whether a design can turn: most corners share it
    refused = dict[int, str]()
    doubted = bool(_refusal(plain, points))
    for row, values in enumerate(points.values):
        corner, geometry = points.take(slice(row, row + 1)), values[moving].tobytes()
        why = _refusal(plain, corner) if doubted else ""
        if not why and geometry not in locked:
            locked[geometry] = _obstacle(scene_of(plain, corner, 0) if geometry else scene)
        if why := why or locked[geometry]:
            refused[row] = why
    status = np.full(len(points), -1)
    good = np.array([row for row in range(len(points)) if row not in refused], int)
    if simulate and good.size:
        from hpcclear.dynamics.evaluation import evaluate_records  # with all that compiles

        brief: dict[str, object] = {"transient_revolutions": 1, "averaged_revolutions": 1}
        brief |= {"target_error": None, "max_steps": min(STEPS, scene.numerics.max_steps)}
        short = scene.with_({f"numerics.{name}": value for name, value in brief.items()})
        status[good] = evaluate_records(short, points.take(good))["status"]
    return CornerOutcomes(points, refused, status)


def _refusal(scene: Scene, points: Points) -> str:
    """Why the numbers of the first corner that makes no mechanism make none; "" if all do."""
    try:
        check_points(scene, points)
    except InputError as error:
        return f"{error.reason}. {error.remedy}"
    return ""


def _obstacle(scene: Scene) -> str:
    """Why the mechanism of a scene does not close or cannot turn; "" if it can."""
    try:
        poses_at_start(scene)  # refuses one that does not close
        locked = refused_of(scene)
    except InputError as error:
        return f"{error.reason}. {error.remedy}"
    return "" if locked is None else f"{locked[0].message}. {locked[0].remedy}"

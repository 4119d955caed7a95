"""From the tables of a linkage to the mechanism as data."""

from typing import Any

from hpcclear.base.arrays import Array
from hpcclear.base.errors import at
from hpcclear.base.pieces import Pieces
from hpcclear.dynamics.linkage.mechanism import Mechanism, with_numbers
from hpcclear.dynamics.linkage.parts import Body, places_of, split
from hpcclear.scene import Scene
from hpcclear.scene.loads.declared import loads_of
from hpcclear.scene.planar import Planar, PlanarBody, PlanarJoint, is_loose, turns_of
from hpcclear.scene.points import Points


def mechanism_of(planar: Planar) -> Mechanism:
    """The mechanism of a scene's tables; InputError names the entry below ``mechanism``."""
    turns_of(planar)  # refuses one that nothing drives
    with at("mechanism"):
        return Mechanism(**_tables(planar))


def with_columns(scene: Scene, structure: Mechanism, points: Points) -> Mechanism:
    """The mechanisms of samples: numbers that columns of the points drive are arrays (m,)."""
    tables: Any = scene.linkage
    for k, paths in enumerate(points.paths):
        for path in map(scene.path_in_linkage, paths):
            if path.startswith("mechanism.") and ".out_of_round." not in path:
                tables = _put(tables, path.split(".")[1:], points.values[:, k])
    return with_numbers(structure, **_tables(tables))


def _put(table: Any, keys: list[str], value: Array) -> Any:
    """A copy of nested tables with another entry, unchecked; rows are found by their names."""
    if not keys:
        return value
    head, *rest = keys
    if isinstance(table, tuple):
        return tuple(_put(row, rest, value) if row.name == head else row for row in table)
    return table.model_copy(update={head: _put(getattr(table, head), rest, value)})


def _tables(planar: Planar) -> dict[str, Any]:
    return {
        "bodies": tuple(_body(body, planar.joints) for body in planar.bodies),
        "joints": planar.joints,
        "drives": planar.drives,
        "ground": {point.name: (point.x, point.y) for point in planar.ground.points},
        "loads": (*planar.loads, *loads_of(planar.joints)),
    }


def _body(body: PlanarBody, joints: tuple[PlanarJoint, ...]) -> Body:
    """A body; one that slides in channels wider than itself has the centres of its corners as points."""
    points = body.own_points
    for joint in joints:
        if is_loose(joint):
            own, point = split(places_of(joint)[0])
            if own == body.name and point in points:
                points |= joint.further_points(points[point])
    mass = body.mass, body.own_inertia, body.own_center
    return Body(body.name, *mass, points, body.start_angle, body.bending)


def curves_of(scene: Scene) -> dict[str, Pieces]:
    """Tables of drives and loads by name, over the angle (rad) or time (s) that each goes by."""
    planar, turns = scene.linkage, turns_of(scene.linkage)
    tabled = (one for one in (*planar.loads, *planar.drives) if one.table)
    return {one.name: one.curve(turns, scene.numerics.interpolation) for one in tabled}

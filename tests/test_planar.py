"""Planar linkages from tables: read into data, assembled, refused by name; the slider-crank's scene written out."""

import copy
import math

import numpy as np
import pytest
from dense_linkage import stiffness
from running import scene_with
from some_laws import row
from test_linkage_scenes import ROCKER

from hpcclear.base.errors import InputError
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.assembly import assemble
from hpcclear.dynamics.linkage.trees import forest
from hpcclear.dynamics.planar.tables import mechanism_of
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.start import start_states
from hpcclear.scene.contacts.pin_in_bearing import PlanarClearance
from hpcclear.scene.faults import explained
from hpcclear.scene.planar import Planar

OWN = {
    "crank": {
        "mass": "200 g", "inertia": 3e-5, "center": ["20 mm", 0.0], "points": {"a": [0.0, 0.0], "b": ["40 mm", 0.0]},
        "start_angle": "25 deg",
    },
    "rocker": {"like": "crank", "points": {"a": [0.0, 0.0], "b": [0.08, 0.0]}, "start_angle": "90 deg"},
}  # fmt: skip
"""Bodies by their points, in the places of two of the shipped crank-rocker's bars."""
LOADS = {
    "weight": {"kind": "force", "place": "coupler.tip", "force": [0.0, "-10 N"]},
    "band": {"kind": "spring", "first": "rocker.b", "second": "ground.o", "stiffness": 100.0},
}
TABLES = copy.deepcopy(ROCKER["mechanism"]) | {"loads": LOADS}
TABLES["bodies"] |= OWN
TABLES["joints"]["o3"]["clearance"] = "0.1 mm"


def changed(path, value):
    """The tables with another entry, or without it."""
    tables = copy.deepcopy(TABLES)
    *keys, last = path.split(".")
    table = tables
    for key in keys:
        table = table.setdefault(key, {})
    if value is None:
        del table[last]
    else:
        table[last] = value
    return tables


def test_tables_are_read_into_data_and_assembled():
    mechanism = mechanism_of(Planar.model_validate(TABLES))
    assert [body.name for body in mechanism.bodies] == ["crank", "coupler", "rocker"]
    crank, coupler, rocker = mechanism.bodies
    assert (crank.mass, crank.center) == (0.2, (0.02, 0.0))
    assert crank.start_angle == pytest.approx(math.radians(25))
    assert (rocker.mass, rocker.points["b"]) == (0.2, (0.08, 0.0))  # like the crank
    assert coupler.points["tip"] == (0.06, 0.05)
    _, o3 = mechanism.clearances
    assert isinstance(o3, PlanarClearance)
    assert (o3.clearance, o3.bearing_radius, o3.journal) == (1e-4, 0.01, "coupler.b")
    assert mechanism.period.speed == pytest.approx(30 * math.pi)
    assert [load.kind for load in mechanism.loads] == ["force", "spring"]
    names = [one.name for one in forest(mechanism).coordinates]
    assert names == ["x_coupler", "y_coupler", "angle_coupler", "angle_rocker"]
    assembly = assemble(mechanism)
    assert assembly.angle("crank") == pytest.approx(math.radians(25))
    assert 0 < assembly.angle("coupler") < assembly.angle("rocker") < math.pi


@pytest.mark.parametrize(
    ("path", "value", "key", "said"),
    [
        ("bodies.coupler.mass", "3 m", "bodies.coupler.mass", "kg"),
        ("bodies.coupler.mass", None, "bodies.coupler.mass", "missing"),
        ("bodies.coupler.weight", 1.0, "bodies.coupler.weight", "not a known key"),
        ("bodies.coupler.points.b", [0.12], "bodies.coupler.points.b", "pair"),
        ("bodies.coupler.points", "a, b", "bodies.coupler.points", "{ NAME = [x, y] }"),
        ("bodies.rocker.like", "crnk", "bodies.rocker.like", "crank"),
        ("joints.o1.kind", "revolut", "joints.o1.kind", "revolute"),
        ("joints.o1.kind", None, "joints.o1.kind", '"slide"'),
        ("joints.o2.clearance", None, "joints.o2.clearance", "missing"),
        ("drives", {}, "drives", "nothing drives"),
        ("loads.weight.place", "coupler", "loads.weight.place", "no point"),
        ("loads.band.kind", "rubber", "loads.band.kind", "spring"),
        ("bodies.extra", {"mass": 1.0}, "bodies.extra.inertia", "inertia"),
    ],
)
def test_wrong_tables_are_refused_by_name(path, value, key, said):
    """Further ones are in `test_linkage_scenes`."""
    tables = changed(path, value)
    with pytest.raises(InputError) as caught, explained(tables):
        mechanism_of(Planar.model_validate(tables))
    assert caught.value.key.removeprefix("mechanism.") == key
    assert said in str(caught.value)


TILTED = {"joints.crank_rod.start_eccentricity": [1e-4, -5e-5]}
TORQUE = {"drive": {"kind": "torque", "torque": 5.0, "initial_speed": 300.0}}


@pytest.mark.parametrize("changes", [{}, TILTED, TORQUE], ids=["paper", "eccentric", "torque"])
def test_the_slider_crank_written_out_starts_where_the_scene_does(changes):
    scene = scene_with(changes, 1)
    mechanism = mechanism_of(scene.linkage)
    par = parameters(scene)
    assembly = assemble(mechanism)
    start = start_states(scene, par)
    names = [(one.kind, one.body) for one in assembly.loops.forest.coordinates]
    order = [
        names.index(p) for p in (("x", "rod"), ("y", "rod"), ("angle", "rod"), ("x", "slider"))
    ]
    np.testing.assert_allclose(assembly.q[order], start.coordinates(4)[0], atol=1e-14)
    np.testing.assert_allclose(assembly.v[order], start.velocities(4)[0], rtol=1e-9, atol=1e-9)
    expected = [stiffness(joint) for joint in mechanism.clearances]
    first = row("contact", scene.effects.contact.law, "stiffness")
    found = [par[0, one.block + first] for one in at.JOINTS[:2]]
    np.testing.assert_allclose(expected, found, rtol=1e-15)

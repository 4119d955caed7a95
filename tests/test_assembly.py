"""Assembly from rough angles, motions that drives prescribe, and what is refused, by the name of the joint."""

import math
from dataclasses import replace

import linkages
import numpy as np
import pytest
from dense_linkage import Dense, turned
from refusals import refused

from hpcclear.base.errors import InputError
from hpcclear.dynamics.linkage.assembly import assemble
from hpcclear.dynamics.linkage.mechanism import Mechanism
from hpcclear.dynamics.linkage.parts import Body, split
from hpcclear.dynamics.linkage.prescribed import prescribed_motion
from hpcclear.scene.driving import PlanarSpeed
from hpcclear.scene.fields import Position
from hpcclear.scene.planar import PlanarFixed

PRESCRIBED = {
    "slider-crank": linkages.slider_crank(tilt=0.3, offset=0.01, friction=linkages.RUB, off=0.003),
    "four-bar": linkages.four_bar(off=0.004),
    "v-twin": linkages.v_twin(friction=linkages.RUB),
    "six-bar": linkages.six_bar(friction=linkages.RUB),
    "quick-return": linkages.quick_return(friction=linkages.RUB),
    "3-RRR": linkages.three_rrr(),
}


def in_dense_order(dense, assembly, rows):
    """Values (..., n) of the assembly's coordinates, bodies in file order, x, y and angle each; 0 for held bodies."""
    found = np.zeros((*rows.shape[:-1], dense.n))
    for k, one in enumerate(assembly.loops.forest.coordinates):
        place = dense.first[one.body] + ("x", "y", "angle").index(one.kind)
        found[..., place] = rows[..., k]
    return found


def where_held(dense):
    """Coordinates (n,) of the bodies held on the ground, 0 for all others."""
    q = np.zeros(dense.n)
    for joint in dense.mechanism.ideal:
        if isinstance(joint, PlanarFixed):
            body = dense.mechanism.body(split(joint.point)[0])
            arm = turned(np.subtract(body.center, body.points[split(joint.point)[1]]), joint.angle)
            place = dense.first[body.name]
            q[place : place + 3] = *np.add(dense.place(q, joint.line), arm), joint.angle
    return q


@pytest.mark.parametrize("name", linkages.LINKAGES)
def test_every_linkage_is_assembled_as_it_was_meant(name):
    mechanism = linkages.LINKAGES[name]
    assembly = assemble(mechanism)
    dense = Dense(mechanism)
    q, v = (in_dense_order(dense, assembly, x) for x in (assembly.q, assembly.v))
    c, dc, _ = dense.along(q + where_held(dense), v, 0.0)
    assert np.abs(c).max(initial=0.0) < 1e-13
    assert np.abs(dc).max(initial=0.0) < 1e-10
    assert all(gap < 1e-12 for gap in open_gaps(assembly).values())
    for body in mechanism.bodies:
        if isinstance(mechanism.drive_of(body.name), PlanarSpeed):
            assert assembly.angle(body.name) == pytest.approx(body.start_angle)
    assert len(assembly.report()) == len(mechanism.bodies)


def open_gaps(assembly):
    """How far journals stand off their bearings' centres at the start, m, by joint."""
    loops = assembly.loops
    error = loops.at(assembly.q, assembly.v, 0.0).error
    rows = {
        joint.name: [r for r, owner in enumerate(loops.owners) if owner == f"joints.{joint.name}"]
        for joint in loops.mechanism.clearances
    }
    return {name: math.hypot(*error[own]) for name, own in rows.items()}


def test_journals_start_where_they_are_put():
    mechanism = linkages.slider_crank("o12", "o23")
    moved = {"o12": {"start_eccentricity": Position(x=1e-4, y=-5e-5)}}
    joints = tuple(
        linkages.changed(joint, **moved.get(joint.name, {})) for joint in mechanism.joints
    )
    gaps = open_gaps(assemble(replace(mechanism, joints=joints)))
    assert gaps["o12"] == pytest.approx(math.hypot(1e-4, 5e-5))
    assert gaps["o23"] < 1e-12


@pytest.mark.parametrize(
    ("make", "most"), [(linkages.four_bar, 2), (linkages.slider_crank, 2), (linkages.six_bar, 4)]
)
def test_random_start_angles_lead_to_one_of_the_assemblies(make, most):
    """In any order of joints; and no guided body faces backwards."""
    rng = np.random.default_rng(3)
    base, poses = make(), set()
    for attempt in range(25):
        free = (body for body in base.bodies if not base.drive_of(body.name))
        start = {body.name: rng.choice([math.pi, rng.uniform(-3, 3)]) for body in free}
        bodies = tuple(
            replace(body, start_angle=start.get(body.name, body.start_angle))
            for body in base.bodies
        )
        first = attempt % len(base.joints)
        joints = base.joints[first:] + base.joints[:first]
        assembly = assemble(replace(base, bodies=bodies, joints=joints))
        angles = {"ground": 0.0} | {body.name: assembly.angle(body.name) for body in bodies}
        for guide in (joint for joint in joints if joint.kind == "slide"):
            body, carrier = (split(place)[0] for place in (guide.point, guide.line))
            assert math.cos(angles[body] - angles[carrier] - guide.angle) == pytest.approx(1.0)
        x = [k for k, one in enumerate(assembly.loops.forest.coordinates) if one.kind != "angle"]
        poses.add(tuple(np.round(assembly.q[x], 9) + 0.0))
    assert 1 <= len(poses) <= most


@pytest.mark.parametrize("name", PRESCRIBED)
def test_prescribed_motion_is_the_dense_model_s(name):
    mechanism = PRESCRIBED[name]
    motion = prescribed_motion(mechanism, np.linspace(0.0, 0.2, 25), gravity=9.81)
    dense = Dense(mechanism, gravity=9.81)
    q, v, a = (in_dense_order(dense, motion.assembly, x) for x in (motion.q, motion.v, motion.a))
    for k, time in enumerate(motion.times):
        c, dc, _ = dense.along(q[k], v[k], time)
        assert np.abs(c).max() < 1e-12
        assert np.abs(dc).max() < 1e-9
        expected = dense.accelerations(q[k], v[k], time)
        np.testing.assert_allclose(a[k], expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
        scale = max(map(abs, dense.seen["multipliers"].values()))
        for (joint, row), value in dense.seen["multipliers"].items():
            name = f"{joint}_{'angle' if row == 'drive' else row}"
            assert motion.holds[name][k] == pytest.approx(value, rel=1e-8, abs=1e-9 * scale)
        assert motion.loss[k] == pytest.approx(dense.seen["guide_loss"], rel=1e-8, abs=1e-8)
        assert motion.load_power[k] == pytest.approx(dense.seen["load_power"], rel=1e-9, abs=1e-9)


# ---- what is refused ----------------------------------------------------------------------------
def stretched(length, **points):
    """The four-bar with a coupler of another length."""
    base = linkages.four_bar()
    coupler = linkages.bar("coupler", length, 0.3, 0.5, tip=(0.06, 0.05))
    return replace(base, bodies=(base.bodies[0], coupler, base.bodies[2]))


def on_two_rails():
    """A carriage on two parallel guides, and a bar that swings freely."""
    carriage = Body(
        "carriage", 1.0, 1e-3, points={"a": (0.0, 0.0), "b": (0.1, 0.1), "pin": (0.0, 0.05)}
    )
    return Mechanism(
        (
            linkages.bar("crank", 0.05, 0.1, 0.4),
            carriage,
            linkages.bar("rod", 0.2, 0.1, 0.1),
            linkages.bar("tail", 0.1, 0.1, -1.0),
        ),
        (
            *linkages.pins((), "o1 crank.a ground.o", "o2 crank.b rod.a"),
            linkages.slide("rail", "carriage.a", "ground.o"),
            linkages.slide("second", "carriage.b", "ground.high"),
            *linkages.pins(("o3",), "o3 carriage.pin rod.b", "o4 tail.a rod.b"),
        ),
        (linkages.MOTOR,),
        {"o": (0.0, 0.0), "high": (0.0, 0.1)},
    )


@pytest.mark.parametrize(
    ("make", "key", "said"),
    [
        (lambda: stretched(0.01), "joints.o3", " m': the mechanism cannot be assembled"),
        (lambda: stretched(0.4), "joints.", "cannot be assembled"),
        (lambda: linkages.slider_crank(offset=0.4), "joints.", "cannot be assembled"),
        (on_two_rails, "joints.second", "redundant"),
    ],
)
def test_what_cannot_be_assembled_is_refused(make, key, said):
    with pytest.raises(InputError) as caught:
        assemble(make())
    assert caught.value.key.startswith(key)
    assert said in str(caught.value)


def test_a_start_in_a_dead_centre_is_refused():
    """Coupler and rocker in line: the crank cannot push them."""
    base = linkages.four_bar()
    angles = zip(base.bodies, (math.pi, 0.0, math.pi), strict=True)
    bodies = tuple(replace(body, start_angle=angle) for body, angle in angles)
    ground = {"o": (0.0, 0.0), "p": (0.12 + 0.08 - 0.04, 0.0)}
    mechanism = replace(base, bodies=bodies, ground=ground)
    with pytest.raises(InputError, match="dead centre") as caught:
        assemble(mechanism)
    assert caught.value.key.startswith("joints.o")


def test_a_crank_that_cannot_turn_through_is_stopped_at_its_dead_centre():
    mechanism = stretched(0.07)
    with refused("drives.motor", reason="(joints o2, o3, o4)"):
        prescribed_motion(mechanism, np.linspace(0, 0.16, 50))


def test_what_is_left_free_has_no_prescribed_motion():
    for mechanism in (linkages.four_bar("o2"), linkages.LINKAGES["chain"]):
        with pytest.raises(InputError, match="left free"):
            prescribed_motion(mechanism, np.zeros(1))


def test_a_second_drive_of_constant_speed_may_turn_twice_as_fast():
    base = linkages.three_rrr()
    drives = tuple(
        linkages.constant_speed(f"servo{k}", f"arm{k}", 0.2 * (1 + k % 2), period=k == 0)
        for k in range(3)
    )
    motion = prescribed_motion(replace(base, drives=drives), np.linspace(0, 0.3, 7))
    forest = motion.assembly.loops.forest
    for k in range(3):
        spins = motion.v[:, forest.index("angle", f"arm{k}")]
        np.testing.assert_allclose(spins, 0.2 * (1 + k % 2), rtol=1e-9)

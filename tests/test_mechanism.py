"""Mechanisms as data: broken ones are refused by name, and where good ones are cut."""

from dataclasses import replace

import linkages
import pytest
from refusals import refused

from hpcclear.dynamics.linkage.mechanism import Mechanism, freedom
from hpcclear.dynamics.linkage.parts import Body
from hpcclear.dynamics.linkage.trees import forest
from hpcclear.scene.contacts.guide import PlanarSlide
from hpcclear.scene.contacts.pin_in_bearing import PlanarClearance
from hpcclear.scene.joints import PlanarRevolute

BASE = linkages.four_bar("o2", "o3")


def with_body(name, **changes):
    """The four-bar with a changed body."""
    bodies = tuple(replace(body, **changes) if body.name == name else body for body in BASE.bodies)
    return lambda: replace(BASE, bodies=bodies)


def with_joint(name, **changes):
    """The four-bar with a changed joint."""
    joints = tuple(
        linkages.changed(joint, **changes) if joint.name == name else joint for joint in BASE.joints
    )
    return lambda: replace(BASE, joints=joints)


def with_more(table, *more):
    """The four-bar with further entries of a table."""
    return lambda: replace(BASE, **{table: (*getattr(BASE, table), *more)})


LONE = Body("lone", 0.1, 1e-5, points={"a": (0.0, 0.0)})
DEAD = linkages.harmonic("swing", "rocker", 0.2, 9.0)

BROKEN = {
    "a joint to no body": (with_joint("o2", bearing="cupler.a"), "joints.o2.bearing", "no body"),
    "a joint to no point": (with_joint("o4", bearing="ground.x"), "joints.o4.bearing", "no point"),
    "a joint without a point": (with_joint("o1", journal="crank"), "joints.o1.journal", "no point"),
    "a joint of one body": (with_joint("o2", bearing="crank.a"), "joints.o2", "to itself"),
    "no joint at all": (with_more("bodies", LONE), "bodies.lone", "no joints lead"),
    "nothing on the ground": (
        lambda: replace(BASE, joints=BASE.joints[1:3]), "bodies.crank", "to the ground",
    ),
    "no body": (lambda: replace(BASE, bodies=()), "bodies", "Add [mechanism.bodies."),
    "a drive of no body": (
        lambda: replace(BASE, drives=(linkages.changed(linkages.MOTOR, body="crnk"),)), "drives.motor.body", "no such",
    ),
    "a drive of a guided body": (
        lambda: replace(linkages.slider_crank("o12"), drives=(linkages.changed(linkages.MOTOR, body="slider"),)),
        "drives.motor.body",
        "prismatic joint",
    ),
    "two drives of one body": (
        with_more("drives", linkages.harmonic("swing", "crank", 0.1, 1.0)), "drives.swing.body", "'motor'",
    ),
    "two that give the period": (
        lambda: replace(
            BASE, drives=(linkages.changed(linkages.MOTOR, period=True), linkages.changed(DEAD, period=True))
        ),
        "drives.swing.period",
        "already",
    ),
    "two periods": (with_more("drives", DEAD), "drives.swing", " s': does not repeat"),
    "turns of a drive that gives no period": (
        with_more("drives", linkages.constant_speed("wheel", "rocker", 80.0, turns=2)), "drives.wheel.turns", "'motor' defines",
    ),
    "no inertia": (
        with_body("rocker", inertia=0.0, center=(0.0, 0.0)),  # that of its pin
        "bodies.rocker.inertia",
        "needs an inertia",
    ),
    "a point named like the centre": (
        with_body("crank", points={"a": (0, 0), "b": (1, 0), "center": (0, 0)}),
        "bodies.crank.points.center",
        "mass centre",
    ),
    "a name with a blank": (
        lambda: replace(BASE, bodies=(*BASE.bodies, replace(LONE, name="a b"))),
        "bodies.a b",
        "not a valid name",
    ),
    "over-constrained": (
        lambda: replace(
            linkages.four_bar(),
            bodies=(*BASE.bodies, linkages.bar("brace", 0.1, 0.1)),
            joints=(
                *linkages.four_bar().joints,
                *linkages.pins((), "o5 brace.a crank.b", "o6 brace.b ground.p"),
            ),
        ),
        "joints.o6",
        "too many degrees of freedom",
    ),
    "too many drives": (
        lambda: replace(linkages.four_bar(), drives=(linkages.MOTOR, linkages.constant_speed("other", "rocker", 40.0))),
        "joints.o4",
        "remove a drive",
    ),
    "held on a body": (
        with_more("joints", linkages.fixed("weld", "rocker.b", "coupler.b")),
        "joints.weld.line",
        "to the ground only",
    ),
    "a ground that slides": (
        with_more("joints", linkages.slide("rail", "ground.o", "rocker.a")), "joints.rail.point", "Swap",
    ),
    "a load nowhere": (
        with_more("loads", linkages.load("force", "gas", place="piston.pin", force=[1.0, 0.0])), "loads.gas.place", "no body",
    ),
    "a spring nowhere": (
        with_more("loads", linkages.load("spring", "band", first="crank.a", second="crank.z", stiffness=1.0)),
        "loads.band.second", "no point",
    ),
    "too many joints with clearance": (
        lambda: Mechanism(
            tuple(linkages.bar(f"bar{k}", 0.1, 0.1) for k in range(9)),
            (
                linkages.revolute("o", "bar0.a", "ground.o"),
                *(linkages.loose_pin(f"o{k}", f"bar{k}.a", "bar0.b", 1e-4, 1e-2) for k in range(1, 9)),
                linkages.loose_pin("o9", "bar8.b", "ground.o", 1e-4, 1e-2),
            ),
            (linkages.constant_speed("motor", "bar0", 1.0),),
        ),
        "joints",
        "more than 8",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", BROKEN)
def test_what_makes_no_mechanism_is_refused_by_name(case):
    make, key, said = BROKEN[case]
    with refused(key, said=said) as caught:
        make()
    assert len(caught.value.remedy) > 5


@pytest.mark.parametrize("name", linkages.LINKAGES)
def test_coordinates_less_closures_are_the_degrees_of_freedom(name):
    mechanism = linkages.LINKAGES[name]
    for cartesian in (False, True):
        trees = forest(mechanism, cartesian)
        rows = sum(
            2 if isinstance(one, (PlanarClearance, PlanarRevolute, PlanarSlide)) else 1
            for one in trees.closures
        )
        assert len(trees.coordinates) - rows == freedom(mechanism)
        assert len(set(trees.coordinates)) == len(trees.coordinates)

"""Twenty linkages for the tests, as data: engines, four-bars, presses, a shaper, parallel robots."""

import math
from dataclasses import replace

from hpcclear.dynamics.linkage.mechanism import Mechanism
from hpcclear.dynamics.linkage.parts import Body, split
from hpcclear.scene.contacts.guide import PlanarSlide
from hpcclear.scene.contacts.pin_in_bearing import PlanarClearance
from hpcclear.scene.contacts.pin_in_slot import PlanarSlot
from hpcclear.scene.driving import PlanarHarmonic, PlanarSpeed, PlanarTorque
from hpcclear.scene.joints import IdealPinFriction, JointFriction, PlanarFixed, PlanarRevolute
from hpcclear.scene.loads import KINDS


def rows(table, kind, names):
    """What makes rows of a scene's table, entries by position or name, unchecked."""

    def made(*entries, **more):
        given = dict(zip(names.split(), entries, strict=False))
        return table.model_construct(kind=kind, **given, **more)

    return made


constant_speed = rows(PlanarSpeed, "constant-speed", "name body speed period")
harmonic = rows(PlanarHarmonic, "harmonic", "name body amplitude frequency mean phase period")
torque_drive = rows(PlanarTorque, "torque", "name body torque initial_speed")
revolute = rows(PlanarRevolute, "revolute", "name journal bearing")
loose_pin = rows(PlanarClearance, "clearance", "name journal bearing clearance bearing_radius")
slide = rows(PlanarSlide, "slide", "name point line angle friction")
slot = rows(PlanarSlot, "slot", "name point line angle clearance pin_radius")
fixed = rows(PlanarFixed, "fixed", "name point line angle")


def changed(row, **entries):
    """A row of a scene's table with other entries."""
    return row.model_copy(update=entries)


def load(kind, name, **entries):
    """A load of a kind by its entries in a scene."""
    return KINDS[kind](kind=kind, name=name, **entries)


MOTOR = constant_speed("motor", "crank", 40.0)
ENGINE = torque_drive("engine", "crank", 3.0, 40.0, flywheel_inertia=2e-3)


def bar(name, length, mass, start=0.0, *, off=0.0, **points):
    """A bar from a to b with further points, its mass centre a little off the line if asked to."""
    given = {"a": (0.0, 0.0), "b": (length, 0.0), **points}
    return Body(name, mass, mass * length**2 / 10, (0.45 * length, off), given, start)


def pin(name, journal, bearing, *, open_pins=()):
    """A pin, with clearance if it is named among the open ones."""
    if name in open_pins:
        return loose_pin(name, journal, bearing, 2e-4, 0.01)
    return revolute(name, journal, bearing)


def spring(name, first, second, stiffness, length, damping, **more):
    ends = {"first": first, "second": second, "stiffness": stiffness, "length": length}
    return load("spring", name, **ends, damping=damping, **more)


def pins(open_pins, *rows):
    """Pins by texts such as "o1 crank.a ground.o"."""
    return tuple(pin(*row.split(), open_pins=open_pins) for row in rows)


def slider_crank(*open_pins, drive=MOTOR, tilt=0.0, offset=0.0, friction=None, off=0.0, loads=()):
    turn = tilt
    bodies = (
        bar("crank", 0.05, 0.3, turn + 0.3, off=off),
        bar("rod", 0.12, 0.21, turn - 0.1, off=off),
        Body("slider", 0.14, points={"pin": (0.0, 0.0), "top": (0.03, 0.01)}, start_angle=turn),
    )
    shift = (-offset * math.sin(turn), offset * math.cos(turn))
    return Mechanism(
        bodies,
        (
            slide("guide", "slider.pin", "ground.line", tilt, friction),
            *pins(open_pins, "o14 crank.a ground.o", "o12 crank.b rod.a", "o23 slider.pin rod.b"),
        ),
        (drive,),
        {"o": (0.0, 0.0), "line": shift},
        loads,
    )


FOUR = (
    "o1 crank.a ground.o",
    "o2 crank.b coupler.a",
    "o3 coupler.b rocker.b",
    "o4 rocker.a ground.p",
)


def four_bar(*open_pins, drive=MOTOR, off=0.0, loads=()):
    bodies = (
        bar("crank", 0.04, 0.2, 0.4, off=off),
        bar("coupler", 0.12, 0.3, 0.5, off=off, tip=(0.06, 0.05)),
        bar("rocker", 0.08, 0.25, 1.6, off=off),
    )
    return Mechanism(
        bodies, pins(open_pins, *FOUR), (drive,), {"o": (0.0, 0.0), "p": (0.13, 0.01)}, loads
    )


def v_twin(*open_pins, drive=MOTOR, friction=None):
    bank = math.radians(35)
    bodies = [bar("crank", 0.04, 0.8, 1.3)]
    joints = [pin("main", "crank.a", "ground.o")]
    loads = []
    for side, tilt in (("left", math.pi / 2 + bank), ("right", math.pi / 2 - bank)):
        lean = 0.2 if side == "left" else -0.2
        bodies += [
            bar(f"rod_{side}", 0.13, 0.3, tilt + lean),
            Body(f"piston_{side}", 0.4, points={"pin": (0.0, 0.0)}, start_angle=tilt),
        ]
        joints += [
            slide(f"bore_{side}", f"piston_{side}.pin", "ground.o", tilt, friction),
            pin(f"big_{side}", "crank.b", f"rod_{side}.a", open_pins=open_pins),
            pin(f"small_{side}", f"piston_{side}.pin", f"rod_{side}.b", open_pins=open_pins),
        ]
        gas = {"size": [[0.0, 1.0], [3.0, 2.0]], "direction": tilt + math.pi}
        loads.append(load("force", f"gas_{side}", place=f"piston_{side}.pin", **gas))
    return Mechanism(tuple(bodies), tuple(joints), (drive,), loads=tuple(loads))


def six_bar(*open_pins, friction=None):
    """A crank-rocker whose rocker drives a ram."""
    base = four_bar(*open_pins)
    bodies = (
        *base.bodies,
        bar("link", 0.15, 0.2, math.pi / 2 - 0.1),
        Body("ram", 1.5, points={"pin": (0.0, 0.0)}, start_angle=math.pi / 2),
    )
    joints = (
        *base.joints,
        slide("bed", "ram.pin", "ground.bed", math.pi / 2, friction),
        *pins(open_pins, "o5 rocker.b link.a", "o6 ram.pin link.b"),
    )
    loads = (load("force", "work", place="ram.pin", force=[0.0, -200.0]),)
    return Mechanism(bodies, joints, base.drives, {**base.ground, "bed": (0.13, 0.0)}, loads)


def quick_return(*open_pins, friction=None):
    """Crank, block on a rocking lever, and the lever's pin on the ground."""
    bodies = (
        bar("crank", 0.05, 0.3, 0.4),
        Body("block", 0.1, 2e-5, points={"pin": (0.0, 0.0), "edge": (0.01, 0.004)}),
        bar("lever", 0.25, 0.6, 1.1, top=(0.25, 0.02)),
    )
    joints = (
        *pins(open_pins, "o1 crank.a ground.o", "o2 crank.b block.pin", "o3 lever.a ground.p"),
        slide("slot", "block.pin", "lever.a", 0.0, friction),
    )
    loads = (spring("return_spring", "lever.top", "ground.o", 300.0, 0.1, 2.0),)
    return Mechanism(bodies, joints, (MOTOR,), {"o": (0.0, 0.0), "p": (0.0, -0.1)}, loads)


def slotted_lever(*open_pins, clearance=None):
    """A crank pin in the slot of a rocking lever."""
    base = quick_return(*open_pins)
    bodies = tuple(body for body in base.bodies if body.name != "block")
    joints = [joint for joint in base.joints if joint.name in ("o1", "o3")]
    places = ("slot", "crank.b", "lever.a", 0.1)
    made = slot(*places) if clearance is None else slot(*places, clearance, 0.006)
    return Mechanism(bodies, (*joints, made), base.drives, base.ground, base.loads)


def three_rrr(*open_pins):
    """A platform on three legs, each with a harmonic drive."""
    radius, corner = 0.25, 0.08
    bodies = [
        Body(
            "platform", 1.0, 4e-3, (0.0, 0.0),
            {f"p{k}": (corner * math.cos(2.1 * k), corner * math.sin(2.1 * k)) for k in range(3)},
        )
    ]  # fmt: skip
    joints, drives, ground = [], [], {}
    for k in range(3):
        angle = 2.1 * k
        ground[f"g{k}"] = (radius * math.cos(angle), radius * math.sin(angle))
        bodies += [bar(f"arm{k}", 0.12, 0.2, angle + 2.2), bar(f"leg{k}", 0.14, 0.15, angle + 3.9)]
        knees = f"knee{k} arm{k}.b leg{k}.a", f"tip{k} leg{k}.b platform.p{k}"
        joints += pins(open_pins, f"base{k} arm{k}.a ground.g{k}", *knees)
        drives.append(
            harmonic(f"servo{k}", f"arm{k}", 0.2, 2.0 * (1 + k % 2), angle + 2.2, 0.4 * k, k == 0)
        )
    return Mechanism(tuple(bodies), tuple(joints), tuple(drives), ground)


def pendulum_chain():
    """Three bars in a row, the first driven by a torque, the last held by a spring."""
    bodies = tuple(
        bar(name, 0.1, 0.2, 0.3 * k, off=0.004) for k, name in enumerate(("crank", "two", "three"))
    )
    joints = pins((), "o1 crank.a ground.o", "o2 two.a crank.b", "o3 three.a two.b")
    loads = (
        spring("band", "three.b", "ground.q", 50.0, 0.05, 0.3),
        load("torque", "brake", body="two", torque=-0.4),
    )
    return Mechanism(bodies, joints, (ENGINE,), {"o": (0.0, 0.0), "q": (0.2, 0.2)}, loads)


def two_stage(*open_pins):
    """A guide on a moving carriage, which a crank pushes along the ground: guides in a row."""
    base = slider_crank(*open_pins)
    bodies = (
        *base.bodies,
        Body("tool", 0.2, points={"grip": (0.0, 0.0)}, start_angle=0.9),
        bar("strut", 0.16, 0.1, 2.0),
    )
    joints = (
        *base.joints,
        slide("feed", "tool.grip", "slider.top", 0.9),
        *pins(open_pins, "o5 tool.grip strut.b", "o6 strut.a ground.r"),
    )
    return Mechanism(bodies, joints, base.drives, {**base.ground, "r": (0.22, -0.05)}, base.loads)


def turning_slide(*open_pins, friction=None):
    """A block on a driven arm, pulled along it by a link: the guide turns with the drive."""
    bodies = (
        Body("crank", 0.4, 1e-3, (0.02, 0.01), {"a": (0.0, 0.0), "c": (0.01, 0.0)}, 0.3),
        Body("block", 0.1, 2e-5, (0.002, 0.001), {"pin": (0.0, 0.0)}),
        bar("link", 0.09, 0.1, 2.5),
    )
    joints = (
        *pins(open_pins, "o1 crank.a ground.o", "o2 block.pin link.b", "o3 link.a ground.p"),
        slide("arm", "block.pin", "crank.c", 0.25, friction),
    )
    return Mechanism(bodies, joints, (MOTOR,), {"o": (0.0, 0.0), "p": (0.06, 0.01)})


def held_frame(*open_pins):
    """A four-bar whose base plate is a body held on the ground, askew."""
    base = four_bar(*open_pins)
    plate = Body("plate", 5.0, points={"o": (0.0, 0.0), "p": (0.13, 0.01)})
    joints = tuple(changed(j, bearing=j.bearing.replace("ground.", "plate.")) for j in base.joints)
    return Mechanism(
        (*base.bodies, plate), (*joints, fixed("bolts", "plate.o", "ground.o", 0.2)), base.drives
    )


def loosened(mechanism, *names, length=0.05, height=0.02, radius=1e-3):
    """A mechanism whose named guides have clearance; what they guide then turns, and needs an inertia."""
    loose = {
        j.name: changed(
            j, friction=None, clearance=2e-4, length=length, height=height, corner_radius=radius
        )
        for j in mechanism.joints
        if j.name in names
    }
    bodies = []
    for body in mechanism.bodies:
        points = dict(body.points)
        for joint in loose.values():
            own, point = split(joint.point)
            if own == body.name:
                points |= joint.further_points(points[point])
        guided = len(points) > len(body.points)
        inertia = 3e-5 if guided and not body.inertia else body.inertia
        bodies.append(replace(body, points=points, inertia=inertia))
    joints = tuple(loose.get(j.name, j) for j in mechanism.joints)
    return replace(mechanism, bodies=tuple(bodies), joints=joints)


def rubbing(mechanism, *names, coefficient=0.2, radius=0.008):
    """A mechanism with friction in its named pins, all without clearance by default."""
    joints = tuple(
        changed(
            j,
            friction=IdealPinFriction(
                coefficient=coefficient, ramp_speed=0.3, radius=radius * (1.0 + 0.2 * k)
            ),
        )
        if isinstance(j, PlanarRevolute) and (not names or j.name in names)
        else j
        for k, j in enumerate(mechanism.joints)
    )
    return replace(mechanism, joints=joints)


RUB = JointFriction(coefficient=0.15, ramp_speed=0.1)
BLOWER = changed(
    ENGINE, torque=None, torque_by_speed=((0.0, 3.0), (12.0, 5.0), (25.0, 1.0), (40.0, -0.5))
)
HELD = (
    load(
        "torsion-spring",
        "coil",
        body="rocker",
        stiffness=4.0,
        angle=0.3,
        damping=0.2,
        lower=1.0,
        upper=1.4,
        stop_stiffness=30.0,
    ),
    load(
        "torsion-spring",
        "between",
        body="rocker",
        other="coupler",
        stiffness=1.5,
        angle=-0.2,
        damping=0.1,
    ),
    spring("buffer", "coupler.tip", "ground.o", 400.0, 0.09, 3.0, acts="pushing"),
    spring("rope", "coupler.tip", "ground.p", 250.0, 0.05, 1.0, acts="pulling"),
)
MOVED = (
    load(
        "cylinder",
        "ram",
        first="coupler.tip",
        second="ground.p",
        force=[[0.03, 20.0], [0.08, 5.0], [0.12, -9.0]],
        damping=2.0,
    ),
    load("cylinder", "jack", first="coupler.tip", second="ground.o", force=12.0),
    load("drag", "fan", body="rocker", linear=0.02, quadratic=0.003),
    load("force", "jet", place="coupler.tip", force=[3.0, -8.0], follows=True),
)
PUSH = (
    load("force", "push", place="slider.top", force=[-30.0, 7.0]),
    load("torque", "twist", body="rod", torque=0.3),
)

LINKAGES = {
    "slider-crank, two": slider_crank("o12", "o23", loads=PUSH),
    "slider-crank, three, torque": slider_crank("o14", "o12", "o23", drive=ENGINE, off=0.003),
    "slider-crank, tilted, one": slider_crank("o12", tilt=0.5, offset=0.01, friction=RUB, off=0.004),
    "slider-crank, offset, far": slider_crank("o23", offset=0.02, drive=ENGINE, friction=RUB, loads=PUSH),
    "slider-crank, ideal": slider_crank(friction=RUB),
    "slider-crank, ideal, torque": slider_crank(drive=ENGINE, friction=RUB, off=0.002, loads=PUSH),
    "four-bar, none": four_bar(loads=(load("force", "tip", place="coupler.tip", force=[4.0, -9.0]),)),
    "four-bar, springs": four_bar("o3", loads=HELD),
    "four-bar, cylinders": four_bar("o2", "o3", drive=BLOWER, loads=MOVED),
    "four-bar, one": four_bar("o3", off=0.006),
    "four-bar, two": four_bar("o2", "o3", drive=ENGINE),
    "four-bar, four": four_bar("o1", "o2", "o3", "o4"),
    "v-twin, four": v_twin("big_left", "big_right", "small_left", "small_right", friction=RUB),
    "v-twin, two, torque": v_twin("big_left", "small_right", drive=ENGINE, friction=RUB),
    "v-twin, ideal, torque": v_twin(drive=ENGINE, friction=RUB),
    "six-bar, two": six_bar("o3", "o6", friction=RUB),
    "six-bar, one, a loop": six_bar("o5"),
    "quick-return": quick_return("o2", friction=RUB),
    "quick-return, ideal": quick_return(friction=RUB),
    "3-RRR, three": three_rrr("tip0", "tip1", "tip2"),
    "3-RRR, one": three_rrr("knee1"),
    "chain": pendulum_chain(),
    "two stages": two_stage("o23"),
    "turning slide": turning_slide("o2"),
    "held frame": held_frame("o2"),
    "slider-crank, loose guide": loosened(slider_crank("o23", tilt=0.4, offset=0.01, off=0.003), "guide"),
    "quick-return, loose slot": loosened(quick_return(), "slot"),
    "two stages, both loose": loosened(two_stage(), "guide", "feed"),
    "slider-crank, rubbing pins": rubbing(slider_crank(off=0.003, friction=RUB, loads=PUSH)),
    "slider-crank, rubbing, torque": rubbing(slider_crank(drive=ENGINE, friction=RUB, loads=PUSH, off=0.002)),
    "slider-crank, one loose, rubbing": rubbing(slider_crank("o12", friction=RUB, tilt=0.3, offset=0.01)),
    "four-bar, rubbing pins": rubbing(four_bar(drive=BLOWER, off=0.004, loads=MOVED)),
    "four-bar, rubbing, driven": rubbing(four_bar(loads=HELD)),
    "v-twin, rubbing": rubbing(v_twin("big_left", drive=ENGINE, friction=RUB)),
    "six-bar, rubbing": rubbing(six_bar("o5", friction=RUB)),
    "quick-return, rubbing": rubbing(quick_return(friction=RUB)),
    "chain, rubbing": rubbing(pendulum_chain()),
    "two stages, rubbing": rubbing(two_stage("o23")),
    "turning slide, rubbing": rubbing(turning_slide(friction=RUB)),
    "3-RRR, rubbing": rubbing(three_rrr("tip0", "tip1", "tip2")),
    "held frame, rubbing": rubbing(held_frame("o2")),
    "slotted lever": rubbing(slotted_lever()),
    "slotted lever, torque": rubbing(replace(slotted_lever(), drives=(ENGINE,))),
    "slotted lever, loose": rubbing(slotted_lever(clearance=2e-4)),
    "slotted lever, all loose": replace(slotted_lever("o1", "o3", clearance=2e-4), drives=(ENGINE,)),
    "turning slide, loose": loosened(turning_slide("o2"), "arm"),
}  # fmt: skip

"""Random scenes of linkages, and slips that people make in them: each with what a command must answer."""

import copy
import math
import random
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

Content = dict[str, Any]

STEEL = {"youngs_modulus": "206 GPa", "poisson_ratio": 0.3}
BRONZE = {"youngs_modulus": "110 GPa", "poisson_ratio": 0.34}


@dataclass(frozen=True)
class Slip:
    """A scene, what is wrong with it, and which of these words a refusal must hold; none: it is to be accepted."""

    name: str
    content: Content
    words: tuple[str, ...] = ()
    turns: bool | None = None
    """Whether its crank can turn all round; None where nobody asks."""


def mm(value: float) -> str:
    return f"{value:.4f} mm"


def joint(dice: random.Random, journal: str, bearing: str) -> Content:
    places = {"journal": journal, "bearing": bearing}
    if dice.random() < 0.5:
        return {"kind": "revolute", **places}
    return {
        "kind": "clearance",
        **places,
        "clearance": mm(dice.uniform(0.02, 0.4)),
        "bearing_radius": mm(dice.uniform(8.0, 20.0)),
        "materials": {"bearing": BRONZE, "journal": STEEL},
    }


def bar(dice: random.Random, length: float, start: float) -> Content:
    """A bar of so many millimetres."""
    mass = dice.uniform(0.05, 0.6)
    return {
        "length": mm(length),
        "mass": mass,
        "inertia": mass * (length * 1e-3) ** 2 / dice.uniform(8.0, 12.0),
        "start_angle": f"{start:.2f} deg",
    }


def drive(dice: random.Random) -> Content:
    speed = dice.uniform(100, 3000)
    if dice.random() < 0.8:
        return {"kind": "constant-speed", "body": "crank", "speed": f"{speed:.1f} rpm"}
    return {
        "kind": "torque",
        "body": "crank",
        "torque": f"{dice.uniform(0.1, 5.0):.4f} N*m",
        "initial_speed": f"{speed:.1f} rpm",
        "no_load_speed": f"{1.5 * speed:.1f} rpm",
    }


def scene(bodies: Content, ground: Content, joints: Content, driven: Content) -> Content:
    effects: Content = {"gravity": 9.81}
    if any(row["kind"] == "clearance" for row in joints.values()):
        effects["contact"] = {"law": "hunt-crossley", "damping": 0.4}
        effects["friction"] = {"law": "coulomb", "coefficient": 0.05, "ramp_speed": "10 mm/s"}
    return {
        "format_version": 2,
        "mechanism": {
            "kind": "planar",
            "ground": {"points": ground},
            "bodies": bodies,
            "joints": joints,
            "drives": {"motor": driven},
        },
        "effects": effects,
    }


def four_bar(dice: random.Random, turns: bool) -> Content:
    """A four-bar on the wanted side of Grashof's condition for its crank, by a margin; bars in mm."""
    while True:
        crank, coupler, rocker, ground = (dice.uniform(20.0, 200.0) for _ in range(4))
        others = sorted((coupler, rocker, ground))
        # The crank turns all round if it is the shortest and shortest + longest < the other two, or if the ground is.
        lengths = sorted((crank, coupler, rocker, ground))
        margin = lengths[1] + lengths[2] - lengths[0] - lengths[3]
        full = margin > 0 and lengths[0] in (crank, ground)
        if abs(margin) > 4.0 and full == turns and crank < sum(others):
            break
    angle = _closing_angle(dice, crank, coupler, rocker, ground)
    if angle is None:
        return four_bar(dice, turns)
    first, second, third = angle
    bodies = {
        "crank": bar(dice, crank, first),
        "coupler": bar(dice, coupler, second),
        "rocker": bar(dice, rocker, third),
    }
    joints = {
        "o1": {"kind": "revolute", "journal": "crank.a", "bearing": "ground.o"},
        "o2": joint(dice, "crank.b", "coupler.a"),
        "o3": joint(dice, "coupler.b", "rocker.b"),
        "o4": {"kind": "revolute", "journal": "rocker.a", "bearing": "ground.p"},
    }
    places = {"o": [0.0, 0.0], "p": [mm(ground), "0 mm"]}
    return scene(bodies, places, joints, drive(dice))


def _closing_angle(
    dice: random.Random, crank: float, coupler: float, rocker: float, ground: float
) -> tuple[float, float, float] | None:
    """Angles in degrees of the three bars at a crank angle at which the loop closes, well away from a dead centre."""
    for _ in range(40):
        first = dice.uniform(0.0, 2.0 * math.pi)
        x, y = crank * math.cos(first), crank * math.sin(first)
        across = math.hypot(ground - x, -y)
        if not abs(coupler - rocker) + 2.0 < across < coupler + rocker - 2.0:
            continue
        lean = (coupler**2 + across**2 - rocker**2) / (2.0 * coupler * across)
        second = math.atan2(-y, ground - x) + math.acos(lean)
        end = x + coupler * math.cos(second), y + coupler * math.sin(second)
        third = math.atan2(end[1], end[0] - ground)
        return tuple(math.degrees(angle) for angle in (first, second, third))  # type: ignore[return-value]
    return None


def slider_crank(dice: random.Random, turns: bool) -> Content:
    """A slider-crank whose guide may be tilted and offset; the crank turns if rod > crank + offset."""
    crank, tilt = dice.uniform(20.0, 60.0), dice.uniform(-90.0, 90.0)
    offset = dice.uniform(0.0, 0.3 * crank)
    rod = (crank + offset) * (dice.uniform(1.2, 4.0) if turns else dice.uniform(0.45, 0.9))
    if rod < offset + 2.0:
        return slider_crank(dice, turns)
    # the crank along the guide: what is left across is the offset
    lean = math.degrees(math.asin(offset / rod))
    turn = math.radians(tilt)
    bodies = {
        "crank": bar(dice, crank, tilt),
        "rod": bar(dice, rod, tilt + lean),
        "slider": {"mass": dice.uniform(0.05, 0.5), "points": {"pin": [0.0, 0.0]}, "start_angle": f"{tilt:.4f} deg"},
    }  # fmt: skip
    joints = {
        "main": {"kind": "revolute", "journal": "crank.a", "bearing": "ground.o"},
        "big": joint(dice, "crank.b", "rod.a"),
        "small": joint(dice, "slider.pin", "rod.b"),
        "guide": {"kind": "slide", "point": "slider.pin", "line": "ground.line", "angle": f"{tilt:.4f} deg"},
    }  # fmt: skip
    places = {"o": [0.0, 0.0], "line": [mm(-offset * math.sin(turn)), mm(offset * math.cos(turn))]}
    return scene(bodies, places, joints, drive(dice))


def base(dice: random.Random, turns: bool = True) -> Content:
    return dice.choice((four_bar, slider_crank))(dice, turns)


# -- slips: each takes a sound scene, spoils it in place, and returns the words that its refusal must hold ------------


def missing_drive(dice: random.Random, content: Content) -> tuple[str, ...]:
    del content["mechanism"]["drives"]
    return ("drives",)


def drive_of_nobody(dice: random.Random, content: Content) -> tuple[str, ...]:
    content["mechanism"]["drives"]["motor"]["body"] = "crnk"
    return ("mechanism.drives.motor.body", "crank")


def _some_body(dice: random.Random, content: Content) -> tuple[str, Content]:
    return dice.choice(list(content["mechanism"]["bodies"].items()))


def wrong_unit(dice: random.Random, content: Content) -> tuple[str, ...]:
    name, body = _some_body(dice, content)
    key, unit = dice.choice((("mass", "mm"), ("inertia", "kg*m"), ("start_angle", "mm")))
    body[key] = f"1.5 {unit}"
    return (f"mechanism.bodies.{name}.{key}", unit)


def unknown_unit(dice: random.Random, content: Content) -> tuple[str, ...]:
    name, body = _some_body(dice, content)
    body["mass"] = "0.3 klio"
    return (f"mechanism.bodies.{name}.mass", "klio")


def speed_in_hertz(dice: random.Random, content: Content) -> tuple[str, ...]:
    motor = content["mechanism"]["drives"]["motor"]
    key = "speed" if "speed" in motor else "initial_speed"
    motor[key] = "15 Hz"
    return (f"mechanism.drives.motor.{key}", "rpm")


def misspelt_key(dice: random.Random, content: Content) -> tuple[str, ...]:
    name, body = _some_body(dice, content)
    body["mas"] = body.pop("mass")
    return (f"mechanism.bodies.{name}.mas", "mass")


def unknown_point(dice: random.Random, content: Content) -> tuple[str, ...]:
    joints = content["mechanism"]["joints"]
    name = dice.choice([name for name, row in joints.items() if "journal" in row])
    joints[name]["journal"] = "crank.c"
    return (f"mechanism.joints.{name}", "crank.c")


def unknown_body(dice: random.Random, content: Content) -> tuple[str, ...]:
    joints = content["mechanism"]["joints"]
    name = dice.choice([name for name, row in joints.items() if "journal" in row])
    joints[name]["bearing"] = "crankcase.o"
    return (f"mechanism.joints.{name}", "crankcase")


def negative_mass(dice: random.Random, content: Content) -> tuple[str, ...]:
    name, body = _some_body(dice, content)
    body["mass"] = -0.2
    return (f"mechanism.bodies.{name}.mass", "above 0")


def huge_clearance(dice: random.Random, content: Content) -> tuple[str, ...]:
    joints = content["mechanism"]["joints"]
    name, row = dice.choice([(name, row) for name, row in joints.items() if "journal" in row])
    places = {"journal": row["journal"], "bearing": row["bearing"]}
    joints[name] = {
        "kind": "clearance", **places, "clearance": "30 mm", "bearing_radius": "10 mm",
        "materials": {"bearing": BRONZE, "journal": STEEL},
    }  # fmt: skip
    return (f"mechanism.joints.{name}", "clearance")


def no_contact_law(dice: random.Random, content: Content) -> tuple[str, ...]:
    words = huge_clearance(dice, content)
    name = words[0].rpartition(".")[2]
    content["mechanism"]["joints"][name]["clearance"] = "0.1 mm"
    content["effects"] = {}
    return ("contact",)


def a_joint_left_out(dice: random.Random, content: Content) -> tuple[str, ...]:
    del content["mechanism"]["joints"][dice.choice(list(content["mechanism"]["joints"]))]
    return ()  # a machine of its own, mostly: accepted or refused with a reason


def two_drives_of_a_crank(dice: random.Random, content: Content) -> tuple[str, ...]:
    content["mechanism"]["drives"]["second"] = {
        "kind": "constant-speed",
        "body": "crank",
        "speed": 10.0,
    }
    return ("drives",)


def far_apart(dice: random.Random, content: Content) -> tuple[str, ...]:
    """A loop that cannot close."""
    mechanism = content["mechanism"]
    points = mechanism["ground"]["points"]
    if "p" in points:
        points["p"] = ["3 m", "3 m"]
    else:  # a guide's line is moved across itself
        turn = math.radians(float(mechanism["joints"]["guide"]["angle"].split()[0]))
        points["line"] = [-3.0 * math.sin(turn), 3.0 * math.cos(turn)]
    return ("joint",)


def wrong_law(dice: random.Random, content: Content) -> tuple[str, ...]:
    content["effects"]["contact"] = {"law": "hunt-crosley", "damping": 0.4}
    return ("effects.contact", "hunt-crossley")


def rpm_without_quotes(dice: random.Random, content: Content) -> tuple[str, ...]:
    """A plain number is SI: accepted, with a warning where it is of no usual size."""
    motor = content["mechanism"]["drives"]["motor"]
    motor["speed" if "speed" in motor else "initial_speed"] = dice.uniform(900.0, 3000.0)
    return ()


REFUSED: tuple[Callable[[random.Random, Content], tuple[str, ...]], ...] = (
    missing_drive, drive_of_nobody, wrong_unit, unknown_unit, speed_in_hertz, misspelt_key, unknown_point, unknown_body,
    negative_mass, huge_clearance, no_contact_law, two_drives_of_a_crank, far_apart, wrong_law,
)  # fmt: skip
ACCEPTED_OR_NOT = (a_joint_left_out, rpm_without_quotes)


def slip(seed: int) -> Slip:
    """The random scene of this number: a third sound, a fifth locked, the others with a slip."""
    dice = random.Random(seed)
    chance = dice.random()
    if chance < 0.35:
        return Slip("sound", base(dice), turns=True)
    if chance < 0.55:
        content = base(dice, turns=False)
        constant = content["mechanism"]["drives"]["motor"]["kind"] == "constant-speed"
        return Slip("locked", content, ("cannot turn",) if constant else (), turns=False)
    content = copy.deepcopy(base(dice))
    spoil = dice.choice(REFUSED + ACCEPTED_OR_NOT)
    return Slip(spoil.__name__, content, spoil(dice, content))

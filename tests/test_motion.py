"""Equations of motion of the slider-crank against a dense model in nine coordinates that shares no formula with them."""

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from dense_linkage import Contact, Dense, admissible, assembled
from linkages import constant_speed, load, loose_pin, revolute, slide, torque_drive
from running import PHI, THETA2, X2, X3, Y2, scene_with
from some_laws import contact_law, row

from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.mechanism import Mechanism
from hpcclear.dynamics.linkage.observe import observe
from hpcclear.dynamics.linkage.parts import Body
from hpcclear.dynamics.planar.problem import linkage_of
from hpcclear.dynamics.planar.response import violation
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.problem import problem_of
from hpcclear.laws import laws
from hpcclear.scene.joints import JointFriction

CRANK = {"length": 0.05, "mass": 0.3, "inertia": 1.3e-4, "u": 0.02}
ROD = {"length": 0.12, "mass": 0.21, "inertia": 2.5e-4, "u": 0.045}
SLIDER_MASS = 0.14
SPEED = 520.0
GUIDE = (0.2, 0.5)  # coefficient, ramp speed
DAMPING = 0.5
RESTITUTION_FACTOR = 0.4
MU, RAMP = 0.1, 0.3
DEAD = 0.05
FILM = {"short": 8.0, "long": 20.0, "shear": 0.03, "floor": 0.04}
BRISTLES = {"stiffness": 3e4, "damping": 0.7, "viscous": 0.02, "static": 0.16, "speed": 6.0}
RUBBING = {
    "coefficient": MU,
    "inverse_ramp": 1 / RAMP,
    "dead_speed": DEAD,
    "bristles": BRISTLES["stiffness"],
    "damper": BRISTLES["damping"],
    "viscous_coefficient": BRISTLES["viscous"],
    "static_coefficient": BRISTLES["static"],
    "inverse_speed": 1 / BRISTLES["speed"],
}
OFFSET = 0.017
LOADS = [[0.0, -30.0], [math.pi, 20.0], [3 * math.pi, -5.0]]
"""N by the crank angle over two turns, straight between: rows at borders of the kernel's cells."""
DEFLECTIONS = np.array([4e-6, -2e-6])  # of the bristles in both joints, m
KERNEL_ORDER = [0, 1, 3, 4, 5, 6, 7, 8, 2]  # the kernel keeps the crank angle last

FULL = {"gravity", "load", "guide", "energies", "series"}
TOPOLOGIES = {
    "two": {"crank_rod", "rod_slider"},
    "O12": {"crank_rod"},
    "O23": {"rod_slider"},
    "none": set(),
}
MOTIONS = [
    ("two", {"fixed", "coulomb"}),
    ("two", FULL | {"latched", "ambrosio"}),
    ("two", FULL | {"fixed", "coulomb", "torque"}),
    ("two", FULL | {"latched", "coulomb", "short_film", "long_film"}),
    ("two", FULL | {"fixed", "lugre", "torque"}),
    ("O12", {"latched", "coulomb"}),
    ("O12", FULL | {"fixed", "ambrosio"}),
    ("O12", FULL | {"latched", "coulomb", "torque"}),
    ("O12", FULL | {"torque", "short_film"}),
    ("O23", {"fixed", "coulomb"}),
    ("O23", {"fixed", "lugre"}),
    ("O23", FULL | {"fixed", "long_film"}),
    ("O23", FULL | {"latched", "coulomb"}),
    ("O23", FULL | {"fixed", "ambrosio", "torque"}),
    ("none", {"torque", "energies", "series"}),
    ("none", FULL | {"torque"}),
]
FURTHER = [
    ("two", FULL - {"load"} | {"latched", "coulomb", "offset", "clockwise", "two turns"}),
    ("O12", FULL - {"load"} | {"fixed", "offset", "torque", "two turns"}),
]
"""An offset guide, a drive that turns clockwise, a load that repeats after two turns."""


def clip(x):
    return min(max(x, -1.0), 1.0)


CLEARANCES = {"crank_rod": 3e-4, "rod_slider": 5e-4}
BASES = {name: at.JOINTS[k].block for k, name in enumerate(CLEARANCES)}


def bar(numbers):
    return {**{k: v for k, v in numbers.items() if k != "u"}, "mass_center": numbers["u"]}


def models_of(effects):
    """Models of oil films by the joints that are open."""
    models = [model for model in ("short", "long") if f"{model}_film" in effects]
    return dict(zip((name for name in BASES if name in effects), models, strict=False))


@lru_cache(maxsize=64)
def scene_of(effects):
    """The scene of these effects (a frozen set), with this file's constants."""
    friction = {"law": "none"}
    if "coulomb" in effects:
        friction = {"law": "coulomb", "coefficient": MU, "ramp_speed": RAMP}
    if "ambrosio" in effects:
        friction = {"law": "ambrosio", "coefficient": MU, "speeds": [DEAD, DEAD + RAMP]}
    if "lugre" in effects:
        friction = {
            "law": "lugre", "coefficient": MU, "static_coefficient": BRISTLES["static"],
            "bristle_stiffness": BRISTLES["stiffness"], "bristle_damping": BRISTLES["damping"],
            "viscous_coefficient": BRISTLES["viscous"], "stribeck_speed": BRISTLES["speed"],
        }  # fmt: skip
    law = {"law": "hertz"}
    if "fixed" in effects:
        law = {"law": "hunt-crossley", "damping": DAMPING}
    if "latched" in effects:
        law = {"law": "lankarani-nikravesh", "restitution": 0.9}
    changes = {
        "mechanism.crank": bar(CRANK), "mechanism.rod": bar(ROD), "mechanism.slider.mass": SLIDER_MASS,
        "drive": {"kind": "constant-speed", "speed": SPEED},
        "effects": {"contact": law, "friction": friction, "gravity": 9.81 * ("gravity" in effects)},
        "numerics.alpha": 250.0, "numerics.beta": 240.0,
        "numerics.formulation": "baumgarte" if "baumgarte" in effects else "minimal",
    }  # fmt: skip
    if "torque" in effects:
        changes["drive"] = {"kind": "torque", "torque": 2.5, "initial_speed": SPEED}
    if "clockwise" in effects:
        changes["drive"]["speed"] = -SPEED
    if "offset" in effects:
        changes["mechanism.offset"] = OFFSET
    if "two turns" in effects:
        changes["drive"]["turns"] = 2
        changes["effects"]["slider_load"] = LOADS
        changes["numerics.interpolation"] = "linear"
    if "load" in effects:
        changes["effects"]["slider_load"] = -35.0
    if "guide" in effects:
        changes["effects"]["guide_friction"] = {"coefficient": GUIDE[0], "ramp_speed": GUIDE[1]}
    for name, clearance in CLEARANCES.items():
        if name not in effects:
            changes[f"joints.{name}"] = {"kind": "ideal"}
            continue
        changes[f"joints.{name}.clearance"] = clearance
        if name in models_of(effects):
            film = {"viscosity": 0.05, "length": 0.02, "roughness": 1e-5}
            changes[f"joints.{name}.film"] = {**film, "model": models_of(effects)[name]}
    return scene_with(changes)


def row_of_parameters(effects):
    """Parameters as the kernel reads them, with this file's constants."""
    par = parameters(scene_of(frozenset(effects)))[0]
    law = contact_law(effects)
    for joint in CLEARANCES.keys() & effects:
        base = BASES[joint]
        values = {
            row("contact", law, "stiffness"): 2e9,
            at.FILM_SCALE: FILM.get(models_of(effects).get(joint), 0.0),
            at.FILM_SHEAR: FILM["shear"],
            at.FILM_FLOOR: FILM["floor"],
        }
        if law != "hertz":
            factor = DAMPING if "fixed" in effects else RESTITUTION_FACTOR
            values[row("contact", law, "damping")] = factor
        for rubs in {"coulomb", "ambrosio", "lugre"} & effects:
            for name in laws("friction")[rubs].read:
                values[row("friction", rubs, name)] = RUBBING[name]
        for place, value in values.items():
            par[base + place] = value
    return par


def deflected(effects):
    """Deflections of the bristles in the joints that are open."""
    return DEFLECTIONS[["crank_rod" in effects, "rod_slider" in effects]]


def bristle_rate(deflection, sliding):
    """Rate of a deflection, m/s, by Canudas de Wit's equations."""
    falls = math.exp(-((sliding / BRISTLES["speed"]) ** 2))
    held = (MU + (BRISTLES["static"] - MU) * falls) / BRISTLES["stiffness"]
    return sliding - abs(sliding) / held * deflection


def laws_of(effects, joint, active, impact_speed, deflection):
    def factor(rate):
        if "fixed" in effects:
            return 1 + DAMPING * rate
        return 1 + (RESTITUTION_FACTOR * rate / impact_speed if "latched" in effects else 0.0)

    def friction(sliding):
        if "coulomb" in effects:
            return MU * clip(sliding / RAMP)
        if "ambrosio" in effects:
            size = min(max((abs(sliding) - DEAD) / RAMP, 0.0), 1.0)
            return MU * math.copysign(size, sliding)
        if "lugre" in effects:
            rate = bristle_rate(deflection, sliding)
            spring, damper = BRISTLES["stiffness"] * deflection, BRISTLES["damping"] * rate
            return spring + damper + BRISTLES["viscous"] * sliding
        return 0.0

    model = models_of(effects).get(joint)
    factors = {name: FILM[name] * (name == model) for name in ("short", "long")}
    active = active if "latched" in effects else 1.0
    return Contact(factor, friction, active, {**FILM, **factors} if model else None)


def mechanism_of(effects):
    """The slider-crank of these effects as data, beside what a scene is made into."""

    def bar(name, length, mass, inertia, u):
        return Body(name, mass, inertia, (u, 0.0), {"a": (0.0, 0.0), "b": (length, 0.0)})

    def pin(name, journal, bearing):
        if name in effects:
            return loose_pin(name, journal, bearing, CLEARANCES[name], 0.02)
        return revolute(name, journal, bearing)

    friction = JointFriction(coefficient=GUIDE[0], ramp_speed=GUIDE[1])
    drive = constant_speed("drive", "crank", SPEED * (-1 if "clockwise" in effects else 1))
    size = LOADS if "two turns" in effects else -35.0
    loaded = not effects.isdisjoint({"load", "two turns"})
    return Mechanism(
        (bar("crank", **CRANK), bar("rod", **ROD), Body("slider", SLIDER_MASS, points={"pin": (0.0, 0.0)})),
        (
            revolute("crank_frame", "crank.a", "ground.o"),
            slide("guide", "slider.pin", "ground.line", 0.0, friction if "guide" in effects else None),
            pin("crank_rod", "crank.b", "rod.a"),
            pin("rod_slider", "slider.pin", "rod.b"),
        ),
        (torque_drive("drive", "crank", 2.5, SPEED) if "torque" in effects else drive,),
        {"o": (0.0, 0.0), "line": (0.0, OFFSET if "offset" in effects else 0.0)},
        (load("force", "load", place="slider.pin", size=size),) * loaded,
    )  # fmt: skip


def dense_model(effects, contacts=None, feedback=False):
    """The dense model of these effects, by the contacts' flags and impact speeds."""
    angles, sizes = np.transpose([*LOADS, [2 * at.TURN, LOADS[0][1]]])
    return Dense(
        mechanism_of(effects),
        [
            laws_of(effects, joint, contacts[k], 1 / contacts[at.MAX_JOINTS + k], DEFLECTIONS[k])
            for k, joint in enumerate(CLEARANCES)
            if joint in effects
        ],
        gravity=9.81 if "gravity" in effects else 0.0,
        alpha=250.0 if feedback else 0.0,
        beta=240.0 if feedback else 0.0,
        curves={"load": lambda angle: np.interp(angle % (2 * at.TURN), angles, sizes)},
    )


def drive_of(mech):
    """Its speed, or about that of a free crank; and the moment that it exerted."""
    (drive,) = mech.mechanism.drives
    moments = mech.seen.get("torques") or {
        "drive": mech.seen.get("multipliers", {}).get(("drive", "drive"))
    }
    return getattr(drive, "speed", SPEED), moments["drive"]


def pose_of(mech, phi, eccentricities=()):
    """Nine coordinates of the mechanism at a crank angle, and eccentricities of its open joints."""
    turn = np.array([np.cos(phi), np.sin(phi)])
    pin, slider = CRANK["length"] * turn, CRANK["length"] * turn[0] + ROD["length"]
    guess = [*CRANK["u"] * turn, phi, pin[0] + ROD["u"], pin[1], 0.0, slider, 0.0, 0.0]
    return assembled(mech, guess, phi / drive_of(mech)[0], eccentricities)


def random_state(mech, rng, turns=1):
    """A state that meets the constraints, journals up to 1.3 clearances off centre; and its time."""
    eccentric = []
    for joint in mech.mechanism.clearances:
        reach, angle = joint.clearance * rng.uniform(0.7, 1.3), rng.uniform(0, at.TURN)
        eccentric.append(reach * np.array([np.cos(angle), np.sin(angle)]))
    speed, _ = drive_of(mech)
    phi = math.copysign(rng.uniform(0, at.TURN * turns), speed)
    q, t = pose_of(mech, phi, eccentric), phi / speed
    wanted = rng.normal(size=9) * np.array([5, 5, SPEED, 8, 8, 90, 10, 0, 0])
    wanted[PHI] = speed * rng.uniform(0.5, 1.5)
    return q, admissible(mech, q, wanted, t), t


def reduced(effects, values):
    """Minimal coordinates among the nine."""
    topology = ("crank_rod" in effects, "rod_slider" in effects)
    rows = [X2, Y2, THETA2, X3] if all(topology) else [THETA2, X3]
    return values[rows + [PHI] * ("torque" in effects)]


def seen_by_kernel(effects, par, q, v, contacts, t):
    """Accelerations, those of bristles first where there are any, and rates of one state from the kernel."""
    problem = problem_of(scene_of(frozenset(effects)))
    asked = {name: 1 if name in effects else None for name in ("series", "energies")}
    problem = replace(problem, effects=problem.effects._replace(**asked))
    if "lugre" in effects:
        z = deflected(effects)
        q, v = np.concatenate([np.full(len(z), 7.0), q]), np.concatenate([z, v])
    out = np.zeros((1, len(q) + at.RATES))
    states = np.concatenate([q, v])[None]
    motion = problem.motion(problem.effects, 1).address
    times = np.array([t]), np.zeros(1)
    observe(motion, par, problem.tables, states, contacts[None], times, out)
    return out[0, : len(q)], out[0, len(q) :]


def cases(rng, effects, count=25):
    """Random states of a set of effects with the model that describes each."""
    par = row_of_parameters(effects)
    for _ in range(count):
        contacts = np.zeros((2, at.MAX_JOINTS))
        contacts[0, :2] = rng.integers(0, 2, 2)
        contacts[1, :2] = rng.uniform(0.3, 3.0, 2)
        contacts = contacts.ravel()
        mech = dense_model(effects, contacts)
        yield par, contacts, mech, *random_state(mech, rng, 2 if "two turns" in effects else 1)


def scale_of(reference):
    return np.abs(reference).max()


def check_rates(effects, mech, rates, v):
    """Gaps, forces and powers of the kernel against the dense model's."""
    for name, joint in zip(CLEARANCES, at.JOINTS, strict=False):
        if name in effects:
            seen = mech.seen[name]
            np.testing.assert_allclose(rates[joint.gap], seen["gap"], rtol=0, atol=1e-16)
            np.testing.assert_allclose(rates[joint.force], seen["normal"], rtol=1e-10, atol=1e-9)
            np.testing.assert_allclose(rates[joint.rate], seen["rate"], rtol=1e-10, atol=1e-11)
            if "series" in effects:
                np.testing.assert_allclose(
                    rates[joint.friction], seen["tangential"], rtol=1e-9, atol=1e-9
                )
    if "energies" in effects:
        _, drive = drive_of(mech)
        scale = abs(drive) + 1.0
        assert rates[at.DRIVE_MOMENT] == pytest.approx(drive, rel=1e-9, abs=1e-9 * scale)
        assert rates[at.DRIVE_POWER] == pytest.approx(drive * v[PHI], rel=1e-9, abs=1e-6 * scale)
        assert rates[at.ABS_DRIVE_POWER] == abs(rates[at.DRIVE_POWER])
        assert rates[at.LOAD_POWER] == pytest.approx(mech.seen["load_power"], rel=1e-12)
        losses = sum(mech.seen[joint]["loss"] for joint in CLEARANCES.keys() & effects)
        losses += mech.seen["guide_loss"]
        assert rates[at.DISSIPATION] == pytest.approx(losses, rel=1e-9, abs=1e-7)


@pytest.mark.parametrize(
    ("topology", "effects"), MOTIONS + FURTHER, ids=lambda x: x if isinstance(x, str) else ""
)
@pytest.mark.shortened(9)
def test_minimal_accelerations_equal_the_dense_model(topology, effects):
    effects = effects | TOPOLOGIES[topology]
    contacts_met = 0
    for par, contacts, mech, q, v, t in cases(np.random.default_rng(3), effects):
        reference = mech.accelerations(q, v, t)
        a, rates = seen_by_kernel(
            effects, par, reduced(effects, q), reduced(effects, v), contacts, t
        )
        if "lugre" in effects:
            seen = [mech.seen[name] for name in CLEARANCES if name in effects]
            pairs = zip(deflected(effects), seen, strict=True)
            rates_of = [bristle_rate(z, one["sliding"]) for z, one in pairs]
            np.testing.assert_allclose(a[: len(seen)], rates_of, rtol=1e-10)
            a = a[len(seen) :]
        expected = reduced(effects, reference)
        np.testing.assert_allclose(a, expected, rtol=1e-10, atol=1e-10 * scale_of(reference))
        check_rates(effects, mech, rates, v)
        contacts_met += any(mech.seen[j]["normal"] > 0 for j in CLEARANCES.keys() & effects)
    assert contacts_met > 2 or topology == "none"


@pytest.mark.parametrize(
    ("topology", "effects"), MOTIONS + FURTHER, ids=lambda x: x if isinstance(x, str) else ""
)
@pytest.mark.shortened(9)
def test_power_balance_closes_at_every_instant(topology, effects):
    """Kinetic, potential and stored energy change by what the balance says, state by state."""
    effects = effects | TOPOLOGIES[topology] | {"energies", "series"}
    for par, contacts, mech, q, v, t in cases(np.random.default_rng(4), effects, 10):
        a = mech.accelerations(q, v, t)
        _, rates = seen_by_kernel(
            effects, par, reduced(effects, q), reduced(effects, v), contacts, t
        )
        kinetic = (mech.masses() * v) @ a
        weight = mech.gravity * (mech.masses() * v)[[1, 4]].sum()
        stored = sum(mech.seen[joint]["elastic"] for joint in CLEARANCES.keys() & effects)
        supplied = rates[at.DRIVE_POWER] + rates[at.LOAD_POWER] * bool(
            {"load", "two turns"} & effects
        )
        terms = np.array([kinetic, weight, stored, supplied, rates[at.DISSIPATION]])
        rest = kinetic + weight + stored - supplied + rates[at.DISSIPATION]
        assert abs(rest) < 1e-10 * np.abs(terms).max() + 1e-9


@pytest.mark.parametrize(
    ("topology", "effects"),
    [
        pytest.param(*case, marks=[] if k % 3 == 2 else pytest.mark.full)
        for k, case in enumerate(
            [
                *(one for one in MOTIONS if "lugre" not in one[1]),
                ("none", FULL),
                ("two", {"fixed", "coulomb", "offset", "clockwise"}),
            ]
        )
    ],
    ids=lambda x: x if isinstance(x, str) else "",
)
@pytest.mark.shortened(3)
def test_baumgarte_accelerations_equal_the_dense_solve(topology, effects):
    """Also where constraints are violated, so that the feedback matters."""
    effects = effects | TOPOLOGIES[topology] | {"baumgarte"}
    rng = np.random.default_rng(5)
    for par, contacts, _, q, v, t in cases(rng, effects):
        mech = dense_model(effects, contacts, feedback=True)
        q = q + 1e-5 * rng.normal(size=9)
        v = v + 1e-2 * rng.normal(size=9)
        reference = mech.accelerations(q, v, t)
        a, rates = seen_by_kernel(effects, par, q[KERNEL_ORDER], v[KERNEL_ORDER], contacts, t)
        np.testing.assert_allclose(
            a, reference[KERNEL_ORDER], rtol=1e-10, atol=1e-10 * scale_of(reference)
        )
        check_rates(effects, mech, rates, v)


def test_constraint_violation_is_the_largest_constraint():
    rng = np.random.default_rng(6)
    for names in TOPOLOGIES.values():
        mech = dense_model(names, np.ones(2 * at.MAX_JOINTS))
        q = random_state(mech, rng)[0] + 1e-6 * rng.normal(size=9)
        rows = mech.constraints(q, q[PHI] / SPEED) | {("drive", "drive"): 0.0}
        rows["guide", "angle"] *= ROD["length"]
        linkage = linkage_of(scene_of(frozenset(names | {"baumgarte"})))
        q, still = q[KERNEL_ORDER][:, None], np.zeros((9, 1))
        got = violation(linkage, q, still, np.array([q[-1, 0] / SPEED]))
        np.testing.assert_allclose(got, [np.abs([*rows.values()]).max()], rtol=1e-9)

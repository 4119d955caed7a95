"""Effects together: every pair once, on-at-zero equals off, torque drives, joints removed, contradictions."""

import numpy as np
import pytest
from pairwise import CONTACTS, FRICTIONS, pairwise_table
from refusals import refused
from running import HUNT_CROSSLEY, SCENE, energy_residual, run, scene_with
from some_laws import effects_with

from hpcclear.dynamics import layout as at
from hpcclear.scene import load_scene

TORQUE_CURVE = [[0.0, 2.0], [1.0, 9.0], [3.0, 4.0], [5.0, -1.0]]
LOAD_CURVE = [[0.0, -200.0], [1.5, -30.0], [4.0, 80.0]]
FREE = {"kind": "torque", "initial_speed": "5000 rpm", "flywheel_inertia": 1e-2}
IDEAL = {"kind": "ideal"}
OIL = {"viscosity": 1e-3, "length": "20 mm"}
BENDING = {"stiffness": 300.0}
FACTORS = {
    "open": ["both", "crank_rod", "rod_slider", "none"],
    "contact": list(CONTACTS),
    "friction": list(FRICTIONS),
    "drive": ["speed", "torque", "curve"],
    "gravity": [0.0, 9.81],
    "load": [None, -50.0, LOAD_CURVE],
    "guide": [False, True],
    "film": [None, "short", "long"],
    "formulation": ["minimal", "baumgarte"],
    "bending": [None, 2],
    "energy": [True, False],
}


def allowed(row):
    """Whether a (partial) choice of levels is one simulation by the stepper."""
    if row.get("open") == "none":
        # without clearance there is no contact law to choose, and friction is refused
        if row.get("contact", "hertz") != "hertz" or row.get("friction", "none") != "none":
            return False
        if row.get("film") is not None:
            return False
        # prescribed, not integrated: tests/test_ideal.py
        if row.get("drive") == "speed" and row.get("bending", 2) is None:
            return False
    return True


TABLE = pairwise_table(FACTORS, allowed)


# each row compiles a stepper of its own: the short profile takes some of them
ROWS = [
    pytest.param(
        row,
        id="-".join(str(level)[:9] for level in row.values()),
        marks=[] if k % 4 == 1 else pytest.mark.full,
    )
    for k, row in enumerate(TABLE)
]


def scene_of(row, **more):
    """The scene of a row of the table."""
    changes = {
        "effects.contact": CONTACTS[row["contact"]],
        "effects.friction": FRICTIONS[row["friction"]],
        "effects.gravity": row["gravity"],
        "numerics.formulation": row["formulation"],
        "numerics.energy": row["energy"],
    }
    for joint in ("crank_rod", "rod_slider"):
        if row["open"] not in ("both", joint):
            changes[f"joints.{joint}"] = IDEAL
        elif row["film"] is not None:
            changes[f"joints.{joint}.film"] = OIL | {"model": row["film"]}
    if row["drive"] != "speed":
        changes["drive"] = {**FREE, "torque": 5.0 if row["drive"] == "torque" else TORQUE_CURVE}
    if row["load"] is not None:
        changes["effects.slider_load"] = row["load"]
    if row["bending"] is not None:
        changes["mechanism.rod.bending"] = {"stiffness": 300.0, "modes": row["bending"]}
        changes["mechanism.rod.bending"]["damping"] = 0.02
    if row["guide"]:
        changes["effects.guide_friction"] = {"coefficient": 0.1}
    return scene_with(changes | more, rtol=1e-7)


@pytest.mark.parametrize("row", ROWS)
@pytest.mark.shortened(3)
def test_every_pair_of_effects_runs(row):
    """One revolution; where energies are kept, they balance."""
    scene = scene_of(row)
    result = run(scene)
    assert result.out.status == 0
    assert np.isfinite(result.q).all()
    joints = [row["open"] in ("both", name) for name in ("crank_rod", "rod_slider")]
    assert ((result.out.mean_gap[:2] > 0.0) == joints).all()
    if row["energy"]:
        rest, passed = energy_residual(scene, result)
        assert abs(rest) < 1e-4 * passed


NO_FRICTION = {joint.block + at.FRICTION_NUMBERS: 0.0 for joint in at.JOINTS[:2]}
ZEROS = {  # flags of the kernel and rows of parameters, or entries of the scene
    "coulomb": ({"friction": effects_with({"coulomb"}).friction}, NO_FRICTION, {}),
    "ambrosio": ({"friction": effects_with({"ambrosio"}).friction}, NO_FRICTION, {}),
    "load": ({}, {}, {"effects.slider_load": 0.0}),
    "load_table": ({}, {}, {"effects.slider_load": [[0.0, 0.0], [3.0, 0.0]]}),
    "guide": ({}, {}, {"effects.guide_friction": {"coefficient": 0.0}}),
    "film": ({"films": ("short", "long", *[None] * 6)}, {}, {}),  # of no viscosity
}


@pytest.fixture(scope="module")
def without():
    """Hunt-Crossley 0.5 and nothing else, one revolution."""
    return run(scene_with({"effects.contact": HUNT_CROSSLEY, "effects.friction": {"law": "none"}}))


def assert_same_motion(one, other):
    """To 1e-12 of the peak of each coordinate and velocity."""
    for a, b in ((one.q, other.q), (one.v, other.v)):
        assert (np.abs(a[-1] - b[-1]) <= 1e-12 * np.abs(b).max(axis=0)).all()


@pytest.mark.parametrize(
    "effect",
    [
        pytest.param(name, marks=[] if name in ("coulomb", "guide", "film") else pytest.mark.full)
        for name in ZEROS
    ],
)
@pytest.mark.shortened(2)
def test_an_effect_with_coefficient_zero_changes_nothing(effect, without):
    flags, rows, changes = ZEROS[effect]
    plain = {"effects.contact": HUNT_CROSSLEY, "effects.friction": {"law": "none"}}
    assert_same_motion(run(scene_with(plain | changes), flags, rows), without)


def torque_scene(flywheel, torque, revolutions=1, rtol=1e-9):
    drive = {**FREE, "flywheel_inertia": flywheel, "torque": torque}
    return scene_with({"effects.contact": HUNT_CROSSLEY, "drive": drive}, revolutions, rtol)


@pytest.mark.parametrize(("flywheel", "torque"), [(1e-3, 10.0), (1e-2, -20.0)])
def test_torque_drive_keeps_the_energy_balance(flywheel, torque):
    scene = torque_scene(flywheel, torque, revolutions=3)
    result = run(scene, effects={"energies": 1})
    rest, passed = energy_residual(scene, result)
    assert abs(rest) < 1e-6 * passed


@pytest.mark.full
def test_a_heavy_flywheel_tends_to_constant_speed_like_its_inverse():
    """The crank's speed is disturbed by 1/J, and so is the state after one turn: ten times heavier, a tenth."""
    scene = scene_with({"effects.contact": HUNT_CROSSLEY}, rtol=1e-11)
    constant = run(scene, effects={"energies": 1})
    differences = []
    for flywheel in (1e2, 1e3, 1e4):
        free = run(torque_scene(flywheel, 0.0, rtol=1e-11), effects={"energies": 1})
        change = np.concatenate(
            [free.q[-1, :4] - constant.q[-1], (free.v[-1, :4] - constant.v[-1]) / 500]
        )
        differences.append(np.linalg.norm(change))
    rates = np.log10(differences[:-1]) - np.log10(differences[1:])
    np.testing.assert_allclose(rates, 1.0, atol=0.1)


CONTRADICTIONS = [
    ({"joints.crank_rod": IDEAL, "joints.rod_slider": IDEAL}, "effects.friction.law", "ideal"),
    ({"effects.contact": {"law": "flores"}}, "effects.contact.restitution", "restitution"),
    (
        {"effects.contact": {"law": "hertz", "damping": 0.5}},
        "effects.contact.damping",
        "no fixed damping",
    ),
    ({"drive": {**FREE, "torque": 1.0, "speed": 500.0}}, "drive.speed", "is a result of a torque"),
    ({"drive.torque": 1.0}, "drive.torque", "contradicts a prescribed"),
    ({"effects.contact": None}, "effects.contact", "needs a contact law"),
    (
        {"mechanism.crank.bending": BENDING},
        "mechanism.crank.bending",
        "drives the bar and clamps it",
    ),
    (
        {
            "mechanism.rod.bending": BENDING,
            "joints.crank_rod.out_of_round": {"journal": {"cosine_2": 1e-5}},
        },
        "mechanism.rod.bending",
        "out of round",
    ),
]


@pytest.mark.parametrize(("changes", "key", "reason"), CONTRADICTIONS, ids=lambda x: str(x)[:30])
def test_contradictions_are_refused_with_the_reason(changes, key, reason):
    with refused(key, reason=reason):
        load_scene(SCENE).with_(changes)

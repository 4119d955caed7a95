"""Scenes of linkages: whole motions against a dense model and scipy, energy, samples, drives, tables, and what is refused."""

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from dense_linkage import Contact, Dense, comes_as, start_of
from planar_scenes import without_play, written_out

from hpcclear import load_scene, simulate
from hpcclear.base.errors import InputError
from hpcclear.base.outcome import Status
from hpcclear.dynamics.evaluation import evaluate_records
from hpcclear.dynamics.evaluation.evaluator import DEFAULT_LANES
from hpcclear.dynamics.planar.problem import linkage_of, poses_at_start, put_together
from hpcclear.dynamics.planar.tables import mechanism_of
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.start import start_states
from hpcclear.ensemble.api import as_points, evaluate
from hpcclear.scene import Scene

LINKAGES = Path(__file__).parents[1] / "jobs" / "linkages"
NAMES = sorted(path.stem for path in LINKAGES.glob("*.toml"))
ROCKER = tomllib.loads((LINKAGES / "crank_rocker.toml").read_text())
CHI, MU, RAMP, GRAVITY = 0.4, 0.05, 0.01, 9.81
CONTACT = Contact(lambda rate: 1 + CHI * rate, lambda s: MU * min(max(s / RAMP, -1.0), 1.0))
"""Of the crank-rocker's effects."""


def rocker(*sets):
    """The crank-rocker without its study, one revolution from the start."""
    content = {key: value for key, value in ROCKER.items() if key != "study"}
    short = ("numerics.transient_revolutions=0", "numerics.averaged_revolutions=1")
    return load_scene(content, (*short, *sets))


# ---- physics -----------------------------------------------------------------------------------------


@pytest.mark.nightly
def test_a_whole_motion_is_the_dense_model_s():
    """From assembly through contact in both joints: positions to 1e-8 m while the motion is well-posed; energy closed."""
    scene = rocker(
        "numerics.rtol=1e-10", "numerics.method=dormand-prince",
        "mechanism.joints.o2.start_eccentricity=[2e-5, 1e-5]",
        "mechanism.joints.o3.start_eccentricity=[-2e-5, 1e-5]",
    )  # fmt: skip
    dense = Dense(linkage_of(scene).mechanism, [CONTACT] * 2, GRAVITY)
    response = simulate(scene)
    # contact begins in both joints before 2.5 ms; later chaos parts any two solutions
    met = comes_as(response, dense, start_of(dense), 0.0025)
    assert (response["contact_force"].to_numpy()[:met].max(axis=0) > 100.0).all()
    work = float(np.abs(np.diff(response["driving_work"].to_numpy())).sum())
    assert float(np.abs(response["energy_residual"]).max()) < 1e-7 * work


def test_forces_of_pins_are_the_dense_model_s():
    """Multipliers of its constraints: beside a joint with clearance, in a closed loop, with friction in the pins."""
    turning = {
        "kind": "revolute",
        "friction": {"coefficient": 0.1, "radius": 5e-3, "ramp_speed": 0.01},
    }
    scene = rocker().with_({
        "mechanism.bodies.bar": {"length": 0.2, "mass": 0.1, "inertia": 4e-4, "start_angle": -0.8},
        "mechanism.bodies.block": {"mass": 0.4, "points": {"pin": [0.0, 0.0]}},
        "mechanism.joints.o1": {**turning, "journal": "crank.a", "bearing": "ground.o"},
        "mechanism.joints.o2": {"kind": "revolute", "journal": "crank.b", "bearing": "coupler.a"},
        "mechanism.joints.o3": {**turning, "journal": "coupler.b", "bearing": "rocker.b"},
        "mechanism.joints.o5": {**turning, "journal": "bar.a", "bearing": "coupler.tip"},
        "mechanism.joints.o6": {**ROCKER["mechanism"]["joints"]["o2"], "journal": "block.pin", "bearing": "bar.b"},
        "mechanism.joints.way": {"kind": "slide", "point": "block.pin", "line": "ground.o"},
    })  # fmt: skip
    mechanism = linkage_of(scene).mechanism
    dense = Dense(mechanism, [CONTACT], GRAVITY, scene.numerics.alpha, scene.numerics.beta)
    response = simulate(scene)
    assert int(response.status) == 0
    assert response["contact_force"].to_numpy().max() > 50.0
    q, v = (
        np.stack([response[f"body_{name}"].to_numpy() for name in names], -1).reshape(len(response.time), -1)
        for names in (("x", "y", "angle"), ("vx", "vy", "spin"))
    )  # fmt: skip
    pins = [str(one) for one in response.pin.to_numpy()]
    assert pins == ["o1", "o4", "o2", "o3", "o5"]
    every = range(0, len(q), 17)
    right = np.empty((len(every), 2, len(pins)))
    for k, row in enumerate(every):
        dense.accelerations(q[row], v[row], float(response.time[row]))
        held = dense.seen["multipliers"]
        right[k] = [[held[pin, axis] for pin in pins] for axis in "xy"]
    found = np.stack([response[f"pin_force_{axis}"].to_numpy()[every] for axis in "xy"], 1)
    np.testing.assert_allclose(found, right, rtol=0, atol=1e-6 * np.abs(right).max())


def slider_crank_pair():
    """The paper's slider-crank, and the same by bodies and joints."""
    scene = load_scene(
        Path(__file__).parents[1] / "jobs" / "slider_crank.toml",
        ("numerics.transient_revolutions=0", "numerics.averaged_revolutions=1", "numerics.rtol=1e-9",
         "numerics.method=dormand-prince"),
    )  # fmt: skip
    return scene, written_out(scene)


def test_the_slider_crank_by_bodies_is_the_slider_crank():
    given, planar = (simulate(scene) for scene in slider_crank_pair())
    half = given.sizes["time"] // 2  # chaos parts them later
    for name, scale in (("eccentricity_x", 1e-9), ("contact_force", 1.0), ("crank_moment", 0.1)):
        np.testing.assert_allclose(
            planar[name].to_numpy()[:half], given[name].to_numpy()[:half], rtol=1e-4, atol=scale
        )
    slider = planar["body_x"].sel(body="slider").to_numpy()
    np.testing.assert_allclose(slider[:half], given["slider_position"].to_numpy()[:half], atol=1e-9)
    assert given["contact_force"].to_numpy()[:half].max() > 1e3


def test_without_play_nothing_is_integrated_and_reactions_are_the_closed_form_s():
    given, planar = slider_crank_pair()
    ideal = {"kind": "ideal"}
    given = given.with_(
        {"joints.crank_rod": ideal, "joints.rod_slider": ideal, "effects": {"gravity": 9.81}}
    )
    planar = without_play(planar).with_({"effects": {"gravity": 9.81}})
    one, two = simulate(given), simulate(planar)
    assert two.sizes["joint"] == 0
    for name, scale in (("crank_moment", 1e-7), ("kinetic_energy", 1e-9), ("driving_work", 1e-3)):
        np.testing.assert_allclose(
            two[name].to_numpy(), one[name].to_numpy(), atol=scale, rtol=1e-9
        )
    for axis in "xy":  # on the slider, and on the rod
        pin = two[f"pin_force_{axis}"].sel(pin="rod_slider").to_numpy()
        rod = one[f"reaction_{axis}"].sel(joint="rod_slider").to_numpy()
        np.testing.assert_allclose(pin, -rod, atol=1e-6, rtol=1e-9)
    found = evaluate(planar, {"mechanism.bodies.rod.mass": [0.2, 0.3]})
    assert (found["objective"] == 0.0).all()


DRIVES = {
    "torque": {
        "kind": "torque", "body": "crank", "torque": 1.0, "initial_speed": 90.0,
        "flywheel_inertia": 1e-2,
    },
    "torque over the angle": {
        "kind": "torque", "body": "crank", "torque": [[0.0, 2.0], ["180 deg", -1.0]],
        "initial_speed": 90.0, "flywheel_inertia": 1e-2,
    },
    "clockwise": {"kind": "constant-speed", "body": "crank", "speed": -90.0},
    "two turns": {"kind": "constant-speed", "body": "crank", "speed": 90.0, "turns": 2},
    "swinging": {
        "kind": "harmonic", "body": "crank", "amplitude": "50 deg", "frequency": "12 Hz",
        "mean": "60 deg",
    },
}  # fmt: skip


def driven(drive: str) -> Scene:
    """The rocker by one of these drives, two revolutions from its start, with its energy."""
    content = {key: value for key, value in ROCKER.items() if key != "study"}
    mechanism = {**content["mechanism"], "drives": {"motor": DRIVES[drive]}}
    return load_scene(
        {**content, "mechanism": mechanism},
        ("numerics.transient_revolutions=0", "numerics.averaged_revolutions=2", "numerics.energy=true"),
    )  # fmt: skip


@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.shortened(3)
def test_every_drive_closes_the_energy(drive):
    scene = driven(drive)
    response = simulate(scene)
    assert int(response["status"]) == 0
    work = float(np.abs(np.diff(response["driving_work"].to_numpy())).sum())
    size = max(work, float(response["kinetic_energy"].max()))
    assert float(np.abs(response["energy_residual"]).max()) < 1e-5 * size
    # the angle itself swings with a harmonic drive
    turns = float(response["drive_phase"][-1]) / (2 * math.pi)
    assert turns == pytest.approx(4.0 if drive == "two turns" else 2.0, abs=0.1)
    found = evaluate(scene, {"mechanism.joints.o2.clearance": np.linspace(1e-4, 3e-4, 41)})
    assert (found["status"] == 0).all()
    # 2.6e-6 at most of 4001 samples of every drive
    assert float(found["energy_error"].max()) < 5e-6


def test_no_first_step_of_a_contact_is_its_last():
    """Of 60 001 clearances those of which a contact was passed in one step, as its estimated error happened to be small there.

    They left 5 to 42 millionths of their energy. With each contact's beginning followed, no drive leaves more than 3.
    """
    worst = [0.000151158, 0.000145252, 0.00013234, 0.00015801266666666669]
    found = evaluate(driven("torque"), {"mechanism.joints.o2.clearance": worst})
    assert (found["status"] == 0).all()
    assert float(found["energy_error"].max()) < 1.5e-6


# ---- samples -----------------------------------------------------------------------------------------


def test_samples_are_the_scenes_with_their_numbers():
    """Whatever a column drives: masses, lengths, points of the ground, play, speed, a start angle."""
    scene = rocker("numerics.method=tsitouras")  # which a tight response would not take
    columns = {
        "mechanism.bodies.coupler.mass": [0.25, 0.35],
        "mechanism.bodies.rocker.length": [0.08, 0.082],
        "mechanism.ground.points.p.x": [0.131, 0.129],
        "mechanism.joints.o3.clearance": [1e-4, 3e-4],
        "mechanism.bodies.crank.start_angle": [0.3, 0.6],
        "effects.friction.coefficient": [0.04, 0.06],
    }
    found = evaluate(scene, columns)
    # of another speed the tolerances are others, and chaos makes something of that: numbers and starts are compared
    faster = {**columns, "mechanism.drives.motor.speed": [90.0, 100.0]}
    points = as_points(scene, faster)
    par = parameters(scene, points)
    start = start_states(scene, par, points)
    for row in (0, 1):
        alone = scene.with_({path: values[row] for path, values in columns.items()})
        assert float(found["objective"][row]) == float(simulate(alone)["objective"])
        alone = scene.with_({path: values[row] for path, values in faster.items()})
        own = parameters(alone)
        np.testing.assert_array_equal(own[0], par[row])
        np.testing.assert_array_equal(start_states(alone, own).rows[0], start.rows[row])
    assert list(found["joint"].to_numpy()) == ["o2", "o3"]


@pytest.mark.parametrize(
    "name", [
        pytest.param("press"),
        pytest.param("four_stroke", marks=pytest.mark.nightly),
        *(pytest.param(n, marks=pytest.mark.full) for n in NAMES if n not in ("press", "four_stroke")),
    ]
)  # fmt: skip
def test_bytes_are_the_same_for_any_lanes(name):
    """Those of ranks are in `test_kills`."""
    sets = ("numerics.transient_revolutions=0", "numerics.averaged_revolutions=1")
    scene = load_scene(LINKAGES / f"{name}.toml", sets)
    columns = {"C": np.linspace(*scene.required_study.variable("C").range, 9)}
    one, many = (
        evaluate_records(scene, as_points(scene, columns), lanes=lanes)
        for lanes in (1, DEFAULT_LANES)
    )
    assert one.tobytes() == many.tobytes()


def test_a_sample_that_does_not_close_has_failed_and_the_others_go_on():
    found = evaluate(rocker(), {"mechanism.bodies.coupler.length": [0.12, 1.0, 0.121]})
    assert list(found["status"].to_numpy()) == [0, Status.CANNOT_TURN, 0]
    assert np.isnan(found["objective"][1])
    assert np.isfinite(found["objective"][[0, 2]]).all()


def test_a_number_that_is_nought_can_be_a_variable_of_the_study_only():
    scene = rocker()
    with pytest.raises(InputError, match="zero in this scene"):
        evaluate(scene, {"mechanism.bodies.coupler.center.y": [1e-3]})


def test_an_inertia_may_follow_mass_and_length():
    """As the scene states it, and where columns move both."""
    mass, length = (
        rocker().number(f"mechanism.bodies.coupler.{name}") for name in ("mass", "length")
    )
    slender = mass * length**2 / 12.0
    stated = rocker(f"mechanism.bodies.coupler.inertia={1.5 * slender!r}")
    followed = rocker(
        "mechanism.bodies.coupler.inertia=0", "mechanism.bodies.coupler.inertia_ratio=1.5"
    )
    assert simulate(followed).equals(simulate(stated))
    inertia, other = (one.linkage.bodies[1].own_inertia for one in (followed, stated))
    assert inertia == pytest.approx(other, rel=1e-15)

    lengths, masses = np.array([0.118, 0.12, 0.123]), np.array([0.25, 0.3, 0.4])
    moved = {"mechanism.bodies.coupler.length": lengths, "mechanism.bodies.coupler.mass": masses}
    with_inertia = moved | {"mechanism.bodies.coupler.inertia": 1.5 * (masses * lengths**2 / 12.0)}
    found = evaluate_records(followed, as_points(followed, moved))
    wanted = evaluate_records(stated, as_points(stated, with_inertia))
    assert (found["status"] == Status.OK).all()
    np.testing.assert_array_equal(found["objective"], wanted["objective"])


# ---- what is refused ---------------------------------------------------------------------------------

BROKEN = {
    "joints.o2.journal=crank.c": "no point",
    "joints.o2.bearing=arm.a": "no body",
    "joints.o2.clearance=-1e-4": "above 0",
    "joints.o2.clearance=20 mm": "smaller than the bearing",
    "joints.o2.kind=welded": "known values",
    'joints.o9={kind="revolute",journal="crank.a",bearing="ground.o"}': "redundant beside o1",
    'joints.o9={kind="slot",point="rocker.a",line="ground.p"}': "redundant beside o4",
    'joints.o9={like="o2",journal="crank.a",bearing="ground.o"}': "cannot move in its clearance beside o1",
    "joints.o2.materials.bearing.youngs_modulus=0": "above 0",
    "bodies.crank.mass=0": "above 0",
    "bodies.coupler.inertia=0": "inertia",
    "bodies.coupler.center=[0.1, 0.0]": "mass_center",
    "bodies.coupler.inertia_ratio=1": "Remove one",
    "drives.motor.body=shaft": "no such moving body",
    "drives.motor.speed=0": "there would be no motion",
    "drives.motor.turns=0": "from 1",
    "drives.motor.torque=3": "contradicts a prescribed speed",
    "loads.pull.kind=magnet": "known values",
    'loads.l={kind="spring",first="ground.o",second="ground.p",stiffness=1}': "moves nothing",
    'loads.l={kind="cylinder",first="rocker.b",second="rocker.b",force=1}': "moves nothing",
    'loads.l={kind="torsion-spring",body="rocker",other="rocker",stiffness=1}': "moves nothing",
    'loads.l={kind="force",place="ground.p",force=[1,0]}': "moves nothing",
    'loads.l={kind="force",place="rocker.b",force=[1,0],direction=1}': "that of a size",
    'loads.l={kind="force",place="rocker.b",size=1,size_by_time=[[0,1],[1,2]]}': "given twice",
    'loads.l={kind="drag",body="rocker"}': "no effect. Write linear or quadratic",
    'loads.l={kind="torsion-spring",body="rocker",angle=1}': "no effect. Write stiffness or damping",
    'loads.l={kind="torsion-spring",body="rocker",angle=1,damping=1}': "without stiffness",
    "ground.points.p=[0.1]": "pair",
    'loads.l={kind="torsion-spring",body="crank",stiffness=1.0}': "l.body: this body goes round",
    'loads.l={kind="torsion-spring",body="rocker",lower=0.1}': "l.stop_stiffness: stops and",
    'loads.l={kind="torsion-spring",body="rocker",other="no",damping=1}': "l.other: there is no such",
    'loads.l={kind="drag",body="ground",linear=1}': "l.body: there is no such",
    'loads.l={kind="cylinder",first="rocker.b",second="ground.o",force=[[1,2]]}': "l.force: a table of 2",
    'loads.l={kind="cylinder",first="rocker.b",second="ground.o",force=[[2,2],[1,2]]}': "l.force: the distances",
    'drives.motor={kind="torque",body="crank",initial_speed=5}': "motor.torque: is given twice",
    'drives.motor={kind="torque",body="crank",initial_speed=5,torque=1,torque_by_speed=[[0,2],[9,0]]}': "is given twice",
}
"""Entries that are refused by their own names, and what is said."""


@pytest.mark.parametrize("change", BROKEN)
def test_broken_linkages_are_refused_by_name(change):
    with pytest.raises(InputError) as caught:
        simulate(rocker(f"mechanism.{change}"))
    said = caught.value
    assert said.key.startswith(f"mechanism.{change.partition('=')[0]}")
    assert BROKEN[change] in f"{said.key}: {said.reason}. {said.remedy}"


def test_a_slider_crank_s_tables_do_not_fit_a_linkage():
    content = {key: value for key, value in ROCKER.items() if key != "study"}
    for table, value in (("drive", {"kind": "torque"}), ("joints", {})):
        with pytest.raises(InputError, match="belongs to a slider-crank"):
            load_scene({**content, table: value})
    with pytest.raises(InputError, match="belongs to a slider-crank"):
        rocker("effects.slider_load=3")


def test_a_row_like_another_takes_over_what_its_tables_do_not_say():
    """Another bearing on the same journal, another mass centre of the same kind; points are a body's own."""
    content = tomllib.loads((LINKAGES / "crank_rocker.toml").read_text(encoding="utf-8"))
    soft = {"youngs_modulus": 5e8, "poisson_ratio": 0.4}
    content["mechanism"]["joints"]["o3"]["materials"] = {"bearing": soft}
    content["mechanism"]["bodies"]["rocker"] = {
        "like": "coupler", "length": 0.08, "start_angle": "90 deg", "points": {"knob": [0.0, 0.01]},
    }  # fmt: skip
    scene = load_scene(content)
    own, model = (scene.clearance_joint(name).materials for name in ("o3", "o2"))
    assert own.bearing.youngs_modulus == 5e8
    assert own.journal == model.journal
    bodies = {body.name: body for body in scene.mechanism.bodies}
    assert [point.name for point in bodies["rocker"].points] == ["knob"]
    assert bodies["rocker"].mass == bodies["coupler"].mass


def test_the_angle_of_a_body_that_is_held_is_told():
    """By the joint that holds it: it has no coordinate of its own."""
    examples = LINKAGES.parents[1] / "docs" / "mkdocs" / "examples"
    scene = load_scene(examples / "linkage.toml")
    assert math.degrees(poses_at_start(scene)["frame"][2]) == pytest.approx(90.0)
    told = put_together(mechanism_of(scene.linkage)).report()
    assert "frame: 90 deg (start_angle 0 deg)" in told
    assert "crank: 25 deg (start_angle 25 deg)" in told

"""The mechanism without clearance at a given speed: textbook relations, dense inverse dynamics, works."""

import math

import numpy as np
import pytest
from dense_linkage import admissible
from running import THETA2, X2, X3, Y2, scene_with
from scipy.interpolate import PchipInterpolator
from test_motion import (
    CRANK,
    FULL,
    ROD,
    SLIDER_MASS,
    SPEED,
    dense_model,
    drive_of,
    pose_of,
    scene_of as scene_of_effects,
)

from hpcclear.base.outcome import Status
from hpcclear.base.pieces import periodic
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.evaluation import evaluate_records
from hpcclear.dynamics.linkage.prescribed import prescribed_motion
from hpcclear.dynamics.planar.tables import mechanism_of
from hpcclear.dynamics.response import simulate
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.problem import problem_of
from hpcclear.dynamics.setup.start import start_states
from hpcclear.dynamics.stepping.prescribed import PrescribedSamples
from hpcclear.report.figures import motion, moving
from hpcclear.scene.points import Points

ANGLES = np.linspace(0, 3 * at.TURN, 721)


def response(effects, angles=ANGLES, **changes):
    """The motion at crank angles, and accelerations, velocities and places of the bodies by name."""
    scene = scene_of_effects(frozenset(effects)).with_(changes)
    held = prescribed_motion(mechanism_of(scene.linkage), angles / SPEED, scene.effects.gravity)
    forest = held.assembly.loops.forest

    def of(name, body):
        columns = {"q": held.q, "v": held.v, "a": held.a}
        kind, axis = name.split("_")
        return columns[kind][:, forest.index(axis, body)]

    return held, of


def relative_to_peak(got, expected):
    return np.abs(got - expected).max() / np.abs(expected).max()


def slider_by_the_textbook(angles=ANGLES):
    """x = r cos + sqrt(l^2 - r^2 sin^2) and its derivatives in the crank angle, written out."""
    r, length = CRANK["length"], ROD["length"]
    s, c = np.sin(angles), np.cos(angles)
    root = np.sqrt(length**2 - r**2 * s**2)
    x = r * c + root
    v = -SPEED * (r * s + r**2 * s * c / root)
    a = -(SPEED**2) * (r * c + r**2 * (c**2 - s**2) / root + r**4 * s**2 * c**2 / root**3)
    return x, v, a, root


def test_slider_equals_the_textbook():
    _, of = response(set())
    for name, expected in zip(("q_x", "v_x", "a_x"), slider_by_the_textbook(), strict=False):
        assert relative_to_peak(of(name, "slider"), expected) < 1e-11


def test_reactions_equal_the_textbook():
    """A rod that moves like masses at its ends: what slider and far end need goes along it to the crank (two-force member)."""
    r, length, u = CRANK["length"], ROD["length"], ROD["u"]
    far, near = ROD["mass"] * u / length, ROD["mass"] * (length - u) / length
    held, _ = response({"load"}, **{"mechanism.rod.inertia": ROD["mass"] * u * (length - u)})
    s, c = np.sin(ANGLES), np.cos(ANGLES)
    _, _, a, root = slider_by_the_textbook()
    along = -35.0 - (SLIDER_MASS + far) * a  # on the rod from its far end, x
    across = along * (-r * s) / root  # a two-force member pulls along itself
    pull = near * r * SPEED**2  # of the near end on the crank, outwards
    centripetal = CRANK["mass"] * CRANK["u"] * SPEED**2 + pull
    expected = {  # of pins: on the journals' bodies
        "rod_slider_x": SLIDER_MASS * a + 35.0,
        "rod_slider_y": -across,
        "crank_rod_x": along + pull * c,
        "crank_rod_y": across + pull * s,
        "guide_across": across,
        "crank_frame_x": -along - centripetal * c,
        "crank_frame_y": -across - centripetal * s,
        # virtual power: moment times speed plus force times slider speed is zero
        "drive_angle": along * (r * s + r**2 * s * c / root),
    }
    for name, force in expected.items():
        assert relative_to_peak(held.holds[name], force) < 1e-10, name


@pytest.mark.parametrize(
    "effects",
    [
        set(), FULL, {"gravity"}, {"guide", "load"}, {"guide", "load", "gravity", "offset"},
        {"offset", "clockwise"},
    ],
    ids=sorted,
)  # fmt: skip
def test_reactions_equal_the_multipliers_of_the_dense_model(effects):
    """All bodies with mass, gravity, load and guide friction."""
    angles = ANGLES[:240:7]
    held, of = response(effects, angles)
    mech = dense_model(effects)
    names = {
        f"{joint}_{axis}": (joint, axis)
        for joint, axes in (("crank_rod", "xy"), ("rod_slider", "xy"), ("crank_frame", "xy"), ("guide", ["across"]))
        for axis in axes
    } | {"drive_angle": ("drive", "drive")}  # fmt: skip
    expected = []
    for phi in angles * np.sign(drive_of(mech)[0]):
        q, time = pose_of(mech, phi), abs(phi) / SPEED
        v = admissible(mech, q, np.zeros(9), time)
        a = mech.accelerations(q, v, time)
        motion = [row[k] for row in (q, v, a) for k in (X3, X2, Y2, THETA2)]
        forces = [mech.seen["multipliers"][key] for key in names.values()]
        expected.append([*motion, *forces, mech.seen["guide_loss"], mech.seen["load_power"]])
    bodies = (("x", "slider"), ("x", "rod"), ("y", "rod"), ("angle", "rod"))
    seen = [
        *(of(f"{kind}_{axis}", body) for kind in "qva" for axis, body in bodies),
        *(held.holds[name] for name in names), held.loss, held.load_power,
    ]  # fmt: skip
    for row, (got, wanted) in enumerate(zip(seen, np.array(expected).T, strict=True)):
        scale = np.abs(wanted).max() + 1e-12
        assert np.abs(np.abs(got) - np.abs(wanted)).max() <= 1e-9 * scale, row


ROWS = ((0.1, 1.0), (1.0, 3.0), (3.0, -2.0), (5.0, 0.5))


@pytest.mark.parametrize("seed", range(5))
def test_curves_are_the_monotone_cubics_of_scipy(seed):
    """Rows that rise, fall, stay level and lie unevenly, over many decades."""
    random = np.random.default_rng(seed)
    rows = np.sort(random.choice(6000, random.integers(2, 40), replace=False)) / 1000.0
    values = random.integers(-3, 4, len(rows)) * 10.0 ** random.uniform(-8, 8)
    three = np.concatenate([rows - at.TURN, rows, rows + at.TURN])
    smooth = PchipInterpolator(three, np.tile(values, 3))
    curve = periodic(tuple(zip(rows, values, strict=True)), at.TURN)
    angle = np.linspace(0.0, at.TURN, 5001)
    there = np.where(angle < rows[0], angle + at.TURN, angle)
    size = np.abs(values).max()
    np.testing.assert_allclose(curve.at(angle), smooth(there), rtol=0, atol=1e-11 * size)
    slope = smooth.derivative()(there)
    np.testing.assert_allclose(
        curve.derivative().at(angle), slope, rtol=0, atol=1e-9 * np.abs(slope).max()
    )
    area = smooth.integrate(rows[0], rows[0] + at.TURN)
    assert curve.mean() * at.TURN == pytest.approx(area, abs=1e-11 * size)


def test_straight_lines_between_rows():
    """Exact everywhere, corners included."""
    angle = np.linspace(-1.0, 7.0, 20_001)
    expected = np.interp(angle, *np.array(ROWS).T, period=at.TURN)
    found = periodic(ROWS, 2 * math.pi, "linear").at(angle)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13)
    even = tuple((k * at.TURN / 8, float(k % 3)) for k in range(8))
    expected = np.interp(angle, *np.array(even).T, period=at.TURN)
    assert np.abs(periodic(even, 2 * math.pi, "linear").at(angle) - expected).max() < 1e-12
    assert np.abs(periodic(even, 2 * math.pi).at(angle) - expected).max() > 0.01


@pytest.mark.parametrize("ideal_joints", [True, False])
def test_the_load_of_a_response_is_straight_where_that_is_asked_for(ideal_joints):
    load = [[0.0, 0.0], [3.0, 100.0], [4.0, -100.0]]
    changes = {"effects.slider_load": load, "numerics.interpolation": "linear"}
    response = simulate(scene_with(changes | (BARE if ideal_joints else {}), revolutions=1))
    angle = np.mod(response["crank_angle"].to_numpy(), at.TURN)
    expected = np.interp(angle, *np.array(load).T, period=at.TURN)
    assert np.abs(response["slider_load"].to_numpy() - expected).max() < 0.5
    assert np.abs(response["energy_residual"].to_numpy()).max() < 1e-3


BARE = {
    "joints.crank_rod": {"kind": "ideal"},
    "joints.rod_slider": {"kind": "ideal"},
    "effects.friction": {"law": "none"},
}


def test_a_queue_of_scenes_without_clearance_is_done_at_once():
    scene = scene_with(BARE, revolutions=3)
    par = np.tile(parameters(scene), (4, 1))
    lanes = PrescribedSamples(problem_of(scene))
    lanes.queue(par[:3], start_states(scene, par[:3]), np.array([5, 6, 7]))
    lanes.queue(par[3:], start_states(scene, par[3:]), np.array([2]))
    assert lanes.pending == 4
    lanes.advance(0.1)
    labels, outcome, seen = lanes.collect()
    assert lanes.pending == 0
    np.testing.assert_array_equal(labels, [5, 6, 7, 2])
    for column in (outcome.status, outcome.objective, outcome.spread, outcome.evaluations):
        np.testing.assert_array_equal(column, 0.0)
    np.testing.assert_allclose(outcome.time, 3 * 60 / 5000)
    np.testing.assert_array_equal(seen, par)
    assert len(lanes.collect()[0]) == 0


def test_series_of_a_scene_without_clearance_keep_the_energy_balance():
    more = {
        "effects.gravity": 9.81,
        "effects.slider_load": -40.0,
        "effects.guide_friction": {"coefficient": 0.1},
        "output.instants_per_revolution": 360,
    }
    series = simulate(scene_with(BARE | more, revolutions=2))
    times = series["time"].to_numpy()
    assert times.shape == (721,)
    assert times[-1] == pytest.approx(2 * 60 / 5000, rel=1e-12)
    series = {name: series[name].to_numpy() for name in series.data_vars}
    assert np.abs(series["energy_residual"]).max() < 1e-6 * np.abs(series["driving_work"]).max()
    speed = np.gradient(series["slider_position"], times, edge_order=2)
    assert np.abs(speed - series["slider_velocity"]).max() < 1e-3 * np.abs(speed).max()


@pytest.mark.parametrize("changes", [{}, {"joints.crank_rod.clearance": 3e-4}])
def test_a_clockwise_slider_crank_is_the_mirror_image(changes):
    """Of one with its offset on the other side; without gravity."""
    both = (BARE if not changes else {"joints.rod_slider": {"kind": "ideal"}}) | changes
    one, other = (
        simulate(scene_with(both | {"drive.speed": speed, "mechanism.offset": offset}, 1, 1e-9))
        for speed, offset in ((520.0, 0.01), (-520.0, -0.01))
    )
    for name, sign in (
        ("crank_angle", -1), ("slider_position", 1), ("rod_x", 1), ("rod_y", -1), ("rod_angle", -1),
        ("eccentricity_y", -1), ("crank_moment", -1), ("driving_work", 1),
    ):  # fmt: skip
        expected, got = one[name].to_numpy(), sign * other[name].to_numpy()
        size = np.abs(expected).max()
        np.testing.assert_allclose(got, expected, rtol=0, atol=1e-6 * size, err_msg=name)
    np.testing.assert_allclose(motion.turns(other), motion.turns(one), rtol=1e-12)
    assert motion.crank_angle(other)[1] == -motion.crank_angle(one)[1] == -1
    for response, offset in ((one, 0.01), (other, -0.01)):
        np.testing.assert_allclose(moving.bodies(response)[1][:, 4, 1], offset, rtol=1e-6)
    # at rod and crank in line the slider is at its ends
    reach = np.sqrt((0.12 + 0.05) ** 2 - 0.01**2)
    assert one["slider_position"].max() == pytest.approx(reach, rel=1e-2 if changes else 1e-4)


@pytest.mark.parametrize("speed", [520.0, -520.0])
def test_a_load_of_two_turns_repeats_after_them(speed):
    load = [[0.0, 0.0], [3.0, 100.0], [8.0, -100.0], [12.0, 20.0]]
    changes = {"drive.turns": 2, "drive.speed": speed, "effects.slider_load": load}
    response = simulate(scene_with(BARE | changes | {"numerics.interpolation": "linear"}, 2))
    angle = response["crank_angle"].to_numpy()
    assert angle[-1] == pytest.approx(np.copysign(4 * at.TURN, speed))
    expected = np.interp(angle, *np.array(load).T, period=2 * at.TURN)
    assert np.abs(response["slider_load"].to_numpy() - expected).max() < 1.0
    assert np.abs(response["energy_residual"].to_numpy()).max() < 1e-3
    assert np.abs(response["load_work"].to_numpy()).max() > 1.0


@pytest.mark.parametrize("drive", ["prescribed", "torque"])
@pytest.mark.parametrize("longer", [1e-6, 2.6e-8, 1e-9])
def test_a_rod_hardly_longer_than_the_crank_is_told(drive, longer):
    """Energy closes where numbers are given, and where they are not the status says why."""
    changes = {
        "joints.crank_rod": {"kind": "ideal"},
        "joints.rod_slider": {"kind": "ideal"},
        "effects.friction": {"law": "none"},
        "mechanism.rod.length": 0.05 + longer,
        "mechanism.rod.mass_center": 0.02,
    }
    if drive == "torque":
        changes["drive"] = {
            "kind": "torque", "torque": 5.0, "initial_speed": 520.0, "flywheel_inertia": 0.01
        }  # fmt: skip
    scene = scene_with(changes)
    found = simulate(scene)
    records = evaluate_records(scene, Points((), np.empty((1, 0)), ()))
    if longer < 1e-7:
        assert int(found["status"]) == records["status"][0] == Status.NEAR_SINGULAR
        assert "change point" in Status.NEAR_SINGULAR.message
        assert np.isnan(float(found["objective"]))
        assert np.isnan(records["objective"][0])
    else:
        assert int(found["status"]) == records["status"][0] == Status.OK
        off = np.abs(found["energy_residual"]).max() / np.abs(found["kinetic_energy"]).max()
        assert off < 1e-4


def test_extremes_of_samples_are_those_of_the_series():
    """Without anything to integrate, moment and acceleration of a revolution are worked out beforehand."""
    scene = scene_with(BARE | {"effects.gravity": 9.81, "numerics.responses": True})
    points = Points(("m3",), np.array([[0.1], [0.4]]), (("mechanism.slider.mass",),))
    records = evaluate_records(scene, points)
    for record, mass in zip(records, points.values[:, 0], strict=True):
        shown = simulate(scene.with_({"mechanism.slider.mass": mass}))
        moment, acceleration = (
            shown[name].to_numpy()[:-1] for name in ("crank_moment", "slider_acceleration")
        )
        assert record["peak_crank_moment"] == pytest.approx(np.abs(moment).max(), rel=1e-9)
        assert record["slider_acceleration_deviation"] == pytest.approx(
            acceleration.std(), rel=1e-9
        )

"""The mechanism without clearance: closed forms, dense inverse dynamics, works."""

import numpy as np
import pytest
from dense_mechanism import PHI, THETA2, X2, X3, Y2, admissible, assembled
from running import scene_with
from scipy.interpolate import PchipInterpolator
from test_motion import CRANK, FULL, ROD, SLIDER_MASS, SPEED, dense_model, row_of_parameters

from hpcclear.base.outcome import Status
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.closed_form import ClosedForm, ideal_series
from hpcclear.dynamics.curves import curve_at, periodic_cells
from hpcclear.dynamics.evaluation import evaluate_records
from hpcclear.dynamics.linkage import ideal
from hpcclear.dynamics.parameters import parameters
from hpcclear.dynamics.problem import problem_of
from hpcclear.dynamics.response import simulate
from hpcclear.dynamics.start import start_states
from hpcclear.dynamics.views import Outcome
from hpcclear.scene.points import Points

ANGLES = np.linspace(0, 3 * at.TURN, 721)
ZERO = np.zeros(2)


def response(effects, angles=ANGLES, **more):
    par = row_of_parameters(effects, None)
    flags = at.Effects(**dict.fromkeys(effects, 1))
    return ideal.ideal_response(flags, par, None, angles, **more), par


def relative_to_peak(got, expected):
    return np.abs(got - expected).max() / np.abs(expected).max()


def test_slider_equals_the_textbook():
    """x = r cos + sqrt(l^2 - r^2 sin^2) and its derivatives in the crank angle, written out."""
    seen, _ = response(set())
    r, length = CRANK["length"], ROD["length"]
    s, c = np.sin(ANGLES), np.cos(ANGLES)
    root = np.sqrt(length**2 - r**2 * s**2)
    x = r * c + root
    v = -SPEED * (r * s + r**2 * s * c / root)
    a = -(SPEED**2) * (r * c + r**2 * (c**2 - s**2) / root + r**4 * s**2 * c**2 / root**3)
    assert relative_to_peak(seen[ideal.SLIDER_X], x) < 1e-12
    assert relative_to_peak(seen[ideal.SLIDER_V], v) < 1e-12
    assert relative_to_peak(seen[ideal.SLIDER_A], a) < 1e-12


def test_reactions_equal_the_textbook():
    """Rod without mass at its ends: the slider's inertia goes along the rod to the crank (two-force member)."""
    effects = {"load"}
    par = row_of_parameters(effects, None)
    par[[at.ROD_MASS, at.ROD_INERTIA]] = 0.0
    flags = at.Effects(load=1)
    seen = ideal.ideal_response(flags, par, None, ANGLES)
    r, length = CRANK["length"], ROD["length"]
    s, c = np.sin(ANGLES), np.cos(ANGLES)
    root = np.sqrt(length**2 - r**2 * s**2)
    a = -(SPEED**2) * (r * c + r**2 * (c**2 - s**2) / root + r**4 * s**2 * c**2 / root**3)
    along = par[at.LOAD] - SLIDER_MASS * a  # on the rod from the slider, x
    across = along * (-r * s) / root  # a two-force member pulls along itself
    assert relative_to_peak(seen[ideal.FORCE_23_X], along) < 1e-12
    assert relative_to_peak(seen[ideal.FORCE_23_Y], across) < 1e-12
    assert relative_to_peak(seen[ideal.FORCE_12_X], -along) < 1e-12
    assert relative_to_peak(seen[ideal.FORCE_12_Y], -across) < 1e-12
    assert relative_to_peak(seen[ideal.GUIDE_FORCE], across) < 1e-12
    centripetal = CRANK["mass"] * CRANK["u"] * SPEED**2
    assert relative_to_peak(seen[ideal.BEARING_X], -along - centripetal * c) < 1e-12
    assert relative_to_peak(seen[ideal.BEARING_Y], -across - centripetal * s) < 1e-12
    # virtual power: moment times speed plus force times slider speed is zero
    moment = along * (r * s + r**2 * s * c / root)
    assert relative_to_peak(seen[ideal.CRANK_MOMENT], moment) < 1e-12


@pytest.mark.parametrize("effects", [set(), FULL, {"gravity"}, {"guide", "load"}], ids=sorted)
def test_reactions_equal_the_multipliers_of_the_dense_model(effects):
    """All bodies with mass, gravity, load and guide friction."""
    seen, par = response(effects, ANGLES[:240:7])
    mech = dense_model(effects, par, np.ones(2 * at.MAX_JOINTS))
    expected = []
    for phi in ANGLES[:240:7]:
        q = assembled(mech, phi, ZERO, ZERO)
        v = admissible(mech, q, np.zeros(9), phi / SPEED)
        a = mech.accelerations(q, v, phi / SPEED)
        bearing_x, bearing_y, guide, _, drive, px, py, rx, ry = mech.seen["multipliers"]
        motion = [
            q[X3],
            v[X3],
            a[X3],
            q[X2],
            q[Y2],
            q[THETA2],
            v[X2],
            v[Y2],
            v[THETA2],
            a[X2],
            a[Y2],
            a[THETA2],
        ]
        forces = [
            -px,
            -py,
            -rx,
            -ry,
            bearing_x,
            bearing_y,
            guide,
            mech.seen["guide_friction"],
            mech.load,
            drive,
        ]
        if v[X3] < 0:
            forces[7] = mech.seen["guide_friction"]
        expected.append(motion + forces)
    expected = np.array(expected).T
    for row, (got, wanted) in enumerate(zip(seen, expected, strict=True)):
        scale = np.abs(wanted).max()
        assert np.abs(got - wanted).max() <= 1e-11 * scale, row


def test_a_torque_driven_crank_gets_its_torque_back():
    """With the acceleration that a torque gives, inverse dynamics returns this torque."""
    effects = FULL | {"torque"}
    rng = np.random.default_rng(8)
    par = row_of_parameters(effects, rng)
    mech = dense_model(effects, par, np.ones(2 * at.MAX_JOINTS))
    for phi in rng.uniform(0, at.TURN, 10):
        q = assembled(mech, phi, ZERO, ZERO)
        wanted = np.zeros(9)
        wanted[PHI] = SPEED
        v = admissible(mech, q, wanted)
        v *= SPEED / v[PHI]
        a = mech.accelerations(q, v)
        seen, _ = response(
            effects, np.array([phi]), speed=v[PHI : PHI + 1], acceleration=a[PHI : PHI + 1]
        )
        assert seen[ideal.CRANK_MOMENT, 0] == pytest.approx(2.5, rel=1e-9)
        assert seen[ideal.SLIDER_A, 0] == pytest.approx(a[X3], rel=1e-11)


def test_works_close_the_energy_balance():
    """Kinetic and potential energy at the instants against the integrals between them."""
    effects = FULL
    seen, par = response(effects)
    flags = at.Effects(**dict.fromkeys(effects, 1))
    drive, size, lost, load = ideal.ideal_works(flags, par, None, ANGLES)
    m2, i2 = ROD["mass"], ROD["inertia"]
    kinetic = (
        m2 * (seen[ideal.ROD_VX] ** 2 + seen[ideal.ROD_VY] ** 2) + i2 * seen[ideal.ROD_SPIN] ** 2
    )
    kinetic = 0.5 * (kinetic + SLIDER_MASS * seen[ideal.SLIDER_V] ** 2)
    height = par[at.CRANK_MOMENT] * np.sin(ANGLES) + m2 * seen[ideal.ROD_Y]
    total = kinetic + 9.81 * height
    rest = total - total[0] - drive - load + lost
    # the guide reaction changes sign inside a few intervals, where |N| has a kink
    assert np.abs(rest).max() < 1e-6 * size[-1]
    assert (np.diff(lost) >= 0).all()
    assert (np.diff(size) >= 0).all()


def test_tabulated_load_is_taken_at_the_crank_angle():
    cells = periodic_cells(((0.0, 1.0), (1.0, 3.0), (3.0, -2.0), (5.0, 0.5)))
    par = row_of_parameters(set(), None)
    par[at.LOAD] = 1.0
    seen = ideal.ideal_response(
        at.Effects(load_table=1), par, cells, np.array([0.0, 1.0, 3.0, 5.0, 1.0 + at.TURN])
    )
    np.testing.assert_allclose(seen[ideal.LOAD_FORCE], [1.0, 3.0, -2.0, 0.5, 3.0], atol=1e-4)


ROWS = ((0.1, 1.0), (1.0, 3.0), (3.0, -2.0), (5.0, 0.5))


@pytest.mark.parametrize("seed", range(5))
def test_curves_are_the_monotone_cubics_of_scipy(seed):
    """Rows that rise, fall, stay level and lie unevenly, over many decades."""
    random = np.random.default_rng(seed)
    rows = np.sort(random.choice(6000, random.integers(2, 40), replace=False)) / 1000.0
    values = random.integers(-3, 4, len(rows)) * 10.0 ** random.uniform(-8, 8)
    three = np.concatenate([rows - at.TURN, rows, rows + at.TURN])
    smooth = PchipInterpolator(three, np.tile(values, 3))
    cells = periodic_cells(tuple(zip(rows, values, strict=True))).reshape(-1, 4)
    width = at.TURN / at.CELLS
    angle = np.arange(at.CELLS) * width
    angle = np.where(angle < rows[0], angle + at.TURN, angle)
    size = np.abs(values).max()
    np.testing.assert_allclose(cells[:, 0], smooth(angle), rtol=0, atol=1e-13 * size)
    slope = smooth.derivative()(angle)
    np.testing.assert_allclose(
        cells[:, 1], slope * width, rtol=0, atol=1e-12 * np.abs(slope).max() * width
    )


def test_straight_lines_between_rows():
    """Exact but in the four cells that hold a row; there off by an eighth of the kink's slope over a cell, at most."""
    width = at.TURN / at.CELLS
    angle = np.linspace(-1.0, 7.0, 20_001)
    expected = np.interp(angle, *np.array(ROWS).T, period=at.TURN)
    error = np.abs(curve_at(ROWS, angle, interpolation="linear") - expected)
    holds = [np.abs((angle - row + np.pi) % at.TURN - np.pi) < width for row, _ in ROWS]
    assert error[~np.any(holds, axis=0)].max() < 1e-13
    assert 0 < error.max() < 0.5 * width * 5
    # rows at the borders of cells have their kinks
    even = tuple((k * at.TURN / 8, float(k % 3)) for k in range(8))
    expected = np.interp(angle, *np.array(even).T, period=at.TURN)
    assert np.abs(curve_at(even, angle, interpolation="linear") - expected).max() < 1e-12
    assert np.abs(curve_at(even, angle) - expected).max() > 0.01


@pytest.mark.parametrize("ideal_joints", [True, False])
def test_the_load_of_a_response_is_straight_where_that_is_asked_for(ideal_joints):
    load = [[0.0, 0.0], [3.0, 100.0], [4.0, -100.0]]
    changes = {"effects.slider_load": load, "numerics.interpolation": "linear"}
    response = simulate(scene_with(changes | (BARE if ideal_joints else {}), revolutions=1))
    angle = np.mod(response["crank_angle"].to_numpy(), at.TURN)
    expected = np.interp(angle, *np.array(load).T, period=at.TURN)
    assert np.abs(response["slider_load"].to_numpy() - expected).max() < 0.5
    assert np.abs(response["energy_residual"].to_numpy()).max() < 1e-3


def test_outcomes_have_no_gap():
    par = np.tile(row_of_parameters(set(), None), (3, 1))
    par[:, at.PERIOD] = at.TURN / SPEED
    seen = Outcome(ideal.ideal_outcomes(at.Effects(), par, None, 5, 4))
    for column in (seen.status, seen.objective, seen.spread, seen.evaluations):
        np.testing.assert_array_equal(column, 0.0)
    np.testing.assert_allclose(seen.time, 9 * at.TURN / SPEED)
    assert np.isnan(Outcome(ideal.ideal_outcomes(at.Effects(), par, None, 5, 1)).spread).all()


BARE = {
    "joints.crank_rod": {"kind": "ideal"},
    "joints.rod_slider": {"kind": "ideal"},
    "effects.friction": {"law": "none"},
}


def test_a_queue_of_scenes_without_clearance_is_done_at_once():
    scene = scene_with(BARE, revolutions=3)
    par = np.tile(parameters(scene), (4, 1))
    lanes = ClosedForm(problem_of(scene))
    lanes.queue(par[:3], start_states(scene, par[:3]), np.array([5, 6, 7]))
    lanes.queue(par[3:], start_states(scene, par[3:]), np.array([2]))
    assert lanes.pending == 4
    lanes.advance(0.1)
    labels, outcome, seen = lanes.collect()
    assert lanes.pending == 0
    np.testing.assert_array_equal(labels, [5, 6, 7, 2])
    np.testing.assert_array_equal(outcome.objective, 0.0)
    np.testing.assert_array_equal(seen, par)
    assert len(lanes.collect()[0]) == 0


def test_series_of_a_scene_without_clearance_keep_the_energy_balance():
    more = {
        "effects.gravity": 9.81,
        "effects.slider_load": -40.0,
        "effects.guide_friction": {"coefficient": 0.1},
        "output.instants_per_revolution": 360,
    }
    times, series = ideal_series(scene_with(BARE | more, revolutions=2))
    assert times.shape == (721,)
    assert times[-1] == pytest.approx(2 * 60 / 5000, rel=1e-12)
    assert all(len(values) == 721 for values in series.values())
    assert np.abs(series["energy_residual"]).max() < 1e-6 * np.abs(series["driving_work"]).max()
    speed = np.gradient(series["slider_position"], times, edge_order=2)
    assert np.abs(speed - series["slider_velocity"]).max() < 1e-3 * np.abs(speed).max()


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
    if longer < (1e-7 if drive == "torque" else 1e-8):
        assert int(found["status"]) == records["status"][0] == Status.NEAR_SINGULAR
        assert "clearance" in Status.NEAR_SINGULAR.message
        assert np.isnan(float(found["objective"]))
        assert np.isnan(records["objective"][0])
    else:
        assert int(found["status"]) == records["status"][0] == Status.OK
        off = np.abs(found["energy_residual"]).max() / np.abs(found["kinetic_energy"]).max()
        assert off < 1e-4

"""Lobatto collocation: its coefficients, its results beside those of the pair, and what surrounds a step."""

import sys
from pathlib import Path

import numba
import numpy as np
import pytest
from running import HUNT_CROSSLEY, LATCHED, energy_residual, kept_steps, run, scene_with

from hpcclear.base.errors import InputError
from hpcclear.base.jit import FASTMATH
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.collocation import lobatto
from hpcclear.dynamics.lanes import Lanes
from hpcclear.dynamics.parameters import parameters
from hpcclear.dynamics.problem import problem_of
from hpcclear.dynamics.response import integrate
from hpcclear.dynamics.start import start_states
from hpcclear.dynamics.stepping import record
from hpcclear.dynamics.views import Outcome, Start
from hpcclear.scene import load_scene
from hpcclear.scene.points import Points

ANALYSIS = Path(__file__).parents[1] / "analysis"
sys.path.insert(0, str(ANALYSIS))

from assembly import executed_arithmetic, force_evaluation  # noqa: E402
from scenes import LAWS, scene, single  # noqa: E402

DRY = {"law": "none"}
RAMP = {"law": "coulomb", "coefficient": 0.05, "ramp_speed": 0.1}
AMBROSIO = {"law": "ambrosio", "coefficient": 0.05, "speeds": [1e-3, 0.1]}
TORQUE = {"kind": "torque", "torque": 0.5, "initial_speed": 300.0}
IDEAL = {"kind": "ideal"}
CURVE = [[0.0, -10.0], [3.0, -50.0], [2.0 * np.pi, -10.0]]

CASES = {
    "Hunt-Crossley": {"effects.contact": HUNT_CROSSLEY, "effects.friction": RAMP},
    "latched": {"effects.contact": {**LATCHED, "restitution": 0.5}, "effects.friction": RAMP},
    "Ambrosio": {"effects.contact": HUNT_CROSSLEY, "effects.friction": AMBROSIO},
    "dry": {"effects.contact": HUNT_CROSSLEY, "effects.friction": DRY},
    "first joint": {"effects.contact": HUNT_CROSSLEY, "joints.rod_slider": IDEAL},
    "second joint": {
        "effects.contact": {**LATCHED, "restitution": 0.5}, "joints.crank_rod": IDEAL
    },
    "torque": {"effects.contact": HUNT_CROSSLEY, "drive": TORQUE},
    "torque, one joint": {
        "effects.contact": HUNT_CROSSLEY, "drive": TORQUE, "joints.crank_rod": IDEAL
    },
    "everything": {
        "effects.contact": HUNT_CROSSLEY,
        "effects.gravity": 9.81,
        "effects.slider_load": CURVE,
        "effects.guide_friction": {"coefficient": 0.05, "ramp_speed": 0.1},
        "numerics.responses": True,
    },
}  # fmt: skip


def case(name: str, method: str, rtol: float, revolutions: int = 2):
    """One of the scenes with a method."""
    clearance = {
        f"joints.{joint}.clearance": 0.3e-3
        for joint in ("crank_rod", "rod_slider")
        if f"joints.{joint}" not in CASES[name]
    }
    return scene_with(
        clearance | CASES[name] | {"numerics.method": method, "numerics.energy": True},
        revolutions,
        rtol,
    )


# ---- coefficients -----------------------------------------------------------------------------------


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("kind", [float, complex])
def test_coefficients_are_real_whatever_type_the_roots_come_in(monkeypatch, kind):
    # NumPy 2.5 returns complex roots, earlier ones real ones.
    roots = lobatto.legendre.legroots
    expected = lobatto.matrices()
    monkeypatch.setattr(lobatto.legendre, "legroots", lambda c: roots(c).real.astype(kind))
    assert lobatto.nodes().dtype == np.float64
    for matrix, same in zip(lobatto.matrices(), expected, strict=True):
        assert matrix.dtype == np.float64
        assert np.array_equal(matrix, same)


def test_nodes_are_lobatto_points():
    x = 2.0 * lobatto.nodes() - 1.0
    assert len(x) == lobatto.STAGES + 1
    np.testing.assert_allclose(x, -x[::-1], atol=1e-15)
    assert (x[0], x[-1]) == (-1.0, 1.0)
    slope = np.polynomial.Legendre.basis(lobatto.STAGES).deriv()
    assert np.abs(slope(x[1:-1])).max() < 1e-13


@pytest.mark.parametrize("degree", range(lobatto.STAGES + 1))
def test_polynomials_are_integrated_exactly_to_every_node(degree: int):
    c = lobatto.nodes()
    once, twice, to_coefficients = lobatto.matrices()
    values = c**degree
    np.testing.assert_allclose(once @ values, c ** (degree + 1) / (degree + 1), atol=1e-15)
    exact = c ** (degree + 2) / ((degree + 1) * (degree + 2))
    np.testing.assert_allclose(twice @ values, exact, atol=1e-15)
    shifted = np.polynomial.Legendre(to_coefficients @ values, domain=[0, 1])
    np.testing.assert_allclose(shifted(0.3), 0.3**degree, atol=1e-14)


@pytest.mark.parametrize("degree", range(16))
def test_the_end_of_a_step_is_exact_to_degree_15(degree: int):
    once, twice, _ = lobatto.matrices()
    values = lobatto.nodes() ** degree
    assert once[-1] @ values == pytest.approx(1.0 / (degree + 1), abs=1e-15)
    if degree < 15:
        exact = 1.0 / ((degree + 1) * (degree + 2))
        assert twice[-1] @ values == pytest.approx(exact, abs=1e-15)


def test_order_on_an_oscillator():
    once, twice, _ = lobatto.matrices()
    c = lobatto.nodes()

    def miss(h: float) -> float:
        """Error after one step of x'' = -x - x'/2 from x = 1, x' = 0, over the exact solution's size."""
        # a = -(x + h c v + h^2 T a) - (v + h S a)/2 for all nine nodes
        system = np.eye(9) + h * h * twice + 0.5 * h * once
        a = np.linalg.solve(system, -np.ones(9))
        w = np.sqrt(1.0 - 1.0 / 16.0)
        x = np.exp(-h / 4) * (np.cos(w * h) + np.sin(w * h) / (4 * w))
        v = -np.exp(-h / 4) * np.sin(w * h) / w
        return abs(1.0 + h * h * twice[-1] @ a - x) + abs(h * once[-1] @ a - v)

    assert c[-1] == 1.0
    slope = np.log2(miss(4.0) / miss(2.0))
    assert slope == pytest.approx(17.0, abs=0.7)  # of one step: the order and one


# ---- results ----------------------------------------------------------------------------------------


def outcome(scene) -> Outcome:
    """Outcome of one sample; with its record, so that every test runs the same compiled stepper."""
    return run(scene).out


@pytest.mark.parametrize("name", CASES)
def test_collocation_agrees_with_the_pair(name: str):
    """Two methods that share no coefficient, at tolerances where both have converged."""
    ours = outcome(case(name, "lobatto", 1e-10, 1))
    pair = outcome(case(name, "dormand-prince", 1e-11, 1))
    assert ours.status == pair.status == 0
    assert ours.attempts < 0.5 * pair.attempts
    names = ["objective", "mean_gap", "drive_work", "dissipated", "load_work", "time", "latched"]
    if name == "everything":
        names += ["mean_force", "acceleration_deviation"]
    for which in names:
        np.testing.assert_allclose(
            getattr(ours, which), getattr(pair, which), rtol=3e-8, err_msg=which
        )
    # |power| has a kink at each zero, which no method steps to: long steps feel it more; it is a scale and no result
    assert ours.absolute_drive_work == pytest.approx(pair.absolute_drive_work, rel=1e-4)
    np.testing.assert_allclose(ours.moving, pair.moving, rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("name", CASES)
def test_a_tighter_tolerance_is_nearer(name: str):
    exact = outcome(case(name, "lobatto", 1e-12, 1)).objective
    errors = [
        abs(outcome(case(name, "lobatto", rtol, 1)).objective / exact - 1.0)
        for rtol in (1e-4, 1e-7, 1e-10)
    ]
    assert errors[0] < 1e-3
    assert errors[1] < 1e-6
    assert errors[2] < 1e-8


@pytest.mark.parametrize("name", CASES)
def test_the_energy_balance_closes(name: str):
    scene = case(name, "lobatto", 1e-8)
    residual, passed = energy_residual(scene, run(scene))
    assert abs(residual) < 1e-7 * passed


# ---- around a step ----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["latched", "torque"])
def test_interruptions_do_not_change_one_bit(name: str):
    scene = case(name, "lobatto", 1e-6)
    par = parameters(scene)

    def finished(budget: int) -> bytes:
        lanes = Lanes(problem_of(scene), 1)
        lanes.queue(par, start_states(scene, par), np.zeros(1, np.int64))
        while lanes.pending:
            lanes.step(budget)
        return lanes.collect()[1].rows.tobytes()

    assert finished(1) == finished(1_000_000)


def test_samples_one_after_the_other_do_not_know_of_each_other():
    scene = case("latched", "lobatto", 1e-6)
    clearances = np.array([[0.2e-3], [0.5e-3], [0.3e-3]])
    points = Points(["c"], clearances, [["joints.crank_rod.clearance"]])
    par = parameters(scene, points)
    start = start_states(scene, par)
    lanes = Lanes(problem_of(scene), 32)
    assert lanes.width == 1
    together = lanes.run(par, start)
    for k in range(3):
        alone = Lanes(problem_of(scene), 1).run(par[k : k + 1], start[k : k + 1])
        assert alone[0].rows.tobytes() == together[k].rows.tobytes()


def test_the_record_holds_every_node_and_a_small_one_changes_no_step():
    scene = case("latched", "lobatto", 1e-9)
    steps, _, _ = integrate(scene)
    problem, par = problem_of(scene, ledger=True, series=True), parameters(scene)
    n = problem.coordinates
    chunks = kept_steps(problem, par, start_states(scene, par), 3 * lobatto.STAGES + 5, 1_000_000)
    rows = np.concatenate(chunks)
    assert len(chunks) > 20
    assert len(rows) % lobatto.STAGES == 0
    assert rows[:, record.TIME].tobytes() == steps.time[1:].tobytes()
    assert rows[:, record.STATE : record.STATE + n].tobytes() == steps.q[1:].tobytes()
    assert (np.diff(steps.time) > 0.0).all()
    assert (np.diff(steps.works[:, 1]) >= 0.0).all()  # of the absolute power


@pytest.mark.parametrize("method", ["lobatto", "tsitouras"])
def test_a_full_record_is_not_written_beyond(method: str):
    scene = case("dry", method, 1e-9)
    problem, par = problem_of(scene), parameters(scene)
    lanes = Lanes(problem, 1, np.zeros((2 * lobatto.STAGES, record.columns(problem.coordinates))))
    lanes.queue(par, start_states(scene, par), np.zeros(1, np.int64))
    while not lanes.record_full:
        assert lanes.step(1000)
    with pytest.raises(RuntimeError, match="record is full"):
        lanes.step(1)
    assert len(lanes.take_record()) > lobatto.STAGES
    assert lanes.step(1)


def test_a_lost_cause_ends_with_a_status():
    scene = case("dry", "lobatto", 1e-6).with_({"numerics.max_steps": 20})
    lost = outcome(scene)
    assert lost.status == 1
    assert lost.attempts == 20


@pytest.mark.parametrize("name", ["Hunt-Crossley", "latched"])
def test_a_response_by_collocation_is_the_pair_s(name: str):
    """To 1e-9 at a tight tolerance: neither method is off by more there."""
    _, alone, _ = integrate(case(name, "lobatto", 1e-10, 1))
    scene = case(name, "auto", 1e-10, 1)
    par = parameters(scene)
    lanes = Lanes(problem_of(scene), 32)
    starts = Start(np.repeat(start_states(scene, par).rows, 3, 0))
    outcomes = lanes.run(np.repeat(par, 3, 0), starts)
    assert lanes.problem.tableau.name == "tsitouras"
    np.testing.assert_allclose(alone["objective"][0], outcomes.objective, rtol=1e-9)


def test_collocation_is_taken_where_it_is_named():
    def taken(changes) -> bool:
        return problem_of(scene_with(changes, rtol=1e-6)).collocation

    smooth = {"effects.contact": HUNT_CROSSLEY}
    assert not taken(smooth)
    assert taken(smooth | {"numerics.method": "lobatto"})
    assert not taken(smooth | {"numerics.method": "dormand-prince"})
    both = {"numerics.formulation": "baumgarte", "numerics.method": "lobatto"}
    with pytest.raises(InputError, match="minimal coordinates"):
        taken(smooth | both)


def test_a_contact_between_two_sweeps_does_not_hold_it_up():
    """A gap that the last sweep found 1e-8 m on one side of nought, and the state that it left on the other."""
    linkage = ANALYSIS.parent / "jobs" / "linkages" / "v_twin.toml"
    short = ["numerics.transient_revolutions=0", "numerics.averaged_revolutions=1"]
    twin = load_scene(linkage, [*short, "numerics.method=lobatto", "numerics.rtol=1e-5"])
    _, outcome, _ = integrate(twin)
    assert outcome["status"][0] == 0


# ---- speed ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("law", LAWS)
def test_a_sweep_is_packed(law: str):
    """Eight stages, a vector each, however many coordinates; sums over the stages and their quotients are left alone."""

    @numba.njit(error_model="numpy", fastmath=FASTMATH)
    def sweep(m, work, n):
        _, back = lobatto.compare(m, n)
        lobatto.set_stages(m, work, n, 1e-6, at.ACC, back)
        lobatto.guess(m, n, 1e-6)

    sweep(lobatto.new_memory(), np.zeros(at.WORK), 4)
    found = executed_arithmetic(sweep.inspect_asm(sweep.signatures[0]))
    assert found.packed.total() >= 60  # of one coordinate: they are a loop
    assert found.scalar.total() <= 10
    problem = single(scene(law, 1e-6, 1, 1)).problem
    found = executed_arithmetic(force_evaluation(problem, lobatto.STAGES))
    assert found.packed.total() >= 100
    assert found.packed_share >= 0.9

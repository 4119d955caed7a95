"""A named error of f: met within limits that hold, or said to be missed or not to exist, whatever the motion does."""

import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner

from hpcclear import simulate
from hpcclear.base.errors import InputError
from hpcclear.base.outcome import Flag, Regime
from hpcclear.cli import cli
from hpcclear.cli.printing import describe
from hpcclear.dynamics.evaluation import evaluate_records
from hpcclear.dynamics.evaluation.steady import ensemble
from hpcclear.dynamics.evaluation.steady.copies import perturbed, scales
from hpcclear.dynamics.evaluation.steady.judging import objective
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.problem import problem_of
from hpcclear.dynamics.setup.start import start_states
from hpcclear.dynamics.stepping.lanes import Lanes
from hpcclear.ensemble.api import evaluate
from hpcclear.report.html.content import Content
from hpcclear.scene import Scene, load_scene
from hpcclear.scene.points import Points

FILE = Path(__file__).parent.parent / "jobs" / "hunt_crossley.toml"
BASE = load_scene(FILE)
NOTHING = Points((), np.empty((1, 0)), ())
CHAOTIC = {
    "effects.contact.damping": 0.02,
    "joints.crank_rod.clearance": 1e-3,
    "joints.rod_slider.clearance": 1e-3,
}
"""The journals bounce: a perturbation grows by a factor of a hundred in a revolution."""

SLOWING = {
    "drive": {"kind": "torque", "torque": -0.5, "initial_speed": 500.0},
    "mechanism.crank.inertia": 0.1,
}


def record(changes: dict, target: float, **numerics: int) -> np.void:
    asked = {"numerics.target_error": target} | {f"numerics.{k}": v for k, v in numerics.items()}
    return evaluate_records(BASE.with_(changes | asked), NOTHING)[0]


@cache
def truth(chaotic: bool) -> tuple[float, float]:
    """Mean of f over copies that nothing else uses, at a tighter tolerance and for longer; and its standard error."""
    scene = BASE.with_(CHAOTIC if chaotic else {})
    numerics = {
        "rtol": 1e-7,
        "atol": None,
        "transient_revolutions": 40,
        "averaged_revolutions": 120,
    }
    problem = problem_of(scene.with_({f"numerics.{k}": v for k, v in numerics.items()}))
    par = parameters(scene)
    start = perturbed(start_states(scene, par), scales(scene, par[0]), range(1000, 1064))
    gaps = Lanes(problem, 16).run(np.repeat(par, 64, axis=0), start).mean_gap
    return float(objective(gaps.mean(axis=0))), float(objective(gaps).std(ddof=1) / 8.0)


@pytest.mark.parametrize("target", [1e-2, 1e-3, 1e-4])
def test_a_regular_motion_is_told_and_its_limits_hold(target: float):
    found = record({}, target)
    assert found["regime"] == Regime.REGULAR
    assert found["period"] == 1
    assert not found["flags"] & Flag.TARGET_MISSED
    assert found["objective_limit"] <= target * found["objective"]
    assert abs(found["objective"] - truth(False)[0]) <= found["objective_limit"]


@pytest.mark.parametrize("target", [1e-2, 2e-3])
def test_a_chaotic_motion_is_told_and_its_limits_hold(target: float):
    found = record(CHAOTIC, target)
    assert found["regime"] == Regime.CHAOTIC
    assert found["lyapunov_exponent"] > 1.0
    assert not found["flags"] & Flag.TARGET_MISSED
    assert found["objective_limit"] <= target * found["objective"]
    mean, error = truth(True)
    # one seed, one draw: its limits and three standard errors of the truth
    assert abs(found["objective"] - mean) <= found["objective_limit"] + 3.0 * error


def test_a_target_beyond_the_budget_is_missed_and_the_limits_say_by_how_much():
    found = record(CHAOTIC, 1e-4, target_revolutions=3000)
    assert found["flags"] & Flag.TARGET_MISSED
    assert 1e-4 < found["objective_limit"] / found["objective"] < 1e-2
    assert 3000 <= found["steady_revolutions"] < 4000
    assert abs(found["objective"] - truth(True)[0]) <= 2.0 * found["objective_limit"]


def test_more_revolutions_narrow_the_limits():
    # a quarter of the width by scatter; what two tolerances differ by falls more slowly, and is drawn from chance
    few, many = (record(CHAOTIC, 1e-5, target_revolutions=n) for n in (3000, 48000))
    assert many["objective_limit"] < 0.7 * few["objective_limit"]


def test_a_motion_that_slows_down_has_no_steady_mean():
    found = record(SLOWING, 1e-3)
    assert found["regime"] in (Regime.UNSTEADY, Regime.SETTLING)
    assert found["flags"] & Flag.TARGET_MISSED


def test_a_chaotic_motion_whose_speed_still_moves_is_not_called_met():
    """The crank gathers speed for thousands of revolutions, by less in a look than chaos scatters."""
    drive = {"kind": "torque", "torque": 0.5, "initial_speed": 60.0}
    found = record(CHAOTIC | {"drive": drive, "mechanism.crank.inertia": 0.05}, 1e-2)
    assert found["regime"] in (Regime.UNSTEADY, Regime.SETTLING)
    assert found["flags"] & Flag.TARGET_MISSED


def test_a_looser_tolerance_that_is_off_is_given_up_and_the_stricter_kept(monkeypatch):
    monkeypatch.setattr(ensemble, "LOOSEST", 1e-3)  # where this motion is off by 0.3 %
    found = record(CHAOTIC, 5e-4, target_revolutions=60_000)
    assert found["steady_rtol"] <= 1.01e-5
    mean, error = truth(True)
    assert abs(found["objective"] - mean) <= found["objective_limit"] + 3.0 * error


def test_neither_lanes_nor_company_change_a_bit():
    scene = BASE.with_(CHAOTIC | {"numerics.target_error": 1e-2})
    clearance = ("joints.crank_rod.clearance", "joints.rod_slider.clearance")
    points = Points(("C",), np.array([[1e-3], [0.3e-3], [0.6e-3]]), (clearance,))
    together = evaluate_records(scene, points)
    for lanes, rows in ((32, [0, 1, 2]), (16, [2, 0]), (16, [1])):
        others = evaluate_records(scene, points.take(rows), lanes)
        for name in (
            "objective",
            "objective_limit",
            "lyapunov_exponent",
            "peak_contact_force",
            "rhs_evaluations",
        ):
            np.testing.assert_array_equal(others[name], together[name][rows])


def test_a_stricter_error_takes_a_stricter_tolerance():
    rtol = [float(record({}, e)["steady_rtol"]) for e in (1e-2, 1e-4, 1e-6)]
    assert rtol[0] > 5.0 * rtol[1] > 25.0 * rtol[2]


def test_files_say_what_was_reached():
    named = BASE.with_({"numerics.target_error": 1e-3})
    points = {"C": np.linspace(0.3e-3, 0.6e-3, 4)}
    made = evaluate(named, points)
    assert made.attrs["target_error_reached"] == "0.001 met on 4 of 4"
    assert (made["regime"] == Regime.REGULAR).all()
    assert "regime" not in evaluate(BASE, points)
    assert "target_error_reached" not in evaluate(BASE, points).attrs
    short = evaluate(
        BASE.with_(CHAOTIC | {"numerics.target_error": 1e-6, "numerics.target_revolutions": 2500}),
        {"m1": 0.3},
    )
    assert (
        short.attrs["target_error_reached"] == "1e-06 met on 0 of 1; missed: 1 chaotic (samples 0)"
    )


def test_a_response_carries_the_steady_mean():
    made = simulate(BASE.with_({"numerics.target_error": 1e-3}))
    alone = record({}, 1e-3)
    assert float(made["objective"]) == alone["objective"]
    assert float(made["objective_limit"]) == alone["objective_limit"]
    assert made.sizes["time"] > 1000


def test_a_stretch_says_by_itself_how_far_replicas_of_it_differ():
    """The stretch itself stays what it is."""
    plain, checked = (simulate(BASE.with_(CHAOTIC), checked=on) for on in (False, True))
    assert float(plain["objective"]) == float(checked["objective"])
    assert np.isnan(float(plain["objective_uncertainty"]))
    assert float(checked["objective_uncertainty"]) > 1e-3 * float(checked["objective"])


def run_simulate(tmp_path: Path, scene: Scene) -> tuple[int, str, str]:
    file = tmp_path / "scene.toml"
    file.write_text(scene.to_toml())
    result = CliRunner().invoke(
        cli, ["simulate", str(file), "-o", str(tmp_path / "r.nc")], standalone_mode=False
    )
    return result.return_value, " ".join(result.stdout.split()), result.stderr


def test_the_terminal_says_so_and_the_exit_code(tmp_path: Path):
    code, shown, errors = run_simulate(tmp_path, BASE.with_({"numerics.target_error": 1e-2}))
    assert code == 0
    assert "±" in shown
    assert "f is known to ± " in shown
    assert errors == ""
    missed = CHAOTIC | {"numerics.target_error": 1e-4, "numerics.target_revolutions": 2500}
    code, shown, errors = run_simulate(tmp_path, BASE.with_(missed))
    assert code == 4
    assert "chaotic" in shown
    assert errors.startswith("Target missed: the relative half-width of f is ")
    with xr.open_dataset(tmp_path / "r.nc") as made:
        assert int(made["flags"]) & Flag.TARGET_MISSED


def test_wherever_the_budget_ends_limits_are_finite_or_there_are_none():
    """From the look on to the first look at an ensemble, and after the tolerance was given up."""
    for budget in (100, 400, 700, 1000, 2100):
        found = record(CHAOTIC, 1e-6, target_revolutions=budget)
        assert found["flags"] & Flag.TARGET_MISSED
        assert not np.isinf(found["objective_limit"])
        assert np.isnan(found["objective_limit"]) or found["objective_limit"] > 0.0
        assert found["steady_revolutions"] >= budget


ONE_JOINT = "mechanism.joints.o3={kind='revolute',journal='coupler.b',bearing='rocker.b'}"
"""Leaves a crank-rocker one joint with clearance."""


@pytest.mark.parametrize("gaps", [[3.0], [3.0, 4.0], [2.0, 3.0, 6.0]])
def test_f_is_the_root_sum_of_squares_of_as_many_joints_as_there_are(gaps):
    assert objective(np.array([gaps, gaps])) == pytest.approx([float(np.linalg.norm(gaps))] * 2)


def test_a_linkage_with_one_clearance_joint_meets_a_target(tmp_path, capsys, details):
    settings = [ONE_JOINT, "numerics.target_error=0.5", "numerics.target_revolutions=100"]
    scene = load_scene(FILE.parent / "linkages" / "crank_rocker.toml", settings)
    found = simulate(scene)
    assert found["mean_gap"].shape == (1,)
    assert float(found["objective"]) == float(found["mean_gap"][0]) > 0.0
    describe(Content(tmp_path, {}, {"response": found}), tmp_path / "a.nc")
    steady = re.search(r"\nf +([0-9.]+)", capsys.readouterr().out)
    assert float(steady[1]) == pytest.approx(1e6 * float(found["objective"]), rel=0.1)


@pytest.mark.parametrize("changes", [{"numerics.objective": "peak-contact-force"}, {"study": None}])
def test_only_the_mean_gap_has_a_target(changes):
    peak = load_scene(FILE.parent / "quickstart.toml").with_(
        {"study.objective": "peak-contact-force"}
    )
    scene = BASE.with_(changes) if "study" not in changes else peak
    with pytest.raises(InputError, match=r"mean gap .*peak-contact-force.*averaged_revolutions"):
        scene.with_({"numerics.target_error": 0.01})

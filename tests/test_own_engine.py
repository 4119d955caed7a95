"""What results say of an engine of one's own: its own numbers, its own names, the objective that was asked for."""

import tomllib
from pathlib import Path
from types import SimpleNamespace

import formula
import numpy as np
import opened
import pytest
from own_engine import engine

import hpcclear
from hpcclear.base.objectives import OURS
from hpcclear.cli.printing import describe
from hpcclear.ensemble.session import Options, run_sample
from hpcclear.ranks.boundary import alone
from hpcclear.report.figures import labels
from hpcclear.report.html.content import Content
from hpcclear.scene import load_scene
from hpcclear.scene.describing import implausible
from hpcclear.study import responses, run_study
from hpcclear.study.optimisation import Choice

JOBS = Path(__file__).parent.parent / "jobs"
PLAYS = ("joints.crank_rod.clearance", "joints.rod_slider.clearance")


def compared(scene, **design):
    """The scene that a design of a study of that scene is compared in."""
    run = SimpleNamespace(scene=scene, study=scene.study)
    return responses.scene_of(run, Choice("worn alpha", "worn", design), 1)


def test_responses_are_compared_at_the_plays_of_the_scene():
    assert [compared(engine(), shank=0.4).number(path) for path in PLAYS] == [30e-6, 15e-6]
    assert compared(engine(), play=4e-5).number(PLAYS[0]) == 4e-5


def test_a_response_says_what_was_simulated(tmp_path, monkeypatch):
    """Its scene is that of its design, and simulating that scene again gives the response again."""
    formula.replace_dynamics(monkeypatch.setattr)
    run_study(engine(), tmp_path / "out", alone(), progress_style="quiet")
    front = opened.read(tmp_path / "out" / "verification.nc")
    for path in (tmp_path / "out" / "responses").glob("*.nc"):
        found = opened.read(path)
        scene = load_scene(tomllib.loads(found.attrs["scene"]))
        assert scene.hash == found.attrs["scene_hash"]
        assert [scene.number(play) for play in PLAYS] == [30e-6, 15e-6]
        name = found.attrs["design"]
        design = front.sel(design="worn original" if name == "original" else name)
        assert scene.number("mechanism.rod.mass") == pytest.approx(float(design["shank"]))


QUICK = ("numerics.rtol=1e-5", "study.samples=32", "numerics.responses=true")
UNITS = {
    "mean-gap": "m",
    "mean-contact-force": "N",
    "peak-contact-force": "N",
    "peak-crank-moment": "N m",
    "slider-acceleration-deviation": "m/s^2",
}


def of_response(found, name: str) -> float:
    """The objective worked out from what else a file holds."""
    if name == "mean-gap":
        return float(np.sqrt((found["mean_gap"] ** 2).sum("joint")))
    if name.endswith("contact-force"):
        return float(found[name.replace("-", "_")].max("joint"))
    return float(found[name.replace("-", "_")])


@pytest.mark.parametrize("name", UNITS)
def test_the_objective_asked_for_is_what_sample_evaluate_and_simulate_call_objective(
    tmp_path, name
):
    scene = engine(*QUICK, f"study.objective={name}")
    run_sample(scene, tmp_path / "samples.nc", alone(), options=Options(style="quiet"))
    evaluated = hpcclear.evaluate(scene, {"play": [30e-6]})
    for found in (opened.read(tmp_path / "samples.nc"), evaluated):
        assert found["objective"].attrs["units"] == UNITS[name]
        assert found["objective"].attrs["long_name"] == f"objective f, {OURS[name].words}"
        one = found.isel(sample=-1)
        assert float(one["objective"]) == pytest.approx(of_response(one, name), rel=1e-12)
        if name != "mean-gap":  # how f scatters says nothing of it
            assert found["objective_spread"].isnull().all()
    response = hpcclear.simulate(scene.with_({"joints.crank_rod.clearance": 30e-6}))
    assert response["objective"].attrs["units"] == UNITS[name]
    assert float(response["objective"]) == pytest.approx(float(evaluated["objective"][0]), rel=0.05)


@pytest.mark.parametrize(
    ("change", "fragments"),
    [
        ("drive.speed=5000", ["drive.speed = 5000 rad/s is 47746 rpm", '"5000 rpm"']),
        ("joints.crank_rod.bearing.youngs_modulus=0.5", ["= 0.5 Pa is softer than rubber", "GPa"]),
        ("joints.rod_slider.journal.youngs_modulus=210e12", ["stiffer than diamond", "GPa"]),
        ("joints.rod_slider.clearance=0.003", ["27 % of the bearing's radius", "radial clearance"]),
        ("mechanism.slider.mass=400", ["mechanism.slider.mass = 400 kg", '"400 g"']),
        ("mechanism.rod.length=140", ["mechanism.rod.length = 140 m", '"140 mm"']),
        ("mechanism.rod.inertia=1100", ["mechanism.rod.inertia = 1100 kg m2", "check the unit"]),
        ("effects.gravity=9810", ["effects.gravity = 9810", "9.81"]),
    ],
)
def test_a_slip_of_units_is_warned_of_in_a_line_with_a_remedy(change, fragments):
    assert engine(study=False).warnings == ()
    first, *_ = engine(change, study=False).warnings
    for fragment in fragments:
        assert fragment in first


@pytest.mark.parametrize(
    "change",
    [
        "mechanism.bodies.coupler.mass=400",
        "mechanism.bodies.coupler.length=140",
        "mechanism.joints.o2.materials.bearing.youngs_modulus=0.5",
        "mechanism.bodies.rocker.mass_center=3",
    ],
)
def test_a_slip_in_a_linkage_is_named_as_it_is_written(change):
    scene = load_scene(JOBS / "linkages" / "crank_rocker.toml", [change])
    assert any(text.startswith(f"{change.partition('=')[0]} = ") for text in scene.warnings)


@pytest.mark.parametrize("job", sorted(path.name for path in JOBS.glob("*.toml")))
def test_what_is_meant_is_not_warned_of(job):
    assert not list(implausible(load_scene(JOBS / job)))


RIGID = ("joints.crank_rod.kind=ideal", "joints.rod_slider.kind=ideal")


def test_a_study_of_what_is_0_is_warned_of():
    study = "effects.friction=none", "study.variables.m2.range=[0.1, 0.4]"
    (text,) = implausible(load_scene(JOBS / "slider_crank.toml", [*RIGID, *study]))
    assert text.startswith('study.objective = "mean-gap" is 0 where all joints are ideal')


@pytest.mark.parametrize("more", [(), RIGID], ids=["with play", "without"])
def test_a_response_holds_the_load_that_was_applied(more):
    """Through every row of the table, between the rows, and its work is the work that the balance knows."""
    found = hpcclear.simulate(engine(*more, study=False))
    angle, load = found.crank_angle.to_numpy(), found.slider_load.to_numpy()
    for degrees, force in ((0, -9000.0), (40, -3000.0), (180, -200.0)):
        for turn in (0, 1):
            at = np.interp(np.radians(degrees) + 2 * np.pi * turn, angle, load)
            assert at == pytest.approx(force, abs=30.0)
    assert load.min() >= -9000.0 - 1e-6
    assert load.max() <= -200.0 + 1e-6
    work = np.trapezoid(load * found.slider_velocity, found.time)
    assert work == pytest.approx(float(found.load_work[-1] - found.load_work[0]), rel=1e-3)
    assert found.slider_load.attrs["units"] == "N"
    assert np.allclose(found.crank_speed, 100 * np.pi)


def test_a_peak_between_the_instants_of_the_series_has_its_angle(tmp_path, capsys, details):
    response = hpcclear.simulate(engine("output.instants_per_revolution=12", study=False))
    describe(Content(tmp_path, {}, {"response": response}), tmp_path / "response.nc")
    told = " ".join(capsys.readouterr().out.split())
    with labels.in_units_of(response.attrs["scene"]):
        for peak, angle in zip(response.peak_contact_force, response.peak_angle, strict=True):
            assert labels.quantity(float(peak), "N") in told
            assert f"{np.degrees(float(angle)):.0f} deg" in told

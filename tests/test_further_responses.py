"""What a sample records on request: mean contact forces, crank moment, slider acceleration, and its energy balance."""

import numpy as np
import pytest
from running import HUNT_CROSSLEY, LATCHED, RIGID, scene_with

from hpcclear.base.objectives import RATE
from hpcclear.base.outcome import LEVELS, ON_REQUEST, RESPONSES, WIDEST
from hpcclear.dynamics.evaluation import evaluate_records
from hpcclear.dynamics.evaluation.evaluator import DEFAULT_LANES
from hpcclear.dynamics.response import simulate
from hpcclear.results import dataset
from hpcclear.results.names import KINDS
from hpcclear.scene.points import Points

NOTHING = Points((), np.empty((1, 0)), ())
STUDY = {
    "seed": 1,
    "variables": {"C": {"path": "joints.crank_rod.clearance", "range": [1e-4, 4e-4]}},
}
IDEAL = {"kind": "ideal"}
FREE = {"kind": "torque", "initial_speed": 523.6, "flywheel_inertia": 1e-2, "torque": 5.0}


def asking(changes: dict, objective: str = "mean-contact-force"):
    """One revolution left out, one averaged."""
    study = {**STUDY, "objective": objective}
    ideal = changes.get("joints.crank_rod") == IDEAL
    if ideal:
        study["variables"] = {"m": {"path": "mechanism.rod.mass", "range": [0.1, 1.0]}}
    scene = scene_with({"effects.contact": HUNT_CROSSLEY, **changes}, rtol=1e-9)
    return scene.with_({"study": study, "numerics.transient_revolutions": 1})


def integral(y: np.ndarray, x: np.ndarray) -> float:
    return float(0.5 * ((y[1:] + y[:-1]) * np.diff(x)).sum())


@pytest.mark.parametrize(
    "changes",
    [
        pytest.param({}, id="two open"),
        pytest.param({"effects.contact": LATCHED}, marks=pytest.mark.full, id="latched"),
        pytest.param({"joints.crank_rod": IDEAL}, marks=pytest.mark.full, id="O23 open"),
        pytest.param({"joints.rod_slider": IDEAL}, marks=pytest.mark.full, id="O12 open"),
        pytest.param({"drive": FREE}, marks=pytest.mark.full, id="torque drive"),
        pytest.param({"numerics.formulation": "baumgarte"}, marks=pytest.mark.full, id="baumgarte"),
        pytest.param({"numerics.method": "radau"}, marks=pytest.mark.full, id="radau"),
        pytest.param(
            {**RIGID, "drive": FREE}, marks=pytest.mark.full, id="torque drive, no clearance"
        ),
        pytest.param(RIGID, id="no clearance"),
    ],
)
def test_responses_of_a_sample_are_those_of_its_time_series(changes):
    scene = asking(changes)
    record = evaluate_records(scene, NOTHING, lanes=1)[0]
    series = simulate(scene.with_({"output.instants_per_revolution": 20_000}))
    late = series.crank_angle.to_numpy() >= 2 * np.pi * (1 - 1e-12)
    time = series.time.to_numpy()[late]
    span = np.ptp(time)
    force = series.contact_force.to_numpy()[late]
    for joint in range(2):
        mean = integral(force[:, joint], time) / span
        assert record["mean_contact_force"][joint] == pytest.approx(mean, rel=1e-4)
    moment = np.abs(series.crank_moment.to_numpy()[late]).max()
    # A sample looks at the ends of its steps, the series at many more instants. A step may end nearer to the peak than any of
    # 20 000 instants: the moment follows contacts that swing some 11 times a radian, so these miss (11 * 3.1e-4 / 2)^2 / 2.
    assert moment * 0.97 < record["peak_crank_moment"] <= moment * (1 + 3e-6)
    a = series.slider_acceleration.to_numpy()[late]
    mean = integral(a, time) / span
    deviation = np.sqrt(integral((a - mean) ** 2, time) / span)
    assert record["slider_acceleration_deviation"] == pytest.approx(deviation, rel=1e-4)


@pytest.mark.parametrize("objective", ["mean-gap", "peak-contact-force"])
def test_what_is_not_asked_for_is_not_a_number_and_not_in_the_file(objective):
    records = evaluate_records(asking({}, objective), NOTHING, lanes=1)
    assert not set(ON_REQUEST) & set(records.dtype.names)
    content = dataset.samples_dataset((), np.empty((1, 0)), {}, records)
    assert not set(ON_REQUEST) & set(content.data_vars)
    assert dataset.records(content).tobytes() == records.tobytes()


WORN = {"joints.crank_rod.wear": {"length": 0.02, "journal": {"coefficient": 1e-15}}}


def test_what_is_asked_for_is_in_the_file():
    everything = {
        "numerics.energy": True,
        "numerics.impacts": True,
        **WORN,
        "wear": {"profile": "angular"},
    }
    records = evaluate_records(asking(everything), NOTHING, lanes=1)
    content = dataset.samples_dataset((), np.empty((1, 0)), {}, records)
    # no point is followed, no level asked for, f has no rate of its own, and the contact no pressure
    left_out = {RATE, *LEVELS, *WIDEST}
    asked_for = {name for name in ON_REQUEST if "point" not in name} - left_out
    assert left_out.isdisjoint(content.data_vars)
    assert asked_for <= set(content.data_vars) <= set(KINDS["samples"].data)
    assert dataset.records(content).tobytes() == records.tobytes()


def test_a_failed_sample_has_no_responses():
    scene = asking({"numerics.max_steps": 100, "numerics.energy": True})
    records = evaluate_records(scene, NOTHING, lanes=1)
    assert records["status"][0] != 0
    assert all(np.isnan(records[name]).all() for name in (*RESPONSES, "energy_error"))


@pytest.mark.parametrize(
    "changes",
    [
        pytest.param({"effects.contact": LATCHED}, id="latched"),
        pytest.param({}, marks=pytest.mark.full, id="smooth"),
        pytest.param({"drive": FREE}, marks=pytest.mark.full, id="torque"),
        pytest.param({"effects.gravity": 9.81}, marks=pytest.mark.full, id="gravity"),
        pytest.param({"numerics.formulation": "baumgarte"}, marks=pytest.mark.full, id="baumgarte"),
        pytest.param({"joints.rod_slider": IDEAL}, marks=pytest.mark.full, id="O12 open"),
    ],
)
def test_the_energy_balance_of_every_sample_closes(changes):
    scene = asking({**changes, "numerics.energy": True})
    clearances = np.linspace(1e-4, 4e-4, 40)[:, None]
    points = Points(("C",), clearances, (("joints.crank_rod.clearance",),))
    records = evaluate_records(scene, points, lanes=DEFAULT_LANES)
    assert (records["status"] == 0).all()
    assert (records["energy_error"] < 1e-7).all()
    assert (records["energy_error"] > 0).any()
    loose = evaluate_records(scene.with_({"numerics.rtol": 1e-4}), points, lanes=DEFAULT_LANES)
    assert np.median(loose["energy_error"]) > 30 * np.median(records["energy_error"])

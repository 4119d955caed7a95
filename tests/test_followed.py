"""A followed point of a linkage: acceleration against differences, path error against the play, records against the series."""

from pathlib import Path

import numpy as np
import pytest

from hpcclear import evaluate, load_scene, simulate
from hpcclear.base.errors import InputError
from hpcclear.dynamics.planar.problem import linkage_of

ROCKER = load_scene(Path(__file__).parent.parent / "jobs" / "linkages" / "crank_rocker.toml").with_(
    {"mechanism.followed": "coupler.tip", "numerics.responses": True, "numerics.rtol": 1e-7}
)
PLAYS = [f"mechanism.joints.{name}.clearance" for name in ROCKER.clearance_joints()]


def accelerations(response):
    """Of the series, x + iy, and by differences of the places."""
    told = response["followed_acceleration_x"] + 1j * response["followed_acceleration_y"]
    place, time = response["followed_x"] + 1j * response["followed_y"], response["time"].to_numpy()
    differences = np.gradient(np.gradient(place.to_numpy(), time), time)
    return told.to_numpy(), differences


@pytest.mark.parametrize("formulation", ["minimal", "baumgarte"])
def test_a_followed_point_accelerates_as_its_places_say(formulation):
    scene = ROCKER.with_(
        {
            "numerics.formulation": formulation,
            "numerics.method": "tsitouras",
            "numerics.transient_revolutions": 0,
            "numerics.averaged_revolutions": 1,
            "output.instants_per_revolution": 20_000,
        }
    )
    response = simulate(scene)
    told, differences = accelerations(response)
    scale = np.sqrt(np.mean(np.abs(told) ** 2))
    # The median: where a contact begins or ends differences smear its corner.
    assert np.median(np.abs(told - differences)) < 1e-3 * scale
    mass = "mechanism.bodies.rocker.mass"
    record = evaluate(scene, {mass: [scene.number(mass)]})
    time = response["time"].to_numpy()
    mean, square = (np.trapezoid(one, time) / time[-1] for one in (told, np.abs(told) ** 2))
    # The motion rattles: single response and sample are the same to what it is well-posed to.
    deviation = float(record["point_acceleration_deviation"][0])
    assert deviation == pytest.approx(np.sqrt(square - abs(mean) ** 2), rel=0.02)
    peak = float(record["peak_point_acceleration"][0])
    assert peak == pytest.approx(np.abs(told).max(), rel=0.02)
    assert "slider_acceleration_deviation" not in record


def test_a_point_leaves_its_path_by_no_more_than_play_allows():
    """The less play the less; the rest is what the contacts give way."""
    for play in (1e-4, 1e-6):
        response = simulate(ROCKER.with_(dict.fromkeys(PLAYS, play)))
        off = response["path_error"].to_numpy()
        assert 0.1 * play < off.max() < 10 * play + 2e-5


def test_the_path_of_a_crank_under_a_torque_begins_where_the_crank_does():
    motor = {"kind": "torque", "body": "crank", "torque": 0.5, "initial_speed": 60.0}
    free = {"mechanism.drives": {"motor": {**motor, "flywheel_inertia": 1e-2}}, "study": None}
    response = simulate(ROCKER.with_({**dict.fromkeys(PLAYS, 1e-6), **free}))
    assert response["path_error"].to_numpy().max() < 3e-5


def test_a_point_has_no_path_where_a_drive_does_not_repeat_without_play():
    """A fan on a torque of its own keeps no time: simulated, and without a path error."""
    fan = {
        "mechanism.bodies.fan": {"length": 0.03, "mass": 0.05, "inertia": 4e-6},
        "mechanism.joints.fan": {"kind": "revolute", "journal": "fan.a", "bearing": "ground.o"},
        "mechanism.drives.motor.period": True,
        "mechanism.drives.fan": {"kind": "torque", "body": "fan", "torque": 0.1, "initial_speed": 77.0},
        "study": None,
    }  # fmt: skip
    response = simulate(ROCKER.with_({**dict.fromkeys(PLAYS, 1e-4), **fan}))
    assert "followed_x" in response
    assert "path_error" not in response


def test_without_play_the_point_stays_on_its_path():
    pins = {
        f"mechanism.joints.{name}": {"kind": "revolute", "journal": joint.journal, "bearing": joint.bearing}
        for name in ROCKER.clearance_joints()
        for joint in [next(j for j in ROCKER.mechanism.joints if j.name == name)]
    }  # fmt: skip
    ideal = ROCKER.with_(
        {
            **pins,
            "effects.contact": None,
            "effects.friction": {"law": "none"},
            "study": None,
            "output.instants_per_revolution": 4000,
        }
    )
    told, differences = accelerations(simulate(ideal))
    inside = slice(2, -2)
    np.testing.assert_allclose(
        told[inside], differences[inside], rtol=0, atol=1e-4 * abs(told).max()
    )


def test_what_is_not_followed_is_refused_as_an_objective():
    with pytest.raises(InputError, match="is no point of a body"):
        ROCKER.with_({"mechanism.followed": "coupler.top"})
    study = ROCKER.with_({"study.objective": "peak-point-acceleration"})
    linkage_of(study)
    with pytest.raises(InputError, match="no point is followed"):
        linkage_of(study.with_({"mechanism.followed": None}))
    with pytest.raises(InputError, match="has a followed point"):
        linkage_of(study.with_({"study.objective": "slider-acceleration-deviation"}))

"""A torque that falls with the speed, as a motor's does: an independent integration, energy, a speed that it settles at."""

import numpy as np
import pytest
from running import scene_with
from scipy.integrate import solve_ivp
from test_linkage_scenes import slider_crank_pair
from test_rest import IDEAL, reduced_inertia

from hpcclear.base.errors import InputError
from hpcclear.base.outcome import Regime
from hpcclear.dynamics.evaluation import evaluate_records
from hpcclear.dynamics.response import simulate
from hpcclear.scene.describing import effects_on
from hpcclear.scene.points import Points

MOTOR = {
    "kind": "torque", "torque": 8.0, "no_load_speed": "1500 rpm", "flywheel_inertia": 2e-3,
    "initial_speed": 0.0, "expected_speed": "1000 rpm",
}  # fmt: skip
NOTHING = Points((), np.empty((1, 0)), ())


def driven(changes=None, revolutions=3, **drive):
    return scene_with({"drive": MOTOR | drive, **(changes or {})}, revolutions)


def run_up(scene, angle):
    """Time and speed when the crank has turned so far: J w dw/dangle + J' w^2 / 2 = T (1 - w / w0), by scipy, from rest."""
    torque, fastest = scene.drive.torque, scene.drive.no_load_speed

    def rates(t, y):
        step = 1e-5
        slope = (reduced_inertia(scene, y[0] + step) - reduced_inertia(scene, y[0] - step)) / (
            2 * step
        )
        force = torque * (1 - y[1] / fastest) - 0.5 * slope * y[1] ** 2
        return y[1], force / reduced_inertia(scene, y[0])

    def there(t, y):
        return y[0] - angle

    there.terminal = True
    found = solve_ivp(rates, (0, 100), (0, 0), "DOP853", events=there, rtol=1e-11, atol=1e-12)
    return found.t[-1], found.y[1, -1]


@pytest.mark.parametrize("formulation", ["minimal", "baumgarte"])
def test_a_run_up_is_that_of_the_reduced_inertia(formulation):
    scene = driven({"effects.gravity": 0.0, "numerics.formulation": formulation, **IDEAL})
    response = simulate(scene)
    seconds, speed = run_up(scene, 6 * np.pi)
    assert float(response["time"][-1]) == pytest.approx(seconds, rel=1e-7)
    assert float(response["crank_speed"][-1]) == pytest.approx(speed, rel=1e-7)


@pytest.mark.parametrize("formulation", ["minimal", "baumgarte"])
@pytest.mark.parametrize("torque", [8.0, [[0.0, 10.0], [np.pi, 4.0], [2 * np.pi, 10.0]]])
@pytest.mark.shortened(2)
def test_with_play_the_energy_closes_and_an_ensemble_says_the_same(formulation, torque):
    scene = driven({"numerics.formulation": formulation}, torque=torque)
    response = simulate(scene)
    off = np.abs(response["energy_residual"]).max() / np.abs(response["kinetic_energy"]).max()
    assert off < 1e-7
    # one lane and many may round differently, which impacts multiply
    found = evaluate_records(scene, NOTHING)["objective"][0]
    assert found == pytest.approx(float(response["objective"]), rel=1e-4)


def test_a_linkage_is_driven_alike():
    ours, theirs = slider_crank_pair()
    # Impacts multiply what the two texts round differently: at 1e-9 it is 3e-6, a tenth of the tolerance's own 2e-5.
    tight = {"numerics.rtol": 1e-11}
    one = simulate(ours.with_({"drive": MOTOR, **tight}))
    other = simulate(theirs.with_({"mechanism.drives.motor": MOTOR | {"body": "crank"}, **tight}))
    for name in ("objective", "crank_speed", "time"):
        found = np.ravel(other[name])[-1]
        assert found == pytest.approx(np.ravel(one[name])[-1], rel=1e-6)


def test_its_speed_settles_and_then_there_is_a_steady_mean():
    """Without friction and play nothing else ends the run-up: with a constant torque there is none."""
    smooth = {**IDEAL, "effects.gravity": 0.0}
    response = simulate(driven(smooth, 60))
    fastest = driven().drive.no_load_speed
    turn = response["crank_speed"].to_numpy()[-720:]  # the last revolution
    assert abs(np.mean(turn) / fastest - 1.0) < 0.05
    steady = simulate(driven({"numerics.target_error": 1e-2}))
    assert Regime(int(steady["regime"])) is Regime.REGULAR
    assert float(steady["objective_limit"]) <= 1e-2 * float(steady["objective"])


def test_it_can_be_varied_and_is_told():
    speeds = np.array([[120.0], [150.0], [180.0]])
    points = Points(("fastest",), speeds, (("drive.no_load_speed",),))
    found = evaluate_records(driven(), points)
    for speed, record in zip(speeds[:, 0], found, strict=True):
        alone = evaluate_records(driven(no_load_speed=float(speed)), NOTHING)[0]
        assert record["objective"] == alone["objective"]
    assert any("falling with speed" in line for line in effects_on(driven()))
    with pytest.raises(InputError, match="no_load_speed"):
        driven(no_load_speed=0.0)
    with pytest.raises(InputError, match="no_load_speed"):
        scene_with({"drive": {"kind": "constant-speed", "speed": 100.0, "no_load_speed": 1.0}}, 1)

"""A torque drive that starts from rest: closed forms, energy, impacts that throw back, and what never gets going."""

import numpy as np
import pytest
from running import scene_with
from scipy.integrate import quad
from test_linkage_scenes import slider_crank_pair

from hpcclear.base.errors import InputError
from hpcclear.base.outcome import Status
from hpcclear.dynamics.evaluation import evaluate_records
from hpcclear.dynamics.response import simulate
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.start import start_states
from hpcclear.scene.points import Points, check_points

REST = {"kind": "torque", "torque": 5.0, "initial_speed": 0.0, "expected_speed": "1000 rpm"}
IDEAL = {
    "joints.crank_rod": {"kind": "ideal"}, "joints.rod_slider": {"kind": "ideal"},
    "effects.friction": {"law": "none"},
}  # fmt: skip
LIGHT = {
    "mechanism.crank.inertia": 1e-6, "mechanism.crank.mass": 1e-3, "mechanism.crank.mass_center": 0.0,
    "joints.crank_rod.clearance": "1 mm",
}  # fmt: skip


def from_rest(changes=None, revolutions=2, **drive):
    return scene_with({"drive": REST | drive, **(changes or {})}, revolutions)


def reduced_inertia(scene, angle):
    """Twice the kinetic energy at unit crank speed, kg m2, by the slider-crank's textbook formulas."""
    m = scene.slider_crank
    r, length, u = m.crank.length, m.rod.length, m.rod.mass_center
    lean = np.arcsin(-r * np.sin(angle) / length)
    spin = -r * np.cos(angle) / (length * np.cos(lean))
    x = -r * np.sin(angle) - u * np.sin(lean) * spin
    y = r * np.cos(angle) + u * np.cos(lean) * spin
    slider = -r * np.sin(angle) - length * np.sin(lean) * spin
    crank = m.crank.inertia + m.crank.mass * m.crank.mass_center**2 + scene.drive.flywheel_inertia
    rod = m.rod.mass * (x**2 + y**2) + m.rod.inertia * spin**2
    return crank + rod + m.slider.mass * slider**2


def test_the_time_of_a_run_up_is_that_of_the_reduced_inertia():
    """Without play and gravity T angle = J(angle) w^2 / 2, and so t = integral of sqrt(J / (2 T angle)) over the angle."""
    scene = from_rest({"effects.gravity": 0.0, **IDEAL}, 3, flywheel_inertia=1e-3)
    response = simulate(scene)
    turned = 3 * 2 * np.pi
    assert response["crank_angle"].to_numpy()[-1] == pytest.approx(turned, rel=1e-10)
    speed = np.sqrt(2 * 5.0 * turned / reduced_inertia(scene, turned))
    assert float(response["crank_speed"][-1]) == pytest.approx(speed, rel=1e-7)
    # angle = u^2 takes the root out of it
    seconds, _ = quad(
        lambda u: np.sqrt(2 * reduced_inertia(scene, u * u) / 5.0),
        0.0, np.sqrt(turned), epsrel=1e-10, limit=400,
    )  # fmt: skip
    assert float(response["time"][-1]) == pytest.approx(seconds, rel=1e-7)


@pytest.mark.parametrize("formulation", ["minimal", "baumgarte"])
def test_with_play_the_energy_closes_and_an_ensemble_says_the_same(formulation):
    pair = {"numerics.formulation": formulation, "numerics.method": "tsitouras"}
    scene = from_rest(pair, flywheel_inertia=1e-2)
    response = simulate(scene)
    assert float(response["crank_speed"][0]) == 0.0
    off = np.abs(response["energy_residual"]).max() / np.abs(response["kinetic_energy"]).max()
    assert off < 1e-7
    records = evaluate_records(scene, Points((), np.empty((1, 0)), ()))
    assert records["objective"][0] == float(response["objective"])


def test_a_light_crank_is_thrown_back_and_goes_on():
    response = simulate(from_rest(LIGHT))
    assert int(response["status"]) == Status.OK
    assert float(response["crank_speed"].min()) < -100.0
    assert np.abs(response["energy_residual"]).max() < 1e-7 * response["kinetic_energy"].max()


@pytest.mark.parametrize(
    ("torque", "gravity"), [(-1.0, 9.81), (1e-3, 9.81), (0.0, 0.0)],
    ids=["the wrong way", "too weak", "nothing moves"],
)  # fmt: skip
def test_what_does_not_get_going_has_stalled(torque, gravity):
    response = simulate(from_rest({**LIGHT, "effects.gravity": gravity}, torque=torque))
    assert int(response["status"]) == Status.STALLED
    assert np.isnan(float(response["objective"]))


def test_a_linkage_starts_from_rest_like_the_slider_crank():
    known, linkage = slider_crank_pair()
    drive = REST | {"flywheel_inertia": 1e-2}
    known = known.with_({"drive": drive})
    linkage = linkage.with_({"mechanism.drives.motor": drive | {"body": "crank"}})
    f, speeds = zip(
        *(
            (float(response["objective"]), response["crank_speed"].to_numpy()[-1])
            for response in (simulate(known), simulate(linkage))
        ),
        strict=True,
    )
    # a millionth of a millionth more flywheel moves either f by up to 1.1e-5: what differs in the last digit does as much
    assert f[0] == pytest.approx(f[1], rel=3e-5)
    assert speeds[0] == pytest.approx(speeds[1], rel=1e-6)


def test_a_variable_may_go_down_to_rest_where_a_speed_is_expected():
    points = Points(("w",), np.array([[0.0], [50.0]]), (("drive.initial_speed",),))
    moving = from_rest(initial_speed=40.0, expected_speed=None, flywheel_inertia=1e-2)
    with pytest.raises(
        InputError, match=r"starts from rest, and drive\.expected_speed is not given"
    ):
        check_points(moving, points)
    expecting = from_rest(initial_speed=40.0, flywheel_inertia=1e-2)
    check_points(expecting, points)
    found = evaluate_records(expecting, points)["objective"]
    for row, speed in enumerate((0.0, 50.0)):
        alone = from_rest(initial_speed=speed, flywheel_inertia=1e-2)
        assert (
            found[row] == evaluate_records(alone, Points((), np.empty((1, 0)), ()))["objective"][0]
        )


@pytest.mark.parametrize("drive", [{}, {"initial_speed": 40.0, "expected_speed": None}])
def test_several_designs_start_alike_where_no_points_say_otherwise(drive):
    """As `hpcclear accuracy` asks for them."""
    scene = from_rest(**drive)
    par = parameters(scene)
    one, three = start_states(scene, par), start_states(scene, np.repeat(par, 3, axis=0))
    np.testing.assert_array_equal(three.rows, np.repeat(one.rows, 3, axis=0))
    # from a least-squares solution of all joints and drives
    assert one.velocities(5)[0, 4] == pytest.approx(scene.drive.initial_speed, rel=1e-14)

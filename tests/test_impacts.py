"""Measures of impact and noise, against what is known otherwise.

Energy lost in impacts against the energy balance, counts against a dense series, the force on the frame against the momentum of
the bodies, third-octave levels against scipy.signal."""

import inspect

import numpy as np
import pytest
from running import HUNT_CROSSLEY, LATCHED, SCENE, scene_with
from scipy import signal
from scipy.integrate import simpson

from hpcclear import evaluate, load_scene, simulate
from hpcclear.base.objectives import OURS
from hpcclear.base.outcome import IMPACTS
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.setup.problem import effects_of, problem_of
from hpcclear.statistics import spectra

LOOSE = {"law": "hunt-crossley", "damping": 0.05}
REPEATED = {"mechanism.slider.mass": [load_scene(SCENE).mechanism.slider.mass]}
SLIPPERY = {"effects.friction": {"law": "none"}}
ONE = {"mechanism.rod.mass": [0.2]}
DENSE = 20_000


def light(changes=None, law=LOOSE, averaged=2):
    """A scene without friction whose joints lose contact: one revolution left out."""
    scene = scene_with({"effects.contact": law, **SLIPPERY, **(changes or {})}, rtol=1e-9)
    numerics = {"transient_revolutions": 1, "averaged_revolutions": averaged, "impacts": True}
    return scene.with_({f"numerics.{key}": value for key, value in numerics.items()})


@pytest.fixture(scope="module")
def dense():
    return simulate(light({"output.instants_per_revolution": DENSE, "effects.gravity": 9.81}))


def test_energy_lost_in_impacts_closes_with_the_energy_balance(dense):
    ends = slice(DENSE, None, DENSE)
    lost = dense["impact_energy_by_revolution"].sum("joint").to_numpy()
    stored = sum(dense[f"{kind}_energy"] for kind in ("kinetic", "elastic", "potential"))
    given = np.diff(dense["driving_work"].to_numpy()[ends])
    np.testing.assert_allclose(given - np.diff(stored.to_numpy()[ends]), lost, rtol=1e-6)
    assert (lost > 0.1).all()


@pytest.mark.parametrize(
    "changes",
    [
        pytest.param({}, id="explicit"),
        pytest.param({"numerics.method": "radau"}, marks=pytest.mark.full, id="implicit"),
        pytest.param({"effects.contact": LATCHED}, marks=pytest.mark.full, id="latched"),
        pytest.param(
            {"drive": {"kind": "torque", "initial_speed": 523.6, "flywheel_inertia": 1e-2, "torque": 5.0}},
            marks=pytest.mark.full, id="torque drive",
        ),
    ],
)  # fmt: skip
def test_samples_and_responses_measure_the_same(changes):
    """Counts are those of the series at so many instants, angles are within two of these at both ends of a flight."""
    scene = light({"output.instants_per_revolution": DENSE, **changes})
    found, sample = simulate(scene), evaluate(scene, REPEATED).isel(sample=0)
    for name in IMPACTS:
        np.testing.assert_allclose(found[name], sample[name], rtol=1e-7, err_msg=name)
    touches = found["penetration"].to_numpy()[DENSE:] > 0.0
    begun = (touches[1:] & ~touches[:-1]).sum(axis=0)
    np.testing.assert_array_equal(found["impacts_by_revolution"].sum("revolution"), begun)
    assert begun.max() > 0
    flown = 2 * np.pi * (~touches[:-1]).mean(axis=0)
    np.testing.assert_allclose(
        found["contact_loss"], flown, atol=(begun.max() + 1) * 2 * np.pi / DENSE
    )
    force = found["contact_force"].to_numpy()[DENSE:]
    time = found["time"].to_numpy()[DENSE:]
    impulse = simpson(force, x=time, axis=0) / 2
    np.testing.assert_allclose(found["contact_impulse"], impulse, rtol=1e-5)
    square = simpson(force**2, x=time, axis=0) / np.ptp(time)
    np.testing.assert_allclose(found["rms_contact_force"] ** 2, square, rtol=1e-4)


def test_the_force_on_the_frame_is_the_change_of_momentum(dense):
    """Of crank, rod and slider, whose mass centres move as their positions say; weight included."""
    scene = light({"effects.gravity": 9.81})
    crank, rod, slider = (scene.mechanism.crank, scene.mechanism.rod, scene.mechanism.slider)
    time, w = dense["time"].to_numpy(), scene.drive.speed
    x = crank.mass * crank.mass_center * np.cos(dense["crank_angle"].to_numpy())
    y = crank.mass * crank.mass_center * np.sin(dense["crank_angle"].to_numpy())
    x = x + rod.mass * dense["rod_x"].to_numpy()
    x = x + slider.mass * dense["slider_position"].to_numpy()
    y = y + rod.mass * dense["rod_y"].to_numpy()
    for name, moment, weight in (
        ("frame_force_x", x, 0.0),
        ("frame_force_y", y, 9.81 * (crank.mass + rod.mass + slider.mass)),
    ):
        force = dense[name].to_numpy()
        # twice integrated over stretches of 2000 instants, which no derivative blurs
        for first in range(0, 2 * DENSE, 2000):
            part = slice(first, first + 2001)
            t = time[part] - time[first]
            weights = np.minimum(t, t[-1] - t)  # a hat: the second difference of the position
            expected = -(moment[first] - 2 * moment[first + 1000] + moment[first + 2000])
            found = simpson(weights * (force[part] + weight), x=t)
            scale = (crank.mass + rod.mass + slider.mass) * crank.length * (w * t[-1]) ** 2
            assert abs(found - expected) < 1e-6 * scale


def test_third_octave_levels_are_those_of_scipy_on_a_dense_series():
    """A motion that repeats itself, at 720 instants a revolution, against a periodogram of 16 times as many."""
    scene = scene_with({"effects.contact": HUNT_CROSSLEY, **SLIPPERY}, rtol=1e-9).with_(
        {"numerics.transient_revolutions": 12, "numerics.averaged_revolutions": 4}
    )
    found = simulate(scene)
    many = simulate(scene.with_({"output.instants_per_revolution": 16 * 720}))
    rate = 16 * 720 * 4 / (many["time"].to_numpy()[-1] - many["time"].to_numpy()[12 * 16 * 720])
    power = 0.0
    for axis in "xy":
        values = many[f"frame_force_{axis}"].to_numpy()[12 * 16 * 720 : -1]
        frequencies, density = signal.periodogram(values, rate, scaling="spectrum")
        power = power + density
    for centre, level in zip(
        found["band"].to_numpy(), found["frame_force_level"].to_numpy(), strict=True
    ):
        edges = centre * 10.0**-0.05, centre * 10.0**0.05
        inside = (frequencies >= edges[0]) & (frequencies < edges[1])
        expected = 10 * np.log10(power[inside].sum() / 1e-12)
        assert abs(level - expected) < 0.1 if np.isfinite(level) else expected < 100.0
    total = (found["frame_force_orders"] ** 2).sum()
    assert float(np.sqrt(total)) == pytest.approx(float(found["rms_frame_force"]), rel=1e-5)
    width = found["frame_force_level_upper"] - found["frame_force_level_lower"]
    assert float(width.max()) < 1e-3
    assert float(found["rms_frame_force_limit"]) < 1e-6 * float(found["rms_frame_force"])


def test_half_widths_hold_as_often_as_they_say():
    """Of independent revolutions, fewer and more than there are batches; of too few there is none."""
    rng = np.random.default_rng(5)
    for count in (5, 137):
        values = rng.exponential(1.0, (count, 4000))
        if count == 5:
            values = rng.normal(1.0, 1.0, (count, 4000))
        held = np.abs(values.mean(axis=0) - 1.0) <= spectra.half_width(values)
        assert 0.93 < held.mean() < 0.97
    assert np.isnan(spectra.half_width(np.ones((3, 2)))).all()


@pytest.mark.parametrize("name", ["impacts", "impact-energy", "rms-frame-force", "contact-loss"])
def test_each_measure_is_an_objective_and_asks_for_itself(name):
    scene = light().with_({"numerics.impacts": False, "numerics.objective": name})
    found = evaluate(scene, ONE)
    field = name.replace("-", "_")
    values = found[field].to_numpy().ravel()
    expected = values.sum() if name == "impact-energy" else values.max()
    assert float(found["objective"][0]) == expected
    assert OURS[name].unit == found["objective"].attrs["units"].replace("1", "")


def test_what_is_not_asked_for_is_not_compiled():
    scene = light().with_({"numerics.impacts": False})
    problem = problem_of(scene)
    assert effects_of(scene).impacts is None
    text = inspect.getsource(problem.linkage.module(problem.effects))
    assert "frame_x" not in text
    measured = effects_of(scene, impacts=True)
    assert "frame_x" in inspect.getsource(problem.linkage.module(measured))
    names = {at.FRAME_X, at.BEGUN, at.IMPACT_POWERS}
    assert names.isdisjoint(at.measures_of(problem.effects))
    assert at.rules_of(problem.effects).impacts == 0
    assert set(IMPACTS).isdisjoint(evaluate(scene, ONE).data_vars)

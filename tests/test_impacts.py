"""Measures of impact and noise, against what is known otherwise.

Energy lost in impacts against the energy balance, counts against a dense series, the force on the frame against the momentum of
the bodies, third-octave levels against scipy.signal."""

import math
from pathlib import Path

import numpy as np
import pytest
from margins import at_most, bootstrap
from running import HUNT_CROSSLEY, LATCHED, SCENE, scene_with
from scipy import signal
from scipy.integrate import simpson

from hpcclear import evaluate, load_scene, simulate
from hpcclear.base.errors import InputError
from hpcclear.base.objectives import OURS
from hpcclear.base.outcome import IMPACTS
from hpcclear.ensemble.simulate import content_of
from hpcclear.statistics import spectra

COMPRESSOR = Path(__file__).parents[1] / "jobs" / "compressor.toml"
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
        {"numerics.transient_revolutions": 12, "numerics.averaged_revolutions": 14}
    )
    found = simulate(scene)
    many = simulate(scene.with_({"output.instants_per_revolution": 16 * 720}))
    rate = 16 * 720 * 14 / (many["time"].to_numpy()[-1] - many["time"].to_numpy()[12 * 16 * 720])
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


def test_levels_of_a_motion_that_does_not_repeat_are_those_of_welch():
    """A broad-band force and a tone between two orders, at bands from 3 to 100 orders; instants that fold nothing."""
    rng = np.random.default_rng(3)
    count, size = 400, 1024
    t = np.arange(count * size) / size  # in revolutions
    force = signal.lfilter([1.0], [1.0, -0.9], rng.normal(size=count * size))
    force += 3.0 * np.sin(2 * np.pi * 50.4 * t)
    turns = force.reshape(count, size, 1)
    windows = np.stack([spectra.orders(turns[k : k + 3])[:, 0] for k in range(count - 2)])
    centres = spectra.band_centres(3.0, 100.0)
    found, lower, upper = spectra.levels(spectra.in_bands(windows, np.ones(len(windows)), centres))
    frequencies, density = signal.welch(force, size, nperseg=16 * size)
    inside = 0
    for centre, level, low, high in zip(centres, found, lower, upper, strict=True):
        edges = centre * 10.0**-0.05, centre * 10.0**0.05  # those of its orders
        orders = np.arange(math.ceil(edges[0]), math.ceil(edges[1]))
        if not len(orders):
            continue
        band = (frequencies >= orders[0] - 0.5) & (frequencies < orders[-1] + 0.5)
        expected = 10 * np.log10(density[band].sum() / 16 / 1e-12)
        assert abs(level - expected) < 0.25
        inside += low - 0.1 <= expected <= high + 0.1
    assert inside >= 12


def test_levels_do_not_depend_on_the_instants_that_are_stored(shift):
    """A chaotic compressor with short impacts: next to nothing of what they have beyond half the rate is folded.

    What is, falls on bands by chance: half of the loud ones differ by less than 0.02 dB (0.05 dB with half of the
    `OVERSAMPLING`, 2 to 6 dB without), a few by 0.25 dB.
    """
    scene = load_scene(COMPRESSOR).with_({"numerics.averaged_revolutions": 3})
    clearance = scene.number("joints.crank_rod.clearance")
    found = {"frame_force_level": [], "contact_force_level": []}
    for k in range(3):  # motions that part
        other = {"joints.crank_rod.clearance": clearance * (1.0 + 1e-4 * (k + shift))}
        few, many = (
            simulate(
                scene.with_({**other, "output.instants_per_revolution": instants}), checked=False
            )
            for instants in (360, 1440)
        )
        for name, differences in found.items():
            one, same = few[name], many[name].sel(band=few["band"].to_numpy(), method="nearest")
            loud = (one > one.max("band") - 40.0).to_numpy()
            assert loud.sum() > 12
            differences.append(abs(one.to_numpy() - same.to_numpy())[loud])
    for differences in found.values():
        at_most(bootstrap(np.median, np.concatenate(differences), side="lower"), 0.02)


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


def test_half_widths_of_levels_hold_as_often_as_they_say():
    """Of white forces, whose windows of three revolutions overlap: an order's mean square is known."""
    rng = np.random.default_rng(6)
    held = []
    for _ in range(60):
        turns = rng.normal(size=(30, 16, 20))
        windows = np.stack([spectra.orders(turns[k : k + 3]) for k in range(28)])
        mean, reach = windows.mean(axis=0), spectra.half_width(windows, spectra.WINDOW)
        held.append(np.abs(mean - 2.0 / 16) <= reach)
    assert 0.91 < np.mean(held) < 0.97


@pytest.mark.parametrize("name", ["impacts", "impact-energy", "rms-frame-force", "contact-loss"])
def test_each_measure_is_an_objective_and_asks_for_itself(name):
    scene = light().with_({"numerics.impacts": False, "numerics.objective": name})
    found = evaluate(scene, ONE)
    field = name.replace("-", "_")
    values = found[field].to_numpy().ravel()
    expected = values.sum() if name == "impact-energy" else values.max()
    assert float(found["objective"][0]) == expected
    assert OURS[name].unit == found["objective"].attrs["units"].replace("1", "")


LEVELS = ("frame_force_level", "contact_force_level")
"""Fields of the bands."""


@pytest.fixture(scope="module")
def heard():
    """The compressor over eight revolutions in two bands, at two clearances, and its response at the first."""
    clearance = "joints.crank_rod.clearance"
    scene = load_scene(COMPRESSOR).with_(
        {
            "numerics.transient_revolutions": 2, "numerics.averaged_revolutions": 14,
            "numerics.levels": [1000.0], "numerics.objective": "contact-force-level-at-2kHz", clearance: 3e-5,
        }
    )  # fmt: skip
    return scene, evaluate(scene, {clearance: [3e-5, 6e-5]}), simulate(scene)


def test_a_sample_has_the_levels_of_its_response(heard):
    _, samples, response = heard
    assert samples["band"].to_numpy() == pytest.approx([1000.0, 1000.0 * 10**0.3])
    for name in LEVELS:
        alone = response[name].sel(band=samples["band"], method="nearest").transpose(..., "band")
        np.testing.assert_array_equal(samples[name][0], alone)
        reach = (response[f"{name}_upper"] - response[name]).sel(
            band=samples["band"], method="nearest"
        )
        np.testing.assert_allclose(
            samples[f"{name}_limit"][0], reach.transpose(..., "band"), rtol=1e-9
        )
        assert (samples[f"{name}_limit"] > 0.0).all()
    for name in IMPACTS:
        np.testing.assert_allclose(samples[name][0], response[name], rtol=1e-9)
        np.testing.assert_array_equal(samples[f"{name}_limit"][0], response[f"{name}_limit"])


def test_samples_recorded_side_by_side_are_those_recorded_alone(heard):
    scene, samples, _ = heard
    alone = evaluate(scene, {"joints.crank_rod.clearance": [6e-5]})
    for name in (*LEVELS, *(f"{one}_limit" for one in (*LEVELS, *IMPACTS))):
        np.testing.assert_array_equal(alone[name][0], samples[name][1])


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"numerics.levels": [20.0]}, "no multiple of the frequency"),
        ({"numerics.levels": [1e5], "drive.speed": 1.0}, "instants a revolution"),
    ],
)
def test_bands_that_the_drive_does_not_reach_are_refused(changes, words):
    with pytest.raises(InputError, match=words):
        evaluate(load_scene(COMPRESSOR).with_(changes), ONE)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"numerics.levels": [100.0 * 2**k for k in range(5)]}, "4"),
        ({"numerics.levels": [1e3], "numerics.target_error": 0.01}, "target_error"),
        ({"numerics.objective": "frame-force-level-at-1kHzz"}, "not a known objective"),
        ({"numerics.objective": "frame-force-level-at-0Hz"}, "from 1 to 100000 Hz"),
        ({"numerics.objective": f"contact-force-level-at-{'9' * 400}Hz"}, "from 1 to 100000 Hz"),
    ],
)
def test_levels_that_cannot_be_recorded_are_refused(changes, words):
    with pytest.raises(InputError, match=words):
        load_scene(COMPRESSOR).with_(changes)


def test_constraints_ask_for_the_measures_they_are_of(heard):
    """Ranks get what the study requires of each sample, whatever its objective is."""
    study = {
        "objective": "mean-gap",
        "variables": {
            "m": {"range": [0.2, 0.3], "paths": ["mechanism.slider.mass"]},
            "C": {"range": [3e-5, 6e-5], "paths": ["joints.crank_rod.clearance"]},
        },
        "random": {"C": {"distribution": "uniform", "range": [3e-5, 6e-5]}},
        "cases": {
            "quiet": {
                "random": ["C"],
                "objectives": ["mean"],
                "constraints": [
                    {"statistic": "mean", "of": "impact-energy", "most": "5 mJ"},
                    {"statistic": "mean", "of": "frame-force-level-at-1.25kHz", "most": 150.0},
                ],
            }
        },
    }
    scene = load_scene(COMPRESSOR).with_(
        {"study": study, "numerics.impacts": False, "numerics.objective": None}
    )
    numerics = content_of(scene)["numerics"]
    assert numerics["impacts"]
    assert numerics["levels"] == pytest.approx([1000.0 * 10**0.1])

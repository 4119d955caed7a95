"""Unknown clearances from measured signals: features, posterior, calibration, model check, the command and its page."""

import re
from functools import partial
from pathlib import Path

import numpy as np
import opened
import pytest
from click.testing import CliRunner
from doc_pages import ROOT
from refusals import refused
from test_compare import table

import hpcclear
from hpcclear.base.errors import InputError
from hpcclear.cli import cli
from hpcclear.ensemble import single
from hpcclear.identify import answer
from hpcclear.identify.advice import advice, noise_of
from hpcclear.identify.answer import identified as identified_dataset
from hpcclear.identify.features import Layout
from hpcclear.identify.history import DAY, history, seconds_of
from hpcclear.identify.inputs import Inputs
from hpcclear.identify.judgement import features_of, judged, prepare
from hpcclear.identify.made import write_made
from hpcclear.identify.measured import Measured, loaded, read_measured
from hpcclear.identify.posterior import sequential
from hpcclear.identify.settings import Settings
from hpcclear.identify.signals import ORDERS, Sensor, Spectrum, harmonics
from hpcclear.identify.training import Ensemble, prepared_scene
from hpcclear.report.identified import interval, lines, warnings
from hpcclear.results.content import Results
from hpcclear.results.signals import signals_in
from hpcclear.scene.streams import generator, sobol

SCENE = ROOT / "jobs" / "identify.toml"
UNKNOWN = "joints.crank_rod.clearance=10um:150um"
SHORT = ["numerics.transient_revolutions=3", "numerics.averaged_revolutions=10"]
SPEED = 50.0  # Hz


@pytest.fixture(scope="module")
def scene():
    return hpcclear.load_scene(SCENE, SHORT)


# -- signals ----------------------------------------------------------------------------------------


def wave(turns: np.ndarray) -> np.ndarray:
    angle = 2.0 * np.pi * turns
    return 3.0 + 2.0 * np.cos(angle - 0.4) + 0.5 * np.sin(7 * angle)


def test_harmonics_of_whole_revolutions_have_their_amplitudes_and_phases():
    turns = np.linspace(0.3, 6.1, 4000)
    found = harmonics(turns, wave(turns))
    assert found.shape == (5, ORDERS + 1)
    np.testing.assert_allclose(found[:, 0], 3.0, atol=1e-4)
    np.testing.assert_allclose(found[:, 1], 2.0 * np.exp(-0.4j), atol=1e-4)
    np.testing.assert_allclose(found[:, 7], -0.5j, atol=1e-4)
    np.testing.assert_allclose(found[:, 9], 0.0, atol=1e-4)


@pytest.mark.parametrize("gap", [(2.3, 2.37), (2.3, 4.1), (2.0, 3.0), (0.5, 0.9)])
def test_revolutions_with_a_gap_are_left_out(gap):
    turns = np.arange(1801) / 200
    kept = turns[(turns <= gap[0] + 1e-9) | (turns >= gap[1] - 1e-9)]
    found = harmonics(kept, wave(kept))
    assert len(found) == 9 - (int(np.ceil(gap[1])) - int(gap[0]))
    np.testing.assert_allclose(found[:, 1], 2.0 * np.exp(-0.4j), atol=5e-4)


def test_events_are_counted():
    turns = np.arange(0.0, 5.0, 1e-3) + 5e-4
    events = np.zeros(len(turns))
    events[::100] = 1.0  # ten a revolution
    found = harmonics(turns, events, count=True)
    np.testing.assert_allclose(found[:, 0].real, 10.0, rtol=0.11)


def test_a_table_is_read_by_angle_or_by_time_whose_frequency_is_found(tmp_path):
    time = np.arange(0.0, 0.5, 2e-4)
    true = 1.012 * SPEED  # the machine runs faster than its scene
    values = wave(true * time)
    degrees = np.mod(360.0 * true * time, 360.0)
    by_angle = table(tmp_path / "a.csv", {"crank_angle [deg]": degrees, "torque [N m]": values})
    by_time = table(tmp_path / "t.csv", {"time [s]": time, "torque [N m]": values})
    synchronised = read_measured(by_angle, "crank_moment", "N m", SPEED)
    free = read_measured(by_time, "crank_moment", "N m", SPEED)
    assert (synchronised.synchronised, free.synchronised) == (True, False)
    assert free.frequency == pytest.approx(true, rel=1e-4)
    assert synchronised.highest == free.highest == 39  # below 0.4 of the sampling rate
    for one in (synchronised, free):
        assert abs(one.spectrum.mean[1]) == pytest.approx(2.0, rel=2e-3)
        assert abs(one.spectrum.mean[7]) == pytest.approx(0.5, rel=2e-2)
    assert np.angle(synchronised.spectrum.mean[1]) == pytest.approx(-0.4, abs=1e-3)


def test_bad_tables_and_words_are_refused(tmp_path, scene):
    time = np.arange(0.0, 0.05, 1e-3)
    short = {"time [s]": time, "a [N m]": time, "b [N m]": time}
    blind = {"n": time, "crank_moment [N m]": time}
    slow = {"time [s]": 1e4 * time, "crank_moment [N m]": time**2}
    for columns, name, unit, reason in (
        (short, "crank_moment", "N m", "no column 'crank_moment'"),
        (short, "a", "N m", "2 whole revolutions"),
        (short, "a", "m/s^2", r"kg|unit"),
        (blind, "crank_moment", "N m", "neither time nor crank angle"),
        (slow, "crank_moment", "N m", "less than one each"),
    ):
        with pytest.raises(InputError, match=reason):
            read_measured(table(tmp_path / "s.csv", columns), name, unit, SPEED)
    turns = np.linspace(0.0, 10.0, 200)
    every = {"crank_angle [deg]": 360.0 * turns, "time [s]": turns / SPEED}
    every["crank_moment [N m]"] = turns
    for changed, reason in (
        ({"time [s]": turns / SPEED / 3.0}, "rpm, and the scene"),
        ({"time [s]": -turns}, "times do not rise"),
        ({"crank_moment [N m]": np.array(["OVR"] * 200), "speed [rpm]": turns}, "'OVR'"),
        ({"crank_moment": turns}, "has 2 columns"),
    ):
        path = table(tmp_path / "c.csv", every | changed)
        with refused(said=reason):
            read_measured(path, "crank_moment", "N m", SPEED)
    driven = table(tmp_path / "c.csv", every | {"time [s]": turns / SPEED / 1.2})
    assert read_measured(driven, "crank_moment", "N m", SPEED, given=False).frequency > 1.1 * SPEED
    by_271_degrees = {name: one[::15] for name, one in every.items()}
    rising = table(tmp_path / "r.csv", by_271_degrees)
    assert read_measured(rising, "crank_moment", "N m", SPEED).frequency == pytest.approx(SPEED)
    for words, reason in (
        ("joints.crank_rod.clearance", "is not PATH=LO:HI"),
        ("joints.crank_rod.clearance=2um:1um", "bounds are crossed"),
        ("joints.crank_rod.clearance=1um:5kg", "kg"),
        ("joints.crank_rod.clearanc=1um:5um", "clearanc"),
        ("joints.crank_rod.clearance=1um:30mm", "as large as the bearing"),
    ):
        with pytest.raises(InputError, match=reason):
            Inputs.of(scene, [words])
    with pytest.raises(InputError, match="two unknowns drive joints"):
        Inputs.of(scene, [UNKNOWN, UNKNOWN])
    with pytest.raises(InputError, match="no harmonic"):
        Layout.of(Measured("a", Spectrum(np.zeros(9), np.zeros(9), 5), True, SPEED, 9), Sensor((0.0, 40.0)))  # fmt: skip


def without_clearance(name: str, *joints: str, **tables: dict[str, str]):
    """A shipped scene whose joints are ideal, over one revolution."""
    scene = hpcclear.load_scene(ROOT / "jobs" / name).with_({"study": None})
    changes = {joint: tables.get(joint.rpartition(".")[2], {"kind": "ideal"}) for joint in joints}
    return scene.with_({**changes, "effects": {}, "numerics.averaged_revolutions": 1})


def test_a_point_of_a_linkage_has_an_acceleration():
    pins = {
        "o2": {"kind": "revolute", "journal": "crank.b", "bearing": "coupler.a"},
        "o3": {"kind": "revolute", "journal": "coupler.b", "bearing": "rocker.b"},
    }
    joints = ("mechanism.joints.o2", "mechanism.joints.o3")
    rigid = without_clearance("linkages/crank_rocker.toml", *joints, **pins)
    response = hpcclear.simulate(rigid)
    found = signals_in(Results.of(response))["acceleration_x crank.b"].values
    expected = -((2.0 * np.pi * 15.0) ** 2) * response["point_x"].sel(point="crank.b")
    np.testing.assert_allclose(found, expected, atol=1e-3 * float(np.abs(expected).max()))


def test_a_sensor_has_a_band_and_a_resonance():
    sensor = Sensor((100.0, 1000.0), resonance=2000.0, quality=10.0)
    response = sensor.response(np.array([0.0, 1000.0, 2000.0]))
    np.testing.assert_allclose(np.abs(response), [1.0, 1.3303, 10.0], rtol=1e-4)
    measured = Measured("slider_acceleration", Spectrum(np.zeros(65), np.zeros(65), 5), True, SPEED, 64)  # fmt: skip
    assert Layout.of(measured, sensor).orders == tuple(range(2, 21))


def test_a_measured_pressure_becomes_the_load_of_the_slider(tmp_path, scene):
    degrees = np.arange(0.0, 360.0 * 6.0, 0.5)
    pressure = 2.0 + np.cos(np.radians(degrees))
    place = table(tmp_path / "p.csv", {"crank_angle [deg]": degrees, "p [bar]": pressure})
    curve = np.array(loaded(scene, place, "p=10 cm2").effects.slider_load)
    np.testing.assert_allclose(curve[:, 1], -1e-3 * 1e5 * (2.0 + np.cos(curve[:, 0])), atol=0.5)
    for words, reason in (("p", "COLUMN=AREA"), ("q=1 cm2", "column 'q'"), ("p=-1 cm2", "above 0")):
        with pytest.raises(InputError, match=f"--pressure = .*{reason}"):
            loaded(scene, place, words)


# -- posterior --------------------------------------------------------------------------------------


def test_the_sampler_finds_a_normal_posterior():
    middle, factor = np.array([0.4, 0.6]), np.array([[0.05, 0.0], [0.03, 0.02]])

    def likelihood(places):
        return -0.5 * (np.linalg.solve(factor, (places - middle).T) ** 2).sum(axis=0)

    found = sequential(likelihood, 2, 4000, np.random.default_rng(1))
    np.testing.assert_allclose(found.mean(axis=0), middle, atol=0.004)
    np.testing.assert_allclose(np.cov(found.T), factor @ factor.T, rtol=0.15, atol=1e-5)


def spectra_of(places: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Packed spectra (n, 1, PARTS, orders) of a machine by formula: its chaos differs from one to the next."""
    clearance, mass = places[:, :1], places[:, 1:2]
    order = np.arange(ORDERS + 1.0)
    mean = (1.0 + 0.2 * mass) * np.exp(-order / 6.0) * (1.0 + 0.6 * np.sin(clearance * (1.0 + order / 8.0)))  # fmt: skip
    mean = mean * np.exp(0.3j * clearance * order)
    chaos = 0.01 * (rng.standard_normal(mean.shape) + 1j * rng.standard_normal(mean.shape))
    variance = np.full(mean.shape, 20.0 * 2e-4)
    return Spectrum(mean + chaos, variance, 20).packed()[:, None]


@pytest.fixture(scope="module")
def made(scene):
    """An ensemble by formula, and its preparation for a sensor with noise."""
    whole = Inputs.of(scene, [UNKNOWN])
    inputs = Inputs(scene, whole.unknowns, whole.random[:1])
    places = sobol(inputs.size + 2, generator(1, "identify"), 0, 128)
    spectra = spectra_of(places, np.random.default_rng(2))
    ensemble = Ensemble(inputs, places, ("crank_moment",), spectra, 20)
    seen = ensemble.spectrum("crank_moment")
    typical = Spectrum(seen.mean[0], seen.variance[0] + 0.05, 20)
    measured = Measured("crank_moment", typical, True, SPEED, ORDERS)
    layout = Layout.of(measured, Sensor())
    variance = features_of([measured], [layout])[1]
    return ensemble, layout, prepare(ensemble, [layout], Sensor(), SPEED, variance, 1, 64)


def machine(ensemble, layout, place, rng, change=0.0):
    """Features of a new machine at a place, with noise; `change`: of its third harmonic."""
    seen = Spectrum.unpacked(spectra_of(place[None], rng)[0, 0], 20)
    noise = rng.standard_normal((2, ORDERS + 1)) * np.sqrt(0.5 * 0.05 / 20)
    mean = seen.mean + noise[0] + 1j * noise[1]
    mean[3] += change
    scatter = seen.variance + 0.05
    measured = Measured("crank_moment", Spectrum(mean, scatter, 20), True, SPEED, ORDERS)
    return features_of([measured], [layout])[0]


def test_intervals_hold_and_are_narrow_where_the_model_is_right(made):
    ensemble, layout, prepared = made
    rng = np.random.default_rng(5)
    places = rng.random((60, 2))
    verdicts = [judged(prepared, machine(ensemble, layout, place, rng), 1, 400) for place in places]
    truth = ensemble.inputs.values(places)[:, 0]
    ends = np.array([one.interval[:, 0] for one in verdicts])
    inside = (ends[:, 0] <= truth) & (truth <= ends[:, 2])
    assert inside.mean() >= 0.9
    assert np.median(ends[:, 2] - ends[:, 0]) < 0.25 * 140e-6
    assert np.median(np.abs(ends[:, 1] - truth) / truth) < 0.1
    assert np.mean([one.explained for one in verdicts]) >= 0.95


def test_a_signal_that_no_member_has_is_refused_by_its_feature(made):
    ensemble, layout, prepared = made
    features = machine(ensemble, layout, np.array([0.5, 0.5]), np.random.default_rng(6), 0.8)
    verdict = judged(prepared, features, 1, 400)
    assert not verdict.explained
    assert "harmonic 3 " in prepared.labels[verdict.worst]


def test_two_clearances_that_only_their_sum_decides_are_not_identified_separately(scene):
    pin = scene.resolved()["joints"]["crank_rod"]
    both = scene.with_({"joints.rod_slider": pin})
    other = UNKNOWN.replace("crank_rod", "rod_slider")
    whole = Inputs.of(both, [UNKNOWN, other])
    inputs = Inputs(both, whole.unknowns, ())
    places = sobol(inputs.size + 2, generator(1, "identify"), 0, 128)
    total = np.column_stack([places[:, :2].mean(axis=1), np.full(len(places), 0.5)])
    spectra = spectra_of(total, np.random.default_rng(2))
    ensemble = Ensemble(inputs, places, ("crank_moment",), spectra, 20)
    measured = Measured("crank_moment", ensemble.spectrum("crank_moment"), True, SPEED, ORDERS)
    layout = Layout.of(measured, Sensor())
    truth = np.array([0.5, 0.5])
    values = machine(ensemble, layout, truth, np.random.default_rng(7))
    variance = np.full(len(values), 0.5 * 0.05 / 20)
    prepared = prepare(ensemble, [layout], Sensor(), SPEED, variance, 1, 32)
    found = [(prepared, judged(prepared, values, 1, 400))]
    wanted = Settings((UNKNOWN, other), "a.csv")
    gains = advice(ensemble, ["crank_moment"], Sensor(), SPEED, 0.1, 1)
    content = identified_dataset(ensemble, found, np.zeros(1), gains, wanted, 1, {})
    assert float(content["correlation"][0]) < -0.9
    assert float(content["expected_correlation"][0, 0]) < -0.7  # the bounds cut errors off
    assert "correlation of errors -0." in list(lines(content))[-1].text
    assert any("not identified separately" in text for text in warnings(content))
    together = next(line.text for line in lines(content) if line.label == "together")
    found_sum = re.search(r"only (0\.\d+) crank_rod \+ (0\.\d+) rod_slider = ([\d.]+) µm", together)
    assert [float(one) for one in found_sum.groups()] == pytest.approx([0.5, 0.5, 80.0], rel=0.15)
    widths = np.ptp(content["interval"].to_numpy()[0], axis=1)
    assert (widths > 3e-5).all()  # each is open, though their mean is known
    each = content["posterior"].to_numpy()[0, :, :2]  # particles by inputs
    assert each.mean(axis=1).std() < 0.3 * each.std(axis=0).min()


def test_a_resonance_that_is_known_is_taken_off_and_an_unknown_one_is_noticed(made):
    ensemble, layout, _ = made
    sensor = Sensor(resonance=300.0, quality=5.0)  # Hz; the sixth harmonic
    truth, rng = np.array([0.3, 0.5]), np.random.default_rng(8)
    seen = Spectrum.unpacked(spectra_of(truth[None], rng)[0, 0], 20)
    mean = seen.mean * sensor.response(np.arange(ORDERS + 1) * SPEED)
    measured = Measured("crank_moment", Spectrum(mean, np.full(ORDERS + 1, 0.05), 20), True, SPEED, ORDERS)  # fmt: skip
    values, variance = features_of([measured], [layout])
    known, unknown = (
        judged(prepare(ensemble, [layout], one, SPEED, variance, 1, 32), values, 1, 400)
        for one in (sensor, Sensor())
    )
    clearance = ensemble.inputs.values(truth[None])[0, 0]
    assert known.explained
    assert known.interval[0, 0] < clearance < known.interval[2, 0]
    assert known.interval[2, 0] - known.interval[0, 0] < 0.3 * 140e-6
    assert not unknown.explained
    assert re.search(r"harmonic [67] ", made[2].labels[unknown.worst])


def test_impacts_are_counted_in_a_simulated_measurement(tmp_path, scene):
    """Timing is in the harmonics, the count in the mean; both as the motion itself has them."""
    # At 150 um some motions keep contact, by their last bits; at 400 um nine perturbed ones have 4.2 to 5.1 impacts each.
    loose = {"joints.crank_rod.clearance": 400e-6, "study": None}
    own = prepared_scene(scene.with_(loose))
    response, name = hpcclear.simulate(own, checked=False), "impacts crank_rod"
    place = tmp_path / "impacts.csv"
    write_made(own, place, [name], noise=0.1, revolutions=9, response=response)
    found = read_measured(place, name, "1", SPEED).spectrum
    counts = response["impacts_by_revolution"].sel(joint="crank_rod").values
    assert counts.mean() > 1.0
    assert found.mean[0].real == pytest.approx(counts[:9].mean(), rel=0.1)
    assert np.abs(found.mean[1:20]).max() > 0.3 * found.mean[0].real


def test_noise_without_a_signal_leaves_the_unknown_open(made):
    ensemble, layout, _ = made
    size = len(layout.labels)
    loud = prepare(ensemble, [layout], Sensor(), SPEED, np.full(size, 1e4), 1, 32)
    low, _, high = judged(loud, np.zeros(size), 1, 400).interval[:, 0]
    assert high - low > 0.8 * 140e-6


def test_advice_ranks_more_revolutions_and_less_noise(made):
    ensemble, _, _ = made
    told = [advice(ensemble, ["crank_moment"], Sensor(), SPEED, share, 1) for share in (0.1, 3.0)]
    widths = [one.half_width[0, :, 0] for one in told]
    assert widths[1][-1] < widths[1][0]
    assert (widths[1] > widths[0]).all()
    quiet = noise_of(ensemble.spectrum("crank_moment"), 0.1, 512.0)
    assert quiet[0] == pytest.approx(0.25 * quiet[1])


def test_amplitudes_and_scatter_have_no_bias_from_noise():
    """Without a crank angle harmonics have amplitudes only; what noise adds to them and to the scatter is taken off."""
    rng = np.random.default_rng(4)
    noise = rng.standard_normal((400, 30, ORDERS + 1, 2)) @ np.array([1.0, 1.0j]) * 0.5**0.5
    true = np.full(ORDERS + 1, 0.4)
    found = []
    for own in noise:
        measured = Measured("crank_moment", Spectrum.of(true + own), False, SPEED, ORDERS)
        layout = Layout.of(measured, Sensor(), noise=1.0)
        found.append(features_of([measured], [layout])[0])
    means = dict(zip(layout.labels, np.mean(found, axis=0), strict=True))
    assert means["amplitude of harmonic 5 of crank_moment"] == pytest.approx(0.4, abs=0.03)
    assert means["harmonics 41 to 51 of crank_moment"] == pytest.approx(0.4 * 11**0.5, rel=0.03)
    scatter = [value for name, value in means.items() if name.startswith("scatter")]
    assert max(scatter) < 0.6  # of 1.0 a harmonic before the noise is taken off
    assert layout.values(Spectrum(true, np.ones(ORDERS + 1), 30))[0][-1] == pytest.approx(5**0.5)  # fmt: skip


# -- several dates ----------------------------------------------------------------------------------


def test_growth_has_a_rate_and_a_time_to_the_limit_with_intervals():
    rng = np.random.default_rng(3)
    times = seconds_of(("2026-01-01", "2026-01-11", "2026-01-31"), 3)
    np.testing.assert_allclose(times, [0.0, 10 * DAY, 30 * DAY])
    truth = 50e-6 + 1e-6 * times / DAY
    particles = truth[:, None, None] + 2e-6 * rng.standard_normal((3, 4000, 1))
    good = np.ones(3, bool)
    rate, left = history(times, particles, 100e-6, rng, good)
    assert rate[1, 0] * DAY == pytest.approx(1e-6, rel=0.02)
    expected = 1.96 * 2e-6 / np.sqrt(np.sum((times / DAY - 40.0 / 3.0) ** 2))
    assert (rate[2, 0] - rate[0, 0]) * DAY / 2 == pytest.approx(expected, rel=0.1)
    assert left[0, 0] < 20 * DAY < left[2, 0]
    assert left[1, 0] == pytest.approx(20 * DAY, rel=0.05)
    shrinking = history(times, particles[::-1], 100e-6, rng, good)
    assert np.isinf(shrinking.time[1, 0])
    assert history(times[:1], particles[:1], None, rng, good[:1]) is None
    assert history(seconds_of((), 3), particles, None, rng, good) is None  # no date, no rate


@pytest.mark.parametrize(
    ("dates", "reason"),
    [(("2026-01-01",), "2 signals"), (("2026-01-01", "May"), "date"), (("2026-01-02", "2026-01-01"), "rise")],
)  # fmt: skip
def test_dates_that_are_none_are_refused(dates, reason):
    with pytest.raises(InputError, match=reason):
        seconds_of(dates, 2)


@pytest.mark.parametrize(
    ("words", "reason"),
    [({"limit": "1 mm"}, "two dates"), ({"limit": "1 mm", "date": "2026-01-01"}, "two dates"),
     ({"resonance": "0"}, "above 0 Hz"), ({"resonance": "5000:-3"}, "above 0"), ({"band": "-1:50"}, "at least 0"),
     ({"angle_error": "-5 deg"}, "at least 0"), ({"gain_error": -0.1}, "at least 0")],
)  # fmt: skip
def test_words_without_sense_are_refused_before_anything_is_simulated(
    tmp_path, scene, words, reason
):
    with pytest.raises(InputError, match=reason):
        hpcclear.identify(scene, UNKNOWN, SCENE, output=tmp_path / "identify.nc", **words)
    assert not list(tmp_path.iterdir())


def record(path: Path, noise: float, samples: int, change: float, form: str, seed: int) -> Path:
    """A table of the machine by formula at 0.4 of the bounds; `change`: of its third harmonic."""
    rng = np.random.default_rng(seed)
    turns = np.arange(20 * samples + 1) / samples
    mean = Spectrum.unpacked(spectra_of(np.array([[0.4, 0.5]]), rng)[0, 0], 20).mean
    mean[3] += change
    values = (mean * np.exp(2j * np.pi * turns[:, None] * np.arange(ORDERS + 1))).real.sum(axis=1)
    values = values * (form != "zero") + noise * rng.standard_normal(len(turns))
    axis = {"time [s]": turns / SPEED} if form == "time" else {"crank_angle [deg]": 360.0 * turns}
    return table(path, {**axis, "crank_moment [N m]": values})


@pytest.mark.nightly
def test_each_record_is_judged_as_if_it_were_alone(made, scene, tmp_path, monkeypatch):
    """Good ones and one of another machine, beside loose, coarse, dead, free-running ones: verdicts stay to the last bit."""
    monkeypatch.setattr(answer, "ensemble_of", lambda *_, **__: made[0])
    monkeypatch.setattr(answer, "prepare", partial(prepare, members=24))  # enough to compare
    bare = scene.with_({"study": None})
    kinds = {
        "good": (0.2, 256, 0.0, ""), "other machine": (0.2, 256, 0.8, ""), "loose": (20.0, 256, 0.0, ""),
        "coarse": (0.2, 40, 0.0, ""), "dead": (0.0, 256, 0.0, "zero"), "free": (0.2, 256, 0.0, "time"),
    }  # fmt: skip
    files = {
        name: record(tmp_path / f"{name}.csv", *its, k)
        for k, (name, its) in enumerate(kinds.items())
    }

    def judge(*names):
        dates = [f"2026-01-{k}" for k in range(10, 10 + len(names))]
        return hpcclear.identify(
            bare, UNKNOWN, [files[name] for name in names], date=dates, progress="quiet"
        )

    alone = [judge(name) for name in ("good", "other machine")]
    company = judge(*kinds)
    for k, one in enumerate(alone):
        for name in ("interval", "doubt", "explained", "posterior", "widening"):
            np.testing.assert_array_equal(company[name][k], one[name][0], name)
        known = np.isfinite(company["measured"][k])
        assert company["feature"].values[known].tolist() == one["feature"].values.tolist()
    low, _, high = alone[0]["interval"].values[0, 0]
    assert low < 10e-6 + 0.4 * 140e-6 < high < low + 40e-6
    assert company["explained"].values[[0, 1, 4]].tolist() == [1, 0, 0]
    assert np.ptp(company["interval"].values[2, 0]) > 2.0 * (high - low)
    text = "\n".join(f"{line.label} {line.text}" for line in lines(company))
    assert f"from the {int(company['explained'].sum())} of 6 records" in text


def test_a_record_that_is_not_explained_has_no_part_in_the_growth():
    rng = np.random.default_rng(3)
    times = DAY * np.arange(4.0)
    particles = (50e-6 + 1e-6 * np.arange(4.0))[:, None, None] + 1e-7 * rng.standard_normal(
        (4, 500, 1)
    )
    particles[3] = 140e-6  # a dead sensor: narrow and wrong
    good = np.array([True, True, True, False])
    rate, left = history(times, particles, 100e-6, rng, good)
    assert rate[1, 0] * DAY == pytest.approx(1e-6, rel=0.1)
    assert left[1, 0] == pytest.approx(47 * DAY, rel=0.1)  # from the last record on
    assert history(times, particles, None, rng, np.array([True, False, False, False])) is None


# -- the command ------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def measured(tmp_path_factory, scene):
    """Made tables of two dates."""
    folder = tmp_path_factory.mktemp("measured")
    for clearance in (42, 60):
        real = scene.with_({"joints.crank_rod.clearance": 1e-6 * clearance})
        write_made(real, folder / f"{clearance}.csv", ["crank_moment"], noise=0.1, revolutions=12)
    return [folder / "42.csv", folder / "60.csv"]


@pytest.fixture(scope="module")
def identified(measured, tmp_path_factory):
    """The file, what the command printed, and its words; it was interrupted after half of its ensemble before."""
    place = tmp_path_factory.mktemp("identified") / "identify.nc"
    words = ["identify", str(SCENE), "--unknown", UNKNOWN, "-o", str(place), "--members", "32"]
    words += [word for change in SHORT for word in ("--set", change)]
    words += ["--advise", "--limit", "100um", "--progress", "quiet"]
    for signal, date in zip(measured, ("2026-01-01", "2026-03-01"), strict=True):
        words += ["--signal", str(signal), "--date", date]
    real, simulated = single.simulate_together, []

    def breaking(scenes, copies):
        if len(simulated) == 16:
            simulated.append(0)
            raise KeyboardInterrupt
        simulated.extend(copies)
        return real(scenes, copies)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(single, "simulate_together", breaking)
        broken = CliRunner().invoke(cli, words, standalone_mode=False)
        assert not place.exists(), broken.output
        done = CliRunner().invoke(cli, words, standalone_mode=False)
    assert done.exception is None, done.output
    assert len(simulated) == 32 + 1  # the finished half was not simulated again
    return place, done.output, done.exit_code, words


def test_the_command_prints_intervals_growth_and_advice(identified):
    place, printed, code, _ = identified
    content = opened.read(place, "identify")
    assert code == (0 if content["explained"].all() else 4)
    for words in ("crank_rod", "95 %", "per day", "time to", "by crank_moment"):  # fmt: skip
        assert words in " ".join(printed.split()), printed
    ends = content["interval"].values[:, 0]
    assert (ends[:, 0] < [42e-6, 60e-6]).all()
    assert (ends[:, 2] > [42e-6, 60e-6]).all()
    assert content["interval"].attrs["units"] == "m"


def test_an_answer_is_never_more_certain_than_it_is(identified):
    content = opened.read(identified[0]).isel(record=[0])

    def said(low, middle, high, explained=1):
        own = content.copy(deep=True)
        own["interval"][0, 0] = [low, middle, high]
        own["explained"][0] = explained
        return own

    assert interval(said(4.1e-5, 4.2e-5, 4.3e-5), 0, 0).startswith("42")
    assert "not determined" in interval(said(1.5e-5, 7e-5, 1.45e-4), 0, 0)
    assert interval(said(1.0e-5, 1.2e-5, 2e-5), 0, 0).startswith("at most")
    assert interval(said(1.3e-4, 1.4e-4, 1.5e-4), 0, 0).startswith("at least")
    refused = said(4.1e-5, 4.2e-5, 4.3e-5, 0)
    assert "does not explain" in interval(refused, 0, 0)
    assert re.search(r"does not explain .* the \w+", next(warnings(refused)))
    assert any(line.label == "calibration" for line in lines(refused))


def test_the_same_command_finds_it_finished_and_another_is_refused(identified):
    place, _, _, words = identified
    before = place.read_bytes()
    again = CliRunner().invoke(cli, words, standalone_mode=False)
    assert again.exception is None
    assert place.read_bytes() == before
    other = CliRunner().invoke(cli, [*words, "--noise", "10%"], standalone_mode=False)
    assert other.exit_code == 2
    assert "another run" in " ".join(other.output.split())

"""What accuracy costs: orders of the methods, the reference, and each panel against closed forms."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import opened
import pytest
from margins import FALSE_RED, at_least, at_most, fewest, most
from running import RIGID
from scipy.stats import chi2, f

from hpcclear.accuracy import averaging, integration, random_inputs, spending
from hpcclear.accuracy.looked_at import QUANTITIES
from hpcclear.accuracy.profile import QUICK
from hpcclear.accuracy.run import Panels
from hpcclear.accuracy.standin import with_case
from hpcclear.base.errors import InputError
from hpcclear.ranks.boundary import alone
from hpcclear.scene import load_scene

JOBS = Path(__file__).parent.parent / "jobs"
PAPER = load_scene(JOBS / "slider_crank.toml")
TWIN = load_scene(JOBS / "hunt_crossley.toml")

TINY = replace(
    QUICK,
    name="tiny",
    tolerances=(1e-3, 1e-5, 1e-7),
    designs=1,
    repeats=1,
    revolutions=16,
    copies=4,
    segments=8,
    training=(20, 40),
    tests=20,
    draws=(16, 64, 1024),  # 256 simulations do for the first two
    blocks=8,
    simulations=256,
    strong_seconds=0.1,
)


def silent(text: str) -> None:
    """Nothing is told."""


# ---- integration ----------------------------------------------------------------------------------


def test_the_slope_of_a_known_power_is_found_and_what_is_not_resolved_is_left_out():
    work = 100.0 * 2.0 ** np.arange(8)
    errors = 1e-2 * (work / work[0]) ** -3.0
    assert integration.observed_order(work, errors, 0.0) == pytest.approx(3.0)
    stalled = np.maximum(errors, 1e-6)
    assert integration.observed_order(work, stalled, 2e-6) == pytest.approx(3.0)
    assert np.isnan(integration.observed_order(work, errors, 1.0))


def test_the_reference_is_the_published_one_and_two_ways_to_it_agree():
    """Two independent prototypes and Exudyn, after one revolution: slider position, velocity, objective."""
    reference = integration.reference_of(PAPER, 1)
    position, velocity, _, objective = reference.values[0]
    assert position == pytest.approx(0.170909697445, abs=1e-9)
    assert velocity == pytest.approx(0.553755970, abs=1e-5)
    assert objective == pytest.approx(0.28753013e-3, rel=1e-6)
    assert (reference.error < 1e-9).all()


def test_errors_of_the_ladder_fall_and_the_reference_is_a_hundred_times_better():
    found = integration.measure(TWIN, TINY, silent)
    best = found["error"][0, :, :]  # dormand-prince
    assert (best[0] > best[2]).all()
    position = QUANTITIES.index("slider_position")
    # Not by (1e-5 / 1e-3): at the loosest tolerance most steps are at the edge of stability, and held stricter there.
    assert best[1, position] < 0.1 * best[0, position] < 1e-4
    assert best[2, position] < 1e-2 * best[1, position]
    # of order 8: this may be better still
    pairs = [k for k, name in enumerate(found["integrator"]) if name != "prince-dormand"]
    floor = integration.MARGIN * found["reference_error"][position]
    assert (found["error"][pairs, :, position] >= floor).all()
    assert (found["error"] >= found["reference_error"]).all()
    # single and in lanes: the same bits
    np.testing.assert_array_equal(found["error"][0], found["error"][1])


@pytest.mark.parametrize(
    "drive", [pytest.param("constant-speed", marks=pytest.mark.full), "torque"]
)
@pytest.mark.nightly
def test_two_ways_through_a_revolution_of_a_linkage_agree(drive):
    """scipy on the generated equations, and the kernel; a revolution of a free crank ends at an angle, not at a time."""
    scene = load_scene(JOBS / "linkages" / "crank_rocker.toml")
    # Pressed against its bearings; left alone it rattles, and a perturbation grows by e^10 in this revolution. With -20, which
    # the motor can turn, contacts still come and go: the error of one method is 0.003 or 4 times its first there.
    hold = {"kind": "torque", "body": "rocker", "torque": -20.0 if drive == "torque" else -120.0}
    scene = scene.with_({"mechanism.loads": {"hold": hold}})
    if drive == "torque":
        motor = {"kind": drive, "body": "crank", "torque": 10.0, "initial_speed": 60.0}
        scene = scene.with_({"mechanism.drives": {"motor": {**motor, "flywheel_inertia": 1e-2}}})
    reference = integration.reference_of(scene, 1)
    # Of f and velocity, through dozens of contacts; 1e-6 at most with eight loads about -20.
    assert (reference.error < 1e-5).all()
    if drive == "torque":
        return  # the ladder is climbed once
    found = integration.measure(scene, TINY, silent)
    by_name = dict(zip(found["integrator"].tolist(), found["error"][..., 0], strict=True))
    for name in ("tsitouras", "LSODA (scipy)"):
        assert by_name[name][0] < 1e-3
        assert by_name[name][2] < 1e-6  # 9e-9 at most with eight loads from -105 to -145
    studied, case, _ = with_case(scene.with_({"study": None}))
    assert case == "about_the_scene"
    assert set(studied.required_study.optimisation) == {"mass", "C1", "C2"}


# ---- averaging ------------------------------------------------------------------------------------


def test_a_transient_that_decays_and_copies_that_settle_apart():
    turn = np.arange(64.0)[:, None, None]
    apart = np.array([-3e-3, 0.0, 3e-3])[None, :, None]
    gaps = 2e-4 * (1.0 + 0.1 * 0.5**turn + apart) * np.ones(2)
    found = averaging.analyse(gaps, 0.0)
    assert found["averaging_floor"] == pytest.approx(3e-3)  # standard deviation of -3, 0, 3
    late = list(found["transient"]).index(16)
    np.testing.assert_allclose(found["averaging_error"][late], np.sqrt(2.0 / 3.0) * 3e-3, rtol=1e-3)
    first = found["averaging_error"][0] ** 2 - (2.0 / 3.0) * 3e-3**2
    share = [0.1 * (2.0 - 2.0 ** (1 - a)) / a for a in found["averaged"].astype(float)]
    np.testing.assert_allclose(np.sqrt(first), share, rtol=1e-2)


# ---- tolerance and revolutions -------------------------------------------------------------------


def planted(bias, deviation, segments=64, seed=7):
    """Copies whose segments scatter independently about a mean that goes by the tolerance."""
    rng = np.random.default_rng(seed)
    shape = (segments, len(spending.TOLERANCES), spending.COPIES)
    f = 1.0 + np.array(bias)[:, None] + deviation * rng.standard_normal(shape)
    gaps = 1e-5 * np.stack([0.6 * f, 0.8 * f], axis=-1)
    done = segments * spending.COPIES * spending.SEGMENT
    price = np.array([1.0, 1.1, 1.3, 1.6, 2.0, 2.5]) * 1e-3
    return spending.Run(gaps, price * done, np.empty((6, spending.COPIES, 0)))


def test_bias_variance_and_price_that_were_planted_are_found():
    wanted = [0.1, 0.005, 0.0, 0.0, 0.0, 0.0]
    found = spending.analyse(planted(wanted, 0.03))
    off = (found["tolerance_bias"] - wanted) / found["tolerance_bias_error"]
    assert (np.abs(off) < 4.5).all()
    # of ten revolutions 0.03^2; a variance over 32 copies scatters by a quarter of itself
    np.testing.assert_allclose(found["turn_variance"], 10 * 0.03**2, rtol=0.9)
    price = found["tolerance_seconds"]
    np.testing.assert_allclose(price, [1e-3, 1.1e-3, 1.3e-3, 1.6e-3, 2e-3, 2.5e-3])
    error = found["spent_error"]
    assert (error[0] > 0.095).all()  # no revolutions help against a bias
    np.testing.assert_allclose(error[3, :5], found["spent_model"][3, :5], rtol=0.7)
    assert error[3, 0] > 3.0 * error[3, 5]


def test_the_cheapest_tolerance_is_the_loosest_that_is_not_off():
    found = spending.analyse(planted([0.1, 0.01, 0.0, 0.0, 0.0, 0.0], 0.03))
    rtol, spent, seconds = spending.cheapest(found, 0.05)
    assert rtol == 1e-4
    assert spent == pytest.approx(10 * 0.03**2 / (0.05**2 - 0.01**2), abs=5)
    assert seconds == pytest.approx(1.1e-3 * (spent + 32 * found["spin_up"]), rel=0.01)
    strict = spending.cheapest(found, 0.004)
    assert strict[0] <= 1e-5  # 1e-4 is off by more
    assert np.isnan(spending.cheapest(found, 1e-5)).all()  # no bias is known so well
    assert strict[1] > spending.cheapest(found, 0.02)[1] > 0


def test_copies_that_fail_are_left_out():
    run = planted([0.0] * 6, 0.03)
    run.gaps[10:, 2, 5] = np.nan
    found = spending.analyse(run)
    assert np.isfinite(found["spent_error"][:, :5]).all()
    assert abs(found["tolerance_bias"][2]) < 4.5 * found["tolerance_bias_error"][2]


def test_a_run_that_was_cut_goes_on_as_if_it_had_not_been():
    whole = list(spending.measure(TWIN, spending.Run.of(TWIN), 16))
    assert [len(run.gaps) for run in whole] == [8, 16]
    (again,) = spending.measure(TWIN, whole[0], 16)
    np.testing.assert_array_equal(again.gaps, whole[1].gaps)
    np.testing.assert_array_equal(again.start, whole[1].start)


# ---- surrogates and random inputs -----------------------------------------------------------------


def test_limits_of_a_root_mean_square_hold_as_often_as_they_say(shift):
    rng = np.random.default_rng(4 + shift)
    errors = 0.3 * rng.standard_normal((12, 4000))
    middle, lower, upper = random_inputs.root_mean_square(errors, 0)
    held = np.count_nonzero((lower < 0.3) & (upper > 0.3))
    at_least(held, fewest(4000, 0.95))
    at_most(held, most(4000, 0.95))
    # mean of 4000 squares of 12 degrees of freedom: four times its scatter
    at_most(abs(np.mean(middle**2) / 0.09 - 1.0), 4.0 * np.sqrt(2.0 / 48_000))
    one = random_inputs.root_mean_square(errors, 1)
    np.testing.assert_allclose(one[2] / one[0], np.sqrt(11 / chi2.ppf(0.025, 11)))


def test_a_scene_without_a_case_gets_one_about_its_own_values():
    made, case, where = with_case(PAPER)
    assert made.study.case(case).random == ("m2", "m3", "C")
    assert "no study" in where
    middle = np.mean(made.study.variables[0].range)
    assert middle == pytest.approx(PAPER.number("mechanism.rod.mass"))
    bare = PAPER.with_({"study": {"variables": {"m2": {"range": [0.1, 0.4]}}}})
    made, case, where = with_case(bare)
    assert made.study.random_input("m2").half_width == pytest.approx(0.05 * 0.3)
    study = load_scene(JOBS / "robust_slider_crank.toml")
    assert with_case(study)[1] == "robust"


def test_clearances_that_differ_are_varied_apart():
    made, _, _ = with_case(PAPER.with_({"joints.crank_rod.clearance": "0.4 mm"}))
    assert [v.name for v in made.study.variables] == ["m2", "m3", "C12", "C23"]


# ---- all of it ------------------------------------------------------------------------------------


def panels_of(scene):
    kept = {}
    store = SimpleNamespace(load_stage=kept.get, save_stage=kept.__setitem__)
    return Panels(scene, alone(), TINY, print, store, lambda content: None)


@pytest.fixture(scope="module")
def measured():
    return panels_of(TWIN).measured().to_xarray()


def test_everything_is_in_one_file_that_reads_back(measured, tmp_path):
    opened.write(measured, tmp_path / "accuracy.nc")
    again = opened.read(tmp_path / "accuracy.nc", "accuracy")
    assert again.identical(measured)
    for name in ("processor", "versions", "repeats", "profile", "study", "scene"):
        assert again.attrs[name]
    closed = abs(measured["closed_form"])
    assert float(closed.sel(moment="mean")) < 1e-8
    # small beside the mean: digits cancel in both ways
    assert float(closed.sel(moment="deviation")) < 1e-2
    r2 = measured["r2"].sel(surrogate="Kriging")
    assert float(r2[-1]) > 0.9
    error = measured["moment_error"].sel(moment="mean")
    assert (error.isel(draws=slice(2)) < 0.05).all()
    assert float(error.sel(estimate="surrogate")[-1]) < 0.05
    assert float(measured["strong_seconds"][0]) > 0.0


def test_monte_carlo_on_the_surrogate_converges_as_theory_says(measured):
    error = measured["moment_error"].sel(estimate="surrogate", moment="mean").to_numpy()
    # 64 times the draws, 8 samples each: the square of the ratio over 64 is distributed as F of 8 and 8 degrees
    square = (error[0] / error[2]) ** 2 / 64.0
    at_least(square, f.ppf(FALSE_RED / 2.0, 8, 8))
    at_most(square, f.isf(FALSE_RED / 2.0, 8, 8))


def test_without_clearance_there_is_nothing_to_measure():
    with pytest.raises(InputError, match="without clearance"):
        panels_of(PAPER.with_(RIGID)).measured()

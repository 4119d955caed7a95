"""The study as a whole, on a mechanism that is a formula: every answer is known beforehand."""

import re
from collections import Counter

import numpy as np
import opened
import pytest
from commands import contents
from formula_study import formula, on_ranks, whole as scene_of

from hpcclear.base.errors import InputError
from hpcclear.base.outcome import Status
from hpcclear.base.verdict import Verdict
from hpcclear.ensemble import single
from hpcclear.ranks import leading
from hpcclear.ranks.boundary import alone
from hpcclear.ranks.stopping import Stopped
from hpcclear.report.answer import answer
from hpcclear.report.html.page import write_report
from hpcclear.report.merit import recommended
from hpcclear.results.names import KINDS, designs_in
from hpcclear.statistics.surrogate.stored import models_in
from hpcclear.study import chaos, responses, run_study, stages
from hpcclear.study.paper import claims
from hpcclear.study.paper.claims import ResponseEvidence
from hpcclear.study.paper.printed import is_the_papers, printed_designs
from hpcclear.study.responses import QUANTITIES
from hpcclear.study.stages import files_of

Z = ("m2", "m3", "u2", "I2")
HALF = {"m2": 0.005, "m3": 0.005, "u2": 0.02, "I2": 0.5e-4}


@pytest.fixture(autouse=True)
def _dynamics(monkeypatch):
    formula.replace_dynamics(monkeypatch.setattr)


@pytest.fixture(scope="module")
def results(carried_out):
    """One study, done in one go."""
    told: list[str] = []
    place = carried_out(scene_of(), told.append)
    assert all("ended with its rounds" in text for text in told)  # there is one round
    return place


def truth(design: dict[str, float], robust: bool) -> tuple[float, float]:
    """Exact mean and deviation of the formula for a design."""
    low, high = 3e-4, 1e-3
    middle, variance = (low + high) / 2, (high - low) ** 2 / 12
    factor = 0.1 + 0.5 * design["m2"]
    constant = 4 - 5 * design["m2"] + 3 * design["m3"] - 10 * design["u2"] + 500 * design["I2"]
    mean = 1e-4 * constant + factor * middle
    spread = factor**2 * variance
    if robust:
        mass = HALF["m2"] ** 2 / 3
        spread += 0.25 * mass * variance + (0.5 * middle - 5e-4) ** 2 * mass
        slopes = {"m3": 3e-4, "u2": -1e-3, "I2": 500e-4}
        spread += sum((slopes[name] * HALF[name]) ** 2 / 3 for name in slopes)
    return mean, spread**0.5


# -- the whole study --------------------------------------------------------------------------------


def test_writes_every_result_and_leaves_no_rubbish(results):
    names = {path.name for path in results.iterdir()}
    kinds = (
        "samples sensitivity kriging front verification contributions chaos claims readings timing"
    )
    assert names == {f"{kind}.nc" for kind in kinds.split()} | {"responses"}
    for kind in kinds.split():
        found = opened.read(results / f"{kind}.nc", kind)
        assert found.attrs["scene_hash"] == scene_of().hash
    series = {path.stem for path in (results / "responses").iterdir()}
    assert series == {"original", "first_alpha", "first_beta", "second_alpha", "second_beta"}
    timing = opened.read(results / "timing.nc", "timing")
    assert "kriging: simulations" in timing["stage"].to_numpy()


def test_sensitivities_are_the_derivatives(results):
    found = opened.read(results / "sensitivity.nc").sel(surface="m2 m3")
    clearance = found["clearance"].to_numpy()
    slope = found["best_sensitivity"].sel(parameter="m2").to_numpy()
    np.testing.assert_allclose(slope, (0.5 * clearance - 5e-4) * 0.315, atol=1e-12)
    slope = found["best_sensitivity"].sel(parameter="m3").to_numpy()
    np.testing.assert_allclose(slope, 3e-4 * 0.21, atol=1e-12)
    assert np.isnan(found["best_sensitivity"].sel(parameter="u1")).all()
    whole = opened.read(results / "sensitivity.nc")
    chosen = whole["parameter"].to_numpy()[whole["selected"].to_numpy() == 1]
    assert set(chosen) == {"m2", "m3", "u2", "I2"}
    assert (whole["surface_accepted"] == 1).all()
    first = whole["sobol_first"].sel(parameter=["m1", "u1", "I1"]).to_numpy()
    np.testing.assert_allclose(first, 0.0, atol=1e-6)


def test_true_moments_and_the_surrogate_meet_the_formula(results):
    found = opened.read(results / "verification.nc")
    z = 4.5  # standard errors: 29 designs with common draws, 2 moments
    for one in (found.isel(design=k) for k in range(found.sizes["design"])):
        design = {name: float(one[name]) for name in Z}
        robust = str(one["case"].values) == "second"
        mean, deviation = truth(design, robust)
        error = float(one["mean_upper"] - one["mean_true"]) / 1.97  # Student's t, 200 draws
        assert abs(float(one["mean_true"]) - mean) < z * error
        error = float(one["deviation_upper"] - one["deviation_true"]) / 1.97
        assert abs(float(one["deviation_true"]) - deviation) < z * error
        if np.isfinite(one["mean_surrogate"]):
            assert float(one["mean_surrogate"]) == pytest.approx(mean, rel=2e-3)
            assert float(one["deviation_surrogate"]) == pytest.approx(deviation, rel=2e-2)
        assert int(one["samples"]) == 200
        assert int(one["failed"]) == 0
    names = found["design"].to_numpy().tolist()
    # those that cannot be told apart are one
    assert 4 <= sum("front" in name for name in names) <= 8
    assert sum("paper" in name for name in names) == 4
    paper = found.sel(design="first paper alpha")
    assert float(paper["mean_paper"]) == 1.7787e-4
    assert "surrogate" not in found.attrs["remarks"]


def test_the_swarms_ends_are_verified_under_their_names(results):
    """The least mean has the largest m2, u2 and the least m3 and I2; the deviation wants m2 small."""
    found = opened.read(results / "verification.nc")
    alpha, beta = found.sel(design="first best alpha"), found.sel(design="first best beta")
    assert float(alpha["m3"]) == pytest.approx(0.07, abs=0.02)
    assert float(beta["m2"]) == pytest.approx(0.105, abs=0.02)
    assert float(alpha["m2"]) > float(beta["m2"]) + 0.1
    front = opened.read(results / "front.nc")
    assert front.sizes == {"case": 2, "run": 2, "solution": 12}
    verified = front["verified"].to_numpy().sum(axis=(1, 2))
    assert (verified == 6).all()  # four spread points, alpha, beta
    least = front["mean"].sel(case="first").min()
    assert float(least) == pytest.approx(float(alpha["mean_surrogate"]), rel=1e-12)


def test_alpha_and_beta_have_the_least_and_the_front_is_true(results):
    """By the formula, not by the simulations that chose them."""
    found = opened.read(results / "verification.nc")
    for case, robust in (("first", False), ("second", True)):
        designs = [
            {name: float(found[name].sel(design=f"{case} {end}")) for name in Z}
            for end in ("alpha", "beta")
        ]
        best = {"m2": 0.42, "m3": 0.07, "u2": 0.12, "I2": 0.42 * 0.12**2 / 12}
        assert truth(designs[0], robust)[0] < truth(best, robust)[0] * 1.02
        least = {"m2": 0.105, "m3": 0.07, "u2": 0.12, "I2": 0.105 * 0.12**2 / 12}
        assert truth(designs[1], robust)[1] < truth(least, robust)[1] * 1.005
        own = [k for k, name in enumerate(found["design"].to_numpy()) if f"{case} front" in name]
        points = [truth(one, robust) for one in designs]
        points += [truth({name: float(found[name][k]) for name in Z}, robust) for k in own]
        for one in points:
            assert not any(o[0] < one[0] and o[1] < one[1] for o in points)
        assert not found["dominated"].to_numpy()[own].any()


def test_a_user_can_go_on_from_the_models(results):
    models = models_in(opened.read(results / "kriging.nc", "kriging").variables)
    assert set(models) == {"m2 m3 C", "m2 m3 u2 I2_ratio C"}
    model = models["m2 m3 u2 I2_ratio C"]
    m2, m3, u2, c = 0.3, 0.1, 0.05, 6e-4
    inertia = 2.5 * m2 * 0.12**2 / 12
    value = model.predict(np.array([[m2, m3, u2, 2.5, c]]))[0]
    expected = 1e-4 * (4 - 5 * m2 + 3 * m3 - 10 * u2 + 500 * inertia) + (0.1 + 0.5 * m2) * c
    assert value == pytest.approx(expected, rel=2e-3)
    assert model.lower[3] < 0.6  # widened by the scatter of I2 and m2
    with pytest.raises(InputError, match="extrapolate"):
        model.predict(np.array([[m2, m3, u2, 9.0, c]]))


def test_another_kernel_and_chosen_terms_go_through_to_the_files(results, tmp_path):
    """A cubic in seven inputs has 120 terms, twice as many as there are points."""
    scene = scene_of(
        "study.surrogate.kernel=matern-5/2", "study.sensitivity.together_order=3",
        "study.verification.audit_samples=0", "study.verification.infill_rounds=0",
    )  # fmt: skip
    place = tmp_path / "out"
    run_study(scene, place, alone(), progress_style="quiet")
    models = models_in(opened.read(place / "kriging.nc", "kriging").variables)
    assert {leaf.kernel for model in models.values() for leaf in model.leaves} == {"matern-5/2"}
    known = models_in(opened.read(results / "kriging.nc", "kriging").variables)
    model, other = models["m2 m3 C"], known["m2 m3 C"]
    assert {leaf.kernel for leaf in other.leaves} == {"squared-exponential"}
    at = np.array([[0.3, 0.1, 6e-4]])
    assert model.predict(at) == pytest.approx(other.predict(at), rel=0.05)
    assert (model.predict(at) != other.predict(at)).all()
    assert np.isfinite(opened.read(place / "front.nc", "front")["deviation"]).any()
    found = opened.read(place / "sensitivity.nc", "sensitivity")
    terms = found["surface_terms"].isel(surface=-1).to_numpy()
    assert (terms >= 8).all()
    assert (terms < 60).all()
    assert (found["surface_order"].isel(surface=-1) >= 2).all()
    default = opened.read(results / "sensitivity.nc", "sensitivity")
    assert "surface_terms" not in default  # all of them, everywhere
    assert "kernel" not in opened.read(results / "kriging.nc", "kriging")
    for name in ("m2", "m3"):  # the formula is linear in both
        where = {"parameter": name, "surface": default["surface"][-1]}
        known = default["best_sensitivity"].sel(where).to_numpy()
        np.testing.assert_allclose(found["best_sensitivity"].sel(where), known, rtol=0.02)


def test_samples_are_numbered_through_and_tell_their_designs(results):
    found = opened.read(results / "samples.nc", "samples")
    assert (np.diff(found["sample"]) == 1).all()
    assert set(designs_in(found)) == {"m1", "u1", "I1", "m2", "u2", "I2", "m3", "C"}
    column = {
        path: designs_in(found)[variable.name]
        for variable in scene_of().study.variables
        for path in variable.paths
    }
    np.testing.assert_allclose(found["objective"], formula.objective(column), rtol=1e-12)


def test_claims_are_judged(results):
    found = opened.read(results / "claims.nc")
    verdicts = dict(zip(found["claim"].to_numpy(), found["verdict"].to_numpy(), strict=True))
    assert verdicts[1] == claims.HOLDS  # df/dC = 0.1 + 0.5 m2
    assert verdicts[2] == claims.FAILS  # df/dm2 < 0
    assert verdicts[3] == claims.HOLDS
    assert verdicts[4] == claims.HOLDS
    assert verdicts[11] == claims.HOLDS
    assert all(len(text) > 10 for text in found["figure"].to_numpy())


def test_readings_compare_with_the_printed_values(results):
    found = opened.read(results / "readings.nc")
    assert found.sizes == {"reading": 9, "design": 4}
    assert len(set(found["reading"].to_numpy())) == 9
    value = found["mean"].isel(reading=0, design=0)
    expected = np.sqrt(np.mean(np.log(found["mean"][0] / found["mean_paper"]) ** 2))
    assert float(found["distance"][0]) == pytest.approx(float(expected))
    design = {"m2": 0.105, "m3": 0.0715, "u2": 0.0451, "I2": 1.2432e-4}
    assert float(value) == pytest.approx(truth(design, False)[0], rel=0.1)


# -- interruptions and ranks ------------------------------------------------------------------------


def test_a_run_stopped_after_every_stage_ends_with_the_same_bytes(results, tmp_path):
    place = tmp_path / "pieces"
    stages = formula.run_in_pieces(scene_of(), place, alone())
    assert stages == 8
    assert contents(place) == contents(results)


@pytest.mark.parametrize(
    "overrides",
    [
        ["study.verification.infill_rounds=0"],
        ["study.sensitivity.sobol_samples=0", "study.verification.audit_samples=0"],
    ],
)
def test_a_study_simulates_what_it_says_beforehand(tmp_path, monkeypatch, overrides):
    """What `plan` counts: samples stage by stage, and single responses."""
    scene = scene_of(*overrides)
    made, run_points, responded = Counter[str](), leading.run_points, Counter[str]()

    def counted(self, task, points, **options):
        if task.make is not single.Responses:
            made[re.sub(r"(-\d+| check)?: simulations", "", task.name)] += len(points)
        return run_points(self, task, points, **options)

    def respond(one, *rest, **options):
        responded["all"] += 1
        return formula.respond(one, *rest, **options)

    monkeypatch.setattr(leading, "run_points", counted)
    monkeypatch.setattr(responses, "simulated", respond)
    run_study(scene, tmp_path / "out", alone(), progress_style="quiet")
    said = {stage: count for stage, count in stages.samples_of(scene).items() if count}
    at_most = ("search", "verification", "pairs", "chaos") if len(overrides) > 1 else ("chaos",)
    for stage in at_most:  # rounds may win nothing, fronts be short, ends be one design, designs that win nothing have 64
        assert 0.2 * said[stage] < made[stage] <= said.pop(stage)
        del made[stage]
    assert dict(made) == said
    # what is recommended is an end, or not
    assert 0.7 * stages.responses_of(scene) < responded["all"] <= stages.responses_of(scene)


def test_the_share_of_chaos_is_that_of_the_pairs():
    rng = np.random.default_rng(11)
    inputs, chaotic = rng.normal(10.0, 0.3, (4000, 1)), rng.normal(0.0, 0.4, (4000, 2))
    chaotic[:1000] = 0.0  # a quarter of the samples is regular
    deviation, share, moved = chaos.split(inputs + chaotic)
    within = 0.75 * 0.4**2
    assert deviation == pytest.approx(within**0.5, rel=0.05)
    assert share == pytest.approx(within / (within + 0.3**2), rel=0.05)
    assert moved == pytest.approx(0.75, abs=0.01)
    assert chaos.split(np.repeat(inputs, 2, axis=1)) == (0.0, 0.0, 0.0)
    assert np.isnan(chaos.split(np.full((8, 2), np.nan))).all()


def test_a_formula_has_no_chaos_and_the_study_says_so(results):
    found, verified = (opened.read(results / f"{n}.nc") for n in ("chaos", "verification"))
    assert recommended(verified) in found["design"]
    assert set(found["design"].to_numpy()) < set(verified["design"].to_numpy())
    assert (found["chaotic"] == 0.0).all()
    assert (found["chaos_share"] < 1e-10).all()
    files = {"chaos": found, "verification": verified}
    (line,) = [one for one in answer(files) if one.label == "chaos"]
    assert line.text.startswith("0 of ")


def test_a_run_stopped_amid_simulations_goes_on(results, tmp_path, monkeypatch):
    place, ranks, calls = tmp_path / "stopped", alone(), [0]
    work = formula.FormulaWorker.advance

    def advance(self, seconds):
        calls[0] += 1
        if calls[0] in (3, 20):
            ranks.stop_switch.request("test")
        return work(self, seconds)

    monkeypatch.setattr(formula.FormulaWorker, "advance", advance)
    scene = scene_of()
    with pytest.raises(Stopped):
        run_study(scene, place, ranks, progress_style="quiet")
    assert (place / "checkpoint").is_dir()
    ranks = alone()
    with pytest.raises(Stopped):
        run_study(scene, place, ranks, progress_style="quiet")
    before = calls[0]
    run_study(scene, place, alone(), progress_style="quiet")
    assert contents(place) == contents(results)
    again = calls[0]
    assert again > before
    told: list[str] = []
    run_study(scene, place, alone(), progress_style="quiet", notify=told.append)
    assert calls[0] == again  # nothing is done twice
    assert "finished" in told[0]


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [2, 3])
@pytest.mark.shortened(1)
def test_the_number_of_ranks_changes_no_byte(results, tmp_path, ranks):
    assert contents(on_ranks(scene_of(), tmp_path, ranks=ranks)) == contents(results)


# -- failures, infill, refusals ---------------------------------------------------------------------


def test_failed_samples_are_left_out_and_counted(tmp_path, monkeypatch):
    monkeypatch.setattr(formula, "FAILS_ABOVE", 0.26)
    place = tmp_path / "failing"
    run_study(scene_of(), place, alone(), progress_style="quiet")
    samples = opened.read(place / "samples.nc")
    heavy = samples["m3"].to_numpy() > 0.26
    assert heavy.any()
    assert (samples["status"].to_numpy()[heavy] != 0).all()
    assert np.isnan(samples["objective"].to_numpy()[heavy]).all()
    found = opened.read(place / "sensitivity.nc")
    assert found.attrs["failed_simulations"] > 0
    models = opened.read(place / "kriging.nc")
    assert (models["dropped"] > 0).all()
    verified = opened.read(place / "verification.nc")
    assert float(verified["mean_true"].sel(design="first alpha")) > 0


def test_all_failed_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(formula, "FAILS_ABOVE", 0.0)
    with pytest.raises(InputError, match=r"all of these simulations failed.*max_steps"):
        run_study(scene_of(), tmp_path / "out", alone(), progress_style="quiet")


def test_the_front_is_true_where_the_surrogate_fails(tmp_path, monkeypatch):
    """A hill that few points see stands where the surrogate's best design is: direct simulation finds a better one."""
    plain = formula.objective

    def hill(column):
        along = (column["mechanism.rod.mass_center"] - 0.12) / 0.04
        across = (column["mechanism.slider.mass"] - 0.07) / 0.04
        return plain(column) + 4e-5 * np.exp(-(along**2) - across**2)

    monkeypatch.setattr(formula, "objective", hill)
    scene = scene_of("study.verification.infill_rounds=4", "study.seed=5")
    run_study(scene, tmp_path / "out", alone(), progress_style="quiet")
    found = opened.read(tmp_path / "out" / "verification.nc")
    ours, swarms = found.sel(design="first alpha"), found.sel(design="first best alpha")
    assert float(swarms["mean_surrogate"]) < 0.98 * float(swarms["mean_true"])
    assert float(ours["mean_true"]) < float(swarms["mean_true"])
    assert "first best alpha" not in str(ours["equivalence"].values)  # significantly
    least = min(
        truth({"m2": m2, "m3": 0.07, "u2": u2, "I2": m2 * 1.2e-3}, False)[0]
        + 4e-5 * np.exp(-(((u2 - 0.12) / 0.04) ** 2))
        for m2 in (0.105, 0.42)
        for u2 in np.linspace(0.0, 0.12, 121)
    )
    assert float(ours["mean_lower"]) < 1.02 * least


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["study.cases={}"], "no case to optimise"),
        (["joints.rod_slider.clearance=0.4 mm"], "a model leaves it out"),
    ],
)
def test_bad_input_is_refused_before_any_simulation(tmp_path, overrides, message):
    scene = scene_of(*overrides, "study.surrogate.models=[['m2', 'm3']]")
    with pytest.raises(InputError, match=message):
        run_study(scene, tmp_path / "out", alone(), progress_style="quiet")


@pytest.mark.parametrize(
    ("entry", "cites", "compares"),
    [
        ("numerics.rtol=1e-7", True, True),
        ("effects.contact.restitution=0.5", True, True),
        ("drive.speed=3000 rpm", True, False),
        ("study.objective=peak-contact-force", True, False),
        ("study.cases.robust={random=['C', 'm2'], objectives=['mean']}", True, False),
        (
            "study.cases.robust={random=['C'], constraints=[{statistic='mean', most='1 nm'}]}",
            True,
            False,
        ),
        ("mechanism.rod.length=0.13", False, False),
        ("joints.crank_rod.bearing_radius=21 mm", False, False),
        ("joints.rod_slider.bearing.youngs_modulus=2 GPa", False, False),
    ],
)
def test_the_papers_scene_is_recognised_by_what_it_holds(entry, cites, compares):
    scene = scene_of(entry)
    assert bool(scene.references) == cites
    assert is_the_papers(scene) == compares
    assert ("claims.nc" in files_of(scene)) == compares
    assert bool(printed_designs(scene)) == compares


def test_a_claim_on_designs_that_are_one_is_undecided():
    names, values = np.array(["original", "robust alpha"]), np.ones((2, 3, 4, 5, 9))
    found = ResponseEvidence({"names": names, "statistics": values})
    verdict, text = found.judged([("robust beta", "robust alpha", "mean", QUANTITIES[0], 1)])
    assert verdict == Verdict.UNDECIDED
    assert "robust beta" in text


OF_THE_OBJECTIVE = {
    "chaos.nc": "chaos_deviation",
    "samples.nc": "objective objective_spread objective_uncertainty",
    "sensitivity.nc": (
        "sensitivity standard_error best_sensitivity uncertainty influence mean_objective "
        "mean_objective_error"
    ),
    "kriging.nc": "training_output output_mean output_scale rmse",
    "front.nc": "mean deviation",
    "verification.nc": (
        "mean_true mean_lower mean_upper mean_surrogate "
        "deviation_true deviation_lower deviation_upper deviation_surrogate "
        "percentile percentile_lower percentile_upper"
    ),
}


@pytest.mark.parametrize(
    ("name", "unit", "squared"),
    [
        ("mean-gap", "m", "m^2"),
        ("peak-contact-force", "N", "N^2"),
        ("peak-crank-moment", "N m", "(N m)^2"),
    ],
)
@pytest.mark.shortened(2)
def test_units_follow_the_objective_and_nothing_else_does(
    tmp_path, monkeypatch, name, unit, squared
):
    """What depends on the objective has its unit; a position stays in metres."""
    monkeypatch.setattr(formula, "FIELD", "" if name == "mean-gap" else name.replace("-", "_"))
    place = tmp_path / "out"
    run_study(scene_of(f"study.objective={name}"), place, alone(), progress_style="quiet")
    for path in sorted(place.rglob("*.nc")):
        found = opened.read(path)
        table = KINDS[found.attrs["hpcclear_kind"]]
        theirs = OF_THE_OBJECTIVE.get(path.name, OF_THE_OBJECTIVE["samples.nc"]).split()
        for variable, content in found.data_vars.items():
            if variable in theirs:
                assert content.attrs["units"] == unit, (path.name, variable)
            elif variable == "hypervolume":
                assert content.attrs["units"] == squared
            elif variable in table.data and content.dtype.kind == "f":
                assert content.attrs["units"] == table.data[variable].units, (path.name, variable)
    response = opened.read(place / "responses" / "original.nc")
    assert response["eccentricity_x"].attrs["units"] == "m"


# -- parts ------------------------------------------------------------------------------------------


def test_differences_count_only_beyond_their_scatter():
    rng = np.random.default_rng(2)
    series = np.ones((3, 6, 10, 3, 4)) + 0.01 * rng.normal(size=(3, 6, 10, 3, 4))
    series[1] *= 0.8
    found = claims.ResponseEvidence({"names": np.array(["a", "b", "c"]), "statistics": series})
    quantity = responses.QUANTITIES[0]
    assert found.judged([("b", "a", "peak", quantity, -1)])[0] == claims.HOLDS
    assert found.judged([("b", "a", "peak", quantity, 1)])[0] == claims.FAILS
    assert found.judged([("c", "a", "peak", quantity, 1)])[0] == claims.OPEN


def test_what_copies_disagree_on_cannot_be_told():
    """Each copy by itself is sure, with stretches that hardly differ; the copies are not."""
    rng = np.random.default_rng(2)
    series = np.ones((2, 6, 10, 3, 4)) + 1e-3 * rng.normal(size=(2, 6, 10, 3, 4))
    series[1] *= 0.9
    names, quantity = np.array(["a", "b"]), responses.QUANTITIES[0]
    wanted = [("b", "a", "peak", quantity, -1)]
    found = claims.ResponseEvidence({"names": names, "statistics": series})
    assert found.judged(wanted)[0] == claims.HOLDS
    series[1] *= 1.0 + 0.15 * rng.normal(size=(6, 1, 1, 1))
    verdict, text = claims.ResponseEvidence({"names": names, "statistics": series}).judged(wanted)
    assert verdict == claims.OPEN
    assert re.search(r"significant above \d+\.\d %", text)


def test_a_response_that_fails_is_told_and_the_study_ends(tmp_path, monkeypatch):
    """All of the study but that one file is there, and no comparison is made up."""
    design = None

    def failing(scene, *others, **options):
        """The design that comes first, the original, ends amid its transient."""
        nonlocal design
        design = design or (scene.mechanism.rod.mass, scene.mechanism.slider.mass)
        response = formula.respond(scene, *others, **options)
        if design != (scene.mechanism.rod.mass, scene.mechanism.slider.mass):
            return response
        response["status"].values[...] = int(Status.STEP_CAP)
        return response.isel(time=slice(5))

    monkeypatch.setattr(responses, "simulated", failing)
    told: list[str] = []
    run_study(scene_of(), tmp_path, alone(), progress_style="quiet", notify=told.append)
    (about,) = (text for text in told if "has no file" in text)
    assert "response of original" in about
    assert "step_cap" in about
    assert Status.STEP_CAP.remedy in about
    assert len(list((tmp_path / "responses").iterdir())) == 4
    assert write_report(tmp_path).exists()
    found = opened.read(tmp_path / "claims.nc")
    texts = " ".join(found["figure"].to_numpy().astype(str))
    assert "first alpha against original: peak of contact force 1 unknown" in texts
    assert not re.search(r"\bnan\b.*against|against[^;]*\bnan\b", texts)

"""Certificates of effects: changes with limits, the procedure on formulas, scenes with effects off, command and stage."""

import json
import math
import tomllib
from pathlib import Path

import formula_study
import numpy as np
import opened
import pytest
import tomli_w
import xarray as xr
from commands import overrides, run
from margins import at_least, fewest
from scipy.interpolate import PchipInterpolator

from hpcclear.base.asking import answered
from hpcclear.base.verdict import Verdict
from hpcclear.dynamics.evaluation import evaluate_records
from hpcclear.ensemble.certificate import Certificate, Screening, VariantResult, certificate
from hpcclear.ensemble.trial import Drawn, Trial
from hpcclear.ranks.boundary import alone
from hpcclear.report.figures.effects import label, named, saving, seconds_of, statements
from hpcclear.report.html.sections import _changed
from hpcclear.results import dataset
from hpcclear.results.checkpoint import Checkpoint
from hpcclear.results.names import SECONDS_BY_ROUND, SECONDS_PER_SAMPLE
from hpcclear.scene import load_scene
from hpcclear.scene.switches import Off, switches
from hpcclear.scene.syntax import parse
from hpcclear.statistics.random.paired import deviation_change, mean_change, point_change
from hpcclear.study import certificate as stage
from hpcclear.study.run import StudyRun
from hpcclear.study.simulations import Simulations
from hpcclear.study.stages import certificate_extent

JOBS = Path(__file__).parent.parent / "jobs"
SCENE = JOBS / "slider_crank.toml"
SETTINGS = ("joints.rod_slider.kind=ideal", "effects.gravity=9.81", "effects.slider_load=-0.5")
"""What matters: play, contact damping. What does not, to 2 %: friction, gravity, load."""


# ---- changes ---------------------------------------------------------------------------------------


def test_changes_of_what_is_proportional_are_exact():
    on = np.random.default_rng(0).uniform(1.0, 2.0, (16, 8))
    for found in (mean_change(on, 1.03 * on, 0.95), deviation_change(on, 1.03 * on, 0.95)):
        assert found.value == pytest.approx(0.03, rel=1e-12)
        assert found.limit < 1e-14
    shifted = mean_change(on, on + 0.1, 0.95)
    assert shifted.value == pytest.approx(0.1 / on.mean(), rel=1e-12)
    assert deviation_change(on, on + 0.1, 0.95).value == pytest.approx(0.0, abs=1e-12)
    assert point_change(on, on + 0.1) == pytest.approx(0.1 / on.mean(), rel=1e-12)
    nothing = mean_change(np.zeros((16, 1)), np.zeros((16, 1)), 0.95)
    assert nothing == (0.0, 0.0)
    assert not math.isfinite(mean_change(np.zeros((16, 1)), np.ones((16, 1)), 0.95).value)


def test_limits_hold_the_change_as_often_as_they_say(shift):
    """Designs that differ, pairs that share them, chaos on top: the true change lies within 95 % limits in 95 % of cases."""
    rng, inside = np.random.default_rng(shift + 7), np.zeros(2, int)
    for _ in range(400):
        level = rng.uniform(1.0, 3.0, (16, 1))
        scatter = rng.standard_normal((2, 16, 8))
        chaos = 0.3 * rng.standard_normal((2, 16, 8))
        on = level * (1.0 + 0.1 * scatter[0]) + 0.1 * chaos[0]
        off = 1.02 * level * (1.0 + 0.1 * scatter[0]) + 0.1 * chaos[1]
        found = mean_change(on, off, 0.95)
        inside[0] += abs(found.value - 0.02) <= found.limit
        same = level * (1.0 + 0.1 * scatter[1])  # independent of `on`, of the same deviation
        found = deviation_change(level * (1.0 + 0.1 * scatter[0]), same, 0.95)
        inside[1] += abs(found.value) <= found.limit
    for count in inside:
        at_least(count, fewest(400, 0.94))


def test_pairs_that_fail_leave_a_change_unknown():
    on = np.ones((16, 4))
    off = 1.01 * on
    off[0, 0] = np.nan
    assert mean_change(on, off, 0.95).value == pytest.approx(0.01)
    off[:4] = np.nan  # a quarter
    assert math.isnan(mean_change(on, off, 0.95).value)


# ---- the procedure ---------------------------------------------------------------------------------


def explicit(off):
    """No variant calls for implicit steps."""
    return False


def followed(
    change,
    effects,
    tolerance=0.01,
    noise=0.0,
    most=256,
    saves=None,
    implicit=explicit,
    budget=math.inf,
    works=None,
    possible=lambda off: True,
) -> Certificate:
    """A certificate of a formula: f is 1 + change(off) times a design, with scatter; effect k saves the share saves[k], or
    `works` tells what a sample takes."""
    saves = saves or [0.3] * effects
    works = works or (lambda off: np.prod([1.0 - saves[k] for k in off]))
    plan = Screening(effects, tolerance, 0.99, most, False, False, possible, implicit, budget)

    def seen(one):
        rows = np.arange(one.first, one.last)
        design = 1.0 + 0.5 * np.sin(1.0 + rows)[:, None] * np.ones((1, 4))
        rng = np.random.default_rng([*one.off, 99, one.first])
        f = design * (1.0 + change(one.off)) + noise * rng.standard_normal(design.shape)
        work = 1000.0 * works(one.off)
        return VariantResult(
            f, np.full((*f.shape, 2), 5.0), np.full(f.shape, int(work)), np.full(f.shape, work)
        )

    return answered(certificate(plan), lambda wanted: [seen(one) for one in wanted])


def test_what_is_within_the_tolerance_is_left_out_together():
    sizes = [0.002, 0.2, -0.003, 0.004]
    found = followed(lambda off: sum(sizes[k] for k in off), 4)
    assert found.recommended == (0, 2, 3)
    assert found.book.verdict((1,)) is Verdict.FAILS
    assert found.book.changes((0, 2, 3)).mean.value == pytest.approx(0.003, abs=1e-9)


def test_a_sum_beyond_the_tolerance_drops_what_saves_least():
    """Three changes of 0.4 % each are 1.2 %: the two that save most are left out."""
    found = followed(lambda off: 0.004 * len(off), 3, saves=[0.5, 0.1, 0.3])
    assert found.recommended == (0, 2)


def test_an_effect_whose_absence_costs_more_stays_on():
    found = followed(lambda off: 0.001 * len(off), 2, saves=[-0.5, 0.2])
    assert found.recommended == (1,)
    assert found.book.verdict((0,)) is Verdict.HOLDS
    assert followed(lambda off: 0.001 * len(off), 1, saves=[-0.5]).recommended == ()


def test_effects_that_are_one_another_s_substitute_stay_on():
    """Either of 0 and 1 may go, both may not: alone each change is 0."""

    def change(off):
        return 0.3 if {0, 1} <= set(off) else 0.0

    found = followed(change, 3, saves=[0.2, 0.4, 0.3])
    assert found.recommended == (1, 2)
    assert (0, 1) in found.variants  # the pair that explains it
    pairs = [found.book.changes(off)[0].value for off in ((0, 1), (1, 2))]
    assert pairs == pytest.approx([0.3, 0.0], abs=1e-9)  # alone each changes nothing


def test_chaos_is_averaged_where_that_helps_and_not_believed_where_it_does_not():
    quiet = followed(lambda off: 0.002 * len(off), 1, noise=0.06)
    assert quiet.recommended == (0,)
    assert quiet.book.replicates((0,)) > 16  # it took more than a first look
    loud = followed(lambda off: 0.0, 1, noise=0.5)
    assert loud.recommended == ()
    assert loud.book.verdict((0,)) is Verdict.UNDECIDED
    assert loud.book.replicates((0,)) == 256


def test_what_calls_for_implicit_steps_goes_together():
    """Either film alone is dearer than both, since the dry joint strikes; without both steps are explicit and cheap."""
    work = {(): 1.0, (0,): 2.0, (1,): 1.5, (2,): 0.9}

    def saved(off):
        return work.get(off, 0.05 if {0, 1} <= set(off) else 2.0)

    found = followed(
        lambda off: 0.002 * len(off), 3, works=saved, implicit=lambda off: not {0, 1} <= set(off)
    )
    assert found.recommended == (0, 1, 2)
    assert found.variants == ((), (0,), (1,), (2,), (0, 1, 2))  # none before it, none after


def test_of_two_models_alike_in_cost_the_one_with_less_in_it_is_taken():
    """0 is an effect, 1 what it has beyond a cheaper model, whose evaluations happen to be a few per cent fewer."""
    work = {(0,): 0.5, (1,): 0.48, (2,): 0.9, (0, 2): 0.45, (1, 2): 0.43, (): 1.0}
    found = followed(
        lambda off: 0.0, 3, works=lambda off: work[off], possible=lambda off: not {0, 1} <= set(off)
    )
    assert found.recommended == (0, 2)
    assert (1, 2) not in found.variants


def test_what_fails_is_not_simulated_on():
    found = followed(lambda off: np.nan if off == (0,) else 0.0, 2)
    assert found.book.verdict((0,)) is Verdict.UNDECIDED
    assert found.book.replicates((0,)) == 16
    assert found.recommended == (1,)


# ---- scenes with effects off -----------------------------------------------------------------------


def test_every_effect_of_a_slider_crank_is_found_and_its_entries_go():
    scene = load_scene(
        JOBS / "quickstart.toml",
        ["effects.gravity=9.81", "effects.slider_load=20.0", "effects.guide_friction={coefficient=0.1}",
         'drive={kind="torque", torque=1.0, initial_speed="3000 rpm"}'],
    )  # fmt: skip
    found = {one.name: one for one in switches(scene)}
    assert list(found) == [
        "clearance in crank_rod", "clearance in rod_slider", "friction in joints", "contact damping", "gravity",
        "slider load", "guide friction", "speed fluctuation",
    ]  # fmt: skip
    off = {name: Off(scene, [one]).scene for name, one in found.items()}
    assert off["clearance in crank_rod"].clearance_joints() == ("rod_slider",)
    assert off["friction in joints"].effects.friction.law == "none"
    assert off["contact damping"].effects.contact.law == "hertz"
    assert off["gravity"].effects.gravity == 0.0
    assert off["slider load"].effects.slider_load is None
    assert off["guide friction"].effects.guide_friction is None
    assert off["speed fluctuation"].drive.speed == scene.drive.initial_speed
    for name, one in off.items():  # and nothing else
        assert {k for k in one.resolved() if one.resolved()[k] != scene.resolved()[k]} <= {
            "joints", "drive", "effects", "study",
        }, name  # fmt: skip
        assert load_scene(parse(one.to_toml(), name)) == one


BRISTLES = '{law="lugre", coefficient=0.1, static_coefficient=0.15, stribeck_speed=0.001, bristle_stiffness=1e5}'
FILM = '{viscosity=0.01, length=%s, model="finite"}'
STROKE = (
    "[[0.0, 8.0], [1.5707963267948966, 0.0], [3.141592653589793, 0.0], [4.71238898038469, 4.0]]"
)


def rich(*settings):
    """The paper's mechanism with oil in one joint, bristles, a rod in four modes, tables."""
    return load_scene(
        SCENE,
        [f"joints.crank_rod.film={FILM % 0.02}", f"effects.friction={BRISTLES}", f"effects.slider_load={STROKE}",
         "joints.rod_slider.clearance=1e-4", "mechanism.rod.bending={stiffness=800.0, modes=4, damping=0.01}",
         *settings],
    )  # fmt: skip


def test_cheaper_models_of_an_effect_are_tried_besides_its_absence():
    scene = rich()
    found = {one.name: one for one in switches(scene)}
    assert list(found) == [
        "clearance in crank_rod", "clearance in rod_slider", "oil film in crank_rod", "finite length of the film in crank_rod",
        "friction in joints", "sticking in joints", "contact damping", "bending of rod", "bending of rod beyond 2 modes",
        "bending of rod beyond one mode", "slider load", "variation of slider load",
    ]  # fmt: skip
    off = {name: Off(scene, [one]).scene for name, one in found.items()}
    assert off["oil film in crank_rod"].films() == {}
    (film,) = off["finite length of the film in crank_rod"].films().values()
    assert film == scene.films()["crank_rod"].model_copy(update={"model": "short"})
    sliding = off["sticking in joints"].effects.friction
    assert (sliding.law, sliding.coefficient) == ("coulomb", 0.1)
    # not as steep as Stribeck's speed would make it
    assert sliding.ramp_speed == pytest.approx(0.1 / 50.0)
    assert not off["bending of rod"].bending()
    assert off["bending of rod beyond 2 modes"].modes == 2
    assert off["bending of rod beyond one mode"].modes == 1
    assert off["variation of slider load"].effects.slider_load == pytest.approx(3.0)
    wide = rich(f"joints.crank_rod.film={FILM % 0.08}")  # twice as long as its diameter
    closed = next(one for one in switches(wide) if one.name.startswith("finite"))
    assert Off(wide, [closed]).scene.films()["crank_rod"].model == "long"


def test_two_models_of_one_effect_are_no_set():
    trial = Trial(rich())
    place = {one.name: k for k, one in enumerate(trial.switches)}
    for names in (
        ("oil film in crank_rod", "finite length of the film in crank_rod"),
        ("clearance in crank_rod", "oil film in crank_rod"),
        ("friction in joints", "sticking in joints"),
        ("bending of rod", "bending of rod beyond one mode"),
        ("slider load", "variation of slider load"),
    ):
        assert not trial.possible(tuple(sorted(place[name] for name in names))), names
    assert trial.possible((place["clearance in rod_slider"], place["oil film in crank_rod"]))


def test_ramps_that_call_for_implicit_steps_are_tried_wider():
    steep = {
        '{law="coulomb", coefficient=0.1, ramp_speed=1e-4}': lambda f: f.ramp_speed,
        '{law="ambrosio", coefficient=0.1, speeds=[1e-5, 1e-4]}': lambda f: f.speeds[1],
    }
    for law, speed in steep.items():
        scene = load_scene(SCENE, [f"effects.friction={law}"])
        trial = Trial(scene)
        place = [one.name for one in trial.switches].index("steepness of friction")
        wider = trial.variant((place,)).scene.effects.friction
        assert speed(wider) == pytest.approx(0.002)
        assert wider.coefficient == 0.1
        assert trial.implicit(())
        assert not trial.implicit((place,))
    assert wider.speeds[0] == pytest.approx(0.0002)
    gentle = load_scene(
        SCENE, ['effects.friction={law="coulomb", coefficient=0.1, ramp_speed=0.01}']
    )
    assert "steepness of friction" not in [one.name for one in switches(gentle)]


def test_waves_and_wear_of_joints_are_effects_unless_lives_are_followed():
    worn = "joints.crank_rod.wear={length=0.02, bearing={coefficient=1e-15}}"
    shape = "joints.rod_slider.out_of_round={bearing={cosine_2=1e-5}}"
    play = "joints.rod_slider.clearance=1e-4"
    scene = load_scene(SCENE, [worn, play, shape])
    found = {one.name: one for one in switches(scene)}
    assert not Off(scene, [found["wear of crank_rod"]]).scene.worn_joints()
    assert not any(Off(scene, [found["waves around rod_slider"]]).scene.waves().values())
    lives = load_scene(SCENE, [worn, play, shape, "wear={cycles=1e6}"])
    assert {one.name for one in switches(lives)} == set(found) - {"wear of crank_rod"}


def mean_that_acts(table, turns: int, interpolation: str) -> float:
    """By scipy's monotone cubic, or straight lines, through three periods of a table."""
    angle, value = np.array(table).T
    period = 2.0 * math.pi * turns
    if angle[-1] - angle[0] > 0.999999 * period:  # the first row again
        angle, value = angle[:-1], value[:-1]
    wide, values = np.concatenate([angle - period, angle, angle + period]), np.tile(value, 3)
    if interpolation == "smooth":
        return float(PchipInterpolator(wide, values).integrate(0.0, period)) / period
    places = np.sort(np.concatenate([wide[(wide > 0.0) & (wide < period)], [0.0, period]]))
    return float(np.trapezoid(np.interp(places, wide, values), places)) / period


@pytest.mark.parametrize("interpolation", ["smooth", "linear"])
@pytest.mark.parametrize("seed", range(4))
def test_a_load_without_its_variation_is_the_mean_of_the_curve_that_acts(seed, interpolation):
    """Between few uneven rows the mean of the cubic is far from that of straight lines."""
    rng = np.random.default_rng(seed)
    for turns in (1, 2):
        angles = np.sort(rng.uniform(0.0, 2.0 * math.pi * turns, 3 + seed))
        table = np.column_stack([angles, rng.uniform(-900.0, 900.0, len(angles))]).tolist()
        content = load_scene(JOBS / "linkages" / "four_stroke.toml").resolved()
        content["mechanism"]["drives"]["motor"]["turns"] = turns
        content["mechanism"]["loads"]["gas"]["size"] = table
        content["numerics"]["interpolation"] = interpolation
        scene = load_scene({key: value for key, value in content.items() if key != "study"})
        gas = next(one for one in switches(scene) if one.name == "variation of gas")
        (load,) = (one for one in Off(scene, [gas]).scene.mechanism.loads if one.name == "gas")
        assert load.size == pytest.approx(mean_that_acts(table, turns, interpolation), rel=1e-9)


def test_columns_drive_what_is_left_and_the_study_forgets_what_is_gone():
    scene = load_scene(
        JOBS / "quickstart.toml",
        ["study.variables.g={path='effects.gravity', range=[1.0, 10.0]}", "effects.gravity=9.81",
         "study.random.g={distribution='uniform', half_width=0.5}",
         'study.cases.heavy=["g"]', 'study.surrogate.optimisation=["m2", "m3", "u2", "I2", "C", "g"]'],
    )  # fmt: skip
    found = {one.name: one for one in switches(scene)}
    off = Off(scene, [found["clearance in rod_slider"], found["gravity"]])
    assert off.paths(scene.study.variable("C").paths) == ("joints.crank_rod.clearance",)
    assert off.paths(("effects.gravity",)) == ()
    study = off.scene.study
    assert "g" not in study.names
    assert [case.name for case in study.cases] == ["deterministic", "robust"]
    assert study.variable("C").paths == ("joints.crank_rod.clearance",)


def test_a_linkage_has_its_effects_by_name():
    scene = load_scene(JOBS / "linkages" / "four_stroke.toml")
    found = {one.name: one for one in switches(scene)}
    assert {"clearance in big_end", "guide friction in bore", "force gas", "gravity"} <= set(found)
    off = Off(
        scene, [found["clearance in big_end"], found["guide friction in bore"], found["force gas"]]
    )
    joints = off.scene.resolved()["mechanism"]["joints"]
    assert joints["big_end"]["kind"] == "revolute"
    assert "friction" not in joints["bore"]
    assert "gas" not in off.scene.resolved()["mechanism"].get("loads", {})


# ---- bad input -------------------------------------------------------------------------------------


IDEAL = ("joints.crank_rod.kind=ideal", "joints.rod_slider.kind=ideal")


@pytest.mark.parametrize(
    ("words", "found"),
    [
        (["--tolerance", "0"], "--tolerance"),
        (["--tolerance", "nan"], "--tolerance"),
        (["--tolerance", "150%"], "--tolerance"),
        (
            overrides(*IDEAL, "effects.friction=none"),
            "no effect",
        ),
        (
            overrides(*IDEAL, "effects.friction=none", "effects.gravity=9.81"),
            "peak-crank-moment",
        ),
        (["--samples", "3"], "--samples"),
        (["-o", "one.nc", "--scene", "x/../one.nc"], "--output names this file too"),
    ],
)  # fmt: skip
def test_bad_words_end_with_2(tmp_path, words, found):
    code, output = run(["effects", str(SCENE), "-o", str(tmp_path / "e.nc"), *words], 0)
    assert code == 2, output
    assert found in output
    assert not (tmp_path / "e.nc").exists()


# ---- the command -----------------------------------------------------------------------------------


def words(output: Path, *further: str) -> list[str]:
    quick = ["--tolerance", "2%", "--samples", "64", *further]
    return ["effects", str(SCENE), "-o", str(output), *overrides(*SETTINGS), *quick]


@pytest.fixture(scope="module")
def certified(tmp_path_factory):
    """Folder and output of one run."""
    place = tmp_path_factory.mktemp("effects")
    code, output = run(
        words(place / "e.nc", "--details", "--scene", str(place / "reduced.toml")), 0
    )
    assert code == 0, output
    return place, output


def test_the_scene_that_is_printed_stays_within_the_tolerance(certified):
    """By points of its own, which the certificate has not seen."""
    place, output = certified
    content = opened.read(place / "e.nc", "effects")
    chosen = int(np.argmax(content["recommended"].to_numpy()))
    off = content["off"].to_numpy()[chosen]
    names = content["effect"].to_numpy()
    assert set(names[off == 1]) == {"friction in joints", "gravity", "slider load"}
    whole = load_scene(SCENE, SETTINGS)
    text = _changed(dataset.read(place / "e.nc", "effects"))
    assert text.splitlines()[0] in " ".join(output.split())
    pasted = tomllib.loads(text)
    reduced = load_scene({**whole.resolved(), **pasted})
    assert reduced == load_scene(place / "reduced.toml")
    assert reduced.effects.gravity == 0.0
    assert reduced.effects.friction.law == "none"
    points = Drawn(whole).points(64, 80)
    on, less = (evaluate_records(one, points)["objective"] for one in (whole, reduced))
    assert abs(less.mean() / on.mean() - 1.0) < 0.02
    assert float(content["change"][chosen, 0]) == pytest.approx(
        less.mean() / on.mean() - 1.0, abs=2e-3
    )


def test_savings_have_intervals_and_these_hold(certified, shift):
    """A machine that slows down and speeds up changes all times of a round alike; what is left scatters by 5 %."""
    content = opened.read(certified[0] / "e.nc", "effects")
    name = label(named(content, 1))
    rng, held = np.random.default_rng([11, shift]), 0
    for _ in range(200):
        speed = 10.0 ** rng.uniform(-1.0, 1.0, 5)
        scatter = 1.0 + 0.05 * rng.standard_normal((2, 5))
        times = {"all on": speed * scatter[0], name: 0.6 * speed * scatter[1]}
        found = saving(content, 1, times)
        held += abs(found.share - 0.4) <= found.half
    assert held >= fewest(200, 0.93)
    drift = saving(content, 1, {"all on": [1.0, 3.0, 9.0], name: [0.6, 1.8, 5.4]})
    assert drift[:2] == pytest.approx((0.4, 0.0), abs=1e-12)
    old = xr.Dataset(attrs={SECONDS_BY_ROUND: json.dumps({"all on": [4.0], name: [1.0]})})
    assert saving(content, 1, seconds_of(old)).words == "about 75 %"


def test_a_linkage_is_certified(tmp_path):
    """A crank-rocker with one soft, well damped pin, which moves regularly: a breath of a torque does not matter."""
    scene = load_scene(JOBS / "linkages" / "crank_rocker.toml", ["study.cases={}"]).with_(
        {"study": None}
    )
    content = scene.resolved()
    content["numerics"] |= {"transient_revolutions": 1, "averaged_revolutions": 1}
    content["mechanism"]["joints"]["o3"] = {
        "kind": "revolute",
        "journal": "coupler.b",
        "bearing": "rocker.b",
    }
    content["mechanism"]["joints"]["o2"]["materials"]["bearing"]["youngs_modulus"] = 5e7
    content["effects"]["contact"] = {"law": "hunt-crossley", "damping": 20.0}
    content["mechanism"]["loads"] = {"breath": {"kind": "torque", "body": "rocker", "torque": 1e-9}}
    file = tmp_path / "linkage.toml"
    file.write_text(tomli_w.dumps(content), encoding="utf-8")
    code, output = run(["effects", str(file), "-o", str(tmp_path / "e.nc"), "--samples", "64"], 0)
    assert code == 0, output
    found = opened.read(tmp_path / "e.nc", "effects")
    rows = {str(name): k + 1 for k, name in enumerate(found["effect"].to_numpy())}
    assert set(rows) >= {"clearance in o2", "friction in joints", "gravity", "torque breath"}
    assert float(found["change"][rows["clearance in o2"], 0]) == -1.0  # no other gap is left
    assert int(found["decision"][rows["torque breath"]]) == Verdict.HOLDS
    chosen = found.isel(variant=int(np.argmax(found["recommended"].to_numpy())))
    assert int(chosen["off"].sel(effect="torque breath")) == 1
    assert int(chosen["off"].sel(effect="clearance in o2")) == 0


# ---- the stage of a study --------------------------------------------------------------------------


def test_the_stage_keeps_its_simulations(monkeypatch, tmp_path):
    """On a mechanism that is a formula, which no effect changes but the clearance that it reads."""
    formula_study.formula.replace_dynamics(monkeypatch.setattr)
    monkeypatch.setattr(Trial, "seconds", lambda trial, variants: {"all on": [2.0, 3.0, 7.0]})
    settings = [
        "study.certificate={tolerance=0.05, samples=128}",
        'numerics.objective_joints=["crank_rod"]',
    ]
    scene = formula_study.whole(*settings)
    told: list[str] = []

    def once():
        units = {variable.name: variable.unit for variable in scene.study.variables}
        checkpoint = Checkpoint(tmp_path / "checkpoint", {"a": "b"}, units=units)
        ranks = alone()
        simulations = Simulations(scene, ranks, checkpoint, "quiet")
        run = StudyRun(scene, tmp_path, ranks, checkpoint, simulations, told.append)
        stage.certify(run, certificate_extent(scene, 128))
        return run, (tmp_path / "effects.nc").read_bytes()

    first, written = once()
    assert json.loads(first.times[SECONDS_PER_SAMPLE]) == {"all on": 3.0}
    content = opened.read(tmp_path / "effects.nc", "effects")
    chosen = content.isel(variant=int(np.argmax(content["recommended"].to_numpy())))
    assert int(chosen["off"].sum()) == 2  # the other play, and contact damping
    assert any("can be neglected: clearance in rod_slider, contact damping" in one for one in told)
    monkeypatch.setattr(stage, "sample_points", None)  # all is kept: nothing is simulated again
    assert once()[1] == written
    assert statements(content, {}) is not None
    assert isinstance(content, xr.Dataset)

"""Variables that take some values only, distributions that depend on the design, and what they cost."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from hpcclear.base.errors import InputError
from hpcclear.scene import load_scene
from hpcclear.scene.cases import Goal
from hpcclear.scene.domain import box
from hpcclear.scene.fits import fit_of
from hpcclear.scene.points import Points, expanded, latin_hypercube, snapped
from hpcclear.scene.sampling import monte_carlo

JOB = tomllib.loads(
    (Path(__file__).parent.parent / "jobs" / "robust_slider_crank.toml").read_text()
)
FITS = ["40 H7/f7", "40 H7/g6", "40 H6/g5"]
OF_FIT = {"fits": FITS, "paths": ["joints.crank_rod.fit", "random.C12.fit"]}
RODS = [
    {"name": "steel", "mechanism.rod.mass": "0.21 kg", "mechanism.rod.inertia": 2.6e-4},
    {"name": "titanium", "mechanism.rod": {"mass": "0.12 kg", "inertia": "150 kg mm2"}},
]


def scene_with(variables=(), random=(), cases=None, **study):
    """The slider-crank with a fit in its first joint, and these variables and random inputs."""
    content = {key: dict(table) for key, table in JOB.items() if isinstance(table, dict)}
    joint = {k: v for k, v in JOB["joints"]["crank_rod"].items() if k not in ("clearance", "bearing_radius")}  # fmt: skip
    content["joints"]["crank_rod"] = {**joint, "fit": FITS[0]}
    content["mechanism"]["rod"] = {**JOB["mechanism"]["rod"], "mass": 0.21, "inertia": 2.6e-4}
    content["study"] = {
        "seed": 4, "samples": 60, "variables": dict(variables), "random": dict(random),
        "sensitivity": {"groups": []}, **study,
    }  # fmt: skip
    if cases:
        content["study"]["cases"] = cases
    return load_scene(content)


M3 = {"range": [0.1, 0.2]}
C12 = {"path": "joints.crank_rod.clearance", "range": ["1 um", "70 um"]}


@pytest.mark.parametrize(
    ("row", "options"),
    [
        ({"values": [0.2, "100 g", 0.15]}, (0.1, 0.15, 0.2)),
        ({"range": [0.1, 0.2], "step": 0.025}, (0.1, 0.125, 0.15, 0.175, 0.2)),
        ({"range": [0.1, 0.21], "step": "40 g"}, (0.1, 0.14, 0.18)),
    ],
)
def test_lists_and_grids_are_sampled_evenly(row, options):
    scene = scene_with({"m3": row, "m2": {"range": [0.1, 0.4]}})
    assert scene.study.variable("m3").options == pytest.approx(options)
    assert load_scene(scene.resolved()) == scene
    for points in (latin_hypercube(scene), monte_carlo(scene, 60, stratified=True)):
        found, counts = np.unique(points.column("m3"), return_counts=True)
        assert found == pytest.approx(options)
        assert np.ptp(counts) <= 1
    near = snapped(scene.study, ("m3",), np.array([[0.0], [0.119], [9.0]]))[:, 0]
    assert set(near) <= set(scene.study.variable("m3").options)
    assert (near[0], near[-1]) == pytest.approx((options[0], options[-1]))


def test_what_scatters_about_a_value_is_modelled_between_values():
    row = {"distribution": "uniform", "half_width": 0.005}
    scene = scene_with({"m3": {"values": [0.1, 0.2]}, "m2": {"values": [0.1, 0.3]}}, {"m3": row})
    places = np.array([[0.14, 0.14]])
    assert snapped(scene.study, ("m3", "m2"), places) == pytest.approx(np.array([[0.1, 0.1]]))
    model = snapped(scene.study, ("m3", "m2"), places, model=True)
    assert model == pytest.approx(np.array([[0.14, 0.1]]))
    assert box(scene, ("m3",), ["m3"]).upper[0] == pytest.approx(0.205)


def test_rows_of_a_catalogue_stand_for_all_their_entries():
    scene = scene_with({"rod": {"catalogue": RODS}, "m3": M3})
    points = latin_hypercube(scene)
    assert set(points.column("rod")) == {0.0, 1.0}
    whole = expanded(scene.study, points)
    mass = whole.column("mechanism.rod.mass")
    assert mass == pytest.approx(np.where(points.column("rod") == 1.0, 0.12, 0.21))
    heavy = whole.column("mechanism.rod.inertia")
    assert heavy == pytest.approx(np.where(points.column("rod") == 1.0, 1.5e-4, 2.6e-4))
    assert whole.paths[whole.names.index("mechanism.rod.mass")] == ("mechanism.rod.mass",)
    assert scene.baseline("rod") == 0.0
    assert load_scene(scene.resolved()) == scene
    plain = Points(("m3",), [[0.1]], (("mechanism.slider.mass",),))
    assert expanded(scene.study, plain) is plain


def test_a_random_clearance_follows_the_fit_of_its_design():
    scene = scene_with({"fit": OF_FIT, "C12": C12, "m3": M3}, {"C12": {"distribution": "fit"}})
    row = scene.study.random_input("C12")
    for k, text in enumerate(FITS):
        fit = fit_of(text)
        assert scene.study.law(row, {"fit": float(k)}).span == pytest.approx(fit.clearances)
        design = {"fit": float(k), "C12": 0.0, "m3": 0.1}
        drawn = monte_carlo(scene, 500, design=design)
        low, high = fit.clearances
        assert ((drawn.column("C12") >= low) & (drawn.column("C12") <= high)).all()
        assert np.mean(drawn.column("C12")) == pytest.approx(fit.clearance, rel=0.02)
        radius = expanded(scene.study, drawn).column("joints.crank_rod.bearing_radius")
        assert radius == pytest.approx(fit.bearing_radius)
    mixed = monte_carlo(scene, 300)  # every row is a design
    for k, text in enumerate(FITS):
        here = mixed.column("C12")[mixed.column("fit") == k]
        low, high = fit_of(text).clearances
        assert here.size > 50
        assert low <= here.min() <= here.max() <= high
    assert load_scene(scene.resolved()) == scene


def test_widths_that_are_variables_and_shares_of_the_design():
    width = {"range": ["1 g", "10 g"], "path": "random.m3.half_width"}
    scene = scene_with(
        {"m3": M3, "m2": {"range": [0.1, 0.4]}, "t": width},
        {"m3": {"distribution": "uniform", "half_width": 0.005},
         "m2": {"distribution": "normal", "deviation": "2 %"}},
    )  # fmt: skip
    assert scene.study.variable("t").unit == "kg"
    assert scene.baseline("t") == 0.005
    assert scene.study.variable("t").silent
    assert scene.study.models[-1] == ("m3", "m2")
    design = {"m3": 0.15, "m2": 0.3, "t": 0.01}
    points = monte_carlo(scene, 4000, design=design, stratified=True)
    assert np.ptp(points.column("m3")) == pytest.approx(0.02, rel=1e-2)
    assert np.std(points.column("m2")) == pytest.approx(0.006, rel=1e-2)
    low, high = scene.study.reach(scene.study.random_input("m3"))
    assert (low, high) == pytest.approx((-0.01, 0.01))


def test_costs():
    grades = {"fits": FITS, "path": "joints.crank_rod.fit", "cost": {"IT5": 4, "IT6": 2, "IT7": 1}}
    rods = [{**row, "cost": cost} for row, cost in zip(RODS, (2, 7), strict=True)]
    masses = {"values": [0.2, 0.1], "cost": [5, 8]}  # sorted with their values
    scene = scene_with({"fit": grades, "rod": {"catalogue": rods}, "m3": masses})
    goal = Goal(statistic="cost")
    goal.priced_by(scene.study.variables)
    found = goal.of_design({"fit": np.arange(3.0), "rod": np.ones(3), "m3": np.full(3, 0.1)})
    assert found == pytest.approx(np.array([2, 3, 6]) + 7 + 8)


@pytest.mark.parametrize(
    ("cost", "width", "expected"),
    [
        ({"law": "reciprocal", "at": "10 um", "cost": 3}, 2e-5, 1.5),
        ({"law": "reciprocal", "at": "10 um", "cost": 3, "power": 2, "fixed": 1}, 2e-5, 1.75),
        ({"law": "exponential", "at": "10 um", "cost": 3, "scale": "5 um"}, 1.5e-5, 3 / np.e),
    ],
)
def test_laws_of_cost(cost, width, expected):
    widths = {"range": ["1 um", "50 um"], "path": "random.C12.half_width", "cost": cost}
    study = scene_with(
        {"C12": {**C12, "range": ["1 um", "150 um"]}, "w": widths},
        {"C12": {"distribution": "uniform", "mean": "60 um", "half_width": "10 um"}},
    ).study
    assert study.variable("w").costs(width) == pytest.approx(expected)


REFUSED = {
    "one value": ({"m3": {"values": [0.1]}}, {}, "from 2 to"),
    "twice": ({"m3": {"values": [0.1, "100 g"]}}, {}, "twice"),
    "wrong unit": ({"m3": {"values": [0.1, "3 mm"]}}, {}, "does not fit"),
    "no text": ({"m3": {"values": "0.1"}}, {}, "numbers are expected"),
    "range and values": ({"m3": {"range": [0.1, 0.2], "values": [0.1, 0.2]}}, {}, "a range or"),
    "step beside values": ({"m3": {"values": [0.1, 0.2], "step": 0.1}}, {}, "belongs to a range"),
    "too wide a step": ({"m3": {"range": [0.1, 0.2], "step": 1.0}}, {}, "gives 1 values"),
    "negative step": ({"m3": {"range": [0.1, 0.2], "step": -0.1}}, {}, "above 0"),
    "too fine a step": ({"m3": {"range": [0.1, 0.2], "step": 1e-6}}, {}, "from 2 to 1000"),
    "outside": ({"m3": {"values": [-0.1, 0.2]}}, {}, "above 0"),
    "fit of nothing": ({"fit": {"fits": FITS}}, {}, "needs a path"),
    "fit of a mass": ({"fit": {"fits": FITS, "path": "mechanism.rod.mass"}}, {}, "no fit of a joint"),
    "tight fit": ({"fit": {**OF_FIT, "fits": ["40 H7/p6", "40 H7/f7"]}, "C12": C12},
                  {"C12": {"distribution": "fit"}}, "without clearance"),
    "fits twice": ({"fit": {"fits": FITS[:1] * 2, "path": "joints.crank_rod.fit"}}, {}, "twice"),
    "baseline": ({"fit": {"fits": FITS[1:], "path": "joints.crank_rod.fit"}}, {}, "not among its rows"),
    "unknown input": ({"m3": M3, "t": {"range": [1e-3, 2e-3], "path": "random.q.half_width"}}, {}, "not a random input"),
    "no such entry": ({"m3": M3, "t": {"range": [1e-3, 2e-3], "path": "random.m3.width"}},
                      {"m3": {"distribution": "uniform", "half_width": 0.01}}, "no entry of a random input"),
    "not given": ({"m3": M3, "t": {"range": [1e-3, 2e-3], "path": "random.m3.deviation"}},
                  {"m3": {"distribution": "uniform", "half_width": 0.01}}, "has no deviation"),
    "too wide": ({"m3": M3, "t": {"range": [1e-3, 0.2], "path": "random.m3.half_width"}},
                 {"m3": {"distribution": "uniform", "mean": 0.15, "half_width": 0.01}}, "wider than its domain"),
    "share of a ratio": ({"I2": {"ratio": [1, 4]}}, {"I2": {"distribution": "uniform", "half_width": "3 %"}}, "a share"),
    "share and number": ({"m3": M3}, {"m3": {"distribution": "truncated-normal", "half_width": "3 %", "deviation": 1e-3}},
                         "what stands beside it is none"),
    "rows differ": ({"rod": {"catalogue": [RODS[0], {"name": "b", "mechanism.rod.mass": 1}]}}, {}, "differ in"),
    "unknown entry": ({"rod": {"catalogue": [{"name": "a", "mechanism.rod.colour": 1}, RODS[0]]}}, {}, "not a physical number"),
    "nameless": ({"rod": {"catalogue": [{"mechanism.rod.mass": 1}, RODS[0]]}}, {}, "is missing"),
    "half priced": ({"rod": {"catalogue": [{**RODS[0], "cost": 1}, RODS[1]]}}, {}, "some rows have a cost"),
    "driven twice": ({"rod": {"catalogue": RODS}, "m2": {"range": [0.1, 0.3]}}, {}, "both drive"),
    "no mechanism": ({"rod": {"catalogue": [{"name": "long", "mechanism.rod.length": 0.12},
                                            {"name": "short", "mechanism.rod.length": 0.01}]}}, {}, "makes no mechanism"),
    "costs": ({"m3": {"values": [0.1, 0.2], "cost": [1]}}, {}, "1 costs for 2 options"),
    "cost of a range": ({"m3": {"range": [0.1, 0.2], "cost": [1, 2]}}, {}, "the variable has none"),
    "no law": ({"m3": {"range": [0.1, 0.2], "cost": {"at": 0.1, "cost": 1}}}, {}, "law of the cost is missing"),
    "law without scale": ({"m3": {"range": [0.1, 0.2], "cost": {"law": "exponential", "at": 0.1, "cost": 1}}}, {}, "needs it"),
    "grade": ({"fit": {"fits": FITS, "path": "joints.crank_rod.fit", "cost": {"IT7": 1}}}, {}, "no cost of IT6"),
    "one load": ({"m3": M3, "n": {"range": [1, 2], "over": "worst", "path": "drive.speed"}}, {}, "values or rows"),
    "word": ({"m3": M3, "n": {"values": [1, 2], "over": "wurst", "path": "drive.speed"}}, {}, 'Write over = "worst"'),
    "weight": ({"m3": M3, "n": {"values": [1, 2], "over": [1, -1], "path": "drive.speed"}}, {}, "must be at least 0"),
    "weights": ({"m3": M3, "n": {"values": [1, 2], "over": [1], "path": "drive.speed"}}, {}, "as many weights"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_refused(case):
    variables, random, words = REFUSED[case]
    with pytest.raises(InputError) as caught:
        scene_with(variables, random)
    error = caught.value
    assert error.key.startswith("study."), error.key
    assert words in f"{error.reason}. {error.remedy}", str(error)

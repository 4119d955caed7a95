"""Fits of ISO 286 against published limit deviations, the clearance that they give, and its distribution against draws."""

import itertools

import numpy as np
import pytest
from refusals import refused
from running import scene_with
from scipy.special import ndtr, ndtri

from hpcclear.base.errors import InputError
from hpcclear.scene import load_scene
from hpcclear.scene.fits import PARTS, SIZES, fit_of, law_of

STEPS = SIZES
SHAFTS = {
    "d9": ((-20, -45), (-30, -60), (-40, -76), (-50, -93), (-65, -117), (-80, -142), (-100, -174), (-120, -207), (-145, -245),
           (-170, -285), (-190, -320), (-210, -350), (-230, -385)),
    "e8": ((-14, -28), (-20, -38), (-25, -47), (-32, -59), (-40, -73), (-50, -89), (-60, -106), (-72, -126), (-85, -148),
           (-100, -172), (-110, -191), (-125, -214), (-135, -232)),
    "f7": ((-6, -16), (-10, -22), (-13, -28), (-16, -34), (-20, -41), (-25, -50), (-30, -60), (-36, -71), (-43, -83), (-50,
    -96),
           (-56, -108), (-62, -119), (-68, -131)),
    "f8": ((-6, -20), (-10, -28), (-13, -35), (-16, -43), (-20, -53), (-25, -64), (-30, -76), (-36, -90), (-43, -106), (-50,
    -122),
           (-56, -137), (-62, -151), (-68, -165)),
    "g5": ((-2, -6), (-4, -9), (-5, -11), (-6, -14), (-7, -16), (-9, -20), (-10, -23), (-12, -27), (-14, -32), (-15, -35),
           (-17, -40), (-18, -43), (-20, -47)),
    "g6": ((-2, -8), (-4, -12), (-5, -14), (-6, -17), (-7, -20), (-9, -25), (-10, -29), (-12, -34), (-14, -39), (-15, -44),
           (-17, -49), (-18, -54), (-20, -60)),
    "h6": ((0, -6), (0, -8), (0, -9), (0, -11), (0, -13), (0, -16), (0, -19), (0, -22), (0, -25), (0, -29), (0, -32), (0,
    -36),
           (0, -40)),
    "h9": ((0, -25), (0, -30), (0, -36), (0, -43), (0, -52), (0, -62), (0, -74), (0, -87), (0, -100), (0, -115), (0, -130),
           (0, -140), (0, -155)),
    "h11": ((0, -60), (0, -75), (0, -90), (0, -110), (0, -130), (0, -160), (0, -190), (0, -220), (0, -250), (0, -290), (0,
    -320),
            (0, -360), (0, -400)),
}  # fmt: skip
"""Upper and lower limit deviations of shafts as ISO 286-2 prints them, in micrometres, by range of sizes."""
C11 = (
    (-60, -120), (-70, -145), (-80, -170), (-95, -205), (-110, -240), (-120, -280), (-130, -290), (-140, -330), (-150, -340),
    (-170, -390), (-180, -400), (-200, -450), (-210, -460), (-230, -480), (-240, -530), (-260, -550), (-280, -570), (-300,
    -620),
    (-330, -650), (-360, -720), (-400, -760), (-440, -840), (-480, -880),
)  # fmt: skip
"""The same of c11, by part of a range."""
HOLES = {
    "H5": (4, 5, 6, 8, 9, 11, 13, 15, 18, 20, 23, 25, 27),
    "H6": (6, 8, 9, 11, 13, 16, 19, 22, 25, 29, 32, 36, 40),
    "H7": (10, 12, 15, 18, 21, 25, 30, 35, 40, 46, 52, 57, 63),
    "H8": (14, 18, 22, 27, 33, 39, 46, 54, 63, 72, 81, 89, 97),
    "H9": (25, 30, 36, 43, 52, 62, 74, 87, 100, 115, 130, 140, 155),
    "H10": (40, 48, 58, 70, 84, 100, 120, 140, 160, 185, 210, 230, 250),
    "H11": (60, 75, 90, 110, 130, 160, 190, 220, 250, 290, 320, 360, 400),
}
"""Upper limit deviations of holes."""
PREFERRED = (
    "H11/c11",
    "H9/d9",
    "H8/e8",
    "H8/f7",
    "H7/f7",
    "H7/g6",
    "H7/h6",
    "H8/h9",
    "H9/h9",
    "H11/h11",
    "H6/g5",
    "H8/f8",
)
CASES = {
    "20 H7/f7": (20, 62), "12 H7/g6": (6, 35), "20 H11/c11": (110, 370), "20 H9/d9": (65, 169), "20 H8/f7": (20, 74),
    "20 H7/g6": (7, 41), "20 H7/h6": (0, 34), "100 H11/c11": (170, 610), "100 H8/f7": (36, 125), "100 H7/g6": (12, 69),
    "250 H11/c11": (280, 860), "500 H9/d9": (230, 540), "1 H7/g6": (2, 18), "6 H8/f7": (10, 40),
    # of the shaft basis
    "20 F8/h6": (20, 66), "20 G7/h6": (7, 41), "20 D9/h9": (65, 169), "20 C11/h11": (110, 370), "20 E9/h9": (40, 144),
}  # fmt: skip
"""Least and largest clearance of both diameters in micrometres, by ANSI B4.2 (1978), tables 2 to 4, and DIN 7154 and 7155."""


def micrometres(fit):
    return tuple(round(2e6 * one, 6) for one in fit.clearances)


def test_preferred_fits_of_all_sizes():
    """Each size at, just below and just above a step."""
    sizes = sorted({*PARTS, *(p - 0.5 for p in PARTS), *(p + 0.5 for p in PARTS[:-1]), 1.0})
    for size, name in itertools.product(sizes, PREFERRED):
        hole, shaft = name.split("/")
        band = next(k for k, step in enumerate(STEPS) if size <= step)
        part = next(k for k, step in enumerate(PARTS) if size <= step)
        upper, lower = C11[part] if shaft == "c11" else SHAFTS[shaft][band]
        fit = fit_of(f"{size:g} {name}")
        assert fit.shaft == (lower, upper), (size, name)
        assert fit.hole == (0, HOLES[hole][band]), (size, name)
        assert micrometres(fit) == (-upper, HOLES[hole][band] - lower), (size, name)


@pytest.mark.parametrize("text", CASES)
def test_published_clearances(text):
    assert micrometres(fit_of(text)) == CASES[text]
    size, classes = text.split(" ")
    for spelled in (
        f"{size}{classes}",
        f"Ø{size} {classes}",
        f" {size} mm {classes} ",
        text.replace("/", " / "),
    ):
        assert fit_of(spelled) == fit_of(text)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("20 H7/p6", "leaves -35 to -1 um"), ("20 H7/k6", "leaves -15 to 19 um"), ("20 H7/js6", "leaves -6.5 to 27.5 um"),
        ("H7/f7", "nominal size in mm"), ("20 f7/H7", "hole, with its capital letter"), ("0 H7/f7", "no size above 0"),
        ("501 H7/f7", "to 500 mm"), ("12,5 H7/f7", "decimal point"), ("20 H12/f7", "no grade from 5 to 11"), ("20 H7",
        "20 H7/f7"),
        ("20 X7/f7", "A to H and JS"), ("20 H7/zc7", "a to h"), ("", "20 H7/f7"), (7, "in quotes"),
    ],
)  # fmt: skip
def test_other_fits_are_refused(text, words):
    with refused(said=words, match=r"joints\.crank_rod\.fit"):
        scene_with({"joints.crank_rod.fit": text})


def draws_of(limits, entries, rng, count):
    """Diameters of one part, by a way of its own: draws of a normal, those beyond the limits thrown away."""
    lower, upper = limits
    if entries.get("distribution") == "uniform":
        return rng.uniform(lower, upper, count)
    cp, cpk = entries.get("cp", 1.0), entries.get("cpk", entries.get("cp", 1.0))
    spread = (upper - lower) / (6 * cp)
    mean = (
        (upper - 3 * cpk * spread)
        if entries.get("towards") == "upper"
        else (lower + 3 * cpk * spread)
    )
    found = np.empty(0)
    while len(found) < count:
        more = rng.normal(mean, spread, count)
        if entries.get("inspected", True):
            more = more[(more >= lower) & (more <= upper)]
        found = np.concatenate([found, more])
    return found[:count]


@pytest.mark.parametrize(
    ("bore", "pin"),
    [
        ({}, {}),
        ({"cp": 1.67}, {"cp": 1.33, "cpk": 1.0, "towards": "upper"}),
        ({"distribution": "uniform"}, {"distribution": "uniform"}),
        ({"cp": 0.5}, {"cp": 1.0, "inspected": False}),
        ({"cp": 1.0, "cpk": 0.0, "towards": "lower"}, {"distribution": "uniform"}),
        ({"cp": 1.33, "cpk": 0.7, "towards": "upper", "inspected": False}, {"cp": 2.0}),
    ],
)
def test_distribution_of_a_fit_against_a_million_draws(bore, pin):
    fit, count = fit_of("20 H7/f7"), 1_000_000
    law = law_of({"fit": "20 H7/f7", "bore": bore, "pin": pin})
    rng = np.random.default_rng(286)
    drawn = np.sort(
        draws_of(fit.diameters("hole"), bore, rng, count) - draws_of(fit.diameters("shaft"), pin, rng, count)
    ) / 2  # fmt: skip
    chances = np.array([1e-3, 0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99, 0.999])
    # order statistics: the 99.99 % confidence interval of each quantile
    reach = 3.9 * np.sqrt(chances * (1 - chances) * count)
    low, high = (drawn[(chances * count + side * reach).astype(int)] for side in (-1, 1))
    found = law(chances)
    assert ((found >= low) & (found <= high)).all(), (low, found, high)
    assert law.span[0] <= drawn[0]
    assert drawn[-1] <= law.span[1]
    values = law((np.arange(100_000) + 0.5) / 100_000)
    assert values.mean() == pytest.approx(drawn.mean(), abs=4 * drawn.std() / 1000)
    assert values.std() == pytest.approx(drawn.std(), rel=4e-3)


def test_two_uniform_parts_of_equal_width_make_a_triangle():
    """Exactly known: quantiles of the triangular distribution."""
    entry = {"distribution": "uniform"}
    law = law_of({"fit": "20 H7/f7", "bore": entry, "pin": entry})
    chances = np.linspace(1e-4, 1 - 1e-4, 501)
    half = np.where(chances < 0.5, np.sqrt(chances / 2), 1 - np.sqrt((1 - chances) / 2))
    np.testing.assert_allclose(law(chances), 10e-6 + 21e-6 * half, rtol=0, atol=2e-9)


def test_wide_normals_add_their_variances():
    """Parts that are not inspected: the difference of two normals is normal."""
    entry = {"cp": 1.5, "inspected": False}
    law = law_of({"fit": "20 H7/f7", "bore": entry, "pin": entry})
    spread = 21e-6 / 9 * np.sqrt(2) / 2
    chances = ndtr(np.linspace(-4, 4, 81))
    np.testing.assert_allclose(law(chances), 20.5e-6 + spread * ndtri(chances), rtol=0, atol=1e-9)


def studied(changes):
    base = {"study.variables.m2": {"range": ["100 g", "200 g"]}}
    return scene_with({**base, **changes})


def test_a_joint_by_its_fit():
    scene = scene_with({"joints.crank_rod.fit": "20 H7/f7"})
    joint = scene.joints.crank_rod
    assert joint.clearance == 20.5e-6
    assert tuple(map(str, scene.readings)) == (
        "joints.crank_rod.fit: '20 H7/f7' is read as a radial clearance of 10 to 31 um, here 20.5 um, and a bearing radius of "
        "10.00525 mm",
    )
    assert joint.bearing_radius == pytest.approx(10.00525e-3, rel=1e-15)
    assert joint.bearing_radius - joint.clearance == pytest.approx(19.9695e-3 / 2, rel=1e-12)
    assert scene.joints.rod_slider.clearance == 3e-4
    half = scene_with({"joints.crank_rod.diametral_clearance": "0.5 mm"})
    assert half.joints.crank_rod.clearance == 2.5e-4
    assert half.joints.crank_rod.bearing_radius == 0.02
    again = scene.with_({"joints.crank_rod.clearance": "0.1 mm"})
    assert again.joints.crank_rod.clearance == 1e-4
    assert again.joints.crank_rod.bearing_radius == joint.bearing_radius
    assert load_scene(scene.resolved()) == scene


def test_in_a_file_and_by_set(tmp_path):
    text = load_scene("jobs/linkages/crank_rocker.toml").to_toml()
    path = tmp_path / "scene.toml"
    path.write_text(text)
    joint = next(iter(load_scene(path).clearance_joints()))
    key = f"mechanism.joints.{joint}"
    by_set = load_scene(path, [f"{key}.fit=25 H8/f7"])
    assert by_set.number(f"{key}.clearance") == (33 + 20 + 41) / 4e6
    assert by_set.number(f"{key}.bearing_radius") == pytest.approx((2 * 25e-3 + 33e-6) / 4)
    both = load_scene(path, [f"{key}.fit=25 H8/f7", f"{key}.clearance=0.2 mm"])
    assert both.number(f"{key}.clearance") == 2e-4
    assert both.number(f"{key}.bearing_radius") == by_set.number(f"{key}.bearing_radius")
    line = next(one for one in text.splitlines() if one.startswith("clearance ="))
    path.write_text(text.replace(line, f'{line}\nfit = "25 H8/f7"', 1))
    with pytest.raises(InputError, match="stands beside clearance"):
        load_scene(path)


def test_a_random_clearance_by_the_fit_of_its_joint():
    fits = {f"joints.{one}.fit": "20 H7/f7" for one in ("crank_rod", "rod_slider")}
    scene = studied({**fits, "study.random.C12": {"distribution": "fit"}})
    row = scene.study.random_input("C12")
    assert row.fit == "20 H7/f7"
    assert row.absolute
    assert row.span == pytest.approx((10e-6, 31e-6))
    tighter = scene.with_({"joints.crank_rod.fit": "20 H6/g6"})
    assert tighter.study.random_input("C12").fit == "20 H6/g6"
    one = {"study.random.C": {"distribution": "fit", "bore": {"cp": 1.33}}}
    assert studied({**fits, **one}).study.random_input("C").fit == "20 H7/f7"
    limits = {"range": ["20.00 mm", "20.02 mm"]}, {"range": ["19.95 mm", "19.97 mm"]}
    own = {"study.random.C12": {"distribution": "fit", "bore": limits[0], "pin": limits[1]}}
    assert studied(own).study.random_input("C12").span == pytest.approx((15e-6, 35e-6))
    assert load_scene(studied(own).resolved()) == studied(own)


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ({}, "C12.bore = None: its limits of size are not known"),
        ({"fit": "20 H7/h6"}, "radial clearances from 0 to 17 um"),
        ({"fit": "20 H7/f7", "mean": 1e-5}, "does not belong"),
        ({"fit": "20 H7/f7", "bore": {"cp": 0}}, "must be above 0"),
        ({"fit": "20 H7/f7", "bore": {"cp": 1, "cpk": 1.2, "towards": "upper"}}, "larger than cp"),
        ({"fit": "20 H7/f7", "pin": {"cp": 1.33, "cpk": 1.0}}, 'towards = "upper" or "lower"'),
        ({"fit": "20 H7/f7", "pin": {"distribution": "uniform", "cp": 1.33}}, "belongs to a normal"),
        ({"fit": "20 H7/f7", "pin": {"range": ["20 mm", "19 mm"]}}, "are crossed"),
        ({"fit": "20 H7/f7", "pin": {"capability": 1}}, "is not a known key"),
        ({"fit": "20 H7/f7", "path": "mechanism.rod.mass"}, "gives clearances of joints"),
    ],
)  # fmt: skip
def test_random_fits_that_are_none(row, words):
    with refused(said=words):
        studied({"study.random.C12": {"distribution": "fit", **row}})

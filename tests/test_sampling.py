"""Points: strata, bounds, independence of the number drawn, moments, tables of designs."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from margins import at_most
from scipy import stats

from hpcclear.base.errors import InputError
from hpcclear.results.names import KINDS
from hpcclear.scene import load_scene
from hpcclear.scene.domain import box, to_coordinates
from hpcclear.scene.points import latin_hypercube, read_points
from hpcclear.scene.sampling import monte_carlo

JOBS = Path(__file__).parent.parent / "jobs"
ROBUST = load_scene(JOBS / "robust_slider_crank.toml")
DESIGN = {"m2": 0.2, "m3": 0.1, "u2": 0.05, "I2": 3e-4}
ROBUST_CASE = ("C", "m2", "m3", "u2", "I2")
OPTIMISATION = ("m2", "m3", "u2", "I2", "C")


def test_scene_design_is_stratified_in_its_coordinates() -> None:
    points = latin_hypercube(ROBUST, 128)
    region = box(ROBUST)
    coordinates = to_coordinates(ROBUST, points.names, points.values)
    unit = (coordinates - region.lower) / (region.upper - region.lower)
    strata = np.sort(np.floor(unit * 128).astype(int), axis=0)
    assert (strata == np.arange(128)[:, None]).all()


def test_ratios_become_inertias_of_the_same_row() -> None:
    points = latin_hypercube(ROBUST, 300)
    for mass, inertia, length in (("m1", "I1", 0.05), ("m2", "I2", 0.12)):
        ratio = points.column(inertia) / (points.column(mass) * length**2 / 12)
        assert 1 <= ratio.min() < 1.02
        assert 3.98 < ratio.max() <= 4


def test_ratio_follows_a_varying_length() -> None:
    scene = ROBUST.with_(
        {
            "study.variables.L2": {"path": "mechanism.rod.length", "range": [0.1, 0.2]},
            "study.surrogate.optimisation": ["I2", "L2", "m2", "m3", "u2", "C"],
        }
    )
    points = latin_hypercube(scene, 100)
    ratio = points.column("I2") * 12 / (points.column("m2") * points.column("L2") ** 2)
    assert ratio.min() >= 1
    assert ratio.max() <= 4


def test_a_widened_box_holds_every_random_point() -> None:
    region = box(ROBUST, OPTIMISATION, ROBUST_CASE)
    corners = [(0.105, 1.0), (0.105, 4.0), (0.42, 1.0), (0.42, 4.0)]
    for mass, ratio in corners:
        design = {"m2": mass, "m3": 0.07, "u2": 0.0, "I2": ratio * mass * 0.12**2 / 12}
        points = monte_carlo(ROBUST, 4000, random=ROBUST_CASE, design=design)
        coordinates = to_coordinates(ROBUST, points.names, points.values)
        for name, column in zip(points.names, coordinates.T, strict=True):
            at = region.names.index(name)
            assert region.lower[at] - 1e-12 <= column.min()
            assert column.max() <= region.upper[at] + 1e-12


def test_design_follows_from_seed_and_purpose() -> None:
    first = latin_hypercube(ROBUST)
    assert len(first) == 200
    assert (first.values == latin_hypercube(ROBUST).values).all()
    others = [
        latin_hypercube(ROBUST, purpose="test"),
        latin_hypercube(ROBUST.with_({"study.seed": 0})),
        latin_hypercube(ROBUST.with_({"study.seed": 2**40})),
    ]
    for other in others:
        assert np.intersect1d(first.values[:, 0], other.values[:, 0]).size == 0


@pytest.mark.parametrize("design", [None, DESIGN])
def test_sample_does_not_depend_on_how_many_are_drawn(design: dict[str, float] | None) -> None:
    whole = monte_carlo(ROBUST, 1000, design=design).values
    for first, count in ((0, 1), (1, 1), (2, 7), (3, 250), (997, 3), (500, 500)):
        part = monte_carlo(ROBUST, count, design=design, first=first).values
        assert (part == whole[first : first + count]).all()


def test_further_random_input_leaves_the_others() -> None:
    some = monte_carlo(ROBUST, 50, random=("C",), design=DESIGN)
    more = monte_carlo(ROBUST, 50, random=("m2", "C"), design=DESIGN)
    assert (some.column("C") == more.column("C")).all()
    assert (some.column("m2") == 0.2).all()


def test_streams_are_independent(shift: int) -> None:
    scene = ROBUST.with_({"study.seed": 1 + shift})
    values = monte_carlo(scene, 100_000, random=ROBUST_CASE, design=DESIGN).values
    correlation = np.corrcoef(values.T) - np.eye(values.shape[1])
    at_most(np.abs(correlation).max(), 5 / np.sqrt(100_000))
    other = monte_carlo(scene, 100_000, random=ROBUST_CASE, design=DESIGN, purpose="verify").values
    at_most(abs(np.corrcoef(values[:, 0], other[:, 0])[0, 1]), 5 / np.sqrt(100_000))


def distributed_as(column: np.ndarray, law: Callable[[np.ndarray], np.ndarray]) -> None:
    """Kolmogorov's distance, with a limit that is passed wrongly once in ten thousand: there are eight."""
    at_most(stats.kstest(column, law).statistic, stats.kstwo.isf(1e-4, len(column)))


@pytest.mark.parametrize(
    ("entries", "law"),
    [
        ({"distribution": "uniform", "half_width": 0.005}, stats.uniform(0.195, 0.01)),
        ({"distribution": "uniform", "range": [0.2, 0.3]}, stats.uniform(0.2, 0.1)),
        ({"distribution": "normal", "deviation": 0.004}, stats.norm(0.2, 0.004)),
        ({"distribution": "normal", "mean": 0.25, "deviation": 0.004}, stats.norm(0.25, 0.004)),
        (
            {"distribution": "truncated-normal", "deviation": 0.004, "half_width": 0.005},
            stats.truncnorm(-1.25, 1.25, 0.2, 0.004),
        ),
    ],
)
def test_random_inputs_have_their_distribution(
    entries: dict[str, object], law: stats.rv_continuous, shift: int
) -> None:
    changes = {
        "study.random.m2": entries,
        "study.cases.robust": ["C", "m2"],
        "study.seed": 1 + shift,
    }
    scene = ROBUST.with_(changes)
    points = monte_carlo(scene, 50_000, random=("m2",), design=DESIGN)
    assert points.names == ("m2", "u2", "I2", "m3")
    column = points.column("m2")
    error = law.std() / np.sqrt(len(points))
    at_most(abs(column.mean() - law.mean()), 4.5 * error)
    at_most(abs(column.std() / law.std() - 1.0), 0.02)  # six times its scatter and more
    distributed_as(column, law.cdf)
    assert law.cdf(column.min()) >= 0
    lower, upper = law.support()
    assert lower <= column.min()
    assert column.max() <= upper


def test_without_a_design_variables_fill_their_range_and_inputs_scatter_about_the_scene(
    shift: int,
) -> None:
    points = monte_carlo(ROBUST.with_({"study.seed": 1 + shift}), 20_000)
    assert points.names == ROBUST.study.names  # type: ignore[union-attr]
    distributed_as(points.column("m1"), stats.uniform(0.15, 0.45).cdf)
    distributed_as(points.column("m2"), stats.uniform(0.205, 0.01).cdf)
    ratio = points.column("I1") / (points.column("m1") * 0.05**2 / 12)
    distributed_as(ratio, stats.uniform(1, 3).cdf)


# --- tables of designs -------------------------------------------------------------------------


def _table(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "designs.csv"
    path.write_bytes(text.encode("utf-8-sig"))
    return path


def test_table_of_designs(tmp_path: Path) -> None:
    text = (
        "# my designs\nm2, C [mm], mechanism.slider.mass [g], drive.speed [rpm]\r\n"
        "0.2,0.3,140,5000\n\n 0.3 , 0.6, 150, 3000\n"
    )
    points = read_points(_table(tmp_path, text), ROBUST)
    assert points.names == ("m2", "C", "mechanism.slider.mass", "drive.speed")
    expected = [[0.2, 3e-4, 0.14, ROBUST.number("drive.speed")], [0.3, 6e-4, 0.15, 100 * np.pi]]
    np.testing.assert_allclose(points.values, expected, rtol=2e-16)
    assert points.paths[1] == ("joints.crank_rod.clearance", "joints.rod_slider.clearance")


def test_a_table_that_was_exported_gives_its_designs_again(tmp_path: Path) -> None:
    text = "sample,m2 [g],C [mm],objective [mm],peak_contact_force crank_rod [N],status,label\n"
    place = _table(tmp_path, text + "0,210,0.3,0.2,9000,ok,new\n1,200,0.3,,,stalled,old\n")
    points = read_points(place, ROBUST, KINDS["samples"].table)
    assert (points.names, points.labels) == (("m2", "C"), ("new", "old"))
    study = load_scene(JOBS / "tolerances.toml")
    with pytest.raises(InputError, match="is a choice of the study"):
        read_points(_table(tmp_path, "m2 [g],rod\n210,steel"), study)


def test_table_needs_no_study_and_drives_the_clearances_there_are(tmp_path: Path) -> None:
    scene = load_scene(JOBS / "slider_crank.toml", ["joints.crank_rod.kind=ideal"])
    points = read_points(_table(tmp_path, "C [mm]\n0.5"), scene)
    assert points.paths == (("joints.rod_slider.clearance",),)


@pytest.mark.parametrize(
    ("text", "key", "fragment"),
    [
        ("", "table of points", "contains no points"),
        ("m2\n", "table of points", "contains no points"),
        ("m2,C [kg]\n1,2", "{}", "quantity in m"),
        ("m2 [furlongz]\n1", "{}", "not a known unit"),
        ("m2,masss\n1,2", "{}", "neither a variable nor a number"),
        ("m2,m 3\n1,2", "{}", "not a column name"),
        ("m2,m2\n1,2", "{}", "two columns drive"),
        ("m2,mechanism.rod.mass\n1,2", "{}", "two columns drive"),
        ("C,C12\n1e-3,1e-3", "{}", "two columns drive"),
        ("m2,C [mm]\n1,0.5\n1,nan", "{}, line 3, column C", "finite decimal"),
        ("m2,C [mm]\n1,", "{}, line 2, column C", "finite decimal"),
        ("m2\n1/3", "{}, line 2, column m2", "finite decimal"),
        ("m2\n1e999", "{}, line 2, column m2", "finite decimal"),
        ("m2\n-1", "{}, line 2, column m2", "above 0 kg"),
        ("mechanism.rod.mass_center\n1e99", "{}, line 2", "is beyond 1e+30"),
        ("m2,m3\n1", "{}, line 2", "1 cell instead of 2"),
        ("m2,C [mm]\n\n1,21", "{}, line 3, joints.crank_rod.bearing_radius", "'-1 mm': makes"),
        ('"m2\n1', "table of points", "cannot be read"),
    ],
)
def test_broken_table_is_refused(tmp_path: Path, text: str, key: str, fragment: str) -> None:
    path = _table(tmp_path, text)
    with pytest.raises(InputError) as caught:
        read_points(path, ROBUST)
    assert caught.value.key.startswith(key.format(path))
    assert fragment in str(caught.value)
    assert caught.value.remedy

"""Distributions of random inputs and how they vary together, against closed forms."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from margins import at_most
from scipy import stats
from scipy.special import gamma

from hpcclear.base.errors import InputError
from hpcclear.ensemble.session import design
from hpcclear.scene import Scene, load_scene
from hpcclear.scene.correlation import Correlation
from hpcclear.scene.domain import box, to_coordinates
from hpcclear.scene.sampling import monte_carlo
from hpcclear.statistics.surrogate.kernels import MATERN, SQUARED_EXPONENTIAL, Kernel
from hpcclear.statistics.surrogate.kriging import Kriging
from hpcclear.statistics.surrogate.piecewise import Piecewise
from hpcclear.study.problem import problem_of

JOBS = Path(__file__).parent.parent / "jobs"
ROBUST = load_scene(JOBS / "robust_slider_crank.toml")
DESIGN = {"m2": 0.2, "m3": 0.1, "u2": 0.05, "I2": 3e-4}
MILLION = 1_000_000
FOUR = 4.0  # deviations: one such number in 16 000 is beyond
"""Standard errors within which what is drawn has to agree; 3.3 is passed wrongly once in a thousand."""

VALUES = (0.00031, 0.00036, 0.00036, 0.00044, 0.0008)


def _with(name: str, **row: object) -> Scene:
    return ROBUST.with_({f"study.random.{name}": row})


# Scene entry of C, and the distribution in mm with mean, deviation and quantile function written out.
def _lognormal(
    mean: float, deviation: float
) -> tuple[float, float, Callable[[np.ndarray], np.ndarray]]:
    s2 = np.log(1 + (deviation / mean) ** 2)
    mu = np.log(mean) - s2 / 2
    return mean, deviation, lambda p: np.exp(mu + np.sqrt(s2) * stats.norm.ppf(p))


def _weibull(
    location: float, scale: float, k: float
) -> tuple[float, float, Callable[[np.ndarray], np.ndarray]]:
    one, two = gamma(1 + 1 / k), gamma(1 + 2 / k)
    return (
        location + scale * one,
        scale * np.sqrt(two - one**2),
        lambda p: location + scale * (-np.log(1 - p)) ** (1 / k),
    )


def _beta21(low: float, high: float) -> tuple[float, float, Callable[[np.ndarray], np.ndarray]]:
    """Shapes 2 and 1: F = x^2."""
    return (
        low + (high - low) * 2 / 3,
        (high - low) * np.sqrt(1 / 18),
        lambda p: low + (high - low) * np.sqrt(p),
    )


CLOSED = {
    "lognormal": (
        {"distribution": "lognormal", "mean": "0.55 mm", "deviation": "0.04 mm"},
        _lognormal(0.55e-3, 0.04e-3),
    ),
    "weibull": (
        {"distribution": "weibull", "location": "0.3 mm", "scale": "0.1 mm", "shape": 2.5},
        _weibull(0.3e-3, 0.1e-3, 2.5),
    ),
    "scipy": (
        {"distribution": "scipy:weibull_min", "c": 2.5, "loc": "0.3 mm", "scale": "100 um"},
        _weibull(0.3e-3, 0.1e-3, 2.5),
    ),
    "beta": (
        {"distribution": "beta", "shapes": [2, 1], "range": ["0.4 mm", "0.9 mm"]},
        _beta21(0.4e-3, 0.9e-3),
    ),
    "samples": (
        {"distribution": "samples", "values": list(VALUES[::-1])},
        (
            np.mean(VALUES),
            np.std(VALUES),
            lambda p: np.array(VALUES)[np.ceil(p * len(VALUES)).astype(int) - 1],
        ),
    ),
}
EACH = pytest.mark.parametrize("name", CLOSED)


@EACH
def test_quantiles_are_the_closed_ones(name: str) -> None:
    entry, (_, _, exact) = CLOSED[name]
    law = _with("C", **entry).required_study.random_input("C").law
    chance = np.array([1e-6, 0.01, 0.05, 0.33, 0.5, 0.77, 0.95, 0.99, 1 - 1e-6])
    np.testing.assert_allclose(law(chance), exact(chance), rtol=1e-11)


@EACH
def test_a_million_draws_have_the_closed_moments(name: str, shift: int) -> None:
    entry, (mean, deviation, exact) = CLOSED[name]
    scene = _with("C", **entry).with_({"study.seed": 1 + shift})
    drawn = monte_carlo(scene, MILLION, random=("C",), design=DESIGN).column("C")
    at_most(abs(drawn.mean() - mean) * 1e3 / deviation, FOUR)  # error: deviation / sqrt(1e6)
    fourth = np.mean((drawn - mean) ** 4)
    error = np.sqrt((fourth - deviation**4) / MILLION) / (2 * deviation)
    at_most(abs(drawn.std() - deviation) / error, FOUR)
    level = float(exact(np.array([0.95]))[0])
    share, below = 0.95, np.mean(drawn <= level)
    if name == "samples":
        share = 1.0
    at_most(abs(below - share), FOUR * np.sqrt(0.95 * 0.05 / MILLION))


@EACH
def test_sobol_and_latin_hypercube_have_them_with_few_points(name: str) -> None:
    entry, (mean, deviation, _) = CLOSED[name]
    scene = _with("C", **entry)
    sobol = [
        monte_carlo(scene, 1024, random=("C", "m2"), design=DESIGN, replicate=k).column("C")
        for k in range(4)
    ]
    strata = design(scene.with_({"study.method": "random-lhs", "study.samples": 4096}), None)
    for drawn in (np.concatenate(sobol), strata.column("C")):
        assert abs(drawn.mean() - mean) < 2e-3 * deviation  # independent ones: 16e-3
        assert abs(drawn.std() - deviation) < 6e-3 * deviation


@EACH
@pytest.mark.parametrize("replicate", [None, 3])
def test_samples_do_not_depend_on_how_many_are_drawn(name: str, replicate: int | None) -> None:
    scene = _with("C", **CLOSED[name][0]).with_({"study.correlation": MOULD})
    whole = monte_carlo(scene, 1024, design=DESIGN, replicate=replicate).values
    for first, count in ((0, 1), (1, 1), (2, 6), (512, 512)):
        part = monte_carlo(scene, count, design=DESIGN, first=first, replicate=replicate).values
        assert (part == whole[first : first + count]).all()


def test_cut_off_distributions_are_conditional(shift: int) -> None:
    entry = {
        "distribution": "lognormal",
        "mean": "0.5 mm",
        "deviation": "0.2 mm",
        "range": ["0.3 mm", "0.8 mm"],
    }
    scene = _with("C", **entry).with_({"study.seed": 1 + shift})
    drawn = monte_carlo(scene, 100_000, random=("C",), design=DESIGN).column("C")
    s2 = np.log(1 + 0.16)
    whole = stats.lognorm(np.sqrt(s2), scale=0.5e-3 / np.sqrt(1.16))
    low, high = whole.cdf([0.3e-3, 0.8e-3])
    found = stats.kstest(drawn, lambda x: (whole.cdf(x) - low) / (high - low)).statistic
    at_most(found, stats.kstwo.isf(1e-4, len(drawn)))
    assert drawn.min() >= 0.3e-3
    assert drawn.max() <= 0.8e-3


def test_distributions_may_lie_about_the_design() -> None:
    rows = {
        "samples": {"distribution": "samples", "values": ["-1 g", "3 g"], "about_design": True},
        "weibull": {"distribution": "weibull", "scale": "2 g", "shape": 2, "about_design": True},
        "lognormal": {
            "distribution": "lognormal",
            "mean": "2 g",
            "deviation": "0.5 g",
            "about_design": True,
        },
        "beta": {"distribution": "beta", "shapes": [2, 5], "half_width": "5 g"},
    }
    for name, row in rows.items():
        scene = _with("m2", **row)
        low, high = scene.required_study.random_input("m2").span
        drawn = monte_carlo(scene, 1000, random=("m2",), design=DESIGN).column("m2")
        assert 0.2 + low <= drawn.min() < drawn.max() <= 0.2 + high
        wide = box(scene, ("m2",), widen=("m2",))
        assert wide.lower[0] == pytest.approx(0.105 + min(low, 0.0)), name
        assert wide.upper[0] == pytest.approx(0.42 + max(high, 0.0)), name
        assert "m2" in scene.required_study.design_variables("robust")


@pytest.mark.parametrize(
    ("text", "column", "key", "reason"),
    [
        ("a,b\n1,2\n", None, "study.random.C.column", "2 columns"),
        ("a,b\n1,2\n", "c", "study.random.C.column", "no column"),
        ("C [mm]\n0.3\nthick\n", None, "line 3, column C", "not a finite decimal"),
        ("C [mm], D\n0.3\n", "D", "line 2", "1 cell"),
        ("C [kg]\n0.3\n0.4\n", None, "study.random.C.values", "does not fit"),
        ("C [mm]\n0.3\n", None, "study.random.C.values", "from 2 to"),
        ("C [mm]\n0.3\n-0.4\n", None, "study.random.C.values", "above 0"),
    ],
)
def test_files_that_are_no_sample_are_refused(
    tmp_path: Path, text: str, column: str | None, key: str, reason: str
) -> None:
    (tmp_path / "measured.csv").write_text(text)
    row = {"distribution": "samples", "file": str(tmp_path / "measured.csv")}
    content = ROBUST.resolved()
    content["study"]["random"]["C"] = row if column is None else {**row, "column": column}
    with pytest.raises(InputError) as caught:
        load_scene(content)
    assert key in caught.value.key
    assert reason in caught.value.reason
    assert caught.value.remedy


# --- what varies together ----------------------------------------------------------------------

MOULD = {"inputs": ["m3", "C", "m2"], "matrix": [[1, -0.5, 0.8], [-0.5, 1, -0.3], [0.8, -0.3, 1]]}


def _correlation(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.corrcoef(a, b)[0, 1])


def test_correlation_of_a_million_draws_is_the_closed_one(shift: int) -> None:
    """Of normals r, of uniforms 6/pi asin(r/2), of lognormals (exp(r s t) - 1) over the root of the same with r = 1."""
    s, t, r = 0.05, 0.03, -0.5
    changes = {
        "study.seed": 1 + shift,
        "study.correlation": MOULD,
        "study.random.m2": {"distribution": "uniform", "half_width": "5 g"},
        "study.random.m3": {
            "distribution": "lognormal", "mean": "10 g", "deviation": 0.01 * np.sqrt(np.expm1(s**2)), "about_design": True,
        },
        "study.random.C": {
            "distribution": "lognormal", "mean": "0.5 mm", "deviation": 0.5e-3 * np.sqrt(np.expm1(t**2)),
        },
    }  # fmt: skip
    points = monte_carlo(ROBUST.with_(changes), MILLION, random=("C", "m2", "m3"), design=DESIGN)
    wanted = np.expm1(r * s * t) / np.sqrt(np.expm1(s**2) * np.expm1(t**2))
    found = _correlation(points.column("m3"), points.column("C"))
    at_most(abs(found - wanted), FOUR * (1 - wanted**2) / 1e3)
    ranks = stats.spearmanr(points.column("m2"), points.column("m3")).statistic
    at_most(abs(ranks - 6 / np.pi * np.arcsin(0.4)), FOUR / 1e3)
    ends = stats.uniform(0.195, 0.01).cdf
    at_most(stats.kstest(points.column("m2"), ends).statistic, stats.kstwo.isf(1e-4, MILLION))


def test_rank_correlation_is_what_was_asked_for(shift: int) -> None:
    changes = {"study.seed": 1 + shift, "study.correlation": {**MOULD, "measure": "rank"}}
    points = monte_carlo(ROBUST.with_(changes), MILLION, random=("C", "m2", "m3"), design=DESIGN)
    found = _correlation(points.column("m2"), points.column("m3"))  # both uniform: ranks themselves
    at_most(abs(found - 0.8), FOUR / 1e3)


@pytest.mark.parametrize("method", ["monte-carlo", "random-lhs", "qmc"])
def test_every_method_correlates(method: str) -> None:
    scene = ROBUST.with_(
        {"study.correlation": MOULD, "study.method": method, "study.samples": 4096}
    )
    points = design(scene, None)
    assert _correlation(points.column("m2"), points.column("m3")) == pytest.approx(0.786, abs=0.03)
    assert abs(_correlation(points.column("m2"), points.column("u2"))) < 0.06


@pytest.mark.parametrize("measure", ["normal", "rank"])
def test_a_matrix_that_is_not_definite_is_after_its_remedy(measure: str, shift: int) -> None:
    rng, refused = np.random.default_rng(shift), 0
    for count in rng.integers(2, 6, 50):
        own = np.round(np.tril(rng.uniform(-0.99, 0.99, (count, count)), -1), 2)
        own, rest = own + own.T, {"inputs": tuple("abcdef"[:count]), "measure": measure}
        try:
            Correlation(matrix=(own + np.eye(count)).tolist(), **rest)
        except ValueError as error:
            refused += 1
            share = float(re.search(r"diagonal by ([\d.]+)", str(error))[1])
            Correlation(matrix=(share * own + np.eye(count)).tolist(), **rest)
    assert refused > 10


# --- moments of surrogates -----------------------------------------------------------------------


def _model(scene: Scene, length: float = 1.2, kernel: Kernel = SQUARED_EXPONENTIAL) -> Piecewise:
    """Any model of the optimisation's inputs over their widened box."""
    names = scene.required_study.optimisation
    region = box(scene, names, sorted({n for c in scene.required_study.cases for n in c.random}))
    rng = np.random.default_rng(5)
    unit = rng.random((40, len(names)))
    own = tuple("I2_ratio" if name == "I2" else name for name in names)
    leaf = Kriging(
        names=own, lower=region.lower, upper=region.upper, length_scales=np.full(len(names), length),
        signal_variance=2.0, noise_variance=1e-3, mean=7.0, scale=0.5,
        inputs=region.lower + unit * (region.upper - region.lower), values=np.zeros(40), alpha=rng.normal(size=40),
        kernel=kernel,
    )  # fmt: skip
    return Piecewise((leaf,), np.array([True]))


@pytest.mark.parametrize(
    ("together", "kernel"),
    [(False, SQUARED_EXPONENTIAL), (True, SQUARED_EXPONENTIAL), (False, MATERN)],
)
def test_moments_of_a_surrogate_are_those_of_the_same_scatter(
    together: bool, kernel: Kernel
) -> None:
    changes: dict[str, object] = {
        "study.random.C": CLOSED["weibull"][0],
        "study.random.m3": {
            "distribution": "samples",
            "values": ["-4 g", "1 g", "2 g"],
            "about_design": True,
        },
    }
    if together:
        changes["study.correlation"] = MOULD
    scene = ROBUST.with_(changes)
    model = _model(scene, kernel=kernel)
    problem = problem_of(scene, "robust", model)
    design = np.array([[DESIGN[name] for name in problem.names]])
    points = monte_carlo(
        scene, 50_000, random=scene.required_study.case("robust").random, design=DESIGN
    )
    names = scene.required_study.optimisation
    values = np.column_stack([points.column(name) for name in names])
    drawn = model.predict(to_coordinates(scene, names, values))
    mean, deviation = problem.moments(design)[0]
    error = drawn.std() / np.sqrt(len(drawn))
    slack = 0.05 * deviation if together or kernel == MATERN else 0.0  # 256 points
    assert abs(mean - drawn.mean()) < 4 * error + slack
    assert abs(deviation - drawn.std()) < 4 * error + 2 * slack

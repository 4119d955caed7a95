"""What makes the scatter of a design: contributions of inputs against exact ones, tolerances against brute force, and lines."""

import numpy as np
import pytest
import xarray as xr
from margins import most
from scipy.stats import qmc

from hpcclear.report import scatter
from hpcclear.statistics.sensitivity.contributions import contributions


def drawn(seed: int, size: int, length: int = 64) -> np.ndarray:
    """Uniform inputs of variance 1: 16 replicates of a Sobol sequence."""
    rng = np.random.default_rng(seed)
    unit = np.stack([qmc.Sobol(size, rng=rng).random(length) for _ in range(16)])
    return (unit - 0.5) * 12.0**0.5


def response(x: np.ndarray) -> np.ndarray:
    """Three terms of variance 4, 1 and 0.2, and an interaction of 0.25; the fourth input does nothing by itself."""
    square = (x[..., 2] ** 2 - 1.0) / 0.8**0.5
    return 7.0 + 2.0 * x[..., 0] + x[..., 1] + 0.2**0.5 * square + 0.5 * x[..., 0] * x[..., 3]


def test_contributions_are_the_exact_ones_within_their_errors():
    x = drawn(1, 4)
    found = contributions(x, response(x), range(4))
    total = 4.0 + 1.0 + 0.2 + 0.25
    exact = np.array([4.0, 1.0, 0.2, 0.0]) / total
    np.testing.assert_allclose(found.share, exact, atol=0.02)
    assert (abs(found.share - exact) < 4.0 * found.share_error + 2e-3).all()
    assert found.rest == pytest.approx(0.0, abs=1e-9)  # the product of two is explained
    assert found.share.sum() == pytest.approx(1.0 - 0.25 / total, abs=0.02)


def test_a_halved_tolerance_brings_what_brute_force_says():
    x = drawn(2, 4, 256)
    f = response(x)
    found = contributions(x, f, range(4))
    for k in range(4):
        less = x.copy()
        less[..., k] *= 0.5
        exact = 1.0 - response(less).std() / f.std()
        assert found.halved[k] == pytest.approx(exact, abs=4.0 * found.halved_error[k] + 2e-3)
    assert list(np.argsort(-found.halved)[:2]) == [0, 1]
    assert found.halved[3] > 0.01  # the interaction counts for the fourth


def test_scatter_that_no_input_makes_is_no_inputs(shift):
    """Chaotic motion adds noise: inputs that do nothing are within their error of 0, and the rest is the noise."""
    beyond = 0
    for seed in range(60):
        x = drawn(1000 * shift + seed, 3, 16)
        noise = np.random.default_rng([shift, seed]).standard_normal(x.shape[:2])
        found = contributions(x, 3.0 * x[..., 0] + 3.0 * noise, range(3))
        assert found.rest == pytest.approx(0.5, abs=0.12)
        beyond += int((found.share[1:] > 1.96 * found.share_error[1:]).sum())
    assert beyond <= most(120, 0.05), beyond


def test_inputs_that_vary_together_have_one_contribution():
    x = drawn(4, 3)
    x[..., 1] = 0.8 * x[..., 0] + 0.6 * x[..., 1]
    f = x[..., 0] + x[..., 1] + x[..., 2]
    found = contributions(x, f, [5, 5, 2])
    assert found.share[0] == found.share[1] == pytest.approx(3.6 / 4.6, abs=0.02)
    assert found.share[2] == pytest.approx(1.0 / 4.6, abs=0.02)


def test_too_few_values_say_nothing_and_no_scatter_is_none():
    x = drawn(5, 4, 4)
    assert np.isnan(contributions(x, response(x), range(4)).share).all()
    x = drawn(5, 2)
    still = contributions(x, np.full(x.shape[:2], 3.0), range(2))
    assert (still.share == 0.0).all()
    assert still.rest == 0.0
    failed = response(drawn(1, 4))
    failed[3, ::2] = np.nan
    assert np.isfinite(contributions(drawn(1, 4), failed, range(4)).share).all()


def test_lines_name_what_scatters_alone_and_what_is_zero_within_its_error():
    def numbers(*values):
        return ("design", "input"), [list(values)]

    content = xr.Dataset(
        {
            "contribution": numbers(0.55, 0.3, 0.3, 0.001, np.nan),
            "contribution_error": numbers(0.01, 0.02, 0.02, 0.004, np.nan),
            "halved": numbers(0.25, 0.1, 0.02, 0.0, np.nan), "halved_error": numbers(0.01, 0.01, 0.005, 0.001, np.nan),
            "unexplained": ("design", [0.15]), "together": ("input", [0, 1, 1, 0, 0]),
        },
        {"design": ["case alpha"], "input": ["C", "m2", "m3", "u2", "other"]},
    )  # fmt: skip
    best = xr.Dataset(coords={"design": "case alpha"})
    shares, tolerances, first = scatter.lines({"contributions": content}, best)
    assert first.label == "tighten first"
    listed = (
        "C 55% ± 2%, m2+m3 (correlated) 30% ± 4%, u2 below 0.8%. The cubic fit does not explain 15%"
    )
    assert listed in shares.text
    assert "C 25% ± 2%, m2 10% ± 2%, m3 2.0% ± 1.0%, u2 below 0.5%" in tolerances.text
    assert "other" not in shares.text + tolerances.text
    assert list(scatter.lines({}, best)) == []

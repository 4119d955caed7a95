"""Response surfaces that choose their terms: what they find, what they are worth, and when they are taken."""

import numpy as np
import pytest
from margins import at_least, at_most
from sklearn.linear_model import LinearRegression

from hpcclear.scene.stages import Sensitivity
from hpcclear.statistics.surrogate.metrics import accuracy
from hpcclear.statistics.surrogate.polynomial import monomials, n_terms
from hpcclear.statistics.surrogate.response_surface import fit_response_surface, latin_hypercube

DIMS = 20
UNIT = np.tile([0.0, 1.0], (DIMS, 1))


def friedman(x: np.ndarray) -> np.ndarray:
    wave = 10 * np.sin(np.pi * x[:, 0] * x[:, 1])
    return wave + 20 * (x[:, 2] - 0.5) ** 2 + 10 * x[:, 3] + 5 * x[:, 4]


def sparse(x: np.ndarray) -> np.ndarray:
    """A cubic of few terms, exactly."""
    z = 2 * x - 1
    return 3.0 + z[:, 0] - 2 * z[:, 1] * z[:, 2] + 0.5 * z[:, 3] ** 3 + z[:, 4] * z[:, 5] * z[:, 6]


def sample(n: int, seed: int, bounds: np.ndarray = UNIT) -> np.ndarray:
    return latin_hypercube(n, bounds, np.random.default_rng(seed))


def test_a_cubic_of_few_terms_is_found_among_1771_by_150_points() -> None:
    points = sample(150, 1)
    surface = fit_response_surface(points, sparse(points), UNIT, 3, chosen=True)
    places = sample(500, 2)
    np.testing.assert_allclose(surface.predict(places), sparse(places), atol=1e-9)
    kept = {tuple(row) for row in surface.exponents.tolist()}
    product = tuple(int(j in (4, 5, 6)) for j in range(DIMS))
    cube = tuple(3 * (j == 3) for j in range(DIMS))
    assert {product, cube} < kept
    slopes, _ = surface.gradient(np.full(DIMS, 0.5))
    np.testing.assert_allclose(slopes, 2.0 * (np.arange(DIMS) == 0), atol=1e-8)  # of x, not z


def test_a_product_of_polynomials_brings_the_monomials_it_is_made_of() -> None:
    bounds = np.tile([-1.0, 1.0], (6, 1))
    points = sample(80, 4, bounds)
    values = (3 * points[:, 0] ** 2 - 1) * (3 * points[:, 1] ** 2 - 1)
    surface = fit_response_surface(points, values, bounds, 4, chosen=True)
    further = {tuple(row) for row in surface.exponents[7:].tolist()}
    assert further == {(2, 2, 0, 0, 0, 0), (2, 0, 0, 0, 0, 0), (0, 2, 0, 0, 0, 0)}


def test_it_is_the_least_squares_fit_of_its_terms() -> None:
    points = sample(120, 3)
    values = friedman(points)
    surface = fit_response_surface(points, values, UNIT, 3, chosen=True)
    terms = monomials(2 * points - 1, surface.exponents)
    peer = LinearRegression(fit_intercept=False).fit(terms, values)
    np.testing.assert_allclose(surface.coefficients, peer.coef_, rtol=1e-6, atol=1e-8)
    assert surface.degrees_of_freedom == 120 - len(surface.exponents)


@pytest.mark.parametrize("count", [100, 300])
def test_it_beats_all_terms_that_are_affordable_on_points_it_has_not_seen(
    count: int, shift: int
) -> None:
    points, places = sample(count, 10 + shift), sample(1000, 11 + shift)
    truth = friedman(places)
    chosen = fit_response_surface(points, friedman(points), UNIT, 3, chosen=True)
    at_least(accuracy(truth, chosen.predict(places)).r2, 0.97)
    for order in (1, 2):
        if n_terms(DIMS, order) < count:
            whole = fit_response_surface(points, friedman(points), UNIT, order)
            assert accuracy(truth, whole.predict(places)).r2 < 0.9


def test_all_terms_of_a_lower_order_are_taken_where_they_say_more() -> None:
    """Every product of two inputs matters: 231 terms, none of them to spare."""
    rng = np.random.default_rng(5)
    slopes, pairs = rng.standard_normal(DIMS), 0.3 * rng.standard_normal((DIMS, DIMS))

    def dense(x: np.ndarray) -> np.ndarray:
        z = 2 * x - 1
        return z @ slopes + np.einsum("ni,ij,nj->n", z, pairs, z)

    points, places = sample(300, 6), sample(500, 7)
    values = dense(points)
    chosen = fit_response_surface(points, values, UNIT, 3, chosen=True)
    whole = fit_response_surface(points, values, UNIT, 2)
    np.testing.assert_array_equal(chosen.predict(places), whole.predict(places))


def test_noise_has_no_terms_and_errors_that_are_told() -> None:
    points = sample(120, 8)
    values = np.random.default_rng(9).standard_normal(120)
    surface = fit_response_surface(points, values, UNIT, 3, chosen=True)
    assert len(surface.exponents) == DIMS + 1  # the linear ones, which are always there
    assert surface.residual_variance > 0.9
    assert surface.leave_one_out_r2 < 0.0


def test_standard_errors_are_not_flattered_by_the_choice(shift: int) -> None:
    """Slopes at the middle over the errors that are told, 240 of them: 1 if these are right, 2 by residuals alone."""
    middle, step = np.full(DIMS, 0.5), 1e-5
    ends = middle + step * np.concatenate([np.eye(DIMS), -np.eye(DIMS)])
    above, below = np.split(friedman(ends), 2)
    off = []
    for seed in range(12):
        points = sample(100, 20 + 100 * shift + seed)
        noise = np.random.default_rng(500 + 100 * shift + seed).standard_normal(100)
        surface = fit_response_surface(points, friedman(points) + noise, UNIT, 3, chosen=True)
        slopes, errors = surface.gradient(middle)
        off.append((slopes - (above - below) / (2 * step)) / errors)
    at_most(float(np.sqrt(np.mean(np.square(off)))), 1.5)


@pytest.mark.parametrize(
    ("terms", "samples", "chosen"),
    [(None, 11, False), (None, 10, True), ("chosen", 11, True), ("all", 9, False)],
)
def test_a_stage_chooses_where_points_are_few_or_it_is_asked_to(
    terms: str | None, samples: int, chosen: bool
) -> None:
    assert Sensitivity(terms=terms).chooses(2, 3, samples) is chosen  # of 10 terms

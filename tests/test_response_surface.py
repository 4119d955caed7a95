"""Response surfaces and accuracy measures against closed forms, refits and simulation."""

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
import pytest
from margins import at_most
from scipy.special import stdtrit
from sklearn.linear_model import LinearRegression
from sklearn.preprocessing import PolynomialFeatures

from hpcclear.base.errors import InputError
from hpcclear.statistics.surrogate.metrics import accuracy
from hpcclear.statistics.surrogate.response_surface import (
    ResponseSurface,
    fit_response_surface,
    latin_hypercube,
)
from hpcclear.statistics.surrogate.surface_search import (
    SearchSettings,
    SurfaceSearch,
    fit_until_accepted,
)

MASSES = np.array([[0.105, 0.42], [0.07, 0.28]])  # kg, m2 and m3 of the paper
INERTIAS = np.array([[3.1e-5, 1.25e-4], [1.3e-4, 5.0e-4], [0.0, 0.12]])  # badly scaled on purpose


def scaled(points: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    return 2 * (points - bounds[:, 0]) / np.ptp(bounds, axis=1) - 1


def cubic(x: np.ndarray) -> np.ndarray:
    """A full cubic in two scaled inputs; its coefficients are written out."""
    u, v = scaled(x, MASSES).T
    return (
        3e-4
        + 1e-4 * u
        - 2e-4 * v
        + 5e-5 * u**2
        + 3e-5 * u * v
        - 4e-5 * v**2
        + 7e-6 * u**3
        - 9e-6 * u**2 * v
        + 2e-6 * u * v**2
        + 8e-6 * v**3
    )


def search_for(
    function: Callable[[np.ndarray], np.ndarray],
    bounds: np.ndarray,
    rng: np.random.Generator,
    **settings: object,
) -> SurfaceSearch:
    made = SurfaceSearch(bounds, rng, SearchSettings(**settings))  # type: ignore[arg-type]
    fit_until_accepted(lambda asked: {k: function(at) for k, at in asked.items()}, [made])
    return made


def sample(n: int, bounds: np.ndarray, seed: int) -> np.ndarray:
    return latin_hypercube(n, bounds, np.random.default_rng(seed))


def noisy_fit(seed: int, n: int = 30, sigma: float = 2e-5) -> ResponseSurface:
    rng = np.random.default_rng(seed)
    x = latin_hypercube(n, MASSES, rng)
    return fit_response_surface(x, cubic(x) + sigma * rng.standard_normal(n), MASSES, 3)


# accuracy -----------------------------------------------------------------------------------------


def test_measures_by_hand() -> None:
    reached = accuracy([1.0, 2.0, 3.0, 6.0], [1.0, 3.0, 3.0, 5.0])  # mean 3, SST 14, SSE 2
    assert reached.r2 == pytest.approx(6 / 7, rel=1e-14)
    assert reached.r2_explained == pytest.approx(4 / 7, rel=1e-14)
    assert reached.rmae == pytest.approx(1 / np.sqrt(3.5), rel=1e-14)
    assert reached.rmae_mean == pytest.approx(1 / 3, rel=1e-14)
    assert reached.rmse == pytest.approx(np.sqrt(0.5), rel=1e-14)


def test_constant_test_values_have_no_r2_but_can_be_met() -> None:
    exact, off = accuracy([0.1] * 5, [0.1] * 5), accuracy([0.1] * 5, [0.1001] * 5)
    assert np.isnan(exact.r2)
    assert np.isnan(exact.rmae)
    assert exact.meets(0.99, 0.1)
    assert not off.meets(-np.inf, np.inf)


# the fit ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("point", [(0.2625, 0.175), (0.105, 0.28), (0.3, 0.1)])
def test_gradient_of_a_cubic_in_physical_units(point: tuple[float, float]) -> None:
    x = sample(45, MASSES, 3)
    surface = fit_response_surface(x, cubic(x), MASSES, 3)
    u, v = scaled(np.array(point), MASSES)
    by_u = 1e-4 + 1e-4 * u + 3e-5 * v + 21e-6 * u**2 - 18e-6 * u * v + 2e-6 * v**2
    by_v = -2e-4 + 3e-5 * u - 8e-5 * v - 9e-6 * u**2 + 4e-6 * u * v + 24e-6 * v**2
    slope, error = surface.gradient(point)
    expected = np.array([by_u, by_v]) * 2 / np.ptp(MASSES, axis=1)
    np.testing.assert_allclose(slope, expected, rtol=1e-10)
    assert (error < 1e-10 * np.abs(expected)).all()


def test_agrees_with_another_package_on_badly_scaled_inputs() -> None:
    rng = np.random.default_rng(4)
    x = latin_hypercube(60, INERTIAS, rng)
    z = scaled(x, INERTIAS)
    y = 2e-4 * np.exp(z[:, 0] + z[:, 1] * z[:, 2]) + 1e-6 * rng.standard_normal(60)
    surface = fit_response_surface(x, y, INERTIAS, 3)
    features = PolynomialFeatures(3)
    other = LinearRegression(fit_intercept=False).fit(features.fit_transform(z), y)
    fresh = sample(20, INERTIAS, 5)
    expected = other.predict(features.transform(scaled(fresh, INERTIAS)))
    np.testing.assert_allclose(surface.predict(fresh), expected, rtol=1e-9)


def test_leave_one_out_is_what_refitting_gives() -> None:
    rng = np.random.default_rng(7)
    x = latin_hypercube(20, MASSES, rng)
    y = cubic(x) + 1e-5 * rng.standard_normal(20)
    surface = fit_response_surface(x, y, MASSES, 3)
    refitted = np.empty(20)
    for i in range(20):
        others = np.arange(20) != i
        without = fit_response_surface(x[others], y[others], MASSES, 3)
        refitted[i] = y[i] - without.predict(x[[i]])[0]
    np.testing.assert_allclose(surface.leave_one_out_errors, refitted, rtol=1e-8)
    expected = 1 - np.sum(refitted**2) / np.sum((y - y.mean()) ** 2)
    assert surface.leave_one_out_r2 == pytest.approx(expected, rel=1e-8)


def test_standard_errors_cover_the_truth_as_often_as_they_say(shift: int) -> None:
    runs, middle = 600, MASSES.mean(axis=1)
    truth = np.array([1e-4, -2e-4]) * 2 / np.ptp(MASSES, axis=1)
    surfaces = [noisy_fit(seed) for seed in range(10 * shift, 10 * shift + runs)]
    slopes, errors = np.moveaxis([s.gradient(middle) for s in surfaces], 1, 0)
    for level in (0.5, 0.8, 0.95):
        t = stdtrit(surfaces[0].degrees_of_freedom, 0.5 + level / 2)
        covered = np.mean(np.abs(slopes - truth) <= t * errors, axis=0)
        limit = 4 * np.sqrt(level * (1 - level) / runs)
        at_most(np.abs(covered - level).max(), limit)
    variances = [s.residual_variance for s in surfaces]
    at_most(abs(np.mean(variances) / 4e-10 - 1.0), 4 * np.sqrt(2 / 20 / runs))


def test_failed_values_are_dropped_and_counted() -> None:
    x = sample(45, MASSES, 8)
    y = cubic(x)
    y[[3, 17, 40]] = np.nan, np.inf, np.nan
    kept = np.isfinite(y)
    surface = fit_response_surface(x, y, MASSES, 3)
    same = fit_response_surface(x[kept], y[kept], MASSES, 3)
    assert surface.n_points == 42
    np.testing.assert_array_equal(surface.coefficients, same.coefficients)


def test_refuses_fewer_points_than_terms() -> None:
    x = sample(12, MASSES, 11)
    y = cubic(x)
    fit_response_surface(x[:10], y[:10], MASSES, 3)
    with pytest.raises(InputError, match="10 terms"):
        fit_response_surface(x[:9], y[:9], MASSES, 3)
    y[:3] = np.nan
    with pytest.raises(InputError, match="3 points failed"):
        fit_response_surface(x, y, MASSES, 3)
    with pytest.raises(InputError, match="12 points failed"):
        fit_response_surface(x, np.full(12, np.nan), MASSES, 3)


def test_refuses_points_that_do_not_determine_the_terms() -> None:
    x = sample(45, MASSES, 12)
    x[:, 1] = np.linspace(*MASSES[1], 3)[np.arange(45) % 3]  # three levels cannot bear a cubic
    with pytest.raises(InputError, match="do not determine"):
        fit_response_surface(x, cubic(x), MASSES, 3)
    fit_response_surface(x, cubic(x), MASSES, 2)


def test_refuses_points_outside() -> None:
    surface = noisy_fit(0)
    edge = MASSES[:, 1]
    surface.predict(edge[np.newaxis])
    for point in (edge * 1.001, [np.nan, 0.1]):
        with pytest.raises(InputError, match="points"):
            surface.predict([point])
        with pytest.raises(InputError, match="points"):
            surface.gradient(point)


# the search ---------------------------------------------------------------------------------------

BOX = np.array([[-1.0, 1.0], [-1.0, 1.0]])


class Counted:
    """A function that remembers what it was asked."""

    def __init__(self, function: Callable[[np.ndarray], np.ndarray]) -> None:
        self.function, self.asked = function, [np.empty((0, 2))]

    def __call__(self, x: np.ndarray) -> np.ndarray:
        self.asked.append(x)
        return self.function(x)


def test_search_takes_the_paper_sample_when_it_suffices() -> None:
    f = Counted(lambda x: x[:, 0] ** 3 + x[:, 1])
    search = search_for(f, BOX, np.random.default_rng(0))
    assert search.accepted
    assert search.best[0].order == 3
    assert [len(x) for x in f.asked[1:]] == [5, 45]


def test_search_changes_the_order() -> None:
    f = Counted(lambda x: np.cos(2 * x[:, 0]) * x[:, 1] ** 2)
    search = search_for(f, BOX, np.random.default_rng(1), n_test=20, r2_min=0.97, rmae_max=0.5)
    assert search.accepted
    assert [len(x) for x in f.asked[1:]] == [20, 45]  # by the same points
    assert search.best[0].order == 4
    assert search.best[1].r2 >= 0.97


def test_search_raises_the_sample_by_new_points_and_keeps_the_test_points_apart() -> None:
    f = Counted(lambda x: np.sin(3 * x[:, 0]) + x[:, 1])
    search = search_for(
        f, BOX, np.random.default_rng(2), orders=(7,), n_points=20, n_test=20, r2_min=0.99
    )
    assert search.accepted
    test, *training = f.asked[1:]
    assert [len(x) for x in training] == [20, 20, 40][: len(training)]
    assert search.best[0].n_points == sum(map(len, training)) > 36  # 20 points cannot bear 36 terms
    true = np.sin(3 * test[:, 0]) + test[:, 1]
    assert accuracy(true, search.best[0].predict(test)) == search.best[1]


def test_search_reports_that_noise_cannot_be_fitted() -> None:
    noise = np.random.default_rng(3)
    f = Counted(lambda x: noise.standard_normal(len(x)))
    search = search_for(f, BOX, np.random.default_rng(4), n_test=30, max_points=150)
    assert not search.accepted
    assert [len(x) for x in f.asked[1:]] == [30, 45, 45, 60]  # never past max_points
    with pytest.raises(InputError, match=r"no surface could be fitted: .*36 terms"):
        search_for(f, BOX, np.random.default_rng(4), orders=(7,), n_points=10, max_points=30)


def test_searches_side_by_side_find_what_each_finds_alone() -> None:
    """One passes at once, one needs more points, one never does; each is asked for no longer than it takes."""
    waves = [0.0, 16.0, 400.0]
    settings = SearchSettings(n_points=20, n_test=30, max_points=80, r2_min=0.999, rmae_max=0.1)
    rounds: list[tuple[int, ...]] = []

    def truth(wave: float, x: np.ndarray) -> np.ndarray:
        return np.asarray(cubic(x) + 1e-4 * np.sin(wave * x[:, 0]) * (wave > 0.0))

    def searches() -> list[SurfaceSearch]:
        seeds = range(len(waves))
        return [SurfaceSearch(MASSES, np.random.default_rng(seed), settings) for seed in seeds]

    def evaluate(asked: Mapping[int, np.ndarray]) -> dict[int, np.ndarray]:
        rounds.append(tuple(asked))
        return {k: truth(waves[k], at) for k, at in asked.items()}

    together = searches()
    fit_until_accepted(evaluate, together)
    assert rounds[0] == (0, 1, 2)
    assert rounds[-1] == (2,)
    for k, alone in enumerate(searches()):
        fit_until_accepted(partial(lambda w, asked: {0: truth(w, asked[0])}, waves[k]), [alone])
        assert alone.accepted == together[k].accepted == (k < 2)
        assert alone.best[1] == together[k].best[1]

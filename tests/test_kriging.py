"""Kriging against scikit-learn, known functions and itself after a round trip."""

import numpy as np
import pytest
from margins import at_least, at_most
from scipy.optimize import approx_fprime, minimize
from scipy.spatial.distance import cdist
from scipy.stats import multivariate_normal, qmc
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, Matern, WhiteKernel

from hpcclear.base.errors import InputError
from hpcclear.statistics.surrogate.fitting import KrigingMethod, fit_kriging
from hpcclear.statistics.surrogate.kernels import (
    KERNELS,
    MATERN,
    SQUARED_EXPONENTIAL,
    Errors,
    correlation,
)
from hpcclear.statistics.surrogate.likelihood import PART, maximise, negative_likelihood
from hpcclear.statistics.surrogate.metrics import accuracy
from hpcclear.statistics.surrogate.piecewise import Piecewise
from hpcclear.statistics.surrogate.predictor import gaussian, matern
from hpcclear.statistics.surrogate.stored import arrays_of, models_in
from hpcclear.statistics.surrogate.subintervals import SubintervalSettings, fit_subintervals

PEERS = {SQUARED_EXPONENTIAL: RBF, MATERN: lambda *own: Matern(*own, nu=2.5)}
"""The same covariance functions by scikit-learn."""
BOUNDS = np.array([[1.0, 3.0], [-2e-4, 5e-4], [10.0, 11.0]])


def smooth(points):
    """A function of 3 inputs without kinks, of order 1."""
    x, y, z = ((points - BOUNDS[:, 0]) / np.ptp(BOUNDS, axis=1)).T
    return np.sin(3 * x) + y**2 * z + 5.0


def draw(count, seed, bounds=BOUNDS):
    unit = qmc.LatinHypercube(len(bounds), rng=np.random.default_rng(seed)).random(count)
    return bounds[:, 0] + np.ptp(bounds, axis=1) * unit


def fitted(kernel):
    points = draw(60, 0)
    values = smooth(points) + 0.01 * np.random.default_rng(1).normal(size=60)
    names = ("a", "b", "c")
    return fit_kriging(
        points, values, BOUNDS, rng=np.random.default_rng(2), names=names, kernel=kernel
    )


@pytest.fixture(scope="module")
def model():
    return fitted(SQUARED_EXPONENTIAL)


@pytest.fixture(scope="module", params=KERNELS)
def either(request):
    """A model with each kernel."""
    return fitted(request.param)


def refit(model, **changes):
    arguments = {"points": model.inputs, "values": model.values, "bounds": BOUNDS}
    arguments |= {"rng": np.random.default_rng(2)} | changes
    return fit_kriging(**arguments)


def test_prediction_is_that_of_scikit_learn(either):
    model = either
    smooth_part = ConstantKernel(model.signal_variance) * PEERS[model.kernel](model.length_scales)
    kernel = smooth_part + WhiteKernel(model.noise_variance)
    oracle = GaussianProcessRegressor(kernel, alpha=0.0, optimizer=None, normalize_y=True)
    oracle.fit(model.to_unit(model.inputs), model.values)
    places = draw(500, 3)
    mean, deviation = oracle.predict(model.to_unit(places), return_std=True)
    np.testing.assert_allclose(model.predict(places), mean, rtol=1e-10)
    latent = model.variance(places) + model.noise_variance * model.scale**2
    np.testing.assert_allclose(latent, deviation**2, rtol=1e-7)


def test_likelihood_is_at_its_maximum(either):
    """scikit-learn, started afresh in wider bounds, finds nothing better."""
    model = either
    smooth_part = ConstantKernel(1.0, (1e-4, 1e6)) * PEERS[model.kernel](np.ones(3), (1e-3, 1e3))
    kernel = smooth_part + WhiteKernel(0.1)
    oracle = GaussianProcessRegressor(
        kernel, alpha=0.0, normalize_y=True, n_restarts_optimizer=5, random_state=0
    )
    oracle.fit(model.to_unit(model.inputs), model.values)
    theta = np.log([model.signal_variance, *model.length_scales, model.noise_variance])
    assert oracle.log_marginal_likelihood(theta) > oracle.log_marginal_likelihood_value_ - 0.1


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize(("dims", "count", "noise"), [(1, 30, 1e-8), (5, 80, 1e-3), (20, 120, 1.0)])
def test_likelihood_and_gradient_are_those_of_scikit_learn(dims, count, noise, kernel):
    rng = np.random.default_rng(dims)
    points, values = rng.random((count, dims)), rng.standard_normal(count)
    points[1] = points[0]  # twice the same design
    theta = np.log([2.0, *rng.uniform(0.05, 3.0, dims), noise])
    its = ConstantKernel(1.0) * PEERS[kernel](np.ones(dims)) + WhiteKernel(1.0)
    peer = GaussianProcessRegressor(its, alpha=0.0, optimizer=None).fit(points, values)
    value, gradient = peer.log_marginal_likelihood(theta, eval_gradient=True)
    found, slopes = negative_likelihood(theta, points - 0.5, values, kernel)
    assert found == pytest.approx(-value, rel=1e-6)
    np.testing.assert_allclose(slopes, -gradient, rtol=1e-6, atol=1e-6 * abs(gradient).max())


@pytest.mark.parametrize("kernel", KERNELS)
def test_errors_in_common_are_part_of_the_likelihood_and_of_what_is_known(kernel):
    """Values by the normal density, slopes by differences; variances of differences by the joint covariance."""
    rng = np.random.default_rng(4)
    points, values, shifts = (
        rng.random((30, 2)),
        rng.normal(size=30),
        0.2 * rng.normal(size=(30, 8)),
    )
    errors, theta = (
        Errors(rng.uniform(0.5, 2.0, 30), shifts @ shifts.T),
        np.log([2.0, 0.4, 0.9, 0.01]),
    )
    squares = cdist(points / [0.4, 0.9], points / [0.4, 0.9], "sqeuclidean")
    whole = 2.0 * correlation(squares, kernel) + 0.01 * np.diag(errors.own) + errors.common

    def of(at):
        return negative_likelihood(at, points - 0.5, values, kernel, errors)

    assert of(theta)[0] == pytest.approx(-multivariate_normal(cov=whole).logpdf(values), rel=1e-9)
    steps = approx_fprime(theta, lambda at: of(at)[0])
    np.testing.assert_allclose(of(theta)[1], steps, rtol=1e-4, atol=1e-4)
    model = fit_kriging(
        points, values, np.tile([0.0, 1.0], (2, 1)), rng=rng, kernel=kernel, errors=errors
    )
    joint = model.covariance(points)
    apart = np.diag(joint) + joint[0, 0] - 2.0 * joint[0]
    np.testing.assert_allclose(model.apart(points, points[0]), apart, atol=1e-9)
    np.testing.assert_allclose(model.apart(points), 0.0, atol=1e-9)


def of_many_points(points, seed=5):
    """An input with short waves, a slope, an input that does nothing; noise of a tenth."""
    noise = 0.1 * np.random.default_rng(seed).standard_normal(len(points))
    return np.sin(12 * points[:, 0]) + points[:, 1] + noise


def searched(points, values, restarts):
    """Length scales, variances and minus the log likelihood of `maximise`."""
    values = (values - values.mean()) / values.std()
    bounds = np.array([(1e-3, 1e3), *[(1e-2, 1e2)] * points.shape[1], (1e-8, 10.0)])
    start = np.array([1.0, *[0.5] * points.shape[1], 1e-3])
    found = maximise(points, values, [start], bounds, restarts, 3)
    theta = np.log([found.signal_variance, *found.length_scales, found.noise_variance])
    return found, negative_likelihood(theta, points - 0.5, values)[0], theta, values


def test_a_search_by_parts_ends_at_the_maximum_over_all_points():
    points = draw(2 * PART + 1, 21, np.tile([0.0, 1.0], (3, 1)))
    found, least, theta, values = searched(points, of_many_points(points), 0)
    assert found.noise_variance == pytest.approx(0.01 / 0.6, rel=0.3)
    assert found.length_scales[0] < 1.0 < found.length_scales[2]
    bounds = np.log([(1e-3, 1e3), *[(1e-2, 1e2)] * 3, (1e-8, 10.0)])
    whole = minimize(
        lambda at: negative_likelihood(at, points - 0.5, values),
        theta, method="L-BFGS-B", jac=True, bounds=bounds,
    )  # fmt: skip
    assert whole.fun > least - 0.1  # going on from there gains nothing


def test_more_starts_on_a_part_find_what_one_on_all_points_misses():
    """From the first start alone all of this function is noise; so it was with one on all points."""
    points = draw(2 * PART, 22, np.tile([0.0, 1.0], (5, 1)))
    values = np.sin(14 * points[:, 0]) + 0.6 * np.cos(11 * points[:, 1] + 3 * points[:, 2])
    model = fit_kriging(
        points, values, np.tile([0.0, 1.0], (5, 1)), rng=np.random.default_rng(0), restarts=0
    )
    places = draw(300, 23, np.tile([0.0, 1.0], (5, 1)))
    truth = np.sin(14 * places[:, 0]) + 0.6 * np.cos(11 * places[:, 1] + 3 * places[:, 2])
    assert accuracy(truth, model.predict(places)).r2 > 0.99


def test_an_input_that_a_part_does_not_see_comes_back():
    """Noise hides the third input from half of the points: its length scale of 14 there would stay 14 with all of them."""
    points = draw(2 * PART, 0, np.tile([0.0, 1.0], (3, 1)))
    noise = 0.5 * np.random.default_rng(0).standard_normal(len(points))
    values = 2 * np.sin(4 * points[:, 0]) + 0.2 * np.sin(9 * points[:, 2]) + noise
    found, *_ = searched(points, values, 0)
    assert found.length_scales[2] < 3.0 < found.length_scales[1]


def test_what_cannot_be_factored_is_never_the_best():
    points = np.zeros((5, 2))  # five times the same design, and no noise to speak of
    theta = np.log([1e3, 1.0, 1.0, 1e-20])
    value, gradient = negative_likelihood(theta, points, np.arange(5.0))
    assert value == np.inf
    assert (gradient == 0.0).all()


@pytest.mark.parametrize("kernel", [gaussian, matern], ids=["exponential", "matern"])
def test_kernels_are_accurate_to_the_last_digits(kernel):
    squares = np.concatenate([np.linspace(0, 599, 5001), np.logspace(-16, 2, 500)])
    steps = np.sqrt(5 * squares)
    right = np.exp(-0.5 * squares)
    if kernel is matern:
        right = (1 + steps + steps**2 / 3) * np.exp(-steps)
    ours = np.array([kernel(square) for square in squares])
    np.testing.assert_allclose(ours, right, rtol=1e-13)
    assert kernel(0.0) == 1.0
    assert 0 <= kernel(1e9) < 1e-100


def test_prediction_does_not_depend_on_the_batch(either):
    model = either
    places = draw(37, 4)
    alone = np.concatenate([model.predict(place[None]) for place in places])
    assert (alone == model.predict(places)).all()


def test_round_trip_is_bitwise(either):
    model = either
    whole = Piecewise((model,), np.ones(1))
    arrays = {name: np.copy(array) for name, array in arrays_of(whole).items()}
    ((again,),) = (one.leaves for one in models_in(arrays).values())
    places = draw(100, 5)
    assert again.names == ("a", "b", "c")
    assert again.kernel == model.kernel
    assert (again.predict(places) == model.predict(places)).all()
    assert (again.variance(places) == model.variance(places)).all()


def test_does_not_extrapolate(model):
    inside = BOUNDS.mean(axis=1)
    for column, value in [(0, 3.0001), (1, -2.1e-4), (2, np.nan), (2, np.inf)]:
        place = inside.copy()
        place[column] = value
        with pytest.raises(InputError, match="does not extrapolate") as caught:
            model.predict(np.array([inside, place]))
        assert caught.value.key == model.names[column]
        assert caught.value.value == value or np.isnan(value)
    corners = np.array([BOUNDS[:, 0], np.nextafter(BOUNDS[:, 1], np.inf)])  # round-off is forgiven
    assert np.isfinite(model.predict(corners)).all()


def test_noise_is_recovered(shift):
    """Deviation 0.1 on 300 points: the estimate scatters by 0.1 / sqrt(600); 4 of that."""
    points = draw(300, 9 + shift)
    values = smooth(points) + 0.1 * np.random.default_rng(10 + shift).normal(size=300)
    model = fit_kriging(points, values, BOUNDS, rng=np.random.default_rng(0), restarts=0)
    at_most(abs(model.scale * np.sqrt(model.noise_variance) - 0.1), 0.017)


def test_smooth_function_of_five_inputs(shift):
    """The Friedman function: sin(pi x1 x2), a parabola and two lines; known to be fitted well."""
    bounds = np.tile([0.0, 1.0], (5, 1))
    train, test = draw(200, 11 + shift, bounds), draw(500, 12 + shift, bounds)

    def friedman(x):
        wave = 10 * np.sin(np.pi * x[:, 0] * x[:, 1])
        return wave + 20 * (x[:, 2] - 0.5) ** 2 + 10 * x[:, 3] + 5 * x[:, 4]

    model = fit_kriging(train, friedman(train), bounds, rng=np.random.default_rng(0), restarts=0)
    reached = accuracy(friedman(test), model.predict(test))
    at_least(reached.r2, 0.9999)
    at_most(reached.rmae, 0.05)


def test_failed_samples_are_dropped_and_counted(model):
    values = np.array(model.values)
    values[[3, 40]] = np.nan
    with_failures = refit(model, values=values)
    valid = np.isfinite(values)
    without = refit(model, points=model.inputs[valid], values=values[valid])
    assert with_failures.dropped == 2
    assert without.dropped == 0
    assert (with_failures.alpha == without.alpha).all()


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda p, v, b: (p, np.where(np.arange(60) < 55, np.nan, v), b), "too few valid samples"),
        (lambda p, v, b: (p, np.full(60, np.nan), b), "too few valid samples"),
        (lambda p, v, b: (p[:0], v[:0], b), "too few valid samples"),
        (lambda p, v, b: (np.where(p > 2.99, np.nan, p), v, b), "outside"),
        (lambda p, v, b: (p * 1.1, v, b), "outside"),
    ],
)
def test_bad_training_data_are_refused(model, change, reason):
    points, values, bounds = change(np.array(model.inputs), np.array(model.values), BOUNDS)
    with pytest.raises(InputError, match=reason):
        fit_kriging(points, values, bounds, rng=np.random.default_rng(0))


def test_each_kernel_suits_its_functions():
    """A kink is what Matern is for, a function without any what the squared exponential is."""
    box = np.tile([0.0, 1.0], (2, 1))
    train, test = draw(80, 31, box), draw(500, 32, box)
    of_kernel = {}
    for words, function in (
        ("kink", lambda x: np.abs(x[:, 0] - 0.4) + x[:, 1]),
        ("smooth", lambda x: np.sin(3 * x[:, 0]) * np.exp(x[:, 1])),
    ):
        for kernel in KERNELS:
            one = fit_kriging(
                train, function(train), box, rng=np.random.default_rng(0), kernel=kernel
            )
            of_kernel[words, kernel] = accuracy(function(test), one.predict(test)).rmse
    assert of_kernel["kink", MATERN] < 0.7 * of_kernel["kink", SQUARED_EXPONENTIAL]
    assert of_kernel["smooth", SQUARED_EXPONENTIAL] < 0.2 * of_kernel["smooth", MATERN]


def test_leave_one_out_is_what_fits_without_a_point_predict(either):
    model = either
    gone = 7
    left = np.arange(60) != gone
    unit = model.to_unit(model.inputs)
    matrix = model._noisy_covariance()[np.ix_(left, left)]
    alpha = np.linalg.solve(matrix, (model.values[left] - model.mean) / model.scale)
    cross = model._covariance(unit[[gone]], unit[left])[0]
    expected = model.mean + model.scale * cross @ alpha
    assert model.leave_one_out()[gone] == pytest.approx(expected, rel=1e-8)


# Subintervals


SQUARE = np.array([[0.0, 1.0], [0.0, 2.0]])
METHOD = KrigingMethod(restarts=0)


def kinked(points):
    return np.abs(points[:, 0] - 0.3) + 0.5 * points[:, 1] ** 2


class Counted:
    """A function that keeps count of its calls."""

    def __init__(self, function):
        self.function, self.calls = function, []

    def __call__(self, points):
        self.calls.append(len(points))
        return self.function(points)


def fit_kinked(evaluate, seed=0, **changes):
    arguments = {"samples": 30, "test_samples": 40, "max_resamples": 0, "max_depth": 5}
    arguments |= {"r2_min": 0.999, "rmae_max": 0.05} | changes
    settings = SubintervalSettings(**arguments)
    rng = np.random.default_rng(seed)
    return fit_subintervals(evaluate, SQUARE, settings, rng=rng, method=METHOD)


def test_recursion_cuts_where_the_kink_is(shift):
    evaluate = Counted(kinked)
    pieces = fit_kinked(evaluate, shift)
    assert pieces.accepted.all()
    assert len(pieces.leaves) > 1
    assert all((leaf.lower[1], leaf.upper[1]) == (0.0, 2.0) for leaf in pieces.leaves)
    assert len(evaluate.calls) < 6  # one call a generation
    places = draw(500, 13 + shift, SQUARE)
    at_least(accuracy(kinked(places), pieces.predict(places)).r2, 0.999)
    single = fit_kinked(kinked, shift, max_depth=0)
    assert not single.accepted.any()
    assert single.leaves[0].names == ("x1", "x2")
    worse = accuracy(kinked(places), single.predict(places)).rmse
    better = accuracy(kinked(places), pieces.predict(places)).rmse
    # a quarter at most in fifty repeats; a cut elsewhere gains nothing
    at_most(np.log(better / worse), np.log(0.8))


def test_a_smooth_function_stays_in_one_piece():
    evaluate = Counted(lambda p: p[:, 0] * p[:, 1])
    pieces = fit_kinked(evaluate)
    assert len(pieces.leaves) == 1
    assert evaluate.calls == [70]

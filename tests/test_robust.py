"""Moments under random inputs: three routes against each other and against known answers."""

from dataclasses import replace

import numpy as np
import pytest
from margins import at_least, at_most
from refusals import refused
from scipy import stats
from scipy.integrate import quad
from sklearn.gaussian_process.kernels import Matern

from hpcclear.base.errors import InputError
from hpcclear.base.quantiles import Normal, Uniform
from hpcclear.statistics.random import rules
from hpcclear.statistics.random.inputs import DerivedInput, RandomVariable
from hpcclear.statistics.random.moments import RobustObjective, sample_moments
from hpcclear.statistics.surrogate.kernels import MATERN
from hpcclear.statistics.surrogate.kriging import Kriging
from hpcclear.statistics.surrogate.piecewise import Piecewise

LOWER, UPPER = np.array([1.0, -0.2, 5e-5, 3e-4]), np.array([2.0, 0.3, 8e-4, 1e-3])
NAMES = ("m", "u", "I", "C")
DESIGN = ("m", "u", "I")
SCIPY = {
    Uniform(1.0, 2.0): stats.uniform(-1.0, 4.0),
    Normal(2.0, 0.5): stats.norm(2.0, 0.5),
    Normal(2.0, 0.5, 0.6): stats.truncnorm(-1.2, 1.2, 2.0, 0.5),
    Normal(0.0, 1.0, 0.01): stats.truncnorm(-0.01, 0.01),
}


def surrogate(lengths=(1.5, 0.6, 3.0, 0.9), names=NAMES, lower=LOWER, upper=UPPER, seed=0):
    """A Kriging model with alpha out of a hat: the moments must hold for any."""
    rng = np.random.default_rng(seed)
    points = lower + (upper - lower) * rng.random((61, len(names)))
    return Kriging(
        names=names,
        lower=lower,
        upper=upper,
        length_scales=np.array(lengths),
        signal_variance=2.0,
        noise_variance=1e-3,
        mean=7.0,
        scale=0.5,
        inputs=points,
        values=np.zeros(61),
        alpha=rng.normal(size=61),
    )


def designs(count, seed=1):
    """Designs whose random inputs stay inside the domain."""
    return np.array([1.1, -0.1, 2e-4]) + np.random.default_rng(seed).random((count, 3)) * np.array(
        [0.8, 0.3, 4e-4]
    )


UNIFORM = (
    RandomVariable("C", Uniform(6.5e-4, 3.5e-4)),
    RandomVariable("m", Uniform(0.0, 0.05), about_design=True),
    RandomVariable("u", Uniform(0.0, 0.1), about_design=True),
    RandomVariable("I", Uniform(0.0, 1e-4), about_design=True),
)
NORMAL = (
    RandomVariable("C", Normal(6.5e-4, 5e-5)),
    RandomVariable("m", Normal(0.0, 0.015), about_design=True),
    RandomVariable("u", Normal(0.005, 0.015), about_design=True),
)
TRUNCATED = (
    RandomVariable("C", Normal(6e-4, 2e-4, 3e-4)),
    RandomVariable("u", Normal(0.02, 0.05, 0.04), about_design=True),
)


def drawn(count, seed):
    """Independent draws of `UNIFORM`, in place of a rule."""
    rng = np.random.default_rng(seed)
    return {one.name: one.law(rng.random(count))[None] for one in UNIFORM}


CASES = pytest.mark.parametrize("inputs", [UNIFORM, NORMAL, TRUNCATED, UNIFORM[:1]])


@pytest.mark.parametrize("distribution", SCIPY, ids=str)
def test_rule_integrates_polynomials(distribution):
    """N nodes are exact to degree 2 N - 1 (a normal's support is cut at 6 deviations)."""
    oracle = SCIPY[distribution]
    nodes, weights = rules.rule(distribution, 6)
    low, high = distribution.span
    assert low < nodes.min() < nodes.max() < high
    assert (weights > 0).all()
    places = (nodes - oracle.mean()) / oracle.std()
    for power in range(12):
        exact = oracle.expect(lambda x, k=power: ((x - oracle.mean()) / oracle.std()) ** k)
        if distribution == Normal(2.0, 0.5):
            exact = stats.truncnorm(-6, 6).moment(power) if power > 0 else 1.0
        assert weights @ places**power == pytest.approx(exact, rel=1e-7, abs=1e-7)


@pytest.mark.parametrize("distribution", SCIPY, ids=str)
def test_kernel_integral(distribution):
    centres = np.array([-3.0, 0.0, 1.7, 4.4, 6.0])
    for length in (0.2, 1.0, 30.0):
        ours = rules.kernel_integral(distribution, centres, length)
        low, high = distribution.span
        for value, centre in zip(ours, centres, strict=True):
            exact = quad(
                lambda x, c=centre, length=length: (
                    SCIPY[distribution].pdf(x) * np.exp(-0.5 * ((x - c) / length) ** 2)
                ),
                low,
                high,
                points=[min(max(centre, low), high)],
                epsabs=1e-13,
                epsrel=1e-11,
                limit=200,
            )[0]
            assert value == pytest.approx(exact, rel=1e-8, abs=3e-9)


def test_standard_errors_are_honest(shift):
    """Over 2000 repetitions the estimates scatter as much as their standard errors say.

    The ratio itself scatters by 0.016. Of 400 exponential numbers the heavy tail is seldom whole, and the fourth moment
    comes out too small: the error of the deviation is 5 % too small on average.
    """
    rng = np.random.default_rng(shift)
    for draw, deviation, allowed in [
        (rng.normal(3.0, 2.0, (2000, 400)), 2.0, 0.08),
        (rng.uniform(0.0, 1.0, (2000, 400)), 12**-0.5, 0.08),
        (rng.exponential(1.0, (2000, 400)), 1.0, 0.12),
    ]:
        found = sample_moments(draw)
        at_most(abs(found.mean.std() / found.mean_error.mean() - 1.0), 0.08)
        at_most(abs(found.deviation.std() / found.deviation_error.mean() - 1.0), allowed)
        covered = abs(found.deviation - deviation) < 2 * found.deviation_error
        at_least(covered.mean(), 0.9)
        at_most(covered.mean(), 0.98)


# The three routes


@CASES
def test_quadrature_is_the_closed_form(inputs):
    objective = RobustObjective(surrogate(), DESIGN, inputs)
    places = designs(20)
    found, exact = objective(places), objective.closed_form(places)
    assert abs((found - exact)[:, 0] / exact[:, 1]).max() < 1e-6
    assert abs(found[:, 1] / exact[:, 1] - 1).max() < 1e-5
    finer = RobustObjective(surrogate(), DESIGN, inputs, tolerance=1e-12)(places)
    assert abs(finer / exact - 1).max() < 2e-7


def test_moments_of_the_predictor_by_brute_force():
    """A dense grid through `predict`, which shares no code with the tensor rule."""
    model = surrogate()
    objective = RobustObjective(model, DESIGN, UNIFORM[:2])
    nodes, weights = np.polynomial.legendre.leggauss(30)
    (place,) = designs(1)
    m, c = np.meshgrid(place[0] + 0.05 * nodes, 6.5e-4 + 3.5e-4 * nodes, indexing="ij")
    grid = np.stack([m, np.full_like(m, place[1]), np.full_like(m, place[2]), c], axis=-1)
    values = model.predict(grid.reshape(-1, 4))
    weight = np.outer(weights, weights).ravel() / 4
    mean = weight @ values
    deviation = np.sqrt(weight @ (values - mean) ** 2)
    np.testing.assert_allclose(objective(place[None]), [[mean, deviation]], rtol=1e-7)


def test_nothing_random_about_the_design_or_at_all():
    model, places = surrogate(), designs(5)
    calm = RobustObjective(model, (*DESIGN, "C"), ())
    places = np.column_stack([places, np.full(5, 5e-4)])
    values = model.predict(places)
    np.testing.assert_allclose(calm(places)[:, 0], values, rtol=1e-13)
    assert (calm(places)[:, 1] < 1e-13).all()
    assert calm(places[:0]).shape == (0, 2)


# Inputs that are derived: trained in r = I / m, tolerances in I and m

RATIO = (DerivedInput("r", ("I", "m"), lambda inertia, mass: inertia / mass),)
RATIO_NAMES = ("m", "u", "r", "C")
RATIO_UPPER = np.array([2.0, 0.3, 1e-3, 1e-3])


def in_ratio(**changes):
    arguments = {"derived": RATIO, "probes": designs(50)} | changes
    model = surrogate(names=RATIO_NAMES, upper=RATIO_UPPER)
    return RobustObjective(model, DESIGN, UNIFORM, **arguments)


def test_derived_inputs_agree_with_a_fine_rule_and_with_samples():
    objective, places = in_ratio(), designs(20)
    found, fine = objective(places), in_ratio(tolerance=1e-12)(places)
    assert abs((found - fine)[:, 0] / fine[:, 1]).max() < 1e-6
    assert abs(found[:, 1] / fine[:, 1] - 1).max() < 1e-6
    sampled = sample_moments(objective.sampled(places[:2], drawn(1_000_000, 4)))
    assert (abs(found[:2, 0] - sampled.mean) < 3 * sampled.mean_error).all()
    assert (abs(found[:2, 1] - sampled.deviation) < 3 * sampled.deviation_error).all()


def test_derived_support_must_stay_inside():
    place = np.array([[1.1, 0.0, 1.5e-4]])  # I down to 0.5e-4, m up to 1.15: r = 4.3e-5 < 5e-5
    with refused("r", match="does not extrapolate") as caught:
        in_ratio()(place)
    assert caught.value.value == pytest.approx(0.5e-4 / 1.15)


# Piecewise models


def pieces():
    """Four unrelated models on boxes cut across u and C, so that the prediction jumps."""
    leaves = []
    for k, (u, c) in enumerate([(0, 0), (0, 1), (1, 0), (1, 1)]):
        lower, upper = LOWER.copy(), UPPER.copy()
        (upper if u == 0 else lower)[1] = 0.03
        (upper if c == 0 else lower)[3] = 5e-4
        leaves.append(surrogate(lower=lower, upper=upper, seed=k))
    return Piecewise(tuple(leaves), np.ones(4, bool))


def test_piecewise_model_is_averaged_over_draws():
    with pytest.raises(InputError, match="give draws"):
        RobustObjective(pieces(), DESIGN, UNIFORM)
    objective = RobustObjective(pieces(), DESIGN, UNIFORM, draws=lambda _: drawn(300_000, 6))
    places = designs(3)
    found = objective(places)
    sampled = sample_moments(objective.sampled(places, drawn(300_000, 5)))
    assert (abs(found[:, 0] - sampled.mean) < 5 * sampled.mean_error).all()
    assert (abs(found[:, 1] - sampled.deviation) < 5 * sampled.deviation_error).all()


def test_support_must_stay_inside_the_domain():
    objective = RobustObjective(surrogate(), DESIGN, UNIFORM)
    place = designs(1)
    assert np.isfinite(objective(np.array([[1.05, 0.0, 2e-4]]))).all()  # just touches the border
    for column, value in [(0, 1.04), (1, 0.21), (2, 1.4e-4), (0, np.nan)]:
        outside = place.copy()
        outside[0, column] = value
        with refused(DESIGN[column], match="does not extrapolate"):
            objective(outside)
    wide = RobustObjective(surrogate(), DESIGN, (RandomVariable("C", Uniform(6.45e-4, 3.55e-4)),))
    with refused("C", match="does not extrapolate"):
        wide(place)


def test_an_input_over_many_length_scales_is_refused():
    rough = surrogate(lengths=(1.0, 1.0, 1.0, 0.01))
    with refused("C", match="length scales"):
        RobustObjective(rough, DESIGN, UNIFORM[:1])


# A kernel that is no product of its inputs


def test_moments_under_matern_are_those_of_a_dense_grid():
    """Draws in equal steps of probability, against a Gauss rule through scikit-learn's kernel."""
    rough = replace(surrogate(), kernel=MATERN)
    steps = (np.arange(4000) + 0.5) / 4000
    objective = RobustObjective(
        rough, DESIGN, UNIFORM[:1], draws=lambda _: {"C": 3e-4 + 7e-4 * steps[None]}
    )
    (place,) = designs(1)
    nodes, weights = np.polynomial.legendre.leggauss(40)
    at = np.column_stack([np.tile(place, (40, 1)), 6.5e-4 + 3.5e-4 * nodes])
    peer = Matern(rough.length_scales, nu=2.5)(rough.to_unit(at), rough.to_unit(rough.inputs))
    values = rough.mean + rough.scale * rough.signal_variance * peer @ rough.alpha
    mean = weights @ values / 2
    deviation = np.sqrt(weights @ (values - mean) ** 2 / 2)
    np.testing.assert_allclose(objective(place[None]), [[mean, deviation]], rtol=3e-4)

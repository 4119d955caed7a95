"""Surrogates: how long fits take, beside scikit-learn's, and how far off they are on points they have not seen.

    python analysis/benchmark_surrogates.py                 # all of it, about 10 min
    python analysis/benchmark_surrogates.py fits --seeds 1  # a look: fits, kernels or surfaces

fits: Kriging by scikit-learn's GaussianProcessRegressor (same kernel, bounds, first start and number of starts,
one thread) and by `fit_kriging`: seconds of processor time, log likelihood by the same formula, held-out error.
kernels: held-out error of the squared exponential and of Matern 5/2 on the same functions.
surfaces: polynomials of 20 variables, all terms up to an order beside those that are chosen of a cubic's 1771.
Held-out errors are root mean squares on 2000 points over the deviation of the function; medians over the seeds.
"""

import argparse
import time
import warnings
from collections.abc import Callable

import numpy as np
from scipy.stats import qmc
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

from hpcclear.base.threads import one_thread
from hpcclear.statistics.surrogate.fitting import (
    LENGTH_BOUNDS,
    NOISE_BOUNDS,
    SIGNAL_BOUNDS,
    fit_kriging,
)
from hpcclear.statistics.surrogate.kernels import KERNELS
from hpcclear.statistics.surrogate.likelihood import negative_likelihood
from hpcclear.statistics.surrogate.polynomial import n_terms
from hpcclear.statistics.surrogate.response_surface import fit_response_surface

Function = Callable[[np.ndarray], np.ndarray]
RESTARTS = 3
TESTS = 2000


def friedman(x: np.ndarray) -> np.ndarray:
    """Smooth, five inputs matter (Friedman 1991)."""
    wave = 10 * np.sin(np.pi * x[:, 0] * x[:, 1])
    return wave + 20 * (x[:, 2] - 0.5) ** 2 + 10 * x[:, 3] + 5 * x[:, 4]


def wavy(x: np.ndarray) -> np.ndarray:
    """Two waves, one of them across two inputs, and a line; the fifth input does nothing."""
    return np.sin(14 * x[:, 0]) + 0.6 * np.cos(11 * x[:, 1] + 3 * x[:, 2]) + x[:, 3]


def kinked(x: np.ndarray) -> np.ndarray:
    """Sobol's G function: each input has a kink in its middle."""
    weights = np.array([0.0, 1.0, 4.5, 9.0, 99.0])
    return np.prod((np.abs(4 * x[:, :5] - 2) + weights) / (1 + weights), axis=1)


def edge(x: np.ndarray) -> np.ndarray:
    """Flat on both sides of a steep edge, and a little of all else."""
    return np.tanh(12 * (x[:, 0] - 0.3 - 0.3 * x[:, 1])) + 0.3 * x[:, 2] ** 2 + 0.2 * x[:, 3]


def ripples(x: np.ndarray) -> np.ndarray:
    """A slope that a short wave of a twentieth of its height runs over."""
    return x[:, 0] + x[:, 1] ** 2 + 0.05 * np.sin(40 * x[:, 0]) + 0.03 * x[:, 2] * x[:, 3]


def welch(x: np.ndarray) -> np.ndarray:
    """Twenty inputs, some of which hardly matter (Welch et al. 1992, doi:10.1080/00401706.1992.10485229)."""
    z = x - 0.5
    slopes = {4: 1.0, 1: 0.05, 2: 0.08, 5: -0.03, 6: 0.03, 8: -0.09, 9: -0.01, 10: -0.07}
    slopes |= {13: -0.04, 14: 0.06, 16: -0.01, 17: -0.03}
    linear = sum(slope * z[:, k] for k, slope in slopes.items())
    high = 40 * z[:, 18] ** 3 - 5 * z[:, 18] + 0.25 * z[:, 12] ** 2
    return 5 * z[:, 11] / (1 + z[:, 0]) + 5 * (z[:, 3] - z[:, 19]) ** 2 + high + linear


def dense(x: np.ndarray) -> np.ndarray:
    """A full quadratic in twenty inputs."""
    rng = np.random.default_rng(77)
    slopes, pairs = rng.standard_normal(20), 0.15 * rng.standard_normal((20, 20))
    z = 2 * x - 1
    return z @ slopes + np.einsum("ni,ij,nj->n", z, pairs, z)


FIVE: tuple[Function, ...] = (friedman, wavy, kinked, edge, ripples)


def main() -> None:
    """Print a line for each function."""
    parser = argparse.ArgumentParser(description=__doc__)
    parts = {"fits": fits, "kernels": kernels, "surfaces": surfaces}
    parser.add_argument("part", nargs="*", choices=[*parts, []], default=[])
    parser.add_argument("--seeds", type=int, default=3)
    words = parser.parse_args()
    with one_thread():
        for name in words.part or parts:
            print(f"{name}:", flush=True)
            parts[name](words.seeds)


def fits(seeds: int) -> None:
    """Kriging by scikit-learn and by `fit_kriging`."""
    welcher = (welch, friedman)  # of 20 inputs
    sizes = [(5, 200, FIVE), (20, 200, welcher), (5, 1000, FIVE)]
    _both(friedman, 5, 30, 0)  # loads and compiles what both need
    for dims, count, functions in sizes:
        for function in functions:
            rows = np.array([_both(function, dims, count, seed) for seed in range(seeds)])
            theirs, ours = np.median(rows, axis=0)
            gained = np.median(rows[:, 1, 1] - rows[:, 0, 1])
            print(
                f"  {function.__name__:9} {dims:2} x {count:4}: scikit-learn {theirs[0]:6.2f} s, here {ours[0]:5.2f} s, "
                f"{np.median(rows[:, 0, 0] / rows[:, 1, 0]):5.1f} times faster; log likelihood {gained:+9.3g} "
                f"(least {(rows[:, 1, 1] - rows[:, 0, 1]).min():+.2g}); held-out {theirs[2]:.2e}, {ours[2]:.2e}",
                flush=True,
            )


def _both(function: Function, dims: int, count: int, seed: int) -> list[tuple[float, float, float]]:
    """Seconds, log likelihood and held-out error of both."""
    points, values, tests, truths = _data(function, dims, count, seed)
    mean, scale = values.mean(), values.std()
    seed_of_starts = int(np.random.default_rng(seed).integers(2**31))
    kernel = ConstantKernel(1.0, SIGNAL_BOUNDS) * RBF(np.full(dims, 0.5), LENGTH_BOUNDS)
    peer = GaussianProcessRegressor(
        kernel + WhiteKernel(1e-3, NOISE_BOUNDS),
        alpha=0.0,
        n_restarts_optimizer=RESTARTS,
        random_state=seed_of_starts,
    )
    started = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        peer.fit(points, (values - mean) / scale)
    theirs = time.process_time() - started
    started = time.process_time()
    model = fit_kriging(
        points, values, _box(dims), rng=np.random.default_rng(seed), restarts=RESTARTS
    )
    ours = time.process_time() - started
    own = np.log([model.signal_variance, *model.length_scales, model.noise_variance])
    likely = [
        -negative_likelihood(theta, points - 0.5, (values - mean) / scale)[0]
        for theta in (peer.kernel_.theta, own)
    ]
    off = [
        _off(truths, mean + scale * peer.predict(tests)),
        _off(truths, model.predict(tests)),
    ]
    return list(zip((theirs, ours), likely, off, strict=True))


def kernels(seeds: int) -> None:
    """Held-out errors by kernel."""
    for function in FIVE:
        for count in (100, 300):
            found = {}
            for kernel in KERNELS:
                errors = []
                for seed in range(seeds):
                    points, values, tests, truths = _data(function, 5, count, seed)
                    rng = np.random.default_rng(seed)
                    model = fit_kriging(points, values, _box(5), rng=rng, kernel=kernel)
                    errors.append(_off(truths, model.predict(tests)))
                found[kernel] = np.median(errors)
            text = ", ".join(f"{kernel} {error:.2e}" for kernel, error in found.items())
            print(f"  {function.__name__:9} 5 x {count}: held-out {text}", flush=True)


def surfaces(seeds: int) -> None:
    """Polynomials of 20 variables."""
    for function in (welch, friedman, dense):
        for count in (300, 2000):
            for order, chosen in ((1, False), (2, False), (3, False), (3, True)):
                if not chosen and n_terms(20, order) >= count:
                    continue
                rows = []
                for seed in range(1 if order == 3 and not chosen else seeds):
                    points, values, tests, truths = _data(function, 20, count, seed)
                    started = time.process_time()
                    one = fit_response_surface(points, values, _box(20), order, chosen=chosen)
                    seconds = time.process_time() - started
                    rows.append((seconds, len(one.coefficients), _off(truths, one.predict(tests))))
                seconds, terms, error = np.median(rows, axis=0)
                print(
                    f"  {function.__name__:9} 20 x {count:4}, order {order}, {'chosen' if chosen else 'all':6} "
                    f"{terms:4.0f} terms: {seconds:6.2f} s, held-out {error:.2e}",
                    flush=True,
                )


def _data(function: Function, dims: int, count: int, seed: int) -> tuple[np.ndarray, ...]:
    """Training points of a Latin hypercube, test points and values of both."""
    points = qmc.LatinHypercube(dims, rng=np.random.default_rng(seed)).random(count)
    tests = np.random.default_rng(10_000 + seed).random((TESTS, dims))
    return points, function(points), tests, function(tests)


def _box(dims: int) -> np.ndarray:
    return np.tile([0.0, 1.0], (dims, 1))


def _off(truths: np.ndarray, predicted: np.ndarray) -> float:
    return float(np.sqrt(np.mean((truths - predicted) ** 2)) / truths.std())


if __name__ == "__main__":
    main()

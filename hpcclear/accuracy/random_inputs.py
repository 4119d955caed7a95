"""Error of mean and standard deviation against Monte Carlo size: on the surrogate, beside quadrature, and by simulation."""

import time

import numpy as np
from scipy.stats import chi2

from hpcclear.accuracy.profile import Profile, Variables
from hpcclear.accuracy.surrogate import objectives
from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.ranks.team import Ranks
from hpcclear.scene import Scene
from hpcclear.scene.domain import box, to_physical
from hpcclear.scene.sampling import monte_carlo
from hpcclear.scene.streams import generator
from hpcclear.statistics.random.moments import SampledMoments, sample_moments
from hpcclear.statistics.surrogate.piecewise import Leaf
from hpcclear.study.problem import problem_of

ESTIMATES = ("surrogate", "simulation")
MOMENTS = ("mean", "deviation")
LEAST_BLOCKS = 4
"""Samples of one size below which their scatter says nothing."""


def simulate(scene: Scene, case: str, profile: Profile, ranks: Ranks) -> tuple[Array, float]:
    """The objective at draws of the random inputs about the middle of the design space, and core-seconds of one of them.

    Shape (n,); what failed is left out. `scene` has a study that has the case.
    """
    names, middle = middle_of(scene, case)
    chosen = dict(zip(names, middle[0], strict=True))
    random, count = scene.required_study.case(case).random, profile.simulations
    points = monte_carlo(scene, count, random=random, design=chosen, purpose="accuracy")
    values, each = objectives(scene, points, ranks, "random inputs: simulations")
    return values[np.isfinite(values)], each


def middle_of(scene: Scene, case: str) -> tuple[tuple[str, ...], Array]:
    """Names of the case's design variables, and the design in the middle of their space, SI, shape (1, d)."""
    names = scene.required_study.design_variables(case)
    region = box(scene, names)
    return names, to_physical(scene, names, 0.5 * (region.lower + region.upper)[None])


def measure(
    scene: Scene, case: str, model: Leaf, profile: Profile, values: Array, each: float
) -> Variables:
    """Measure at the middle of the design space: (2 estimates, 2 moments, sizes), relative to the moment; NaN if not measured.

    The model is one in the inputs of the study's optimisation; `values` (n,) and `each` as of `simulate`.
    """
    problem = problem_of(scene, case, model)  # type: ignore[arg-type]
    _, design = middle_of(scene, case)

    def drawn(size: int, rng: np.random.Generator) -> SampledMoments:
        draws = problem.independent(size, rng)(design)
        return sample_moments(problem.objective.sampled(design, draws))

    drawn(4, np.random.default_rng(0))  # compiles
    problem.objective(design)
    started = time.perf_counter()
    exact = problem.objective(design)[0]
    quadrature_seconds = time.perf_counter() - started
    try:
        closed = exact / problem.objective.closed_form(design)[0] - 1.0
    except InputError:  # inputs derived from others have none, nor has what is averaged over draws
        closed = np.full(len(MOMENTS), np.nan)
    sizes = np.array(profile.draws, np.int64)
    error, lower, upper = np.full((3, len(ESTIMATES), len(MOMENTS), len(sizes)), np.nan)
    seconds = np.full((len(ESTIMATES), len(sizes)), np.nan)
    rng = generator(scene.required_study.seed, "accuracy", "draws")
    for k, size in enumerate(sizes):
        started = time.perf_counter()
        found = [drawn(int(size), rng) for _ in range(profile.blocks)]
        seconds[0, k] = (time.perf_counter() - started) / profile.blocks
        table = np.array([[one.mean[0], one.deviation[0]] for one in found])
        error[0, :, k], lower[0, :, k], upper[0, :, k] = root_mean_square(table / exact - 1.0, 0)
    true = sample_moments(values[None])
    truth = np.array([true.mean[0], true.deviation[0]])
    for k, size in enumerate(sizes):
        blocks = len(values) // size
        seconds[1, k] = each * size
        if blocks >= LEAST_BLOCKS:
            parts = values[: blocks * size].reshape(blocks, size)
            table = np.stack([parts.mean(axis=1), parts.std(axis=1, ddof=1)], axis=1)
            ends = root_mean_square(table / truth - 1.0, 1)
            error[1, :, k], lower[1, :, k], upper[1, :, k] = ends
    bias_error = np.array([true.mean_error[0], true.deviation_error[0]]) / truth
    return {
        "estimate": np.array(ESTIMATES),
        "moment": np.array(MOMENTS),
        "draws": sizes,
        "moment_error": error,
        "moment_lower": lower,
        "moment_upper": upper,
        "moment_seconds": seconds,
        "moment_bias": exact / truth - 1.0,
        "bias_error": bias_error,
        "closed_form": closed,
        "quadrature_seconds": np.array(quadrature_seconds),
    }


def root_mean_square(errors: Array, known: int) -> tuple[Array, Array, Array]:
    """Root mean square over the first axis of any shape, with 95 % confidence intervals for normal errors.

    `known` is 1 if the truth the errors are about was taken from the same values, which hides a share of them.
    """
    freedom = len(errors) - known
    square = np.square(errors).sum(axis=0)
    ends = [np.sqrt(square / chi2.ppf(p, freedom)) for p in (0.975, 0.025)]
    return np.sqrt(square / freedom), ends[0], ends[1]

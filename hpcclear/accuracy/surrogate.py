"""Accuracy of response surface and Kriging against sample size and simulation time."""

import time

import numpy as np

from hpcclear.accuracy.profile import Profile, Variables
from hpcclear.base.arrays import Array
from hpcclear.base.outcome import Status
from hpcclear.ensemble.session import sample_points
from hpcclear.ranks.team import Ranks
from hpcclear.scene import Scene
from hpcclear.scene.domain import Box, box
from hpcclear.scene.points import Points, points_at
from hpcclear.scene.streams import generator, unit_lhs
from hpcclear.statistics.surrogate.fitting import KrigingMethod
from hpcclear.statistics.surrogate.metrics import accuracy
from hpcclear.statistics.surrogate.piecewise import Leaf
from hpcclear.statistics.surrogate.polynomial import n_terms
from hpcclear.statistics.surrogate.response_surface import fit_response_surface
from hpcclear.statistics.surrogate.subintervals import Method
from hpcclear.study.surrogates import coordinate, method_of


def region_of(scene: Scene, case: str) -> Box:
    """Where the surrogates hold: the design space, widened so that no random input of the case leaves it."""
    study = scene.required_study
    return box(scene, study.optimisation, study.case(case).random)


def designs_of(scene: Scene, case: str, profile: Profile, rng: np.random.Generator) -> list[Array]:
    """Designs of every training sample, then of the test, in sampling coordinates, shape (size, d) each."""
    region = region_of(scene, case)
    sizes = *profile.training, profile.tests
    return [region.at(unit_lhs(size, len(region.names), rng)) for size in sizes]


def simulate(scene: Scene, case: str, profile: Profile, ranks: Ranks) -> tuple[Array, float]:
    """The objective at all designs, one after the other, shape (n,), and core-seconds of one of them."""
    rng = generator(scene.required_study.seed, "accuracy", "surrogate")
    coordinates = np.concatenate(designs_of(scene, case, profile, rng))
    points = points_at(scene, region_of(scene, case).names, coordinates)
    return objectives(scene, points, ranks, "surrogate: simulations")


def measure(
    scene: Scene, case: str, profile: Profile, values: Array, sample_seconds: float
) -> tuple[Variables, Leaf]:
    """Fit the surrogates to samples of each size and compare them with fresh simulations; and the Kriging model of the largest.

    They are two, and what the study requests, where that is another than Kriging with the squared exponential.
    `values`, shape (n,), and `sample_seconds` are those of `simulate`.
    """
    region = region_of(scene, case)
    rng = generator(scene.required_study.seed, "accuracy", "surrogate")
    coordinates = designs_of(scene, case, profile, rng)
    parts = np.split(values, np.cumsum([len(one) for one in coordinates])[:-1])
    bounds = region.bounds
    names = [coordinate(scene.required_study.variable(name)) for name in region.names]
    methods: dict[str, Method] = {"Kriging": KrigingMethod()}
    asked = method_of(scene)
    methods |= {asked.label: asked} if asked.label else {}
    shape = (1 + len(methods), len(profile.training))
    r2, rmae, loo, seconds = (np.full(shape, np.nan) for _ in range(4))
    for k, (points, f) in enumerate(zip(coordinates[:-1], parts[:-1], strict=True)):
        deviation = np.nanstd(f)
        started = time.perf_counter()
        order = next((m for m in (3, 2, 1) if 1.3 * n_terms(len(names), m) <= len(points)), 0)
        surface = fit_response_surface(points, f, bounds, order)
        seconds[0, k] = time.perf_counter() - started
        loo[0, k] = np.sqrt(np.mean(surface.leave_one_out_errors**2)) / deviation
        models = []
        for j, method in enumerate(methods.values(), 1):
            started = time.perf_counter()
            models.append(method.fit(points, f, bounds, rng=rng, names=names))
            seconds[j, k] = time.perf_counter() - started
            left_out = models[-1].values - models[-1].leave_one_out()
            loo[j, k] = np.sqrt(np.mean(left_out**2)) / deviation
        for j, surrogate in enumerate((surface, *models)):
            reached = accuracy(parts[-1], surrogate.predict(coordinates[-1]))
            r2[j, k], rmae[j, k] = reached.r2, reached.rmae
    found = {
        "surrogate": np.array(["response surface", *methods]),
        "training": np.array(profile.training, np.int64),
        "r2": r2,
        "rmae": rmae,
        "leave_one_out": loo,
        "fit_seconds": seconds,
        "sample_seconds": np.array(sample_seconds),
    }
    return found, models[0]


def simulated_middle(scene: Scene, case: str, ranks: Ranks) -> None:
    """Simulate one design on the available ranks: every rank compiles the kernel, or loads it."""
    region = region_of(scene, case)
    middle = points_at(scene, region.names, 0.5 * (region.lower + region.upper)[None])
    objectives(scene, middle, ranks, "compilation")


def objectives(scene: Scene, points: Points, ranks: Ranks, stage: str) -> tuple[Array, float]:
    """The study's objective at points, shape (n,), SI, NaN where failed, and core-seconds of one of them."""
    records = sample_points(scene, points, ranks, stage=stage)
    values = records["objective"]
    busy = float(ranks.stage_seconds[stage][:, 0].sum())
    return np.where(records["status"] == Status.OK, values, np.nan), busy / len(points)

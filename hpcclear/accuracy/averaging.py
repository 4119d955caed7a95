"""Error of the objective against transient and averaged revolutions, and its lower bound by chaos.

Copies of the scene that differ by tiny perturbations run for a long time, half of them with ten times stricter tolerances.
Where motion is periodic they come to agree; where it is chaotic they part, and each sees another interval of the same
attractor; where the damping keeps an old impact speed they can settle on different orbits for good. The last is an error
that no average removes: the scatter of the copies' long averages.
"""

import time

import numpy as np

from hpcclear.accuracy.methods import one_turn
from hpcclear.accuracy.profile import Profile, Variables
from hpcclear.base.arrays import Array, Integers
from hpcclear.dynamics.evaluation.evaluator import DEFAULT_LANES
from hpcclear.dynamics.evaluation.steady.judging import objective
from hpcclear.dynamics.layout import MAX_JOINTS
from hpcclear.dynamics.layout.views import Parameters, Start
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.problem import problem_of
from hpcclear.dynamics.setup.start import start_states
from hpcclear.dynamics.stepping.lanes import Lanes
from hpcclear.scene import Scene

PERTURBATION = 1e-10
"""Relative size of the perturbations at the start."""

STRICTER = 10.0
"""How many times stricter the tolerances of every other copy are."""


def measure(scene: Scene, profile: Profile) -> Variables:
    """Run the copies and compare short averages with the long one."""
    return analyse(*revolutions_of(scene, profile.copies, profile.revolutions))


def analyse(gaps: Array, seconds: float) -> Variables:
    """The panel from mean gaps (revolutions, copies, 2 joints); the second half of the run counts as the truth.

    `seconds`: of one revolution of one copy in a full block of lanes.
    """
    half = len(gaps) // 2
    transient, averaged = doubling(half // 2, start=0), doubling(half // 2, start=1)
    late = objective(gaps[half:].mean(axis=0))  # (copies,)
    truth = late.mean()
    error = np.array([[_error(gaps, t, a, truth) for a in averaged] for t in transient])
    floor = np.array(late.std(ddof=1) / truth)
    found = {"transient": transient, "averaged": averaged, "averaging_error": error}
    return found | {"averaging_floor": floor, "turn_seconds": np.array(seconds)}


def doubling(most: int, start: int) -> Integers:
    """`start`, then powers of two up to `most`, shape (n,)."""
    powers = 2 ** np.arange(1 + int(np.log2(max(most, 1))))
    return np.unique(np.append(start, powers)).astype(np.int64)


def _error(gaps: Array, transient: int, averaged: int, truth: float) -> float:
    f = objective(gaps[transient : transient + averaged].mean(axis=0))
    return float(np.sqrt(np.mean((f / truth - 1.0) ** 2)))


def revolutions_of(scene: Scene, copies: int, revolutions: int) -> tuple[Array, float]:
    """Mean gaps (revolutions, copies, 2 joints) revolution by revolution, and seconds of one of them.

    Copies that failed are left out.
    """
    here = one_turn(scene)
    problem = problem_of(here)
    par = np.repeat(parameters(here), copies, axis=0)
    Parameters(par[1::2]).strictness = STRICTER**2  # squared, as the kernel keeps it
    start = Start(np.repeat(start_states(here, parameters(here)).rows, copies, axis=0))
    low, high = -PERTURBATION, PERTURBATION
    start.moving *= 1.0 + np.random.default_rng(0).uniform(low, high, start.moving.shape)
    lanes = Lanes(problem, DEFAULT_LANES)
    lanes.step(1)  # without samples it only compiles
    gaps = np.full((revolutions, copies, MAX_JOINTS), np.nan)
    alive = np.arange(copies)
    started = time.perf_counter()
    for revolution in range(revolutions):
        outcome = lanes.run(par[alive], start)
        good = outcome.status == 0
        alive, outcome = alive[good], outcome[good]
        gaps[revolution, alive] = outcome.mean_gap
        start = outcome.end()
    seconds = (time.perf_counter() - started) / (revolutions * copies)
    return gaps[:, np.isfinite(gaps[-1]).all(axis=1)], seconds

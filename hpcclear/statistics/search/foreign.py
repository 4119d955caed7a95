"""Searches of pymoo in the place of the swarm, through ask and tell: same evaluations, same constraints, same kind of front.

Whatever an algorithm keeps of what it met, the front is made as the swarm's: the archive of all feasible designs that no
other one dominates, cut to size. A design whose objectives are not all finite breaks constraints without limit.

Source: J. Blank and K. Deb, "pymoo: multi-objective optimization in Python", IEEE Access 8 (2020),
doi:10.1109/ACCESS.2020.2990567. It is an extra and is imported when a search begins, never with the package.
"""

import importlib
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.statistics.search.pareto import Archive, Front, cut, relative_gain
from hpcclear.statistics.search.settings import SwarmSettings

ALGORITHMS = {
    "AGEMOEA": "age",
    "AGEMOEA2": "age2",
    "GDE3": "gde3",
    "NSGA2": "nsga2",
    "NSGA3": "nsga3",
    "RVEA": "rvea",
    "SMSEMOA": "sms",
    "UNSGA3": "unsga3",
}
"""Algorithms, and the module of `pymoo.algorithms.moo` that each is in: those that need to know no more than how many designs
they move at a time, draw all their numbers by their seed (MOPSO_CD, CMOPSO and SPEA2 do not) and keep to constraints within
some thousand evaluations (CTAEA does not)."""

DIRECTED = ("NSGA3", "RVEA", "UNSGA3")
"""Those that go by reference directions: a simplex lattice (Das and Dennis 1998) of as many as there are designs at a time, or
fewer."""

UNKNOWN = 1e30
"""Violation of a design whose objectives are not finite."""


def check(name: str) -> None:
    """That an algorithm can be had.

    Raises
    ------
    InputError
        There is none of that name, or pymoo is not installed; the message names the extra that brings it.
    """
    if name not in ALGORITHMS:
        raise InputError("algorithm", name, "is not known", f"Write one of {', '.join(ALGORITHMS)}")
    try:
        importlib.import_module("pymoo")
    except ModuleNotFoundError:
        raise InputError(
            "study.swarm.algorithm",
            f"pymoo:{name}",
            "is an algorithm of pymoo, which is not installed",
            "Install it with: pip install 'hpcclear[pymoo]', or leave the entry out",
        ) from None


def minimise(
    name: str,
    function: Callable[[Array], ArrayLike | tuple[ArrayLike, ArrayLike]],
    bounds: Array,
    objectives: int,
    *,
    iterations: int,
    particles: int,
    rng: np.random.Generator,
    size: int = 100,
) -> Front:
    """Run an algorithm of pymoo for the evaluations that a swarm would take.

    Parameters
    ----------
    name : str
        One of `ALGORITHMS`.
    function : callable
        Takes points (n, d) and returns objectives (n, m), or a tuple of them and violations (n,) or (n, c), > 0 where broken.
    bounds : array, shape (d, 2)
    objectives : int
        m.
    iterations, particles : int
        Their product is how often the function is evaluated.
    rng : Generator
        Advanced; the algorithm's seed is drawn from it.
    size : int
        Points of the front at most.

    Returns
    -------
    Front
        As the swarm's; ``history`` is empty.

    Raises
    ------
    InputError
        As `check`.
    """
    check(name)
    lower, width = bounds[:, 0], bounds[:, 1] - bounds[:, 0]
    algorithm, told = _begun(name, objectives, len(bounds), particles, iterations, rng)
    archive = Archive(
        SwarmSettings.archive_capacity, np.empty((0, len(bounds))), np.empty((0, objectives))
    )
    budget, late = iterations * particles, (iterations - max(1, iterations // 10)) * particles
    count = failed = infeasible = 0
    earlier = archive.values
    while count < budget:
        asked = algorithm.ask()
        if asked is None or len(asked) == 0:  # it has no further design
            break
        asked = asked[: budget - count]
        unit = np.clip(asked.get("X"), 0.0, 1.0)
        values, broken = _checked(function(np.clip(lower + unit * width, *bounds.T)))
        good = np.isfinite(values).all(axis=1)
        archive.add(unit[good & (broken == 0.0)], values[good & (broken == 0.0)])
        told(asked, values, np.where(good, broken, np.maximum(broken, UNKNOWN)))
        count += len(unit)
        failed += int((~good).sum())
        infeasible += int((good & (broken > 0.0)).sum())
        if count <= late:
            earlier = archive.values
    kept = cut(archive.values, size)
    if len(kept):
        kept = kept[np.lexsort(archive.values[kept].T[::-1])]
    gain = relative_gain(earlier, archive.values)
    return Front(
        points=np.clip(lower + archive.positions[kept] * width, *bounds.T),
        values=archive.values[kept],
        evaluations=count,
        failed=failed,
        infeasible=infeasible,
        history=np.empty(0),
        gain=gain,
        settled=bool(gain < 1e-3),
        remark=f"pymoo's {name}: the last tenth of {count} evaluations won {gain:.1e} of the hypervolume",
    )


def _begun(
    name: str,
    objectives: int,
    variables: int,
    particles: int,
    iterations: int,
    rng: np.random.Generator,
) -> tuple[Any, Callable[[Any, Array, Array], None]]:
    """The algorithm at its start, and what tells it objectives (n, m) and violations (n,) of what it asked for."""
    from pymoo.core.problem import Problem
    from pymoo.problems.static import StaticProblem

    problem = Problem(n_var=variables, n_obj=objectives, n_ieq_constr=1, xl=0.0, xu=1.0)
    maker = getattr(importlib.import_module(f"pymoo.algorithms.moo.{ALGORITHMS[name]}"), name)
    entries: dict[str, Any] = {"pop_size": particles}
    if name in DIRECTED:
        entries = {"ref_dirs": _directions(objectives, particles)}
    algorithm = maker(**entries)
    seed = int(rng.integers(2**31))
    budget = ("n_eval", iterations * particles)
    algorithm.setup(problem, termination=budget, seed=seed, verbose=False)

    def told(asked: Any, values: Array, broken: Array) -> None:
        finite = np.isfinite(values)
        worst = np.max(values, axis=0, initial=-np.inf, where=finite)
        values = np.where(finite, values, np.where(np.isfinite(worst), worst, 0.0))
        answer = StaticProblem(problem, F=values, G=broken[:, None])
        algorithm.evaluator.eval(answer, asked)
        algorithm.tell(infills=asked)

    return algorithm, told


def _directions(objectives: int, most: int) -> Array:
    """A simplex lattice of at most so many directions, (n, objectives), but never fewer than objectives."""
    from pymoo.util.ref_dirs import get_reference_directions

    parts = 1
    while math.comb(parts + objectives, objectives - 1) <= most:
        parts += 1
    return np.asarray(get_reference_directions("das-dennis", objectives, n_partitions=parts))


def _checked(found: ArrayLike | tuple[ArrayLike, ArrayLike]) -> tuple[Array, Array]:
    """Objectives (n, m) and total violation (n,), infinite where that is not known."""
    values, broken = found if isinstance(found, tuple) else (found, None)
    table = np.asarray(values, dtype=float)
    if broken is None:
        return table, np.zeros(len(table))
    total = np.asarray(broken, dtype=float).reshape(len(table), -1)
    return table, np.where(np.isnan(total), np.inf, np.maximum(total, 0.0)).sum(axis=1)

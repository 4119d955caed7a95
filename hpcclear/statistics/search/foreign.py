"""Algorithms of pymoo instead of the swarm, through `ask` and `tell`: same evaluations, same constraints, same kind of front.

Source: J. Blank and K. Deb, "pymoo: multi-objective optimization in Python", IEEE Access 8 (2020),
doi:10.1109/ACCESS.2020.2990567. It is an extra and is imported when a search begins, never with the package.
"""

import copy
import importlib
import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.base.extras import installing
from hpcclear.statistics.search.asking import KEY, SearchTask

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


def __getattr__(name: str) -> Callable[[SearchTask], "Pymoo"]:
    """The maker of an algorithm of pymoo, by its name: what the registry of searches finds here."""
    if name not in ALGORITHMS:
        raise AttributeError(name)
    return partial(_begun, name)


class Pymoo:
    """An algorithm of pymoo, not set up yet, as a `hpcclear.statistics.search.asking.Search`.

    Its seed is drawn from the generator of the task.
    """

    def __init__(self, algorithm: Any, task: SearchTask) -> None:
        from pymoo.core.problem import Problem

        problem = Problem(len(task.bounds), task.objectives, n_ieq_constr=1, xl=0.0, xu=1.0)
        end, seed = ("n_eval", task.evaluations), int(task.rng.integers(2**31))
        algorithm.setup(problem, termination=end, seed=seed, verbose=False)
        self._algorithm, self._bounds = algorithm, task.bounds
        self._asked: Any = None

    def ask(self) -> Array | None:
        """Designs to evaluate next, (n, d), None at the end."""
        self._asked = self._algorithm.ask()
        if self._asked is None or len(self._asked) == 0:
            return None
        lower, width = self._bounds[:, 0], self._bounds[:, 1] - self._bounds[:, 0]
        unit = np.clip(self._asked.get("X"), 0.0, 1.0)
        return np.clip(lower + unit * width, *self._bounds.T)

    def tell(self, designs: Array, objectives: Array, constraints: Array) -> None:
        """Objectives (n, m) and violations (n,) of what was requested, or of the first of it."""
        from pymoo.problems.static import StaticProblem

        asked, finite = self._asked[: len(designs)], np.isfinite(objectives)
        worst = np.max(objectives, axis=0, initial=-np.inf, where=finite)
        values = np.where(finite, objectives, np.where(np.isfinite(worst), worst, 0.0))
        good = finite.all(axis=1)
        broken = np.where(good, constraints, UNKNOWN)
        answer = StaticProblem(self._algorithm.problem, F=values, G=broken[:, None])
        self._algorithm.evaluator.eval(answer, asked)
        self._algorithm.tell(infills=asked)


def is_algorithm(source: object) -> bool:
    """Whether something is an algorithm of pymoo, or a class of them: they are set up before they return designs."""
    return all(hasattr(source, name) for name in ("setup", "ask", "tell"))


def adapted(source: object, task: SearchTask) -> Pymoo:
    """The search of an algorithm of pymoo, or of a class of them that needs no arguments."""
    return Pymoo(source() if isinstance(source, type) else copy.deepcopy(source), task)


def _begun(name: str, task: SearchTask) -> Pymoo:
    """An algorithm with its own settings."""
    try:
        importlib.import_module("pymoo")
    except ModuleNotFoundError:
        reason = "is an algorithm of pymoo, which is not installed"
        remedy = f"{installing('pymoo')}, or leave the entry out"
        raise InputError(KEY, f"pymoo:{name}", reason, remedy) from None
    module = importlib.import_module(f"pymoo.algorithms.moo.{ALGORITHMS[name]}")
    entries: dict[str, Any] = {"pop_size": task.particles}
    if name in DIRECTED:
        entries = {"ref_dirs": _directions(task.objectives, task.particles)}
    return Pymoo(getattr(module, name)(**entries), task)


def _directions(objectives: int, most: int) -> Array:
    """A simplex lattice of at most so many directions, (n, objectives), but never fewer than objectives."""
    from pymoo.util.ref_dirs import get_reference_directions

    parts = 1
    while math.comb(parts + objectives, objectives - 1) <= most:
        parts += 1
    return np.asarray(get_reference_directions("das-dennis", objectives, n_partitions=parts))

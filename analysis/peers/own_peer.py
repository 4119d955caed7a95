"""This package, and the plain loop beside it, in the form of a peer."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import plain_loop
from scenes import Setup

from hpcclear.dynamics.evaluation.evaluator import DEFAULT_LANES
from hpcclear.dynamics.stepping.explicit.tableau import TABLEAUS
from hpcclear.dynamics.stepping.lanes import Lanes
from hpcclear.dynamics.stepping.problem import Problem
from peers.system import SLIDER, Array, tolerances


def lanes_positions(setup: Setup, width: int) -> Array:
    """Slider positions at the end of every sample, shape (m,)."""
    return _collected(_lanes_of(setup.problem, "lanes", width), setup)


def _collected(lanes: Lanes, setup: Setup) -> Array:
    return lanes.run(setup.par, setup.start).coordinates(4)[:, SLIDER]


def _lanes_of(problem: Problem, name: str, width: int) -> Lanes:
    """Lanes that are kept between calls, as other codes keep what they have compiled."""
    revolutions = (problem.transient, problem.averaged)
    key = (problem.effects, name, problem.rtol, problem.atol, revolutions, width)
    _PROBLEMS.setdefault(key, problem)
    return _kept(key)


@cache
def _kept(key: tuple) -> Lanes:
    return Lanes(_PROBLEMS[key], key[-1])


_PROBLEMS: dict[tuple, Problem] = {}


def _solver(name: str) -> Callable[[Setup, int], float]:
    """By what `simulate` chooses, or by one of the pairs."""
    tableau = TABLEAUS.get(name)

    def solve(setup: Setup, sample: int = 0) -> float:
        problem = setup.problem
        if tableau is not None:
            problem = replace(problem, tableau=tableau)
        one = setup._replace(
            par=setup.par[sample : sample + 1], start=setup.start[sample : sample + 1]
        )
        return float(_collected(_lanes_of(problem, name, 1), one)[0])

    return solve


def plain(setup: Setup, sample: int = 0) -> float:
    """The yardstick, one sample."""
    return float(plain_positions(setup._replace(
        par=setup.par[sample : sample + 1], start=setup.start[sample : sample + 1]
    ))[0])  # fmt: skip


def plain_positions(setup: Setup) -> Array:
    """The yardstick, all samples."""
    p = setup.problem
    latched = p.effects.latched is not None
    revolutions = (p.transient, p.averaged)
    found = plain_loop.run(
        setup.par,
        setup.start.rows,
        p.rtol,
        tuple(tolerances(setup)),
        revolutions,
        latched,
        p.impact_floor,
    )
    return found[:, 1]


SOLVERS = {f"hpcclear {name}": _solver(name) for name in ("auto", *TABLEAUS)} | {
    "plain loop": plain
}
BATCH = {
    "hpcclear lanes": lambda setup: lanes_positions(setup, DEFAULT_LANES),
    "plain loop": plain_positions,
}
LAWS = ("hunt-crossley", "frictionless", "lankarani-nikravesh")

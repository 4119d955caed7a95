"""scipy.integrate.solve_ivp with the compiled right-hand side.

Lankarani-Nikravesh runs from event to event, DOP853 restarted at each impact and at each contact's end.
"""

from collections.abc import Callable

import numpy as np
from numba import njit
from plain_loop import motion
from scenes import Setup
from scipy.integrate import solve_ivp

from peers.system import SLIDER, STATES, end_time, right_hand_side, start, tolerances


@njit
def _rates(t, y, p):
    dy = np.empty(STATES)
    right_hand_side(t, y, dy, p)
    return dy


@njit
def _latched_rates(t, y, p, active, inverse):
    dy, gaps = np.empty(STATES), np.empty(4)
    motion(t, y, dy, p, True, active, inverse, gaps)
    return dy


@njit
def _gaps(t, y, p):
    dy, gaps = np.empty(STATES), np.empty(4)
    motion(t, y, dy, p, True, np.zeros(2, np.bool_), np.zeros(2), gaps)
    return gaps


def _solver(method: str) -> Callable[[Setup, int], float]:
    def solve(setup: Setup, sample: int = 0) -> float:
        if setup.problem.effects.latched is not None:
            return _from_event_to_event(setup, sample, method)
        result = solve_ivp(
            _rates,
            (0.0, end_time(setup, sample)),
            start(setup, sample),
            method,
            args=(setup.par[sample],),
            rtol=setup.problem.rtol,
            atol=tolerances(setup),
        )
        return float(result.y[SLIDER, -1]) if result.success else float("nan")

    return solve


_MOST_EVALUATIONS = 200_000  # a contact latched at a small speed is stiff: explicit steps crawl


class _TooSlow(Exception):
    """More evaluations than a revolution is worth."""


def _from_event_to_event(setup: Setup, sample: int, method: str) -> float:
    evaluations = 0

    def rates(t, y, p, active, inverse):
        nonlocal evaluations
        evaluations += 1
        if evaluations > _MOST_EVALUATIONS:
            raise _TooSlow
        return _latched_rates(t, y, p, active, inverse)

    p, y, t, end = setup.par[sample], start(setup, sample), 0.0, end_time(setup, sample)
    active, inverse = np.zeros(2, bool), np.zeros(2)
    while t < end:
        events = []
        for j in range(2):

            def event(t, y, p, active, inverse, j=j):
                return _gaps(t, y, p)[j]

            event.terminal, event.direction = True, -1.0 if active[j] else 1.0
            events.append(event)
        try:
            result = solve_ivp(
                rates,
                (t, end),
                y,
                method,
                args=(p, active, inverse),
                events=events,
                rtol=setup.problem.rtol,
                atol=tolerances(setup),
            )
        except _TooSlow:
            return float("nan")
        t, y = float(result.t[-1]), result.y[:, -1]
        if result.status < 0:
            return float("nan")
        for j in range(2):
            if len(result.t_events[j]):
                active[j] = not active[j]
                if active[j]:
                    inverse[j] = 1.0 / max(_gaps(t, y, p)[2 + j], setup.problem.impact_floor)
    return float(y[SLIDER])


SOLVERS = {f"scipy {method}": _solver(method) for method in ("DOP853", "LSODA", "Radau")}
LAWS = ("hunt-crossley", "frictionless", "lankarani-nikravesh")
LAWS_OF = {"scipy LSODA": LAWS[:2], "scipy Radau": LAWS[:2]}

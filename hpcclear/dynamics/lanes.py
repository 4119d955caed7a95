"""The stepper's arrays and its queue, behind three calls: queue samples, advance, collect what finished."""

import time
from dataclasses import dataclass

import numpy as np

from hpcclear.base.arrays import Array, Booleans, Integers
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.collocation import lobatto
from hpcclear.dynamics.collocation.lobatto import STAGES
from hpcclear.dynamics.collocation.stepper import make_collocation_stepper
from hpcclear.dynamics.explicit.stepper import make_stepper
from hpcclear.dynamics.explicit.tableau import Tableau
from hpcclear.dynamics.implicit import radau
from hpcclear.dynamics.stepping.lifecycle import (
    ANGLE_TOLERANCE,
    ATOL,
    AVERAGED,
    AVERAGED_CAP,
    BETA,
    COUNTERS,
    EXPONENT,
    FINISHED,
    GAP_TOLERANCE,
    IMPACT_FLOOR,
    IMPLICIT,
    MAX_STEPS,
    NEXT_SLOT,
    OBJECTIVE_TOLERANCE,
    RECORDED,
    RTOL,
    SETTINGS,
    SLOTS,
    SMALLEST_STEP,
    STATE,
    TRANSIENT,
)

_NO_TABLE = np.zeros(4)

IMPLICIT_USE = {"never": 0, "stiff": 1, "always": 2}
"""When lanes take implicit steps: never, where their motion is stiff, always."""


@dataclass(frozen=True)
class Problem:
    """Everything that is common to the samples of a run.

    Attributes
    ----------
    effects : layout.Effects
    coordinates : int
    tableau : Tableau
    rtol : float
    atol : tuple of float
        Absolute tolerances of coordinates, then velocities, SI (2 * coordinates).
    impact_floor : float
        Least latched impact speed, m/s.
    transient, averaged, max_steps : int
    averaged_cap, objective_tolerance
        The average goes on until the relative standard error of the objective is below this, or to the cap;
        a tolerance of 0 averages over `averaged` revolutions.
    torque_table, load_table : numpy.ndarray
        Cubic cells of a periodic table, 4 coefficients a cell.
    implicit : str
        When lanes take implicit steps, a key of `IMPLICIT_USE`.
    collocation : bool
        Whether one sample after the other is integrated by Lobatto collocation, its stages in the lanes.
    """

    effects: at.Effects
    coordinates: int
    tableau: Tableau
    rtol: float
    atol: tuple[float, ...]
    impact_floor: float
    transient: int
    averaged: int
    max_steps: int
    averaged_cap: int = 0
    objective_tolerance: float = 0.0
    torque_table: Array = None  # type: ignore[assignment]
    load_table: Array = None  # type: ignore[assignment]
    implicit: str = "never"
    collocation: bool = False

    def settings(self) -> Array:
        """The numbers of the stepper's control, as it reads them, shape (SETTINGS,)."""
        s = np.zeros(SETTINGS)
        n = self.coordinates
        length = min(self.atol[:n])
        s[RTOL] = self.rtol
        # An impact is located ten times better than positions are integrated, but not below round-off.
        s[GAP_TOLERANCE] = max(0.1 * length, 4e-15)
        s[ANGLE_TOLERANCE] = max(self.rtol * 1e-3, 1e-13)
        s[IMPACT_FLOOR] = self.impact_floor
        s[TRANSIENT], s[AVERAGED], s[MAX_STEPS] = self.transient, self.averaged, self.max_steps
        s[AVERAGED_CAP] = max(self.averaged_cap, self.averaged)
        s[OBJECTIVE_TOLERANCE] = self.objective_tolerance
        s[SMALLEST_STEP] = 1e-14
        s[EXPONENT] = 1.0 / (min(self.tableau.order, self.tableau.error_order) + 1)
        s[BETA] = 0.04
        s[IMPLICIT] = IMPLICIT_USE[self.implicit]
        s[ATOL : ATOL + n] = self.atol[:n]
        s[ATOL + at.MAX_COORDINATES : ATOL + at.MAX_COORDINATES + n] = self.atol[n:]
        return s


class Lanes:
    """W lanes and a queue of samples.

    Parameters
    ----------
    problem : Problem
    width : int
        Lanes; 1 for a single response.
    record : numpy.ndarray, optional
        Buffer (rows, columns) for every accepted step of lane 0.
    """

    def __init__(self, problem: Problem, width: int, record: Array | None = None) -> None:
        n, stages = problem.coordinates, problem.tableau.stages
        width = 1 if problem.collocation else width
        self.problem = problem
        self.width = width
        self.record = record
        self._step = make_collocation_stepper(n) if problem.collocation else make_stepper(width, n)
        self._weights = problem.tableau.packed()
        self._settings = problem.settings()
        self._work = np.zeros(at.WORK * width)
        self._stages = np.zeros(stages * n * width)
        self._par = np.ones(at.PARAMETERS * width)  # ones: a resting lane divides by them
        self._book = np.zeros(at.BOOK * width)
        # absent, it keeps the implicit method from being compiled
        self._memory = None if problem.implicit == "never" else radau.new_memory(width)
        if problem.collocation:
            self._memory = lobatto.new_memory()
        self._effects = problem.effects._replace(sliding=None if self._memory is None else 1)
        self._tables = [
            _NO_TABLE if t is None else t for t in (problem.torque_table, problem.load_table)
        ]
        self._budget = 256
        self.counters = np.zeros(COUNTERS, np.int64)
        self._accept_queue(
            np.empty((0, at.PARAMETERS)), np.empty((0, STATE)), np.empty(0, np.int64)
        )

    def _accept_queue(self, par: Array, state: Array, labels: Integers) -> None:
        self._queue_par = np.ascontiguousarray(par)
        self._queue_state = np.ascontiguousarray(state)
        self._labels = labels
        self._out = np.full((len(labels), at.OUT), np.nan)
        self._finished = np.zeros(len(labels), np.int64)
        self.counters[:] = 0
        self.counters[SLOTS] = len(labels)

    @property
    def running(self) -> Booleans:
        """Which lanes hold a sample, shape (width,)."""
        row = at.RUNNING * self.width
        return self._work[row : row + self.width] == 1.0

    @property
    def waiting(self) -> int:
        """Samples queued that no lane has taken yet."""
        return int(self.counters[SLOTS] - self.counters[NEXT_SLOT])

    @property
    def pending(self) -> int:
        """Samples that have not finished."""
        return self.waiting + int(self.running.sum())

    def queue(self, par: Array, state: Array, labels: Integers) -> None:
        """Add samples: parameters (m, PARAMETERS), start states (m, STATE), labels (m,).

        To be called when everything finished has been collected: lanes keep their own copy of what they
        run, so the queue is rebuilt from what still waits.
        """
        if self.pending == 0:
            self._accept_queue(par, state, labels)
            return
        book = self._book.reshape(at.BOOK, self.width)
        running = np.flatnonzero(self.running)
        slots = book[at.SAMPLE, running].astype(np.int64)
        waiting = slice(int(self.counters[NEXT_SLOT]), int(self.counters[SLOTS]))
        held = self._labels[slots]
        # slots 0.. belong to the samples in lanes; their rows of the queue are never read again
        new_par = np.concatenate([self._queue_par[slots], self._queue_par[waiting], par])
        new_state = np.concatenate([self._queue_state[slots], self._queue_state[waiting], state])
        new_labels = np.concatenate([held, self._labels[waiting], labels])
        self._accept_queue(new_par, new_state, new_labels)
        self.counters[NEXT_SLOT] = len(slots)
        book[at.SAMPLE, running] = np.arange(len(slots))

    def advance(self, seconds: float) -> None:
        """Work for about `seconds`, or until every sample is finished (or the record is full)."""
        end = time.perf_counter() + seconds
        while True:
            start = time.perf_counter()
            going = self.step(self._budget)
            now = time.perf_counter()
            # How long a call takes does not change any result: only where it is interrupted.
            if now - start < 0.1 * seconds:
                self._budget = min(2 * self._budget, 1 << 20)
            elif now - start > 0.4 * seconds:
                self._budget = max(self._budget // 2, 16)
            if not going or now >= end or (self.record is not None and self.record_full):
                return

    @property
    def record_full(self) -> bool:
        """Whether the record must be emptied before the stepper can go on."""
        left = 0 if self.record is None else len(self.record) - int(self.counters[RECORDED])
        return self.record is not None and left < (STAGES if self.problem.collocation else 1)

    def take_record(self) -> Array:
        """The recorded rows since the last call (a copy); the record is empty afterwards."""
        assert self.record is not None
        rows = self.record[: int(self.counters[RECORDED])].copy()
        self.counters[RECORDED] = 0
        return rows

    def step(self, budget: int) -> bool:
        """Take at most `budget` block steps; True while samples are running."""
        p = self.problem
        return bool(
            self._step(
                self._effects,
                p.tableau.stages,
                self._weights,
                self._settings,
                self._work,
                self._stages,
                self._par,
                self._book,
                *self._tables,
                self._queue_par,
                self._queue_state,
                self._out,
                self._finished,
                self.counters,
                self.record,
                self._memory,
                budget,
            )
        )

    def collect(self) -> tuple[Integers, Array, Array]:
        """Labels (m,), outcome rows (m, OUT) and parameters (m, PARAMETERS) of what finished since the last call."""
        count = int(self.counters[FINISHED])
        slots = self._finished[:count].copy()
        self.counters[FINISHED] = 0
        return self._labels[slots], self._out[slots], self._queue_par[slots]

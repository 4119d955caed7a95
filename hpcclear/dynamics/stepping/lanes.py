"""The stepper of W samples in a batch, each with its own time, step, contact state and outcome; its arrays and its queue.

Queue samples, advance, collect what finished; or run all at once. A lane whose sample ends takes the next one from the
queue. The compiled stepper (`advance`) returns after a budget of steps with its whole state in the arrays it was given, and
goes on from there bit for bit.
"""

import ctypes
import time
from functools import cache
from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array, Booleans, Integers, aligned
from hpcclear.base.bits import beyond, call_at
from hpcclear.base.jit import FASTMATH, lane_function, narrow_vectors
from hpcclear.base.lowering.compiled import Compiled
from hpcclear.base.lowering.values import Kind, kind_of
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout import arguments as given
from hpcclear.dynamics.layout.arguments import (
    Asking,
    Block,
    Counter,
    Method,
    Queue,
    Stepped,
    rules_in,
)
from hpcclear.dynamics.layout.views import Outcome, Parameters, RunSettings, Start
from hpcclear.dynamics.linkage.observe import observe
from hpcclear.dynamics.linkage.rhs import run_motion
from hpcclear.dynamics.stepping.control import choose_step, commit, flag_gaps, judge_step
from hpcclear.dynamics.stepping.explicit.steps import explicit_code, settle_methods
from hpcclear.dynamics.stepping.implicit.batch import ask_implicit, batch_code
from hpcclear.dynamics.stepping.implicit.columns import new_columns
from hpcclear.dynamics.stepping.implicit.memory import COLUMNS
from hpcclear.dynamics.stepping.peaks import peaks_inside
from hpcclear.dynamics.stepping.problem import Problem
from hpcclear.dynamics.stepping.profile import profile_code
from hpcclear.dynamics.stepping.record import columns, record_step
from hpcclear.dynamics.stepping.special import (
    END_OF_REVOLUTION,
    END_OF_STEP,
    NEXT_SAMPLE,
    ask,
    special_code,
)  # fmt: skip

NO_LIMIT = 1 << 40  # of block steps in a call


@lane_function
def load_lanes(special, numbers, block, queue, method, W):
    """Give samples to lanes that rest. Returns how many run."""
    running = 0.0
    for i in range(W):
        if block.work[at.RUNNING * W + i] == 0.0:
            ask(special, NEXT_SAMPLE, i, numbers, block, queue, method)
        running += block.work[at.RUNNING * W + i]
    return running


@lane_function
def judge_steps(special, rules, n, numbers, block, queue, method, W):
    """Accept, cut or reject every lane's step. Returns the change of the number of running lanes."""
    work, settings = block.work, method.settings
    change = 0.0
    judge_step(work, settings, W)
    if flag_gaps(rules, work, block.par, n - 1, settings[RunSettings.gap_tolerance], W) > 0.0:
        for i in range(W):
            if work[at.SPECIAL * W + i] == 1.0:
                change += ask(special, END_OF_STEP, i, numbers, block, queue, method)
    return change


@lane_function
def end_revolutions(special, numbers, block, queue, method, W):
    """Close the revolutions that ended. Returns the change of the number of running lanes."""
    work = block.work
    change = 0.0
    for i in range(W):
        ends = work[at.ACCEPT * W + i] * work[at.ENDING * W + i] * work[at.RUNNING * W + i]
        if ends == 1.0:
            change += ask(special, END_OF_REVOLUTION, i, numbers, block, queue, method)
    return change


@lane_function
def advance(W, codes, block, queue, method, record, memory, budget):
    """Take at most `budget` block steps. Returns whether lanes are running."""
    if W == 1:
        narrow_vectors()
    settings, numbers, work = method.settings, method.numbers, block.work
    n, rules = numbers[Asking.COORDINATES], rules_in(numbers)
    behind = beyond(work, at.STAGES * W), beyond(work, at.WORK * W)  # at known distances
    block = Block(work, behind[0], behind[1], block.book)
    running = load_lanes(codes.special, numbers, block, queue, method, W)
    while budget > 0 and running > 0.0:
        budget -= 1
        choose_step(rules, work, block.par, W)
        stiff = settle_methods(memory, settings, work, W)
        if stiff < running:
            of_pair = numbers, work, settings, method.weights, method.tables, method.measures
            call_at(codes.explicit, of_pair)
        if stiff > 0.0:
            ask_implicit(codes.implicit, numbers, block, method, memory)
        running += judge_steps(codes.special, rules, n, numbers, block, queue, method, W)
        if rules.profile:
            run_motion(numbers[Asking.PROFILE], work, method.tables)
        peaks_inside(rules, work, block.par, W)
        ended = commit(Stepped(rules, method.measures), work, block.stages, n, W)
        full = record_step(record, queue.counters, work, block.stages, block.book, n, W)
        if ended > 0.0:
            running += end_revolutions(codes.special, numbers, block, queue, method, W)
        if full:
            break
    return running > 0.0


class Codes(NamedTuple):
    """Addresses of what a stepper calls: `special.special_code`, `steps.explicit_code`, `batch.batch_code` (0 without)."""

    special: int
    explicit: int
    implicit: int


@cache
def make_stepper(W: int, kinds: tuple[Kind, ...], *, implicit: bool = False) -> Compiled:
    """Return the compiled stepper for W lanes, of any number of coordinates and any joints.

    Its arguments, of these kinds: `Codes`, and of `layout.arguments` `Block`, `Queue`, `Method`; an array for the steps of the
    first sample (see `record.record_step`); if `implicit` the memory of the implicit method (see `columns.new_columns`); and
    the budget: how many block steps to take at most. It returns 1 while lanes are running. A response and an ensemble call the
    same machine code; ensembles want at least twice the vector length.
    """
    known: dict[str, object] = {"W": W}
    if not implicit:
        known["memory"] = None
    return Compiled(advance, kinds, FASTMATH, ctypes.c_int64, **known)


class Lanes:
    """W lanes and a queue of samples; W is 1 for a single response.

    `record`: buffer (rows, columns) for every accepted step of the first `kept` samples, which run in the first lanes.
    `observed`: effects with which the same motion is run a second time while these are recorded, for their works and what
    `observe` returns; no other number depends on it. Raises ValueError if the problem's coordinates do not fit the stepper.
    """

    def __init__(
        self, problem: Problem, width: int, record: Array | None = None, observed: at.Effects | None = None,
        kept: int = 1,
    ) -> None:  # fmt: skip
        n = problem.coordinates
        self.problem = problem
        self.width = width
        self._kept = kept
        self.record = np.zeros((0, columns(n))) if record is None else record
        bank = aligned((at.STAGES + problem.tableau.stages * at.MAX_COORDINATES) * width)
        # parameters: a resting lane divides by them
        bank[at.WORK * width : at.STAGES * width] = 1.0
        self._block = Block(
            work=bank[: at.WORK * width],
            stages=bank[at.STAGES * width :],
            par=bank[at.WORK * width : at.STAGES * width],
            book=np.zeros(at.BOOK * width),
        )
        implicit = problem.implicit != "never"
        self._memory = new_columns(width) if implicit else None
        sliding = None if self._memory is None else 1
        effects = problem.effects._replace(sliding=sliding)
        self._observed = None if observed is None else observed._replace(sliding=sliding)
        measured = effects._replace(impacts=(observed or effects).impacts)
        self._rules = given.rules_of(measured, problem.stopping_curves)
        measures = at.measures_of(observed or problem.effects)
        self._method = Method(
            problem.settings().rows,
            problem.tableau.packed(),
            problem.tables,
            measures,
            given.numbers_of(self._rules, width, n, len(measures)),
        )
        self._codes = Codes(0, 0, 0)
        self._budget = 256
        self.counters = np.zeros(Counter.COUNT, np.int64)
        no_par, no_start = np.empty((0, problem.parameter_rows)), Start.at_rest(0).rows
        self._accept_queue(no_par, no_start, np.empty(0, np.int64))
        self._effects = effects
        self._compiled = False

    def _compile(self) -> None:
        """Compile or load the stepper and what it calls."""
        problem, effects, stiff = self.problem, self._effects, self._memory is not None
        widths = self.width, COLUMNS if stiff else 0  # of all lanes, and of eight stiff ones
        explicit = explicit_code(self.width, problem.tableau.stages).address
        kinds = kind_of(self._arguments(0)).parts
        self._step = make_stepper(self.width, kinds, implicit=stiff)
        implicit = batch_code().address if stiff else 0
        self._codes = Codes(special_code().address, explicit, implicit)
        numbers = self._method.numbers
        motions = {Asking.MOTION: effects, Asking.OBSERVING: self._observed}
        for first, of in motions.items():
            for row, width in enumerate(widths, first):
                if of is not None and width:
                    numbers[row] = problem.motion(of, width).address
        self._observer = int(numbers[Asking.OBSERVING] or numbers[Asking.MOTION])
        if self._rules.profile:
            numbers[Asking.PROFILE] = profile_code(effects, self.width).address
        # last: a stepper must not call what an interrupted compilation left out
        self._compiled = True

    def observe(
        self, par: Array, states: Array, contacts: Array, times: Array, began: Array
    ) -> Array:
        """Accelerations (n), rates, forces of pins at each instant (instants, n + RATES + 2 MAX_PINS), by the motion with the
        observed effects.

        Parameters (PARAMETERS,) of one sample; the others as of `hpcclear.dynamics.linkage.observe.observe`. To be called after
        the first step.
        """
        out = np.zeros((len(times), self.problem.coordinates + at.RATES + 2 * at.MAX_PINS))
        states, contacts = map(np.ascontiguousarray, (states, contacts))
        tables, both = self.problem.tables, (times, began)
        observe(self._observer, par, tables, states, contacts, both, out, self.width)
        return out

    def _arguments(self, budget: int) -> tuple[object, ...]:
        arrays = (self._block, self._queue, self._method)
        memory = () if self._memory is None else (self._memory,)
        return (self._codes, *arrays, self.record, *memory, budget)

    def _accept_queue(self, par: Array, start: Array, labels: Integers) -> None:
        count = len(labels)
        self._labels = labels
        self._queue = Queue(
            par=np.ascontiguousarray(par),
            start=np.ascontiguousarray(start),
            out=np.full((count, Outcome.size), np.nan),
            finished=np.zeros(count, np.int64),
            counters=self.counters,
        )
        self.counters[:] = 0
        self.counters[Counter.SLOTS] = count
        self.counters[Counter.KEPT] = self._kept

    @property
    def running(self) -> Booleans:
        """Which lanes hold a sample, shape (width,)."""
        row = at.RUNNING * self.width
        return self._block.work[row : row + self.width] == 1.0

    @property
    def pending(self) -> int:
        """Samples that have not finished."""
        waiting = self.counters[Counter.SLOTS] - self.counters[Counter.NEXT_SLOT]
        return int(waiting + self.running.sum())

    def run(self, par: Array, start: Start) -> Outcome:
        """Simulate samples to their ends: parameters (m, PARAMETERS) and m starts to m outcomes, in their order.

        To be called when nothing is queued or running.
        """
        assert self.pending == 0
        assert len(self.record) == 0
        self.queue(par, start, np.arange(len(par)))
        while self.step(NO_LIMIT):
            pass
        self.counters[Counter.FINISHED] = 0
        return self.problem.marked(Outcome(self._queue.out), par, start)

    def queue(self, par: Array, start: Start, labels: Integers) -> None:
        """Add samples: parameters (m, PARAMETERS), m starts, labels (m,).

        To be called when everything finished has been collected: lanes keep their own copy of what they run, so the queue is
        rebuilt from what still waits. Raises ValueError if a row of parameters has another length than the kernel's.
        """
        par = Parameters(par).rows
        if self.pending == 0:
            self._accept_queue(par, start.rows, labels)
            return
        book = self._block.book.reshape(at.BOOK, self.width)
        running = np.flatnonzero(self.running)
        slots = book[at.SAMPLE, running].astype(np.int64)
        waiting = slice(int(self.counters[Counter.NEXT_SLOT]), int(self.counters[Counter.SLOTS]))
        held = self._labels[slots]
        # slots 0.. belong to the samples in lanes; their rows of the queue are never read again
        old = self._queue
        new_par = np.concatenate([old.par[slots], old.par[waiting], par])
        new_start = np.concatenate([old.start[slots], old.start[waiting], start.rows])
        new_labels = np.concatenate([held, self._labels[waiting], labels])
        self._accept_queue(new_par, new_start, new_labels)
        self.counters[Counter.NEXT_SLOT] = len(slots)
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
            if not going or now >= end or self.record_full:
                return

    @property
    def record_full(self) -> bool:
        """Whether the record must be emptied before the stepper can go on."""
        return 0 < len(self.record) < int(self.counters[Counter.RECORDED]) + self._kept

    def take_record(self) -> Array:
        """The recorded rows since the last call (a copy); the record is empty afterwards.

        Once the recorded samples are over, those that go on are no longer observed.
        """
        rows = self.record[: int(self.counters[Counter.RECORDED])].copy()
        self.counters[Counter.RECORDED] = 0
        places = self._block.book[at.SAMPLE * self.width : (at.SAMPLE + 1) * self.width]
        if not (self.running & (places < self._kept)).any():
            self._method.numbers[[Asking.OBSERVING, Asking.OBSERVING_EIGHT]] = 0
        return rows

    def step(self, budget: int) -> bool:
        """Take at most `budget` block steps; True while samples are running.

        Raises RuntimeError: the record is full: what comes next would be written beyond it.
        """
        if self.record_full:
            raise RuntimeError("the record is full; take it first")
        if not self._compiled:
            self._compile()  # by the first call, which one rank of a node makes before the others
        return bool(self._step(*self._arguments(budget)))

    def collect(self) -> tuple[Integers, Outcome, Array]:
        """Labels (m,), outcomes and parameters (m, PARAMETERS) of what finished since the last call."""
        count = int(self.counters[Counter.FINISHED])
        slots = self._queue.finished[:count].copy()
        self.counters[Counter.FINISHED] = 0
        par = self._queue.par[slots]
        start = Start(self._queue.start[slots])
        outcome = self.problem.marked(Outcome(self._queue.out[slots]), par, start)
        return self._labels[slots], outcome, par

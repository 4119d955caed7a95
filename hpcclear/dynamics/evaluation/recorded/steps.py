"""The accepted steps of samples as they come, and the states at the output's instants between them.

Steps are worked off revolution by revolution, so that memory goes with the instants and not with the steps: whatever a light
body does, at most `most_kept` steps of an unfinished revolution are held.
"""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hpcclear.base.arrays import Array, Booleans, Records
from hpcclear.base.objectives import MEAN_GAP, Objective
from hpcclear.base.outcome import failed
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.evaluation.evaluator import DEFAULT_LANES, Evaluator, with_pressures
from hpcclear.dynamics.evaluation.steady.copies import perturbed, scales
from hpcclear.dynamics.layout.views import Parameters, Rates, Start
from hpcclear.dynamics.linkage.passage import cubic
from hpcclear.dynamics.planar.problem import refused_of
from hpcclear.dynamics.planar.response import ResponseStates
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.problem import effects_of, problem_of
from hpcclear.dynamics.setup.start import start_states
from hpcclear.dynamics.stepping import record as rec
from hpcclear.dynamics.stepping.lanes import Lanes
from hpcclear.dynamics.stepping.problem import Problem
from hpcclear.scene import Scene
from hpcclear.scene.points import Points
from hpcclear.scene.scene import record_of

ITSELF = Points((), np.empty((1, 0)), ())  # a scene as its only design
CHUNK = 8192  # accepted steps between two visits to the stepper
LEAST_KEPT = 1 << 16  # steps of an unfinished revolution that are held before any is dropped


@dataclass(frozen=True)
class Steps:
    """Accepted steps of one response in their order; arrays over steps (s,)."""

    time: Array
    turn_time: Array  # since the start of the revolution
    revolution: Array
    contacts: Array  # (s, 2 MAX_JOINTS): active flags, then 1/d'_0, valid until the next step
    works: Array  # (s, 4): driving work, its absolute value, dissipated, load work, J
    measures: Array  # (s, measures): integrals of `record.MEASURES` since the start
    q: Array  # (s, n)
    v: Array
    a: Array

    @classmethod
    def of(cls, rows: Array) -> "Steps":
        """Those of rows of the record (s, columns)."""
        s, n = rec.STATE, (rows.shape[1] - rec.STATE) // 3
        parts = [rec.DRIVE_WORK, rec.MEASURED, s, s + n, s + 2 * n]
        first, *others = np.split(rows, [rec.CONTACTS, *parts], axis=1)
        time, turn_time, revolution, _ = first.T
        return cls(time, turn_time, revolution, *others)


@dataclass(frozen=True)
class Recorded:
    """One of the samples of a recording; `par` (PARAMETERS,): of the kernel."""

    problem: Problem
    par: Array
    _lanes: Lanes
    _start: Start

    def observe(self, states: Array, contacts: Array, turn_time: Array, began: Array) -> Array:
        """Accelerations (t, n), then rates and forces of pins, as columns, at states (t, 2 n), contacts (t, 2 MAX_JOINTS),
        times in the revolution (t,) and when that began (t,)."""
        return self._lanes.observe(self.par, states, contacts, turn_time, began)

    def first_row(self) -> Array:
        """The row (1, columns) of the start."""
        n, start, none = self.problem.coordinates, self._start, np.zeros(1)
        row = np.zeros((1, rec.columns(n)))
        row[:, rec.CONTACTS : rec.DRIVE_WORK] = start.contacts
        seen = self.observe(start.state(n), start.contacts, none, none)
        row[:, rec.STATE :] = np.hstack([start.state(n), seen[:, :n]])
        return row


class Recording:
    """Samples in the lanes of an ensemble, their accepted steps kept: of the scene, or of the points `design` of it.

    `copies`: perturb the starts of the scene and of those `beside` it, which have the same problem, in the directions of these
    numbers (`hpcclear.dynamics.evaluation.steady.copies`); 0 does not. Those beside it are without replicas, and all can turn.
    `perturbations`, `objective`: as of `hpcclear.dynamics.evaluation.evaluator.Evaluator`; replicas go with one point alone.
    """

    def __init__(
        self, scene: Scene, copies: Sequence[int] = (), perturbations: Sequence[int] = (),
        objective: Objective = MEAN_GAP, beside: Sequence[Scene] = (), design: Points = ITSELF,
    ) -> None:  # fmt: skip
        self.problem = problem_of(scene)
        alone = not design.names
        par = [parameters(scene, design), *map(parameters, beside)]
        start = [start_states(scene, par[0], design, walk=not alone)]
        others = zip(beside, par[1:], strict=True)
        start += [start_states(one, own, walk=False) for one, own in others]
        self._record = record_of(scene)
        self._beside, self._values = beside, design.values
        self._refused = refused_of(scene) if alone else None
        for k, (one, copy) in enumerate(zip((scene, *beside), copies, strict=False)):
            if copy:
                start[k] = perturbed(start[k], scales(one, par[k][0]), range(copy, copy + 1))
        self._par = np.concatenate(par)
        self._start = Start(np.concatenate([begin.rows for begin in start]))
        kept = len(self._par)
        buffer = np.zeros((CHUNK, rec.columns(self.problem.coordinates)))
        observed = effects_of(scene, recorded=True)
        self._lanes = Lanes(self.problem, DEFAULT_LANES, buffer, observed, kept)
        self._evaluator = Evaluator(
            scene, design, perturbations=perturbations, objective=objective, recorder=self._lanes
        )
        self._done: list[Records] = []
        own = ((self._par[k], self._lanes, self._start[k : k + 1]) for k in range(kept))
        self.samples = [Recorded(self.problem, *one) for one in own]

    def compile(self) -> None:
        """Compile what it runs."""
        self._lanes.step(0)

    def chunks(self) -> Iterator[Array]:
        """Integrate; yield rows of the record (m, columns), the starts first. To be called once.

        Of a linkage that cannot turn there is the start alone.
        """
        lanes = self._lanes
        self.compile()  # what observes the start too
        first = np.concatenate([one.first_row() for one in self.samples])
        first[:, rec.SLOT] = np.arange(len(first))
        yield first
        if self._refused is not None:
            return
        values = np.resize(self._values, (len(first), self._values.shape[1]))
        self._evaluator.queue(np.arange(len(first)), self._par, self._start, values)
        while lanes.pending:
            while lanes.pending and not lanes.record_full:  # by steps, not by the clock
                self._done.append(self._evaluator.advance(0.2))
            yield lanes.take_record()

    def record(self) -> Records:
        """The outcomes (samples,), with a half-width if replicas run beside, once all chunks were taken."""
        if self._refused is not None:
            return failed(0, self._refused[0], record=self._record)
        done = np.concatenate(self._done)
        done = done[np.argsort(done["sample"], kind="stable")]
        for k, scene in enumerate(self._beside, 1):  # pressures by numbers of their own
            if scene.effects.has_pressure:
                with_pressures(scene, ITSELF, [*ITSELF.values], done[k : k + 1])
        return done


@dataclass(frozen=True)
class Piece:
    """Some instants of the output (t,), and the steps (s,) that they lie between."""

    times: Array
    steps: Steps
    k: NDArray[np.intp]  # (t,): each lies in the step that begins with row k


class StepInstants:
    """Instants over the steps of one sample as these come: `count` a revolution, or, for 0, every step.

    They are evenly spaced in time from its start to its end; the last revolution ends with the last step.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._most_kept = max(LEAST_KEPT, 8 * count)
        self._rows: Array | None = None
        self._broken = np.zeros(0, bool)

    def take(self, chunk: Array) -> Iterator[Piece]:
        """Take rows (m, columns), the start first of all; yield what is finished."""
        if self._rows is None:
            self._rows, self._broken = chunk, np.zeros(len(chunk), bool)
            return
        rows = np.concatenate([self._rows, chunk])
        broken = np.concatenate([self._broken, np.zeros(len(chunk), bool)])
        if self._count == 0:
            done = len(rows) - 1
        else:
            closing = np.flatnonzero(np.diff(rows[:, rec.REVOLUTION]) > 0)
            done = int(closing[-1]) if len(closing) else 0
        if done:
            yield _piece(rows[: done + 1], broken, self._count, last=False)
            rows, broken = rows[done:], broken[done:]
        while len(rows) > self._most_kept:
            rows, broken = _thinned(rows, broken)
        self._rows, self._broken = rows, broken

    def finish(self) -> Piece:
        """Return the last piece."""
        assert self._rows is not None
        return _piece(self._rows, self._broken, self._count, last=True)


def _piece(rows: Array, broken: Booleans, count: int, *, last: bool) -> Piece:
    """Instants from the first of these rows to the last, which is an instant itself if it is the `last` of all."""
    steps = Steps.of(rows)
    if count == 0:
        times = steps.time if last else steps.time[:-1]
    else:
        closing = np.flatnonzero(np.diff(steps.revolution) > 0)
        borders = steps.time[np.unique([0, *closing, len(rows) - 1])]
        parts = [np.linspace(a, b, count, endpoint=False) for a, b in itertools.pairwise(borders)]
        times = np.concatenate([*parts, borders[-1:] if last else []])
    k = np.clip(np.searchsorted(steps.time, times, side="right") - 1, 0, max(len(rows) - 2, 0))
    if broken.any():  # an instant where steps were dropped moves to the next that were not
        dropped = broken[np.minimum(k + 1, len(rows) - 1)]
        k = k + dropped
        times = np.where(dropped, steps.time[k], times)
    return Piece(times, steps, k)


def _thinned(rows: Array, broken: Booleans) -> tuple[Array, Booleans]:
    """Drop half of the rows where steps are shortest, a quarter of all; `broken`: before which rows some are missing.

    Of four rows the first two stay, which keep a step whole. What was thinned before has an even number of rows, so that its
    pairs stay together.
    """
    quads = (len(rows) - 1) // 4
    begins = rows[: 4 * quads + 1 : 4, rec.TIME]
    spans = np.diff(begins)
    keep = np.ones(len(rows), bool)
    of_quads = keep[: 4 * quads].reshape(quads, 4)
    of_quads[spans <= np.median(spans), 2:] = False
    after_gap = np.concatenate([[False], ~keep[:-1]])
    return rows[keep], (broken | after_gap)[keep]


def seen_between(sample: Recorded, piece: Piece, *, works: bool = False) -> ResponseStates:
    """What the motion is at the instants of a piece; `works`: those too, else there are none."""
    n = sample.problem.coordinates
    wraps = Parameters(sample.par).wraps[:n]
    q, v, a, s = _state(piece, wraps)
    steps, k = piece.steps, piece.k
    revolution, contacts = steps.revolution[k], steps.contacts[k]
    began = steps.time - steps.turn_time
    turn_time = piece.times - began[k]
    q = q - wraps * revolution[:, None]  # counted as the kernel does
    seen = sample.observe(np.hstack([q, v]), contacts, turn_time, began[k])
    stiff, done = sample.problem.implicit != "never", np.zeros((len(k), 0))
    if works or stiff:
        after = np.minimum(k + 1, len(steps.time) - 1)
        rows, where = np.unique(np.concatenate([k, after]), return_inverse=True)
        states = np.hstack([steps.q[rows], steps.v[rows]])
        at_rows = sample.observe(states, steps.contacts[rows], steps.turn_time[rows], began[rows])
        ends = np.split(at_rows[where], 2)
        h = (steps.time[after] - steps.time[k])[:, None]
        p0, p1 = (h * Rates(one[:, n : n + at.RATES]).powers for one in ends)
        done = cubic(steps.works[k], p0, steps.works[after], p1, s)
        if stiff:
            _calm(seen, a, ends[0] + s * (ends[1] - ends[0]))
    rates, pins = np.split(seen[:, n:], [at.RATES], axis=1)
    pins = pins.reshape(-1, 2, at.MAX_PINS)
    return ResponseStates(q, v, turn_time, revolution, contacts, Rates(rates), done, pins)


def _calm(seen: Array, a: Array, between: Array) -> None:
    """Replace what was `seen` where it is further from the accelerations of an instant, `a` (t, n), than what lies `between`
    the ends of the step: films and bristles multiply what a velocity is off by. Gaps go by positions alone, and stay."""
    n = a.shape[1]
    size = np.abs(between[:, :n]).max(axis=0, initial=1e-300)
    off, less = ((np.abs(one[:, :n] - a) / size).max(axis=1) for one in (seen, between))
    between[:, n : n + at.FORCE] = seen[:, n : n + at.FORCE]
    np.copyto(seen, between, where=(off > less)[:, None])


def _state(piece: Piece, wraps: Array) -> tuple[Array, Array, Array, Array]:
    """Coordinates, velocities and accelerations (t, n) at the instants, and how far each lies in its step, from 0 to 1 (t, 1).

    Positions by the quintic through position, velocity and acceleration at both ends of a step, which is as
    accurate as the integrator; angles that restart with every revolution, by `wraps` (n,), are unwrapped first.
    """
    steps, k = piece.steps, piece.k
    after = np.minimum(k + 1, len(steps.time) - 1)
    q0, q1 = (steps.q[row] + wraps * steps.revolution[row][:, None] for row in (k, after))
    h = (steps.time[after] - steps.time[k])[:, None]
    h = np.where(h > 0.0, h, 1.0)  # the last of a motion that stalled
    s = (piece.times - steps.time[k])[:, None] / h
    d = q1 - q0
    v0, v1 = h * steps.v[k], h * steps.v[after]
    a0, a1 = h * h * steps.a[k], h * h * steps.a[after]
    c3 = 10 * d - 6 * v0 - 4 * v1 - 1.5 * a0 + 0.5 * a1
    c4 = -15 * d + 8 * v0 + 7 * v1 + 1.5 * a0 - a1
    c5 = 6 * d - 3 * (v0 + v1) - 0.5 * (a0 - a1)
    position = q0 + s * (v0 + s * (0.5 * a0 + s * (c3 + s * (c4 + s * c5))))
    velocity = (v0 + s * (a0 + s * (3 * c3 + s * (4 * c4 + s * 5 * c5)))) / h
    acceleration = (a0 + s * (6 * c3 + s * (12 * c4 + s * 20 * c5))) / (h * h)
    return position, velocity, acceleration, s

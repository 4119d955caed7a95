"""Every way to integrate one revolution: the methods of the kernel, and two that are not, which call its equations."""

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar

from hpcclear.accuracy.looked_at import QUANTITIES, end_of, neighbours
from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.evaluation.evaluator import DEFAULT_LANES
from hpcclear.dynamics.evaluation.steady.judging import objective
from hpcclear.dynamics.layout.views import Parameters, Start
from hpcclear.dynamics.linkage.observe import FORCE, OPEN, RATE, derivative, new_seen
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.problem import problem_of
from hpcclear.dynamics.setup.start import start_states
from hpcclear.dynamics.stepping.lanes import Lanes
from hpcclear.dynamics.stepping.problem import Problem
from hpcclear.scene import Scene


class CalledEquations:
    """The equations of one design, `par` (PARAMETERS,) and `hpcclear.dynamics.setup.start`, for solvers that call them."""

    def __init__(self, problem: Problem, par: Array, start: Start) -> None:
        self.n = problem.coordinates
        self.problem = problem
        self.par = par
        self.named = Parameters(par)
        effects = problem.effects
        self.latched = effects.latched is not None
        self.free = effects.torque is not None
        self.size = effects.first + effects.joints  # places of joints whose gaps are integrated
        self.start = np.concatenate([start.state(self.n), np.zeros(self.size)])
        self.contacts = start.contacts.copy()
        self.origin = start
        self._head = problem.motion(effects, 1).address, problem.tables
        self._seen = new_seen(self.n, par, self.size)

    def __call__(self, time: float, y: Array) -> Array:
        """dy/dt, shape (2 n + joints,)."""
        derivative(*self._head, self.contacts, time, y, *self._seen)
        return self._seen.rates.copy()

    def joints(self, time: float, y: Array) -> Array:
        """Gap, contact force and rate of the gap of every joint, shape (joints, 3)."""
        derivative(*self._head, self.contacts, time, y, *self._seen)
        return self._seen.joints


@dataclass(frozen=True)
class TurnOutcome:
    """What a method makes of the designs: values (designs, 4) as in `QUANTITIES`, NaN where it failed."""

    values: Array
    evaluations: Array  # (designs,)


Run = Callable[[], TurnOutcome]
Event = Callable[[float, Array], float]


@dataclass(frozen=True)
class Integrator:
    """A method of the panel."""

    name: str
    prepare: Callable[[float], tuple[Run, float]]
    """From a tolerance to a run that can be timed, and the share of its time that one design takes; everything is compiled
    when it returns."""
    compiled: bool = True
    """Whether it runs without Python inside, so that repeating it is cheap."""


def one_turn(scene: Scene, rtol: float | None = None, **numerics: object) -> Scene:
    """The scene for one revolution from the start, all of it averaged."""
    changes: dict[str, object] = {"transient_revolutions": 0, "averaged_revolutions": 1}
    changes |= {"target_error": None, "atol": None, "energy": False, **numerics}
    changes |= {} if rtol is None else {"rtol": rtol}
    return scene.with_({f"numerics.{key}": value for key, value in changes.items()})


# ---- the kernel's own methods -------------------------------------------------------------------


def kernel_method(
    name: str, scene: Scene, designs: int, width: int, formulation: str, method: str
) -> Integrator:
    """A method of the kernel. Raises InputError if this scene cannot be integrated so."""
    scene = one_turn(scene, formulation=formulation, method=method)
    problem_of(scene)  # refuses what there is not

    def prepare(rtol: float) -> tuple[Run, float]:
        here = one_turn(scene, rtol)
        problem = problem_of(here)
        par = parameters(here, neighbours(here, designs))
        start = start_states(here, par)
        copies = -(-2 * width // designs) if width > 1 else 1
        par, start = np.tile(par, (copies, 1)), Start(np.tile(start.rows, (copies, 1)))
        Lanes(problem, width).step(1)  # without samples it only compiles
        return (lambda: _kernel_outcome(here, problem, width, par, start, designs)), 1.0 / len(par)

    return Integrator(name, prepare)


def _kernel_outcome(
    scene: Scene, problem: Problem, width: int, par: Array, start: Start, designs: int
) -> TurnOutcome:
    outcome = Lanes(problem, width).run(par, start)[:designs]
    n = problem.coordinates
    values = np.full((designs, len(QUANTITIES)), np.nan)
    for k in range(designs):
        one = outcome[k]
        if one.status == 0:
            place = end_of(scene, par[k], one.coordinates(n), one.velocities(n))
            values[k] = *place, one.peak_force.max(), one.objective
    return TurnOutcome(values, outcome.evaluations)


# ---- methods that are not the kernel's ----------------------------------------------------------


def systems(scene: Scene, designs: int) -> list[CalledEquations]:
    """The equations of the designs in minimal coordinates."""
    here = one_turn(scene, formulation="minimal", method="auto")
    problem = problem_of(here)
    par = parameters(here, neighbours(here, designs))
    start = start_states(here, par)
    return [CalledEquations(problem, own, start[k]) for k, own in enumerate(par)]


def outside_method(scene: Scene, designs: int, name: str) -> Integrator:
    """A solver of scipy on the compiled equations, restarted wherever a gap changes sign."""
    made = systems(scene, designs)

    def run(rtol: float) -> TurnOutcome:
        values, counts = zip(*(solve_turn(scene, one, name, rtol) for one in made), strict=True)
        return TurnOutcome(np.array(values), np.array(counts))

    def prepare(rtol: float) -> tuple[Run, float]:
        made[0](0.0, made[0].start)
        return (lambda: run(rtol)), 1.0 / designs

    return Integrator(f"{name} (scipy)", prepare, compiled=False)


def solve_turn(
    scene: Scene, one: CalledEquations, solver: str, rtol: float
) -> tuple[tuple[float, ...], int]:
    """One revolution by a solver of scipy, in pieces on which every law is smooth; values and force evaluations."""
    here = CalledEquations(one.problem, one.par, one.origin)  # at its start
    start, period = one.start.copy(), float(one.named.period)
    joints = list(at.places_of(one.problem.effects))
    side = np.where(here.joints(0.0, start)[:, OPEN] > 0.0, 1.0, -1.0)
    limit = 20.0 * period if one.free else period
    turn_end = float(one.named.turn_end)
    atol = one.problem.atol * one.named.tolerances(one.n) * rtol / one.problem.rtol
    atol = np.append(atol, one.size * [rtol * 1e-3 * period])
    t, y, peak, count = 0.0, start, 0.0, 0
    for _ in range(100_000):
        gaps = here.joints(t, y)[:, OPEN].copy()
        events = [_crossing(here, j, side[j], gaps[j]) for j in joints]
        if one.free:
            events.append(_event(lambda time, y: float(y[one.n - 1] - turn_end), 1.0))
        piece = solve_ivp(
            here, (t, limit), y, solver, rtol=rtol, atol=atol, events=events, dense_output=True,
            max_step=period / 64.0,  # a whole contact inside a step would go unnoticed
        )  # fmt: skip
        count += piece.nfev
        peak = max(peak, _largest_force(here, piece))
        t, y = piece.t[-1], piece.y[:, -1].copy()
        hit = [k for k, when in enumerate(piece.t_events) if len(when)]
        if piece.status < 0:
            return (np.nan,) * 4, count
        if piece.status == 0 or len(joints) in hit:  # the event after those of the joints
            here_too = scene.with_({"numerics.formulation": "minimal"})
            place = end_of(here_too, one.par, y[: one.n], y[one.n : 2 * one.n])
            return (*place, peak, float(objective(y[2 * one.n :])) / t), count
        for j in (joints[k] for k in hit):
            side[j] = -side[j]
            if here.latched:
                here.contacts[j] = float(side[j] > 0.0)
                rate = here.joints(t, y)[j, RATE]
                here.contacts[at.MAX_JOINTS + j] = 1.0 / max(rate, one.problem.impact_floor)
    return (np.nan,) * 4, count


def _crossing(one: CalledEquations, joint: int, side: float, at_start: float) -> Event:
    """The event that a gap leaves its side of zero; right after the last event it is taken to be on it."""
    shift = 2.0 * at_start if side * at_start < 0.0 else 0.0
    return _event(lambda time, y: float(one.joints(time, y)[joint, OPEN]) - shift, -side)


def _event(value: Event, direction: float) -> Event:
    """A terminal event of scipy that has one value at one time.

    scipy finds a change of sign in the states at both ends of a step, then evaluates the interpolant there, which differs by
    rounding: where the change is that small, it would find none and stop with an error.
    """
    known: dict[float, float] = {}

    def event(time: float, y: Array) -> float:
        if time not in known:
            known[time] = value(time, y)
        return known[time]

    event.terminal, event.direction = True, direction  # type: ignore[attr-defined]
    return event


def _largest_force(one: CalledEquations, piece: object) -> float:
    """Largest contact force of a piece, by its dense output about the largest step end."""
    times, states, dense = piece.t, piece.y.T, piece.sol  # type: ignore[attr-defined]
    instants = zip(times, states, strict=True)
    forces = np.array([one.joints(t, y)[:, FORCE].copy() for t, y in instants])
    largest = float(forces.max())
    row, joint = np.unravel_index(forces.argmax(), forces.shape)
    low, high = times[max(row - 1, 0)], times[min(row + 1, len(times) - 1)]
    if largest == 0.0 or not low < high:
        return largest

    def negative(t: float) -> float:
        return -float(one.joints(t, dense(t))[joint, FORCE])

    near = {"xatol": 1e-6 * (high - low)}
    found = minimize_scalar(negative, bounds=(low, high), method="bounded", options=near)
    return max(largest, -float(found.fun))


# ---- all of them --------------------------------------------------------------------------------


def methods_of(scene: Scene, designs: int, more: bool) -> list[Integrator]:
    """Every method that can integrate this scene, the kernel's first."""
    wanted = [
        ("tsitouras", 1, "minimal", "tsitouras"),
        (f"tsitouras, {DEFAULT_LANES} lanes", DEFAULT_LANES, "minimal", "tsitouras"),
        ("fehlberg", 1, "minimal", "fehlberg"),
        ("prince-dormand", 1, "minimal", "prince-dormand"),
    ]
    if more:
        wanted += [("radau", 1, "minimal", "radau"), ("baumgarte", 1, "baumgarte", "tsitouras")]
    found = []
    for name, width, formulation, method in wanted:
        with suppress(InputError):  # not for this scene
            found.append(kernel_method(name, scene, designs, width, formulation, method))
    return found + [outside_method(scene, designs, name) for name in ("DOP853", "LSODA")]


def timed(run: Run, repeats: int) -> tuple[TurnOutcome, float]:
    """Outcome and median seconds of repeated runs."""
    seconds = []
    for _ in range(repeats):
        start = time.perf_counter()
        outcome = run()
        seconds.append(time.perf_counter() - start)
    return outcome, float(np.median(seconds))

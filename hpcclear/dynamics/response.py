"""One response, whole: the motion step by step, and from it forces, energies and time series."""

import itertools
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from hpcclear.base.arrays import Array, Records
from hpcclear.base.objectives import Objective, asked
from hpcclear.base.outcome import STEADY, failed
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.bending import bent_motion
from hpcclear.dynamics.closed_form import ClosedForm, ideal_series
from hpcclear.dynamics.collocation.lobatto import STAGES
from hpcclear.dynamics.curves import curve_at
from hpcclear.dynamics.evaluation import evaluate_records
from hpcclear.dynamics.evaluator import outcome_records, responses_told
from hpcclear.dynamics.lanes import Lanes
from hpcclear.dynamics.layout import TURN
from hpcclear.dynamics.linkage import baumgarte, geometry, ideal
from hpcclear.dynamics.linkage.bending import Bent
from hpcclear.dynamics.linkage.observe import observe
from hpcclear.dynamics.parameters import parameters, topology
from hpcclear.dynamics.planar.prescribed import pins_of, prescribed_series
from hpcclear.dynamics.planar.problem import linkage_of, refused_of
from hpcclear.dynamics.planar.response import Seen, balance_series, mode_series
from hpcclear.dynamics.planar.response import labels as planar_labels
from hpcclear.dynamics.planar.response import series as planar_series
from hpcclear.dynamics.problem import (
    Problem,
    coordinate_count,
    integrator_of,
    problem_of,
)
from hpcclear.dynamics.start import start_states
from hpcclear.dynamics.steady.copies import kicked, scales
from hpcclear.dynamics.steady.telling import recorded
from hpcclear.dynamics.stepping import record as rec
from hpcclear.dynamics.views import Parameters, Rates, Start
from hpcclear.results import dataset
from hpcclear.scene import Scene
from hpcclear.scene.points import Points

_CHUNK = 8192  # accepted steps kept before they are handed over


@dataclass(frozen=True)
class Steps:
    """Every accepted step of one response, the start included; arrays over steps (s,)."""

    time: Array
    turn_time: Array  # since the start of the revolution
    revolution: Array
    contacts: Array  # (s, 2 MAX_JOINTS): active flags, then 1/d'_0, valid until the next step
    works: Array  # (s, 4): driving work, its absolute value, dissipated, load work, J
    q: Array  # (s, n)
    v: Array
    a: Array


def integrate(scene: Scene, copy: int = 0) -> tuple[Steps, Records, Array]:
    """Integrate a scene, or a kicked copy; its steps, outcome record (1,) and parameters (PARAMETERS,), all in SI."""
    problem = problem_of(scene, ledger=True, series=True, single=True)
    par = parameters(scene)
    start = start_states(scene, par, walk=False)
    if copy:
        start = kicked(start, scales(scene), range(copy, copy + 1))
    n = problem.coordinates
    told = refused_of(scene) if scene.is_planar else None
    if told is not None:
        row = _first_row(problem, par[0], start[0], n)
        return _steps(row, n), failed(0, told[0]), par[0]
    buffer = np.zeros((_CHUNK, rec.columns(n)))
    lanes = Lanes(problem, 1, buffer)
    lanes.queue(par, start, np.zeros(1, np.int64))
    chunks = []
    while lanes.pending:
        lanes.advance(0.2)
        chunks.append(lanes.take_record())
    # last: what it calls was compiled beside the stepper
    rows = np.concatenate([_first_row(problem, par[0], start[0], n), *chunks])
    labels, out, finished = lanes.collect()
    return (
        _steps(rows, n),
        outcome_records(labels, out, finished, responses_told(problem), bool(problem.effects.wear)),
        par[0],
    )


def _steps(rows: Array, n: int) -> Steps:
    """Rows of the record by name; a motion that ended where it began has the start twice."""
    rows = rows if len(rows) > 1 else rows[[0, 0]]
    s = rec.STATE
    return Steps(
        rows[:, rec.TIME],
        rows[:, rec.TURN_TIME],
        rows[:, rec.REVOLUTION],
        rows[:, rec.CONTACTS : rec.DRIVE_WORK],
        rows[:, rec.DRIVE_WORK : rec.STATE],
        rows[:, s : s + n],
        rows[:, s + n : s + 2 * n],
        rows[:, s + 2 * n :],
    )


def _first_row(problem: Problem, par: Array, start: Start, n: int) -> Array:
    """The start as a row of the record."""
    row = np.zeros((1, rec.columns(n)))
    states = start.state(n)[None]
    contacts = slice(rec.CONTACTS, rec.DRIVE_WORK)
    row[0, contacts] = start.contacts
    row[:, rec.STATE : rec.STATE + 2 * n] = states
    accelerations, _ = _observed(problem, par, states, row[:, contacts], np.zeros(1))
    row[:, rec.STATE + 2 * n :] = accelerations
    return row


def _observed(
    problem: Problem, par: Array, states: Array, contacts: Array, times: Array
) -> tuple[Array, Rates]:
    """Accelerations (n) and rates at each instant."""
    n = problem.coordinates
    out = np.zeros((len(times), n + Rates.size))
    states, contacts, times = (np.ascontiguousarray(x) for x in (states, contacts, times))
    # by the motion that is compiled anyway
    width = STAGES if problem.collocation else 1
    effects = problem.effects._replace(sliding=1) if problem.collocation else problem.effects
    motion = problem.motion(effects, width).address
    observe(motion, par, problem.tables, states, contacts, times, out, width)
    return out[:, :n], Rates(out[:, n:])


def _between(
    steps: Steps, times: Array, cycle: float
) -> tuple[Array, Array, Array, NDArray[np.intp], Array]:
    """States, contacts, step index and time within the step at given times.

    Positions by the quintic through position, velocity and acceleration at both ends of a step, which is as
    accurate as the integrator; a free crank's angle restarts every `cycle` and is unwrapped first.
    """
    q = steps.q.copy()
    if cycle:
        q[:, -1] += cycle * steps.revolution
    k = np.clip(np.searchsorted(steps.time, times, side="right") - 1, 0, len(steps.time) - 2)
    h = (steps.time[k + 1] - steps.time[k])[:, None]
    safe = np.where(h > 0.0, h, 1.0)  # the last of a motion that stalled, or never began
    s = (times - steps.time[k])[:, None] / safe
    d = q[k + 1] - q[k]
    v0, v1 = h * steps.v[k], h * steps.v[k + 1]
    a0, a1 = h * h * steps.a[k], h * h * steps.a[k + 1]
    c3 = 10 * d - 6 * v0 - 4 * v1 - 1.5 * a0 + 0.5 * a1
    c4 = -15 * d + 8 * v0 + 7 * v1 + 1.5 * a0 - a1
    c5 = 6 * d - 3 * (v0 + v1) - 0.5 * (a0 - a1)
    position = q[k] + s * (v0 + s * (0.5 * a0 + s * (c3 + s * (c4 + s * c5))))
    velocity = (v0 + s * (a0 + s * (3 * c3 + s * (4 * c4 + s * 5 * c5)))) / safe
    velocity = np.where(h > 0.0, velocity, steps.v[k])
    return position, velocity, steps.contacts[k], k, s[:, 0]


def _works_between(steps: Steps, powers: Array, k: NDArray[np.intp], s: Array) -> Array:
    """Works (t, 4) by the cubic through works and powers at both ends of the step."""
    h = (steps.time[k + 1] - steps.time[k])[:, None]
    s = s[:, None]
    w0, w1 = steps.works[k], steps.works[k + 1]
    p0, p1 = h * powers[k], h * powers[k + 1]
    d = w1 - w0
    return w0 + s * (p0 + s * (3 * d - 2 * p0 - p1 + s * (p0 + p1 - 2 * d)))


def instants(scene: Scene, steps: Steps) -> Array:
    """Times of the output, s, shape (times,): evenly spaced over each revolution, or every accepted step."""
    count = scene.output.instants_per_revolution
    if count == 0:
        return steps.time
    if steps.time[-1] == steps.time[0]:
        return steps.time[:1]  # it ended where it began
    ends = np.flatnonzero(np.diff(steps.revolution) > 0)  # the rows that close a revolution
    borders = np.concatenate([[0.0], steps.time[ends]])
    if steps.time[-1] > borders[-1]:
        borders = np.append(borders, steps.time[-1])
    parts = [np.linspace(a, b, count, endpoint=False) for a, b in itertools.pairwise(borders)]
    return np.append(np.concatenate(parts), borders[-1])


def simulate(scene: Scene, objective: Objective | None = None, copy: int = 0) -> xr.Dataset:
    """Simulate one scene; time series of the motion, forces and energies.

    Parameters
    ----------
    scene : Scene
    objective : Objective, optional
        What ``objective`` is; by default that of the scene's study, f without one. Others than gaps and peak contact forces
        need ``numerics.responses`` where there is no study that asks for them.
    copy : int
        Start a little beside the scene's start, in the direction of this number (`hpcclear.dynamics.steady.copies`); a
        motion without clearance has no copies.

    Returns
    -------
    xarray.Dataset
        Kind ``response``: dimensions time and joint, SI units as attributes. Every step before a failure is kept;
        `status` says how the simulation ended.

    Raises
    ------
    InputError
        If the scene asks for what the kernel cannot do.
    """
    steady = _steady(scene)
    if steady is not None:
        named, scene = scene, _shown(scene, steady)
    else:
        named = scene
    objective = named.objective if objective is None else objective
    still = coordinate_count(scene) == 0
    times, data, record = _closed_form(scene) if still else _integrated(scene, copy)
    if steady is not None:
        steady["status"] = max(steady["status"][0], record["status"][0])  # of the series as well
        record = steady
    elif named.numerics.uncertainty and coordinate_count(scene):
        record["objective_uncertainty"] = evaluate_records(scene, _ITSELF)["objective_uncertainty"]
    record = asked(record, objective)
    labels = scene.joint_labels
    names = [name for name in (*_TOLD, *STEADY, "regime") if name in _TOLD or steady is not None]
    if scene.effects.slider_load is not None:
        data["slider_load"] = curve_at(
            scene.effects.slider_load, data["crank_angle"], 1, scene.numerics.interpolation
        )
    return dataset.response_dataset(
        times,
        {**data, **{name: dataset.at_joints(record[name], labels)[0] for name in names}},
        dataset.provenance(named.text or named.to_toml(), named.hash, named.references)
        | recorded(named, record)
        | {"integrator": integrator_of(scene, single=True)}
        | {"transient_revolutions": scene.numerics.transient_revolutions}
        | _reason(scene),
        objective,
        labels,
        _dimensions(scene),
    )


def _dimensions(scene: Scene) -> dict[str, tuple[str, ...]] | None:
    """Labels along what a linkage's series have besides time and joints."""
    modes = {"mode": scene.mode_labels} if scene.modes else {}
    if not scene.is_planar:
        return modes or None
    found = planar_labels(linkage_of(scene).mechanism) | modes
    return found if coordinate_count(scene) else {**found, "pin": pins_of(scene)}


def _reason(scene: Scene) -> dict[str, str]:
    """Where a linkage that cannot turn locks, as an attribute."""
    told = refused_of(scene) if scene.is_planar else None
    return {} if told is None else {"ended": told[1].reason}


_TOLD = (
    "objective",
    "objective_spread",
    "objective_uncertainty",
    "mean_gap",
    "peak_contact_force",
    "latched",
    "rhs_evaluations",
    "status",
    "flags",
)
"""What a response says about itself as a sample does."""

SPUN_UP, SHOWN = 20, 10
"""Revolutions before those that a response with a target error is averaged over, and of these, at most."""


def _steady(scene: Scene) -> Records | None:
    """The record (1,) of the steady mean, where the scene names a target error; None: it asks for a stretch."""
    if scene.numerics.target_error is None or not scene.clearance_joints():
        return None
    return evaluate_records(scene, _ITSELF)


_ITSELF = Points((), np.empty((1, 0)), ())
"""The scene as the only design."""


def _shown(scene: Scene, steady: Records) -> Scene:
    """The scene of the one response that is written beside a steady mean: at its tolerance, spun up."""
    rtol = float(steady["steady_rtol"][0])
    changes = {
        "numerics.target_error": None,
        "numerics.rtol": rtol if np.isfinite(rtol) else scene.numerics.rtol,
        "numerics.atol": None,
        "numerics.transient_revolutions": SPUN_UP,
        "numerics.averaged_revolutions": SHOWN,
    }
    return scene.with_(changes)


def _closed_form(scene: Scene) -> tuple[Array, dict[str, Array], Records]:
    """Instants, time series and outcome record (1,) of a scene without clearance at prescribed speed."""
    problem = problem_of(scene)
    lanes = ClosedForm(problem)
    par = parameters(scene)
    lanes.queue(par, start_states(scene, par), np.zeros(1, np.int64))
    record = outcome_records(*lanes.collect(), responses_told(problem), bool(problem.effects.wear))
    found = prescribed_series(scene) if scene.is_planar else ideal_series(scene)
    return *found, record


def _integrated(scene: Scene, copy: int) -> tuple[Array, dict[str, Array], Records]:
    """Instants, time series and outcome record (1,) of a scene that is integrated."""
    steps, record, par = integrate(scene, copy)
    times = instants(scene, steps)
    problem = problem_of(scene, ledger=True, series=True, single=True)
    turning = bool(at.rules_of(problem.effects).turning)  # the crank angle is the last coordinate
    q, v, contacts, k, s = _between(steps, times, problem.cycle if turning else 0.0)
    turn_time = times - np.interp(np.arange(len(steps.time)), *_turn_starts(steps))[k]
    in_turn = _in_turn(q, steps.revolution[k], problem.cycle if turning else 0.0)
    states = np.hstack([in_turn, v])
    accelerations, rates = _observed(problem, par, states, contacts, turn_time)
    ends = np.hstack([steps.q, steps.v])
    at_steps = _observed(problem, par, ends, steps.contacts, steps.turn_time)[1]
    n = problem.coordinates - scene.bristles
    works = _works_between(steps, at_steps.powers, k, s)
    q, v, in_turn, accelerations = (
        one[:, scene.bristles :] for one in (q, v, in_turn, accelerations)
    )
    if scene.is_planar:
        seen = Seen(in_turn, v, turn_time, steps.revolution[k], contacts, rates, works)
        return times, planar_series(scene, par, seen), record
    first, second, free = topology(scene)
    nine = scene.numerics.formulation == "baumgarte"
    phi, omega = TURN * times / Parameters(par).period, np.full_like(times, Parameters(par).speed)
    data = {}
    if nine:
        data["constraint_violation"] = baumgarte.constraint_violation(first, second, par, q.T)
    rows = baumgarte.minimal_rows(first, second) if nine else list(range(n - free))
    if turning:
        phi, omega = q[:, -1], v[:, -1]
    if first or second or scene.modes:
        slider = accelerations[:, rows[-1]]
    else:
        rigid = ideal.ideal_response(
            problem.effects, par, problem.load_table, phi, omega, accelerations[:, n - 1]
        )
        slider = rigid[ideal.SLIDER_A]
    m, bar = bent_motion(scene, par, (phi, omega), q[:, rows].T, v[:, rows].T)
    data |= _series(scene, m, par, rates, contacts, works, bar)
    if bar is not None:
        data |= mode_series(scene.modes, q, v, bar.strain)
    return (
        times,
        data | {"crank_angle": phi, "crank_speed": omega, "slider_acceleration": slider},
        record,
    )


def _in_turn(q: Array, revolution: Array, cycle: float) -> Array:
    """Coordinates with the crank angle, if it is one, counted from the start of its revolution, as the kernel does."""
    if cycle:
        q = q.copy()
        q[:, -1] -= cycle * revolution
    return q


def _turn_starts(steps: Steps) -> tuple[Array, Array]:
    """Index and value of the time at which the revolution of each step interval began, for `numpy.interp`."""
    index = np.arange(len(steps.time), dtype=float)
    return index, steps.time - steps.turn_time


def _series(
    scene: Scene, m: geometry.Motion, par: Array, rates: Rates, contacts: Array, works: Array,
    bar: Bent | None = None,
) -> dict[str, Array]:  # fmt: skip
    """Every time series of the response but those of modes."""
    open_ = np.array([j in scene.clearance_joints() for j in ("crank_rod", "rod_slider")])
    gaps = np.where(open_, rates.gap[:, :2], 0.0)
    stiffness = np.where(open_, Parameters(par).stiffness[:2], 0.0)
    latched = scene.effects.contact is not None and scene.effects.contact.latched
    active = contacts[:, :2] if latched else np.ones((len(contacts), 2))
    elastic = geometry.elastic_energy(gaps, active, stiffness)
    kinetic = geometry.kinetic_energy(m, par)
    potential = geometry.potential_energy(m, par, scene.effects.gravity)
    strain: Array | float = 0.0
    if bar is not None:
        kinetic, strain = kinetic + bar.kinetic, bar.strain
        potential = potential + scene.effects.gravity * bar.raised(m.rod_angle)
    return {
        "slider_position": m.slider,
        "slider_velocity": m.slider_speed,
        "rod_x": m.rod_x,
        "rod_y": m.rod_y,
        "rod_angle": m.rod_angle,
        "eccentricity_x": m.eccentricity_x,
        "eccentricity_y": m.eccentricity_y,
        "penetration": np.maximum(gaps, 0.0) * active,
        "contact_force": rates.force[:, :2],
        "friction_force": rates.friction[:, :2],
        "crank_moment": rates.drive_moment,
        **balance_series((kinetic, elastic, potential, strain), works),
    }

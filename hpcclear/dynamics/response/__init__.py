"""One response: the sample of a scene, and the time series of its motion, forces and energies."""

from typing import Any

import numpy as np
import xarray as xr

from hpcclear.base import host
from hpcclear.base.arrays import Array, Records
from hpcclear.base.errors import InputError
from hpcclear.base.objectives import Objective, asked
from hpcclear.base.outcome import STEADY, Status
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.evaluation import evaluate_records
from hpcclear.dynamics.evaluation.evaluator import (
    alone,
    impacts_reported,
    outcome_records,
    responses_reported,
)
from hpcclear.dynamics.evaluation.steady.wording import recorded
from hpcclear.dynamics.joint_laws import widest_contact
from hpcclear.dynamics.planar.curves import curve_at
from hpcclear.dynamics.planar.prescribed import pins_of, prescribed_series
from hpcclear.dynamics.planar.problem import linkage_of, refused_of
from hpcclear.dynamics.planar.response import Seen
from hpcclear.dynamics.planar.response import labels as planar_labels
from hpcclear.dynamics.planar.response import series as planar_series
from hpcclear.dynamics.response.impacts import Turns, measured, spectral
from hpcclear.dynamics.response.steps import ITSELF, Piece, Recording, pieces
from hpcclear.dynamics.setup.parameters import Numbers, parameters
from hpcclear.dynamics.setup.problem import coordinate_count, integrator_of, problem_of
from hpcclear.dynamics.setup.start import start_states
from hpcclear.dynamics.stepping.lanes import PrescribedSamples
from hpcclear.results import dataset
from hpcclear.results.provenance import provenance
from hpcclear.scene import Scene
from hpcclear.scene.planar import turns_of

MOST = 0.5
"""Share of the machine's memory that the time series of a response may take."""


def _between(piece: Piece, cycle: float) -> tuple[Array, Array, Array]:
    """Coordinates and velocities (t, n) at the instants, and how far each lies in its step, from 0 to 1 (t,).

    Positions by the quintic through position, velocity and acceleration at both ends of a step, which is as
    accurate as the integrator; a free crank's angle restarts every `cycle` and is unwrapped first.
    """
    steps, k = piece.steps, piece.k
    after = np.minimum(k + 1, len(steps.time) - 1)
    q0, q1 = steps.q[k], steps.q[after]
    if cycle:
        q0[:, -1] += cycle * steps.revolution[k]
        q1[:, -1] += cycle * steps.revolution[after]
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
    return position, velocity, s[:, 0]


def _works_between(recording: Recording, piece: Piece, s: Array) -> Array:
    """Works (t, 4) by the cubic through works and powers at both ends of the step."""
    steps, k = piece.steps, piece.k
    after = np.minimum(k + 1, len(steps.time) - 1)
    rows, where = np.unique(np.concatenate([k, after]), return_inverse=True)
    ends = np.hstack([steps.q[rows], steps.v[rows]])
    turn_time = steps.turn_time[rows]
    began = steps.time[rows] - turn_time
    powers = recording.observe(ends, steps.contacts[rows], turn_time, began)[1].powers
    before, behind = np.split(powers[where], 2)
    h = (steps.time[after] - steps.time[k])[:, None]
    s = s[:, None]
    w0, w1 = steps.works[k], steps.works[after]
    p0, p1 = h * before, h * behind
    d = w1 - w0
    return w0 + s * (p0 + s * (3 * d - 2 * p0 - p1 + s * (p0 + p1 - 2 * d)))


def simulate(
    scene: Scene, objective: Objective | None = None, copy: int = 0, *, checked: bool = True
) -> xr.Dataset:
    """Simulate one scene; time series of the motion, forces and energies.

    Parameters
    ----------
    scene : Scene
    objective : Objective, optional
        What ``objective`` is; by default that of the scene's study, f without one. Others than gaps and peak contact forces
        need ``numerics.responses`` where there is no study that requires them.
    copy : int
        Start a little beside the scene's start, in the direction of this number (`evaluation.steady.copies`); a
        motion without clearance has no copies.
    checked : bool
        Whether the objective gets a half-width (``objective_uncertainty``), by replicas beside it; never for a copy.

    Returns
    -------
    xarray.Dataset
        Kind ``response``: dimensions time and joint, SI units as attributes. Every step before a failure is kept;
        `status` says how the simulation ended. All scalars are those of the sample of the same design (`hpcclear.evaluate`),
        bit for bit; those of a copy belong to its series.

    Raises
    ------
    InputError
        If the scene requires what the kernel cannot do, or time series that do not fit into memory.
    """
    steady = _steady(scene)
    named, scene = scene, scene if steady is None else _shown(scene, steady)
    objective = named.objective if objective is None else objective
    still = coordinate_count(scene) == 0
    if still:
        times, data, record = _prescribed(scene)
    else:
        perturbations = (
            alone(scene.numerics.rtol) if checked and not copy and steady is None else ()
        )
        times, data, record = _integrated(scene, Recording(scene, copy, perturbations, objective))
    if steady is not None:
        steady["status"] = max(steady["status"][0], record["status"][0])  # of the series as well
        record = steady
    half_width = record["objective_uncertainty"]  # of the objective already
    record = asked(record, objective)
    record["objective_uncertainty"] = half_width
    labels = scene.joint_labels
    names = [
        name for name in (*_REPORTED, *STEADY, "regime") if name in _REPORTED or steady is not None
    ]
    if steady is None and not still:  # what the sample measures as well has its bits
        names += [name for name in impacts_reported(problem_of(scene)) if name in data]
    if scene.effects.slider_load is not None:
        data["slider_load"] = curve_at(
            scene.effects.slider_load,
            data["crank_angle"],
            _turns(scene),
            scene.numerics.interpolation,
        )
    reported = {name: dataset.at_joints(record[name], labels)[0] for name in names}
    counted = {name: data.pop(name) for name in _COUNTED if name in data}
    return dataset.response_dataset(
        times,
        {
            **data,
            **reported,
            **widest_contact(scene, Numbers(scene, None), reported["peak_contact_force"]),
        },
        provenance(named.text or named.to_toml(), named.hash, named.references)
        | recorded(named, record)
        | {"integrator": integrator_of(scene)}
        | {"transient_turns": scene.numerics.transient_revolutions * _turns(scene)}
        | _reason(scene),
        objective,
        labels,
        {**(_dimensions(scene) or {}), **counted},
    )


_COUNTED = ("revolution", "order", "band")
"""Coordinates of measures of impact and noise."""


def _dimensions(scene: Scene) -> dict[str, tuple[str, ...]] | None:
    """Labels along what a linkage's series have besides time and joints."""
    found = planar_labels(scene, linkage_of(scene).mechanism)
    if scene.modes:
        found["mode"] = scene.mode_labels
    if scene.guides():
        found["guide"] = scene.guides()
    if scene.template is None and not coordinate_count(scene):
        found["pin"] = pins_of(scene)
    return found or None


def _turns(scene: Scene) -> int:
    """Turns of a revolution."""
    return turns_of(scene.linkage)


def _reason(scene: Scene) -> dict[str, str | int]:
    """Where a linkage that cannot turn locks, as an attribute."""
    refusal = refused_of(scene)
    return {} if refusal is None else {"ended": refusal[1].reason}


_REPORTED = (
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
    """The record (1,) of the steady mean, where the scene names a target error; None: it requires a segment."""
    if scene.numerics.target_error is None or not scene.clearance_joints():
        return None
    return evaluate_records(scene, ITSELF)


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


def _prescribed(scene: Scene) -> tuple[Array, dict[str, Array], Records]:
    """Instants, time series and outcome record (1,) of a scene without clearance at prescribed speed."""
    problem = problem_of(scene)
    lanes = PrescribedSamples(problem)
    par = parameters(scene)
    lanes.queue(par, start_states(scene, par), np.zeros(1, np.int64))
    record = outcome_records(
        *lanes.collect(), responses_reported(problem), bool(problem.effects.wear)
    )
    return *prescribed_series(scene, problem.transient + problem.averaged), record


def _integrated(scene: Scene, recording: Recording) -> tuple[Array, dict[str, Array], Records]:
    """Instants, time series and outcome record (1,) of a scene that is integrated."""
    count = scene.output.instants_per_revolution
    problem = recording.problem
    parts: list[dict[str, Array]] = []
    taken, turns = 0, Turns()
    for piece in pieces(recording.chunks(), count):
        series = {"time": piece.times, **_series_between(scene, recording, piece)}
        # copies: a column that is a view would keep all that was observed
        parts.append({name: one.copy() for name, one in series.items()})
        taken += len(piece.times)
        turns.take(piece.steps)
        least = max(taken, count * (problem.transient + problem.averaged))
        _refuse_what_does_not_fit(least * _bytes_an_instant(parts[0]), count)
    turns.finish(piece.steps)
    data = {}
    for name in list(parts[0]):
        data[name] = np.concatenate([part.pop(name) for part in parts])
    data["energy_residual"] -= data["energy_residual"][0]
    record = recording.record()
    if Status(int(record["status"][0])).valid and problem.effects.joints:
        data |= _measured(scene, recording, turns, data)
    return data.pop("time"), data, record


def _measured(
    scene: Scene, recording: Recording, turns: Turns, data: dict[str, Array]
) -> dict[str, Any]:
    """Measures of impact and noise of the averaged revolutions, and the coordinates that go with them."""
    problem = recording.problem
    periods, integrals = turns.averaged(problem.transient)
    cycle = abs(problem.cycle) or at.TURN
    joints = len(scene.joint_labels)
    first = problem.transient + 1
    return {
        "revolution": np.arange(float(first), first + len(periods)),
        **measured(periods, integrals, cycle, joints, rigid=not scene.modes),
        **spectral(data, periods, scene.output.instants_per_revolution),
    }


def _bytes_an_instant(part: dict[str, Array]) -> float:
    return sum(one.nbytes for one in part.values()) / max(len(part["time"]), 1)


def _refuse_what_does_not_fit(size: float, count: int) -> None:
    """Raise InputError where time series of so many bytes would take more than `MOST` of the machine's memory."""
    memory = host.memory()
    if size > MOST * memory:
        raise InputError(
            "output.instants_per_revolution",
            count,
            f"makes time series of {size / 1e9:.3g} GB or more; this machine has {memory / 1e9:.3g} GB of memory",
            "Write fewer instants per revolution (0: every accepted step), or simulate fewer revolutions; "
            "hpcclear sample stores no time series",
        )


def _series_between(scene: Scene, recording: Recording, piece: Piece) -> dict[str, Array]:
    """Every time series at the instants of a piece."""
    problem, par, times = recording.problem, recording.par, piece.times
    turning = bool(at.rules_of(problem.effects).turning)  # the crank angle is the last coordinate
    cycle = problem.cycle if turning else 0.0
    q, v, s = _between(piece, cycle)
    steps, k = piece.steps, piece.k
    revolution, contacts = steps.revolution[k], steps.contacts[k]
    began = (steps.time - steps.turn_time)[k]
    turn_time = times - began
    in_turn = _in_turn(q, revolution, cycle)
    rates = recording.observe(np.hstack([in_turn, v]), contacts, turn_time, began)[1]
    works = _works_between(recording, piece, s)
    q, v, in_turn = (one[:, scene.bristles :] for one in (q, v, in_turn))
    return planar_series(
        scene, par, Seen(in_turn, v, turn_time, revolution, contacts, rates, works)
    )


def _in_turn(q: Array, revolution: Array, cycle: float) -> Array:
    """Coordinates with the crank angle, if it is one, counted from the start of its revolution, as the kernel does."""
    if cycle:
        q = q.copy()
        q[:, -1] -= cycle * revolution
    return q

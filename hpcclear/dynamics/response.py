"""One response: the sample of a scene, and the time series of its motion, forces and energies."""

import os

import numpy as np
import xarray as xr

from hpcclear.base.arrays import Array, Records
from hpcclear.base.errors import InputError
from hpcclear.base.objectives import Objective, asked
from hpcclear.base.outcome import STEADY
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.bending import bent_motion
from hpcclear.dynamics.closed_form import ClosedForm, ideal_series
from hpcclear.dynamics.curves import curve_at
from hpcclear.dynamics.evaluation import evaluate_records
from hpcclear.dynamics.evaluator import KICKS, alone, outcome_records, responses_told
from hpcclear.dynamics.joint_laws import stored_energy
from hpcclear.dynamics.layout import TURN
from hpcclear.dynamics.linkage import baumgarte, geometry, ideal
from hpcclear.dynamics.linkage.bending import Bent
from hpcclear.dynamics.parameters import parameters, topology
from hpcclear.dynamics.planar.prescribed import pins_of, prescribed_series
from hpcclear.dynamics.planar.problem import linkage_of, refused_of, tables_of
from hpcclear.dynamics.planar.response import Seen, balance_series, mode_series
from hpcclear.dynamics.planar.response import labels as planar_labels
from hpcclear.dynamics.planar.response import series as planar_series
from hpcclear.dynamics.problem import coordinate_count, integrator_of, problem_of
from hpcclear.dynamics.recorded import ITSELF, Piece, Recording, Steps, pieces
from hpcclear.dynamics.start import start_states
from hpcclear.dynamics.steady.telling import recorded
from hpcclear.dynamics.views import Parameters, Rates
from hpcclear.results import dataset
from hpcclear.scene import Scene
from hpcclear.scene.planar import turns_of

MOST = 0.5
"""Share of the machine's memory that the time series of a response may take."""


def integrate(scene: Scene, copy: int = 0) -> tuple[Steps, Records, Array]:
    """Integrate a scene, or a perturbed replica; all its steps, outcome record (1,) and parameters (PARAMETERS,), all in SI."""
    recording = Recording(scene, copy)
    steps = Steps.of(np.concatenate(list(recording.chunks())))
    return steps, recording.record(), recording.par


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
    powers = recording.observe(ends, steps.contacts[rows], steps.turn_time[rows])[1].powers
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
        need ``numerics.responses`` where there is no study that asks for them.
    copy : int
        Start a little beside the scene's start, in the direction of this number (`hpcclear.dynamics.steady.copies`); a
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
        If the scene asks for what the kernel cannot do, or for time series that do not fit into memory.
    """
    steady = _steady(scene)
    named, scene = scene, scene if steady is None else _shown(scene, steady)
    objective = named.objective if objective is None else objective
    still = coordinate_count(scene) == 0
    if still:
        times, data, record = _closed_form(scene)
    else:
        kicks = () if copy or steady is not None else _kicks(scene, checked)
        times, data, record = _integrated(scene, Recording(scene, copy, kicks, objective))
    if steady is not None:
        steady["status"] = max(steady["status"][0], record["status"][0])  # of the series as well
        record = steady
    half_width = record["objective_uncertainty"]  # of the objective already
    record = asked(record, objective)
    record["objective_uncertainty"] = half_width
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
        | {"integrator": integrator_of(scene)}
        | {"transient_turns": scene.numerics.transient_revolutions * _turns(scene)}
        | _reason(scene),
        objective,
        labels,
        _dimensions(scene),
    )


def _kicks(scene: Scene, checked: bool) -> tuple[int, ...]:
    """Perturbations of the replicas beside a response."""
    if scene.numerics.uncertainty:
        return KICKS  # as for any sample
    return alone(scene.numerics.rtol) if checked else ()


def _dimensions(scene: Scene) -> dict[str, tuple[str, ...]] | None:
    """Labels along what a linkage's series have besides time and joints."""
    modes = {"mode": scene.mode_labels} if scene.modes else {}
    if not scene.is_planar:
        return modes or None
    found = planar_labels(linkage_of(scene).mechanism) | modes
    return found if coordinate_count(scene) else {**found, "pin": pins_of(scene)}


def _turns(scene: Scene) -> int:
    """Turns of a revolution."""
    return turns_of(tables_of(scene)) if scene.is_planar else 1


def _reason(scene: Scene) -> dict[str, str | int]:
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


def _closed_form(scene: Scene) -> tuple[Array, dict[str, Array], Records]:
    """Instants, time series and outcome record (1,) of a scene without clearance at prescribed speed."""
    problem = problem_of(scene)
    lanes = ClosedForm(problem)
    par = parameters(scene)
    lanes.queue(par, start_states(scene, par), np.zeros(1, np.int64))
    record = outcome_records(*lanes.collect(), responses_told(problem), bool(problem.effects.wear))
    found = prescribed_series(scene) if scene.is_planar else ideal_series(scene)
    return *found, record


def _integrated(scene: Scene, recording: Recording) -> tuple[Array, dict[str, Array], Records]:
    """Instants, time series and outcome record (1,) of a scene that is integrated."""
    count = scene.output.instants_per_revolution
    problem = recording.problem
    parts: list[dict[str, Array]] = []
    taken = 0
    for piece in pieces(recording.chunks(), count):
        series = {"time": piece.times, **_series_between(scene, recording, piece)}
        # copies: a column that is a view would keep all that was observed
        parts.append({name: one.copy() for name, one in series.items()})
        taken += len(piece.times)
        least = max(taken, count * (problem.transient + problem.averaged))
        _refuse_what_does_not_fit(least * _bytes_an_instant(parts[0]), count)
    data = {}
    for name in list(parts[0]):
        data[name] = np.concatenate([part.pop(name) for part in parts])
    data["energy_residual"] -= data["energy_residual"][0]
    return data.pop("time"), data, recording.record()


def _bytes_an_instant(part: dict[str, Array]) -> float:
    return sum(one.nbytes for one in part.values()) / max(len(part["time"]), 1)


def _refuse_what_does_not_fit(size: float, count: int) -> None:
    """Raise InputError where time series of so many bytes would take more than `MOST` of the machine's memory."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
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
    turn_time = times - (steps.time - steps.turn_time)[k]
    in_turn = _in_turn(q, revolution, cycle)
    accelerations, rates = recording.observe(np.hstack([in_turn, v]), contacts, turn_time)
    works = _works_between(recording, piece, s)
    n = problem.coordinates - scene.bristles
    q, v, in_turn, accelerations = (
        one[:, scene.bristles :] for one in (q, v, in_turn, accelerations)
    )
    if scene.is_planar:
        return planar_series(
            scene, par, Seen(in_turn, v, turn_time, revolution, contacts, rates, works)
        )
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
    return data | {"crank_angle": phi, "crank_speed": omega, "slider_acceleration": slider}


def _in_turn(q: Array, revolution: Array, cycle: float) -> Array:
    """Coordinates with the crank angle, if it is one, counted from the start of its revolution, as the kernel does."""
    if cycle:
        q = q.copy()
        q[:, -1] -= cycle * revolution
    return q


def _series(
    scene: Scene, m: geometry.Motion, par: Array, rates: Rates, contacts: Array, works: Array,
    bar: Bent | None = None,
) -> dict[str, Array]:  # fmt: skip
    """Every time series of the response but those of modes."""
    open_ = np.array([j in scene.clearance_joints() for j in ("crank_rod", "rod_slider")])
    gaps = np.where(open_, rates.gap[:, :2], 0.0)
    latched = scene.effects.contact is not None and scene.effects.contact.latched
    active = contacts[:, :2] if latched else np.ones((len(contacts), 2))
    elastic = stored_energy(scene, par, gaps[:, open_], active[:, open_], np.flatnonzero(open_))
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

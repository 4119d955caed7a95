"""The library of hard scenes at several tolerances: outcome, f and how far to trust it, energy, cost.

    python analysis/hard_cases.py                    # tests/hard_cases/*.toml at 1e-3, 1e-6, 1e-8, about 10 min
    python analysis/hard_cases.py --quick            # 3 revolutions, no uncertainty, about 2 min
    python analysis/hard_cases.py mine/*.toml        # your own scenes

Prints one table, writes hard_cases.nc and hard_cases.png. The reference is the same scene at rtol 1e-10; the energy
residual is relative to the largest of kinetic energy and integral of |driving power|.
"""

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from hpcclear import geometry
from hpcclear.errors import InputError
from hpcclear.evaluator import evaluate_records, outcome_records
from hpcclear.kernel import layout as at
from hpcclear.kernel import record as rec
from hpcclear.kernel.lanes import Lanes
from hpcclear.lowering import parameters, problem_of, start_states, topology
from hpcclear.scene import Scene, load_scene
from hpcclear.scene.points import Points
from hpcclear.status import Flag, Status

LIBRARY = Path(__file__).parent.parent / "tests" / "hard_cases"
TOLERANCES = (1e-3, 1e-6, 1e-8)
REFERENCE = 1e-10
LONGEST = 20  # revolutions; longer scenes are cut to this, here
CHUNK = 8192  # steps

NOTHING = Points((), np.empty((1, 0)), ())


@dataclass(frozen=True)
class Run:
    """What one simulation came to."""

    outcome: np.void  # a record of `hpcclear.status.OUTCOME`
    residual: float
    implicit: float  # share of implicit steps
    seconds: float

    @property
    def status(self) -> Status:
        """How it ended."""
        return Status(self.outcome["status"])

    @property
    def flags(self) -> set[Flag]:
        """What to mind."""
        return {flag for flag in Flag if self.outcome["flags"] & flag}


def cut(scene: Scene, rtol: float, longest: int) -> Scene:
    """The scene at another tolerance, over so many revolutions at most, half of them averaged."""
    numerics = scene.numerics
    transient, averaged = numerics.transient_revolutions, numerics.averaged_revolutions
    if averaged == "auto" or transient + averaged > longest:
        transient = min(transient, longest // 2)
        averaged = longest - transient
    return scene.with_(
        {
            "numerics.rtol": rtol,
            "numerics.transient_revolutions": transient,
            "numerics.averaged_revolutions": averaged,
        }
    )


def balance(
    scene: Scene, par: np.ndarray, rows: np.ndarray, n: int
) -> tuple[np.ndarray, np.ndarray]:
    """Energy less all work done at recorded steps, and the size to measure it by, J (steps,)."""
    first, second, free = topology(scene)
    q, v = rows[:, rec.STATE : rec.STATE + n].T, rows[:, rec.STATE + n : rec.STATE + 2 * n].T
    phi = par[at.SPEED] * rows[:, rec.TURN_TIME]
    omega = np.full_like(phi, par[at.SPEED])
    if free:
        phi, omega, q, v = q[-1], v[-1], q[:-1], v[:-1]
    m = geometry.motion((first, second), par, phi, omega, q, v)
    kinetic = geometry.kinetic_energy(m, par)
    energy = kinetic + geometry.potential_energy(m, par, scene.effects.gravity)
    for k, (is_open, base) in enumerate(((first, at.JOINT_12), (second, at.JOINT_23))):
        if is_open:
            gap = (
                np.hypot(m.eccentricity_x[:, k], m.eccentricity_y[:, k]) - par[base + at.CLEARANCE]
            )
            on = rows[:, rec.ACTIVE_12 + k] if scene.effects.contact.latched else 1.0
            energy += 0.4 * par[base + at.CONTACT_STIFFNESS] * on * np.maximum(gap, 0.0) ** 2.5
    works = rows[:, rec.DRIVE_WORK] + rows[:, rec.LOAD_WORK] - rows[:, rec.DISSIPATED]
    return energy - works, np.maximum(kinetic, rows[:, rec.ABS_DRIVE_WORK])


def chunks(lanes: Lanes) -> Iterator[np.ndarray]:
    """Recorded steps as they come."""
    while lanes.pending:
        lanes.advance(0.5)
        yield lanes.take_record()


def run(scene: Scene) -> Run:
    """Simulate one scene with its energy balance; every accepted step counts, none is kept."""
    problem = problem_of(scene, ledger=True, series=True)
    n = problem.coordinates
    par = parameters(scene)
    state = start_states(scene, par)
    lanes = Lanes(problem, 1, np.zeros((CHUNK, rec.columns(n))))
    lanes.queue(par, state, np.zeros(1, np.int64))
    start = np.zeros((1, rec.columns(n)))
    start[0, rec.STATE : rec.STATE + 2 * n] = np.r_[
        state[0, :n], state[0, at.MAX_COORDINATES : at.MAX_COORDINATES + n]
    ]
    start[0, rec.ACTIVE_12 : rec.ACTIVE_23 + 1] = state[0, 2 * at.MAX_COORDINATES :][:2]
    first, largest = balance(scene, par[0], start, n)
    off, size = 0.0, largest[0]
    began = time.perf_counter()
    for rows in chunks(lanes):
        if len(rows):
            total, largest = balance(scene, par[0], rows, n)
            off = max(off, float(np.abs(total - first).max()))
            size = max(size, float(largest.max()))
    labels, out, finished = lanes.collect()
    return Run(
        outcome_records(labels, out, finished)[0],
        off / size,
        out[0, at.OUT_STIFF_STEPS] / max(out[0, at.OUT_ATTEMPTS], 1.0),
        time.perf_counter() - began,
    )

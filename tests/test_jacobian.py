"""The Jacobians of implicit steps, of eight samples side by side, against central differences one by one."""

from pathlib import Path

import numpy as np
import pytest

from hpcclear.base.jit import FASTMATH
from hpcclear.base.lowering.compiled import Compiled
from hpcclear.base.lowering.values import kind_of
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.observe import observe
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.problem import problem_of
from hpcclear.dynamics.setup.start import start_states
from hpcclear.dynamics.stepping.implicit import memory as mem
from hpcclear.dynamics.stepping.implicit.columns import new_columns
from hpcclear.dynamics.stepping.implicit.control import fit_to_ramp
from hpcclear.dynamics.stepping.implicit.memory import COLUMNS, Moved, N
from hpcclear.dynamics.stepping.implicit.newton import evaluate_stages, new_jacobian
from hpcclear.dynamics.stepping.problem import Problem
from hpcclear.scene import load_scene

JOB = Path(__file__).parent.parent / "jobs" / "slider_crank.toml"
DRIVE = {"kind": "torque", "torque": 5.0, "initial_speed": 520.0, "flywheel_inertia": 0.01}
TOPOLOGIES = {
    # name: coordinates, changes
    "two open": (4, {}),
    "two open, free crank": (5, {"drive": DRIVE}),
    "baumgarte": (9, {"numerics.formulation": "baumgarte"}),
}
TIME = 1e-4


def memory_of(changes: dict) -> tuple[Problem, np.ndarray]:
    """What the implicit method remembers of eight samples whose journals both touch, each elsewhere; steps of no length, so
    that every stage stands there."""
    scene = load_scene(JOB).with_({
        "effects.contact": {"law": "hunt-crossley", "damping": 0.5},
        "effects.friction.coefficient": 0.1,
        "numerics.method": "radau",
        **changes,
    })  # fmt: skip
    problem = problem_of(scene)
    n, par = problem.coordinates, parameters(scene)
    start = start_states(scene, par)[0]
    m = new_columns(COLUMNS)[0]
    rows = m.reshape(-1, COLUMNS)
    rows[mem.PAR : mem.PAR + len(par[0])] = par[0][:, None]
    m[mem.TIME : mem.TIME + COLUMNS] = TIME
    rng = np.random.default_rng(n)
    away = rng.choice([-1e-3, 1e-3], (n, COLUMNS)) * rng.uniform(0.6, 1.0, (n, COLUMNS))
    rows[at.Q : at.Q + n] = start.coordinates(n)[:, None] + away  # |e| above the clearance
    rows[at.V : at.V + n] = start.velocities(n)[:, None]
    settings = problem.settings()
    least = settings.atol / settings.rtol * par[0, at.tolerance_rows(n)]
    rows[mem.LEAST + np.r_[:n, N : N + n]] = least[:, None]
    for i in range(COLUMNS):
        fit_to_ramp(par[0], 0, 1, m, i, settings.rows)
    return problem, m


def differentiate(problem: Problem, m: np.ndarray) -> None:
    """Evaluate the stages, and the Jacobians at the middle one."""
    motion = problem.motion(problem.effects, COLUMNS).address
    moved = Moved(0, motion, problem.coordinates, problem.tables)
    for function in (evaluate_stages, new_jacobian):
        Compiled(function, kind_of((moved, m)).parts, FASTMATH)(moved, m)


@pytest.mark.parametrize("name", TOPOLOGIES)
@pytest.mark.shortened(1)
def test_columns_are_the_derivatives(name: str):
    n, changes = TOPOLOGIES[name]
    problem, m = memory_of(changes)
    assert problem.coordinates == n
    rows = m.reshape(-1, COLUMNS)
    motion = problem.motion(problem.effects, 1).address

    def accelerations(states: np.ndarray, i: int) -> np.ndarray:
        out = np.zeros((len(states), n + at.RATES))
        contacts = np.tile(rows[at.ACTIVE : at.ACTIVE + 2 * at.MAX_JOINTS, i], (len(states), 1))
        par, times = rows[mem.PAR : mem.NUMBERS, i].copy(), np.full(len(states), TIME)
        observe(motion, par, problem.tables, states, contacts, (times, np.zeros_like(times)), out)
        return out[:, :n]

    differentiate(problem, m)
    by = [rows[first : first + N * N].reshape(N, N, -1)[:n, :n] for first in (mem.BY_Q, mem.BY_V)]
    for i in range(COLUMNS):
        state = np.r_[rows[at.Q : at.Q + n, i], rows[at.V : at.V + n, i]]
        found = rows[mem.STAGE_ACC + N : mem.STAGE_ACC + N + n, i]
        here = accelerations(state[None], i)[0]
        assert found == pytest.approx(here, rel=1e-13, abs=1e-12 * abs(here).max())
        least = np.r_[rows[mem.LEAST :, i][:n], rows[mem.LEAST + N :, i][:n]]
        reach = m[mem.REACH + i] * least
        increments = np.diag(np.minimum(1e-7 * np.maximum(abs(state), least), reach))
        reference = accelerations(state + increments, i) - accelerations(state - increments, i)
        reference = reference.T / (2.0 * np.diag(increments))
        size = abs(reference * least).max(axis=1, keepdims=True)
        assert (abs(found) > 0.0).sum() >= 4  # both contacts push
        columns = np.hstack([one[:, :, i] for one in by])
        assert (abs(columns - reference) * least < 1e-4 * size).all()


def test_differences_stay_within_the_ramp():
    """A column's increment is a thousandth of the ramp at most: across its end the slope would be hidden."""
    problem, m = memory_of({"effects.friction.ramp_speed": 1e-6})
    velocities = m.reshape(-1, COLUMNS)[mem.BY_V : mem.BY_V + N * N].reshape(N, N, -1)[:4, :4]
    reach = m[mem.REACH : mem.REACH + COLUMNS]
    assert reach == pytest.approx(1e-9)
    differentiate(problem, m)
    assert np.isfinite(velocities).all()
    reach[3] = 0.0  # there and nowhere else is no difference to divide by
    differentiate(problem, m)
    assert np.isfinite(np.delete(velocities, 3, axis=2)).all()
    assert not np.isfinite(velocities[:, :, 3]).any()

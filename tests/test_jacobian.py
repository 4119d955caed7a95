"""The Jacobian of implicit steps, whose columns are evaluated side by side, against central differences one by one."""

from pathlib import Path

import numpy as np
import pytest

from hpcclear.dynamics import layout as at
from hpcclear.dynamics.implicit import memory as mem
from hpcclear.dynamics.implicit.control import fit_to_ramp
from hpcclear.dynamics.implicit.dense import invert_both
from hpcclear.dynamics.implicit.jacobian import difference_jacobian, evaluate_bank
from hpcclear.dynamics.implicit.radau import new_memory
from hpcclear.dynamics.implicit.stiff import blocks_of
from hpcclear.dynamics.linkage.observe import observe
from hpcclear.dynamics.parameters import parameters
from hpcclear.dynamics.problem import Problem, problem_of
from hpcclear.dynamics.start import start_states
from hpcclear.scene import load_scene

JOB = Path(__file__).parent.parent / "jobs" / "slider_crank.toml"
DRIVE = {"kind": "torque", "torque": 5.0, "initial_speed": 520.0, "flywheel_inertia": 0.01}
TOPOLOGIES = {
    # name: coordinates, changes
    "two open": (4, {}),
    "two open, free crank": (5, {"drive": DRIVE}),
    "baumgarte": (9, {"numerics.formulation": "baumgarte"}),
}


def memory_of(changes: dict) -> tuple[Problem, np.ndarray]:
    """What the implicit method remembers of a lane whose journals both touch, at the state of every stage."""
    scene = load_scene(JOB).with_({
        "effects.contact": {"law": "hunt-crossley", "damping": 0.5},
        "effects.friction.coefficient": 0.1,
        "numerics.method": "radau",
        **changes,
    })  # fmt: skip
    problem = problem_of(scene)
    n, par = problem.coordinates, parameters(scene)
    start = start_states(scene, par)[0]
    q, v = start.coordinates(n).copy(), start.velocities(n).copy()
    q += 1e-3 * np.random.default_rng(n).uniform(-1.0, 1.0, n)  # |e| above the clearance
    m = new_memory(1)[0]
    rows = m.reshape(-1, mem.LANES)
    for bank in (rows[: at.BANK], rows[mem.SECOND : mem.SECOND + at.BANK]):
        bank[mem.PAR : mem.PAR + len(par[0])] = par[0][:, None]
        bank[at.STAGE_TIME] = 1e-4
    rows[at.QS : at.QS + n], rows[at.VS : at.VS + n] = q[:, None], v[:, None]
    settings = problem.settings()
    vector(m, mem.LEAST)[:n] = settings.atol_coordinates[:n] / settings.rtol
    vector(m, mem.LEAST + mem.BLOCKS)[:n] = settings.atol_velocities[:n] / settings.rtol
    fit_to_ramp(par[0], 0, 1, m, 0, settings.rows)
    return problem, m


def vector(m: np.ndarray, row: int) -> np.ndarray:
    """The vector over the coordinates that begins at a row."""
    return m[row * mem.LANES :][: mem.BLOCKS * mem.LANES]


def motions_and_tables(problem: Problem) -> tuple:
    """The motion of one lane, and of the bank's, as the stepper of lanes hands them on."""
    return *(
        problem.motion(problem.effects, width).address for width in (1, mem.LANES)
    ), problem.tables


@pytest.mark.parametrize("name", TOPOLOGIES)
def test_columns_are_the_derivatives(name: str):
    n, changes = TOPOLOGIES[name]
    problem, m = memory_of(changes)
    assert problem.coordinates == n
    motion, bank, tables = motions_and_tables(problem)
    rows = m.reshape(-1, mem.LANES)
    state = np.r_[rows[at.QS : at.QS + n, mem.MIDDLE], rows[at.VS : at.VS + n, mem.MIDDLE]]

    def accelerations(states: np.ndarray) -> np.ndarray:
        out = np.zeros((len(states), n + at.RATES))
        contacts = rows[at.ACTIVE : at.ACTIVE + 2 * at.MAX_JOINTS, mem.MIDDLE]
        observe(
            motion, rows[mem.PAR : mem.SECOND, 0].copy(), tables, states,
            np.tile(contacts, (len(states), 1)),
            np.full(len(states), rows[at.STAGE_TIME, mem.MIDDLE]), out,
        )  # fmt: skip
        return out[:, :n]

    evaluate_bank(bank, m, tables)
    found = rows[at.ACC : at.ACC + n, mem.MIDDLE]
    here = accelerations(state[None])[0]
    assert found == pytest.approx(here, rel=1e-13, abs=1e-12 * abs(here).max())
    vector(m, mem.BASE)[:n] = found
    difference_jacobian(bank, n, blocks_of(n), m, tables)
    columns = np.array([vector(m, mem.JACOBIAN + k * mem.BLOCKS)[:n] for k in range(2 * n)]).T

    least = np.r_[vector(m, mem.LEAST)[:n], vector(m, mem.LEAST + mem.BLOCKS)[:n]]
    increments = np.diag(np.minimum(1e-7 * np.maximum(abs(state), least), m[mem.REACH] * least))
    reference = (accelerations(state + increments) - accelerations(state - increments)).T
    reference /= 2.0 * np.diag(increments)
    size = abs(reference * least).max(axis=1, keepdims=True)
    assert (abs(found) > 0.0).sum() >= 4  # both contacts push
    assert (abs(columns - reference) * least < 1e-4 * size).all()


def test_differences_stay_within_the_ramp():
    """A column's increment is a thousandth of the ramp at most: across its end the slope would be hidden."""
    problem, m = memory_of({"effects.friction.ramp_speed": 1e-6})
    _, bank, tables = motions_and_tables(problem)
    difference_jacobian(bank, 4, 1, m, tables)
    increments = m[mem.INCREMENT * mem.LANES :][:8]
    least = vector(m, mem.LEAST + mem.BLOCKS)[:4]
    assert (abs(increments[4:]) <= 1.0001e-9 * least).all()
    assert (increments != 0.0).all()


@pytest.mark.parametrize("n", [1, 2, 5, 8, 9, 24])
def test_inverses_are_those_of_numpy(n: int):
    """Of the real system and of the complex one, whose pivots have to be looked for."""
    rng = np.random.default_rng(n)
    m = new_memory(1)[0]
    real, complex_ = rng.normal(size=(n, n)), rng.normal(size=(n, n)) + 1j * rng.normal(size=(n, n))
    real[0, 0] = complex_[0, 0] = 0.0 if n > 1 else 2.0
    parts = {mem.REAL: real, mem.COMPLEX_RE: complex_.real, mem.COMPLEX_IM: complex_.imag}
    for row, part in parts.items():
        for k in range(n):
            vector(m, row + k * mem.BLOCKS)[:n] = part[:, k]
    assert invert_both(n, blocks_of(n), m)
    found = {
        row: np.array([vector(m, row + k * mem.BLOCKS)[:n] for k in range(n)]).T for row in parts
    }
    np.testing.assert_allclose(found[mem.REAL] @ real, np.eye(n), atol=1e-11)
    both = found[mem.COMPLEX_RE] + 1j * found[mem.COMPLEX_IM]
    np.testing.assert_allclose(both @ complex_, np.eye(n), atol=1e-11)


@pytest.mark.parametrize("row", [mem.REAL, mem.COMPLEX_RE])
def test_a_singular_system_is_noticed(row: int):
    m = new_memory(1)[0]
    for k in range(3):
        for first in (mem.REAL, mem.COMPLEX_RE):
            vector(m, first + k * mem.BLOCKS)[k] = 1.0
    vector(m, row + mem.BLOCKS)[:] = 0.0
    assert not invert_both(3, 1, m)

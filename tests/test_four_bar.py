"""A four-bar with clearance in both joints of its coupler, through the block stepper: against scipy, with its energy.

The stepper takes a motion by its address and knows no mechanism; of the layout's rows of parameters it reads its own few and
those of the joints, so the four-bar's stand where the slider-crank's would.
"""

import math

import numpy as np
import pytest
from dense_linkage import Dense
from linkages import four_bar
from numba import cfunc
from plain_lane import CHI, CONTACT, FREE, GRAVITY, MU, RAMP, Lane, coordinates
from scipy.integrate import solve_ivp

from hpcclear.base.jit import FASTMATH
from hpcclear.base.one_text import one_text
from hpcclear.dynamics import lanes
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.explicit.tableau import DORMAND_PRINCE
from hpcclear.dynamics.linkage.assembly import assemble
from hpcclear.dynamics.linkage.compiled import module_with
from hpcclear.dynamics.linkage.generator import On, Rows, generate
from hpcclear.dynamics.linkage.numbers import row_of, values
from hpcclear.dynamics.linkage.parts import ConstantSpeed
from hpcclear.dynamics.linkage.rhs import SIGNATURE
from hpcclear.dynamics.problem import Problem
from hpcclear.dynamics.views import Start

SPEED, RTOL = 300.0, 1e-10
TURN = 2 * math.pi / SPEED
MECHANISM = four_bar("o2", "o3", drive=ConstantSpeed("motor", "crank", SPEED), off=0.003)
EFFECTS = at.Effects(crank_rod=1, rod_slider=1, fixed=1, coulomb=1, ledger=1)
STEPPERS = {at.SPEED, at.PERIOD, at.FIRST_STEP, at.STRICTNESS}
N = 4  # coordinates: of the coupler x, y and angle, and the rocker's angle


def text_and_parameters():
    """The four-bar's text in the layout's rows, and a sample's parameters."""
    on = On(friction=True, gravity=True, ledger=True)
    names = [name for name in generate(MECHANISM, on, Rows()).parameters if name != "motor_speed"]
    rows = [row for row in range(at.JOINT_12) if row not in STEPPERS]
    given = dict(zip(names, rows, strict=False)) | {"motor_speed": at.SPEED}
    text = generate(MECHANISM, on, Rows(parameters=given))
    par = np.ones(at.PARAMETERS)
    for row, value in row_of(text, values(MECHANISM, gravity=GRAVITY)).items():
        par[row] = value
    par[at.PERIOD], par[at.FIRST_STEP] = TURN, 1e-3 * TURN
    for block, joint in zip((at.JOINT_12, at.JOINT_23), MECHANISM.clearances, strict=True):
        for entry, value in (
            (at.CLEARANCE, joint.clearance),
            (at.CONTACT_STIFFNESS, joint.stiffness),
            (at.DAMPING, CHI),
            (at.BEARING_RADIUS, joint.bearing_radius),
            (at.JOURNAL_RADIUS, joint.bearing_radius - joint.clearance),
            (at.FRICTION, MU),
            (at.INVERSE_RAMP, 1 / RAMP),
        ):
            par[block + entry] = value
    return text, par


def by_stepper(monkeypatch, start, turns):
    """Outcomes of as many samples as there are turns, each of one turn more."""
    text, par = text_and_parameters()
    motion = module_with(text, (at.O12, at.O23)).motion

    def motion_of(effects, W):
        written = one_text(motion, f"four_bar_{W}", effects=effects, W=W)
        return cfunc(SIGNATURE, error_model="numpy", fastmath=FASTMATH)(written)

    monkeypatch.setattr(lanes, "motion_of", motion_of)
    lengths = 1e-3 * RTOL * np.array([1, 1, 10, 10])
    rates = 1e3 * 1e-3 * RTOL * np.array([1, 1, 50, 50])
    problem = Problem(
        EFFECTS, N, DORMAND_PRINCE, RTOL, (*lengths, *rates), 1e-3, 0, turns, 10_000_000
    )
    starts = Start.at_rest(1)
    starts.coordinates(N)[:], starts.velocities(N)[:] = start
    return lanes.Lanes(problem, 4).run(par[None], starts)


def poses(dense, q, v, time):
    """All bodies from the coordinates."""
    crank, _, rocker = MECHANISM.bodies
    x, rates = np.zeros((2, dense.n))
    for body, pin, angle, spin in (
        (crank, (0.0, 0.0), crank.start_angle + SPEED * time, SPEED),
        (rocker, MECHANISM.ground["p"], q[3], v[3]),
    ):
        k = dense.first[body.name]
        turn = complex(math.cos(angle), math.sin(angle)) * complex(*body.center)
        x[k : k + 3] = pin[0] + turn.real, pin[1] + turn.imag, angle
        rates[k : k + 3] = -spin * turn.imag, spin * turn.real, spin
    k = dense.first["coupler"]
    x[k : k + 3], rates[k : k + 3] = q[:3], v[:3]
    return x, rates


def energy(dense, x, rates):
    """Kinetic, potential and elastic energy, J."""
    total = 0.5 * dense.masses() @ rates**2 + GRAVITY * dense.masses()[1::3] @ x[1::3]
    for joint in MECHANISM.clearances:
        a, b = (np.array(dense.place(x, place), float) for place in joint.places)
        total += 0.4 * joint.stiffness * max(np.linalg.norm(a - b) - joint.clearance, 0.0) ** 2.5
    return total


def test_a_four_bar_goes_through_the_stepper(monkeypatch):
    lane, dense = Lane(MECHANISM), Dense(MECHANISM, [CONTACT] * 2, GRAVITY)
    assembly = assemble(MECHANISM)
    q, v = np.zeros((2, dense.n))
    order = [
        dense.first[one.body] + ("x", "y", "angle").index(one.kind)
        for one in assembly.loops.forest.coordinates
    ]
    q[order], v[order] = assembly.q, assembly.v
    start = coordinates(lane, dense, q, v, 0.0 * v)[:2]

    def rates(t, y):
        a, work = lane(y[:N], y[N : 2 * N], t)
        return [*y[N : 2 * N], *a, abs(work[FREE]), abs(work[FREE + 20])]

    out = by_stepper(monkeypatch, start, 1)
    assert out.status[0] == 0
    y = solve_ivp(
        rates, (0.0, TURN), [*start[0], *start[1], 0.0, 0.0],
        method="DOP853", rtol=1e-11, atol=1e-13, max_step=TURN / 2000,
    ).y[:, -1]  # fmt: skip
    np.testing.assert_allclose(out.coordinates(N)[0], y[:N], rtol=0, atol=1e-8)
    np.testing.assert_allclose(out.velocities(N)[0], y[N : 2 * N], rtol=0, atol=1e-4)
    assert out.objective[0] == pytest.approx(np.hypot(*(y[2 * N :] / TURN)), rel=1e-7)
    assert out.peak_force.min() > 100.0  # N: both joints had contact
    before = energy(dense, *poses(dense, *start, 0.0))
    after = energy(dense, *poses(dense, out.coordinates(N)[0], out.velocities(N)[0], TURN))
    works = out.drive_work[0] + out.load_work[0] - out.dissipated[0]
    assert abs(after - before - works) < 1e-8 * out.absolute_drive_work[0]
    assert out.dissipated[0] > 0.01 * out.absolute_drive_work[0]

"""Generated motions: against a dense model that shares no formula."""

import numpy as np
import pytest
from dense_linkage import Dense, start_of, stiffness
from doc_pages import ROOT, blocks
from linkages import LINKAGES, constant_speed, four_bar, load
from plain_lane import ALPHA, BETA, CONTACT, FREE, GRAVITY, Lane, coordinates, random_states
from scipy.integrate import solve_ivp

from hpcclear.dynamics import layout as at

FAST = constant_speed("motor", "crank", 200.0)
IN_PLACE = ("slider-crank, two", "v-twin, ideal, torque", "quick-return")


def check_rates(dense, work, v):
    """Gaps, forces and powers of a text against the dense model's."""
    seen, first = dense.seen, at.RATE_NOW + 1000
    loss = seen["guide_loss"]
    for k, joint in enumerate(dense.mechanism.contacts):
        expected = [seen[joint.name][name] for name in ("gap", "normal", "rate")]
        got = work[FREE + 20 * k : FREE + 20 * k + 3]
        np.testing.assert_allclose(got, expected, rtol=1e-9, atol=1e-12)
        loss += seen[joint.name]["loss"]
    power = 0.0
    for drive in dense.mechanism.drives:
        moment = seen["multipliers"].get(
            (drive.name, "drive"), seen.get("torques", {}).get(drive.name)
        )
        power += moment * v[dense.first[drive.body] + 2]
        if drive is dense.mechanism.period:
            np.testing.assert_allclose(work[first + at.DRIVE_MOMENT], moment, rtol=1e-8, atol=1e-8)
    scale = abs(power) + abs(loss) + abs(seen["load_power"]) + 1.0
    for row, expected in (
        (at.DRIVE_POWER, power),
        (at.ABS_DRIVE_POWER, abs(power)),
        (at.DISSIPATION, loss),
        (at.LOAD_POWER, seen["load_power"]),
    ):
        assert work[first + row] == pytest.approx(expected, rel=1e-9, abs=1e-9 * scale)


def check_frame(dense, work, a):
    """Force on the frame against inertia and weight of all bodies."""
    masses = dense.masses()[::3]
    found = [work[at.RATE_NOW + 1000 + row] for row in (at.FRAME_X, at.FRAME_Y)]
    expected = -masses @ a[::3], -masses @ (a[1::3] + GRAVITY)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize(
    ("name", "cartesian", "hoist"),
    [
        *((name, False, True) for name in LINKAGES),
        *((name, True, True) for name in LINKAGES),
        *((name, False, False) for name in IN_PLACE),
    ],
)
@pytest.mark.shortened(45)
def test_accelerations_and_rates_equal_the_dense_model(name, cartesian, hoist):
    mechanism = LINKAGES[name]
    lane = Lane(mechanism, cartesian=cartesian, hoist=hoist)
    dense = Dense(mechanism, [CONTACT] * len(mechanism.clearances), GRAVITY, ALPHA, BETA)
    rng = np.random.default_rng(7)
    free = np.repeat([body.name != "plate" for body in mechanism.bodies], 3)
    touched = 0
    for q, v, t in random_states(dense, rng, 3):
        if cartesian:  # constraints violated, so that the feedback matters
            q = q + 1e-6 * free * rng.normal(size=dense.n)
            v = v + 1e-3 * free * rng.normal(size=dense.n)
        expected = dense.accelerations(q, v, t)
        states = coordinates(lane, dense, q, v, expected)
        a, work = lane(states[0], states[1], t)
        np.testing.assert_allclose(a, states[2], rtol=1e-10, atol=1e-10 * np.abs(expected).max())
        check_rates(dense, work, v)
        check_frame(dense, work, expected)
        touched += any(dense.seen[joint.name]["normal"] > 0 for joint in mechanism.contacts)
    assert touched or len(mechanism.clearances) < 2


def test_the_load_of_the_page_acts_as_it_says():
    """Like a force that is given at each state, in accelerations and power."""
    (block,) = (one for one in blocks(ROOT / "docs" / "adding-an-effect.md") if one.title)
    names = {"__name__": "sail"}
    exec(block.text, names)
    place, bare = "coupler.tip", four_bar("o2")
    sail = names["SailLoad"](kind="sail", name="own", place=place, coefficient=0.7)
    braked = Lane(four_bar("o2", loads=(sail,)))
    dense = Dense(bare, [CONTACT], GRAVITY)
    for q, v, t in random_states(dense, np.random.default_rng(3), 3):
        velocity = dense.motion_of(q, v, place)[1]
        force = -0.7 * np.hypot(*velocity) * velocity
        pushed = Lane(
            four_bar("o2", loads=(load("force", "own", place=place, force=force.tolist()),))
        )
        states = coordinates(braked, dense, q, v, v)
        (a, work), (b, given) = (lane(states[0], states[1], t) for lane in (braked, pushed))
        np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-12 * np.abs(b).max())
        row = at.RATE_NOW + 1000 + at.LOAD_POWER
        assert work[row] == pytest.approx(given[row], rel=1e-12)
        assert work[row] < 0.0


@pytest.mark.parametrize("name", ["par", "if", "drag", "hinge", "joint_force", "work"])
def test_a_load_may_be_called_like_anything_in_the_text(name):
    """Its values hide nothing: the motion is that of the same loads by other names."""

    def motion(name, fan):
        curve = {"torque": [[0.0, 1.0], [3.0, 2.0]]}
        loads = (
            load("torque", name, body="rocker", **curve),
            load("drag", fan, body="rocker", linear=0.3),
        )
        return Lane(four_bar("o2", loads=loads))

    own, other = motion(name, "fan"), motion("one", "other")
    dense = Dense(four_bar("o2"), [CONTACT], GRAVITY)
    for q, v, t in random_states(dense, np.random.default_rng(5), 2):
        states = coordinates(own, dense, q, v, v)
        (a, _), (b, _) = (lane(states[0], states[1], t) for lane in (own, other))
        np.testing.assert_array_equal(a, b)


def energy(dense, q, v):
    """Kinetic, potential and elastic energy of a state."""
    total = 0.5 * dense.masses() @ v**2 + GRAVITY * dense.masses()[1::3] @ q[1::3]
    for joint in dense.mechanism.clearances:
        a, b = (np.array(dense.place(q, place), float) for place in (joint.journal, joint.bearing))
        depth = max(np.linalg.norm(a - b) - joint.clearance, 0.0)
        total += 0.4 * stiffness(joint) * depth**2.5
    return total


@pytest.mark.parametrize(
    ("mechanism", "end"),
    [
        (four_bar("o2", "o3", drive=FAST, off=0.003), 1e-3),
        pytest.param(four_bar("o1", "o2", "o3", "o4", drive=FAST), 1e-3, marks=pytest.mark.full),
    ],
    ids=["two", "four"],
)
def test_whole_motions_are_the_dense_model_s_and_conserve_energy(mechanism, end):
    """A four-bar from its assembly into contact, before motions of two tolerances part: to 1e-8 m, and 1e-8 of the energy."""
    lane = Lane(mechanism)
    dense = Dense(mechanism, [CONTACT] * len(mechanism.clearances), GRAVITY)
    q, v = start_of(dense)
    start = coordinates(lane, dense, q, v, 0.0 * v)
    n = len(start[0])
    seen = []

    def of_lane(t, y):
        a, work = lane(y[:n], y[n : 2 * n], t)
        seen.append(max(work[FREE + 1 : FREE + 20 * len(mechanism.clearances) : 20]))
        rates = work[at.RATE_NOW + 1000 :]
        return [*y[n : 2 * n], *a, *rates[[at.DRIVE_POWER, at.LOAD_POWER, at.DISSIPATION]]]

    def of_dense(t, y):
        return [*y[dense.n :], *dense.accelerations(y[: dense.n], y[dense.n :], t)]

    options = {"method": "DOP853", "rtol": 1e-10, "atol": 1e-12, "max_step": 2e-5}
    y = solve_ivp(of_lane, (0, end), [*start[0], *start[1], 0, 0, 0], **options).y[:, -1]
    z = solve_ivp(of_dense, (0, end), [*q, *v], **options).y[:, -1]
    expected = coordinates(lane, dense, z[: dense.n], z[dense.n :], 0.0 * v)
    np.testing.assert_allclose(y[:n], expected[0], rtol=0, atol=1e-8)
    assert max(seen) > 10.0  # N: there was contact
    before, after = energy(dense, q, v), energy(dense, z[: dense.n], z[dense.n :])
    drive, load, loss = y[2 * n :]
    assert abs(after - before - drive - load + loss) < 1e-8 * (after + abs(drive))
    assert loss > 1e-6 * after

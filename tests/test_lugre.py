"""Friction by bristles: Stribeck's curve, stick-slip against an independent solver, energy, hard cases, what is refused."""

import math

import numpy as np
import pytest
import running
from planar_scenes import planar_scene
from refusals import refused
from scipy.integrate import solve_ivp
from some_laws import row

from hpcclear import simulate
from hpcclear.base.errors import InputError
from hpcclear.base.outcome import Status
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.observe import observe
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.problem import coordinate_count, problem_of
from hpcclear.dynamics.setup.start import start_states
from hpcclear.laws.friction import lugre
from hpcclear.scene import Scene
from hpcclear.scene.points import Points, check_points

LUGRE = {
    "law": "lugre",
    "coefficient": 0.1,
    "static_coefficient": 0.15,
    "stribeck_speed": 0.01,
    "bristle_stiffness": 1e5,
}


def bristled(changes=None, rtol=1e-6, revolutions=1, **friction) -> Scene:
    """The paper's slider-crank with bristles in its joints, from the start."""
    own = {"effects.friction": LUGRE | friction, "numerics.energy": True}
    return running.scene_with(
        {"effects.contact": running.HUNT_CROSSLEY} | own | (changes or {}), revolutions, rtol
    )


# ---- the law -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("speed", [-3.0, -0.01, -1e-5, 1e-5, 0.004, 0.02, 10.0])
def test_steady_bristles_are_stribecks_curve(speed):
    curve = 0.1 + 0.05 * math.exp(-((speed / 0.01) ** 2))
    held = lugre.stribeck(speed, 0.1, 0.15, 100.0)
    assert held == pytest.approx(curve, rel=1e-14)
    deflection = math.copysign(curve / 1e5, speed)
    rate = lugre.deflection(deflection, speed, 0.1, 0.15, 100.0, 1e5)
    assert abs(rate) <= 1e-14 * abs(speed)
    ratio = lugre.ratio(deflection, rate, speed, 1e5, 0.3, 0.02)
    assert ratio == pytest.approx(math.copysign(curve, speed) + 0.02 * speed, rel=1e-13)


# ---- a shaft in a hub: the mass on a belt as a scene can say it ----------------------------------------------

RADIUS, CLEARANCE, ARM, MASS, INERTIA, CHI = 0.02, 2e-5, 0.05, 1.0, 2e-3, 300.0
POLYMER = {"youngs_modulus": 2e9, "poisson_ratio": 0.38}
HUB = LUGRE | {
    "coefficient": 0.2,
    "static_coefficient": 0.35,
    "stribeck_speed": 0.02,
    "bristle_stiffness": 2e4,
    "bristle_damping": 0.2,
    "viscous_coefficient": 0.05,
}


def shaft(bodies: dict, joints: dict, hub: dict, speed: float, rtol: float, **friction) -> Scene:
    """A turn of a shaft that a motor drives, in a hub with play; it lies on the hub, or the hub hangs on it."""
    materials = {"bearing": POLYMER, "journal": POLYMER}
    play = {"kind": "clearance", "clearance": CLEARANCE, "bearing_radius": RADIUS}
    own = {"shaft": {"mass": 1.0, "inertia": 1e-3, "points": {"o": [0.0, 0.0]}}}
    numerics = {"rtol": rtol, "transient_revolutions": 0, "averaged_revolutions": 1}
    contact = {"law": "hunt-crossley", "damping": CHI}
    return planar_scene(
        own | bodies,
        joints | {"hub": play | {"materials": materials} | hub},
        {"motor": {"kind": "constant-speed", "body": "shaft", "speed": speed}},
        effects={"gravity": 9.81, "contact": contact, "friction": HUB | friction},
        numerics={**numerics, "energy": True},
        output={"instants_per_revolution": 256},
    )


@pytest.mark.parametrize("speed", [0.004, 0.02, 0.05])
@pytest.mark.shortened(1)
def test_a_shaft_that_slides_steadily_has_the_friction_of_stribecks_curve(speed):
    """A rotor that lies in its bearing: 0.2, one, and 2.5 times Stribeck's speed."""
    scene = shaft(
        {},
        {},
        {"journal": "shaft.o", "bearing": "ground.o", "start_eccentricity": [0.0, -CLEARANCE]},
        speed / RADIUS,
        1e-8,
        static_coefficient=0.25,
        bristle_damping=1.0,
        viscous_coefficient=3.0,  # so steep that sliding is stable
    )
    response = simulate(scene)
    assert int(response["status"]) == Status.OK
    last = response.isel(time=-1, joint=0)
    v = speed / RADIUS * (RADIUS - CLEARANCE - 0.5 * float(last["penetration"]))
    curve = 0.2 + 0.05 * math.exp(-((v / 0.02) ** 2)) + 3.0 * v
    assert float(last["friction_force"] / last["contact_force"]) == pytest.approx(curve, rel=1e-8)


def froude(speed: float, rtol: float) -> Scene:
    """A pendulum whose hub hangs on a turning shaft: carried along while it sticks, let go, and caught again."""
    bob = {
        "mass": MASS,
        "inertia": INERTIA,
        "center": [ARM, 0.0],
        "points": {"hub": [0.0, 0.0]},
        "start_angle": -math.pi / 2,
    }
    axis = {"kind": "revolute", "journal": "shaft.o", "bearing": "ground.o"}
    hub = {"journal": "shaft.o", "bearing": "bob.hub", "start_eccentricity": [0.0, CLEARANCE]}
    return shaft({"bob": bob}, {"axis": axis}, hub, speed, rtol)


def pendulum_by_scipy(speed: float, times: np.ndarray) -> np.ndarray:
    """Its mass centre, angle, their velocities and the deflection (7, times), in complex numbers and by LSODA."""
    softness = 2 * (1 - POLYMER["poisson_ratio"] ** 2) / POLYMER["youngs_modulus"]
    stiffness = 4 / (3 * softness) * math.sqrt(RADIUS * (RADIUS - CLEARANCE) / CLEARANCE)

    def derivative(t, y):
        x, height, angle, vx, vy, spin, z = y
        centre, to_hub = complex(x, height), -ARM * complex(math.cos(angle), math.sin(angle))
        hub, hub_speed = centre + to_hub, complex(vx, vy) + 1j * spin * to_hub
        distance = abs(hub)  # the shaft's centre is the origin
        n = -hub / distance
        depth = max(distance - CLEARANCE, 0.0)
        approach = -(hub_speed * n.conjugate()).real
        normal = max(stiffness * depth**1.5 * (1 + CHI * approach), 0.0)
        of_shaft = 1j * speed * n * (RADIUS - CLEARANCE - 0.5 * depth)
        of_hub = hub_speed + 1j * spin * n * (RADIUS + 0.5 * depth)
        sliding = ((of_shaft - of_hub) * (1j * n).conjugate()).real
        fall = HUB["static_coefficient"] - HUB["coefficient"]
        held = HUB["coefficient"] + fall * math.exp(-((sliding / HUB["stribeck_speed"]) ** 2))
        rate = sliding - HUB["bristle_stiffness"] * abs(sliding) / held * z
        ratio = HUB["bristle_stiffness"] * z + HUB["bristle_damping"] * rate
        ratio += HUB["viscous_coefficient"] * sliding
        force = normal * n * (1 + 1j * ratio)
        arm = hub + n * (RADIUS + 0.5 * depth) - centre
        moment = (arm.conjugate() * force).imag
        return [vx, vy, spin, force.real / MASS, force.imag / MASS - 9.81, moment / INERTIA, rate]

    start = [0.0, -CLEARANCE - ARM, -math.pi / 2, 0.0, 0.0, 0.0, 0.0]
    small = np.array([1e-14] * 3 + [1e-12] * 3 + [1e-17])
    found = solve_ivp(
        derivative, (0, times[-1]), start, "LSODA", times, rtol=1e-12, atol=small, max_step=1e-3
    )
    assert found.success
    return found.y


def test_stick_slip_agrees_with_an_independent_solver():
    """To 1e-8 rad and 1e-9 m, through stretches in which the pendulum is carried along and others in which it slips."""
    speed = 2.0
    response = simulate(froude(speed, 1e-12))
    assert int(response["status"]) == Status.OK
    bob = response.sel(body="bob")
    oracle = pendulum_by_scipy(speed, response["time"].to_numpy())
    np.testing.assert_allclose(bob["body_angle"], oracle[2], rtol=0, atol=1e-8)
    np.testing.assert_allclose(bob["body_x"], oracle[0], rtol=0, atol=1e-9)
    slip = (speed - bob["body_spin"].to_numpy()) * RADIUS
    assert (np.abs(slip) < 0.1 * HUB["stribeck_speed"]).sum() > 8  # sticks
    assert (np.abs(slip) > HUB["stribeck_speed"]).sum() > 100  # slips
    assert float(np.abs(response["energy_residual"]).max()) < 1e-10


# ---- the slider-crank: energy, methods, hard cases -------------------------------------------------------------


@pytest.mark.parametrize("rtol", [1e-6, 1e-8])
def test_energy_closes(rtol):
    scene = bristled(rtol=rtol, revolutions=10, bristle_damping=0.1, viscous_coefficient=1e-3)
    assert running.closes(scene).out.dissipated > 0.0


@pytest.mark.parametrize(
    "contact", [running.LATCHED, running.HUNT_CROSSLEY], ids=lambda law: law["law"]
)
def test_bristles_however_stiff_end_in_a_stated_way(contact):
    """Whatever ends well closes its energy balance; what is stiffer than the steps that are allowed says so."""
    hard = [
        *({"bristle_stiffness": 10.0**k} for k in range(3, 13)),
        *({"stribeck_speed": 10.0**-k, "bristle_stiffness": 1e7} for k in (3, 6, 9)),
        {"bristle_damping": 100.0, "bristle_stiffness": 1e7},
        {"bristle_damping": 1e4},
        {"static_coefficient": 5.0, "bristle_stiffness": 1e6},
        {"static_coefficient": 0.1},
        {"coefficient": 1e-6, "static_coefficient": 1e-6},
        {"coefficient": 1e-6},
        {"viscous_coefficient": 1.0},
    ]
    ends = []
    for friction in hard:
        scene = bristled({"effects.contact": contact, "numerics.max_steps": 300_000}, **friction)
        result = running.run(scene)
        ends.append(Status(int(result.out.status)))
        if ends[-1] is Status.OK:
            rest, passed = running.energy_residual(scene, result)
            assert abs(rest) < running.BOUNDS[1e-6] * passed, friction
        else:
            assert math.isnan(result.out.objective)
            assert friction["bristle_stiffness"] > 1e10
    assert set(ends) <= {Status.OK, Status.STEP_CAP}


@pytest.mark.full
def test_methods_agree():
    scene = bristled({"numerics.max_steps": 10**7}, 1e-9)
    running.methods_agree(scene, ("dormand-prince", "radau", "auto"))


@pytest.mark.full
@pytest.mark.parametrize("ideal", ["crank_rod", "rod_slider"])
def test_one_joint_alone_has_its_bristles(ideal):
    scene = bristled({f"joints.{ideal}": {"kind": "ideal"}}, 1e-8)
    assert coordinate_count(scene) == 3
    running.closes(scene)


def accelerations(scene: Scene, states: np.ndarray) -> np.ndarray:
    """Of the mechanism at states of its own (m, 8), by the scene's motion; bristles are not deflected."""
    problem = problem_of(scene)
    n, first, count = problem.coordinates, scene.bristles, len(states)
    whole = np.zeros((count, 2, n))
    whole[:, :, first:] = states.reshape(count, 2, -1)
    out = np.zeros((count, n + at.RATES))
    observe(
        problem.motion(problem.effects, 1).address, parameters(scene)[0], problem.tables,
        whole.reshape(count, -1), np.zeros((count, 2 * at.MAX_JOINTS)), np.zeros((2, count)), out,
    )  # fmt: skip
    return out[:, first:n]


def test_without_friction_bristles_change_nothing():
    """At random states to the last bit but one, and over a revolution as well as it is integrated."""
    none = {"coefficient": 0.0, "static_coefficient": 0.0, "bristle_damping": 1.0}
    on, off = bristled(**none), bristled().with_({"effects.friction": {"law": "none"}})
    start = start_states(off, parameters(off)).state(4)
    away = np.array([3e-4, 3e-4, 1e-3, 3e-4, 1.0, 1.0, 10.0, 1.0])
    states = start + away * np.random.default_rng(8).normal(size=(200, 8))
    without = accelerations(off, states)
    assert (np.abs(without).max(axis=1) > 1e3).sum() > 50
    np.testing.assert_allclose(accelerations(on, states), without, rtol=1e-14, atol=1e-9)
    tight = {"numerics.rtol": 1e-11}
    ends = [running.run(scene.with_(tight)) for scene in (on, off)]
    np.testing.assert_allclose(ends[0].q[-1, 2:], ends[1].q[-1], rtol=0, atol=1e-11)


# ---- the scene file --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("entry", "value", "reason"),
    [
        ("static_coefficient", 0.05, "at least the coefficient of sliding (0.1)"),
        ("static_coefficient", -0.1, "at least 0"),
        ("static_coefficient", None, "needs a static_coefficient"),
        ("stribeck_speed", 0.0, "above 0"),
        ("stribeck_speed", None, "needs a stribeck_speed"),
        ("bristle_stiffness", -1.0, "above 0"),
        ("bristle_stiffness", 0.0, "above 0"),
        ("bristle_stiffness", None, "needs a bristle_stiffness"),
        ("bristle_damping", -1.0, "at least 0"),
        ("viscous_coefficient", -1.0, "at least 0"),
        ("viscous_coefficient", "1 m", "does not fit"),
        ("coefficient", 0.0, "at rest alone"),
        ("ramp_speed", 0.01, "no ramp"),
        ("speeds", [0.001, 0.01], "no ramp"),
    ],
)
def test_bristles_that_are_none_are_refused_with_the_reason(entry, value, reason):
    with refused(f"effects.friction.{entry}", reason=reason):
        bristled(**{entry: value})


def test_points_keep_friction_at_rest_above_that_of_sliding():
    scene = bristled()
    paths = [f"effects.friction.{name}" for name in ("coefficient", "static_coefficient")]
    for values, said in (
        ((0.2, 0.15), "at least the coefficient of sliding"),
        ((0.0, 0.15), "at rest alone"),
    ):
        points = Points(("mu", "rest"), np.array([[0.1, 0.15], values]), tuple((p,) for p in paths))
        with pytest.raises(InputError, match=said):
            check_points(scene, points)
    points = Points(("mu",), np.array([[0.05], [0.15]]), ((paths[0],),))
    check_points(scene, points)
    assert parameters(scene, points)[
        :, at.JOINTS[0].block + row("friction", "lugre", "coefficient")
    ].tolist() == [0.05, 0.15]

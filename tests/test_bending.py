"""Bars that bend: equations against Lagrange's with points, frequencies in closed form, energy, what is refused."""

import math

import numpy as np
import pytest
import running
from bending_by_lagrange import IdealSliderCrank, Rod
from linkages import constant_speed, loose_pin, revolute, slide, torque_drive
from planar_scenes import planar_scene, written_out
from refusals import refused
from scipy.integrate import solve_ivp

from hpcclear import load_scene, simulate
from hpcclear.base.outcome import Status
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.elements import held_inverse, sign_of
from hpcclear.dynamics.linkage.generator import On, Rows, generate
from hpcclear.dynamics.linkage.mechanism import Mechanism
from hpcclear.dynamics.linkage.numbers import row_of, values
from hpcclear.dynamics.linkage.parts import Body
from hpcclear.scene.planar import BarBending

CRANK, LENGTH, MASS, SLIDER = 0.15, 0.3, 0.151104, 0.075552  # Simeon's
UNIFORM = {"mass": MASS, "inertia": MASS * LENGTH**2 / 12, "length": LENGTH, "center": 0.5 * LENGTH}
UNEVEN = UNIFORM | {"inertia": 0.3 * UNIFORM["inertia"] * 12, "center": 0.13}
SPEED, GRAVITY = 150.0, 9.81
SIMEON = 2e11 * 0.008**4 / 12  # N m2


def rod_of(stiffness=SIMEON, damping=0.02, modes=2, exact=False, **bar):
    return Rod(**(UNIFORM | bar), stiffness=stiffness, damping=damping, modes=modes, exact=exact)


def mechanism(opened=(), modes=2, stiffness=SIMEON, damping=0.02, torque=False, **bar):
    """The slider-crank as data."""
    bar = UNIFORM | bar
    ends = {"a": (0.0, 0.0), "b": (LENGTH, 0.0)}
    rod = Body(
        "rod", bar["mass"], bar["inertia"], (bar["center"], 0.0), ends,
        bending=BarBending(modes=modes, stiffness=stiffness, damping=damping) if modes else None,
    )  # fmt: skip
    crank = Body("crank", 0.36, 2.7e-3, (0.07, 0.0), {"a": (0.0, 0.0), "b": (CRANK, 0.0)})
    slider = Body("slider", SLIDER, points={"pin": (0.0, 0.0)})

    def pin(name, journal, bearing):
        if name in opened:
            return loose_pin(name, journal, bearing, 1e-4, 1e-2)
        return revolute(name, journal, bearing)

    drive = constant_speed("drive", "crank", SPEED)
    if torque:
        drive = torque_drive("drive", "crank", 3.0, SPEED)
    return Mechanism(
        (crank, rod, slider),
        (
            revolute("crank_frame", "crank.a", "ground.o"),
            slide("guide", "slider.pin", "ground.o"),
            pin("crank_rod", "crank.b", "rod.a"),
            pin("rod_slider", "slider.pin", "rod.b"),
        ),
        (drive,),
    )


class Text:
    """A generated text read by Python, its joints with clearance exerting given forces and moments on bearing and journal."""

    def __init__(self, mech, loads=None, cartesian=False, hoist=True):
        self.on = On(friction=True, gravity=True, energies=True, series=True)
        self.motion = generate(mech, self.on, Rows(), cartesian=cartesian, hoist=hoist)
        base = values(mech, cartesian, gravity=GRAVITY, feedback=(0.0, 0.0))
        self.par = row_of(self.motion, base)
        self.spins = {}
        names = [joint.name for joint in mech.clearances]

        def joint_force(effects, work, par, joint, relative, turns, i, W):
            self.spins[joint] = relative[4:]
            return loads[joint]

        def sincos(x):
            return np.sin(x), np.cos(x)

        words = {"joint_force": joint_force, "sincos": sincos, "sign_of": sign_of.py_func}
        words |= {"held_inverse": held_inverse.py_func}
        exec(self.motion.source, words)
        self._lane, self._joints = words["lane"], names

    def __call__(self, q, v, t=0.0):
        """Accelerations (n,) and rates."""
        work = np.zeros(at.WORK)
        n = len(q)
        work[at.QS : at.QS + n], work[at.VS : at.VS + n], work[at.STAGE_TIME] = q, v, t
        self._lane(None, self._joints, work, self.par, 0, 1)
        return work[at.ACC : at.ACC + n], work[at.RATE_NOW : at.RATE_NOW + at.RATES]


def loads(rng):
    """Force on the bearing, moments on bearing and journal, loss, of both joints."""
    return {
        name: (*rng.normal(size=2) * 300.0, *rng.normal(size=2) * 2.0, 0.0)
        for name in ("crank_rod", "rod_slider")
    }


def random_rod(rng, modes):
    """Coordinates and velocities of a rod by itself, bent by some millimetres."""
    y = np.concatenate(
        [
            rng.normal(size=2),
            [rng.uniform(0, 6)],
            2e-3 * rng.normal(size=modes) / np.arange(1, modes + 1),
        ]
    )
    return y, np.concatenate(
        [5 * rng.normal(size=2), [80 * rng.normal()], 3 * rng.normal(size=modes)]
    )


@pytest.mark.parametrize("modes", [1, 2, 4])
@pytest.mark.parametrize("bar", [UNIFORM, UNEVEN], ids=["uniform", "uneven"])
def test_a_rod_by_itself_moves_as_its_points_do(modes, bar):
    """Under forces and moments at both ends, in all formulations."""
    rng = np.random.default_rng(modes)
    mech = mechanism(("crank_rod", "rod_slider"), modes, **bar)
    rod = rod_of(modes=modes, **bar)
    center = bar["center"]
    for cartesian, hoist in ((False, True), (False, False), (True, True)):
        for _ in range(5):
            both = loads(rng)
            text = Text(mech, both, cartesian, hoist)
            y, v = random_rod(rng, modes)
            (fx, fy, ma, _, _), (gx, gy, mb, _, _) = both["crank_rod"], both["rod_slider"]
            Q = rod.forces(y, v, GRAVITY)
            Q[:2] += fx, fy
            Q += np.array([gx, gy]) @ rod.end(y).real
            Q[2] += ma + mb
            Q[3:] += ma * rod.end_slopes["a"] + mb * rod.end_slopes["b"]
            a = np.linalg.solve(rod.mass_matrix(y).real, Q)
            forest = text.motion.forest
            n = len(forest.coordinates)
            places = [forest.index(f"bend{k}", "rod") for k in range(1, modes + 1)]
            places = [
                forest.index("x", "rod"), forest.index("y", "rod"), forest.index("angle", "rod"), *places
            ]  # fmt: skip
            e = np.array([np.cos(y[2]), np.sin(y[2])])
            across = np.array([-e[1], e[0]])
            q, w = np.zeros(n), np.zeros(n)
            q[places], w[places] = y, v
            q[places[:2]] += center * e
            w[places[:2]] += center * v[2] * across
            expected = a.copy()
            expected[:2] += center * (a[2] * across - v[2] ** 2 * e)
            got, rates = text(q, w)
            np.testing.assert_allclose(got[places], expected, rtol=0, atol=3e-12 * np.abs(a).max())
            if not cartesian:
                loss = v[3:] @ rod.damp @ v[3:]
                assert rates[at.DISSIPATION] == pytest.approx(loss, rel=1e-12)
            turning = v[2] + v[3:] @ rod.end_slopes["b"]
            assert text.spins["rod_slider"][1] == pytest.approx(turning, rel=1e-12)


def closed(ideal, rng, modes):
    """A state that meets the constraints of a slider-crank without play: rod and slider; and its time."""
    n, t = 3 + modes, rng.uniform(0.0, 0.04)
    y, v = np.zeros(n + 1), np.zeros(n + 1)
    y[3:n], v[3:n] = 2e-3 * rng.normal(size=modes), 2.0 * rng.normal(size=modes)
    y[2] = -np.arcsin(CRANK * np.sin(SPEED * t) / LENGTH)
    for _ in range(9):
        y[:2] = CRANK * np.cos(SPEED * t), CRANK * np.sin(SPEED * t)
        y[2] -= ideal.constraints(y, t)[3] / (LENGTH * np.cos(y[2]))
        y[n] = ideal.rod.place_of_end(y[:n])[0]
    end = ideal.rod.end(y[:n]).real
    v[:2] = SPEED * np.array([-y[1], y[0]])
    v[2] = -(end[1] @ v[:n]) / end[1, 2]
    v[n] = end[0] @ v[:n]
    return y, v, t


@pytest.mark.parametrize("modes", [1, 3])
@pytest.mark.parametrize("opened", [(), ("crank_rod",), ("rod_slider",)])
def test_ideal_joints_hold_a_rod_that_bends(opened, modes):
    """Accelerations and the drive's moment; a joint with play exerts what holds it together."""
    rng = np.random.default_rng(7 + modes)
    ideal = IdealSliderCrank(rod_of(modes=modes, **UNEVEN), CRANK, SLIDER, SPEED, GRAVITY)
    mech = mechanism(opened, modes, **UNEVEN)
    for cartesian in (False, True):
        for _ in range(5):
            y, v, t = closed(ideal, rng, modes)
            a, held = ideal.solved(t, np.concatenate([y, v]))
            n = len(y) - 1
            # multipliers push the rod's ends against the pins
            on = {"crank_rod": -held[:2], "rod_slider": -held[2:]}
            both = {name: (*on[name], 0.0, 0.0, 0.0) for name in opened}
            text = Text(mech, both, cartesian)
            forest = text.motion.forest
            e = np.array([np.cos(y[2]), np.sin(y[2])])
            across = np.array([-e[1], e[0]])
            c = UNEVEN["center"]
            known = {
                ("x", "rod"): 0, ("y", "rod"): 1, ("angle", "rod"): 2,
                **{(f"bend{k}", "rod"): 2 + k for k in range(1, modes + 1)},
                ("slide", "slider"): n, ("x", "slider"): n,
            }  # fmt: skip
            place, speed, wanted = y.copy(), v.copy(), a.copy()
            place[:2] += c * e
            speed[:2] += c * v[2] * across
            wanted[:2] += c * (a[2] * across - v[2] ** 2 * e)
            q, w, expected = (np.full(len(forest.coordinates), np.nan) for _ in range(3))
            for k, one in enumerate(forest.coordinates):
                row = known.get((one.kind, one.body))
                if row is not None:
                    q[k], w[k], expected[k] = place[row], speed[row], wanted[row]
            at_crank = SPEED * t
            arm = 0.07 * np.array([np.cos(at_crank), np.sin(at_crank)])
            crank = {"x": arm[0], "y": arm[1], "angle": at_crank}
            rates = {"x": -SPEED * arm[1], "y": SPEED * arm[0], "angle": SPEED}
            for k, one in enumerate(forest.coordinates):
                if one.body == "crank":
                    q[k], w[k] = crank[one.kind], rates[one.kind]
                elif np.isnan(q[k]):  # slider's height and angle
                    q[k] = w[k] = 0.0
            got, seen = text(q, w, t)
            mine = ~np.isnan(expected)
            scale = np.abs(a).max()
            np.testing.assert_allclose(got[mine], expected[mine], rtol=0, atol=1e-11 * scale)
            pin = CRANK * np.array([np.cos(at_crank), np.sin(at_crank)])
            moment = pin[0] * -held[1] - pin[1] * -held[0]
            moment += 0.36 * GRAVITY * arm[0]
            if not opened:
                assert seen[at.DRIVE_MOMENT] == pytest.approx(moment, rel=1e-9, abs=1e-9)


# ---- closed forms ------------------------------------------------------------------------------------------

WAVE = np.pi / LENGTH
PLANAR = {"mass": MASS, "inertia": UNIFORM["inertia"], "length": LENGTH}


def held_bar(
    carrier, modes=1, block=1e-3, push=0.0, seconds=0.02, damping=0.0, speed=None, gravity=GRAVITY
):
    """A bar between a pin and a block that slides along it, on the ground or on a disc that turns at a speed."""
    on = f"{carrier}.o"
    speed = 2 * np.pi / seconds if speed is None else speed
    bending = {"stiffness": SIMEON, "modes": modes, "damping": damping}
    loads = {"push": {"kind": "force", "place": "block.pin", "force": [-push, 0.0]}}
    return planar_scene(
        {
            "disc": {"mass": 1.0, "inertia": 1e-6, "points": {"o": [0, 0]}},
            "bar": PLANAR | {"bending": bending},
            "block": {"mass": block, "points": {"pin": [0, 0]}},
        },
        {
            "axis": {"kind": "revolute", "journal": "disc.o", "bearing": "ground.o"},
            "left": {"kind": "revolute", "journal": "bar.a", "bearing": on},
            "guide": {"kind": "slide", "point": "block.pin", "line": on},
            "right": {"kind": "revolute", "journal": "block.pin", "bearing": "bar.b"},
        },
        {"motor": {"kind": "constant-speed", "body": "disc", "speed": speed}},
        loads=loads if push else {},
        effects={"gravity": gravity},
        numerics={"rtol": 1e-11, "transient_revolutions": 0, "averaged_revolutions": 1},
    )


def test_a_bar_held_at_both_ends_swings_at_the_beams_frequencies():
    """Let go straight under its weight: about the sag of each mode, (i pi/L)^2 sqrt(EI/(rho A)); even ones rest."""
    response = simulate(held_bar("ground", modes=3))
    t, q = response["time"].to_numpy(), response["mode_amplitude"].to_numpy()
    assert response["mode"].to_numpy().tolist() == ["bar.1", "bar.2", "bar.3"]
    for i in (1, 3):
        rate = (i * WAVE) ** 2 * np.sqrt(SIMEON * LENGTH / MASS)
        sag = -4.0 * GRAVITY / (i * np.pi * rate**2)  # of a load that is the same all along
        expected = sag * (1.0 - np.cos(rate * t))
        np.testing.assert_allclose(q[:, i - 1], expected, rtol=0, atol=1e-5 * abs(sag))
    assert np.abs(q[:, 1]).max() < 1e-5 * np.abs(q[:, 2]).max()
    assert np.abs(response["energy_residual"]).max() < 1e-12


@pytest.mark.parametrize("share", [0.5, -0.8])
@pytest.mark.shortened(1)
def test_what_presses_softens_a_bar_as_euler_has_it(share):
    """The squared frequency falls with the share of the buckling load."""
    push = share * SIMEON * WAVE**2
    response = simulate(held_bar("ground", push=push))
    rate = WAVE**2 * np.sqrt(SIMEON * LENGTH / MASS * (1.0 - share))
    sag = -4.0 * GRAVITY / (np.pi * rate**2)
    expected = sag * (1.0 - np.cos(rate * response["time"].to_numpy()))
    q = response["mode_amplitude"].to_numpy()[:, 0]
    np.testing.assert_allclose(q, expected, rtol=0, atol=1e-4 * abs(sag))


def test_a_bar_that_turns_is_stiffened_by_what_it_pulls():
    """Rayleigh's quotient with the tension of block and bar, by quadrature, less what is thrown outwards."""
    speed, block, gravity = 400.0, 0.05, 1e-2  # which must not change the tension
    bar = held_bar("disc", block=block, speed=speed, gravity=gravity)
    steps = {"numerics.method": "prince-dormand", "output.instants_per_revolution": 0}
    response = simulate(bar.with_(steps))  # 1e-6 of a sag of 10 nm, at the ends of steps
    x, weights = np.polynomial.legendre.leggauss(40)
    x, weights = 0.5 * LENGTH * (x + 1.0), 0.5 * LENGTH * weights
    density = MASS / LENGTH
    tension = speed**2 * (block * LENGTH + 0.5 * density * (LENGTH**2 - x**2))
    shape, slope, curved = (f(WAVE * x) * WAVE**k for k, f in enumerate((np.sin, np.cos, np.sin)))
    kinetic = weights @ (density * shape**2)
    potential = weights @ (SIMEON * curved**2 + tension * slope**2)
    rate = np.sqrt(potential / kinetic - speed**2)
    assert rate > 1.2 * WAVE**2 * np.sqrt(SIMEON / density)
    t = response["time"].to_numpy()
    weight = -gravity * (weights @ (density * shape)) / kinetic
    expected = weight * (np.cos(speed * t) - np.cos(rate * t)) / (rate**2 - speed**2)
    q = response["mode_amplitude"].to_numpy()[:, 0]
    np.testing.assert_allclose(q, expected, rtol=0, atol=1e-6 * np.abs(expected).max())


def test_damping_takes_its_share_of_every_swing():
    response = simulate(held_bar("ground", damping=0.03))
    t, q = response["time"].to_numpy(), response["mode_amplitude"].to_numpy()[:, 0]
    free = WAVE**2 * np.sqrt(SIMEON * LENGTH / MASS)
    sag, rate = -4.0 * GRAVITY / (np.pi * free**2), free * np.sqrt(1.0 - 0.03**2)
    decay = np.exp(-0.03 * free * t)
    expected = sag * (1.0 - decay * (np.cos(rate * t) + 0.03 * free / rate * np.sin(rate * t)))
    np.testing.assert_allclose(q, expected, rtol=0, atol=1e-5 * abs(sag))


# ---- a flexible slider-crank, ideal joints ---------------------------------------------------------------------


def simeons(seconds, **numerics):
    """The slider-crank of Simeon's with two lateral modes, started stretched out and straight."""
    turns = int(np.ceil(seconds * SPEED / (2 * np.pi)))
    rod = UNIFORM | {"mass_center": 0.15, "bending": {"stiffness": SIMEON, "modes": 2}}
    del rod["center"]
    crank = {"length": CRANK, "mass": 0.36, "mass_center": 0.075, "inertia": 6.75e-4}
    return load_scene(
        {
            "mechanism": {"crank": crank, "rod": rod, "slider": {"mass": SLIDER}},
            "drive": {"kind": "constant-speed", "speed": SPEED},
            "joints": {"crank_rod": {"kind": "ideal"}, "rod_slider": {"kind": "ideal"}},
            "numerics": {
                "rtol": 1e-12, "method": "tsitouras", "transient_revolutions": 0,
                "averaged_revolutions": turns, **numerics,
            },
            "output": {"instants_per_revolution": 100},
        }
    )  # fmt: skip


def integrated(ideal, start, times):
    found = solve_ivp(
        ideal.derivative, (0.0, times[-1]), start, "DOP853", times, rtol=1e-11, atol=1e-13
    )
    assert found.success
    return found.y


@pytest.mark.parametrize("seconds", [0.015, pytest.param(0.1, marks=pytest.mark.full)])
@pytest.mark.nightly
def test_a_flexible_slider_crank_moves_as_by_lagrange(seconds):
    """Positions, modes and energy; what is left out of the kinetic energy matters by a thousandth."""
    response = simulate(simeons(seconds))
    times = response["time"].to_numpy()
    times = times[times <= seconds]
    shown = response.isel(time=slice(len(times)))
    ideal = IdealSliderCrank(rod_of(damping=0.0), CRANK, SLIDER, SPEED)
    y = integrated(ideal, ideal.start(), times)
    q = y[3:5].T
    bound = 1e-12 if seconds < 0.05 else 1e-10
    assert np.abs(q[:, 0]).max() > 5e-4
    np.testing.assert_allclose(shown["mode_amplitude"], q, rtol=0, atol=bound)
    np.testing.assert_allclose(shown["rod_angle"], y[2], rtol=0, atol=10 * bound)
    np.testing.assert_allclose(shown["slider_position"], y[5], rtol=0, atol=bound)
    n = 6
    energies = [ideal.rod.energy(a[:5], a[n : n + 5]) for a in y.T]
    moving = np.array([e[0] for e in energies]) + 0.5 * SLIDER * y[n + 5] ** 2
    crank = 0.5 * (6.75e-4 + 0.36 * 0.075**2) * SPEED**2
    np.testing.assert_allclose(shown["kinetic_energy"], moving + crank, rtol=1e-9)
    np.testing.assert_allclose(shown["strain_energy"], [e[1] for e in energies], rtol=0, atol=1e-9)
    np.testing.assert_allclose(shown["energy_residual"], 0.0, atol=1e-7)
    exact = IdealSliderCrank(rod_of(damping=0.0, exact=True), CRANK, SLIDER, SPEED)
    whole = integrated(exact, ideal.start(), times)
    assert np.abs(whole[3:5] - y[3:5]).max() < 2e-3 * np.abs(y[3]).max()


@pytest.mark.full
def test_without_stiffening_the_oracle_is_simeons():
    """Of the IVP test set's slider-crank at 0.1 s, to some 1e-3: it has linear strain, so no stiffening.

    Its rod stretches by 8 um besides, as its other modes say. The package stiffens, which changes the first amplitude by a
    fifth there.
    """
    published = {"angle": -3.311734987910881e-1, "slider": 1.697373326718410e-1}
    modes, stretch = np.array([1.893192460247178e-4, 2.375751865617931e-5]), -8.363283141616840e-6
    found = {}
    for stiffened in (True, False):
        rod = rod_of(damping=0.0)
        rod.slopes = rod.slopes * stiffened
        ideal = IdealSliderCrank(rod, CRANK, SLIDER, SPEED)
        start = ideal.start()
        start[9:11] = 0.444896105, 4.63434311e-3
        found[stiffened] = integrated(ideal, start, [0.1])[:, -1]
    plain = found[False]
    np.testing.assert_allclose(plain[3:5], modes, rtol=1.5e-3)
    assert plain[5] + stretch == pytest.approx(published["slider"], abs=1e-6)
    assert plain[2] == pytest.approx(published["angle"], abs=2e-5)
    assert 1.15 < found[True][3] / modes[0] < 1.3


# ---- joints with play: energy, hard cases, towards rigid ---------------------------------------------------------


def bending(changes=None, rtol=1e-6, revolutions=1, **table):
    """The paper's slider-crank with a rod that bends, from the start."""
    rod = {"stiffness": 300.0, "damping": 0.01} | table
    own = {"mechanism.rod.bending": rod, "numerics.energy": True}
    return running.scene_with(
        {"effects.contact": running.HUNT_CROSSLEY} | own | (changes or {}), revolutions, rtol
    )


@pytest.mark.parametrize("rtol", [1e-6, 1e-8])
@pytest.mark.shortened(1)
def test_energy_closes_with_play_contact_and_friction(rtol):
    """By the tests' own energies, over ten revolutions."""
    scene = bending({"effects.gravity": 9.81}, rtol=rtol, revolutions=10, stiffness=50.0)
    assert np.abs(running.closes(scene).q[:, 0]).max() > 5e-4


@pytest.mark.parametrize(
    "contact",
    [
        pytest.param(running.LATCHED, id="latched", marks=pytest.mark.full),
        pytest.param(running.HUNT_CROSSLEY, id="hunt-crossley", marks=pytest.mark.nightly),
    ],
)
def test_rods_however_soft_or_stiff_end_in_a_stated_way(contact):
    """What ends well closes its energy balance; a rod that its own inertia buckles says that it came to no end."""
    ends = {}
    for modes in (1, 2, 3, 4):
        for power in (-3, 0, 1, 2, 4, 6, 8):
            scene = bending({"effects.contact": contact}, stiffness=10.0**power, modes=modes)
            result = running.run(scene)
            end = ends[modes, power] = Status(int(result.out.status))
            if end is Status.OK:
                rest, passed = running.energy_residual(scene, result)
                assert abs(rest) < running.BOUNDS[1e-6] * passed, (modes, power)
            else:
                assert math.isnan(result.out.objective)
    assert {end for (_, power), end in ends.items() if power <= 0} == {Status.STEP_TOO_SMALL}
    assert {end for (_, power), end in ends.items() if power >= 1} == {Status.OK}


def test_a_stiff_rod_tends_to_a_rigid_one_like_one_over_its_stiffness():
    without = {"effects.contact": running.HUNT_CROSSLEY, "effects.friction": {"law": "none"}}
    rigid = running.run(running.scene_with(without, rtol=1e-10))
    apart = []
    for stiffness in (1e5, 1e6):
        soft = running.run(bending(without, 1e-10, stiffness=stiffness, damping=0.1, modes=1))
        apart.append(np.abs(soft.q[-1, 1:] - rigid.q[-1]).max())
    assert apart[0] < 1e-5
    assert apart[0] / apart[1] == pytest.approx(10.0, rel=0.05)


@pytest.mark.full
def test_methods_agree():
    running.methods_agree(
        bending({}, 1e-10, modes=2), ("dormand-prince", "radau", "switching", "prince-dormand")
    )


def test_the_slider_crank_written_as_a_linkage_is_the_same():
    scene = bending(rtol=1e-9)
    one, other = simulate(scene), simulate(written_out(scene))
    assert float(other["objective"]) == pytest.approx(float(one["objective"]), rel=1e-9)
    for name in ("mode_amplitude", "strain_energy", "kinetic_energy", "energy_residual"):
        size = np.abs(one["kinetic_energy" if "energy" in name else name]).max()
        np.testing.assert_allclose(other[name], one[name], rtol=0, atol=1e-7 * float(size))


# ---- the scene file ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("entry", "value", "reason"),
    [
        ("stiffness", 0.0, "above 0"),
        ("stiffness", "3 N/m", "does not fit"),
        ("modes", 0, "1"),
        ("modes", 5, "4"),
        ("damping", -0.1, "at least 0"),
        ("damping", 1.0, "below 1"),
    ],
)
def test_bending_that_is_none_is_refused_with_the_reason(entry, value, reason):
    with refused(f"mechanism.rod.bending.{entry}", reason=reason):
        bending(**{entry: value})


WRONG = {
    "no bar": ({"mechanism.bodies.bar": {
        "mass": 1.0, "inertia": 1.0, "points": {"a": [0, 0], "b": [1, 0]}, "bending": {"stiffness": 1.0}}}, "bar", "no length"),
    "a point": ({"mechanism.bodies.bar.points": {"c": [0.1, 0.0]}}, "bar", "further point, c"),
    "driven": ({"mechanism.drives.motor.body": "bar"}, "bar", "clamp"),
    "a torque": ({"mechanism.loads": {"turn": {"kind": "torque", "body": "bar", "torque": 1.0}}}, "bar", "no point of appl"),
    "a guide": ({"mechanism.joints.left": {"kind": "slide", "point": "bar.a", "line": "ground.o"}}, "bar", "guides the bar"),
    "a free end": ({"mechanism.joints.right.bearing": "disc.o"}, "bar", "end b"),
    "waves": ({"mechanism.joints.left": {
        "kind": "clearance", "journal": "bar.a", "bearing": "ground.o", "clearance": 1e-4, "bearing_radius": 1e-2,
        "materials": {part: {"youngs_modulus": 2e9, "poisson_ratio": 0.3} for part in ("bearing", "journal")},
        "out_of_round": {"journal": {"cosine_2": 1e-5}}}}, "bar", "out of round"),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG)
def test_bars_that_bend_otherwise_than_between_pins_are_refused(case):
    changes, body, reason = WRONG[case]
    with refused(f"mechanism.bodies.{body}.bending", reason=reason):
        held_bar("ground").with_(changes)


def test_a_profile_of_wear_beside_bending_is_refused():
    wear = {"joints.crank_rod.wear": {"bearing": {"coefficient": 1e-16}, "length": 0.02}}
    lives = {"wear": {"cycles": 1e6, "profile": "harmonics"}}
    with refused("wear.profile"):
        bending(wear | lives)


def test_deflections_that_are_not_small_are_no_motion():
    """A bar that its load buckles is followed until it is a 200th shorter, and no further."""
    response = simulate(held_bar("ground", push=1.1 * SIMEON * WAVE**2, seconds=0.2))
    assert int(response["status"]) == Status.STEP_TOO_SMALL
    q = response["mode_amplitude"].to_numpy()
    assert 0.04 * LENGTH < np.abs(q).max() < 0.0451 * LENGTH  # sqrt(0.02)/pi


def test_a_rod_that_its_inertia_buckles_is_warned_of():
    """Euler's load of the paper's rod is 685/m2 times its stiffness, and 4800 N the inertia."""
    assert any("buckles under 6.85e+03 N" in text for text in bending(stiffness=10.0).warnings)
    assert not any("buckles" in text for text in bending(stiffness=20.0).warnings)

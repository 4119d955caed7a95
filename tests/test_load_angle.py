"""Tables of loads and torques are taken at the angle of the drive's body: from the x axis, counter-clockwise, start included.

The oracle is virtual work by kinematics of its own, complex numbers and scipy's monotone cubic: a load that depends on the
drive's angle alone has done U(angle) - U(start), however the angle got there.
"""

import math

import numpy as np
import pytest
from planar_scenes import planar_scene
from scipy.interpolate import PchipInterpolator
from test_linkage_scenes import slider_crank_pair
from test_rest import REST

from hpcclear import simulate

TURN = 2 * math.pi
STARTS = [math.radians(angle) for angle in (-70.0, 20.0, 115.0, 230.0, 400.0)]
WAYS = (1, -1)
SECONDS = 0.5  # of a turn, or of a swing to and fro
CLEARANCE = 1e-6  # m: works then are off by the load times this, and what the contact gives way
CRANK, COUPLER, ROCKER, FOOT = 0.04, 0.12, 0.08, complex(0.13, 0.01)
PUSH = ((0.1, -60.0), (1.2, 90.0), (2.0, 15.0), (3.5, -40.0), (5.0, 10.0))  # rad, N
TWIST = ((0.0, 1.0), (0.9, -2.0), (2.5, 3.0), (4.0, 0.5))  # rad, N m
LEAN = 0.7  # direction of the force, rad
MATERIAL = {"youngs_modulus": 2e11, "poisson_ratio": 0.3}
SURFACES = {"bearing_radius": 0.01, "materials": {"bearing": MATERIAL, "journal": MATERIAL}}


# ---- the oracle ----------------------------------------------------------------------------------------


def curve(rows, turns=1):
    """A periodic table as a function of an angle."""
    rows, span = sorted(rows), TURN * turns
    x, y = np.array([(a + k * span, v) for k in (-1, 0, 1) for a, v in rows]).T
    smooth = PchipInterpolator(x, y)
    return lambda angle: smooth(rows[0][0] + np.mod(angle - rows[0][0], span))


def four_bar(angle, a=CRANK, b=COUPLER, c=ROCKER, foot=FOOT, tip=complex(0.06, 0.05)):
    """Tip of the coupler, angles of coupler and rocker, at angles of the crank."""
    pin = a * np.exp(1j * np.asarray(angle))
    way = foot - pin
    far = np.abs(way)
    along = (b * b - c * c + far * far) / (2 * far)
    top = pin + way / far * (along + 1j * np.sqrt(b * b - along * along))
    coupler = np.angle(top - pin)
    return pin + tip * np.exp(1j * coupler), coupler, np.angle(top - foot)


def worked(loads, angle, places, turns=1):
    """U(angle) - U(angle[0]) of tables; `places(angle)`: what each load moves, along its direction."""
    fine = np.linspace(angle.min() - 0.1, angle.max() + 0.1, 40_001)
    middle = 0.5 * (fine[1:] + fine[:-1])
    moved = zip(loads, places(fine), strict=True)
    steps = sum(curve(rows, turns)(middle) * np.diff(place) for rows, place in moved)
    done = np.interp(angle, fine, np.concatenate([[0.0], np.cumsum(steps)]))
    return done - done[0]


def four_bar_works(angle, push=PUSH, twist=TWIST, lean=LEAN, turns=1, **sizes):
    """Work of the force at the four-bar's tip and of the torque on its rocker, at angles of its crank."""

    def places(fine):
        tip, _, rocker = four_bar(fine, **sizes)
        return (tip * np.exp(-1j * lean)).real, np.unwrap(rocker)

    return worked((push, twist), angle, places, turns)


# ---- scenes --------------------------------------------------------------------------------------------


def drive(kind, way, start, body="crank"):
    """A drive, its angle as a function of time, and where it starts; a free one has none."""
    rate = way * TURN / SECONDS
    if kind == "constant":
        return {"kind": "constant-speed", "body": body, "speed": rate}, lambda t: start + rate * t
    if kind == "harmonic":
        phase = 0.4 if way > 0 else math.pi + 0.4
        swing = {"amplitude": 2.5, "frequency": 1 / SECONDS, "mean": start - 2.5 * math.sin(phase)}
        made = {"kind": "harmonic", "body": body, "phase": phase, **swing}
        return made, lambda t: swing["mean"] + 2.5 * np.sin(abs(rate) * t + phase)
    if kind == "table":

        def given(t):
            return start + way * (TURN * t / SECONDS + 0.4 * np.sin(TURN * t / SECONDS))

        times = np.linspace(0.0, SECONDS, 181)
        rows = [[float(t), float(given(t))] for t in times]
        return {"kind": "table", "body": body, "angle": rows}, given
    assert kind == "torque"
    torque = [[angle, 2.0 + value] for angle, value in TWIST]
    made = {"kind": "torque", "body": body, "torque": torque, "initial_speed": TURN / SECONDS}
    return {**made, "flywheel_inertia": 0.5}, None


def bar(length, start, **more):
    """A slender bar of steel, light enough to be of no account."""
    return {
        "length": float(length),
        "mass": 0.1,
        "inertia": 1e-4,
        "start_angle": float(start),
        **more,
    }


def pin(journal, bearing, clearance=0.0):
    """A pin between two places."""
    kind = (
        {"kind": "clearance", "clearance": clearance, **SURFACES}
        if clearance
        else {"kind": "revolute"}
    )
    return {**kind, "journal": journal, "bearing": bearing}


def scene_of(bodies, joints, drives, loads, ground, *, revolutions=1, **numerics):
    """A scene without gravity or friction; stiff contacts are damped, so that little rattles."""
    clearance = any(joint["kind"] == "clearance" for joint in joints.values())
    return planar_scene(
        bodies, joints, drives, ground=ground, loads=loads,
        effects={"contact": {"law": "hunt-crossley", "damping": 5.0}} if clearance else {},
        numerics={
            "rtol": 1e-6, "method": "tsitouras", "transient_revolutions": 0,
            "averaged_revolutions": revolutions, **numerics,
        },
        output={"instants_per_revolution": 120},
    )  # fmt: skip


def bars(start, clearance, a=CRANK, b=COUPLER, c=ROCKER, foot=FOOT, tip=complex(0.06, 0.05)):
    """Bodies, joints and ground of the four-bar, its crank at an angle."""
    _, coupler, rocker = four_bar(start, a, b, c, foot, tip)
    bodies = {
        "crank": bar(a, start),
        "coupler": bar(b, coupler, points={"tip": [tip.real, tip.imag]}),
        "rocker": bar(c, rocker),
    }
    joints = {
        "o1": pin("crank.a", "ground.o"),
        "o2": pin("crank.b", "coupler.a", clearance),
        "o3": pin("coupler.b", "rocker.b"),
        "o4": pin("rocker.a", "ground.p"),
    }
    return bodies, joints, {"o": [0.0, 0.0], "p": [foot.real, foot.imag]}


def pushed(push=PUSH, twist=TWIST, lean=LEAN):
    """The four-bar's loads."""
    force = {"kind": "force", "place": "coupler.tip", "size": [*map(list, push)], "direction": lean}
    return {
        "push": force,
        "twist": {"kind": "torque", "body": "rocker", "torque": [*map(list, twist)]},
    }


def linkage(kind, way, start, clearance, **more):
    """The four-bar under its loads, and its drive's angle over time."""
    made, angle = drive(kind, way, start)
    bodies, joints, ground = bars(start, clearance)
    return scene_of(bodies, joints, {"motor": made}, pushed(), ground, **more), angle


def closes(response, right, clearance=0.0, largest_load=90.0):
    """The loads have done at every instant what virtual work says, up to the clearance and the sums over 120 instants."""
    assert int(response["status"]) == 0
    found, largest = response["load_work"].to_numpy(), np.abs(right).max()
    assert largest > 0.3  # J, or nothing is compared
    room = 1e-3 * largest + 20 * clearance * largest_load
    np.testing.assert_allclose(found, right, rtol=0, atol=room)
    assert float(np.abs(response["energy_residual"]).max()) < 1e-3 * largest


# ---- one machine, five starts, both ways round, every drive --------------------------------------------


@pytest.mark.parametrize("clearance", [0.0, CLEARANCE], ids=["ideal", "clearance"])
@pytest.mark.parametrize("way", WAYS, ids=["ccw", "cw"])
@pytest.mark.parametrize("kind", ["constant", "harmonic", "table"])
@pytest.mark.shortened(4)
def test_loads_are_taken_at_the_angle_of_the_drive_s_body(kind, way, clearance):
    for start in STARTS:
        scene, given = linkage(kind, way, start, clearance)
        response = simulate(scene)
        angle = given(response["time"].to_numpy())
        closes(response, four_bar_works(angle), clearance)


@pytest.mark.parametrize("start", STARTS)
@pytest.mark.shortened(2)
def test_a_free_body_s_torque_and_loads_too_and_its_revolution_is_a_whole_turn(start):
    scene, _ = linkage("torque", 1, start, CLEARANCE, revolutions=2)
    response = simulate(scene)
    angle = response["crank_angle"].to_numpy()
    assert angle[[0, -1]] == pytest.approx([start, start + 2 * TURN], abs=1e-9)
    closes(response, four_bar_works(angle), CLEARANCE)
    right = worked([[(a, 2.0 + value) for a, value in TWIST]], angle, lambda fine: (fine,))
    np.testing.assert_allclose(response["driving_work"], right, rtol=0, atol=1e-4)


# ---- bodies whose angle is not read off easily ---------------------------------------------------------


RADIUS, PIVOT, TILT = 0.06, complex(0.02, 0.01), 0.6


def on_its_line(angle):
    """Distance along a line through 0 in a direction at which it meets the circle that a lever's end makes."""
    along = (PIVOT * np.exp(-1j * np.asarray(angle))).real
    return along + np.sqrt(RADIUS**2 - abs(PIVOT) ** 2 + along**2)


@pytest.mark.parametrize("clearance", [0.0, CLEARANCE], ids=["ideal", "clearance"])
@pytest.mark.shortened(1)
def test_a_driven_body_that_a_slide_holds_at_an_angle_has_its_own(clearance):
    """A block on a carrier that it turns, its line 0.6 rad off the carrier's axis; a lever leads it."""
    for start, way in zip(STARTS, (1, -1, 1, -1, 1), strict=True):
        distance = float(on_its_line(start))
        lever = np.angle(distance * np.exp(1j * start) - PIVOT)
        bodies = {
            "carrier": bar(0.05, start - TILT),
            "block": {
                "mass": 0.1,
                "inertia": 1e-4,
                "points": {"pin": [0.0, 0.0]},
                "start_angle": start,
            },
            "lever": bar(RADIUS, lever),
        }
        joints = {
            "main": pin("carrier.a", "ground.o"),
            "line": {"kind": "slide", "point": "block.pin", "line": "carrier.a", "angle": TILT},
            "end": pin("lever.b", "block.pin", clearance),
            "foot": pin("lever.a", "ground.p"),
        }
        made, given = drive("constant", way, start, "block")
        push = {"kind": "force", "place": "lever.b", "size": [*map(list, PUSH)], "direction": LEAN}
        ground = {"o": [0.0, 0.0], "p": [PIVOT.real, PIVOT.imag]}
        response = simulate(scene_of(bodies, joints, {"motor": made}, {"push": push}, ground))
        angle = given(response["time"].to_numpy())
        right = worked(
            [PUSH], angle, lambda fine: ((on_its_line(fine) * np.exp(1j * (fine - LEAN))).real,)
        )
        closes(response, right, clearance)
        np.testing.assert_allclose(response["crank_angle"], angle, rtol=0, atol=1e-9)


@pytest.mark.parametrize("clearance", [0.0, CLEARANCE], ids=["ideal", "clearance"])
@pytest.mark.shortened(1)
def test_a_rotor_that_moves_nothing_gives_the_angle_all_the_same(clearance):
    """It gives the period, another drive turns the crank three times as fast: series of both go on from turn to turn."""
    for rotor, way, start in zip(STARTS, (1, -1, 1, -1, 1), reversed(STARTS), strict=True):
        bodies, joints, ground = bars(start, clearance)
        bodies["rotor"] = {
            "mass": 1.0,
            "inertia": 1e-3,
            "points": {"hub": [0.0, 0.0]},
            "start_angle": rotor,
        }
        joints["bearing"] = pin("rotor.hub", "ground.o")
        main, given = drive("constant", way, rotor, "rotor")
        drives = {"main": main, "motor": {**main, "body": "crank", "speed": 3 * main["speed"]}}
        scene = scene_of(
            bodies, joints, drives, pushed(twist=((0.0, 0.0), (1.0, 0.0))), ground, revolutions=2
        )
        response = simulate(scene)
        turned = given(response["time"].to_numpy()) - rotor

        def places(fine, rotor=rotor, start=start):
            tip = four_bar(start + 3 * (fine - rotor))[0]
            return ((tip * np.exp(-1j * LEAN)).real,)

        closes(response, worked([PUSH], rotor + turned, places), clearance)
        for body, angle in (("rotor", rotor + turned), ("crank", start + 3 * turned)):
            found = response["body_angle"].sel(body=body)
            np.testing.assert_allclose(found, angle, rtol=0, atol=1e-9)
        np.testing.assert_allclose(response["crank_angle"], rotor + turned, rtol=0, atol=1e-9)
        np.testing.assert_allclose(response["crank_speed"], main["speed"], rtol=1e-9)
        np.testing.assert_allclose(response["drive_phase"], abs(turned), rtol=0, atol=1e-9)


@pytest.mark.parametrize("clearance", [0.0, CLEARANCE], ids=["ideal", "clearance"])
@pytest.mark.shortened(1)
def test_of_two_turns_the_angle_itself_says_which_it_is(clearance):
    """The start angle begins the first turn, 360 deg more the second; clockwise the angle falls from there."""
    push = [*PUSH, *((angle + TURN, -2 * size) for angle, size in PUSH)]
    twist = [(2 * angle, size) for angle, size in TWIST]
    for way in WAYS:
        for start in (0.3, 0.3 + TURN, -4.0):
            made, given = drive("constant", way, start)
            bodies, joints, ground = bars(start, clearance)
            made["turns"] = 2
            response = simulate(
                scene_of(bodies, joints, {"motor": made}, pushed(push, twist), ground)
            )
            angle = given(response["time"].to_numpy())
            assert abs(angle[-1] - start) == pytest.approx(2 * TURN)
            closes(response, four_bar_works(angle, push, twist, turns=2), clearance, 180.0)
            np.testing.assert_allclose(response["crank_angle"], angle, rtol=0, atol=1e-9)


# ---- any four-bar --------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.shortened(6)
def test_random_four_bars_under_random_tables(seed):
    """Lengths by Grashof's condition, starts, ways round, drives and tables at random; every third with clearance."""
    rng = np.random.default_rng(seed)
    clearance = CLEARANCE if seed % 3 == 0 else 0.0
    a, (b, c), d = rng.uniform(0.02, 0.03), rng.uniform(0.06, 0.1, 2), rng.uniform(0.07, 0.09)
    while a + max(b, c, d) > 0.95 * (b + c + d - max(b, c, d)):
        b, c = rng.uniform(0.06, 0.1, 2)
    sizes = {
        "a": a, "b": b, "c": c, "foot": d * np.exp(1j * rng.uniform(0.2, 1.2)),
        "tip": complex(*rng.uniform(0.02, 0.06, 2)),
    }  # fmt: skip
    places = np.arange(4) * TURN / 4 + rng.uniform(0.0, 0.7, (2, 4))
    push = [(float(x), float(y)) for x, y in zip(places[0], rng.uniform(-150, 150, 4), strict=True)]
    twist = [(float(x), float(y)) for x, y in zip(places[1], rng.uniform(-5, 5, 4), strict=True)]
    start, way, lean = rng.uniform(-6, 6), int(rng.choice(WAYS)), rng.uniform(0.2, 1.4)
    made, given = drive(str(rng.choice(["constant", "harmonic", "table"])), way, start)
    bodies, joints, ground = bars(start, clearance, **sizes)
    scene = scene_of(bodies, joints, {"motor": made}, pushed(push, twist, lean), ground)
    response = simulate(scene.with_({"output.instants_per_revolution": 240}))
    angle = given(response["time"].to_numpy())
    closes(response, four_bar_works(angle, push, twist, lean, **sizes), clearance, 150.0)
    np.testing.assert_allclose(response["crank_angle"], angle, rtol=0, atol=2e-6)


# ---- series and what reads them ------------------------------------------------------------------------


@pytest.mark.parametrize("formulation", ["minimal", "baumgarte"])
@pytest.mark.shortened(1)
def test_series_of_the_driven_body_go_on_from_turn_to_turn(formulation):
    start = STARTS[2]
    scene, given = linkage("constant", -1, start, CLEARANCE, revolutions=2, formulation=formulation)
    response = simulate(scene)
    assert int(response["status"]) == 0
    time = response["time"].to_numpy()
    np.testing.assert_allclose(response["crank_angle"], given(time), rtol=0, atol=1e-6)
    np.testing.assert_allclose(
        response["body_angle"].sel(body="crank"), given(time), rtol=0, atol=1e-6
    )
    np.testing.assert_allclose(response["crank_speed"], -TURN / SECONDS, rtol=1e-6)
    np.testing.assert_allclose(response["body_spin"].sel(body="crank"), response["crank_speed"])
    # the other bodies are where geometry has them, in both turns
    tip = response[["point_x", "point_y"]].sel(point="coupler.tip")
    off = tip["point_x"] + 1j * tip["point_y"] - four_bar(given(time))[0]
    assert float(np.abs(off).max()) < 20 * CLEARANCE


def test_a_body_from_rest_may_be_thrown_back_wherever_it_starts():
    """By the first impacts in its joints, some degrees: counted from where it starts."""
    start = 2.0
    light = {
        f"mechanism.bodies.crank.{k}": v
        for k, v in (("mass", 1e-3), ("inertia", 1e-6), ("mass_center", 0.0))
    }
    turned = {
        "mechanism.bodies.crank.start_angle": start, "mechanism.bodies.rod.start_angle": start,
        "mechanism.bodies.slider.start_angle": start, "mechanism.joints.guide.angle": start,
        "mechanism.joints.crank_rod.clearance": 1e-3, "effects.gravity": 0.0,
        "mechanism.drives.motor": {**REST, "body": "crank"},
    }  # fmt: skip
    response = simulate(slider_crank_pair()[1].with_(light | turned))
    assert int(response["status"]) == 0
    assert float(response["crank_speed"].min()) < -100.0
    angle = response["crank_angle"].to_numpy()
    assert angle[-1] == pytest.approx(start + TURN, abs=1e-9)

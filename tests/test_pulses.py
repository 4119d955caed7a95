"""Short pulses in tables: the work of a load is the virtual work of the curve that is drawn, whatever the table goes by.

An engine without clearance: its speed follows from the load, its piston's place is known in closed form.
"""

import numpy as np
import pytest
from planar_scenes import planar_scene
from scipy.interpolate import PchipInterpolator

from hpcclear import simulate
from hpcclear.base.errors import InputError
from hpcclear.base.jit import FASTMATH
from hpcclear.base.lowering.compiled import Compiled
from hpcclear.base.lowering.values import kind_of
from hpcclear.base.pieces import breaks, level, periodic
from hpcclear.dynamics import layout
from hpcclear.dynamics.layout import curves as packing
from hpcclear.dynamics.linkage.elements import enter_table, look_up
from hpcclear.scene.driving import spline

TURN = 2 * np.pi
CRANK, ROD, INERTIA = 0.04, 0.145, 0.5
NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)


def engine(load, motor=None, **numerics):
    """Crank, rod and piston without clearance under one load, the crank at 200 degrees and 3000 rpm with a flywheel."""
    free = {
        "kind": "torque", "body": "crank", "torque": 0.0, "initial_speed": "3000 rpm", "flywheel_inertia": INERTIA,
    }  # fmt: skip
    return planar_scene(
        {
            "crank": {"length": CRANK, "mass": 0.9, "inertia": 6e-4, "mass_center": 0.0, "start_angle": "200 deg"},
            "rod": {"length": ROD, "mass": 0.55, "inertia": 1.9e-3, "mass_center": "48 mm"},
            "slider": {"mass": 0.35, "points": {"pin": [0, 0]}},
        },
        {
            "o1": {"kind": "revolute", "journal": "crank.a", "bearing": "ground.o"},
            "o2": {"kind": "revolute", "journal": "crank.b", "bearing": "rod.a"},
            "o3": {"kind": "revolute", "journal": "slider.pin", "bearing": "rod.b"},
            "way": {"kind": "slide", "point": "slider.pin", "line": "ground.o"},
        },
        {"motor": motor or free},
        loads={"gas": load},
        numerics={"transient_revolutions": 0, "averaged_revolutions": 1, **numerics},
    )  # fmt: skip


def gas(rows):
    """A force on the piston against +x, over the crank angle."""
    return {"kind": "force", "place": "slider.pin", "direction": "180 deg", "size": rows}


CONSTANT = {"kind": "constant-speed", "body": "crank", "speed": "3000 rpm"}


def cylinder(begin, width):
    """Force of a cylinder from the shaft to the piston by rows, m and N: a pulse of 20 J."""
    rise = 0.5e-3 * width
    rows = [[begin, 0.0], [begin + rise, 20.0 / rise], [begin + 2 * rise, 0.0]]
    return {"kind": "cylinder", "first": "slider.pin", "second": "ground.o", "force": rows}


def feels(rows, off, motor=None, **numerics):
    """The work of a table over the crank angle is its virtual work."""
    found = simulate(engine(gas(rows), motor, **numerics))
    angle = found["crank_angle"].to_numpy()
    turns = (motor or {}).get("turns", 1)
    assert angle[-1] - angle[0] == pytest.approx(turns * TURN)
    right = integral(rows, angle[0], angle[-1], turns * TURN, lever)
    assert abs(right) > 1.0
    assert float(found["load_work"][-1]) == pytest.approx(right, rel=off), rows[:4]


def feels_distance(load, off, scene):
    """The work of a cylinder is a function of the distance alone, at every instant."""
    found = simulate(scene)
    angle = found["crank_angle"].to_numpy()
    place = CRANK * np.cos(angle) + np.sqrt(ROD**2 - (CRANK * np.sin(angle)) ** 2)
    right = [straight(load["force"], place[0], one)[0] for one in place]
    assert np.ptp(right) == pytest.approx(20.0)
    np.testing.assert_allclose(
        found["load_work"], right, rtol=0, atol=off * 20.0, err_msg=str(load["force"])
    )


def lever(angle):
    """-dx/da of the piston: work of the force over the angle."""
    rise = CRANK * np.sin(angle)
    return rise + rise * CRANK * np.cos(angle) / np.sqrt(ROD**2 - rise**2)


def integral(rows, first, last, length, arm=np.ones_like, linear=False):
    """Integral of a table that repeats, times an arm, summed from row to row: no sum of ours."""
    if last < first:
        return -integral(rows, last, first, length, arm, linear)
    x, y = np.array(rows, float).T
    if x[-1] - x[0] > length * (1 - 1e-12):
        x, y = x[:-1], y[:-1]
    rounds = np.arange(np.floor(first / length) - 2, np.ceil(last / length) + 3)
    wide, high = (x + rounds[:, None] * length).ravel(), np.tile(y, len(rounds))
    curve = (lambda at: np.interp(at, wide, high)) if linear else PchipInterpolator(wide, high)
    edges = np.union1d(np.linspace(first, last, 60), wide[(wide > first) & (wide < last)])
    half = 0.5 * np.diff(edges)[:, None]
    at = edges[:-1, None] + half * (NODES + 1)
    return float((half * WEIGHTS * curve(at) * arm(at)).sum())


def pulse(kind, width, at, size=60_000.0):
    """Rows (deg, N) of a pulse that begins at an angle: triangle, rectangle, saw of five teeth, or a bell of 101 rows."""
    top = size / width
    if kind == "triangle":
        rows = [(at, 0), (at + width / 2, top), (at + width, 0)]
    elif kind == "rectangle":
        edge = 0.01 * width
        rows = [(at, 0), (at + edge, top / 2), (at + width - edge, top / 2), (at + width, 0)]
    elif kind == "saw":
        rows = [(at + width * k / 10, top * (k % 2)) for k in range(11)]
    else:
        share = np.linspace(0, 1, 101)
        rows = [(at + width * s, top * np.sin(np.pi * s) ** 2) for s in share]
    return [[float(np.radians(a)), float(v)] for a, v in [(0, 0), *rows, (350, 0)]]


KINDS = ("triangle", "rectangle", "saw", "bell")
WIDTHS = (30.0, 10.0, 3.0, 1.0, 0.3)  # deg


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.shortened(2)
def test_work_of_a_pulse_is_its_virtual_work(kind):
    for number, width in enumerate(WIDTHS):
        at = (5.0, 100.0, 203.0, 307.3, 61.7)[(number + KINDS.index(kind)) % 5]
        rows = pulse(kind, width, at)
        for rtol, off in ((1e-6, 1e-2), (1e-10, 1e-6)):
            feels(rows, off, rtol=rtol)


def test_the_peak_of_one_degree_is_felt():
    """The flywheel's family: 8.963, 4.622, 3.021 and 2.559 J of peaks of 30, 10, 3 and 1 degrees."""
    for width, right in ((30.0, 8.963), (10.0, 4.622), (3.0, 3.021), (1.0, 2.559)):
        found = simulate(engine(gas(pulse("triangle", width, 5.0))))
        assert float(found["load_work"][-1]) == pytest.approx(right, abs=2e-3)


@pytest.mark.parametrize("interpolation", ["smooth", "linear"])
def test_a_pulse_over_the_time_gives_a_wheel_its_momentum(interpolation):
    """Of a wheel the momentum is the area of the pulse, wherever it stands, also within what would be the first step."""
    places = (2.001, 2.0, 1e-3), (2.0, 0.0301, 3e-5), (3600.0, 0.05, 1e-4), (2.0, 0.0, 1e-6)
    for length, begin, width in places:
        rows = [[begin, 0.0], [begin + width / 2, -4.0 / width], [begin + width, 0.0]]
        rows = [[0.0, 0.0], *rows] if begin else rows
        rows += [[length, 0.0]] if begin + width < length else []
        load = {"kind": "torque", "body": "wheel", "torque_by_time": rows}
        scene = wheel(load, interpolation, 3 if begin < 1 else 105)
        by = "minimal" if begin < 1 else "baumgarte"  # the axes of the pin are apart
        found = simulate(scene.with_({"numerics.formulation": by}))
        speed = found["crank_speed"].to_numpy()
        assert speed[-1] - speed[0] == pytest.approx(-2.0 / 1e-2, rel=1e-5)  # area over inertia


def wheel(load, interpolation="smooth", revolutions=2, motor=None):
    """A wheel that turns freely, fast enough to get over the pulse."""
    free = {"kind": "torque", "body": "wheel", "torque": 0.0, "initial_speed": 320.0}
    return planar_scene(
        {"wheel": {"mass": 1.0, "inertia": 1e-2, "points": {"o": [0.0, 0.0]}}},
        {"pin": {"kind": "revolute", "journal": "wheel.o", "bearing": "ground.o"}},
        {"motor": motor or free},
        loads={"jam": load},
        numerics={
            "transient_revolutions": 0, "averaged_revolutions": revolutions, "interpolation": interpolation,
        },
        output={"instants_per_revolution": 36},
    )  # fmt: skip


def test_prescribed_motions_feel_them_too():
    """At a constant speed nothing is integrated in steps; the work is a sum between instants."""
    for kind in KINDS:
        for width in (3.0, 0.3, 0.03):
            feels(pulse(kind, width, 100.1), 1e-6, CONSTANT)
    for begin, width in ((0.13, 3.0), (0.151, 0.3), (0.1123, 0.01)):
        load = cylinder(begin, width)
        feels_distance(load, 1e-5, engine(load, CONSTANT))


# ---- curves ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("interpolation", ["smooth", "linear"])
def test_means_are_those_of_the_curve_that_acts(interpolation):
    rng = np.random.default_rng(3)
    for turns in (1, 2):
        x = np.sort(rng.uniform(-TURN, TURN * (turns - 1), 9))
        rows = tuple(zip(x, rng.normal(size=9), strict=True))
        right = integral(rows, 0.0, TURN * turns, TURN * turns, linear=interpolation == "linear")
        mean = periodic(rows, TURN * turns, interpolation).mean()
        assert mean == pytest.approx(right / TURN / turns, abs=1e-12)


def looked_up(table, curve, shares):
    """What the kernel reads at places (n,), shares of a curve's length."""
    lanes, head = np.zeros(layout.BANK), table[packing.HEAD * curve :][: packing.HEAD]
    found = []
    repeats, intervals = head[packing.REPEATS], head[packing.INTERVALS]
    row, real, whole = kind_of((lanes, 1.0, 1)).parts
    enter = Compiled(enter_table, [row, whole, *[real] * 4, whole, whole], FASTMATH)
    look = Compiled(look_up, [row, row, whole, whole], FASTMATH)
    for share in shares:
        enter(lanes, curve, share, 0.0, repeats, intervals, 0, 1)
        look(lanes, table, curve, 1)
        found.append(lanes[layout.CURVES + curve])
    return np.array(found)


def test_any_table_is_found_by_the_kernel_s_search():
    """Even rows, random ones, ones that double their distance, ones in a thousandth of the length."""
    rng = np.random.default_rng(5)
    places = [
        np.linspace(0.0, 1.0, 721),
        np.sort(rng.uniform(0.0, 1.0, 40)),
        2.0 ** -np.arange(40.0, -1.0, -1.0),
        np.concatenate([[0.0], 0.4 + 1e-3 * np.sort(rng.uniform(0, 1, 50)), [0.9]]),
    ]
    rows = [tuple(zip(x, np.append(rng.normal(size=len(x) - 1), 0.0), strict=True)) for x in places]
    rows = [((r[0][0], 0.0), *r[1:]) for r in rows]
    curves = [periodic(one, 1.0) for one in rows] + [level(one) for one in rows]
    table = packing.packed(curves, [breaks(curve, 1e-4) for curve in curves])
    halvings = table[: packing.HEAD * layout.MAX_CURVES].reshape(-1, packing.HEAD)[
        :, packing.HALVINGS
    ]
    assert 0 < np.count_nonzero(halvings) < len(curves)
    for number, curve in enumerate(curves):
        edges = np.concatenate([curve.starts, np.arange(4096) / 4096])
        near = np.concatenate(
            [edges, edges + 1e-9, edges + 3e-16, edges - 3e-16, rng.uniform(0, 1, 200)]
        )
        near = near[(near >= 0.0) & (near < 1.0)]
        expected = curve.at(near * curve.length)
        np.testing.assert_allclose(looked_up(table, number, near), expected, rtol=0, atol=1e-9)


def test_steps_end_where_no_cubic_follows():
    """At each row of a pulse, at few of a smooth curve however many rows it has, at none of a constant."""
    degrees = np.array([0.0, 5.0, 5.5, 6.0, 350.0])
    rows = tuple(zip(np.radians(degrees), (0.0, 0.0, 6e4, 0.0, 0.0), strict=True))
    ends = np.degrees(breaks(periodic(rows, TURN), 1e-4) * TURN)
    assert {5.0, 5.5, 6.0} <= set(np.round(ends, 9))
    counts = []
    for n in (360, 7200):
        x = np.linspace(0.0, TURN, n, endpoint=False)
        counts.append(
            len(breaks(periodic(tuple(zip(x, np.exp(np.cos(x)), strict=True)), TURN), 1e-4))
        )
    assert max(counts) < 30
    assert len(breaks(periodic(((0.0, 2.0), (1.0, 2.0)), TURN), 1e-4)) == 0
    cam = tuple((float(t), float(np.sin(TURN * t))) for t in np.linspace(0, 1, 73))
    assert len(breaks(spline(cam).derivative().derivative(), 1e-4)) < 60


# ---- other variables and other steppers --------------------------------------------------------------


def test_of_two_turns_a_pulse_stands_in_one():
    """A table of 720 degrees whose pulse is in the second turn."""
    motor = {
        "kind": "torque", "body": "crank", "torque": 0.0, "initial_speed": "3000 rpm", "flywheel_inertia": INERTIA,
        "turns": 2,
    }  # fmt: skip
    for width in WIDTHS[2:]:
        rows = pulse("triangle", width, 5.0)
        feels([[0.0, 0.0], *([a + TURN, v] for a, v in rows[1:])], 1e-2, motor)


def test_a_pulse_over_another_body_s_angle():
    """The rod's angle is -asin(CRANK sin(a)/ROD): it passes the pulse on its way up and on its way down."""
    for width in WIDTHS[1:]:
        rows = [
            [float(np.radians(a)), v]
            for a, v in ((0, 0), (2, 0), (2 + width / 2, 900.0 / width), (2 + width, 0))
        ]
        load = {"kind": "torque", "body": "rod", "angle_of": "rod", "torque": rows}
        found = simulate(engine(load, rtol=1e-8))
        rod = found["body_angle"].sel(body="rod").to_numpy()
        right = np.array([integral(rows, rod[0], one, TURN) for one in rod[::40]])
        work = found["load_work"].to_numpy()[::40]
        largest = np.abs(right).max()
        assert largest > 1.0
        np.testing.assert_allclose(work, right, rtol=0, atol=1e-3 * largest)


def straight(rows, first, last):
    """Integrals of a table that is straight between its rows and level beyond, and of its reciprocal, from row to row."""
    x, y = np.array(rows, float).T
    edges = np.union1d([first, last], x[(x > min(first, last)) & (x < max(first, last))])
    width, value = np.diff(edges) * np.sign(last - first), np.interp(edges, x, y)
    a, b = value[:-1], value[1:]
    with np.errstate(all="ignore"):
        slowness = np.where(a == b, 1.0 / a, np.log(b / a) / (b - a))
    return float((width * 0.5 * (a + b)).sum()), float((width * slowness).sum())


@pytest.mark.parametrize("method", ["auto", pytest.param("radau", marks=pytest.mark.nightly)])
def test_a_pulse_over_a_distance_does_the_work_of_its_area(method):
    """A cylinder from the shaft to the piston: its work is a function of the distance alone, after every step."""
    for number, width in enumerate((10.0, 3.0, 1.0, 0.3, 0.1, 0.01)):
        load = cylinder((0.13, 0.151, 0.1123, 0.17, 0.12, 0.16)[number], width)
        for rtol, off in ((1e-6, 1e-2), (1e-10, 1e-6)) if method == "auto" else ((1e-6, 1e-2),):
            scene = engine(load, rtol=rtol, method=method)
            ends_of_steps = scene.with_({"output.instants_per_revolution": 0})
            feels_distance(load, off, ends_of_steps)


def test_a_dip_over_the_speed_takes_its_time():
    """Of a wheel the time from one speed to another is the integral of inertia over torque.

    At rtol 1e-6 speeds are known to 4e-4 rad/s: narrow dips are passed in parts.
    """
    for number, width in enumerate((10.0, 1.0, 0.1, 0.01)):
        begin = (335.0, 333.3, 361.0, 340.01)[number]
        rows = [[300.0, 8.0], [begin, 8.0], [begin + width / 2, 0.8], [begin + width, 8.0]]
        drive = {"kind": "torque", "body": "wheel", "torque_by_speed": rows, "initial_speed": 320.0}
        scene = wheel(
            {"kind": "torque", "body": "wheel", "torque": 0.0}, motor=drive, revolutions=4
        )
        for rtol, off in ((1e-6, 1e-3), (1e-10, 1e-4)):
            found = simulate(scene.with_({"numerics.rtol": rtol}))
            speed, time = found["crank_speed"].to_numpy(), found["time"].to_numpy()
            right = 1e-2 * straight(rows, speed[0], speed[-1])[1]
            plain = 1e-2 * (speed[-1] - speed[0]) / 8.0
            assert speed[-1] > begin + width
            assert time[-1] - time[0] - plain == pytest.approx(right - plain, rel=off), (
                width,
                rtol,
            )


@pytest.mark.parametrize("interpolation", ["smooth", "linear"])
def test_a_jump_is_one_however_near_its_rows_stand(interpolation):
    """A load that is switched on and off again, drawn by two rows each: over the angle, over the time, in a long table."""
    for number, width in enumerate((1e-4, 1e-8, 1e-10, 1e-11, 1e-12, 1e-14)):
        for on, off in (((0.2, 0.5), (1.0, 1.3), (3.7, 5.2))[number % 3], (0.0, 1.0)):
            rows = [[on, 3000.0], [off, 3000.0], [off + width, 0.0], [6.0, 0.0]]
            rows = [[0.0, 0.0], [on, 0.0], [on + width, 3000.0], *rows[1:]] if on else rows
            found = simulate(engine(gas(rows), interpolation=interpolation, rtol=1e-8))
            angle = found["crank_angle"].to_numpy()
            near = max(width, 1e-9)  # what PCHIP can be given
            drawn = [[0, 0], [on, 0], [on + near, 3e3], [off, 3e3], [off + near, 0], [6, 0]]
            linear = interpolation == "linear"
            right = integral(drawn[2 * (on == 0.0) :], angle[0], angle[-1], TURN, lever, linear)
            assert float(found["load_work"][-1]) == pytest.approx(right, rel=1e-4), (width, on)
        for length in (0.02, 6.0, 3600.0):
            rows = [
                [0.0, 0.0],
                [0.003, 0.0],
                [0.003 + width, -40.0],
                [0.013, -40.0],
                [0.013 + width, 0.0],
                [length, 0.0],
            ]
            load = {"kind": "torque", "body": "wheel", "torque_by_time": rows}
            speed = simulate(wheel(load, interpolation, 3))["crank_speed"].to_numpy()
            assert speed[-1] - speed[0] == pytest.approx(-40.0, rel=1e-4), (width, length)


def test_rows_too_near_for_steps_to_end_between_them_are_refused():
    """Of tables over a speed or distance, whose places are the motion's and rounded."""
    for kind, unit in (("torque_by_speed", 1.0), ("force", 0.1)):
        for near, refused in ((1e-6, False), (1e-12, True)):
            rows = [
                [unit, 8.0],
                [1.5 * unit, 8.0],
                [1.5 * unit + near * unit, 2.0],
                [2.0 * unit, 2.0],
            ]
            drive = {
                "kind": "torque",
                "body": "crank",
                "initial_speed": 9.0,
                "torque_by_speed": rows,
            }
            load = {"kind": "cylinder", "first": "slider.pin", "second": "ground.o", "force": rows}
            made = (gas(5.0), drive) if kind == "torque_by_speed" else (load,)
            if refused:
                with pytest.raises(InputError, match="nearer to each other"):
                    engine(*made)
            else:
                engine(*made)


@pytest.mark.nightly
@pytest.mark.parametrize(
    "numerics", [{"formulation": "baumgarte"}, {"method": "radau"}], ids=["baumgarte", "radau"]
)
def test_other_steppers_feel_them_too(numerics):
    for kind in KINDS:
        for width in (10.0, 1.0):
            feels(pulse(kind, width, 5.0), 1e-2, **numerics)

"""What is compiled: an effect that is off leaves no trace in the code, and the bare scene is as lean as by hand.

Every row of the kernel's buffers stands at a constant offset, so the source of a motion shows which parameters and state
rows it reads, and the emitted LLVM (with W = 1) which of them are used. The coefficient of an effect has a row of its own,
and its offset is the marker: code that never reads the gravity row does not compute gravity. Tabulated curves have a
constant of their own, 1/(2 pi).
"""

import math
import re
import struct
from dataclasses import replace

import numpy as np
import pytest
from linkages import slider_crank
from numba import njit, types
from some_laws import CONTACT, FRICTION, STIFFNESS, effects_with, row

from hpcclear.base.jit import FASTMATH, lane_function
from hpcclear.base.one_text import one_text, text_of
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout.curves import packed
from hpcclear.dynamics.linkage.linkage import Linkage
from hpcclear.dynamics.linkage.parts import (
    Bending,
    ConstantSpeed,
    Force,
    GuideFriction,
    TorqueDrive,
)
from hpcclear.dynamics.physics.angles import sincos
from hpcclear.laws import laws

pytestmark = pytest.mark.nightly

FLAT = types.float64[::1]
BARE = {"crank_rod", "rod_slider"}
PER_TURN = f"0x{struct.unpack('>Q', struct.pack('>d', 0.5 / math.pi))[0]:016X}"
FRICTIONS = {"coulomb", "ambrosio", "lugre", "short_film", "long_film", "finite_film"}


def linkage_with(on):
    """A slider-crank with these effects on."""
    drive, loads = ConstantSpeed("motor", "crank", 40.0), ()
    if "torque" in on:
        falls = 90.0 if "torque_falls" in on else None
        table = "torque_table" in on
        drive = TorqueDrive("motor", "crank", 3.0, 40.0, table=table, no_load_speed=falls)
    if on & {"load", "load_table"}:
        loads = (Force("load", "slider.pin", (-4.0, 0.0), "load_table" in on),)
    opened = [pin for pin, flag in (("o12", "crank_rod"), ("o23", "rod_slider")) if flag in on]
    friction = GuideFriction(0.1, 0.2) if "guide" in on else None
    made = slider_crank(*opened, drive=drive, friction=friction, loads=loads)
    bodies = [replace(body, start_angle=0.0) for body in made.bodies]
    if "bending" in on:
        bodies[1] = replace(bodies[1], bending=Bending(1, 300.0, 0.02))
    return Linkage(
        replace(made, bodies=tuple(bodies)), gravity="gravity" in on, friction=bool(on & FRICTIONS),
        cartesian="baumgarte" in on, follow="slider", bristled="lugre" in on, waves="waves" in on,
        places=tuple(k for k, flag in enumerate(("crank_rod", "rod_slider")) if flag in on),
    )  # fmt: skip


def flags_of(on, linkage):
    """What of them the kernel's own functions read."""
    places = linkage.places
    known = on & {*at.Effects._fields, *CONTACT, *FRICTION}
    models = [name for name in laws("film") if f"{name}_film" in on]
    films = tuple(models[0] if models and k in places else None for k in range(at.MAX_JOINTS))
    return effects_with(known, joints=len(places), first=next(iter(places), 0), films=films)


def compiled(function, *argument_types):
    """Emitted LLVM and assembly of one specialisation, compiled here and now."""
    dispatcher = njit(
        error_model="numpy", fastmath=FASTMATH, no_cpython_wrapper=True, no_cfunc_wrapper=True
    )(function)
    dispatcher.compile(argument_types)
    return dispatcher.inspect_llvm(argument_types), dispatcher.inspect_asm(argument_types)


def motion_with(on):
    """The kernel's right-hand side with these effects on, its flags, and the names of its own parameters by their rows."""
    linkage = linkage_with(on)
    flags = flags_of(on, linkage)
    names = {row: name for name, row in linkage.rows.items()}
    return linkage.module(flags).accelerations, flags, names


def compiled_motion(on, W=1):
    """Emitted LLVM and assembly of it, and those names."""
    accelerations, flags, names = motion_with(on)
    text = one_text(accelerations, f"looked_at_{W}", effects=flags, W=W)
    return *compiled(text, FLAT, FLAT, FLAT), names


def par(row):
    return ("par", row)


def work(row):
    return ("work", row)


def of_joints(*rows):
    return {par(joint.block + row) for joint in at.JOINTS[:2] for row in rows}


def numbers_of(law, kind="friction"):
    """Rows of a law's numbers in both joints."""
    return of_joints(*(row(kind, law, name) for name in laws(kind)[law].read))


FIRST, SECOND = at.JOINTS[:2]
DAMPED = numbers_of("hunt-crossley", "contact") - numbers_of("hertz", "contact")
FILMS = of_joints(at.FILM_SCALE, at.FILM_FLOOR, at.FILM_SHEAR)

# effect: what is on besides it and the bare scene, and the markers of its law
MARKERS = {
    "crank_rod": (
        set(),
        {par(FIRST.block + at.CLEARANCE), par(FIRST.block + STIFFNESS)},
    ),
    "rod_slider": (
        set(),
        {par(SECOND.block + at.CLEARANCE), par(SECOND.block + STIFFNESS)},
    ),
    "fixed": (set(), DAMPED),
    "latched": (set(), {work(at.INVERSE_IMPACT), work(at.ACTIVE + 1)}),
    "coulomb": (set(), numbers_of("coulomb")),
    "ambrosio": (set(), numbers_of("ambrosio") - numbers_of("coulomb")),
    "torque": (set(), {par("motor_torque")}),
    "torque_table": ({"torque"}, {("constant", PER_TURN)}),
    "torque_falls": ({"torque"}, {par("motor_fall")}),
    "gravity": (set(), {par("gravity")}),
    "load": (set(), {par("load_force_x")}),
    "load_table": (set(), {par("load_force_x"), ("constant", PER_TURN)}),
    "guide": (set(), {par("guide_coefficient"), par("guide_inverse_ramp")}),
    "baumgarte": (set(), {par("alpha2"), par("beta2")}),
    "energies": (set(), {work(at.RATE_NOW + at.DRIVE_POWER), work(at.RATE_NOW + at.DISSIPATION)}),
    "series": (set(), {work(at.RATE_NOW + at.FRICTIONS), work(at.RATE_NOW + at.DRIVE_MOMENT)}),
    "responses": (
        set(),
        {work(at.RATE_NOW + at.FOLLOWED_SQUARE), work(at.RATE_NOW + at.DRIVE_MOMENT)},
    ),
    "wear": (
        set(),
        {work(at.RATE_NOW + joint.sliding_power) for joint in (FIRST, SECOND)},
    ),
    "threshold": ({"wear"}, {par(at.THRESHOLDS), par(at.THRESHOLDS + 3)}),
    "bearing_waves": ({"waves"}, {par(at.WAVES), par(at.WAVES + 7)}),
    "profile": (
        {"waves", "bearing_waves", "wear"},
        {work(at.RATE_NOW + at.ANGLES), work(at.RATE_NOW + at.ANGLES + 5)},
    ),
    "short_film": (set(), FILMS),
    "finite_film": (set(), FILMS | {par(FIRST.further), par(SECOND.further + at.FURTHER_ROWS - 1)}),
    "lugre": (set(), numbers_of("lugre") - numbers_of("ambrosio")),
    "bending": (set(), {par("rod_bend_stiffness_1"), par("rod_bend_lateral_1")}),
    "long_film": (set(), FILMS),
}
# rows that an effect shares with another: not its own marker
SHARED = {
    "latched": DAMPED,
    "ambrosio": numbers_of("coulomb"),
    "lugre": numbers_of("ambrosio"),
    **dict.fromkeys(("short_film", "long_film", "finite_film"), FILMS),
}


DROPPED = {"latched", "baumgarte"}
"""Effects whose text has rows that nothing uses, or whose rows others have so: the compiler drops them."""


def read_in_text(on):
    """Rows of the buffers that the source of a motion names, and the constant of its curves: no compiler is asked."""
    accelerations, flags, names = motion_with(on)
    text = text_of(accelerations, "looked_at", {"effects": flags, "W": 16})
    rows = re.findall(r"\b(par|work)\w*\[(\d+)(?: \+ \w+)?\]", text)
    found = {(name, named(name, int(number) // 16, names)) for name, number in rows}
    return found | ({("constant", PER_TURN)} if str(0.5 / math.pi) in text else set())


def named(buffer, row, names):
    return names.get(row, row) if buffer == "par" else row


def read_in_code(on):
    """The same of the compiled code."""
    llvm, _, names = compiled_motion(on)
    found = {("constant", constant) for constant in re.findall(r"0x[0-9A-F]{16}", llvm)}
    pattern = r"getelementptr (?:inbounds |nuw )*(i8|double), ptr %arg\.(par|work)\.4, i64 (\d+)"
    for element, name, offset in re.findall(pattern, llvm):
        row = int(offset) // (8 if element == "i8" else 1)
        found.add((name, named(name, row, names)))
    return found


@pytest.mark.parametrize("effect", MARKERS)
def test_a_law_is_in_the_code_when_on_and_not_when_off(effect):
    with_, markers = MARKERS[effect]
    read = read_in_code if effect in DROPPED else read_in_text
    on = BARE | with_ | {effect}
    seen = read(on)
    assert markers <= seen
    assert not markers & read((BARE | with_) - {effect})
    for other, (_, others) in MARKERS.items():
        if other not in on | (set() if effect in DROPPED else DROPPED):
            assert not (others - markers - SHARED.get(effect, set())) & seen, other


ROW = linkage_with(BARE).rows
CRANK, NEAR, FAR, SPEED, MASS, INERTIA, SLIDER = (
    ROW[name]
    for name in (
        "crank_a_b_x", "rod_a_center_x", "rod_center_b_x", "motor_speed", "rod_inverse_mass",
        "rod_inverse_inertia", "slider_inverse_mass",
    )
)  # fmt: skip
BLOCK, OTHER = FIRST.block, SECOND.block


def hertz_by_hand(work, par, W):
    """Two clearances, Hertz's law, nothing else: written for this test alone, straight down."""
    for i in range(W):
        phi = par[SPEED * W + i] * work[at.STAGE_TIME * W + i]
        s, c = sincos(phi)
        st, ct = sincos(work[(at.QS + 2) * W + i])
        crank, near, far = (
            par[CRANK * W + i],
            par[NEAR * W + i],
            par[FAR * W + i],
        )
        omega, spin = par[SPEED * W + i], work[(at.VS + 2) * W + i]
        x, y = work[at.QS * W + i], work[(at.QS + 1) * W + i]
        vx, vy = work[at.VS * W + i], work[(at.VS + 1) * W + i]
        ex, ey = crank * c - (x - near * ct), crank * s - (y - near * st)
        ux, uy = (
            -crank * omega * s - (vx + near * spin * st),
            crank * omega * c - (vy - near * spin * ct),
        )
        inverse = 1.0 / math.sqrt(ex * ex + ey * ey + 1e-300)
        nx, ny = ex * inverse, ey * inverse
        gap = (ex * ex + ey * ey + 1e-300) * inverse - par[(BLOCK + at.CLEARANCE) * W + i]
        depth = 0.5 * (gap + abs(gap))
        force = par[(BLOCK + STIFFNESS) * W + i] * (depth * math.sqrt(depth))
        fx, fy = force * nx, force * ny
        work[(at.RATE_NOW + at.GAP) * W + i] = gap
        work[(at.RATE_NOW + at.FORCE) * W + i] = force
        work[(at.RATE_NOW + at.GAP_RATE) * W + i] = ux * nx + uy * ny
        ex, ey = work[(at.QS + 3) * W + i] - (x + far * ct), -(y + far * st)
        ux, uy = work[(at.VS + 3) * W + i] - (vx - far * spin * st), -(vy + far * spin * ct)
        inverse = 1.0 / math.sqrt(ex * ex + ey * ey + 1e-300)
        nx, ny = ex * inverse, ey * inverse
        gap = (ex * ex + ey * ey + 1e-300) * inverse - par[(OTHER + at.CLEARANCE) * W + i]
        depth = 0.5 * (gap + abs(gap))
        force = par[(OTHER + STIFFNESS) * W + i] * (depth * math.sqrt(depth))
        gx, gy = force * nx, force * ny
        work[(at.RATE_NOW + at.GAP + 1) * W + i] = gap
        work[(at.RATE_NOW + at.FORCE + 1) * W + i] = force
        work[(at.RATE_NOW + at.GAP_RATE + 1) * W + i] = ux * nx + uy * ny
        moment = near * (st * fx - ct * fy) + far * (ct * gy - st * gx)
        work[at.ACC * W + i] = (fx + gx) * par[MASS * W + i]
        work[(at.ACC + 1) * W + i] = (fy + gy) * par[MASS * W + i]
        work[(at.ACC + 2) * W + i] = moment * par[INERTIA * W + i]
        work[(at.ACC + 3) * W + i] = -gx * par[SLIDER * W + i]


def vector_loops(assembly):
    """Instructions of every loop that is one block and takes square roots of vectors."""
    loops, label, body = [], None, []
    for line in assembly.splitlines():
        text = line.split("#")[0].strip()
        if match := re.fullmatch(r"(\.?L\w+):", text):
            label, body = match[1], []
        elif text and not text.startswith("."):
            body.append(text)
            if re.match(rf"(j\w+|b\.\w+|cbnz\s+\w+,)\s+{re.escape(label or '-')}$", text):
                loops.append(body)
    packed = re.compile(r"v?sqrtpd|fsqrt\s+v")
    return [loop for loop in loops if any(packed.match(text) for text in loop)]


def test_the_bare_scene_costs_what_a_kernel_by_hand_costs():
    """Instructions of the vectorised loop over lanes; both programs have the same arithmetic to do."""
    W = 32
    by_hand_motion = lane_function(hertz_by_hand)

    def by_hand(work, par):
        by_hand_motion(work, par, W)

    (hand,) = vector_loops(compiled(by_hand, FLAT, FLAT)[1])
    (ours,) = vector_loops(compiled_motion(BARE, W)[1])
    arithmetic = [sum("mov" not in line for line in loop) for loop in (ours, hand)]
    assert arithmetic[0] <= 1.03 * arithmetic[1]
    # With sixteen registers chance decides how much is put away: 298 beside 289.
    assert len(ours) <= 1.06 * len(hand)


def test_the_kernel_by_hand_computes_the_same():
    """Without this the comparison above would mean nothing."""
    rng = np.random.default_rng(2)
    W = 4
    mine, hers = np.zeros((2, at.WORK * W))
    values = np.abs(rng.normal(size=at.PARAMETERS * W)) + 0.1
    given = {name: values[row * W : (row + 1) * W] for name, row in ROW.items()}
    for name, derived in given.items():
        if not name.isidentifier():  # worked out from the others
            derived[:] = eval(name, {}, given)
    mine[:] = hers[:] = rng.normal(size=at.WORK * W)
    njit(hertz_by_hand)(mine, values, W)
    linkage = linkage_with(BARE)
    effects = flags_of(BARE, linkage)
    accelerations = linkage.module(effects).accelerations
    text = one_text(accelerations, f"compared_{W}", effects=effects, W=W)
    njit(text)(hers, values, packed((), ()))
    written = slice(at.ACC * W, (at.RATE_NOW + at.GAP_RATE + 1 + 1) * W)
    np.testing.assert_allclose(mine[written], hers[written], rtol=1e-11, atol=1e-11)
    np.testing.assert_array_equal(mine[: at.ACC * W], hers[: at.ACC * W])

"""What is compiled: an effect that is off leaves no trace in the code, and the bare scene is as lean as by hand.

Every row of the kernel's buffers stands at a constant offset, so the source of a motion shows which parameters and state
rows it reads, and the emitted LLVM (with W = 1) which of them are used. The coefficient of an effect has a row of its own,
and its offset is the marker: code that never reads the gravity row does not compute gravity. Tabulated curves have a
constant of their own, 1/(2 pi).
"""

import math
import re
import struct

import numpy as np
import pytest
from numba import njit, types
from some_laws import STIFFNESS, effects_with, row

from hpcclear.base.jit import FASTMATH, lane_function
from hpcclear.base.one_text import one_text, text_of
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.laws import laws
from hpcclear.dynamics.linkage.rhs import written_by
from hpcclear.dynamics.physics.angles import sincos

FLAT = types.float64[::1]
BARE = {"crank_rod", "rod_slider"}
PER_TURN = f"0x{struct.unpack('>Q', struct.pack('>d', 0.5 / math.pi))[0]:016X}"


def compiled(function, *argument_types):
    """Emitted LLVM and assembly of one specialisation, compiled here and now."""
    dispatcher = njit(
        error_model="numpy", fastmath=FASTMATH, no_cpython_wrapper=True, no_cfunc_wrapper=True
    )(function)
    dispatcher.compile(argument_types)
    return dispatcher.inspect_llvm(argument_types), dispatcher.inspect_asm(argument_types)


def compiled_motion(effects, W=1):
    """The kernel's right-hand side with these effects on."""

    flags = effects_with(effects)
    text = one_text(written_by(flags).accelerations, f"looked_at_{W}", effects=flags, W=W)
    return compiled(text, FLAT, FLAT, FLAT)


def par(row):
    return ("par", row)


def work(row):
    return ("work", row)


def rubbing(law):
    """Rows of a friction law's numbers in both joints."""
    names = laws("friction")[law].read
    blocks = (at.JOINT_12, at.JOINT_23)
    return {par(block + row("friction", law, name)) for block in blocks for name in names}


DAMPING = row("contact", "hunt-crossley", "damping")

# effect: what is on besides it and the bare scene, and the markers of its law
MARKERS = {
    "crank_rod": (
        set(),
        {par(at.JOINT_12 + at.CLEARANCE), par(at.JOINT_12 + STIFFNESS)},
    ),
    "rod_slider": (
        set(),
        {par(at.JOINT_23 + at.CLEARANCE), par(at.JOINT_23 + STIFFNESS)},
    ),
    "fixed": (set(), {par(at.JOINT_12 + DAMPING)}),
    "latched": (set(), {work(at.INVERSE_IMPACT), work(at.ACTIVE + 1)}),
    "coulomb": (set(), rubbing("coulomb")),
    "ambrosio": (set(), rubbing("ambrosio") - rubbing("coulomb")),
    "torque": (set(), {par(at.TORQUE), par(at.CRANK_INERTIA)}),
    "torque_table": ({"torque"}, {("constant", PER_TURN)}),
    "torque_falls": ({"torque"}, {par(at.TORQUE_FALL)}),
    "gravity": (set(), {par(at.GRAVITY)}),
    "load": (set(), {par(at.LOAD)}),
    "load_table": (set(), {par(at.LOAD), ("constant", PER_TURN)}),
    "guide": (set(), {par(at.GUIDE_COEFFICIENT), par(at.GUIDE_INVERSE_RAMP)}),
    "baumgarte": (set(), {par(at.BAUMGARTE_ALPHA2), par(at.BAUMGARTE_BETA2)}),
    "ledger": (set(), {work(at.RATE_NOW + at.DRIVE_POWER), work(at.RATE_NOW + at.DISSIPATION)}),
    "series": (set(), {work(at.RATE_NOW + at.FRICTIONS), work(at.RATE_NOW + at.DRIVE_MOMENT)}),
    "responses": (
        set(),
        {work(at.RATE_NOW + at.FOLLOWED_SQUARE), work(at.RATE_NOW + at.DRIVE_MOMENT)},
    ),
    "wear": (
        set(),
        {work(at.RATE_NOW + joint.sliding_power) for joint in (at.O12, at.O23)},
    ),
    "threshold": ({"wear"}, {par(at.THRESHOLDS), par(at.THRESHOLDS + 3)}),
    "bearing_waves": ({"waves"}, {par(at.WAVES), par(at.WAVES + 7)}),
    "profile": (
        {"waves", "bearing_waves", "wear"},
        {work(at.RATE_NOW + at.ANGLES), work(at.RATE_NOW + at.ANGLES + 5)},
    ),
    "film": (
        {"short_film"},
        {
            par(base + row)
            for base in (at.JOINT_12, at.JOINT_23)
            for row in (at.FILM_FLOOR, at.FILM_SHEAR)
        },
    ),
    "short_film": ({"film"}, {par(at.JOINT_12 + at.FILM_SHORT), par(at.JOINT_23 + at.FILM_SHORT)}),
    "finite_film": (
        {"film"},
        {
            par(at.JOINT_12 + at.FILM_FINITE),
            par(at.O12.finite),
            par(at.O23.finite + at.FINITE_ROWS - 1),
        },
    ),
    "lugre": (set(), rubbing("lugre") - rubbing("ambrosio")),
    "bending": (set(), {par(at.BENDING), par(at.BENDING + 3)}),
    "long_film": ({"film"}, {par(at.JOINT_12 + at.FILM_LONG), par(at.JOINT_23 + at.FILM_LONG)}),
}
# rows that an effect shares with another: not its own marker
SHARED = {
    "latched": {par(at.JOINT_12 + DAMPING)},
    "ambrosio": rubbing("coulomb"),
    "lugre": rubbing("ambrosio"),
    "series": set(),
    "film": {par(at.JOINT_12 + at.FILM_SHORT), par(at.JOINT_23 + at.FILM_SHORT)},
    "baumgarte": set(),
}


DROPPED = {"latched", "short_film", "long_film", "baumgarte"}
"""Effects whose text has rows that nothing uses, or whose rows others have so: the compiler drops them."""


def read_in_text(effects):
    """Rows of the buffers that the source of a motion names, and the constant of its curves: no compiler is asked."""
    flags, W = effects_with(effects), 16
    text = text_of(written_by(flags).accelerations, "looked_at", {"effects": flags, "W": W})
    found = re.findall(r"\b(par|work)\w*\[(\d+)(?: \+ \w+)?\]", text)
    rows = {(name, int(number) // W) for name, number in found}
    return rows | ({("constant", PER_TURN)} if str(0.5 / math.pi) in text else set())


def read_in_code(effects):
    """The same of the compiled code."""
    return traces(compiled_motion(effects)[0])


def traces(llvm):
    """Rows of the buffers that the code touches, and its floating constants."""
    found = {("constant", constant) for constant in re.findall(r"0x[0-9A-F]{16}", llvm)}
    pattern = r"getelementptr (?:inbounds |nuw )*(i8|double), ptr %arg\.(par|work)\.4, i64 (\d+)"
    for element, name, offset in re.findall(pattern, llvm):
        found.add((name, int(offset) // (8 if element == "i8" else 1)))
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


def hertz_by_hand(work, par, W):
    """Two clearances, Hertz's law, nothing else: written for this test alone, straight down."""
    for i in range(W):
        phi = par[at.SPEED * W + i] * work[at.STAGE_TIME * W + i]
        s, c = sincos(phi)
        st, ct = sincos(work[(at.QS + 2) * W + i])
        crank, near, far = (
            par[at.CRANK_LENGTH * W + i],
            par[at.ROD_NEAR * W + i],
            par[at.ROD_FAR * W + i],
        )
        omega, spin = par[at.SPEED * W + i], work[(at.VS + 2) * W + i]
        x, y = work[at.QS * W + i], work[(at.QS + 1) * W + i]
        vx, vy = work[at.VS * W + i], work[(at.VS + 1) * W + i]
        ex, ey = crank * c - (x - near * ct), crank * s - (y - near * st)
        ux, uy = (
            -crank * omega * s - (vx + near * spin * st),
            crank * omega * c - (vy - near * spin * ct),
        )
        inverse = 1.0 / math.sqrt(ex * ex + ey * ey + 1e-300)
        nx, ny = ex * inverse, ey * inverse
        gap = (ex * ex + ey * ey + 1e-300) * inverse - par[(at.JOINT_12 + at.CLEARANCE) * W + i]
        depth = 0.5 * (gap + abs(gap))
        force = par[(at.JOINT_12 + STIFFNESS) * W + i] * (depth * math.sqrt(depth))
        fx, fy = force * nx, force * ny
        work[(at.RATE_NOW + at.GAP_12) * W + i] = gap
        work[(at.RATE_NOW + at.FORCE_12) * W + i] = force
        work[(at.RATE_NOW + at.RATE_12) * W + i] = ux * nx + uy * ny
        ex, ey = work[(at.QS + 3) * W + i] - (x + far * ct), -(y + far * st)
        ux, uy = work[(at.VS + 3) * W + i] - (vx - far * spin * st), -(vy + far * spin * ct)
        inverse = 1.0 / math.sqrt(ex * ex + ey * ey + 1e-300)
        nx, ny = ex * inverse, ey * inverse
        gap = (ex * ex + ey * ey + 1e-300) * inverse - par[(at.JOINT_23 + at.CLEARANCE) * W + i]
        depth = 0.5 * (gap + abs(gap))
        force = par[(at.JOINT_23 + STIFFNESS) * W + i] * (depth * math.sqrt(depth))
        gx, gy = force * nx, force * ny
        work[(at.RATE_NOW + at.GAP_23) * W + i] = gap
        work[(at.RATE_NOW + at.FORCE_23) * W + i] = force
        work[(at.RATE_NOW + at.RATE_23) * W + i] = ux * nx + uy * ny
        moment = near * (st * fx - ct * fy) + far * (ct * gy - st * gx)
        work[at.ACC * W + i] = (fx + gx) * par[at.INV_ROD_MASS * W + i]
        work[(at.ACC + 1) * W + i] = (fy + gy) * par[at.INV_ROD_MASS * W + i]
        work[(at.ACC + 2) * W + i] = moment * par[at.INV_ROD_INERTIA * W + i]
        work[(at.ACC + 3) * W + i] = -gx * par[at.INV_SLIDER_MASS * W + i]


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
    mine[:] = hers[:] = rng.normal(size=at.WORK * W)
    njit(hertz_by_hand)(mine, values, W)
    effects = effects_with(BARE)
    text = one_text(written_by(effects).accelerations, f"compared_{W}", effects=effects, W=W)
    njit(text)(hers, values, np.zeros(at.TABLES))
    written = slice(at.ACC * W, (at.RATE_NOW + at.RATE_23 + 1) * W)
    np.testing.assert_allclose(mine[written], hers[written], rtol=1e-11, atol=1e-11)
    np.testing.assert_array_equal(mine[: at.ACC * W], hers[: at.ACC * W])

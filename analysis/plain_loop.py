"""The yardstick: the same mechanics and method as a plain compiled loop, one sample after the other.

Tsitouras' pair, the same tolerances, error norm, step control, impact location and fastmath flags as
the package, written the way one writes an integrator in Numba: arrays of first-order states, loops over
stages, library sines, branches. Two open joints, constant crank speed, Coulomb friction; contact by
Hunt-Crossley, or by Lankarani-Nikravesh with the impact speed latched.
"""

import math

import numpy as np
from numba import njit
from scenes import scene

from hpcclear.base.arrays import Array
from hpcclear.base.jit import FASTMATH
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.planar.problem import linkage_of
from hpcclear.dynamics.stepping.explicit.tableau import TSITOURAS
from hpcclear.laws import laws

STATES = 10  # rod x, y, angle, slider x, their rates, integrals of both | |e| - c |
# numbers of the laws that it has
STIFFNESS = at.CONTACT_NUMBERS + laws("contact")["hunt-crossley"].read.index("stiffness")
COEFFICIENT = at.FRICTION_NUMBERS
MOST_STEPS = 100_000
"""Of a revolution; a usual one takes 400. At loose tolerances a step that is cut at an impact can shrink to nothing."""
OUTPUTS = ("objective", "slider_position", "slider_velocity", "evaluations", "steps", "status")

FIRST, SECOND = (joint.block for joint in at.JOINTS[:2])
NUMBERS = (
    "crank_a_b_x", "rod_a_center_x", "rod_center_b_x", "rod_mass", "rod_inertia", "slider_mass",
)  # fmt: skip
CRANK, NEAR, FAR, ROD_MASS, ROD_INERTIA, SLIDER_MASS = (
    linkage_of(scene("hunt-crossley", 1e-6, 0, 1))._given[name] for name in NUMBERS
)
"""Rows of the mechanism's numbers, the same in all scenes of the benchmarks."""

_C = TSITOURAS.a.sum(axis=1)
_A, _B, _E = TSITOURAS.a, TSITOURAS.b, TSITOURAS.e
_compiled = njit(error_model="numpy", fastmath=FASTMATH, cache=True)


@_compiled
def joint(p, base, latched, active, inverse_impact, ex, ey, vx, vy, spin_journal, spin_bearing):
    """Gap, its rate, force on the bearing (x, y), moments on bearing and journal."""
    distance = math.sqrt(ex * ex + ey * ey)
    gap = distance - p[base + at.CLEARANCE]
    nx, ny = 0.0, 0.0
    if distance > 0.0:
        nx, ny = ex / distance, ey / distance
    rate = vx * nx + vy * ny
    if gap <= 0.0 or (latched and not active):
        return gap, rate, 0.0, 0.0, 0.0, 0.0
    factor = 1.0 + p[base + at.DAMPING] * rate * (inverse_impact if latched else 1.0)
    normal = max(p[base + STIFFNESS] * gap * math.sqrt(gap) * factor, 0.0)
    arm_bearing = p[base + at.BEARING_RADIUS] + 0.5 * gap
    arm_journal = p[base + at.JOURNAL_RADIUS] - 0.5 * gap
    sliding = vy * nx - vx * ny + spin_journal * arm_journal - spin_bearing * arm_bearing
    ramp = min(max(sliding * p[base + at.INVERSE_RAMP], -1.0), 1.0)
    tangential = normal * p[base + COEFFICIENT] * ramp
    fx, fy = normal * nx - tangential * ny, normal * ny + tangential * nx
    return gap, rate, fx, fy, arm_bearing * tangential, -arm_journal * tangential


@_compiled
def motion(t, y, dy, p, latched, active, inverse_impact, gaps):
    """Time derivatives `dy` of the first eight states; `gaps` gets both gaps, then both gap rates."""
    phi, omega = p[at.SPEED] * t, p[at.SPEED]
    sphi, cphi = math.sin(phi), math.cos(phi)
    st, ct = math.sin(y[2]), math.cos(y[2])
    near, far, crank = p[NEAR], p[FAR], p[CRANK]
    spin = y[6]
    gap1, rate1, fx1, fy1, mb1, _ = joint(
        p, FIRST, latched, active[0], inverse_impact[0],
        crank * cphi - (y[0] - near * ct), crank * sphi - (y[1] - near * st),
        -crank * omega * sphi - (y[4] + near * spin * st),
        crank * omega * cphi - (y[5] - near * spin * ct), omega, spin,
    )  # fmt: skip
    gap2, rate2, fx2, fy2, mb2, _ = joint(
        p, SECOND, latched, active[1], inverse_impact[1],
        y[3] - (y[0] + far * ct), -(y[1] + far * st),
        y[7] - (y[4] - far * spin * st), -(y[5] + far * spin * ct), 0.0, spin,
    )  # fmt: skip
    moment = near * (st * fx1 - ct * fy1) + far * (ct * fy2 - st * fx2) + mb1 + mb2
    for k in range(4):
        dy[k] = y[4 + k]
    dy[4] = (fx1 + fx2) / p[ROD_MASS]
    dy[5] = (fy1 + fy2) / p[ROD_MASS]
    dy[6] = moment / p[ROD_INERTIA]
    dy[7] = -fx2 / p[SLIDER_MASS]
    gaps[0], gaps[1], gaps[2], gaps[3] = gap1, gap2, rate1, rate2


@_compiled
def rates(t, y, dy, p, latched, active, inverse_impact, gaps):
    """Time derivatives `dy` of all states."""
    motion(t, y, dy, p, latched, active, inverse_impact, gaps)
    dy[8], dy[9] = abs(gaps[0]), abs(gaps[1])


@_compiled
def first_impact(h, old, new, active, tolerance):
    """Fraction of the step at which a journal in flight strikes, by the cubic through both ends; 2 if none does."""
    first = 2.0
    for j in range(2):
        if active[j] or new[j] <= tolerance:
            continue
        d0, d1, m0, m1 = old[j], new[j], h * old[2 + j], h * new[2 + j]
        low, high = 0.0, 1.0
        for _ in range(50):
            s = 0.5 * (low + high)
            value = d0 + s * (
                m0 + s * (3.0 * (d1 - d0) - 2.0 * m0 - m1 + s * (2.0 * (d0 - d1) + m0 + m1))
            )
            if value > 0.5 * tolerance:
                high = s
            else:
                low = s
            if high - low < 1e-14:
                break
        first = min(first, high)
    return first


@_compiled
def error_norm(h, k, y, new, rtol, atol, period, p):
    """Mean square of the scaled error over coordinates, velocities, and the two integrals."""
    total = 0.0
    for i in range(STATES):
        error = 0.0
        for s in range(7):
            error += _E[s] * k[s, i]
        if i < 8:
            scale = atol[i] + rtol * max(abs(y[i]), abs(new[i]))
        else:
            scale = rtol * period * p[(FIRST if i == 8 else SECOND) + at.CLEARANCE]
        total += (h * error / scale) ** 2
    return total / 8.0


@_compiled
def simulate(
    p, start, active, inverse_impact, rtol, atol, transient, averaged, latched, floor, out
):
    """One sample, `transient` + `averaged` revolutions; fills `out` as `OUTPUTS`."""
    period = p[at.PERIOD]
    tolerance = max(0.1 * atol[0], 4e-15)
    y, new, k = start.copy(), np.empty(STATES), np.empty((7, STATES))
    old_gaps, gaps = np.empty(4), np.empty(4)
    h, last_log, evaluations, steps = p[at.FIRST_STEP], 0.0, 1, 0
    rates(0.0, y, k[0], p, latched, active, inverse_impact, old_gaps)
    for revolution in range(transient + averaged):
        t = 0.0
        if revolution == transient:
            y[8], y[9] = 0.0, 0.0
        while t < period:
            steps += 1
            if h < 1e-14 * (t + h) or steps > MOST_STEPS * (revolution + 1):
                out[5] = 1.0
                return
            ending = 1.01 * h >= period - t
            step = period - t if ending else h
            for s in range(1, 7):
                for i in range(STATES):
                    change = 0.0
                    for j in range(s):
                        change += _A[s, j] * k[j, i]
                    new[i] = y[i] + step * change
                rates(t + _C[s] * step, new, k[s], p, latched, active, inverse_impact, gaps)
            evaluations += 6
            error = error_norm(step, k, y, new, rtol, atol, period, p)
            log = 0.5 * math.log2(max(error, 1e-20))
            if not error <= 1.0:
                h = step * 2.0 ** max(-0.152 - 0.2 * log, -2.32)
                continue
            struck = False
            if latched:
                fraction = first_impact(step, old_gaps, gaps, active, tolerance)
                if fraction < 1.0 - 1e-12:
                    h = fraction * step
                    continue
                for j in range(2):
                    if not active[j] and abs(gaps[j]) <= tolerance and gaps[2 + j] > 0.0:
                        active[j], inverse_impact[j] = True, 1.0 / max(gaps[2 + j], floor)
                        struck = True
                    elif active[j] and gaps[j] < 0.0:
                        active[j] = False
            growth = 2.0 ** min(max(-0.152 - 0.17 * log + 0.04 * last_log, -2.32), 3.32)
            h = max(step * growth, h) if ending else step * growth
            last_log = max(log, -13.3)
            t = period if ending else t + step
            for i in range(STATES):
                y[i] = new[i]
                k[0, i] = k[6, i]
            old_gaps[:] = gaps
            if struck:
                rates(t, y, k[0], p, latched, active, inverse_impact, old_gaps)
                evaluations += 1
    time = averaged * period
    out[0] = math.sqrt((y[8] / time) ** 2 + (y[9] / time) ** 2)
    out[1], out[2], out[3], out[4], out[5] = y[3], y[7], evaluations, steps, 0.0


@_compiled
def simulate_all(par, state, rtol, atol, transient, averaged, latched, floor):
    """Samples one after the other: parameters (m, PARAMETERS), start states; returns (m, outputs)."""
    out = np.full((len(par), 6), np.nan)
    for m in range(len(par)):
        start = np.zeros(STATES)
        start[:4], start[4:8] = state[m, :4], state[m, at.MAX_COORDINATES :][:4]
        simulate(
            par[m], start, np.zeros(2, np.bool_), np.zeros(2), rtol, atol, transient, averaged,
            latched, floor, out[m],
        )  # fmt: skip
    return out


def run(
    par: Array,
    state: Array,
    rtol: float,
    atol: tuple[float, ...],
    revolutions: tuple[int, int],
    latched: bool,
    floor: float = 1e-3,
) -> Array:
    """Samples as the kernel reads them (rows of parameters and of starts), one row of `OUTPUTS` each.

    Parameters
    ----------
    par, state : ndarray, shapes (m, PARAMETERS) and (m, STATE)
    rtol : float
    atol : tuple of 8 floats
    revolutions : (transient, averaged)
    latched : bool
        Lankarani-Nikravesh with the impact speed latched; else Hunt-Crossley.
    floor : float
        Least latched impact speed, m/s.
    """
    return simulate_all(par, state, rtol, np.array(atol), *revolutions, latched, floor)

"""Radau IIA of order 5 for a batch of eight samples: stages by simplified Newton, error estimate, integrals over a step.

The columns of a row are samples, and each stage has rows of its own. m is the memory of such eight (`memory`), n the number of
coordinates. What is done for some of the eight is chosen number by number, so that none depends on its neighbours.
"""

import math

from hpcclear.base.eight import above, fetch, put, size, spread
from hpcclear.base.jit import lane_function, scalar_function
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.rhs import run_motion, run_observed
from hpcclear.dynamics.stepping.control import measure, place
from hpcclear.dynamics.stepping.implicit import memory as mem, radau as rad
from hpcclear.dynamics.stepping.implicit.control import MAX_ITERATIONS, begin_iteration, rate_of
from hpcclear.dynamics.stepping.implicit.inverses import invert_complex, invert_real
from hpcclear.dynamics.stepping.implicit.kinks import kink_functions
from hpcclear.dynamics.stepping.implicit.memory import ALL_KINKS, COLUMNS, STAGES, N

RELATIVE = 1.5e-8  # of a difference: square root of the round-off


@lane_function
def number(m, flat):
    """One of the numbers of `memory`, of all eight."""
    return fetch(m, flat // COLUMNS)


@lane_function
def most(a, b):
    """The larger of two, number by number."""
    return above(a - b, a, b)


@lane_function
def least(a, b):
    """The smaller of two, number by number."""
    return above(b - a, a, b)


@scalar_function
def start_of_step(moved, m):
    """Evaluate the start of the step."""
    put(m, at.STAGE_TIME, number(m, mem.TIME))
    for k in range(moved.n):
        put(m, at.QS + k, fetch(m, at.Q + k))
        put(m, at.VS + k, fetch(m, at.V + k))
    run_observed(moved.observing, moved.motion, m, moved.tables)


@lane_function
def put_stage(n, m, s):
    """Time, coordinates and velocities of stage s, from the increments of the velocities."""
    h = number(m, mem.STEP)
    put(m, at.STAGE_TIME, number(m, mem.TIME) + rad.NODES[s] * h)
    for k in range(n):
        v, z = fetch(m, at.V + k), mem.Z + k
        total = rad.MATRIX[s, 0] * fetch(m, z) + rad.MATRIX[s, 1] * fetch(m, z + N)
        total = total + rad.MATRIX[s, 2] * fetch(m, z + 2 * N)
        put(m, at.VS + k, v + fetch(m, z + s * N))
        put(m, at.QS + k, fetch(m, at.Q + k) + h * (rad.NODES[s] * v + total))


@scalar_function
def evaluate_stages(moved, m):
    """Accelerations at the three stages."""
    for s in range(STAGES):
        put_stage(moved.n, m, s)
        run_motion(moved.motion, m, moved.tables)
        for k in range(moved.n):
            put(m, mem.STAGE_ACC + s * N + k, fetch(m, at.ACC + k))


@lane_function
def add_rate(m, row, rate, weight, first):
    """Add a rate, weighted, to the sum of a row."""
    value = weight * fetch(m, at.RATE_NOW + rate)
    put(m, row, value if first else fetch(m, row) + value)


@scalar_function
def observe_stages(effects, moved, m, integrated):
    """`evaluate_stages`, and the kink functions there; if `integrated` the means over the step of what is integrated."""
    rules = effects.rules
    for s in range(STAGES):
        put_stage(moved.n, m, s)
        run_observed(moved.observing, moved.motion, m, moved.tables)
        for k in range(moved.n):
            put(m, mem.STAGE_ACC + s * N + k, fetch(m, at.ACC + k))
        kink_functions(rules, m, mem.STAGE_KINKS + s * ALL_KINKS)
        if integrated:
            for joint in range(rules.begin, rules.end):
                gap = at.GAP + place(joint)
                add_rate(m, mem.MEAN + gap, gap, rad.MATRIX[2, s], s == 0)
                add_rate(m, mem.GAP_ERROR + place(joint), gap, rad.ERROR_BY_MATRIX[s], s == 0)
            for r in range(len(effects.measures)):
                rate = measure(effects, r)
                add_rate(m, mem.MEAN + rate, rate, rad.MATRIX[2, s], s == 0)


@scalar_function
def guess(n, m):
    """First guess of the stages where it is requested: the polynomial of the step before, or of the longer try from the same
    start; without either, the velocities at the start."""
    asked = fetch(m, mem.ASKED)
    old, h = number(m, mem.POLYNOMIAL_STEP), number(m, mem.STEP)
    after = above(number(m, mem.CONTINUES), spread(1.0), spread(0.0))
    ratio = h / above(old, old, h)
    for k in range(n):
        row = mem.Z + k
        z0, z1, z2 = fetch(m, row), fetch(m, row + N), fetch(m, row + 2 * N)
        for s in range(STAGES):
            w0, w1, w2 = rad.weights_at(after + rad.NODES[s] * ratio)
            found = w0 * z0 + w1 * z1 + (w2 - after) * z2
            found = above(old, found, spread(0.0))
            put(m, row + s * N, above(asked, found, fetch(m, row + s * N)))
    decouple(n, m)


@scalar_function
def guess_from_start(n, m):
    """First guess of the stages where it is requested: the accelerations at the start."""
    asked, h = fetch(m, mem.ASKED), number(m, mem.STEP)
    for k in range(n):
        a = h * fetch(m, mem.START + k)
        for s in range(STAGES):
            row = mem.Z + s * N + k
            put(m, row, above(asked, rad.NODES[s] * a, fetch(m, row)))
    decouple(n, m)


@scalar_function
def decouple(n, m):
    """The increments at the stages, decoupled."""
    for k in range(n):
        z = mem.Z + k
        z0, z1, z2 = fetch(m, z), fetch(m, z + N), fetch(m, z + 2 * N)
        for s in range(STAGES):
            row = mem.TRANSFORMED + s * N + k
            first, second = rad.T_INVERSE[s, 0] * z0, rad.T_INVERSE[s, 1] * z1
            put(m, row, first + second + rad.T_INVERSE[s, 2] * z2)


@lane_function
def difference(moved, m, row, unit, column):
    """Column of the Jacobian that belongs to a row of the stage's state: from accelerations at a displaced state."""
    before = fetch(m, row)
    by = RELATIVE * most(size(before), unit)
    by = before + least(by, number(m, mem.REACH) * unit)
    put(m, row, by)
    inverse = 1.0 / (by - before)
    run_motion(moved.motion, m, moved.tables)
    put(m, row, before)
    for r in range(moved.n):
        change = fetch(m, at.ACC + r) - fetch(m, mem.STAGE_ACC + N + r)
        put(m, column + r * N, change * inverse)


@scalar_function
def new_jacobian(moved, m):
    """Partial derivatives of the accelerations at the middle stage, where they are known, by coordinates and velocities."""
    put_stage(moved.n, m, mem.MIDDLE)
    for k in range(moved.n):
        difference(moved, m, at.QS + k, fetch(m, mem.LEAST + k), mem.BY_Q + k)
        difference(moved, m, at.VS + k, fetch(m, mem.LEAST + N + k), mem.BY_V + k)


@scalar_function
def make_inverses(n, m):
    """Inverses of the real and the complex systems of the step."""
    h = number(m, mem.STEP)
    square = rad.MU_RE * rad.MU_RE + rad.MU_IM * rad.MU_IM
    for r in range(n):
        for c in range(n):
            i = r * N + c
            by_q, less = fetch(m, mem.BY_Q + i), spread(0.0) - fetch(m, mem.BY_V + i)
            real, re = less - (h * (1.0 / rad.MU)) * by_q, less - (h * (rad.MU_RE / square)) * by_q
            im = (h * (rad.MU_IM / square)) * by_q
            if r == c:
                real, re, im = real + rad.MU / h, re + rad.MU_RE / h, im + rad.MU_IM / h
            put(m, mem.REAL + i, real)
            put(m, mem.COMPLEX_RE + i, re)
            put(m, mem.COMPLEX_IM + i, im)
    invert_real(n, m, mem.REAL)
    invert_complex(n, m, mem.COMPLEX_RE, mem.COMPLEX_IM)


@lane_function
def residuals(n, m, inverse):
    """What is left of the decoupled equations, to mem.CHANGE; `inverse`: of the step."""
    lam, re, im = rad.MU * inverse, rad.MU_RE * inverse, rad.MU_IM * inverse
    for k in range(n):
        f, w, change = mem.STAGE_ACC + k, mem.TRANSFORMED + k, mem.CHANGE + k
        f0, f1, f2 = fetch(m, f), fetch(m, f + N), fetch(m, f + 2 * N)
        w0, w1, w2 = fetch(m, w), fetch(m, w + N), fetch(m, w + 2 * N)
        r0 = rad.T_INVERSE[0, 0] * f0 + rad.T_INVERSE[0, 1] * f1 + rad.T_INVERSE[0, 2] * f2
        r1 = rad.T_INVERSE[1, 0] * f0 + rad.T_INVERSE[1, 1] * f1 + rad.T_INVERSE[1, 2] * f2
        r2 = rad.T_INVERSE[2, 0] * f0 + rad.T_INVERSE[2, 1] * f1 + rad.T_INVERSE[2, 2] * f2
        put(m, change, r0 - lam * w0)
        put(m, change + N, r1 - (re * w1 - im * w2))
        put(m, change + 2 * N, r2 - (re * w2 + im * w1))


@lane_function
def solved(n, m, r):
    """Coordinate r of the three decoupled changes, from what is left of their equations."""
    x, y, z = spread(0.0), spread(0.0), spread(0.0)
    for k in range(n):
        i, change = r * N + k, mem.CHANGE + k
        c0, c1, c2 = fetch(m, change), fetch(m, change + N), fetch(m, change + 2 * N)
        re, im = fetch(m, mem.COMPLEX_RE + i), fetch(m, mem.COMPLEX_IM + i)
        x = x + c0 * fetch(m, mem.REAL + i)
        y = y + c1 * re - c2 * im
        z = z + c2 * re + c1 * im
    return x, y, z


@scalar_function
def correct(n, m):
    """One correction of simplified Newton where it is requested; its size relative to the tolerance to mem.NOW, squared and
    times 3 n."""
    asked = fetch(m, mem.ASKED)
    h = number(m, mem.STEP)
    residuals(n, m, 1.0 / h)
    total = spread(0.0)
    for r in range(n):
        x, y, z = solved(n, m, r)
        by_q = (h * (1.0 / rad.MU)) * fetch(m, mem.INVERSE_SCALE + r)
        by_v = fetch(m, mem.INVERSE_SCALE + N + r)
        total = total + (by_v * by_v + by_q * by_q) * (x * x + y * y + z * z)
        row = mem.TRANSFORMED + r
        w0, w1, w2 = fetch(m, row) + x, fetch(m, row + N) + y, fetch(m, row + 2 * N) + z
        put(m, row, w0)
        put(m, row + N, w1)
        put(m, row + 2 * N, w2)
        for s in range(STAGES):
            found, z_row = rad.T[s, 0] * w0 + rad.T[s, 1] * w1 + rad.T[s, 2] * w2, mem.Z + s * N + r
            put(m, z_row, above(asked, found, fetch(m, z_row)))
    put(m, mem.NOW, total)


@scalar_function
def take_in(n, m, iteration):
    """What the last correction says of each column that requested it: whether it goes on, and how many iterations it took.
    Returns how many columns go on."""
    going = 0
    for i in range(COLUMNS):
        if m[mem.ASKED * COLUMNS + i] == 1.0:
            change = math.sqrt(m[mem.NOW * COLUMNS + i] / (3.0 * n))
            before = m[mem.CHANGE_BEFORE * COLUMNS + i]
            iterations = rate_of(m, i, iteration, change, before)
            m[mem.ITERATIONS * COLUMNS + i] = iterations
            m[mem.CHANGE_BEFORE * COLUMNS + i] = max(change, 1e-300)
            if iterations != 0:
                m[mem.ASKED * COLUMNS + i] = 0.0
            else:
                going += 1
    return going


@scalar_function
def newton(moved, m):
    """Solve for the stages of all columns that require it, whose first guess was evaluated (mem.ITERATIONS)."""
    for i in range(COLUMNS):
        if m[mem.ASKED * COLUMNS + i] == 1.0:
            begin_iteration(m, i)
    for iteration in range(MAX_ITERATIONS):
        if iteration > 0:
            evaluate_stages(moved, m)
        correct(moved.n, m)
        if take_in(moved.n, m, iteration) == 0:
            break


@lane_function
def product(n, m, matrix, vector, r):
    """Coordinate r of a matrix times a vector, by their first rows."""
    total = spread(0.0)
    for k in range(n):
        total = total + fetch(m, vector + k) * fetch(m, matrix + r * N + k)
    return total


@scalar_function
def filtered_error(n, m):
    """Error estimate of order 3, filtered by the real system so that stiff parts do not spoil it, in mem.CHANGE (v, then q).

    Reads the accelerations at the start and shifts of the velocities there from mem.SHIFTED on. The sum of the scaled squares
    goes to mem.NOW.
    """
    by_v, by_q, result = mem.CHANGE, mem.CHANGE + N, mem.CHANGE + 2 * N
    h = number(m, mem.STEP)
    inverse, scaled = 1.0 / h, h * (1.0 / rad.MU)
    for k in range(n):
        z = mem.Z + k
        z0, z1, z2 = fetch(m, z), fetch(m, z + N), fetch(m, z + 2 * N)
        q = rad.ERROR_BY_MATRIX[0] * z0 + rad.ERROR_BY_MATRIX[1] * z1 + rad.ERROR_BY_MATRIX[2] * z2
        v = rad.ERROR_WEIGHTS[0] * z0 + rad.ERROR_WEIGHTS[1] * z1 + rad.ERROR_WEIGHTS[2] * z2
        put(m, by_q + k, fetch(m, mem.SHIFTED + N + k) + q)
        put(m, by_v + k, fetch(m, mem.SHIFTED + k) + inverse * v)
    for k in range(n):
        put(m, by_v + k, fetch(m, by_v + k) + scaled * product(n, m, mem.BY_Q, by_q, k))
    for k in range(n):  # behind what is still read
        put(m, result + k, product(n, m, mem.REAL, by_v, k))
    total = spread(0.0)
    for k in range(n):
        v = fetch(m, result + k)
        q = scaled * (v + fetch(m, by_q + k))
        put(m, by_v + k, v)
        put(m, by_q + k, q)
        v = v * fetch(m, mem.INVERSE_SCALE + N + k)
        q = q * fetch(m, mem.INVERSE_SCALE + k)
        total = total + v * v + q * q
    put(m, mem.NOW, total)


@scalar_function
def refilter_error(moved, m):
    """The estimate once more where it is requested, from the start moved by the estimate: for a first try that looked too
    inaccurate."""
    n = moved.n
    first, asked = fetch(m, mem.NOW), fetch(m, mem.ASKED)
    put(m, at.STAGE_TIME, number(m, mem.TIME))
    for k in range(n):
        put(m, at.VS + k, fetch(m, at.V + k) + fetch(m, mem.CHANGE + k))
        put(m, at.QS + k, fetch(m, at.Q + k) + fetch(m, mem.CHANGE + N + k))
    run_motion(moved.motion, m, moved.tables)
    for k in range(n):
        put(m, mem.SHIFTED + k, fetch(m, at.ACC + k))
        put(m, mem.SHIFTED + N + k, fetch(m, mem.CHANGE + k))
    filtered_error(n, m)
    put(m, mem.NOW, above(asked, fetch(m, mem.NOW), first))

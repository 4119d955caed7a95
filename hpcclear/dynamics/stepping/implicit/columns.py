"""Which stiff lane is in which column of eight, for as long as it is stiff, and what is carried there and back."""

from hpcclear.base.arrays import Array, aligned
from hpcclear.base.jit import lane_function, scalar_function
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout.views import RunSettings
from hpcclear.dynamics.stepping.control import leave_rates, measure, place
from hpcclear.dynamics.stepping.implicit import memory as mem
from hpcclear.dynamics.stepping.implicit.control import fit_to_ramp, forget, go_on
from hpcclear.dynamics.stepping.implicit.memory import COLUMNS, STAGES, N
from hpcclear.dynamics.stepping.implicit.radau import MU


def new_columns(width: int) -> Array:
    """Memory of so many lanes, shape (eights, mem.MEMORY)."""
    eights = -(-width // COLUMNS)
    m = aligned(eights * mem.MEMORY).reshape(eights, mem.MEMORY)
    m[:, at.WORK * COLUMNS : at.BANK * COLUMNS] = 1.0  # a column at rest divides by parameters
    m[:, mem.LEAST * COLUMNS : mem.BY_Q * COLUMNS] = 1.0
    return m


@lane_function
def is_stiff(work, W, lane):
    """Whether a lane takes an implicit step."""
    return work[at.STIFF * W + lane] * work[at.RUNNING * W + lane] == 1.0


@lane_function
def is_new(work, W, lane):
    """Whether it is its first since the explicit method, or since its sample began."""
    return work[at.STIFF_STEPS_HERE * W + lane] == 0.0


@lane_function
def owner(m, i):
    """The lane in column i, -1 where there is none."""
    return int(m[mem.OWNER * COLUMNS + i]) - 1


@lane_function
def flag(m, row, i, yes):
    """Keep whether something holds of column i."""
    m[row * COLUMNS + i] = 1.0 if yes else 0.0


@lane_function
def holds(m, row, i):
    """Whether it does."""
    return m[row * COLUMNS + i] == 1.0


@scalar_function
def find_column(lane, memory):
    """Give a lane the first column that is free."""
    for e in range(len(memory)):
        for i in range(COLUMNS):
            if memory[e, mem.OWNER * COLUMNS + i] == 0.0:
                memory[e, mem.OWNER * COLUMNS + i] = lane + 1
                return


@scalar_function
def settle_columns(work, W, memory):
    """Free the columns of lanes that are no longer stiff, and give one to those that have become so."""
    for e in range(len(memory)):
        for i in range(COLUMNS):
            lane = owner(memory[e], i)
            if lane >= 0 and (not is_stiff(work, W, lane) or is_new(work, W, lane)):
                memory[e, mem.OWNER * COLUMNS + i] = 0.0
    for lane in range(W):
        if is_stiff(work, W, lane) and is_new(work, W, lane):
            find_column(lane, memory)


@scalar_function
def take_over(n, lane, W, par, m, i, settings):
    """Forget what the column held: the lane comes from the explicit method or is new."""
    for k in range(int(settings[RunSettings.parameter_rows])):
        m[(mem.PAR + k) * COLUMNS + i] = par[k * W + lane]
    for k in range(n):
        for row in (k, N + k):
            least = par[(at.LEAST + row) * W + lane]
            m[(mem.LEAST + row) * COLUMNS + i] = least / settings[RunSettings.rtol]
    forget(m, i)
    fit_to_ramp(par, lane, W, m, i, settings)


@scalar_function
def bring_back(n, m, i):
    """Have a column's increments at the stages be those of the step before again."""
    for s in range(STAGES):
        for k in range(n):
            row = s * N + k
            m[(mem.Z + row) * COLUMNS + i] = m[(mem.KEPT + row) * COLUMNS + i]


@scalar_function
def begin_column(effects, moved, lane, W, block, m, i, settings):
    """Bring the start of a lane's step into its column. Returns whether it has to be evaluated."""
    work, n = block.work, moved.n
    first, follows = is_new(work, W, lane), work[at.ACCEPT * W + lane] == 1.0
    if first:
        take_over(n, lane, W, block.par, m, i, settings)
    elif follows:
        go_on(m, i)
    m[mem.TIME + i] = work[at.TIME * W + lane]
    m[at.BEGAN * COLUMNS + i] = work[at.BEGAN * W + lane]
    m[mem.STEP + i] = work[at.STEP * W + lane]
    for p in range(effects.rules.begin, effects.rules.end):
        for row in (at.ACTIVE + p, at.INVERSE_IMPACT + p):
            m[row * COLUMNS + i] = work[row * W + lane]
    for k in range(n):
        m[(at.Q + k) * COLUMNS + i] = work[(at.Q + k) * W + lane]
        m[(at.V + k) * COLUMNS + i] = work[(at.V + k) * W + lane]
        m[(mem.START + k) * COLUMNS + i] = block.stages[k * W + lane]
    known = not (first or work[at.FRESH * W + lane] == 1.0)
    flag(m, mem.KNOWN, i, known)
    flag(m, mem.FOLLOWS, i, follows and not first)
    work[at.STIFF_STEPS * W + lane] += 1.0
    return not known


@scalar_function
def adopt_start(n, lane, W, block, m, i):
    """Take over what the start of a step was evaluated to, where it is new to the lane itself."""
    work = block.work
    work[at.EVALUATIONS * W + lane] += 1.0
    if work[at.FRESH * W + lane] == 1.0:
        for k in range(n):
            found = m[(at.ACC + k) * COLUMNS + i]
            block.stages[k * W + lane] = found
            m[(mem.START + k) * COLUMNS + i] = found
        for r in range(at.RATES):
            work[(at.RATE_OLD + r) * W + lane] = m[(at.RATE_NOW + r) * COLUMNS + i]
        work[at.FRESH * W + lane] = 0.0


@scalar_function
def gap_errors(rules, lane, W, work, m, i):
    """Squares of the scaled errors of the integrals of a column's gaps over the step, added, as for the explicit method."""
    total = 0.0
    for p in range(rules.begin, rules.end):
        error = work[(at.RATE_OLD + at.GAP + p) * W + lane] + m[(mem.GAP_ERROR + p) * COLUMNS + i]
        clearance = mem.PAR + at.JOINT_BLOCKS + at.JOINT_ROWS * p + at.CLEARANCE
        span = m[clearance * COLUMNS + i] * m[(mem.PAR + at.PERIOD) * COLUMNS + i]
        error *= m[mem.STEP + i] / MU / (m[mem.TOLERANCE + i] * span)
        total += error * error
    return total


@scalar_function
def leave(effects, n, lane, W, work, m, i):
    """Put the end of a column's step, and means over it, where an explicit step would leave them."""
    for k in range(n):
        work[(at.QS + k) * W + lane] = m[(at.QS + k) * COLUMNS + i]
        work[(at.VS + k) * W + lane] = m[(at.VS + k) * COLUMNS + i]
        work[(at.ACC + k) * W + lane] = m[(at.ACC + k) * COLUMNS + i]
    leave_rates(effects, work, lane, W, m, COLUMNS, i)
    for p in range(effects.rules.begin, effects.rules.end):
        rate = at.GAP + place(p)
        work[(at.RATE_SUM + rate) * W + lane] = m[(mem.MEAN + rate) * COLUMNS + i]
    for r in range(len(effects.measures)):
        rate = measure(effects, r)
        work[(at.RATE_SUM + rate) * W + lane] = m[(mem.MEAN + rate) * COLUMNS + i]

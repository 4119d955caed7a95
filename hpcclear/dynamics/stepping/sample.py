"""A lane's sample, in scalar code for few lanes at a time: taken from the queue, booked by revolutions, written down."""

import math

from hpcclear.base.jit import scalar_function as lane_event
from hpcclear.base.outcome import Status
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout.arguments import Counter
from hpcclear.dynamics.layout.views import Outcome, RunSettings, Start

OK = int(Status.OK)
STEP_CAP = int(Status.STEP_CAP)
STEP_TOO_SMALL = int(Status.STEP_TOO_SMALL)
NOT_FINITE = int(Status.NOT_FINITE)
UNFINISHED = -1

JOINTS = at.MAX_JOINTS
RATES = len(at.INTEGRATED) - at.WAVE_ROWS  # but for profiles of wear
ACCELERATION = at.place(at.FOLLOWED_ACCELERATION)
SQUARE = at.place(at.FOLLOWED_SQUARE)
ACROSS = at.place(at.FOLLOWED_ACROSS)

STRICT = 1e-6  # relative tolerance of explicit steps that is never made stricter at the edge of stability

OF_INERTIA = 0.02
"""Error of a film's force in an explicit step at most, over the forces of inertia: implicit steps take over at the edge of
stability, but what a loose tolerance makes of forces by then are peaks."""


@lane_event
def make_stricter(lane, W, work, par, settings):
    """How many times tighter than the run's the tolerances of this sample's explicit steps are, squared: within the range of
    stability, and at its edge, where no implicit steps take over. None gets below `STRICT`."""
    film = 0.0
    for k in range(JOINTS):
        row = at.JOINT_BLOCKS + k * at.JOINT_ROWS + at.FILM_STEEPNESS
        film = max(film, par[row * W + lane])
    rtol = settings[RunSettings.rtol]
    speed = 1.0 + par[at.SPEED * W + lane] * par[at.DRIVEN_LENGTH * W + lane]
    by_film = rtol * min(speed * film / OF_INERTIA, 1.0 / STRICT)
    within = max(par[at.STRICTNESS * W + lane], by_film * by_film)
    edge = 0.0
    if settings[RunSettings.implicit] == 0.0:
        edge = rtol * min(par[at.EDGE * W + lane], 1.0 / STRICT)
    work[at.STRICTER * W + lane] = within
    work[at.STRICTER_WITHIN * W + lane] = within
    work[at.STRICTER_AT_EDGE * W + lane] = max(within, edge * edge)


@lane_event
def load(lane, W, n, block, queue, settings):
    """Give a lane the next sample of the queue, or let it rest."""
    work, book = block.work, block.book
    slot = queue.counters[Counter.NEXT_SLOT]
    for k in range(at.RATE_OLD, at.WORK):
        work[k * W + lane] = 0.0
    for k in range(at.LARGEST_RATE, at.WORK):
        work[k * W + lane] = -1e300
    for k in range(at.BOOK):
        book[k * W + lane] = 0.0
    for k in range(at.STRICTER, at.STRICTER_AT_EDGE + 1):
        work[k * W + lane] = 1.0
    if slot >= queue.counters[Counter.SLOTS]:
        return  # the step stays 0: a resting lane repeats its last state
    queue.counters[Counter.NEXT_SLOT] = slot + 1
    for k in range(at.LEAST):
        block.par[k * W + lane] = queue.par[slot, k]
    for k in range(at.JOINT_BLOCKS, int(settings[RunSettings.parameter_rows])):
        block.par[k * W + lane] = queue.par[slot, k]
    make_stricter(lane, W, work, block.par, settings)
    for k in range(n):
        for row in (at.LEAST + k, at.LEAST + at.MAX_COORDINATES + k):
            block.par[row * W + lane] = queue.par[slot, row] * settings[RunSettings.atol]
        block.par[(at.WRAPS + k) * W + lane] = queue.par[slot, at.WRAPS + k]
        work[(at.Q + k) * W + lane] = queue.start[slot, k]
        work[(at.V + k) * W + lane] = queue.start[slot, at.MAX_COORDINATES + k]
    for k in range(JOINTS):
        work[(at.ACTIVE + k) * W + lane] = queue.start[slot, Start.active + k]
        work[(at.INVERSE_IMPACT + k) * W + lane] = queue.start[slot, Start.inverse_impact + k]
    work[at.NEXT_STEP * W + lane] = block.par[at.FIRST_STEP * W + lane]
    work[at.FRESH * W + lane] = 1.0
    work[at.RUNNING * W + lane] = 1.0
    work[at.AVERAGING * W + lane] = 1.0 if settings[RunSettings.transient] == 0.0 else 0.0
    book[at.SAMPLE * W + lane] = slot


@lane_event
def finish(lane, W, n, status, block, queue, settings):
    """Write down a sample that ended, whatever its status, and free the lane."""
    work, book, out = block.work, block.book, queue.out
    slot = int(book[at.SAMPLE * W + lane])
    out[slot, Outcome.status] = status
    out[slot, Outcome.evaluations] = work[at.EVALUATIONS * W + lane]
    out[slot, Outcome.attempts] = work[at.ATTEMPTS * W + lane]
    out[slot, Outcome.stiff_steps] = work[at.STIFF_STEPS * W + lane]
    out[slot, Outcome.revolutions] = book[at.REVOLUTION * W + lane]
    out[slot, Outcome.time] = book[at.ELAPSED * W + lane]
    for k in range(JOINTS):
        out[slot, Outcome.peak_force + k] = work[(at.PEAK + k) * W + lane]
        out[slot, Outcome.deepest + k] = work[(at.DEEPEST + k) * W + lane]
        out[slot, Outcome.active + k] = work[(at.ACTIVE + k) * W + lane]
        out[slot, Outcome.inverse_impact + k] = work[(at.INVERSE_IMPACT + k) * W + lane]
        out[slot, Outcome.largest_rate + k] = work[(at.LARGEST_RATE + k) * W + lane]
        out[slot, Outcome.latched + k] = book[(at.LATCHED + k) * W + lane]
    for r in range(RATES + int(settings[RunSettings.profiled])):
        out[slot, Outcome.total + r] = book[(at.TOTAL + r) * W + lane]
    count = book[at.COUNT_F * W + lane]
    spread = math.sqrt(book[at.M2_F * W + lane] / (count - 1.0)) if count > 1.0 else math.nan
    out[slot, Outcome.spread] = spread
    finish_averages(lane, W, work, book, out, slot, settings)
    for k in range(n):
        out[slot, Outcome.moving + k] = work[(at.Q + k) * W + lane]
        out[slot, Outcome.moving + at.MAX_COORDINATES + k] = work[(at.V + k) * W + lane]
    queue.finished[queue.counters[Counter.FINISHED]] = slot
    queue.counters[Counter.FINISHED] += 1
    work[at.RUNNING * W + lane] = 0.0


@lane_event
def finish_averages(lane, W, work, book, out, slot, settings):
    """Means, peak, standard deviation over the averaged revolutions; meaningless for rates that no effect requested."""
    time = book[at.TIME_SUM * W + lane]
    if time > 0.0:
        for r in range(RATES + int(settings[RunSettings.profiled])):
            out[slot, Outcome.mean + r] = book[(at.AVERAGED + r) * W + lane] / time
        total = 0.0
        for k in range(JOINTS):
            gap = settings[RunSettings.chosen + k] * out[slot, Outcome.mean + k]
            total += gap * gap
        out[slot, Outcome.objective] = math.sqrt(total)
        out[slot, Outcome.period] = time / book[at.COUNT_F * W + lane]
        cycle = abs(settings[RunSettings.cycle])
        out[slot, Outcome.cycle] = cycle if cycle > 0.0 else at.TURN
        out[slot, Outcome.peak_moment] = work[at.PEAK_MOMENT * W + lane]
        mean = out[slot, Outcome.mean + ACCELERATION]
        square = out[slot, Outcome.mean + SQUARE]
        across = out[slot, Outcome.mean + ACROSS]
        square = max(square - mean * mean - across * across, 0.0)
        out[slot, Outcome.acceleration_deviation] = math.sqrt(square)
        out[slot, Outcome.peak_acceleration] = math.sqrt(work[at.PEAK_FOLLOWED * W + lane])


@lane_event
def failure(lane, W, n, work, stages, settings):
    """Why a lane cannot go on: a status, or OK if it can."""
    if work[at.ATTEMPTS * W + lane] >= settings[RunSettings.max_steps]:
        return STEP_CAP
    h = work[at.STEP * W + lane]
    shortest = settings[RunSettings.smallest_step] * (h + work[at.TIME * W + lane])
    if work[at.ACCEPT * W + lane] == 0.0 and h <= shortest:
        for k in range(n):
            state = work[(at.Q + k) * W + lane] + work[(at.V + k) * W + lane]
            if not math.isfinite(state + stages[k * W + lane]):
                return NOT_FINITE
        return STEP_TOO_SMALL
    return OK


@lane_event
def book_objective(lane, W, book, f):
    """Add a revolution's objective to the averages over revolutions."""
    count = book[at.COUNT_F * W + lane] + 1.0
    step = f - book[at.MEAN_F * W + lane]
    mean = book[at.MEAN_F * W + lane] + step / count
    book[at.M2_F * W + lane] += step * (f - mean)
    book[at.MEAN_F * W + lane] = mean
    book[at.COUNT_F * W + lane] = count


@lane_event
def book_averages(lane, W, work, book, time, settings):
    """Add a revolution to the sums of the averaged ones."""
    for r in range(RATES + int(settings[RunSettings.profiled])):
        integral = work[(at.INTEGRAL + at.INTEGRATED_RATES[r]) * W + lane]
        book[(at.AVERAGED + r) * W + lane] += integral
    book[at.TIME_SUM * W + lane] += time
    total = 0.0
    for k in range(JOINTS - 1, -1, -1):  # O12 last: f has always had these bits
        gap = settings[RunSettings.chosen + k] * work[(at.INTEGRAL + at.GAP + k) * W + lane]
        total += gap * gap
        if work[(at.ACTIVE + k) * W + lane] == 1.0 and work[(at.ENDED + k) * W + lane] == 0.0:
            book[(at.LATCHED + k) * W + lane] = 1.0
    book_objective(lane, W, book, math.sqrt(total) / time)


@lane_event
def end_revolution(lane, W, work, book, settings):
    """Complete the sums of a revolution; the status of the sample when it was the last one, else UNFINISHED."""
    time = work[at.TIME * W + lane]
    book[at.ELAPSED * W + lane] += time
    revolution = book[at.REVOLUTION * W + lane] + 1.0
    book[at.REVOLUTION * W + lane] = revolution
    if work[at.AVERAGING * W + lane] == 1.0:
        book_averages(lane, W, work, book, time, settings)
    for r in range(RATES + int(settings[RunSettings.profiled])):
        integral = work[(at.INTEGRAL + at.INTEGRATED_RATES[r]) * W + lane]
        book[(at.TOTAL + r) * W + lane] += integral
    for r in range(at.ANGLES):
        work[(at.INTEGRAL + r) * W + lane] = 0.0
    for r in range(int(settings[RunSettings.profiled])):
        work[(at.INTEGRAL + at.PROFILES + r) * W + lane] = 0.0
    work[at.TIME * W + lane] = 0.0
    work[at.BEGAN * W + lane] += time
    for k in range(JOINTS):
        work[(at.ENDED + k) * W + lane] = 0.0
    work[at.ENDING * W + lane] = 0.0
    work[at.AVERAGING * W + lane] = 1.0 if revolution >= settings[RunSettings.transient] else 0.0
    return UNFINISHED if book[at.COUNT_F * W + lane] < settings[RunSettings.averaged] else OK

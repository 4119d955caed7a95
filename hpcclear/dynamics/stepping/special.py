"""What happens to single lanes between steps: contacts, ends of revolutions, samples that end and begin.

One function for all steppers: it is compiled once, for any number of lanes, coordinates and joints, and called by its address.
"""

from functools import cache

from hpcclear.base.bits import call_at, carray
from hpcclear.base.jit import FASTMATH, lane_function, scalar_function
from hpcclear.base.lowering.compiled import Compiled
from hpcclear.base.lowering.values import COUNTS, DOUBLES
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout.arguments import NUMBERS, Asking, Counter, Queue, block_at, rules_in
from hpcclear.dynamics.layout.views import Outcome, RunSettings, Start
from hpcclear.dynamics.stepping import stops
from hpcclear.dynamics.stepping.rows import next_rows, stop_at_rows
from hpcclear.dynamics.stepping.sample import OK, UNFINISHED, end_revolution, failure, finish, load

NEXT_SAMPLE, END_OF_STEP, END_OF_REVOLUTION = range(3)  # what may be requested


@scalar_function
def end_of_step(rules, lane, W, n, block, settings, tables):
    """What the end of a special lane's step shows: it may be cut. Returns OK or why the lane ends."""
    work = block.work
    status = failure(lane, W, n, work, block.stages, settings)
    if status == OK and work[at.ACCEPT * W + lane] == 1.0:
        if rules.curves > 0:  # first: contacts are latched at the ends of steps that stay
            stop_at_rows(rules, lane, W, work, block.par, tables)
        if rules.latched and work[at.ACCEPT * W + lane] == 1.0:
            stops.stop_at_impacts(rules, lane, W, work, settings)
        if work[at.ACCEPT * W + lane] == 1.0:
            stops.stop_at_kinks(rules, lane, W, work, settings)
        if work[at.ACCEPT * W + lane] == 1.0 and rules.free:
            status = stops.stop_free_crank(lane, W, block, settings, n - 1)
        if work[at.ACCEPT * W + lane] == 1.0:
            for p in range(rules.begin, rules.end):
                stops.integrate_gap(lane, W, work, p)
            for c in range(rules.curves):
                next_rows(lane, W, work, block.par, tables, c, at.RATE_NOW)
    return status


@scalar_function
def answer(numbers, rules, block, queue, settings, tables):
    """Do what is requested of one lane; by how much the number of running lanes changes is left in `FOUND`."""
    asked, lane = numbers[Asking.ASKED], numbers[Asking.LANE]
    W, n = numbers[Asking.WIDTH], numbers[Asking.COORDINATES]
    ends = True
    status = UNFINISHED
    if asked == END_OF_STEP:
        status = end_of_step(rules, lane, W, n, block, settings, tables)
        ends = status != OK
    elif asked == END_OF_REVOLUTION:
        for k in range(n):  # angles that go round with the revolutions keep their precision
            block.work[(at.Q + k) * W + lane] -= block.par[(at.WRAPS + k) * W + lane]
        status = end_revolution(lane, W, block.work, block.book, settings)
        ends = status != UNFINISHED
    before = block.work[at.RUNNING * W + lane]
    if ends:
        if status != UNFINISHED:
            finish(lane, W, n, status, block, queue, settings)
        load(lane, W, n, block, queue, settings)
    numbers[Asking.FOUND] = int(block.work[at.RUNNING * W + lane] - before)


@scalar_function
def special(
    numbers, work, stages, par, book, settings, tables, queued, starts, out, finished, counters
):
    """`answer` for arrays at addresses."""
    of = carray(numbers, NUMBERS)
    W = of[Asking.WIDTH]
    block = block_at(W, work, stages, par, book)
    entries, counts = carray(settings, RunSettings.size), carray(counters, Counter.COUNT)
    slots = counts[Counter.SLOTS]
    parameters = carray(queued, (slots, int(entries[RunSettings.parameter_rows])))
    begun, done = carray(starts, (slots, Start.size)), carray(out, (slots, Outcome.size))
    queue = Queue(parameters, begun, done, carray(finished, slots), counts)
    answer(of, rules_in(of), block, queue, entries, carray(tables, at.MAX_CURVES))


@cache
def special_code() -> Compiled:
    """The compiled `special`; its ``address`` is what steppers take."""
    return Compiled(special, (COUNTS, *[DOUBLES] * 9, *[COUNTS] * 2), FASTMATH)


@lane_function
def ask(address, asked, lane, numbers, block, queue, method):
    """Have `special` do one thing for one lane. Returns the change of the number of running lanes."""
    numbers[Asking.ASKED] = asked
    numbers[Asking.LANE] = lane
    arrays = (
        numbers, block.work, block.stages, block.par, block.book, method.settings, method.tables,
        queue.par, queue.start, queue.out, queue.finished, queue.counters,
    )  # fmt: skip
    call_at(address, arrays)
    return numbers[Asking.FOUND]

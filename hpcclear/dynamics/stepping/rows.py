"""Steps that end at rows of tables, in scalar code for few lanes: no pulse is passed over, however short.

Most steps are shortened before they are tried (`control.shorten_to_rows`). What is found here is the segment between two rows
that a lane's place lies in, and steps that go beyond it, since the speed has changed within them.
"""

import math

from hpcclear.base.jit import scalar_function as lane_event
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout.curves import BREAK_COUNT, BREAKS, HEAD, REPEATS
from hpcclear.dynamics.stepping.control import moved_on, row_reach
from hpcclear.dynamics.stepping.events import impact_fraction
from hpcclear.dynamics.stepping.stops import cut

FAR = 1e300


@lane_event
def before_row(lane, W, work, c):
    """Fraction of this step at which the place of table c comes to the next row; 2 if it does not, or at the end."""
    moved = moved_on(work, c, lane, W)
    way = 1.0 if moved > 0.0 else -1.0
    left = work[((at.AHEAD if moved > 0.0 else at.BEHIND) + c) * W + lane]
    reach = row_reach(work, c, moved, lane, W)
    if abs(moved) <= left + reach or left <= reach:
        return 2.0
    h = way * work[at.STEP * W + lane]
    first = h * work[(at.RATE_OLD + at.PLACE_RATES + c) * W + lane]
    last = h * work[(at.RATE_NOW + at.PLACE_RATES + c) * W + lane]
    return impact_fraction(-left, first, abs(moved) - left, last, 0.0)


@lane_event
def stop_at_rows(rules, lane, W, work, tables):
    """Shorten the step to the first row beyond which it goes."""
    first = 2.0
    for c in range(rules.curves):
        first = min(first, before_row(lane, W, work, c))
    if first < 1.0:
        cut(lane, W, work, first)


@lane_event
def row_before(tables, first, count, place):
    """Number of the last of so many ascending rows at or before a place, -1 of none."""
    low, high = -1, count
    while high - low > 1:
        middle = (low + high) // 2
        if tables[first + middle] <= place:
            low = middle
        else:
            high = middle
    return low


@lane_event
def row_at(tables, first, count, repeats, k):
    """Where row k stands; those before the first and behind the last are a length off, or nowhere."""
    if 0 <= k < count:
        return tables[first + k]
    if not repeats:
        return FAR if k > 0 else -FAR
    return tables[first + k - count] + 1.0 if k > 0 else tables[first + k + count] - 1.0


@lane_event
def row_near(tables, first, count, repeats, place):
    """Number of the row that is nearest to a place."""
    if repeats:
        place -= math.floor(place)
    k = row_before(tables, first, count, place)
    before = row_at(tables, first, count, repeats, k)
    behind = row_at(tables, first, count, repeats, k + 1)
    near = k if place - before < behind - place else k + 1
    return (near + count) % count


@lane_event
def next_rows(lane, W, work, tables, c):
    """Distances to the rows around the end of this step, where it is at one or where they are not known."""
    head = HEAD * c
    first, count = int(tables[head + BREAKS]), int(tables[head + BREAK_COUNT])
    repeats = tables[head + REPEATS] == 1.0
    moved = moved_on(work, c, lane, W)
    place = work[(at.RATE_NOW + at.PLACES + c) * W + lane]
    ahead = work[(at.AHEAD + c) * W + lane] - moved
    behind = work[(at.BEHIND + c) * W + lane] + moved
    reach = row_reach(work, c, moved, lane, W)
    if count == 0:
        ahead, behind = FAR, FAR
    elif ahead + behind <= 0.0:
        k = row_before(tables, first, count, place)
        ahead = row_at(tables, first, count, repeats, k + 1) - place
        behind = place - row_at(tables, first, count, repeats, k)
    elif moved >= 0.0 and ahead <= reach:
        k = row_near(tables, first, count, repeats, place + ahead)
        row, beyond = tables[first + k], row_at(tables, first, count, repeats, k + 1)
        ahead, behind = beyond - row + ahead, -ahead
    elif moved < 0.0 and behind <= reach:
        k = row_near(tables, first, count, repeats, place - behind)
        row, beyond = tables[first + k], row_at(tables, first, count, repeats, k - 1)
        ahead, behind = -behind, row - beyond + behind
    work[(at.AHEAD + c) * W + lane] = ahead + moved
    work[(at.BEHIND + c) * W + lane] = behind - moved

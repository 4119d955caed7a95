"""Steps that end at rows of tables, in scalar code for few lanes: no pulse is passed over, however short.

Most steps are shortened before they are tried (`control.shorten_to_rows`). What is found here is the segment between two rows
that a lane's place lies in, and steps that go beyond it, since the speed has changed within them.
"""

import math

from hpcclear.base.jit import scalar_function as lane_event
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout import curves
from hpcclear.dynamics.stepping.control import row_reach
from hpcclear.dynamics.stepping.stops import cut, impact_fraction

FAR = 1e300

NARROW = 0.02
"""Of the range of a table over a speed or distance: segments below it are passed in parts."""
PARTS = 4.0
"""Their number. A load that follows the motion is no polynomial of the time, and the error that is allowed in a speed may be a
good part of a narrow dip."""


@lane_event
def moved_on(lane, W, work, c):
    """By how much the place of table c has moved in a step: whole lengths are those that its rates say."""
    old, now = at.RATE_OLD * W + lane, at.RATE_NOW * W + lane
    moved = work[now + (at.PLACES + c) * W] - work[old + (at.PLACES + c) * W]
    mean = 0.5 * (work[now + (at.PLACE_RATES + c) * W] + work[old + (at.PLACE_RATES + c) * W])
    return moved + math.floor(work[at.STEP * W + lane] * mean - moved + 0.5)


@lane_event
def before_row(lane, W, work, c):
    """Fraction of this step at which the place of table c comes to the next row; 2 if it does not, or at the end."""
    ahead, behind = work[(at.NEXT_ROW + c) * W + lane], work[(at.LAST_ROW + c) * W + lane]
    moved = moved_on(lane, W, work, c)
    way = 1.0 if moved > 0.0 else -1.0
    row = ahead if moved > 0.0 else behind
    left = way * (row - work[(at.RATE_OLD + at.PLACES + c) * W + lane])
    reach = row_reach(work, c, lane, W)
    if ahead <= behind or abs(moved) <= left + reach or left <= reach:
        return 2.0
    h = way * work[at.STEP * W + lane]
    first = h * work[(at.RATE_OLD + at.PLACE_RATES + c) * W + lane]
    last = h * work[(at.RATE_NOW + at.PLACE_RATES + c) * W + lane]
    return impact_fraction(-left, first, abs(moved) - left, last, 0.0)


@lane_event
def row_of(lane, W, par, tables, c, k):
    """Where row k of table c stands: a share of its length, or what the sample's parameters say."""
    row = tables[(int(tables[curves.HEAD * c + curves.BREAKS]) + k) & curves.PLACES]
    if tables[curves.HEAD * c + curves.IN_PARAMETERS] == 1.0:
        return par[int(row) * W + lane]
    return row


@lane_event
def row_before(lane, W, par, tables, c, place):
    """Number of the last row at or before a place, -1 of none."""
    low, high = -1, int(tables[curves.HEAD * c + curves.BREAK_COUNT])
    while high - low > 1:
        middle = (low + high) // 2
        if row_of(lane, W, par, tables, c, middle) <= place:
            low = middle
        else:
            high = middle
    return low


@lane_event
def row_at(lane, W, par, tables, c, k):
    """The same; of rows before the first and behind the last, a length off or nowhere."""
    count = int(tables[curves.HEAD * c + curves.BREAK_COUNT])
    if 0 <= k < count:
        return row_of(lane, W, par, tables, c, k)
    if tables[curves.HEAD * c + curves.REPEATS] == 0.0:
        return FAR if k > 0 else -FAR
    further = 1.0 if k > 0 else -1.0
    return row_of(lane, W, par, tables, c, k - int(further) * count) + further


@lane_event
def next_rows(lane, W, work, par, tables, c, rates):
    """The rows around the end of this step, or around its beginning, by its `rates`: of one that stands there, beyond it.

    The first row of a table that repeats is at 0, so that no place between two rows is a length off.
    """
    count = int(tables[curves.HEAD * c + curves.BREAK_COUNT])
    ahead, behind = FAR, -FAR
    if count > 0:
        place = work[(rates + at.PLACES + c) * W + lane]
        reach = row_reach(work, c, lane, W)
        onward = work[(rates + at.PLACE_RATES + c) * W + lane] >= 0.0
        place += reach if onward else -reach
        k = row_before(lane, W, par, tables, c, place)
        if tables[curves.HEAD * c + curves.REPEATS] == 1.0 and place >= 1.0:
            k = count
        behind = row_at(lane, W, par, tables, c, k)
        ahead = row_at(lane, W, par, tables, c, k + 1)
        if tables[curves.HEAD * c + curves.IN_PARAMETERS] == 1.0 and 0 <= k < count - 1:
            part = (ahead - behind) / PARTS
            last = row_of(lane, W, par, tables, c, count - 1)
            if ahead - behind < NARROW * (last - row_of(lane, W, par, tables, c, 0)):
                behind += part * math.floor((place - behind) / part)
                ahead = behind + part
    work[(at.NEXT_ROW + c) * W + lane] = ahead
    work[(at.LAST_ROW + c) * W + lane] = behind


@lane_event
def stop_at_rows(rules, lane, W, work, par, tables):
    """Shorten the step to the first row beyond which it goes."""
    first = 2.0
    for c in range(rules.curves):
        ahead, behind = work[(at.NEXT_ROW + c) * W + lane], work[(at.LAST_ROW + c) * W + lane]
        if ahead == behind:  # before the first step
            next_rows(lane, W, work, par, tables, c, at.RATE_OLD)
        first = min(first, before_row(lane, W, work, c))
    if first < 1.0:
        cut(lane, W, work, first)

"""Contacts that begin or end inside a step of collocation: found between its nodes, and the step cut to end there."""

from hpcclear.base.eight import fetch, largest_of
from hpcclear.base.jit import lane_function, scalar_function
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.collocation import lobatto as lob
from hpcclear.dynamics.collocation.lobatto import STAGES
from hpcclear.dynamics.stepping.events import impact_fraction, root
from hpcclear.dynamics.stepping.settings import GAP_TOLERANCE
from hpcclear.dynamics.stepping.stops import cut, latch, latch_at_start


@scalar_function
def gap_before(work, m, p, i):
    """A gap between node i and the one before, for a cubic: its start and length as parts of the step, gap and slope
    times length at its start, then at its end."""
    h = work[at.STEP]
    start, d0, m0 = 0.0, work[at.RATE_OLD + at.GAP + p], h * work[at.RATE_OLD + at.GAP_RATE + p]
    if i > 0:
        start = m[lob.NODE * STAGES + i - 1]
        d0 = m[(at.RATE_NOW + at.GAP + p) * STAGES + i - 1]
        m0 = h * m[(at.RATE_NOW + at.GAP_RATE + p) * STAGES + i - 1]
    length = m[lob.NODE * STAGES + i] - start
    d1 = m[(at.RATE_NOW + at.GAP + p) * STAGES + i]
    m1 = h * m[(at.RATE_NOW + at.GAP_RATE + p) * STAGES + i]
    return start, length, d0, length * m0, d1, length * m1


@lane_function
def leap(d0, m0, d1, m1):
    """By how much a gap changes beyond what its rates tell.

    The gap that is known of the start was found with the last sweep before, whose state was still moved a little by its
    tolerance: a contact that begins between the two would be looked for in shorter and shorter steps.
    """
    return abs(d1 - d0 - 0.5 * (m0 + m1))


@scalar_function
def impact_in(work, m, p, settings):
    """Where in this step a joint in flight strikes, as a fraction; 2 if it does not, 1 if at the end; as `meet_impact`."""
    tolerance = settings[GAP_TOLERANCE]
    for i in range(STAGES):
        start, length, d0, m0, d1, m1 = gap_before(work, m, p, i)
        if i == STAGES - 1 and abs(d1) <= tolerance and m1 > 0.0:
            return 1.0
        fraction = impact_fraction(d0, m0, d1, m1, 0.5 * tolerance)
        if fraction == 0.0 and i == 0:
            latch_at_start(0, 1, work, settings, p)
            return 0.0
        if fraction <= 1.0:
            fraction = start + length * fraction
            return 1.0 if fraction > 1.0 - 1e-7 and m1 > 0.0 else fraction
    return 2.0


@scalar_function
def kink_in(work, m, p, tolerance):
    """Where in this step a gap changes sign, as a fraction; 2 if it does not, or so near an end that it does no harm."""
    for i in range(STAGES):
        start, length, d0, m0, d1, m1 = gap_before(work, m, p, i)
        at_start = i == 0 and abs(d0) <= max(tolerance, leap(d0, m0, d1, m1))
        at_end = i == STAGES - 1 and abs(d1) <= tolerance
        if d0 * d1 < 0.0 and not (at_start or at_end):
            return start + length * root(d0, m0, d1, m1, 1.0)
    return 2.0


@scalar_function
def contact_change(latched, work, m, p, settings):
    """Fraction of the step at which joint p's contact begins or ends; 2 if it does not, 1 if an impact ends the step."""
    if latched and work[at.ACTIVE + p] == 0.0:
        return impact_in(work, m, p, settings)
    return kink_in(work, m, p, settings[GAP_TOLERANCE])


@lane_function
def range_of(work, m, rate):
    """Least and greatest value of a rate at the start and at the nodes."""
    start, nodes = work[at.RATE_OLD + rate], fetch(m, at.RATE_NOW + rate)
    return min(start, -largest_of(-1.0 * nodes)), max(start, largest_of(nodes))


@lane_function
def may_change(latched, work, m, p, settings):
    """Whether joint p's contact may begin or end in this step: mostly its extremes at the nodes say that it does not."""
    low, high = range_of(work, m, at.GAP + p)
    flight = latched and work[at.ACTIVE + p] == 0.0
    strikes = flight and high >= -settings[GAP_TOLERANCE]
    if flight and not strikes:
        slowest, fastest = range_of(work, m, at.GAP_RATE + p)
        strikes = slowest < 0.0 and fastest > 0.0  # it may have touched between two nodes
    return strikes or low * high < 0.0


@scalar_function
def stop_at_contacts(rules, work, m, settings):
    """Cut the step where a contact begins or ends inside it, and latch those that begin at its end."""
    first = 2.0
    for p in range(rules.begin, rules.end):
        if may_change(rules.latched, work, m, p, settings):
            first = min(first, contact_change(rules.latched, work, m, p, settings))
    if first < 1.0:
        cut(0, 1, work, first)
    elif first == 1.0:
        for p in range(rules.begin, rules.end):
            if contact_change(rules.latched, work, m, p, settings) == 1.0:
                latch(0, 1, work, settings, p)
    if first <= 1.0:
        m[lob.KINK] = lob.KINK_AT_END

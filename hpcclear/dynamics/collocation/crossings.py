"""Contacts that begin or end inside a step of collocation: found between its nodes, and the step cut to end there."""

from hpcclear.base.jit import lane_function, scalar_function
from hpcclear.base.unrolled import unrolled, written_out
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.collocation import lobatto as lob
from hpcclear.dynamics.collocation.lobatto import STAGES
from hpcclear.dynamics.stepping.events import impact_fraction, root
from hpcclear.dynamics.stepping.settings import GAP_TOLERANCE
from hpcclear.dynamics.stepping.stops import cut, latch_at_start, latch_if


@scalar_function
def gap_before(work, m, joint, i):
    """A gap between node i and the one before, for a cubic: its start and length as parts of the step, gap and slope
    times length at its start, then at its end."""
    h = work[at.STEP]
    start, d0, m0 = 0.0, work[at.RATE_OLD + joint.gap], h * work[at.RATE_OLD + joint.rate]
    if i > 0:
        start = m[lob.NODE * STAGES + i - 1]
        d0 = m[(at.RATE_NOW + joint.gap) * STAGES + i - 1]
        m0 = h * m[(at.RATE_NOW + joint.rate) * STAGES + i - 1]
    length = m[lob.NODE * STAGES + i] - start
    d1 = m[(at.RATE_NOW + joint.gap) * STAGES + i]
    m1 = h * m[(at.RATE_NOW + joint.rate) * STAGES + i]
    return start, length, d0, length * m0, d1, length * m1


@scalar_function
def impact_in(work, m, joint, settings):
    """Where in this step a joint in flight strikes, as a fraction; 2 if it does not, 1 if at the end; as `meet_impact`."""
    tolerance = settings[GAP_TOLERANCE]
    for i in range(STAGES):
        start, length, d0, m0, d1, m1 = gap_before(work, m, joint, i)
        if i == STAGES - 1 and abs(d1) <= tolerance and m1 > 0.0:
            return 1.0
        fraction = impact_fraction(d0, m0, d1, m1, 0.5 * tolerance)
        if fraction == 0.0 and i == 0:
            latch_at_start(0, 1, work, settings, joint)
            return 0.0
        if fraction <= 1.0:
            fraction = start + length * fraction
            return 1.0 if fraction > 1.0 - 1e-7 and m1 > 0.0 else fraction
    return 2.0


@scalar_function
def kink_in(work, m, joint, tolerance):
    """Where in this step a gap changes sign, as a fraction; 2 if it does not, or so near an end that it does no harm."""
    for i in range(STAGES):
        start, length, d0, m0, d1, m1 = gap_before(work, m, joint, i)
        at_end = (i == 0 and abs(d0) <= tolerance) or (i == STAGES - 1 and abs(d1) <= tolerance)
        if d0 * d1 < 0.0 and not at_end:
            return start + length * root(d0, m0, d1, m1, 1.0)
    return 2.0


@lane_function
def contact_change(flag, latched, work, m, joint, settings):
    """Fraction of the step at which a joint's contact begins or ends; 2 if it does not, 1 if an impact ends the step."""
    if flag is not None:
        if latched and work[joint.active] == 0.0:
            return impact_in(work, m, joint, settings)
        return kink_in(work, m, joint, settings[GAP_TOLERANCE])
    else:
        return 2.0


@lane_function
@unrolled
def stop_at_contacts(effects, work, m, settings):
    """Cut the step where a contact begins or ends inside it, and latch those that begin at its end."""
    first = 2.0
    fraction: dict = {}
    for joint in written_out(at.JOINTS):
        flag = getattr(effects.open, joint.flag)
        fraction[joint] = contact_change(flag, effects.rules.latched, work, m, joint, settings)
        first = min(first, fraction[joint])
    if first < 1.0:
        cut(0, 1, work, first)
    elif first == 1.0:
        for joint in written_out(at.JOINTS):
            latch_if(
                getattr(effects.open, joint.flag), fraction[joint], 0, 1, work, settings, joint
            )
    if first <= 1.0:
        m[lob.KINK] = lob.KINK_AT_END

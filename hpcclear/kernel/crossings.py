"""Contacts that begin or end inside a step of collocation: found between its nodes, and the step cut to end there."""

from ..jit import lane_function, scalar_function
from . import layout as at
from . import lobatto as lob
from .events import impact_fraction, root
from .lifecycle import GAP_TOLERANCE, IMPACT_FLOOR, latch
from .lobatto import STAGES


@scalar_function
def impact_in(work, m, gap, active, inverse, settings):
    """Where in this step a joint in flight strikes, as a fraction; 2 if it does not, 1 if at the end; as `meet_impact`."""
    tolerance = settings[GAP_TOLERANCE]
    h = work[at.STEP]
    d0, m0, c0 = work[at.RATE_OLD + gap], h * work[at.RATE_OLD + gap + 2], 0.0
    for i in range(STAGES):
        d1 = m[(at.RATE_NOW + gap) * STAGES + i]
        m1 = h * m[(at.RATE_NOW + gap + 2) * STAGES + i]
        c1 = m[lob.NODE * STAGES + i]
        if i == STAGES - 1 and abs(d1) <= tolerance and m1 > 0.0:
            return 1.0
        part = c1 - c0
        fraction = impact_fraction(d0, part * m0, d1, part * m1, 0.5 * tolerance)
        if fraction == 0.0 and i == 0:
            speed = max(work[at.RATE_OLD + gap + 2], settings[IMPACT_FLOOR])
            work[active] = 1.0
            work[inverse] = 1.0 / speed
            work[at.FRESH] = 1.0
            return 0.0
        if fraction <= 1.0:
            fraction = c0 + part * fraction
            return 1.0 if fraction > 1.0 - 1e-7 and m1 > 0.0 else fraction
        d0, m0, c0 = d1, m1, c1
    return 2.0


@scalar_function
def kink_in(work, m, gap, tolerance):
    """Where in this step a gap changes sign, as a fraction; 2 if it does not, or so near an end that it does no harm."""
    h = work[at.STEP]
    d0, m0, c0 = work[at.RATE_OLD + gap], h * work[at.RATE_OLD + gap + 2], 0.0
    for i in range(STAGES):
        d1 = m[(at.RATE_NOW + gap) * STAGES + i]
        m1 = h * m[(at.RATE_NOW + gap + 2) * STAGES + i]
        c1 = m[lob.NODE * STAGES + i]
        at_end = (i == 0 and abs(d0) <= tolerance) or (i == STAGES - 1 and abs(d1) <= tolerance)
        if d0 * d1 < 0.0 and not at_end:
            part = c1 - c0
            return c0 + part * root(d0, part * m0, d1, part * m1, 1.0)
        d0, m0, c0 = d1, m1, c1
    return 2.0


@lane_function
def contact_change(flag, latched, work, m, gap, active, inverse, settings):
    """Fraction of the step at which a joint's contact begins or ends; 2 if it does not, 1 if an impact ends the step."""
    if flag is not None:
        if latched is not None and work[active] == 0.0:
            return impact_in(work, m, gap, active, inverse, settings)
        return kink_in(work, m, gap, settings[GAP_TOLERANCE])
    else:
        return 2.0


@lane_function
def stop_at_contacts(effects, work, m, settings):
    """Cut the step where a contact begins or ends inside it, and latch those that begin at its end."""
    first = contact_change(
        effects.crank_rod, effects.latched, work, m,
        at.GAP_12, at.ACTIVE_12, at.INVERSE_IMPACT_12, settings,
    )  # fmt: skip
    second = contact_change(
        effects.rod_slider, effects.latched, work, m,
        at.GAP_23, at.ACTIVE_23, at.INVERSE_IMPACT_23, settings,
    )  # fmt: skip
    fraction = min(first, second)
    if fraction < 1.0:
        h = work[at.STEP]
        work[at.ACCEPT] = 0.0
        work[at.NEXT_STEP] = fraction * h if fraction > 0.0 else h
        m[lob.KINKED] = 2.0
    else:
        if first == 1.0:
            latch(0, 1, work, settings, at.GAP_12, at.ACTIVE_12, at.INVERSE_IMPACT_12)
            m[lob.KINKED] = 2.0
        if second == 1.0:
            latch(0, 1, work, settings, at.GAP_23, at.ACTIVE_23, at.INVERSE_IMPACT_23)
            m[lob.KINKED] = 2.0

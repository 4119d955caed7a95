"""Peaks of contact forces and penetrations inside a step: at its ends they are too low by a fifth of a per cent, and more.

Between two instants a gap is the cubic through its values and rates there. The contact force goes with d**n (1 + c d') or
nearly so, n and c from the law, so that its largest value inside is known from that at either end.
"""

import math

from hpcclear.base.jit import lane_function, scalar_function
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.stepping.control import count_up, place
from hpcclear.dynamics.stepping.stops import hermite, hermite_integral, interior_peak

NEAR = 1.2
"""A peak above so many times the larger value at the ends of a step is not found: it would be a step that resolves nothing."""

TURNS = 4  # of false position: the force is flat at its peak, where it stands matters little


@lane_function
def shape(rules, work, par, p, i, W):
    """Exponent n of the depth in joint p's force, and factor c of the gap's rate, s/m."""
    block = at.JOINT_BLOCKS + at.JOINT_ROWS * p
    c = par[(block + at.DAMPING) * W + i]
    impact = work[(at.INVERSE_IMPACT + p) * W + i]
    return par[(block + at.EXPONENT) * W + i], c * (impact if rules.latched else 1.0)


@lane_function
def force_slope(d, rate, bend, n, c, h):
    """What has the sign of the force's rate at a gap d > 0, with its rate and its second derivative over the step h."""
    return n * h * h * rate * (1.0 + c * rate) + c * d * bend


@lane_function
def slopes_at_ends(d0, r0, d1, r1, n, c, h):
    """That at the start and at the end, by the cubic."""
    rise, m0, m1 = d1 - d0, h * r0, h * r1
    first = force_slope(d0, r0, 6.0 * rise - 4.0 * m0 - 2.0 * m1, n, c, h)
    return first, force_slope(d1, r1, 2.0 * m0 + 4.0 * m1 - 6.0 * rise, n, c, h)


@lane_function
def has_peak(d0, r0, d1, r1, n, c, h):
    """1 where the force rises at the start and falls at the end, both in contact."""
    first, last = slopes_at_ends(d0, r0, d1, r1, n, c, h)
    return 1.0 if (first > 0.0) & (last < 0.0) & (min(d0, d1) > 0.0) else 0.0


@lane_function
def is_deepest(d0, r0, d1, r1):
    """1 where the gap rises at the start and falls at the end, at least one of them in contact."""
    return 1.0 if (r0 > 0.0) & (r1 < 0.0) & (max(d0, d1) > 0.0) else 0.0


@lane_function
def ends_of(work, p, i, W):
    """Gaps, their rates and forces of joint p at both ends of a lane's step: d0, r0, d1, r1, f0, f1."""
    old, now = at.RATE_OLD + p, at.RATE_NOW + p
    gaps = work[(old + at.GAP) * W + i], work[(now + at.GAP) * W + i]
    rates = work[(old + at.GAP_RATE) * W + i], work[(now + at.GAP_RATE) * W + i]
    forces = work[(old + at.FORCE) * W + i], work[(now + at.FORCE) * W + i]
    return gaps[0], rates[0], gaps[1], rates[1], forces[0], forces[1]


@scalar_function
def peak_force(ends, lift, n, c, h):
    """Largest force over a time h in contact with a peak inside; `ends` as of `ends_of`.

    `lift` makes a quartic of the gap's cubic: of s^2 (1 - s)^2.
    """
    d0, r0, d1, r1, f0, f1 = ends
    m0, m1 = h * r0, h * r1
    c2 = 3.0 * (d1 - d0) - 2.0 * m0 - m1
    c3 = 2.0 * (d0 - d1) + m0 + m1
    low, high = 0.0, 1.0
    above, below = slopes_at_ends(d0, r0, d1, r1, n, c, h)
    d, rate = d0, r0
    for _ in range(TURNS):
        s = low + (high - low) * above / (above - below)
        turn = s * (1.0 - s)
        tilt = 1.0 - 2.0 * s
        d = hermite(d0, m0, d1, m1, s) + lift * turn * turn
        rate = (m0 + s * (2.0 * c2 + s * 3.0 * c3) + 2.0 * lift * turn * tilt) / h
        bend = 2.0 * c2 + 6.0 * s * c3 + 2.0 * lift * (tilt * tilt - 2.0 * turn)
        slope = force_slope(d, rate, bend, n, c, h)
        if slope > 0.0:
            low, above, below = s, slope, 0.5 * below  # halved, or one end would stay (Illinois)
        else:
            high, below, above = s, slope, 0.5 * above
    force, end, rate_there = (f0, d0, r0) if f0 > f1 else (f1, d1, r1)
    ratio = d / end
    grown = ratio * math.sqrt(ratio) if n == 1.5 else ratio**n
    inside = force * grown * (1.0 + c * rate) / (1.0 + c * rate_there)
    # not where a film adds to the force: what is found then is no peak of this law
    return inside if max(f0, f1) <= inside <= NEAR * max(f0, f1) else max(f0, f1)


@lane_function
def lane_has_peak(rules, work, par, p, i, W):
    """1 where an accepted step that counts holds a peak of joint p that may be the largest so far."""
    d0, r0, d1, r1, f0, f1 = ends_of(work, p, i, W)
    n, c = shape(rules, work, par, p, i, W)
    high = 1.0 if NEAR * max(f0, f1) > work[(at.PEAK + p) * W + i] else 0.0
    deep = 1.0 if NEAR * max(d0, d1) > work[(at.DEEPEST + p) * W + i] else 0.0
    peak = has_peak(d0, r0, d1, r1, n, c, work[at.STEP * W + i])
    found = max(high * peak, deep * is_deepest(d0, r0, d1, r1))
    return found * work[at.ACCEPT * W + i] * work[at.AVERAGING * W + i]


@scalar_function
def take_peak(rules, work, par, p, i, W):
    """Force and penetration of joint p inside a lane's step, where they are the largest so far."""
    h = work[at.STEP * W + i]
    ends = ends_of(work, p, i, W)
    d0, r0, d1, r1, _, _ = ends
    m0, m1 = h * r0, h * r1
    n, c = shape(rules, work, par, p, i, W)
    # the mean over the step, better than the cubic's, tells how far the gap bulges between its ends
    mean = work[(at.RATE_SUM + at.GAP + p) * W + i]
    lift = 30.0 * (mean - hermite_integral(d0, m0, d1, m1, 1.0))
    if has_peak(d0, r0, d1, r1, n, c, h) == 1.0:
        force = peak_force(ends, lift, n, c, h)
        work[(at.PEAK + p) * W + i] = max(work[(at.PEAK + p) * W + i], force)
    if is_deepest(d0, r0, d1, r1) == 1.0:
        depth = hermite(d0, m0, d1, m1, interior_peak(d0, m0, d1, m1))
        work[(at.DEEPEST + p) * W + i] = max(work[(at.DEEPEST + p) * W + i], depth)


@lane_function
def peaks_inside(rules, work, par, W):
    """Peaks of all lanes' accepted steps, before they are committed."""
    for joint in range(rules.begin, rules.end):
        p = place(joint)
        found = 0.0
        for i in range(W):
            flag = lane_has_peak(rules, work, par, p, i, W)
            work[at.SPECIAL * W + i] = flag
            found = count_up(found, flag)
        if found > 0.0:
            for i in range(W):
                if work[at.SPECIAL * W + i] == 1.0:
                    take_peak(rules, work, par, p, i, W)

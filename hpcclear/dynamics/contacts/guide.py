"""A corner of a slider against the face of a channel that is ahead of it: a circle of a small radius against a line.

A slider has four such contacts. The line of the guide runs in the middle of the channel; of the joint's rows, the bearing's
radius is the distance of a face from that line, the journal's that of the corner, so that the gap is, as of a pin, the
distance of the corner's centre less the difference of both. The contact point lies half-way through the overlap.
"""

from typing import Any

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.bits import no_less
from hpcclear.base.jit import apart, lane_function
from hpcclear.base.outcome import CORNERS
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.contacts.declared import ContactGeometry, Get, Shape
from hpcclear.dynamics.contacts.forces import (
    lost,
    normal_force,
    product,
    store_contact,
    swept,
    tangential_force,
)
from hpcclear.dynamics.layout.views import Parameters


@apart
@lane_function
def corner_force(effects, work, par, joint, relative, across, i, W):
    """Contact and friction of one corner; arguments and results as of `declared.Geometry`.

    `relative`: the corner's centre, counted from a point of the line; `across`: the unit vector from the line to the face.
    """
    ex, ey, vx, vy, spin_journal, spin_bearing = relative
    nx, ny = across
    block = joint.block
    half = par[(block + at.BEARING_RADIUS) * W + i]
    radius = par[(block + at.JOURNAL_RADIUS) * W + i]
    ahead = ey * nx - ex * ny  # along the face
    gap = ex * nx + ey * ny - (half - radius)
    rate = vx * nx + vy * ny + swept(spin_bearing, ahead)
    depth = no_less(gap, 0.0)
    normal = normal_force(effects, work, par, joint, depth, rate, i, W)
    arm_journal = radius - 0.5 * depth
    arm_bearing = half + 0.5 * depth
    along = vy * nx - vx * ny
    sliding = along + swept(spin_journal, arm_journal) - swept(spin_bearing, arm_bearing)
    tangential = tangential_force(effects, work, par, joint, sliding, normal, i, W)
    rubs = effects.friction
    touch, forces = (depth, rate, sliding), (normal, tangential)
    loss = lost(effects, work, par, joint, touch, forces, i, W)
    work[(at.RATE_NOW + joint.gap) * W + i] = gap
    work[(at.RATE_NOW + joint.force) * W + i] = normal
    store_contact(effects, work, par, joint, (touch, forces, across), i, W)
    return (
        normal * nx - product(rubs, tangential, ny),
        normal * ny + product(rubs, tangential, nx),
        product(rubs, tangential, arm_bearing) - normal * ahead,
        -product(rubs, tangential, arm_journal),
        loss,
    )


def shape(get: Get) -> Shape:
    """Numbers of a guide's corners; laws of contact get a journal of the corner's radius on a plane, in which a bearing's
    R_B R_J/c is that radius."""
    clearance, radius = get("clearance"), get("corner_radius")
    half = 0.5 * get("height") + clearance
    return Shape(clearance, half, radius, (radius, radius, radius), radius)


def reach(parameters: Parameters, place: int) -> Array:
    """Of a corner's centre from the line, m, shape (...): of samples."""
    return parameters.bearing_radius[..., place] - parameters.journal_radius[..., place]


def corner(
    middle: tuple[float, float], size: tuple[float, float], radius: float, which: str
) -> tuple[float, float]:
    """Centre of a corner's circle in the slider's axes, m; `middle` of the slider, `size`: length and height."""
    (x, y), (ahead, aside) = middle, CORNERS[which]
    return x + ahead * (0.5 * size[0] - radius), y + aside * (0.5 * size[1] - radius)


def gap_of(joint: Any, which: str, offset: float, tilt: float) -> Array | float:
    """Gap of a corner, m, below 0 in flight, of a slider `offset` from the middle of its channel and tilted by `tilt`, rad."""
    x, y = corner((0.0, 0.0), (joint.length, joint.height), joint.corner_radius, which)
    side = CORNERS[which][1]
    away: Array | float = side * (offset + x * np.sin(tilt) + y * np.cos(tilt))
    return away + joint.corner_radius - 0.5 * joint.height - joint.clearance


GEOMETRY = ContactGeometry(
    name="guide",
    words="corner of a slider against the face of its channel",
    force=corner_force,
    shape=shape,
    reach=reach,
    along_a_line=True,
)

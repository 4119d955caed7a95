"""An arc of the journal's body against a wall of the bearing's: the forces of one contact, whatever the wall's shape.

What a geometry of contact says of it (`hpcclear.scene.contacts`) is where they touch. The contact point lies half-way through
the overlap. The gap's rate follows from the motion of both bodies along the normal, since the wall does not deform.
"""

from hpcclear.base.bits import no_less
from hpcclear.base.jit import apart, lane_function
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.contacts import forces


@apart
@lane_function
def wall_force(effects, work, par, joint, relative, touching, i, W):
    """Contact and friction of one arc.

    `relative`: the arc's centre and its velocity relative to a place of the bearing's body (ex, ey, vx, vy), and the angular
    velocities of journal and bearing, None for what never turns; `touching`: the unit vector from the arc into the wall, the
    gap, and how far the wall is from that place along the vector.
    Returns the force on the bearing at its place (the journal gets the opposite at its own), the moments on bearing and
    journal about these places, and the power that is lost.
    """
    ex, ey, vx, vy, spin_journal, spin_bearing = relative
    nx, ny, gap, half = touching
    radius = par[(joint.block + at.JOURNAL_RADIUS) * W + i]
    ahead = ey * nx - ex * ny  # along the wall
    rate = vx * nx + vy * ny + forces.swept(spin_bearing, ahead)
    depth = no_less(gap, 0.0)
    normal = forces.normal_force(effects, work, par, joint, depth, rate, i, W)
    arm_journal = radius - 0.5 * depth
    arm_bearing = half + 0.5 * depth
    along = vy * nx - vx * ny + forces.swept(spin_journal, arm_journal)
    sliding = along - forces.swept(spin_bearing, arm_bearing)
    tangential = forces.tangential_force(effects, work, par, joint, sliding, normal, i, W)
    rubs = effects.friction
    touch, pushes = (depth, rate, sliding), (normal, tangential)
    loss = forces.lost(effects, work, par, joint, touch, pushes, i, W)
    work[(at.RATE_NOW + joint.gap) * W + i] = gap
    work[(at.RATE_NOW + joint.force) * W + i] = normal
    forces.store_contact(effects, work, par, joint, (touch, pushes, (nx, ny)), i, W)
    return (
        normal * nx - forces.product(rubs, tangential, ny),
        normal * ny + forces.product(rubs, tangential, nx),
        forces.product(rubs, tangential, arm_bearing) - normal * ahead,
        -forces.product(rubs, tangential, arm_journal),
        loss,
    )

"""heyoka: Taylor's method; a step ends where a contact begins, and creeps up to where it ends.

Without friction, since a clipped ramp would add events of its own. One trajectory at a time, or several in the
lanes of one processor vector (`solve_batch`).
"""

from collections.abc import Callable
from functools import cache

import heyoka as hy
import numpy as np
from plain_loop import (
    CRANK,
    FAR,
    FIRST,
    NEAR,
    ROD_INERTIA,
    ROD_MASS,
    SECOND,
    SLIDER_MASS,
    STIFFNESS,
)
from scenes import Setup

from hpcclear.dynamics import layout as at
from peers.system import SLIDER, STATES, Array, end_time, start

_NAMES = ("x2", "y2", "theta", "x3", "vx2", "vy2", "spin", "v3")
# what the equations read, in the order of heyoka's run-time parameters
_USED = (
    at.SPEED,
    CRANK,
    NEAR,
    FAR,
    ROD_MASS,
    ROD_INERTIA,
    SLIDER_MASS,
    *(base + row for base in (FIRST, SECOND) for row in (at.CLEARANCE, STIFFNESS, at.DAMPING)),
)


_PAST = 1e-10
"""m; a step ends this deep in contact, where the sign of the gap is beyond doubt (the force is 1e-5 N there)."""


def _joint(ex, ey, vx, vy, clearance, stiffness, damping):
    """What passes zero just inside the contact, and the force on the bearing."""
    square = ex * ex + ey * ey
    touching = hy.gt(square, clearance * clearance)
    # in flight any positive numbers do: the branch not taken does not count
    distance = hy.sqrt(hy.select(touching, square, 1.0))
    depth = hy.select(touching, distance - clearance, 1.0)
    factor = hy.relu(1.0 + damping * (vx * ex + vy * ey) / distance)
    normal = hy.select(touching, stiffness * depth * hy.sqrt(depth) * factor, 0.0)
    entered = square - (clearance + _PAST) * (clearance + _PAST)
    return entered, normal * ex / distance, normal * ey / distance


@cache
def _equations():
    """Equations of motion, and what passes zero where a contact has begun."""
    x2, y2, theta, x3, vx2, vy2, spin, v3 = hy.make_vars(*_NAMES)
    speed, crank, near, far, m2, i2, m3 = (hy.par[k] for k in range(7))
    sphi, cphi = hy.sin(speed * hy.time), hy.cos(speed * hy.time)
    st, ct = hy.sin(theta), hy.cos(theta)
    entered1, fx1, fy1 = _joint(
        crank * cphi - (x2 - near * ct), crank * sphi - (y2 - near * st),
        -crank * speed * sphi - (vx2 + near * spin * st),
        crank * speed * cphi - (vy2 - near * spin * ct), *(hy.par[k] for k in (7, 8, 9)),
    )  # fmt: skip
    entered2, fx2, fy2 = _joint(
        x3 - (x2 + far * ct), -(y2 + far * st),
        v3 - (vx2 - far * spin * st), -(vy2 + far * spin * ct),
        *(hy.par[k] for k in (10, 11, 12)),
    )  # fmt: skip
    moment = near * (st * fx1 - ct * fy1) + far * (ct * fy2 - st * fx2)
    system = [
        (x2, vx2), (y2, vy2), (theta, spin), (x3, v3),
        (vx2, (fx1 + fx2) / m2), (vy2, (fy1 + fy2) / m2),
        (spin, moment / i2), (v3, -fx2 / m3),
    ]  # fmt: skip
    return system, (entered1, entered2)


def _go_on(*_):
    """An event only ends a step: the next one starts in the other branch."""
    return True


@cache
def _single(rtol: float):
    system, switches = _equations()
    events = [
        hy.t_event(switch, callback=_go_on, direction=hy.event_direction.positive)
        for switch in switches
    ]
    return hy.taylor_adaptive(system, np.zeros(STATES), tol=rtol, t_events=events, pars=[1.0] * 13)


def solve(setup: Setup, sample: int = 0) -> float:
    """Slider position at the end, one trajectory."""
    integrator = _single(max(setup.problem.rtol, 2.3e-16))
    integrator.reset_cooldowns()
    integrator.time = 0.0
    integrator.state[:] = start(setup, sample)
    integrator.pars[:] = setup.par[sample, list(_USED)]
    integrator.propagate_until(end_time(setup, sample))
    return float(integrator.state[SLIDER])


@cache
def _batch(rtol: float, width: int):
    system, switches = _equations()
    events = [
        hy.t_event_batch(switch, callback=_go_on, direction=hy.event_direction.positive)
        for switch in switches
    ]
    return hy.taylor_adaptive_batch(
        system, np.zeros((STATES, width)), tol=rtol, t_events=events, pars=np.ones((13, width))
    )


def solve_batch(setup: Setup) -> Array:
    """Slider positions at the end, as many trajectories at once as a processor vector holds."""
    width = hy.recommended_simd_size()
    integrator = _batch(max(setup.problem.rtol, 2.3e-16), width)
    found = np.empty(len(setup.par))
    for first in range(0, len(setup.par), width):
        samples = np.minimum(np.arange(first, first + width), len(setup.par) - 1)
        integrator.reset_cooldowns()
        integrator.set_time(0.0)
        integrator.state[:] = np.stack([start(setup, k) for k in samples], axis=1)
        integrator.pars[:] = setup.par[samples][:, list(_USED)].T
        integrator.propagate_until([end_time(setup, k) for k in samples])
        found[samples] = integrator.state[SLIDER]
    return found


SOLVERS: dict[str, Callable[[Setup, int], float]] = {"heyoka": solve}
BATCH = {"heyoka batch": solve_batch}
LAWS = ("frictionless",)

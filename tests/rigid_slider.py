"""The slider-crank with clearance in its guide by Flores, Leine and Glocker 2010, rigid and on its own: numbers, equations of
motion of its three angles by Lagrange, and impacts of single corners by Newton's restitution with Coulomb friction.

Shares nothing with the package. doi:10.1007/s11044-009-9178-y
"""

from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

# length, mass, inertia about the middle
CRANK, ROD = ((0.153, 0.038, 7.4e-5), (0.306, 0.038, 5.9e-4))
SLIDER, TURNING = 0.076, 2.7e-6
HALF_LENGTH, HALF_HEIGHT, GAP = 0.05, 0.025, 0.001
RESTITUTION, FRICTION, GRAVITY = 0.4, 0.01, 9.81
START = (0.0, 0.0, 0.0, 150.0, -75.0, 0.0)
CORNERS = {
    "front_left": (1, 1),
    "front_right": (1, -1),
    "back_left": (-1, 1),
    "back_right": (-1, -1),
}


def masses(y):
    (a, m1, i1), (b, m2, i2) = CRANK, ROD
    crossed = (0.5 * m2 + SLIDER) * a * b * np.cos(y[0] - y[1])
    first = i1 + 0.25 * m1 * a * a + (m2 + SLIDER) * a * a
    second = i2 + 0.25 * m2 * b * b + SLIDER * b * b
    return np.array([[first, crossed, 0.0], [crossed, second, 0.0], [0.0, 0.0, TURNING]])


def flight(_, y):
    """Rates of (crank, rod, slider angles, their speeds) without contact."""
    (a, m1, _), (b, m2, _) = CRANK, ROD
    h = (0.5 * m2 + SLIDER) * a * b * np.sin(y[0] - y[1])
    force = [
        -h * y[4] ** 2 - GRAVITY * (0.5 * m1 + m2 + SLIDER) * a * np.cos(y[0]),
        h * y[3] ** 2 - GRAVITY * (0.5 * m2 + SLIDER) * b * np.cos(y[1]),
        0.0,
    ]
    return [*y[3:], *np.linalg.solve(masses(y), force)]


def corner(y, name, radius):
    """Gap of a corner (positive in flight), and Jacobians of its height towards the face and of sliding along +x there."""
    ahead, left = CORNERS[name]
    x, h = ahead * (HALF_LENGTH - radius), left * (HALF_HEIGHT - radius)
    c, s = np.cos(y[2]), np.sin(y[2])
    height = CRANK[0] * np.sin(y[0]) + ROD[0] * np.sin(y[1]) + x * s + h * c
    up = np.array([CRANK[0] * np.cos(y[0]), ROD[0] * np.cos(y[1]), x * c - h * s])
    along = np.array(
        [-CRANK[0] * np.sin(y[0]), -ROD[0] * np.sin(y[1]), -x * s - h * c - left * radius]
    )
    return HALF_HEIGHT + GAP - radius - left * height, left * up, along


class Impact(NamedTuple):
    time: float
    crank: float  # rad
    corner: str
    approach: float  # m/s
    lost: float  # J


def impacts(count, radius, tilt=0.0, end=0.2):
    """The first impacts of the rigid slider, tilted at the start; fewer where they accumulate."""
    y, time, found = np.array(START, float), 0.0, []
    y[2] = tilt
    names = list(CORNERS)

    def event(name):
        def gap(_, z):
            return corner(z, name, radius)[0]

        gap.terminal, gap.direction = True, -1.0
        return gap

    while len(found) < count:
        solution = solve_ivp(
            flight, (time, end), y, method="DOP853", rtol=1e-12, atol=1e-13, max_step=2e-4,
            events=[event(name) for name in names],
        )  # fmt: skip
        hit = [k for k, one in enumerate(solution.t_events) if len(one)]
        if not hit:
            break
        time, y, name = float(solution.t[-1]), solution.y[:, -1].copy(), names[hit[0]]
        _, towards, along = corner(y, name, radius)
        approach, M, speed = towards @ y[3:], masses(y), y[3:].copy()
        push = np.linalg.solve(M, -towards - FRICTION * np.sign(along @ y[3:]) * along)
        impulse = -(1.0 + RESTITUTION) * approach / (towards @ push)
        y[3:] += impulse * push
        lost = 0.5 * (speed @ M @ speed - y[3:] @ M @ y[3:])
        found.append(Impact(time, float(y[0]), name, float(approach), float(lost)))
        if approach < 1e-4:
            break
    return found


def before_impact(times):
    """States (6, t) at instants before the first impact."""
    return solve_ivp(
        flight, (0.0, max(times)), START, method="DOP853", rtol=1e-13, atol=1e-14, t_eval=times,
        max_step=1e-5,
    ).y  # fmt: skip

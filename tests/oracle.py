"""The slider-crank in complex numbers, integrated by scipy: an answer that owes nothing to the kernel.

A point of the plane is a complex number, a turn by an angle a factor, and a force acts at the point where it acts:
Newton's and Euler's equations need no formula for lever arms then. Impacts end a leg of the integration; the next leg
starts there with the new impact speed.
"""

import cmath
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

X, Y, ANGLE, SLIDER = range(4)  # coordinates; velocities follow, then the integrals of both gaps
SCALES = np.array([1e-3, 1e-3, 1e-2, 1e-3, 1.0, 1.0, 50.0, 1.0, 1e-5, 1e-5])


@dataclass
class Joint:
    """A pin with play. `damping` is chi in s/m, or a(c_e) where the impact speed is latched."""

    clearance: float
    bearing_radius: float
    stiffness: float
    damping: float
    latched: bool
    friction: float
    ramp: float
    floor: float
    touching: bool = False
    impact_speed: float = math.inf
    law: Callable[[float, float, float], float] | None = None
    """Normal force of depth, rate and impact speed, in place of the one of `stiffness` and `damping`."""
    rubs: Callable[[float], float] | None = None
    """Friction over normal force of the sliding speed, in place of Coulomb's."""

    def forces(
        self, journal: complex, bearing: complex, speeds: tuple[complex, complex], spins: tuple[float, float]
    ):  # fmt: skip
        """Force on the journal, and the point where it acts; the bearing feels the opposite there."""
        e = journal - bearing
        distance = abs(e)
        depth = distance - self.clearance
        if depth <= 0.0 or (self.latched and not self.touching):
            return 0j, journal
        n = e / distance
        point = bearing + n * (self.bearing_radius + 0.5 * depth)
        slip = (
            speeds[0]
            + 1j * spins[0] * (point - journal)
            - speeds[1]
            - 1j * spins[1] * (point - bearing)
        )
        rate = ((speeds[0] - speeds[1]) * n.conjugate()).real
        relative = rate / self.impact_speed if self.latched else rate
        normal = self.stiffness * depth**1.5 * (1.0 + self.damping * relative)
        if self.law is not None:
            normal = self.law(depth, rate, self.impact_speed)
        normal = max(normal, 0.0)
        sliding = (slip * (1j * n).conjugate()).real
        ratio = self.friction * max(-1.0, min(1.0, sliding / self.ramp))
        tangential = normal * (ratio if self.rubs is None else self.rubs(sliding))
        return -n * (normal + 1j * tangential), point


class SliderCrank:
    """Both joints open, constant crank speed, Hunt-Crossley or Lankarani-Nikravesh, Coulomb friction, gravity.

    Reads a scene's content (SI, as `Scene.resolved` gives it).
    """

    def __init__(self, scene: dict) -> None:
        body, effects = scene["mechanism"], scene["effects"]
        self.speed = scene["drive"]["speed"]
        self.crank = body["crank"]["length"]
        self.length = body["rod"]["length"]
        self.near = body["rod"]["mass_center"]
        self.mass, self.inertia = body["rod"]["mass"], body["rod"]["inertia"]
        self.slider_mass = body["slider"]["mass"]
        self.gravity = effects.get("gravity", 0.0)
        self.joints = [
            self._joint(scene["joints"][name], effects) for name in ("crank_rod", "rod_slider")
        ]
        self.evaluations = 0

    @staticmethod
    def _joint(joint: dict, effects: dict) -> Joint:
        c, radius = joint["clearance"], joint["bearing_radius"]
        softness = sum(
            (1.0 - part["poisson_ratio"] ** 2) / part["youngs_modulus"]
            for part in (joint["bearing"], joint["journal"])
        )
        law, friction = effects["contact"], effects.get("friction", {"law": "none"})
        latched = law["law"] == "lankarani-nikravesh"
        return Joint(
            clearance=c,
            bearing_radius=radius,
            stiffness=4.0 / (3.0 * softness) * math.sqrt(radius * (radius - c) / c),
            damping=3.0 / 4.0 * (1.0 - law["restitution"] ** 2) if latched else law["damping"],
            latched=latched,
            friction=friction.get("coefficient", 0.0),
            ramp=friction.get("ramp_speed", 1.0),
            floor=law.get("minimum_impact_speed", 1e-3),
        )

    def start(self) -> np.ndarray:
        """Outstretched, journals centred, velocities of the ideal mechanism."""
        spin = -self.speed * self.crank / self.length
        velocity = self.speed * self.crank + spin * self.near
        position = [self.crank + self.near, 0.0, 0.0, self.crank + self.length]
        return np.array([*position, 0.0, velocity, spin, 0.0, 0.0, 0.0])

    def ends(self, t: float, y: np.ndarray):
        """Places, velocities and spins of (journal, bearing) at O12 and O23."""
        pin = cmath.rect(self.crank, self.speed * t)
        rod, v = complex(y[X], y[Y]), complex(y[4], y[5])
        along, spin = cmath.rect(1.0, y[ANGLE]), y[6]
        ends = (-self.near * along, (self.length - self.near) * along)
        return (
            (
                pin,
                rod + ends[0],
                (1j * self.speed * pin, v + 1j * spin * ends[0]),
                (self.speed, spin),
            ),
            (
                complex(y[SLIDER]),
                rod + ends[1],
                (complex(y[7]), v + 1j * spin * ends[1]),
                (0.0, spin),
            ),
        )

    def gap(self, joint: int, t: float, y: np.ndarray) -> float:
        """|e| - c in m."""
        journal, bearing, _, _ = self.ends(t, y)[joint]
        return abs(journal - bearing) - self.joints[joint].clearance

    def rate(self, joint: int, t: float, y: np.ndarray) -> float:
        """Its time derivative in m/s."""
        journal, bearing, speeds, _ = self.ends(t, y)[joint]
        e = journal - bearing
        return ((speeds[0] - speeds[1]) * e.conjugate()).real / abs(e)

    def derivative(self, t: float, y: np.ndarray) -> list[float]:
        """Velocities, accelerations and both |gap|."""
        self.evaluations += 1
        total, moment, on_slider = 0j, 0.0, 0.0
        centre = complex(y[X], y[Y])
        gaps = []
        for joint, (journal, bearing, speeds, spins) in zip(
            self.joints, self.ends(t, y), strict=True
        ):
            force, point = joint.forces(journal, bearing, speeds, spins)
            total -= force
            moment -= ((point - centre).conjugate() * force).imag
            on_slider = force.real  # the last joint's journal is the slider's pin
            gaps.append(abs(abs(journal - bearing) - joint.clearance))
        a = total / self.mass
        return [
            *y[4:8], a.real, a.imag - self.gravity, moment / self.inertia, on_slider / self.slider_mass, *gaps,
        ]  # fmt: skip

    def _crossing(self, joint: int, upward: bool) -> Callable[[float, np.ndarray], float]:
        def event(t, y):
            return self.gap(joint, t, y)

        event.terminal, event.direction = True, 1.0 if upward else -1.0
        return event

    def leg(self, y: np.ndarray, start: float, end: float, method: str, rtol: float) -> np.ndarray:
        """State at `end`: impacts and ends of contacts are stopped at where the law remembers them."""
        watched = [k for k, joint in enumerate(self.joints) if joint.latched]
        while start < end:
            events = [self._crossing(k, upward=not self.joints[k].touching) for k in watched]
            solution = solve_ivp(
                self.derivative, (start, end), y, method=method, rtol=rtol, atol=rtol * SCALES,
                events=events or None, first_step=min(1e-8, end - start),
            )  # fmt: skip
            if not solution.success:
                raise RuntimeError(solution.message)
            start, y = solution.t[-1], solution.y[:, -1]
            for k, times in zip(watched, solution.t_events or [], strict=True):
                if len(times):
                    joint = self.joints[k]
                    joint.touching = not joint.touching
                    joint.impact_speed = max(self.rate(k, start, y), joint.floor)
        return y

    def run(self, transient: int, averaged: int, method: str = "LSODA", rtol: float = 1e-10):
        """State at the end, and the objective over the averaged revolutions."""
        y, period = self.start(), 2.0 * math.pi / self.speed
        for k in range(transient + averaged):
            if k == transient:
                y[8:] = 0.0
            y = self.leg(y, k * period, (k + 1) * period, method, rtol)
        return y, math.hypot(y[8], y[9]) / (averaged * period)

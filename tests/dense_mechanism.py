"""The slider-crank by the textbook, for comparison with the kernel: nine coordinates, dense matrices, plain numpy.

Shares no formula with the package: forces act at points given in the plane, constraints are functions of the nine
coordinates, and one linear system gives accelerations and multipliers (paper eq. 11).
"""

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import film_by_quadrature as quadrature
import numpy as np

# coordinates of the three bodies: crank, rod, slider
X1, Y1, PHI, X2, Y2, THETA2, X3, Y3, THETA3 = range(9)


def turned(vector, angle):
    """A body-fixed vector in the plane (works for complex angles, too)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]])


def cross(a, b):
    return a[0] * b[1] - a[1] * b[0]


class Touch(NamedTuple):
    """Journal and bearing as circles: gap, depth, normal from bearing to journal and tangent, and where they touch."""

    gap: float
    depth: float
    n: np.ndarray
    t: np.ndarray
    place: np.ndarray  # half way between both surfaces


def touching(joint, e, centre_b) -> Touch:
    """Of a journal whose centre is at `e` from the bearing's."""
    distance = np.linalg.norm(e)
    n = e / distance
    gap = distance - joint.clearance
    depth = max(gap, 0.0)
    place = centre_b + (joint.bearing_radius + depth / 2) * n
    return Touch(gap, depth, n, np.array([-n[1], n[0]]), place)


@dataclass
class Joint:
    """A joint with clearance."""

    clearance: float
    stiffness: float
    bearing_radius: float
    factor: Any  # 1 + damping as a function of the penetration rate
    friction: Any  # friction over normal force as a function of the sliding speed
    active: float = 1.0
    film: dict | None = (
        None  # factors of the models and of shear, and the least thickness over the clearance
    )


def film_forces(joint, e, velocity, spin_journal, spin_bearing):
    """Forces of an oil film on journal and bearing, and its moments on them about their own centres."""
    film, floor = joint.film, joint.film["floor"]
    ratio = np.linalg.norm(e) / joint.clearance
    least = (
        floor + np.clip(1 - ratio, 0, 2 * floor) ** 2 / (4 * floor) + max(1 - ratio - 2 * floor, 0)
    )
    place = (1 - least) * e / np.linalg.norm(e)
    mean = 0.5 * (spin_journal + spin_bearing)
    w = velocity - mean * np.array([-e[1], e[0]])
    force = film["short"] * quadrature.short(place, w) + film["long"] * quadrature.long(place, w)
    around = np.arange(2000) * np.pi / 1000
    shear = film["shear"] * (1 / quadrature.thickness(place, around)).mean()
    brake = shear * (spin_journal - spin_bearing)
    return (force, -force), (-brake - 0.5 * cross(e, force), brake - 0.5 * cross(e, force))


@dataclass
class Dense:
    """Masses, forces and constraints; `speed` None is a free crank."""

    crank: dict
    rod: dict
    slider_mass: float
    speed: float | None = None
    torque: float = 0.0
    gravity: float = 0.0
    load: float = 0.0
    guide: Any = None  # friction over guide reaction as a function of the slider's speed
    o12: Joint | None = None
    o23: Joint | None = None
    alpha: float = 0.0
    beta: float = 0.0
    offset: float = 0.0  # of the slider's line from the crank's axis
    seen: dict = field(default_factory=dict)

    def constraints(self, q, t):
        """Position constraints, one row each; the first two hold the crank's bearing."""
        crank, rod = self.crank, self.rod
        bearing = np.array([q[X1], q[Y1]]) + turned([-crank["u"], 0.0], q[PHI])
        rows = [*bearing, q[Y3] - self.offset, q[THETA3]]
        if self.speed is not None:
            rows.append(q[PHI] - self.speed * t)
        if self.o12 is None:
            rows += list(self.crank_pin(q) - self.rod_near(q))
        if self.o23 is None:
            rod_far = np.array([q[X2], q[Y2]]) + turned([rod["length"] - rod["u"], 0.0], q[THETA2])
            rows += list(np.array([q[X3], q[Y3]]) - rod_far)
        return np.array(rows)

    def crank_pin(self, q):
        offset = self.crank["length"] - self.crank["u"]
        return np.array([q[X1], q[Y1]]) + turned([offset, 0.0], q[PHI])

    def rod_near(self, q):
        return np.array([q[X2], q[Y2]]) + turned([-self.rod["u"], 0.0], q[THETA2])

    def jacobian(self, q, t):
        """Derivative of the constraints by complex steps: exact to rounding."""
        columns = []
        for k in range(9):
            z = q.astype(complex)
            z[k] += 1e-30j
            columns.append(self.constraints(z, t).imag / 1e-30)
        return np.array(columns).T

    def turning(self, q, v, t):
        """(d jacobian / dt) v, the second directional derivative of the constraints along v.

        Only positions of points depend on the angles, as cos and sin: their second derivative along v is minus the
        squared spin times the offset from the mass centre.
        """
        crank, rod = self.crank, self.rod
        rows = [*(v[PHI] ** 2 * turned([crank["u"], 0.0], q[PHI])), 0.0, 0.0]
        if self.speed is not None:
            rows.append(0.0)
        if self.o12 is None:
            rows += list(
                -(v[PHI] ** 2) * turned([crank["length"] - crank["u"], 0.0], q[PHI])
                + v[THETA2] ** 2 * turned([-rod["u"], 0.0], q[THETA2])
            )
        if self.o23 is None:
            rows += list(v[THETA2] ** 2 * turned([rod["length"] - rod["u"], 0.0], q[THETA2]))
        return np.array(rows)

    def masses(self):
        crank, rod = self.crank, self.rod
        m1, m2, m3 = crank["mass"], rod["mass"], self.slider_mass
        # the slider does not turn: any inertia gives the same motion
        return np.array([m1, m1, crank["inertia"], m2, m2, rod["inertia"], m3, m3, 0.7])

    def contact(self, joint, q, v, bearing, bearing_offset, journal, journal_offset):
        """Generalised forces of one contact; bearing and journal are the first coordinate of their bodies."""

        def point(body, offset):
            return q[body : body + 2] + turned(offset, q[body + 2])

        def speed(body, place):
            arm = place - q[body : body + 2]
            return v[body : body + 2] + v[body + 2] * np.array([-arm[1], arm[0]])

        centre_b, centre_j = point(bearing, bearing_offset), point(journal, journal_offset)
        e = centre_j - centre_b
        gap, depth, n, t, place = touching(joint, e, centre_b)
        rate = (speed(journal, centre_j) - speed(bearing, centre_b)) @ n
        # at the journal's own surface, which in contact is the same place
        own = centre_j + (joint.bearing_radius - joint.clearance - depth / 2) * n
        sliding = (speed(journal, own) - speed(bearing, place)) @ t
        elastic = joint.active * joint.stiffness * depth**1.5
        normal = max(elastic * joint.factor(rate), 0.0)
        tangential = normal * joint.friction(sliding)
        force = normal * n + tangential * t  # on the bearing
        Q = np.zeros(9)
        for body, sign in ((bearing, 1.0), (journal, -1.0)):
            Q[body : body + 2] += sign * force
            Q[body + 2] += sign * cross(place - q[body : body + 2], force)
        seen = {"gap": gap, "normal": normal, "rate": rate, "tangential": tangential}
        seen["sliding"] = sliding
        seen["loss"] = (normal - elastic) * rate + tangential * sliding
        if joint.film is not None:
            places = ((journal, centre_j), (bearing, centre_b))
            relative = speed(journal, centre_j) - speed(bearing, centre_b)
            pulls, moments = film_forces(joint, e, relative, v[journal + 2], v[bearing + 2])
            seen["normal"] = np.linalg.norm(normal * n - pulls[0])
            for (body, centre), pull, moment in zip(places, pulls, moments, strict=True):
                Q[body : body + 2] += pull
                Q[body + 2] += moment + cross(centre - q[body : body + 2], pull)
                seen["loss"] -= speed(body, centre) @ pull + moment * v[body + 2]
        seen["elastic_power"] = elastic * rate
        return Q, seen

    def accelerations(self, q, v, t=0.0):
        """Accelerations (9,); multipliers and powers stay in `seen`."""
        M = np.diag(self.masses())
        Q = np.zeros(9)
        Q[[Y1, Y2, Y3]] -= self.masses()[[Y1, Y2, Y3]] * self.gravity
        Q[X3] += self.load
        self.seen = {}
        if self.speed is None:
            Q[PHI] += self.torque
        if self.o12 is not None:
            offset = [self.crank["length"] - self.crank["u"], 0.0]
            forces, self.seen["o12"] = self.contact(
                self.o12, q, v, X2, [-self.rod["u"], 0.0], X1, offset
            )
            Q += forces
        if self.o23 is not None:
            offset = [self.rod["length"] - self.rod["u"], 0.0]
            forces, self.seen["o23"] = self.contact(self.o23, q, v, X2, offset, X3, [0.0, 0.0])
            Q += forces
        J, c = self.jacobian(q, t), self.constraints(q, t)
        dc = J @ v
        if self.speed is not None:
            dc[4] -= self.speed
        right = -self.turning(q, v, t) - 2 * self.alpha * dc - self.beta**2 * c
        ratio = 0.0 if self.guide is None else self.guide(v[X3])
        for sign in (1.0, -1.0):
            # friction on the slider: minus ratio times the size of the guide's reaction, multiplier 2
            K = np.block([[M, -J.T], [J, np.zeros((len(c), len(c)))]])
            K[X3, 9 + 2] += sign * ratio
            solution = np.linalg.solve(K, np.concatenate([Q, right]))
            if sign * solution[9 + 2] >= 0.0:
                break
        self.seen["multipliers"] = solution[9:]
        self.seen["guide_friction"] = ratio * abs(solution[9 + 2])
        self.seen["drive"] = self.torque if self.speed is None else solution[9 + 4]
        return solution[:9]


def assembled(mech, phi, e12, e23):
    """Nine coordinates of the mechanism with given crank angle and eccentricities."""
    crank, rod = mech.crank, mech.rod
    pin = crank["length"] * np.array([np.cos(phi), np.sin(phi)])
    near = pin - e12
    theta = np.arcsin((mech.offset - e23[1] - near[1]) / rod["length"])
    along = np.array([np.cos(theta), np.sin(theta)])
    slider = near[0] + rod["length"] * along[0] + e23[0]
    q = np.zeros(9)
    q[[X1, Y1]] = pin * crank["u"] / crank["length"]
    q[[PHI, THETA2, X3, Y3]] = phi, theta, slider, mech.offset
    q[[X2, Y2]] = near + rod["u"] * along
    return q


def admissible(mech, q, wanted, t=0.0):
    """Velocities closest to `wanted` that the constraints allow."""
    J = mech.jacobian(q, t)
    right = np.zeros(len(J))
    if mech.speed is not None:
        right[4] = mech.speed
    return wanted - np.linalg.lstsq(J, J @ wanted - right, rcond=None)[0]

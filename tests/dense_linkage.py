"""Any planar linkage by the textbook, for comparison with generated motions: three coordinates a body, dense matrices.

Shares no formula with the package: constraints are functions of the coordinates, differentiated by Taylor arithmetic;
forces act at points given in the plane; one dense system gives accelerations and multipliers. `Dense` reads the
mechanism's data only.
"""

import itertools
import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import film_by_quadrature as quadrature
import numpy as np
from rigid_slider import CORNERS
from scipy.integrate import solve_ivp

from hpcclear.dynamics.linkage import parts as m
from hpcclear.dynamics.linkage.assembly import assemble
from hpcclear.dynamics.linkage.mechanism import Mechanism
from hpcclear.scene.contacts.guide import PlanarSlide
from hpcclear.scene.contacts.pin_in_bearing import PlanarClearance
from hpcclear.scene.contacts.pin_in_slot import PlanarSlot
from hpcclear.scene.driving import PlanarRunUp, PlanarSpeed
from hpcclear.scene.joints import PlanarFixed, PlanarRevolute


class Jet:
    """Value, first and second derivative along one direction."""

    def __init__(self, *parts):
        self.parts = (*parts, 0.0, 0.0)[:3]

    def __add__(self, other):
        other = other if isinstance(other, Jet) else Jet(other)
        return Jet(*(a + b for a, b in zip(self.parts, other.parts, strict=True)))

    def __mul__(self, other):
        (a, da, dda), (b, db, ddb) = (
            self.parts,
            (other if isinstance(other, Jet) else Jet(other)).parts,
        )
        return Jet(a * b, da * b + a * db, dda * b + 2 * da * db + a * ddb)

    __radd__, __rmul__ = __add__, __mul__

    def __neg__(self):
        return self * -1.0

    def __sub__(self, other):
        return self + (-other)

    def __rsub__(self, other):
        return (-self) + other


def sine_and_cosine(x):
    if not isinstance(x, Jet):
        return math.sin(x), math.cos(x)
    a, d, dd = x.parts
    s, c = math.sin(a), math.cos(a)
    return Jet(s, c * d, c * dd - s * d * d), Jet(c, -s * d, -s * dd - c * d * d)


def turned(vector, angle):
    s, c = sine_and_cosine(angle)
    return [vector[0] * c - vector[1] * s, vector[0] * s + vector[1] * c]


class Touch(NamedTuple):
    """Journal and bearing as circles: gap, depth, normal from bearing to journal and tangent, and where they touch."""

    gap: float
    depth: float
    n: np.ndarray
    t: np.ndarray
    place: np.ndarray  # half way between both surfaces in contact, on that of the bearing in flight
    own: np.ndarray  # the same in contact, on the journal's surface in flight


def touching(joint, e, centre_b) -> Touch:
    """Of a journal whose centre is at `e` from the bearing's."""
    distance = np.linalg.norm(e)
    n = e / distance
    gap = distance - joint.clearance
    depth = max(gap, 0.0)
    place = centre_b + (joint.bearing_radius + depth / 2) * n
    return Touch(gap, depth, n, np.array([-n[1], n[0]]), place, place + (gap - depth) * n)


@dataclass
class Contact:
    """Laws of one contact."""

    factor: Any  # 1 + damping as a function of the penetration rate
    friction: Any  # friction over normal force as a function of the sliding speed
    active: float = 1.0
    film: Any = None  # factors of its models and shear, and the least thickness over the clearance


def film_forces(film, clearance, e, velocity, spin_journal, spin_bearing):
    """Force of an oil film on the journal, and its moments on journal and bearing about their own centres."""
    floor, ratio = film["floor"], np.linalg.norm(e) / clearance
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
    across = 0.5 * (e[0] * force[1] - e[1] * force[0])
    return force, np.array([-brake - across, brake - across])


@dataclass
class Dense:
    """Bodies, constraints and forces of a mechanism."""

    mechanism: Mechanism
    contacts: list = field(default_factory=list)
    gravity: float = 0.0
    alpha: float = 0.0
    beta: float = 0.0
    curve: float = 1.0  # what tables of loads and torques say
    curves: dict = field(default_factory=dict)  # or by name, functions of what they go by
    seen: dict = field(default_factory=dict)

    def __post_init__(self):
        self.first = {body.name: 3 * k for k, body in enumerate(self.mechanism.bodies)}
        self.n = 3 * len(self.first)

    def place(self, q, place):
        name, point = m.split(place)
        if name == m.GROUND:
            return list(self.mechanism.ground[point])
        body, k = self.mechanism.body(name), self.first[name]
        arm = np.subtract(body.points[point], body.center)
        x, y = turned(arm, q[k + 2])
        return [q[k] + x, q[k + 1] + y]

    def angle(self, q, place):
        name = m.split(place)[0]
        return 0.0 if name == m.GROUND else q[self.first[name] + 2]

    def driven(self, drive, t):
        if isinstance(drive, PlanarSpeed):
            return self.mechanism.body(drive.body).start_angle + drive.speed * t
        if isinstance(drive, PlanarRunUp):
            start, speed = self.mechanism.body(drive.body).start_angle, self.curves[drive.name]
            if not isinstance(t, Jet):
                return start + speed.antiderivative()(t)
            now, rate, _ = t.parts
            parts = speed.antiderivative()(now), speed(now) * rate, speed(now, 1) * rate**2
            return Jet(start + parts[0], *parts[1:])
        return (
            drive.mean
            + drive.amplitude * sine_and_cosine(2 * math.pi * drive.frequency * t + drive.phase)[0]
        )

    def constraints(self, q, t):
        """Rows by name: x and y of a pin; across and angle of a guide; the angle of a drive."""
        rows = {}
        for joint in self.mechanism.ideal:
            (x, y), (bx, by) = (self.place(q, place) for place in m.places_of(joint))
            if isinstance(joint, PlanarRevolute):
                rows |= {(joint.name, "x"): x - bx, (joint.name, "y"): y - by}
                continue
            tilt = self.angle(q, joint.line) + joint.angle
            dx, dy = turned((1.0, 0.0), tilt)
            rows[joint.name, "across"] = dx * (y - by) - dy * (x - bx)
            if isinstance(joint, PlanarSlot):
                continue
            rows[joint.name, "angle"] = self.angle(q, joint.point) - tilt
            if isinstance(joint, PlanarFixed):
                rows[joint.name, "along"] = dx * (x - bx) + dy * (y - by)
        for drive in self.mechanism.drives:
            if drive.prescribed or isinstance(drive, PlanarRunUp):
                rows[drive.name, "drive"] = q[self.first[drive.body] + 2] - self.driven(drive, t)
        return rows

    def along(self, q, v, t, rate=1.0):
        """Constraints, first and second derivatives along v, time running at a rate: each (rows,)."""
        jets = [Jet(a, b) for a, b in zip(q, v, strict=True)]
        rows = self.constraints(jets, Jet(t, rate)).values()
        parts = [row.parts if isinstance(row, Jet) else (row, 0.0, 0.0) for row in rows]
        return np.array(parts).reshape(-1, 3).T

    def jacobian(self, q, t):
        return np.array([self.along(q, e, t, 0.0)[1] for e in np.eye(self.n)]).T

    def motion_of(self, q, v, place):
        """Position and velocity of a place, and the Jacobian of its position."""
        here = np.array(self.place(q, place), float)
        J = self.point_on(q, m.split(place)[0], here)
        return here, J @ v, J

    def point_on(self, q, name, where):
        """Jacobian of the point of a body that is at `where` now."""
        J = np.zeros((2, self.n))
        if name != m.GROUND:
            k = self.first[name]
            J[0, k] = J[1, k + 1] = 1.0
            J[:, k + 2] = -(where[1] - q[k + 1]), where[0] - q[k]
        return J

    def turn_of(self, place):
        """Jacobian of the angle of a place's body."""
        J, name = np.zeros(self.n), m.split(place)[0]
        if name != m.GROUND:
            J[self.first[name] + 2] = 1.0
        return J

    def touches(self, joint, q):
        """Names of a joint's contacts, and where each touches (`Touch`)."""
        if isinstance(joint, PlanarClearance):
            journal, bearing = (
                np.array(self.place(q, place), float) for place in m.places_of(joint)
            )
            yield joint.name, touching(joint, journal - bearing, bearing)
            return
        middle, on_line = (np.array(self.place(q, place), float) for place in m.places_of(joint))
        line = self.angle(q, joint.line) + joint.angle
        if isinstance(joint, PlanarSlot):
            r, face = joint.pin_radius, joint.pin_radius + joint.clearance
            arms = {"left": (1, (0.0, 0.0)), "right": (-1, (0.0, 0.0))}
        else:
            r, face = joint.corner_radius, 0.5 * joint.height + joint.clearance
            half = 0.5 * joint.length - r, 0.5 * joint.height - r
            arms = {
                name: (left, (ahead * half[0], left * half[1]))
                for name, (ahead, left) in CORNERS.items()
            }
        for name, (left, arm) in arms.items():
            corner = middle + np.array(turned(arm, self.angle(q, joint.point)))
            n = left * np.array(turned((0.0, 1.0), line))  # towards the face
            gap = (corner - on_line) @ n + r - face
            depth = max(gap, 0.0)
            where = corner + (r - 0.5 * depth) * n
            yield (
                f"{joint.name}.{name}",
                Touch(gap, depth, n, np.array([-n[1], n[0]]), where, where),
            )

    def contact(self, joint, laws, q, v):
        """Generalised forces of a joint's contacts."""
        Q = sum(
            self.pressed(joint, one, touch, laws, q, v) for one, touch in self.touches(joint, q)
        )
        return Q if laws.film is None else Q + self.oiled(joint, laws.film, q, v)

    def oiled(self, joint, film, q, v):
        """Generalised forces of an oil film; what the joint bears and loses is with it."""
        places, seen = m.places_of(joint), self.seen[joint.name]
        (at_j, v_j, on_j), (at_b, v_b, on_b) = (self.motion_of(q, v, place) for place in places)
        turns = [self.turn_of(place) for place in places]
        spins = [turn @ v for turn in turns]
        pull, moments = film_forces(film, joint.clearance, at_j - at_b, v_j - v_b, *spins)
        Q = (on_j - on_b).T @ pull + moments @ np.array(turns)
        seen["normal"] = np.linalg.norm(seen["push"] - pull)
        seen["loss"] -= Q @ v
        return Q

    def pressed(self, joint, name, touch, laws, q, v):
        gap, depth, n, t, *ends = touch
        bodies = (m.split(place)[0] for place in reversed(m.places_of(joint)))
        on_b, on_j = map(self.point_on, (q, q), bodies, ends)
        rate = n @ (on_j - on_b) @ v
        sliding = t @ (on_j - on_b) @ v
        elastic = laws.active * stiffness(joint) * depth**1.5
        normal = max(elastic * laws.factor(rate), 0.0)
        tangential = normal * laws.friction(sliding)
        force = normal * n + tangential * t  # on the bearing
        loss = (normal - elastic) * rate + tangential * sliding
        self.seen[name] = {
            "gap": gap, "normal": normal, "rate": rate, "loss": loss, "elastic": elastic * rate,
            "push": normal * n, "tangential": tangential, "sliding": sliding,
        }  # fmt: skip
        return (on_b - on_j).T @ force

    def looked_up(self, load, q, t):
        """What the table of a load says."""
        if load.name not in self.curves:
            return self.curve
        body = load.angle_of or self.mechanism.period.body
        return self.curves[load.name](t if load.seconds else q[self.first[body] + 2])

    def loads(self, q, v, t=0.0):
        Q, power = np.zeros(self.n), 0.0
        for load in self.mechanism.loads:
            own = np.zeros(self.n)
            if load.kind == "force":
                force = np.array(load.components())
                if load.follows:
                    force = np.array(turned(force, self.angle(q, load.place)))
                own = self.motion_of(q, v, load.place)[2].T @ force
            elif load.kind == "torsion-spring":
                signs = self.turn_of(load.body) - self.turn_of(load.other or m.GROUND)
                angle, rate = signs @ q, signs @ v
                moment = load.stiffness * (load.angle - angle) - load.damping * rate
                if load.upper is not None and angle > load.upper:
                    moment += load.stop_stiffness * (load.upper - angle)
                if load.lower is not None and angle < load.lower:
                    moment += load.stop_stiffness * (load.lower - angle)
                own = signs * moment
            elif load.kind == "drag":
                k = self.first[load.body] + 2
                own[k] = -load.linear * v[k] - load.quadratic * v[k] * abs(v[k])
            elif load.kind == "torque":
                own[self.first[load.body] + 2] = load.constant
            else:
                (a, va, Ja), (b, vb, Jb) = (
                    self.motion_of(q, v, place) for place in (load.first, load.second)
                )
                length = np.linalg.norm(a - b)
                n = (a - b) / length
                rate = (va - vb) @ n
                if load.kind == "cylinder":
                    rows = load.force if isinstance(load.force, tuple) else ((0.0, load.force),)
                    pull = load.damping * rate - np.interp(length, *np.transpose(rows))
                else:
                    pull = load.stiffness * (length - load.length) + load.damping * rate
                    side = {"both": 0, "pushing": -1, "pulling": 1}[load.acts]
                    if side and (side * (length - load.length) <= 0 or side * pull <= 0):
                        pull = 0.0
                own = (Jb - Ja).T @ (n * pull)
            if load.table:
                own = own * self.looked_up(load, q, t)
            Q, power = Q + own, power + own @ v
        self.seen["load_power"] = power
        return Q

    def masses(self):
        """Diagonal of the mass matrix; what cannot turn may have any inertia."""
        found = np.zeros(self.n)
        for body in self.mechanism.bodies:
            drive = self.mechanism.drive_of(body.name)
            k = self.first[body.name]
            found[k : k + 2] = body.mass
            found[k + 2] = (body.inertia or 0.7) + getattr(drive, "flywheel_inertia", 0.0)
        return found

    def accelerations(self, q, v, t=0.0):
        """Accelerations; forces, powers and multipliers stay in `seen`."""
        M, self.seen = np.diag(self.masses()), {}
        Q = self.loads(q, v, t)
        Q[1::3] -= self.masses()[1::3] * self.gravity
        for drive in self.mechanism.drives:
            if not (drive.prescribed or isinstance(drive, PlanarRunUp)):
                k = self.first[drive.body] + 2
                torque = self.curve if drive.table or drive.torque is None else drive.torque
                if drive.torque_by_speed is not None:
                    torque = np.interp(v[k], *np.transpose(drive.torque_by_speed))
                self.seen.setdefault("torques", {})[drive.name] = torque
                Q[k] += torque
        for joint, laws in zip(self.mechanism.clearances, self.contacts, strict=True):
            Q += self.contact(joint, laws, q, v)
        J = self.jacobian(q, t)
        c, dc, turning = self.along(q, v, t)
        right = -turning - 2 * self.alpha * dc - self.beta**2 * c
        names = list(self.constraints(q, t))
        rubbed = [j for j in self.mechanism.joints if getattr(j, "friction", None)]
        guides = [j for j in rubbed if isinstance(j, PlanarSlide)]
        pins = [j for j in rubbed if not isinstance(j, PlanarSlide)]
        for signs in itertools.product((1.0, -1.0), repeat=len(guides)):
            K = np.block([[M, -J.T], [J, np.zeros((len(c), len(c)))]])
            loss, ok = 0.0, True
            rubbing = []
            for joint, sign in zip(guides, signs, strict=True):
                tilt = self.angle(q, joint.line) + joint.angle
                d = np.array(turned((1.0, 0.0), tilt))
                where = np.array(self.place(q, joint.point), float)
                on, under = (self.point_on(q, m.split(p)[0], where) for p in m.places_of(joint))
                influence = d @ (on - under)
                speed = influence @ v
                x = speed / joint.friction.ramp_speed
                ratio = joint.friction.coefficient * min(max(x, -1.0), 1.0)
                k = self.n + names.index((joint.name, "across"))
                K[: self.n, k] += sign * ratio * influence
                rubbing.append((k, sign, ratio * speed))
            solution, pin_loss = self.with_pins(pins, names, K, Q, right, v)
            ok = all(sign * solution[k] >= 0.0 for k, sign, _ in rubbing)
            loss = sum(power * abs(solution[k]) for k, _, power in rubbing)
            if ok:
                break
        assert ok
        self.seen["multipliers"] = dict(zip(names, solution[self.n :], strict=True))
        self.seen["guide_loss"] = loss + pin_loss
        return solution[: self.n]

    def with_pins(self, pins, names, K, Q, right, v):
        """The solution with moments mu r |reaction| of pins, by going round, and the power that they lose."""
        sizes = np.zeros(len(pins))
        for _ in range(100):
            given, loss = np.concatenate([Q, right]), 0.0
            for joint, size in zip(pins, sizes, strict=True):
                signs = self.turn_of(joint.journal) - self.turn_of(joint.bearing)
                rubs, turning = joint.friction, signs @ v
                x = turning * rubs.radius / rubs.ramp_speed
                moment = rubs.coefficient * rubs.radius * size * min(max(x, -1.0), 1.0)
                given[: self.n] -= moment * signs
                loss += moment * turning
            solution = np.linalg.solve(K, given)
            before = sizes
            sizes = np.array(
                [
                    np.hypot(*(solution[self.n + names.index((joint.name, k))] for k in "xy"))
                    for joint in pins
                ]
            )
            if np.abs(sizes - before).max(initial=0.0) <= 1e-14 * sizes.max(initial=0.0):
                return solution, loss
        raise AssertionError("reactions and friction of pins do not settle")


def stiffness(joint):
    """K of Hertz of a joint's contacts, N/m^1.5: of its materials, 2e9 where none are given."""
    materials = getattr(joint, "materials", None)
    if materials is None:
        return 2e9
    both = (materials.bearing, materials.journal)
    compliance = sum((1 - one.poisson_ratio**2) / one.youngs_modulus for one in both)
    if isinstance(joint, PlanarClearance):
        radius = joint.bearing_radius * (joint.bearing_radius - joint.clearance) / joint.clearance
    else:
        radius = getattr(joint, "corner_radius", None) or joint.pin_radius
    return 4 / (3 * compliance) * math.sqrt(radius)


def loose(dense, joint):
    """Functions of the coordinates: how far a slider is off its line, and its tilt."""

    def offset(q):
        (x, y), (bx, by) = (dense.place(q, place) for place in m.places_of(joint))
        dx, dy = turned((1.0, 0.0), dense.angle(q, joint.line) + joint.angle)
        return dx * (y - by) - dy * (x - bx)

    def tilt(q):
        return dense.angle(q, joint.point) - dense.angle(q, joint.line) - joint.angle

    return (offset,) if isinstance(joint, PlanarSlot) else (offset, tilt)


def assembled(dense, guess, t, eccentricities):
    """Coordinates near a guess that meet the constraints and put journals where they are asked to be."""
    q = np.array(guess, float)
    clear = dense.mechanism.clearances
    for _ in range(60):
        c = dense.along(q, np.zeros(dense.n), t)[0] if dense.constraints(q, t) else np.zeros(0)
        J = dense.jacobian(q, t).reshape(-1, dense.n)
        rows, jacobians = [c], [J]
        for joint, e in zip(clear, eccentricities, strict=True):
            (a, _, Ja), (b, _, Jb) = (
                dense.motion_of(q, np.zeros(dense.n), place) for place in m.places_of(joint)
            )
            if isinstance(joint, PlanarClearance):
                rows.append(a - b - e)
                jacobians.append(Ja - Jb)
                continue
            # across and tilt, by differences small enough for Newton's method
            for row, asked in zip(loose(dense, joint), e, strict=False):
                rows.append([row(q) - asked])
                slopes = [(row(q + h) - row(q - h)) / 2e-6 for h in 1e-6 * np.eye(dense.n)]
                jacobians.append([slopes])
        c = np.concatenate(rows)
        q = q - np.linalg.lstsq(np.vstack(jacobians), c, rcond=None)[0]
        if np.abs(c).max() < 1e-12:  # the step from there ends at rounding
            break
    assert np.abs(c).max() < 1e-12, np.abs(c).max()
    return q


def admissible(dense, q, wanted, t):
    """Velocities closest to `wanted` that the constraints allow."""
    J = dense.jacobian(q, t).reshape(-1, dense.n)
    if not len(J):
        return wanted
    given = -dense.along(q, np.zeros(dense.n), t)[1]
    return wanted - np.linalg.lstsq(J, J @ wanted - given, rcond=None)[0]


def start_of(dense):
    """Coordinates and velocities, (2, n), that a linkage starts with."""
    made = assemble(dense.mechanism)
    start = np.zeros((2, dense.n))
    for k, one in enumerate(made.loops.forest.coordinates):
        place = dense.first[one.body] + ("x", "y", "angle").index(one.kind)
        start[:, place] = made.q[k], made.v[k]
    return start


def comes_as(response, dense, start, end, rtol=1e-11):
    """Positions of all bodies up to a time (s) are those of the dense model, to 1e-8 m and rad; how many instants."""
    n, time = dense.n, response["time"].to_numpy()
    early = time[time <= end]
    y = solve_ivp(
        lambda t, y: [*y[n:], *dense.accelerations(y[:n], y[n:], t)], (0.0, end), start.ravel(),
        method="DOP853", rtol=rtol, atol=rtol / 100, max_step=end / 50, t_eval=early,
    ).y  # fmt: skip
    for k, name in enumerate(("body_x", "body_y", "body_angle")):
        seen = response[name].to_numpy()[: len(early)]
        np.testing.assert_allclose(seen, y[k:n:3].T, rtol=0, atol=1e-8)
    return len(early)

"""Generated motions as plain Python, and random states of their linkages."""

import math
import types
from functools import partial

import numpy as np
from dense_linkage import Contact, Jet, admissible, assembled, stiffness, turned
from some_laws import effects_with, row as row_of_law

from hpcclear.base import bits
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.contacts import bearing, forces, wall
from hpcclear.dynamics.linkage import elements
from hpcclear.dynamics.linkage.generator import On, Rows, generate
from hpcclear.dynamics.linkage.numbers import row_of, values
from hpcclear.dynamics.linkage.parts import GROUND, places_of, split
from hpcclear.dynamics.physics import angles, friction
from hpcclear.scene.contacts.guide import PlanarSlide

CHI, MU, RAMP = 0.5, 0.1, 0.3
GRAVITY, ALPHA, BETA = 9.81, 250.0, 240.0
EVERYTHING = On(friction=True, gravity=True, energies=True, series=True, impacts=True)
CONTACT = Contact(lambda rate: 1 + CHI * rate, lambda s: MU * min(max(s / RAMP, -1.0), 1.0))
FREE = 500  # rows of what the joints write
BLOCKS = 700  # of their parameters


PLAIN = {
    bits.bits_of: lambda x: np.float64(x).view(np.int64),
    bits.double_of: lambda n: float(np.int64(n).view(np.float64)),
}
"""What compiled code has of a processor's own, as ordinary Python."""


def plain(function, made=None):
    """A compiled function as ordinary Python, and all that it calls."""
    made = {} if made is None else made
    code = function.py_func
    if code not in made:
        names = {}
        made[code] = types.FunctionType(code.__code__, names)
        for name, value in code.__globals__.items():
            if value is forces:
                own = {key: _plain_value(one, made) for key, one in vars(forces).items()}
                names[name] = types.SimpleNamespace(**own)
            else:
                names[name] = _plain_value(value, made)
    return made[code]


def _plain_value(value, made):
    known = PLAIN.get(value) if callable(value) else None
    return known or (plain(value, made) if hasattr(value, "py_func") else value)


def plain_law(law):
    """A law in the lanes as ordinary Python."""
    own = {name: plain(one) for name, one in vars(law).items() if hasattr(one, "py_func")}
    return types.SimpleNamespace(latched=law.latched, bristled=law.bristled, **own)


_ON = effects_with({"fixed", "coulomb", "energies", "series"})
EFFECTS = _ON._replace(contact=plain_law(_ON.contact), friction=plain_law(_ON.friction))


_RATES = [
    "gap", "force", "rate", "friction", "force_kink", "low_kink", "high_kink", "sliding_power",
    "impact_power", "force_square", "objective_rate", "sliding_speed", "normal_x", "normal_y",
]  # fmt: skip


def joints_of(mechanism):
    """Rows of the joints in `work` and `par`."""
    rates = zip(_RATES, (*range(8), *range(10, 16)), strict=True)
    rows = {name: FREE + j - at.RATE_NOW for name, j in rates} | {
        "active": FREE + 8, "inverse_impact": FREE + 9
    }  # fmt: skip
    return tuple(
        types.SimpleNamespace(
            place=k, block=BLOCKS + at.JOINT_ROWS * k, further=0,
            **{name: row + 20 * k for name, row in rows.items()},
        )
        for k, _ in enumerate(mechanism.contacts)
    )  # fmt: skip


class Lane:
    """A generated motion as plain Python, with the rates where the layout has them."""

    def __init__(self, mechanism, on=EVERYTHING, *, feedback=(ALPHA, BETA), **options):
        self.mechanism = mechanism
        tabled = (*mechanism.drives, *mechanism.loads)
        curves = {one.name: 401 for one in tabled if one.table}
        rows = Rows(0, 100, 200, at.RATE_NOW + 1000, 400, free=100, curves=curves)
        self.text = generate(mechanism, on, rows, **options)
        names = {
            "joint_force": plain(bearing.joint_force),
            "wall_force": plain(wall.wall_force),
            "sincos": plain(angles.sincos),
            "saturated": plain(friction.saturated),
        }
        names |= {name: plain(getattr(elements, name)) for name in elements.functions()}
        names |= self.text.functions
        exec(self.text.source, names)
        self.run = names["lane"]
        base = values(
            mechanism, options.get("cartesian", False), gravity=GRAVITY, feedback=feedback
        )
        self.par = np.zeros(1000)
        for row, value in row_of(self.text, base).items():
            self.par[row] = value
        for k, contact in enumerate(mechanism.contacts):
            joint = contact.joint
            first = BLOCKS + at.JOINT_ROWS * k
            block = self.par[first : first + at.JOINT_ROWS]
            shape = joint.shape(partial(getattr, joint))
            block[at.CLEARANCE] = shape.clearance
            block[row_of_law("contact", "hunt-crossley", "stiffness")] = stiffness(joint)
            block[row_of_law("contact", "hunt-crossley", "damping")] = CHI
            block[at.BEARING_RADIUS] = shape.bearing_radius
            block[at.JOURNAL_RADIUS] = shape.journal_radius
            block[row_of_law("friction", "coulomb", "coefficient")] = MU
            block[row_of_law("friction", "coulomb", "inverse_ramp")] = 1 / RAMP

    def __call__(self, q, v, t):
        work = np.zeros(2000)
        n = len(q)
        work[:n], work[100 : 100 + n], work[400] = q, v, t
        work[401] = 1.0
        self.run(EFFECTS, joints_of(self.mechanism), work, self.par, 0, 1)
        return work[200 : 200 + n], work


def guess_of(mechanism):
    """A rough pose: bodies at their start angles, hung one after the other on what is placed already."""
    where = {GROUND: (np.zeros(2), 0.0)}
    bodies = {body.name: body for body in mechanism.bodies}

    def put(name, point, at_place):
        body = bodies[name]
        arm = np.subtract(body.center, body.points[point])
        c, s = math.cos(body.start_angle), math.sin(body.start_angle)
        offset = np.array([c * arm[0] - s * arm[1], s * arm[0] + c * arm[1]])
        where[name] = (at_place + offset, body.start_angle)

    def place(text):
        name, point = split(text)
        if name == GROUND:
            return np.array(mechanism.ground[point])
        (centre, angle), body = where[name], bodies[name]
        arm = np.subtract(body.points[point], body.center)
        c, s = math.cos(angle), math.sin(angle)
        return centre + np.array([c * arm[0] - s * arm[1], s * arm[0] + c * arm[1]])

    for _ in bodies:
        for joint in mechanism.joints:
            for own, other in (places_of(joint), places_of(joint)[::-1]):
                body, point = split(own)
                if body not in where and split(other)[0] in where:
                    put(body, point, place(other))
    return np.concatenate([[*where[name][0], where[name][1]] for name in bodies])


def random_states(dense, rng, count):
    """States that meet the constraints, journals about a clearance off centre, and their times."""
    mechanism = dense.mechanism
    guess = guess_of(mechanism)
    for _ in range(count):
        t = rng.uniform(0, 0.01)
        offsets = [
            joint.clearance
            * rng.uniform(0.7, 1.3)
            * np.array([math.cos(a), math.sin(a)])
            / (1.0, 0.5 * (getattr(joint, "length", None) or 2.0))
            for joint, a in zip(mechanism.clearances, rng.uniform(0, 6, 9), strict=False)
        ]
        q = assembled(
            dense,
            guess + 0.03 * rng.normal(size=dense.n) * np.tile([0.02, 0.02, 1], dense.n // 3),
            t,
            offsets,
        )
        wanted = rng.normal(size=dense.n) * np.tile([2.0, 2.0, 50.0], dense.n // 3)
        yield q, admissible(dense, q, wanted, t), t


def sliding(dense, q, v, a):
    """Displacement, velocity and acceleration along each guide."""
    jets = [Jet(*parts) for parts in zip(q, v, a, strict=True)]
    found = {}
    for joint in dense.mechanism.ideal:
        if isinstance(joint, PlanarSlide):
            (x, y), (bx, by) = (dense.place(jets, p) for p in places_of(joint))
            dx, dy = turned((1.0, 0.0), dense.angle(jets, joint.line) + joint.angle)
            s = dx * (x - bx) + dy * (y - by)
            found[joint.name] = s.parts
    return found


def coordinates(lane, dense, q, v, a):
    """Coordinates of the text, their velocities and accelerations, from those of all bodies."""
    slides = sliding(dense, q, v, a)
    rows = []
    for kind, body in lane.text.forest.coordinates:
        if kind == "slide":
            rows.append(slides[lane.text.forest.hangs[body].joint.name])
        else:
            k = dense.first[body] + ("x", "y", "angle").index(kind)
            rows.append((q[k], v[k], a[k]))
    return np.array(rows).T

"""Assembly of a mechanism from rough angles: Newton's method with the least change, and what to say where it fails."""

import math
from dataclasses import dataclass

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.dynamics.linkage.loops import Loops
from hpcclear.dynamics.linkage.mechanism import Mechanism
from hpcclear.dynamics.linkage.parts import GROUND, Clearance, Fixed, Slide, split

MOST_STEPS = 40
MOST_TRIES = 12
LARGEST_TURN = 0.5  # rad, of a step
CLOSED = 1e-15  # error over typical length at which Newton's method stops
NEARLY = 1e-12  # and up to which the mechanism counts as closed
SINGULAR = 1e-9  # smallest singular value, of rows scaled to 1, from which a pose can be passed


@dataclass(frozen=True)
class Assembly:
    """A mechanism put together."""

    loops: Loops
    """Its coordinates are those of `q` and `v`."""
    q: Array
    v: Array
    """q and v, shape (n,): mass centres and angles of the bodies at the start, and their velocities, SI."""
    steps: int
    """Newton steps it took."""

    def angle(self, body: str) -> float:
        """Angle of a body at the start, rad."""
        forest = self.loops.forest
        k = forest.index("angle", forest.frames[body])
        return forest.offsets[body] + (0.0 if k is None else float(self.q[k]))

    def report(self) -> list[str]:
        """A line a body: the angle taken, and the rough one it was found from, in degrees."""
        return [
            f"{body.name}: {_degrees(self.angle(body.name))} deg (from {_degrees(body.start_angle)})"
            for body in self.loops.mechanism.bodies
        ]


def _degrees(angle: float) -> str:
    """To a thousandth, and 0 for what is left of rounding."""
    return f"{round(math.degrees(angle), 3) + 0.0:g}"


def assemble(mechanism: Mechanism) -> Assembly:
    """Close all loops at time 0, journals centred or at their `start_eccentricity`, with the velocities of ideal joints.

    Raises
    ------
    InputError
        If a loop cannot close, a joint is held twice, or the mechanism stands in a dead centre: the joint is named.
    """
    loops = Loops(mechanism, closed=True)
    wanted = _eccentricities(loops)
    q, steps = _closed(loops, rough_pose(loops), wanted)
    zero = np.zeros(loops.size)
    state = loops.at(q, zero, 0.0)
    ideal = np.array([not is_open(mechanism, owner) for owner in loops.owners], bool)
    check_rank(loops, state.jacobian, ideal, 0.0)
    v, *_ = np.linalg.lstsq(state.jacobian * loops.scales, -state.rate, rcond=1e-12)
    return Assembly(loops, q, v * loops.scales, steps)


def is_open(mechanism: Mechanism, owner: str) -> bool:
    """Whether a constraint, by its owner, is that of a joint with clearance or of a torque."""
    table, name = owner.split(".")
    clear = {joint.name for joint in mechanism.clearances}
    free = {drive.name for drive in mechanism.drives if not drive.prescribed}
    return name in (clear if table == "joints" else free)


def _eccentricities(loops: Loops) -> Array:
    """What each constraint is to be at the start."""
    wanted = np.zeros(len(loops.owners))
    for joint in loops.mechanism.clearances:
        rows = [r for r, owner in enumerate(loops.owners) if owner == f"joints.{joint.name}"]
        wanted[rows] = joint.start_eccentricity
    return wanted


def _closed(loops: Loops, rough: Array, wanted: Array) -> tuple[Array, int]:
    """From rough angles; where these lead into a corner, from angles near them, further and further off."""
    rng = np.random.default_rng(0)  # the same tries for the same mechanism
    guided = {split(joint.point)[0] for joint in loops.mechanism.joints if isinstance(joint, Slide)}
    angles = np.array(
        [one.kind == "angle" and one.body not in guided for one in loops.forest.coordinates], float
    )
    nearest: tuple[float, int] = (math.inf, 0)
    taken = 0
    for reach in (0.0, *np.linspace(0.2, 1.5, MOST_TRIES)):
        q, steps, left, worst = _newton(
            loops, rough + reach * angles * rng.normal(size=loops.size), wanted
        )
        taken += steps
        if left <= NEARLY * loops.scales.max():
            return q, taken
        nearest = min(nearest, (left, worst))
    raise InputError(
        loops.owners[nearest[1]], nearest[0],
        "the mechanism cannot be assembled here: the value is the remaining distance of the two sides, in m or rad",
        "Check the lengths, or give start_angle of its bodies near the intended assembly",
    )  # fmt: skip


def _newton(loops: Loops, q: Array, wanted: Array) -> tuple[Array, int, float, int]:
    """Newton's method by least changes, shortened until the error falls: pose, steps, error left, its row."""
    zero, length = np.zeros(loops.size), loops.scales.max()
    state = loops.at(q, zero, 0.0)
    error = state.error - wanted
    steps = 0
    while steps < MOST_STEPS:
        left = np.linalg.norm(error)
        if left <= CLOSED * length:
            break
        change, *_ = np.linalg.lstsq(state.jacobian * loops.scales, -error, rcond=1e-9)
        share = min(1.0, LARGEST_TURN / max(float(np.abs(change).max()), 1e-9))
        while True:
            new = q + loops.scales * change * share
            state = loops.at(new, zero, 0.0)
            if np.linalg.norm(state.error - wanted) < left or share < 1e-3:
                break
            share *= 0.5
        if np.linalg.norm(state.error - wanted) >= left:
            break  # round-off, or a corner
        q, error, steps = new, state.error - wanted, steps + 1
    return q, steps, float(np.abs(error).max(initial=0.0)), int(np.abs(error).argmax())


def rough_pose(loops: Loops) -> Array:
    """Coordinates (n,) of the bodies at their start angles, hung one after the other on what stands already."""
    mechanism = loops.mechanism
    placed: dict[str, tuple[complex, float]] = {GROUND: (0j, 0.0)}
    bodies = {body.name: body for body in mechanism.bodies}

    def at(place: str) -> complex:
        name, _ = split(place)
        origin, angle = placed[name]
        return origin + complex(*mechanism.at(place)) * complex(math.cos(angle), math.sin(angle))

    while len(placed) <= len(bodies):
        for joint in mechanism.joints:
            for own, other in (joint.places, joint.places[::-1]):
                body, carrier = split(own)[0], split(other)[0]
                if body in placed or carrier not in placed:
                    continue
                angle = bodies[body].start_angle
                if isinstance(joint, (Slide, Fixed)):
                    turned = joint.angle if own == joint.point else -joint.angle
                    angle = placed[carrier][1] + turned
                turn = complex(math.cos(angle), math.sin(angle))
                placed[body] = (at(other) - complex(*mechanism.at(own)) * turn, angle)
    q = np.zeros(loops.size)
    for k, one in enumerate(loops.forest.coordinates):
        origin, angle = placed[one.body]
        centre = origin + complex(*bodies[one.body].center) * complex(
            math.cos(angle), math.sin(angle)
        )
        q[k] = {"x": centre.real, "y": centre.imag, "angle": angle}[one.kind]
    return q


def check_rank(loops: Loops, jacobian: Array, rows: Array, time: float) -> float:
    """Smallest singular value of the constraints' Jacobian (rows, n), rows scaled to 1, of those that `rows` picks.

    Raises
    ------
    InputError
        If they depend on one another.
    """
    scaled = (jacobian * loops.scales)[rows]
    if not len(scaled):
        return 1.0
    scaled = scaled / np.linalg.norm(scaled, axis=1)[:, None].clip(1e-300)
    left, sizes, _ = np.linalg.svd(scaled, full_matrices=True)
    smallest = float(sizes[-1]) if len(scaled) <= loops.size else 0.0
    if smallest > SINGULAR:
        return smallest
    share = np.abs(left[:, -1])
    owners = [owner for owner, taken in zip(loops.owners, rows, strict=True) if taken]
    named = [owner for owner, part in zip(owners, share, strict=True) if part > 0.1 * share.max()]
    joint = next((owner for owner in reversed(named) if owner.startswith("joints")), named[-1])
    raise InputError(
        joint, smallest, f"constrains nothing at {time:.4g} s that other joints do not constrain. It is a dead "
        "centre that the drives cannot pass, or the joint is redundant",
        "Move the start angles away from it, change a length, or remove the redundant joint",
    )  # fmt: skip


def open_gaps(assembly: Assembly) -> dict[str, float]:
    """How far journals stand off their bearings' centres at the start, m, by joint."""
    state = assembly.loops.at(assembly.q, assembly.v, 0.0)
    found: dict[str, float] = {}
    for joint in assembly.loops.mechanism.joints:
        if isinstance(joint, Clearance):
            rows = [
                r
                for r, owner in enumerate(assembly.loops.owners)
                if owner == f"joints.{joint.name}"
            ]
            found[joint.name] = float(np.hypot(*state.error[rows]))
    return found

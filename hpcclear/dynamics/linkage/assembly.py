"""Assembly of a mechanism from rough angles: Newton's method with the least change, and what to say where it fails."""

import itertools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from hpcclear.base.arrays import Array, Booleans, Integers
from hpcclear.base.errors import InputError
from hpcclear.dynamics.linkage.kinematics import CENTER
from hpcclear.dynamics.linkage.loops import Loops, typical_length
from hpcclear.dynamics.linkage.mechanism import Mechanism, straight, uncentred
from hpcclear.dynamics.linkage.numbers import values
from hpcclear.dynamics.linkage.parts import GROUND, Number, Pair, as_complex, places_of, split
from hpcclear.dynamics.linkage.trees import Forest, forest

MOST_STEPS = 40
MOST_TRIES = 12
LARGEST_TURN = 0.5  # rad, of a step
CLOSED = 1e-15  # error over typical length at which Newton's method stops
NEARLY = 1e-12  # and up to which the mechanism counts as closed
SINGULAR = 1e-9  # smallest singular value, of rows scaled to 1, from which a pose can be passed


@dataclass(frozen=True)
class Assembly:
    """A mechanism put together, or samples of one: then with a last axis (m,)."""

    loops: Loops  # its coordinates are those of `q` and `v`
    q: Array  # mass centres and angles of the bodies at the start, SI, (n,), and their velocities
    v: Array

    def angle(self, body: str) -> float:
        """Angle of a body at the start, rad."""
        forest = self.loops.forest
        k = forest.index("angle", forest.frames[body])
        return forest.offsets[body] + (0.0 if k is None else float(self.q[k]))

    def report(self) -> list[str]:
        """A line for each body: its angle, and the estimate in the scene, in degrees."""
        return [
            f"{body.name}: {_degrees(self.angle(body.name))} deg (start_angle {_degrees(body.start_angle)} deg)"
            for body in self.loops.mechanism.bodies
        ]


def _degrees(angle: float) -> str:
    """To a thousandth, and 0 for what is left of rounding."""
    return f"{round(math.degrees(angle), 3) + 0.0:g}"


def assemble(mechanism: Mechanism) -> Assembly:
    """Close all loops at time 0, journals centred or at their `start_eccentricity`, with the velocities of ideal joints.

    The least change is that of the bodies' own axes (`uncentred`), so that mass centres move nothing. Raises InputError if a
    loop cannot close, a joint is held twice, or the mechanism stands in a dead centre: the joint is named.
    """
    bare = uncentred(mechanism)
    loops = Loops(bare, closed=True)
    q = _closed(loops, rough_pose(loops)[:, None], _eccentricities(loops)[:, None])
    jacobian = loops.at(q, np.zeros_like(q), np.zeros(1)).jacobian[0]
    check_rank(loops, jacobian, ideal_rows(mechanism, loops), 0.0)
    made = Assembly(loops, q[:, 0], _velocities(loops, q)[:, 0])
    if bare.bodies == mechanism.bodies:
        return made
    about = Loops(mechanism, closed=True)
    return Assembly(about, *coordinates(about.forest, made, mechanism))


def placed(
    assembly: Assembly, place: str, at: Pair | None = None
) -> tuple[Any, Any, Number, Number]:
    """Position and velocity (complex) of a place of an assembly, or of one `at` the body's own axes; angle and angular velocity
    of its body."""
    mechanism: Mechanism = assembly.loops.mechanism
    name, point = split(place)
    if name == GROUND:
        return as_complex(mechanism.ground[point]), 0j, 0.0, 0.0
    body, forest = mechanism.body(name), assembly.loops.forest
    places = {**body.points, CENTER: body.center}
    here = as_complex(places[point] if at is None else at)
    hang = forest.hangs[name]
    if hang.joint is not None:  # held on the ground
        angle = forest.offsets[name]
        at_rest = placed(assembly, hang.parent)[0]
        own = as_complex(places[split(hang.own)[1]])
        return at_rest + np.exp(1j * np.asarray(angle)) * (here - own), 0j, angle, 0.0
    x, y, turns = (forest.index(kind, name) for kind in ("x", "y", "angle"))
    q, v = assembly.q, assembly.v
    angle, spin = (0.0, 0.0) if turns is None else (q[turns], v[turns])
    turned = (here - as_complex(body.center)) * np.exp(1j * np.asarray(angle))
    return q[x] + 1j * q[y] + turned, v[x] + 1j * v[y] + 1j * spin * turned, angle, spin


def coordinates(forest: Forest, assembly: Assembly, mechanism: Mechanism) -> tuple[Array, Array]:
    """Coordinates and velocities (n,) of a forest, of a linkage put together; (n, m) of samples.

    Journals stand where the assembly (of the mechanism, or `uncentred`) has them; a coordinate along a guide is read off the
    poses of both bodies. The mechanism says where the mass centres are: single ones, or those of samples (m,).
    """
    found: list[tuple[Number, Number]] = []
    for one in forest.coordinates:
        place = assembly.loops.forest.index(one.kind, one.body)
        if one.kind == "slide":
            found.append(_along(forest, assembly, one.body))
        elif place is None:
            found.append((0.0, 0.0))
        elif one.kind == "angle":
            found.append((assembly.q[place], assembly.v[place]))
        else:
            body = mechanism.body(one.body)
            here, speed, _, _ = placed(assembly, f"{body.name}.{CENTER}", body.center)
            found.append((here.real, speed.real) if one.kind == "x" else (here.imag, speed.imag))
    rows = np.broadcast_arrays(*itertools.chain(*found))
    shape = np.shape(rows[0]) if rows else assembly.q.shape[1:]
    both = np.array(rows, float).reshape(-1, 2, *shape)
    return both[:, 0], both[:, 1]


def _along(forest: Forest, assembly: Assembly, body: str) -> tuple[Number, Number]:
    """How far a body has come along its guide, m, and how fast it moves."""
    hang = forest.hangs[body]
    assert hang.joint is not None
    own, own_speed, _, _ = placed(assembly, hang.own)
    base, base_speed, _, _ = placed(assembly, hang.parent)
    _, _, angle, spin = placed(assembly, hang.joint.point)
    along = np.exp(1j * np.asarray(angle))
    if hang.own != hang.joint.point:
        along = -along
    offset, rate = own - base, own_speed - base_speed
    turned = 1j * along * spin
    speed = (along.conjugate() * rate).real + (turned.conjugate() * offset).real
    return (along.conjugate() * offset).real, speed


def assemble_samples(
    structure: Mechanism, sample: Mechanism, count: int
) -> tuple[Assembly, Booleans]:
    """`assemble` for so many samples at once, and which of them it succeeds with (m,): others may close from other angles.

    `structure` is what they have in common; `sample` has numbers of samples (m,), or single ones.
    """
    loops = Loops(structure, closed=True)
    loops.mechanism = sample = straight(sample)
    loops.forest = forest(sample, cartesian=True, closed=True)
    loops.take(values(sample, cartesian=True))
    lengths = np.broadcast_to(typical_length(sample), count)
    angles = np.array([one.kind == "angle" for one in loops.forest.coordinates])
    loops.scales = np.where(angles[:, None], 1.0, lengths)
    rough = np.broadcast_to(rough_pose(loops).T, (count, loops.size)).T.copy()
    wanted = np.broadcast_to(_eccentricities(loops).T, (count, len(loops.owners))).T
    with np.errstate(invalid="ignore"):
        q, left, _ = _newton(loops, rough, wanted)
        good = left <= NEARLY * lengths
        q[:, ~good] = rough[:, ~good]
        jacobian = loops.at(q, np.zeros_like(q), np.zeros(count)).jacobian
        rows = (jacobian * _scales(loops)[:, None])[:, ideal_rows(structure, loops)]
        good &= smallest_value(rows, loops.size) > SINGULAR
        return Assembly(loops, q, _velocities(loops, q)), good


def _scales(loops: Loops) -> Array:
    """Scales of the coordinates, (1, n), or those of samples, (m, n)."""
    return np.atleast_2d(loops.scales.T)


def ideal_rows(mechanism: Mechanism, loops: Loops) -> Booleans:
    """Which constraints are neither of a joint with clearance nor of a torque of the mechanism."""
    clear = {f"joints.{joint.name}" for joint in mechanism.clearances}
    free = {f"drives.{drive.name}" for drive in mechanism.drives if not drive.prescribed}
    return np.array([owner not in clear | free for owner in loops.owners], bool)


def _least_change(loops: Loops, jacobian: Array, asked: Array, rcond: float) -> Array:
    """The smallest scaled change (n, m) that gives constraints what is required of them (rows, m)."""
    inverse = np.linalg.pinv(jacobian * _scales(loops)[:, None], rcond=rcond)
    return (inverse @ asked.T[..., None])[..., 0].T


def _velocities(loops: Loops, q: Array) -> Array:
    """Velocities (n, m) at poses (n, m)."""
    state = loops.at(q, np.zeros_like(q), np.zeros(q.shape[1]))
    scales = _scales(loops).T
    return _least_change(loops, state.jacobian, -state.rate, 1e-12) * scales


def _eccentricities(loops: Loops) -> Array:
    """What each constraint is to be at the start."""
    wanted: list[Number] = [0.0] * len(loops.owners)
    for joint in loops.mechanism.clearances:
        rows = [r for r, owner in enumerate(loops.owners) if owner == f"joints.{joint.name}"]
        for r, apart in zip(rows, joint.start(), strict=True):
            wanted[r] = apart
    return np.array(np.broadcast_arrays(*wanted), float)


def _closed(loops: Loops, rough: Array, wanted: Array) -> Array:
    """From rough angles; where these lead into a corner, from angles near them, further and further off."""
    rng = np.random.default_rng(0)  # the same tries for the same mechanism
    followed, movers = _followed(loops.mechanism), loops.forest.coordinates
    turns = [(one.body, followed[one.body][0]) if one.kind == "angle" else () for one in movers]
    shares = np.array([[bool(one) and one[1:] == other[:1] for other in turns] for one in turns])
    nearest: tuple[float, int] = (math.inf, 0)
    for reach in (0.0, *np.linspace(0.2, 1.5, MOST_TRIES)):
        turned = reach * shares @ rng.normal(size=loops.size)
        q, left, worst = _newton(loops, rough + turned[:, None], wanted)
        if left[0] <= NEARLY * loops.scales.max():
            return q
        nearest = min(nearest, (float(left[0]), int(worst[0])))
    raise InputError(
        loops.owners[nearest[1]], f"{nearest[0]:.4g} {loops.units[nearest[1]]}",
        "the mechanism cannot be assembled here: its two sides stay so far apart",
        "Check the lengths, or give start_angle of its bodies near the intended assembly",
    )  # fmt: skip


def _newton(loops: Loops, q: Array, wanted: Array) -> tuple[Array, Array, Integers]:
    """Newton's method by least changes, shortened until the error falls, of poses (n, m): poses, errors left (m,), and their
    rows."""
    zero, times = np.zeros_like(q), np.zeros(q.shape[1])
    scales = _scales(loops).T
    length = scales.max(axis=0)

    def found(q: Array) -> tuple[Array, Array, Array]:
        state = loops.at(q, zero, times)
        error = state.error - wanted
        return error, np.linalg.norm(error, axis=0), state.jacobian

    error, left, jacobian = found(q)
    going = np.isfinite(left)
    for _ in range(MOST_STEPS):
        going &= left > CLOSED * length
        if not going.any():
            break
        jacobian[~going] = 0.0
        change = scales * _least_change(loops, jacobian, -error, 1e-9)
        most = np.abs(change / scales).max(axis=0, initial=0.0)
        share = np.minimum(1.0, LARGEST_TURN / np.maximum(most, 1e-9))
        while True:
            new = q + change * share
            shown = found(new)
            worse = going & ~(shown[1] < left)
            if not (worse & (share >= 1e-3)).any():
                break
            share = np.where(worse & (share >= 1e-3), 0.5 * share, share)
        going &= ~worse  # round-off, or a corner
        if not going.any():
            break
        q = np.where(going, new, q)
        error, left, jacobian = found(q)
    rows: Integers = np.abs(error).argmax(axis=0)
    return q, np.abs(error).max(axis=0, initial=0.0), rows


def rough_pose(loops: Loops) -> Array:
    """Coordinates (n,) or (n, m) of the bodies at their start angles, hung one after the other on what stands already."""
    mechanism, followed = loops.mechanism, _followed(loops.mechanism)
    turns = {name: np.exp(1j * np.asarray(angle)) for name, (_, angle) in followed.items()}
    origins: dict[str, Any] = {GROUND: 0j}
    while len(origins) <= len(mechanism.bodies):
        for joint in mechanism.joints:
            for own, other in (places_of(joint), places_of(joint)[::-1]):
                body, carrier = split(own)[0], split(other)[0]
                if body not in origins and carrier in origins:
                    there = origins[carrier] + as_complex(mechanism.at(other)) * turns[carrier]
                    origins[body] = there - as_complex(mechanism.at(own)) * turns[body]
    found = []
    for one in loops.forest.coordinates:
        name, arm = one.body, as_complex(mechanism.body(one.body).center)
        centre = origins[name] + arm * turns[name]
        found.append({"x": centre.real, "y": centre.imag, "angle": followed[name][1]}[one.kind])
    return np.array(np.broadcast_arrays(*found), float)


def _followed(mechanism: Mechanism) -> dict[str, tuple[str, Number]]:
    """Of each body the one that gives it its angle at the start by guides, and that angle: the ground, a driven body, one that
    has a start angle, or one that carries guides, in this order. Else a body may face backwards, which meets its constraint."""
    guides = [joint for joint in mechanism.joints if joint.kind in ("slide", "fixed")]
    turned = [(split(one.line)[0], split(one.point)[0], one.angle) for one in guides]
    ways = turned + [(body, carrier, -angle) for carrier, body, angle in turned]
    starts = {GROUND: 0.0} | {one.name: one.start_angle for one in mechanism.bodies}
    guided = {body for _, body, _ in turned}
    names = sorted(starts, key=lambda name: (not np.any(starts[name]), name in guided))
    found: dict[str, tuple[str, Number]] = {}
    for first in (GROUND, *(drive.body for drive in mechanism.drives), *names):
        found.setdefault(first, (first, starts[first]))
        for one, other, angle in ways * len(ways):
            if one in found:
                found.setdefault(other, (found[one][0], found[one][1] + angle))
    return found


def check_redundant(mechanism: Mechanism) -> None:
    """Raise InputError if a joint holds, wherever the mechanism stands, what others hold, or they hold it in its clearance."""
    loops = Loops(uncentred(mechanism), closed=True)
    anywhere = loops.scales * np.random.default_rng(0).normal(size=loops.size)
    q = (rough_pose(loops) + anywhere)[:, None]
    jacobian = loops.at(q, 0.0 * q, np.zeros(1)).jacobian[0]
    ideal, remedy = ideal_rows(mechanism, loops), "Remove one of them"
    for owner in ("", *(f"joints.{joint.name}" for joint in mechanism.clearances)):
        rows = ideal | (np.array(loops.owners) == owner)
        reason = "cannot move in its clearance" if owner else "is redundant"
        _check_independent(loops, jacobian, rows, f"{reason} beside {{}}", remedy, owner)


def check_rank(loops: Loops, jacobian: Array, rows: Booleans, time: float) -> None:
    """Raise InputError if constraints depend on one another, of those with Jacobian (rows, n) that `rows` picks."""
    reason = f"constrains nothing at {time:.4g} s beside {{}}. It is a dead centre that the drives cannot pass, or redundant"
    remedy = "Move the start angles away from it, change a length, or remove the redundant joint"
    _check_independent(loops, jacobian, rows, reason, remedy)


def _check_independent(
    loops: Loops, jacobian: Array, rows: Booleans, reason: str, remedy: str, owner: str = ""
) -> None:
    """Raise InputError if a row depends on others, or all those of an `owner`: of it, or of the last joint among them."""
    scaled, count = (jacobian * loops.scales)[rows], loops.owners.count(owner) or 1
    left, values, _ = np.linalg.svd(scaled / _sizes(scaled))
    values = np.append(values, np.zeros(len(left) - len(values)))
    if len(values) < count or values[-count] > SINGULAR:
        return
    share = np.abs(left[:, -count:]).max(axis=1)
    named = dict.fromkeys(np.array(loops.owners)[rows][share > 0.1 * share.max()].tolist())
    joints = {f"joints.{joint.name}": joint for joint in loops.mechanism.joints}
    key = owner or next((one for one in reversed(named) if one in joints), [*named][-1])
    others = [one.partition(".")[2] for one in named if one != key] or ["the other joints"]
    places = list(places_of(joints[key])) if key in joints else None
    raise InputError(key, places, reason.format(" and ".join(others)), remedy)


def check_ranks(loops: Loops, q: Array, v: Array, times: Array) -> None:
    """`check_rank` of all constraints along a motion (n, t)."""
    jacobians = loops.at(q, v, times).jacobian
    smallest = smallest_value(jacobians * loops.scales, loops.size)
    for k in np.flatnonzero(smallest <= SINGULAR)[:1]:
        check_rank(loops, jacobians[k], np.ones(len(loops.owners), bool), float(times[k]))


def _sizes(rows: Array) -> Array:
    return np.linalg.norm(rows, axis=-1)[..., None].clip(1e-300)


def smallest_value(rows: Array, n: int) -> Array:
    """Smallest singular values (...) of constraints (..., rows, n), rows scaled to 1; 1 without any, 0 of too many."""
    if not rows.shape[-2] or rows.shape[-2] > n:
        return np.full(rows.shape[:-2], float(not rows.shape[-2]))
    return np.asarray(np.linalg.svd(rows / _sizes(rows), compute_uv=False)[..., -1], float)

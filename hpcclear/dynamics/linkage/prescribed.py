"""Linkages without clearance whose drives prescribe everything: the motion from a walk (`passage`), no integration.

Positions and velocities from the walk, accelerations, reactions and drive moments from the generated equations in Cartesian
coordinates (feedback off), all instants at once.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.base.outcome import Status
from hpcclear.base.pieces import Pieces
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.assembly import Assembly, assemble, check_ranks, coordinates, placed
from hpcclear.dynamics.linkage.expression import On, Rows
from hpcclear.dynamics.linkage.generator import generate
from hpcclear.dynamics.linkage.kinematics import CENTER
from hpcclear.dynamics.linkage.loops import Loops, on_arrays
from hpcclear.dynamics.linkage.mechanism import Mechanism, freedom
from hpcclear.dynamics.linkage.numbers import row_of, values
from hpcclear.dynamics.linkage.parts import GROUND, places_of, split
from hpcclear.dynamics.linkage.passage import BESIDE, NEARER, Ended, Passage, WalkPose, walked
from hpcclear.dynamics.linkage.poses import Poses

Curves = Mapping[str, Pieces]
"""Tabulated loads by name, over the angle, rad, or time, s, that each goes by."""

DIVERGING = 1e-6
"""Force times distance from a change point, rad of the drive, over the largest force further off, from which on it has no
bound there."""


@dataclass(frozen=True)
class Prescribed:
    """A motion that the drives prescribe, over instants (t,)."""

    assembly: Assembly
    times: Array  # (t,)
    # mass centres and angles of all bodies, velocities and accelerations, SI, (t, n), in the order of ``assembly.loops.forest``
    q: Array
    v: Array
    a: Array
    # by constraint: ``"NAME_x"`` and ``"NAME_y"`` are the force of a pin on its journal's body, ``"NAME_across"`` that of a
    # guide across its line, ``"NAME_angle"`` the moment of a guide or of a drive; each (t,), N or N m
    holds: dict[str, Array]
    power: Array  # of all drives, of friction, of the loads, W, (t,)
    loss: Array
    load_power: Array

    def at(self, times: Array, values_of: Callable[[Array], Array]) -> "Prescribed":
        """The same at other instants: what makes values there of these, the instants first."""
        parts = ("q", "v", "a", "power", "loss", "load_power")
        holds = {name: values_of(values) for name, values in self.holds.items()}
        known: dict[str, Any] = {name: values_of(getattr(self, name)) for name in parts}
        return replace(self, times=times, holds=holds, **known)


def prescribed_motion(
    mechanism: Mechanism, times: Array, gravity: float = 0.0, curves: Curves | None = None
) -> Prescribed:
    """Motion and reactions at instants (t,), s, which rise from 0; tabulated loads that `curves` leave out are 1.

    Raises InputError if a joint has clearance or the drives leave something free, and where the mechanism comes to a dead
    centre.
    """
    if mechanism.clearances or freedom(mechanism):
        reason = "the motion is not prescribed: degrees of freedom are left free"
        remedy = "Prescribe one angle for each degree of freedom, and make all joints ideal"
        raise InputError("drives", freedom(mechanism), reason, remedy)
    assembly, times = assemble(mechanism), np.asarray(times, float)
    passage = _passed(assembly, times, gravity)
    shown, filled = _beside(passage, times)
    rows = cartesian(assembly, passage, *passage.at(shown), shown)
    q, v = np.moveaxis(rows, 0, -1)
    check_ranks(assembly.loops, q, v, shown)
    return _reactions(assembly, shown, rows, gravity, curves or {}).at(times, filled)


def _passed(assembly: Assembly, times: Array, gravity: float = 0.0) -> Passage:
    """The walk through all instants (t,); InputError where it ends before."""
    rounds = math.ceil(times.max(initial=0.0) / assembly.loops.mechanism.period.seconds)
    passage = passage_of(assembly, max(rounds, 1), gravity)
    if len(passage.passed(times)) < len(times):
        raise refusal(assembly, passage)
    return passage


def passage_of(assembly: Assembly, rounds: int, gravity: float = 0.0) -> Passage:
    """How a linkage put together gets through so many revolutions of its drives, which leave nothing free.

    It ends with ``NEAR_SINGULAR`` at a change point where forces of joints grow without bound.
    """
    mechanism = assembly.loops.mechanism
    main, loops = mechanism.period, Loops(mechanism, trees=True)
    start, _ = coordinates(loops.forest, assembly, mechanism)
    found = walked(loops, start, main.seconds, main.turns, rounds)
    for change in found.changes:
        if freedom(mechanism) == 0 and _diverges(assembly, found, change, gravity):
            found.ended = Ended(Status.NEAR_SINGULAR, change)
            break
    return found


def _diverges(assembly: Assembly, passage: Passage, change: WalkPose, gravity: float) -> bool:
    """Whether a force grows as one over the distance from a change point; tabulated loads count as those of factor 1."""
    near = BESIDE * passage.unit / np.array([1.0, NEARER])
    far = np.linspace(0.1, 1.0, 10) * min(change.time, passage.unit)
    sides = change.time + np.concatenate([-near, near])
    times = np.concatenate([sides, change.time - far])
    rows = cartesian(assembly, passage, *passage.at(times), times)
    held = _reactions(assembly, times, rows, gravity, {}).holds
    sizes = [assembly.loops.length if name.endswith("_angle") else 1.0 for name in held]
    force = np.array(list(held.values())) / np.array(sizes)[:, None]
    wide, close = 0.5 * (force[:, 2:4] - force[:, :2]).T
    residue = np.abs(close - wide / NEARER).max() * BESIDE / (NEARER - 1.0 / NEARER)
    return bool(residue > DIVERGING * np.abs(force[:, 4:]).max())


def refusal(assembly: Assembly, passage: Passage) -> InputError:
    """What to say of a linkage that does not get through."""
    main = assembly.loops.mechanism.period
    return InputError(
        f"drives.{main.name}", main.body, why(assembly, passage),
        "Change a length, a point or an angle so that it passes",
    )  # fmt: skip


def angle_of(pose: Assembly) -> float:
    """The angle of the body that defines the period, deg."""
    return math.degrees(placed(pose, f"{pose.loops.mechanism.period.body}.{CENTER}")[2]) % 360.0


def why(assembly: Assembly, passage: Passage) -> str:
    """Where a walk ended, by the angle of the drive's body, and which bodies and joints hold one another there."""
    assert passage.ended is not None
    status, node = passage.ended
    loops, mechanism = assembly.loops, assembly.loops.mechanism
    pose = pose_at(assembly, passage, node)
    jacobian = loops.scaled(loops.at(pose.q, pose.v, node.time).jacobian)
    left = np.linalg.svd(jacobian)[0][:, -1]  # the forces that hold one another
    owners, names = np.array(loops.owners), [joint.name for joint in mechanism.joints]
    held = {name: float(np.linalg.norm(left[owners == f"joints.{name}"])) for name in names}
    driven = {drive.body for drive in mechanism.drives} | {GROUND}
    loaded = [j for j in mechanism.joints if held[j.name] > 0.05 * max(held.values())]
    ends = [{split(place)[0] for place in places_of(joint)} for joint in loaded]
    names = [body.name for body in mechanism.bodies if body.name not in driven]
    bodies = [name for name in names if sum(name in both for both in ends) > 1]
    between = [joint for joint, both in zip(loaded, ends, strict=True) if both & {*bodies}]
    points = np.array([[(z := placed(pose, places_of(j)[0])[0]).real, z.imag] for j in between])
    spread = np.linalg.svd(points - points.mean(axis=0))[1] if len(points) else np.ones(2)
    straight = len(spread) > 1 and spread[1] < 0.02 * spread[0] and len(bodies) > 1
    where = f"{angle_of(pose):.1f} deg of the {mechanism.period.body}"
    listed = " and ".join([", ".join(bodies[:-1]), bodies[-1]] if len(bodies) > 1 else bodies)
    state = f"{listed} {'in line' if straight else 'jammed'}" if bodies else "jammed"
    joints = ", ".join(joint.name for joint in between)
    state += f" (joints {joints})" if joints else ""
    if status is Status.CANNOT_TURN:
        return f"cannot turn: locks at {where}, {state}"
    return f"near singular: at {where}, {state}, its motion or its forces are not determined"


def cartesian(assembly: Assembly, passage: Passage, q: Array, v: Array, times: Array) -> Array:
    """Coordinates and velocities (t, 2, n) in the order of ``assembly.loops.forest``, of those of the trees (n, t)."""
    mechanism, loops = assembly.loops.mechanism, assembly.loops
    poses = Poses(passage.loops.forest, {}, 0)
    pose, _ = poses.at(poses.par_of(values(mechanism)), q, v, times)
    names = [body.name for body in mechanism.bodies]
    parts = {"x": (pose.x, pose.vx), "y": (pose.y, pose.vy), "angle": (pose.angle, pose.spin)}
    found = np.zeros((len(times), 2, loops.size))
    for k, one in enumerate(loops.forest.coordinates):
        for kind in range(2):
            found[:, kind, k] = parts[one.kind][kind][names.index(one.body)]
    return found


def pose_at(assembly: Assembly, passage: Passage, node: WalkPose) -> Assembly:
    """The linkage at a pose of its walk."""
    times = np.array([node.time])
    ((q, v),) = cartesian(assembly, passage, node.q[:, None], node.v[:, None], times)
    return replace(assembly, q=q, v=v)


def passed_through(assembly: Assembly, times: Array) -> Array:
    """Coordinates and velocities (t, 2, n) at instants (t,), s, that rise from 0.

    Raises InputError where the mechanism comes to a dead centre.
    """
    passage = _passed(assembly, times)
    shown, filled = _beside(passage, times)
    return filled(cartesian(assembly, passage, *passage.at(shown), shown))


def _beside(passage: Passage, times: Array) -> tuple[Array, Callable[[Array], Array]]:
    """Instants to compute, and what makes values at `times` (t,) of values there, the instants first: beside a change point,
    polynomials of the fifth degree through values on both its sides."""
    centres = passage.beside(times)
    inside = np.isfinite(centres)
    places = np.array([-3.0, -2.0, -1.0, 1.0, 2.0, 3.0])
    reach = BESIDE * passage.unit
    around = centres[inside, None] + places * reach
    s = (times[inside] - centres[inside])[:, None] / reach
    weights = np.ones((inside.sum(), 6))
    for k, one in enumerate(places):
        others = np.delete(places, k)
        weights[:, k] = ((s - others) / (one - others)).prod(axis=1)
    shown = np.concatenate([np.where(inside, centres + reach, times), around.ravel()])

    def filled(values: Array) -> Array:
        found = values[: len(times)].copy()
        nodes = values[len(times) :].reshape(-1, 6, *values.shape[1:])
        found[inside] = np.einsum("tk,tk...->t...", weights, nodes)
        return found

    return shown, filled


def _reactions(
    assembly: Assembly, times: Array, found: Array, gravity: float, tabulated: Curves
) -> Prescribed:
    """Accelerations and reactions from the equations of motion, instants batched as rows of arrays."""
    mechanism, n = assembly.loops.mechanism, assembly.loops.size
    holds = 3 * n + 1
    rates = holds + len(assembly.loops.owners)
    tabled = [load for load in mechanism.loads if load.table]
    curves = {load.name: rates + at.RATES + k for k, load in enumerate(tabled)}
    rows = Rows(0, n, 2 * n, rates, 3 * n, holds, curves=curves)
    on = On(gravity=gravity != 0.0, energies=True)
    text = generate(mechanism, on, rows, cartesian=True, hoist=False)
    work = np.zeros((rates + at.RATES + len(curves), len(times)))
    work[:n], work[n : 2 * n], work[3 * n] = found[:, 0].T, found[:, 1].T, times
    for load in tabled:
        body = getattr(load, "angle_of", None) or mechanism.period.body
        turned = assembly.loops.forest.index("angle", body)  # every body turns by itself here
        place = times if load.seconds else work[turned]
        work[curves[load.name]] = tabulated[load.name].at(place) if load.name in tabulated else 1.0
    par = row_of(text, values(mechanism, cartesian=True, gravity=gravity))
    on_arrays(mechanism, text.source, **text.functions)(None, (), work, par, 0, 1)
    from_row = {name: work[holds + r] for r, name in enumerate(text.constraints)}
    return Prescribed(
        assembly, times, found[:, 0], found[:, 1], work[2 * n : 3 * n].T.copy(), from_row,
        work[rates + at.DRIVE_POWER], work[rates + at.DISSIPATION], work[rates + at.LOAD_POWER],
    )  # fmt: skip

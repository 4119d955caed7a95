"""Whether linkages can turn as their drives prescribe, found out before anything is simulated.

What is walked is the ideal twin, with pins in place of clearances. One that a torque drives may swing; without clearance it is
near singular where it hardly passes. With clearance a change point is for the dynamics to decide, unless the constraints of the
ideal joints alone depend on one another there.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.base.outcome import Status
from hpcclear.dynamics.linkage.assembly import Assembly, assemble, ideal_rows, smallest_value
from hpcclear.dynamics.linkage.loops import Loops
from hpcclear.dynamics.linkage.mechanism import Mechanism, freedom
from hpcclear.dynamics.linkage.parts import Joint, is_loose
from hpcclear.dynamics.linkage.passage import MOST_ROUNDS, POOR, Ended, Passage, WalkPose
from hpcclear.dynamics.linkage.prescribed import angle_of, passage_of, pose_at, refusal
from hpcclear.scene.driving import FreeDriving, PlanarSpeed

DEPENDENT = 1e-3
"""Smallest singular value of the ideal joints' constraints, rows scaled to 1, at which they depend on one another at a change
point, which is known to a few digits less than other poses."""

NARROW = 5e-3
"""Smallest singular value over the largest, below which a linkage without clearance that passes is near singular: what it feels
changes within so small a part of a turn that steps, or the nodes that works are summed over, pass over it. For a slider-crank
it is the cosine of the rod's steepest angle: at 6e-3 works at a given speed close to 1e-5."""

CLOSED = 1e-14  # of the size of a linkage: by how much loops are open where they close to rounding
NEAR_CHANGE = 0.1  # of a change point, rad of the drive: poses nearer to it are on its way


def without_clearance(mechanism: Mechanism) -> Mechanism:
    """The mechanism with pins in place of clearances, and a drive of constant speed in place of a torque."""
    drives: list[Any] = []
    for drive in mechanism.drives:
        if isinstance(drive, FreeDriving):
            kept = {one: getattr(drive, one) for one in ("name", "body", "period", "turns")}
            kept |= {"kind": "constant-speed", "speed": drive.usual_speed}
            drives.append(PlanarSpeed.model_construct(**kept))
        else:
            drives.append(drive)
    return replace(mechanism, joints=pinned(mechanism), drives=tuple(drives), loads=())


def pinned(mechanism: Mechanism) -> tuple[Joint, ...]:
    """The joints of a mechanism, none with clearance."""
    joints = (joint.ideal() if is_loose(joint) else joint for joint in mechanism.joints)
    return tuple(joint for joint in joints if joint is not None)


def twin_of(mechanism: Mechanism) -> Mechanism | None:
    """The mechanism without clearance, if its drives prescribe all of its motion, or would at constant speeds."""
    by_torque = not all(drive.prescribed for drive in mechanism.drives)
    if by_torque and (mechanism.clearances or not mechanism.period.advance):
        return None
    try:
        twin = without_clearance(mechanism) if mechanism.clearances or by_torque else mechanism
    except InputError:  # a joint holds what others hold already, once it has no clearance
        return None
    return None if freedom(twin) else twin


Walk = tuple[Assembly, Passage]  # of a linkage put together, through its revolutions


def passage(mechanism: Mechanism, gravity: float, rounds: int) -> Walk | None:
    """The walk of a linkage's twin through so many revolutions, put together; None where it is not to be judged.

    Raises InputError if a mechanism without clearance cannot be put together.
    """
    twin = twin_of(mechanism)
    if twin is None:
        return None
    try:
        assembly = assemble(twin)
    except InputError:
        if mechanism.clearances:
            return None  # it starts at a change point: the dynamics decide
        raise
    if not mechanism.clearances:
        found = passage_of(assembly, rounds, gravity)
        end = found.ended
        if end is not None and not all(drive.prescribed for drive in mechanism.drives):
            near = any(end.node is one for one in found.changes)
            if not near or _closes(assembly, found, end.node):
                found.ended = None  # it may swing; and inertia carries it past a change point
        narrow = _narrowest(found)
        if narrow is not None and (found.ended is None or found.ended.node.time > narrow.time):
            found.ended = Ended(Status.NEAR_SINGULAR, narrow)
        return assembly, found
    found = passage_of(assembly, MOST_ROUNDS)
    singular = list(found.changes)
    if found.ended is not None and found.ended.status is Status.NEAR_SINGULAR:
        singular.append(found.ended.node)
        found.ended = None
    for node in singular:
        if _dependent(mechanism, assembly, found, node):
            found.ended = Ended(Status.NEAR_SINGULAR, node)
            break
    return assembly, found


def _narrowest(walk: Passage) -> WalkPose | None:
    """The first pose of a walk that links nearly lock at, `NARROW`, and are past later on; None without one."""
    margins, times = np.array([(node.margin, node.time) for node in walk.nodes]).T
    best = margins.max(initial=0.0)
    past = np.flatnonzero(margins > POOR * best)
    near = np.zeros(len(times), bool)
    near[0] = not np.isfinite(walk.recurs)  # it may start just behind a change point
    for change in walk.changes:  # which are passed, however near they are
        apart = np.abs(times - change.time)
        near |= np.minimum(apart, np.abs(apart - walk.recurs)) < NEAR_CHANGE * walk.unit
    tight = np.flatnonzero((margins < NARROW * best) & ~near)
    tight = tight[tight < past.max(initial=0)]
    return walk.nodes[int(tight[0])] if len(tight) else None


def _closes(assembly: Assembly, walk: Passage, node: WalkPose) -> bool:
    """Whether the loops close, to rounding, at a pose where they change branch; else they pass very near to it."""
    pose = pose_at(assembly, walk, node)
    error = np.abs(assembly.loops.at(pose.q, pose.v, node.time).error).max()
    return bool(error <= CLOSED * np.abs(pose.q).max())


def _dependent(mechanism: Mechanism, assembly: Assembly, walk: Passage, node: WalkPose) -> bool:
    """Whether the constraints of the ideal joints and drives depend on one another at a pose of the twin."""
    pose, loops = pose_at(assembly, walk, node), assembly.loops
    jacobian = loops.at(pose.q, pose.v, node.time).jacobian * loops.scales
    return bool(smallest_value(jacobian[ideal_rows(mechanism, loops)], loops.size) < DEPENDENT)


def refused(found: Walk | None) -> tuple[Status, InputError] | None:
    """The status of a linkage that cannot turn, by its `passage`, and what to say; None for one that can, or is not judged."""
    if found is None or found[1].ended is None:
        return None
    error = refusal(*found)
    key = f"mechanism.{error.key}"
    return found[1].ended.status, InputError(key, error.value, error.reason, error.remedy)


def changes(mechanism: Mechanism, found: Walk | None) -> tuple[float, ...]:
    """Angles, deg, of the body that defines the period where clearance decides which way a linkage goes on: change points of
    its twin, by its `passage`. Empty for a linkage without clearance, whose change points are passed or refused."""
    if not mechanism.clearances or found is None or found[1].ended is not None:
        return ()
    assembly, walk = found
    return tuple(sorted(angle_of(pose_at(assembly, walk, node)) for node in walk.changes))


def loops_of(structure: Mechanism) -> Loops | None:
    """The loop-closure constraints of samples' twins, of what the samples have in common; None if they are not to be judged."""
    twin = twin_of(structure)
    return None if twin is None else Loops(twin, trees=True)

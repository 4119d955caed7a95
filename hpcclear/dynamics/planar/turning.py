"""Whether linkages can turn as their drives prescribe, found out before anything is simulated.

What is walked is the ideal twin, with pins in place of clearances. One that a torque drives is not judged: it may swing. With
clearance a change point is for the dynamics to decide, unless the constraints of the ideal joints alone depend on one another
there.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hpcclear.base.arrays import Array, Booleans, Integers
from hpcclear.base.errors import InputError
from hpcclear.base.outcome import Status
from hpcclear.dynamics.linkage.assembly import Assembly, assemble, is_open
from hpcclear.dynamics.linkage.linkage import with_numbers
from hpcclear.dynamics.linkage.loops import Loops
from hpcclear.dynamics.linkage.mechanism import Mechanism, freedom
from hpcclear.dynamics.linkage.numbers import values
from hpcclear.dynamics.linkage.parts import (
    Clearance,
    ConstantSpeed,
    Joint,
    Revolute,
    TorqueDrive,
)
from hpcclear.dynamics.linkage.passage import MOST_ROUNDS, Node, Passage, clear
from hpcclear.dynamics.linkage.poses import coordinates
from hpcclear.dynamics.linkage.prescribed import cartesian, passage_of, refusal

DEPENDENT = 1e-3
"""Smallest singular value of the ideal joints' constraints, rows scaled to 1, at which they depend on one another at a change
point, which is known to a few digits less than other poses."""


def without_play(mechanism: Mechanism) -> Mechanism:
    """The mechanism with pins in place of clearances, and a drive of constant speed in place of a torque."""

    drives = tuple(
        ConstantSpeed(d.name, d.body, d.usual_speed, d.period, d.turns)
        if isinstance(d, TorqueDrive)
        else d
        for d in mechanism.drives
    )
    return replace(mechanism, joints=pinned(mechanism), drives=drives, loads=())


def pinned(mechanism: Mechanism) -> tuple[Joint, ...]:
    """The joints of a mechanism, pins in place of clearances."""
    return tuple(
        Revolute(joint.name, joint.journal, joint.bearing)
        if isinstance(joint, Clearance)
        else joint
        for joint in mechanism.joints
    )


def twin_of(mechanism: Mechanism) -> Mechanism | None:
    """The mechanism without clearance, if its drives prescribe all of its motion."""
    if any(isinstance(drive, TorqueDrive) for drive in mechanism.drives):
        return None
    try:
        twin = without_play(mechanism) if mechanism.clearances else mechanism
    except InputError:  # a joint holds what others hold already, once it has no clearance
        return None
    return None if freedom(twin) else twin


def passage(mechanism: Mechanism, gravity: float, rounds: int) -> tuple[Assembly, Passage] | None:
    """The walk of a linkage's twin through so many revolutions, put together; None where it is not to be judged.

    Raises
    ------
    InputError
        If a mechanism without clearance cannot be put together.
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
        return assembly, passage_of(assembly, rounds, gravity)
    found = passage_of(assembly, MOST_ROUNDS)
    singular = list(found.changes)
    if found.ended is not None and found.ended.status is Status.NEAR_SINGULAR:
        singular.append(found.ended.node)
        found.ended = None
    for node in singular:
        if _dependent(mechanism, assembly, found, node):
            found.end(Status.NEAR_SINGULAR, node)
            break
    return assembly, found


def _dependent(mechanism: Mechanism, assembly: Assembly, walk: Passage, node: Node) -> bool:
    """Whether the constraints of the ideal joints and drives depend on one another at a pose of the twin."""
    time = np.array([node.time])
    ((q, v),) = cartesian(assembly, walk, node.q[:, None], node.v[:, None], time)
    loops = assembly.loops
    rows = np.array([not is_open(mechanism, owner) for owner in loops.owners], bool)
    jacobian = (loops.at(q, v, node.time).jacobian * loops.scales)[rows]
    jacobian = jacobian / np.linalg.norm(jacobian, axis=1)[:, None]
    return bool(np.linalg.svd(jacobian)[1][-1] < DEPENDENT)


def refused(mechanism: Mechanism, gravity: float, rounds: int) -> tuple[Status, InputError] | None:
    """The status of a linkage that cannot turn, and what to say; None of one that can, or is not to be judged."""
    found = passage(mechanism, gravity, rounds)
    if found is None or found[1].ended is None:
        return None
    error = refusal(*found)
    key = f"mechanism.{error.key}"
    return found[1].ended.status, InputError(key, error.value, error.reason, error.remedy)


def loops_of(structure: Mechanism) -> Loops | None:
    """The loop-closure constraints of samples' twins, of what the samples have in common; None if they are not to be judged."""
    twin = twin_of(structure)
    return None if twin is None else Loops(twin, trees=True)


def statuses(
    loops: Loops | None, sample: Mechanism, made: Sequence[tuple[Mechanism, Assembly] | None],
    gravity: float, rounds: int,
) -> Integers:  # fmt: skip
    """Statuses (m,) of samples: whether each can turn.

    Parameters
    ----------
    loops : Loops or None
        Of `loops_of`; they take the samples' numbers.
    sample : Mechanism
        With numbers of samples (m,).
    made : sequence of Mechanism and Assembly, or None
        Each sample by itself, put together; None of one that does not close.
    gravity : float
    rounds : int
        Revolutions that one without clearance is walked through.
    """
    found = np.full(len(made), int(Status.CANNOT_TURN))
    closed = np.array([one is not None for one in made], bool)
    found[closed] = int(Status.OK)
    if loops is None or not closed.any():
        return found
    doubtful = closed & ~_clear(loops, sample, made)
    for row in np.flatnonzero(doubtful).tolist():
        one = made[row]
        assert one is not None
        try:
            told = refused(one[0], gravity, rounds)
        except InputError:
            told = None
        found[row] = int(Status.OK if told is None else told[0])
    return found


def _clear(
    loops: Loops, sample: Mechanism, made: Sequence[tuple[Mechanism, Assembly] | None]
) -> Booleans:
    """Which samples (m,) surely turn."""
    tables: dict[str, Any] = {
        "bodies": sample.bodies, "joints": pinned(sample), "drives": sample.drives,
        "ground": sample.ground, "loads": (),
    }  # fmt: skip
    numbers = with_numbers(loops.mechanism, **tables)
    loops.take(values(numbers))
    nowhere = np.full(loops.size, np.nan)
    start = [nowhere if one is None else coordinates(loops.forest, one[1])[0] for one in made]
    main = numbers.period
    seconds: Array = np.broadcast_to(np.asarray(main.seconds, float), len(made))
    return clear(loops, np.array(start).T, seconds, getattr(main, "turns", 1))

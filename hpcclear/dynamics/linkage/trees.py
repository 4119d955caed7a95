"""Where a mechanism is cut: trees of ideal joints, their coordinates and frames, and the joints that close loops.

A joint with clearance is a force, so it is cut. What is left is a forest: its trees hang on the ground or on a free body
(x, y of the mass centre). Angles are absolute: a frame is an angle that one body has, or several whose guides keep them
parallel. Guides enter the trees before pins, so that what closes a loop is a pin where that can be had. In Cartesian
coordinates every body is free, and every ideal joint and prescribed angle is a constraint (the paper's eq. 11).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from hpcclear.dynamics.linkage.bending import kind_of
from hpcclear.dynamics.linkage.mechanism import Mechanism
from hpcclear.dynamics.linkage.parts import GROUND, Drive, Joint, TableRow, is_pin, places_of, split


class Coordinate(NamedTuple):
    """One coordinate: "x" or "y" of a free body's mass centre, "angle" of a frame, "slide" along a guide, "bend1" and so on
    of a bar's modes."""

    kind: str
    body: str

    @property
    def name(self) -> str:
        """A name for the text."""
        return f"{self.kind}_{self.body}"


class Hang(NamedTuple):
    """How a body hangs in its tree: by a joint, from a place of its parent, at a place of its own; free without joint."""

    joint: Joint | None
    parent: str = ""
    own: str = ""


@dataclass(frozen=True)
class Forest:
    """Trees, coordinates and frames of a mechanism."""

    mechanism: Mechanism
    hangs: dict[str, Hang]  # how each body hangs, parents before children
    frames: dict[str, str]  # which body's angle each body has, or the ground's
    offsets: dict[str, float]  # by how much each body is turned against its frame, rad
    # modes of bending first, then in the bodies' order; last the angle of the body that the period's drive turns
    coordinates: tuple[Coordinate, ...]
    prescribed: dict[str, Drive]  # drives by frame, where the angle is given
    closures: tuple[TableRow, ...]  # what is left as a constraint
    cartesian: bool = False  # whether every body is a tree by itself

    def index(self, kind: str, body: str) -> int | None:
        """Which coordinate it is, if it is one; of several modes the first."""
        return self._numbers.get((kind, body))

    @cached_property
    def _numbers(self) -> dict[tuple[str, str], int]:
        numbered = enumerate(self.coordinates)
        return {(one.kind, one.body): k for k, one in reversed(list(numbered))}

    def turning(self, frame: str) -> bool:
        """Whether a frame ever turns."""
        return frame in self.prescribed or self.index("angle", frame) is not None

    def on_ground(self, body: str) -> bool:
        """Whether a body hangs on a pin of the ground, and is rigid."""
        hang = self.hangs[body]
        if self.mechanism.body(body).bending is not None:
            return False
        return hang.joint is not None and is_pin(hang.joint) and split(hang.parent)[0] == GROUND


def forest(mechanism: Mechanism, cartesian: bool = False, closed: bool = False) -> Forest:
    """Cut a mechanism into trees; `cartesian`: into single bodies.

    `closed`, of single bodies only: as if no joint had clearance and no drive gave way.
    """
    joints = list(mechanism.joints if closed else mechanism.ideal)
    edges, closures = ([], joints) if cartesian else _spanning(mechanism)
    if cartesian:
        edges = [joint for joint in closures if joint.kind == "fixed"]
        closures = [joint for joint in closures if joint.kind != "fixed"]
    hangs = _hung(mechanism, edges)
    frames, offsets = _frames(hangs)
    prescribed = {frames[d.body]: d for d in mechanism.drives if d.prescribed and not cartesian}
    ends = [d for d in mechanism.drives if d.prescribed or closed] if cartesian else []
    return Forest(
        mechanism, hangs, frames, offsets, _coordinates(mechanism, hangs, frames, prescribed),
        prescribed, (*closures, *ends), cartesian,
    )  # fmt: skip


def _spanning(m: Mechanism) -> tuple[list[Joint], list[Joint]]:
    """Ideal joints of the trees, and those that close loops."""
    group = {name: name for name in (GROUND, *(body.name for body in m.bodies))}
    edges: list[Joint] = []
    closures: list[Joint] = []
    order = {"fixed": 0, "slide": 1, "revolute": 2}
    for joint in sorted(m.ideal, key=lambda joint: order.get(joint.kind, len(order))):
        one, two = (group[split(place)[0]] for place in places_of(joint))
        if one == two or joint.holds == 1:  # nothing hangs by one constraint alone
            closures.append(joint)
            continue
        edges.append(joint)
        group = {name: one if held == two else held for name, held in group.items()}
    return edges, closures


def _hung(m: Mechanism, edges: list[Joint]) -> dict[str, Hang]:
    """How each body hangs; the ground is the first root, then the first body of each tree without it."""
    hangs: dict[str, Hang] = {}
    for root in (GROUND, *(body.name for body in m.bodies)):
        if root in hangs:
            continue
        if root != GROUND:
            hangs[root] = Hang(None)
        waiting = [root]
        while waiting:
            here = waiting.pop(0)
            for joint in edges:
                first, second = places_of(joint)
                for own, parent in ((first, second), (second, first)):
                    body = split(own)[0]
                    if split(parent)[0] == here and body not in hangs and body != GROUND:
                        hangs[body] = Hang(joint, parent, own)
                        waiting.append(body)
    return hangs


def _frames(hangs: dict[str, Hang]) -> tuple[dict[str, str], dict[str, float]]:
    """Whose angle each body has, and by how much it is turned against that frame, rad."""
    frames, offsets = {GROUND: GROUND}, {GROUND: 0.0}
    for body, hang in hangs.items():
        parent = split(hang.parent)[0]
        if hang.joint is not None and hang.joint.kind in ("slide", "fixed"):
            turned = hang.joint.angle if hang.own == hang.joint.point else -hang.joint.angle
            frames[body], offsets[body] = frames[parent], offsets[parent] + turned
        else:
            frames[body], offsets[body] = body, 0.0
    return frames, offsets


def _coordinates(
    m: Mechanism, hangs: dict[str, Hang], frames: dict[str, str], prescribed: dict[str, Drive]
) -> tuple[Coordinate, ...]:
    bars = ((body.name, body.bending.modes) for body in m.bodies if body.bending is not None)
    found = [Coordinate(kind_of(k), name) for name, modes in bars for k in range(1, modes + 1)]
    for body in m.bodies:
        joint = hangs[body.name].joint
        if joint is None:
            found += [Coordinate("x", body.name), Coordinate("y", body.name)]
        if frames[body.name] == body.name and body.name not in prescribed:
            found.append(Coordinate("angle", body.name))
        if joint is not None and joint.kind == "slide":
            found.append(Coordinate("slide", body.name))
    main = Coordinate("angle", frames[m.period.body])
    return (*(c for c in found if c != main), *(c for c in found if c == main))

"""Where all bodies of a linkage are, and how fast they move, from the coordinates that are integrated; and the way back."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.terms import ZERO, named
from hpcclear.dynamics.linkage.closing import Closing, dot
from hpcclear.dynamics.linkage.expression import Rows, Writer
from hpcclear.dynamics.linkage.kinematics import CENTER, Kinematics
from hpcclear.dynamics.linkage.loops import of_terms
from hpcclear.dynamics.linkage.parts import GROUND, Number, is_pin
from hpcclear.dynamics.linkage.trees import Forest


class Pose(NamedTuple):
    """Positions (m) and velocities (m/s) of mass centres, angles (rad) and angular velocities (rad/s) of bodies."""

    x: Array
    y: Array
    angle: Array
    vx: Array
    vy: Array
    spin: Array


class Poses:
    """Poses of all bodies and eccentricities of the joints with clearance, as a text read with arrays.

    `rows` has rows of parameters that are known, and afterwards those from `free` on besides.
    """

    def __init__(self, forest: Forest, rows: Mapping[str, int], free: int) -> None:
        self.forest = forest
        n = len(forest.coordinates)
        writer = Writer(rows, free, hoist=False)
        kin = Kinematics(forest, writer, Rows(coordinates=0, velocities=n, time=2 * n))
        lines: list[str] = []
        for k, body in enumerate(forest.mechanism.bodies):
            centre = kin.point(f"{body.name}.{CENTER}")
            for r, term in enumerate((*kin.position(centre), *kin.velocity(centre))):
                lines.append(f"out[{6 * k + r}] = {writer.text(term)}")
            frame = forest.frames[body.name]
            angle = ZERO if frame == GROUND else named(f"angle_{frame}")
            lines.append(f"out[{6 * k + 4}] = {writer.text(angle)}")
            lines.append(f"out[{6 * k + 5}] = {writer.text(kin.spin(frame))}")
        first = 6 * len(forest.mechanism.bodies)
        for k, contact in enumerate(forest.mechanism.contacts):
            places = contact.journal, contact.bearing
            journal, bearing = (kin.position(kin.point(place)) for place in places)
            apart = journal - bearing
            if not is_pin(contact.joint):  # the part across the line
                across = Closing(kin, writer).direction(contact.joint).across()
                apart = across.times(dot(apart, across))
            for axis, part in enumerate(apart):
                lines.append(f"out[{first + 2 * k + axis}] = {writer.text(part)}")
        self.size = first + 2 * len(forest.mechanism.contacts)
        self._evaluate = of_terms(forest.mechanism, writer, lines, "out")
        self.rows = {name: row for name, row in writer.rows.items() if name in writer.read}

    def par_of(self, base: Mapping[str, Number]) -> Array:
        """Parameters (rows,) of this object's rows, by names as of `numbers.values`."""
        par = np.zeros(max(self.rows.values(), default=0) + 1)
        for name, row in self.rows.items():
            par[row] = base[name]
        return par

    def at(self, par: Array, q: Array, v: Array, time: Array | float) -> tuple[Pose, Array]:
        """Poses, each (bodies, m), and eccentricities (contacts, 2, m): of a journal from the centre of its bearing, of a
        corner from the line of its guide.

        `par` is (PARAMETERS,) or (m, PARAMETERS); `q`, `v` (n, m); `time` in s since the start of the revolution, one or (m,).
        """
        n = len(self.forest.coordinates)
        count = q.shape[-1] if n else np.size(time)
        work = [*q[:n], *v[:n], np.broadcast_to(time, count)]
        out = [np.zeros(count)] * self.size
        self._evaluate(work, par.T, out)
        rows = np.array([np.broadcast_to(one, count) for one in out])
        bodies = self.forest.mechanism.bodies
        of_bodies = rows[: 6 * len(bodies)].reshape(len(bodies), 6, count)
        x, y, vx, vy, angle, spin = of_bodies.swapaxes(0, 1)
        offsets = np.array([self.forest.offsets[body.name] for body in bodies])
        eccentricity = rows[6 * len(bodies) :].reshape(-1, 2, count)
        return Pose(x, y, angle + offsets[:, None], vx, vy, spin), eccentricity

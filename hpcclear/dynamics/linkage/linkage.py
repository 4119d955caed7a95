"""A linkage as the kernel takes it: where its parameters stand, its texts in these rows, and their values."""

from functools import cached_property
from types import ModuleType

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.bending import Bent, bent, entries, kind_of
from hpcclear.dynamics.linkage.compiled import module_with
from hpcclear.dynamics.linkage.expression import On, Rows
from hpcclear.dynamics.linkage.generator import Motion, curves_of, generate
from hpcclear.dynamics.linkage.loops import Loops
from hpcclear.dynamics.linkage.mechanism import Mechanism, coupled, gain_of
from hpcclear.dynamics.linkage.numbers import row_of, values
from hpcclear.dynamics.linkage.parts import Number
from hpcclear.dynamics.linkage.poses import Pose, Poses
from hpcclear.dynamics.linkage.trees import Forest, forest


class Linkage:
    """A mechanism's structure: what its texts hold and where. Numbers that are zero in it are zero in every sample.

    `on`: what all its texts have; `cartesian`: every body by itself, with multipliers and feedback; `bristles`: of friction in
    the joints with clearance, whose coordinates come before the mechanism's; `places`: of the contacts among the kernel's;
    `parameter_rows`: of a sample. Raises InputError if it needs more parameters than the kernel holds.
    """

    def __init__(
        self, mechanism: Mechanism, on: On, *, cartesian: bool, bristles: int, places: tuple[int, ...]
    ) -> None:  # fmt: skip
        self.mechanism, self._on = mechanism, on
        self._bristles, self.places = bristles, places
        self.cartesian, self.follow = cartesian, on.follow
        self._texts: dict[On, Motion] = {}
        self._given: dict[str, int] = {}
        self.parameter_rows = at.OWN
        # has the rows of all others
        self._whole = self._text(_with_impacts(self._on)._replace(pins=True))
        self.poses = Poses(self.forest, self._given, self.parameter_rows)
        self._take(self.poses.rows)
        bars = [body for body in mechanism.bodies if body.bending is not None]
        masses = [f"{b.name}_{part}" for b in mechanism.bodies for part in ("mass", "inertia")]
        masses += [f"{b.name}_bend_{part}" for b in bars for part in entries(b.bending.modes)]
        for name in masses:
            if name not in self._given:
                self._take({name: self.parameter_rows})
        count = sum(joint.kind == "revolute" for joint in mechanism.joints)
        if count > at.MAX_PINS:
            reason = f"more than {at.MAX_PINS} pins without clearance"
            raise InputError("mechanism.joints", count, reason, "Use fewer bodies")
        needed, most = self.parameter_rows - at.OWN, at.WAVES - at.OWN
        if needed > most:
            reason = f"need {needed} parameters, more than {most}"
            remedy = "Use fewer bodies or points"
            raise InputError("mechanism.bodies", len(mechanism.bodies), reason, remedy)

    def _text(self, on: On) -> Motion:
        """A text, in the rows that those before it have taken."""
        if on not in self._texts:
            first = at.RATE_NOW + at.PLACES + len(self.curve_rows)
            places = {name: first + k for k, name in enumerate(self.straight)}
            given, free, curves = self._given, self.parameter_rows, self.curve_rows
            rows = Rows(parameters=given, free=free, curves=curves, places=places)
            rows = rows.behind(self._bristles)
            text = generate(self.mechanism, on, rows, cartesian=self.cartesian)
            self._texts[on] = text
            taken = {text.derived.get(name, name): row for name, row in text.parameters.items()}
            assert len(self._texts) == 1 or taken.keys() <= self._given.keys(), on
            self._take(taken)
        return self._texts[on]

    def _take(self, rows: dict[str, int]) -> None:
        self._given |= rows
        self.parameter_rows = max([self.parameter_rows, *(row + 1 for row in rows.values())])

    @cached_property
    def forest(self) -> Forest:
        """Its trees and coordinates."""
        return forest(self.mechanism, self.cartesian)

    @cached_property
    def loops(self) -> Loops:
        """The constraints of its Cartesian bodies."""
        return Loops(self.mechanism)

    @cached_property
    def curve_rows(self) -> dict[str, int]:
        """Rows of tabulated values at the stage, by drive or load; raises InputError if there are too many."""
        parts = (*self.mechanism.drives, *self.mechanism.loads)
        tabled = [name for one in parts for name in curves_of(one)]
        count = len(tabled) + len(self.straight)
        if count > at.MAX_CURVES:
            reason = f"more than {at.MAX_CURVES} tabulated curves"
            raise InputError("mechanism.loads", count, reason, "Give some of them as constants")
        return {name: at.CURVES + k for k, name in enumerate(tabled)}

    @cached_property
    def straight(self) -> dict[str, list[str]]:
        """Tables that run straight from row to row, and the parameters that say where they bend."""
        parts = (*self.mechanism.drives, *self.mechanism.loads)
        tables = {name: len(rows) for one in parts for name, rows in one.straight.items()}
        return {name: [f"{name}_start_{k}" for k in range(n)] for name, n in tables.items()}

    @property
    def bends(self) -> list[list[int]]:
        """Rows of the parameters where these tables bend."""
        return [[self._given[name] for name in names] for names in self.straight.values()]

    def module(self, effects: at.Effects) -> ModuleType:
        """The module of its motion with these effects."""
        on = self._on._replace(
            energies=bool(effects.energies), series=bool(effects.series), responses=bool(effects.responses),
            pins=bool(effects.series),
        )  # fmt: skip
        on = _with_impacts(on) if effects.impacts else on
        return module_with(self._text(on), self.places)

    def fill(
        self, par: Array, sample: Mechanism, gravity: Number, feedback: tuple[float, float]
    ) -> None:
        """Write the rows of its own into parameters (m, PARAMETERS), of a mechanism with numbers (m,) or single ones."""
        base = values(sample, self.cartesian, gravity=gravity, feedback=feedback)
        for row, value in row_of(self._whole, base).items():
            par[:, row] = value
        for name, row in self._given.items():
            if name in base:
                par[:, row] = base[name]

    def energies(
        self, par: Array, q: Array, v: Array, time: Array | float, gravity: Array | float
    ) -> tuple[Array, Array, Array]:
        """Kinetic energy and that of gravity and of bending (m,), J, and eccentricities (contacts, 2, m).

        Arguments as of `Poses.at`.
        """
        pose, eccentricity = self.poses.at(par, q, v, time)
        bodies = self.mechanism.bodies
        names = [[f"{b.name}_{part}" for b in bodies] for part in ("mass", "inertia")]
        rows = (par.T[[self._given[name] for name in part]] for part in names)
        mass, inertia = (part.reshape(len(bodies), -1) for part in rows)
        kinetic = 0.5 * (mass * (pose.vx**2 + pose.vy**2) + inertia * pose.spin**2).sum(axis=0)
        potential = gravity * (mass * pose.y).sum(axis=0)
        for k, found in self.bent(par, q, v, pose).items():
            kinetic = kinetic + found.kinetic
            potential = potential + found.strain + gravity * found.raised(pose.angle[k])
        return kinetic, potential, eccentricity

    def bent(self, par: Array, q: Array, v: Array, pose: Pose) -> dict[int, Bent]:
        """What bending adds, by the numbers of the bodies that bend; arguments as of `Poses.at`."""
        result = {}
        for k, body in enumerate(self.mechanism.bodies):
            if body.bending is None:
                continue
            modes = body.bending.modes
            first = self.forest.index(kind_of(1), body.name) or 0
            own = f"{body.name}_bend_"
            found = {name: par.T[self._given[own + name]] for name in entries(modes)}
            cosine, sine = np.cos(pose.angle[k]), np.sin(pose.angle[k])
            along = cosine * pose.vx[k] + sine * pose.vy[k]
            across = cosine * pose.vy[k] - sine * pose.vx[k]
            rows = slice(first, first + modes)
            result[k] = bent(found, q[rows], v[rows], (along, across, pose.spin[k]))
        return result

    def gained(self, body: str, of: Mechanism) -> Number:
        """Return by how much a body of samples turns in a revolution, rad, where its angle restarts with each: of a drive that
        prescribes it by the time in it, of the coordinate that gives the period, and of what springs couple to these."""
        main, frame = self.mechanism.period, self.forest.frames[body]
        drive = self.forest.prescribed.get(frame)
        if drive is None and frame != self.forest.frames[main.body]:
            with_it = next(names for names in self._coupled if body in names)
            drives = main, *self.forest.prescribed.values()
            drive = next((one for one in drives if one.body in with_it), None)
            return 0.0 if drive is None else gain_of(of, drive)
        return gain_of(of, drive or main)

    @cached_property
    def _coupled(self) -> list[set[str]]:
        return coupled(self.mechanism)


def _with_impacts(on: On) -> On:
    """What a text that measures impacts has: all that is measured, so that there is one of them."""
    return on._replace(energies=True, series=True, responses=True, impacts=True)

"""The pilot of a study of which an accuracy is asked: what its errors are, and what they cost.

Some designs are simulated at several tolerances, the same points at each: pairs tell what a tolerance does to mean and
deviation. More points at one of them tell how errors of samples fall.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.scene import Scene
from hpcclear.scene.domain import box, to_physical
from hpcclear.scene.points import Points
from hpcclear.scene.sampling import generator, monte_carlo, unit_lhs
from hpcclear.scene.stages import SCRAMBLINGS
from hpcclear.statistics.random.allocation import Evidence, evidence
from hpcclear.statistics.random.replicates import moments

LADDER = tuple(10.0**-k for k in range(3, 7))
"""Tolerances of the pilot; the ladder goes on if none is good enough."""

STEPS = (0, 3), (1, 2)
"""Which of them are looked at first, and which where that does not tell. The tightest is what the others are measured against:
less tight ones do not show all that a loose one does."""

DESIGNS = 4
"""Designs of the pilot over all cases, the originals besides."""

SCREENED, SCREENING = 16, 2
"""Designs that each case's are chosen from, and points of each scrambling for that: what is verified is good, and a small
deviation has larger relative errors."""

PAIRS = 4
"""Points of each scrambling that pairs are made of at first."""

POINTS = 8
"""Points of each scrambling that tell how errors of samples fall, at the loosest tolerance, which designs are chosen by."""

Simulate = Callable[[str, Scene, Points], tuple[Array, float]]
"""Objectives of points, NaN where failed, and evaluations of the equations of motion a simulation; by a label of its own."""


class Design(NamedTuple):
    """A design of the pilot: its case, its name, its design variables, SI."""

    case: str
    name: str
    values: dict[str, float]


class Pilot:
    """Simulations of the pilot so far.

    Parameters
    ----------
    scene : Scene
        With `study.accuracy`.
    simulate : callable

    Attributes
    ----------
    labels : list of str
        Of its designs.
    rungs : list of float
        Tolerances, loosest first.
    length : int
        Points of each scrambling that pairs are made of.
    spent : float
        Evaluations of the equations of motion.

    Raises
    ------
    InputError
        All simulations at a tolerance fail.
    """

    def __init__(self, scene: Scene, simulate: Simulate) -> None:
        self._scene, self._simulate = scene, simulate
        self.spent, self._parts = 0.0, 0
        self._designs, screened = self._chosen()
        self.labels = [f"{design.case} {design.name}" for design in self._designs]
        self.rungs, self.length = list(LADDER), PAIRS
        more, each = self._values(LADDER[0], SCREENING, POINTS - SCREENING)
        self._points, self._each = np.concatenate([screened, more], axis=2), each
        self._pairs: dict[int, Array] = {}
        self._evaluations: dict[int, float] = {}
        self._steps = list(STEPS)
        self.fuller()

    @property
    def partial(self) -> bool:
        """Whether some tolerances of the ladder were not looked at yet."""
        return bool(self._steps)

    def evidence(self) -> Evidence:
        """What they tell."""
        count = len(self.rungs)
        pairs = np.full((count, len(self._designs), SCRAMBLINGS, self.length), np.nan)
        evaluations = np.full(count, np.nan)
        for rung, values in self._pairs.items():
            pairs[rung], evaluations[rung] = values, self._evaluations[rung]
        return evidence(
            np.array(self.rungs), evaluations, pairs, self._points,
            self._scene.required_study.verification.confidence,
        )  # fmt: skip

    def fuller(self) -> None:
        """The next of the ladder's tolerances that were not looked at."""
        for rung in self._steps.pop(0):
            self._look(rung)

    def tighter(self) -> None:
        """A rung more."""
        self.rungs.append(self.rungs[-1] / 10.0)
        self._look(len(self.rungs) - 1)

    def longer(self) -> None:
        """Twice the pairs at every tolerance that was looked at."""
        self.length *= 2
        for rung in self._pairs:
            self._look(rung)

    def price_of_tightening(self) -> float:
        """Evaluations that `tighter` takes, about: as much more than the last rung as that took more than the one before."""
        before, last = (self._evaluations[rung] for rung in sorted(self._evaluations)[-2:])
        grown = last**2 / max(before, 1.0)
        return len(self._designs) * SCRAMBLINGS * self.length * grown

    def price_of_doubling(self) -> float:
        """Evaluations that `longer` takes."""
        each = sum(self._evaluations.values())
        return len(self._designs) * SCRAMBLINGS * self.length * each

    def _look(self, rung: int) -> None:
        """As many points of each scrambling at a tolerance as pairs are made of."""
        known = self._pairs.get(rung, np.empty((len(self._designs), SCRAMBLINGS, 0)))
        there = known.shape[2]
        more, each = self._pairs_of(rung, there, self.length - there)
        before = there * self._evaluations.get(rung, 0.0)
        self._pairs[rung] = np.concatenate([known, more], axis=2)
        self._evaluations[rung] = (before + (self.length - there) * each) / self.length

    def _pairs_of(self, rung: int, first: int, length: int) -> tuple[Array, float]:
        """Objectives and evaluations, from those that are there already as far as they go."""
        if rung == 0 and first + length <= POINTS:
            return self._points[:, :, first : first + length], self._each
        return self._values(self.rungs[rung], first, length)

    def _values(self, rtol: float, first: int, length: int) -> tuple[Array, float]:
        """Objectives (designs, scramblings, length), and evaluations a simulation."""
        scene = self._scene.with_({"study.accuracy": None, "numerics.rtol": rtol})
        values, spent = [], 0.0
        for case in dict.fromkeys(design.case for design in self._designs):
            own = [design.values for design in self._designs if design.case == case]
            points = _points(scene, case, own, first, length)
            self._parts += 1
            found, each = self._simulate(f"budget-{self._parts}", scene, points)
            values.append(found.reshape(len(own), SCRAMBLINGS, length))
            spent += each * len(points)
        made = np.concatenate(values)
        if not np.isfinite(made).any():
            raise InputError(
                "study.accuracy", rtol, f"all {made.size} simulations of its pilot failed at this rtol",
                "Run hpcclear simulate on the scene to see why",
            )  # fmt: skip
        self.spent += spent
        return made, spent / made.size

    def _chosen(self) -> tuple[list[Design], Array]:
        """The original of each case, and of a Latin hypercube the designs of least mean and least deviation, then others; with
        their first objectives at the loosest tolerance, (designs, scramblings, SCREENING)."""
        study = self._scene.required_study
        each = -(-DESIGNS // len(study.cases))
        self._designs = _screened(self._scene)
        values, _ = self._values(LADDER[0], 0, SCREENING)
        chosen: list[int] = []
        for case in study.cases:
            first, *rows = [k for k, one in enumerate(self._designs) if one.case == case.name]
            both = np.array([[one.value for one in moments(values[k])] for k in rows])
            both = np.where(np.isfinite(both), both, np.inf)
            best = [rows[k] for k in (*both.argmin(axis=0), *range(len(rows)))]
            chosen += [first, *list(dict.fromkeys(best))[:each]]
        return [self._designs[k] for k in chosen], values[chosen]


def _screened(scene: Scene) -> list[Design]:
    """The original and designs of a Latin hypercube, of each case in turn."""
    study = scene.required_study
    found = []
    for case in study.cases:
        names = study.design_variables(case.name)
        first = [scene.number(study.variable(name).paths[0]) for name in names]
        found.append(Design(case.name, "original", dict(zip(names, first, strict=True))))
        region = box(scene, names)
        unit = unit_lhs(SCREENED, len(names), generator(study.seed, "budget", case.name))
        rows = to_physical(scene, names, region.lower + unit * (region.upper - region.lower))
        for k, row in enumerate(rows.tolist()):
            found.append(Design(case.name, f"pilot {k + 1}", dict(zip(names, row, strict=True))))
    return found


def _points(
    scene: Scene, case: str, designs: Sequence[dict[str, float]], first: int, length: int
) -> Points:
    """The points `first` and on of all scramblings of all designs, one after the other."""
    made = [
        monte_carlo(
            scene, length, random=scene.required_study.case(case).random, design=design,
            purpose="budget", first=first, scrambling=number,
        )
        for design in designs
        for number in range(SCRAMBLINGS)
    ]  # fmt: skip
    return Points(made[0].names, np.concatenate([one.values for one in made]), made[0].paths)

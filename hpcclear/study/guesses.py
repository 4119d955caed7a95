"""What the surrogate of f says of the designs of a search: the scatter of simulations that it explains needs none to average
out (control variate), and what it makes of designs is the trend that models of simulated ones start from.

Sources: P. Glasserman, "Monte Carlo Methods in Financial Engineering" (2003), section 4.1, doi:10.1007/978-0-387-21617-1; of
a model of few costly values upon one of many cheap ones M. C. Kennedy and A. O'Hagan, "Predicting the output from a complex
computer code when fast approximations are available", Biometrika 87 (2000), doi:10.1093/biomet/87.1.1.
"""

from collections.abc import Callable, Sequence

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.scene.cases import Case
from hpcclear.scene.domain import Box, to_coordinates
from hpcclear.scene.sampling import unit_lhs
from hpcclear.scene.stages import REPLICATES
from hpcclear.statistics.surrogate.fitting import fit_kriging
from hpcclear.statistics.surrogate.kernels import MATERN
from hpcclear.statistics.surrogate.piecewise import Piecewise
from hpcclear.study import goals, truth
from hpcclear.study.budget import FIRST
from hpcclear.study.failures import excess_of
from hpcclear.study.optimisation import Choice, choices
from hpcclear.study.run import StudyRun

LENGTH, TRENDS = 128, 64
"""Points of each replicate at which the surrogate is averaged for a design, at least, and for a trend."""

TRENDED = 25
"""Designs per variable from which its trends are known."""


class Guesses:
    """The surrogates of f and of further responses at the points of simulations; none, and no trend, without surrogates."""

    def __init__(self, run: StudyRun, case: Case, models: Sequence[Piecewise], least: int) -> None:
        self._run, self._case, self._models = run, case, models
        self.length = max(least, LENGTH)

    def __bool__(self) -> bool:
        return bool(self._models)

    def of(self, choice: Choice, length: int) -> Array:
        """Responses of a design, as `hpcclear.study.truth.made` has them, (k, replicates, `length`): of a power of two."""
        each, spans = REPLICATES // truth.NETS, [(0, FIRST)]
        while spans[-1][1] < length:
            spans.append((spans[-1][1], 2 * spans[-1][1]))
        # a design that grows gets its points a doubling at a time, each in the order of the replicates
        parts = [np.arange(each * a, each * b).reshape(each, b - a) for a, b in spans]
        found = self._of_sequences(choice, length)[..., np.concatenate(parts, axis=1)]
        return found.reshape(len(found), REPLICATES, length)

    def _of_sequences(self, choice: Choice, length: int) -> Array:
        """The same by sequences, (k, `NETS`, all points of each)."""
        names, model = self._run.study.models[-1], self._models[0]
        points = truth.scattered(self._run, choice, length, "search")
        values = points.values[:, [points.names.index(name) for name in names]]
        places = np.clip(to_coordinates(self._run.scene, names, values), model.lower, model.upper)
        f, *further = (one.predict(places) for one in self._models)
        return np.reshape([f, np.zeros(len(f)), *further], (2 + len(further), truth.NETS, -1))

    def trends(self, region: Box, rng: np.random.Generator) -> list[Callable[[Array], Array]]:
        """What objectives, then constraints, come to by the surrogate, of designs (n, d) to (n,) each."""
        if not self:
            return []
        count, bounds = len(region.names), region.bounds
        places = region.at(unit_lhs(TRENDED * count, count, rng))
        made = choices(self._run, self._case.name, places)
        columns = np.array([self._columns(one) for one in made]).T
        values = np.array([list(one.design.values()) for one in made])
        designs = to_coordinates(self._run.scene, region.names, values)
        designs = np.clip(designs, *bounds.T)  # round-off at the border
        return [
            fit_kriging(designs, one, bounds, rng=rng, restarts=0, kernel=MATERN).predict
            for one in columns
        ]

    def _columns(self, choice: Choice) -> list[float]:
        values, design = self._of_sequences(choice, TRENDS), choice.design
        values = values.reshape(len(values), REPLICATES, TRENDS)
        found = [goals.goal_value(one, values, design, 0.95).value for one in self._case.goals]
        return found + [excess_of(one, values, design).value for one in self._case.kept]

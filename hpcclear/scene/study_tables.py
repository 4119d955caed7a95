"""The entries of the [study] table: what is varied, how it is sampled, the settings of each stage; what follows from them."""

import itertools
from typing import Annotated, Literal

from pydantic import Field

from hpcclear.plugins import OBJECTIVES
from hpcclear.scene import goals
from hpcclear.scene.cases import Case
from hpcclear.scene.correlation import Correlation
from hpcclear.scene.fields import Count, NamedRows, Table
from hpcclear.scene.moving import Moving
from hpcclear.scene.random_inputs import RandomInput
from hpcclear.scene.stages import (
    CertificateOfEffects,
    MomentAccuracy,
    Names,
    Sensitivity,
    Surrogate,
    Swarm,
    Verification,
)
from hpcclear.scene.variables import Variable

_LINKS = ("crank", "rod", "slider")  # in the order they are joined
_LINK_NUMBERS = ("mass", "mass_center", "inertia")


class StudyTables(Moving, Table):
    """The entries of the table of a study, each valid by itself."""

    seed: Annotated[int, Count(0, 2**63 - 1)] = 0
    """Seed of all random numbers of the study."""
    method: Literal["lhs", "monte-carlo", "random-lhs", "qmc"] = "lhs"
    """Sampling method of `sample`. "lhs": Latin hypercube over the ranges of the variables. The others use the
    distributions of the random inputs: "monte-carlo", independent draws; "random-lhs", Latin hypercube of the
    probabilities; "qmc", a randomised Sobol sequence (use a power of two)."""
    samples: Annotated[int, Count(1, 10**9)] = 200
    """Number of training points of each Kriging model, and of samples that `sample` simulates."""
    test_samples: Annotated[int, Count(0, 10**6)] = 50
    """Number of additional points on which each Kriging model is tested."""
    objective: Annotated[str, goals.ObjectiveName(OBJECTIVES)] = "mean-gap"
    """Objective f to minimise: the mean gap (eq. 13), another response, or an objective of your own."""
    accuracy: MomentAccuracy | None = None
    """Target half-widths of the confidence intervals of mean and standard deviation of verified designs, relative: one
    number for both, or a table. Each design is simulated until it meets them. The half-widths include the error of the
    integration tolerance, measured by pairs of samples at a tighter tolerance. Default: `mean = 0.002`, `deviation =
    0.005` for the sampling error alone; the printed intervals then still include the error of the tolerance, from a few
    pairs."""
    variables: Annotated[tuple[Variable, ...], NamedRows()]
    random: Annotated[tuple[RandomInput, ...], NamedRows()] = ()
    correlation: Correlation | None = None
    cases: Annotated[tuple[Case, ...], NamedRows()] = ()
    sensitivity: Sensitivity = Sensitivity()
    surrogate: Surrogate = Surrogate()
    swarm: Swarm = Swarm()
    verification: Verification = Verification()
    worst_case: Annotated[bool, Field(strict=True)] = False
    """Whether to search the largest f of the best designs within the bounds of the random inputs (corners and inside).
    Inputs without bounds are taken within three standard deviations."""
    certificate: CertificateOfEffects | None = None
    """Effect screening before the study. Without this table the stage is omitted."""

    @property
    def further(self) -> Names:
        """Responses besides its objective that objectives and constraints of cases are of."""
        asked = (goal.of for case in self.cases for goal in (*case.goals, *case.kept))
        return tuple(dict.fromkeys(one for one in asked if one not in (None, self.objective)))  # type: ignore[arg-type]

    @property
    def names(self) -> Names:
        """Names of the study variables, in file order: the columns of its designs."""
        return tuple(variable.name for variable in self.variables)

    def variable(self, name: str) -> Variable:
        """The variable of that name; KeyError if there is none."""
        return {variable.name: variable for variable in self.variables}[name]

    def random_input(self, name: str) -> RandomInput:
        """The random input of that name; KeyError if there is none."""
        return {row.name: row for row in self.random}[name]

    @property
    def wanted(self) -> MomentAccuracy:
        """Target half-widths of verified designs, or their defaults."""
        return MomentAccuracy() if self.accuracy is None else self.accuracy

    @property
    def paired(self) -> bool:
        """Whether the error of the tolerance is part of a target accuracy; a fixed number of draws has no target."""
        return self.accuracy is not None and self.verification.draws is None

    def case(self, name: str) -> Case:
        """The case of that name; KeyError if there is none."""
        return {case.name: case for case in self.cases}[name]

    @property
    def worn(self) -> tuple[RandomInput, ...]:
        """Random inputs whose values are clearances of worn joints."""
        return tuple(row for row in self.random if row.worn)

    @property
    def groups(self) -> tuple[Names, ...]:
        """Inputs of the response surfaces, fitted at each level of the sensitivity's parameter."""
        if self.sensitivity.groups is not None:
            return self.sensitivity.groups
        if self.sensitivity.parameter not in self.names:
            return ()
        owner = {row.paths[0]: row.name for row in self.variables if len(row.paths) == 1}
        pairs = (
            (owner.get(f"mechanism.{one}.{number}"), owner.get(f"mechanism.{other}.{number}"))
            for number in _LINK_NUMBERS
            for one, other in itertools.pairwise(_LINKS)
        )
        found = ((one, other) for one, other in pairs if one is not None and other is not None)
        return tuple(found) or self._two_by_two()

    def _two_by_two(self) -> tuple[Names, ...]:
        """Variables of a linkage's bodies in file order; the last of an odd number goes with the two before it."""
        of_bodies = [
            row.name
            for row in self.variables
            if row.name != self.sensitivity.parameter
            and row.paths
            and all(path.startswith("mechanism.bodies.") for path in row.paths)
        ]
        last = max(len(of_bodies) - len(of_bodies) % 2 - 2, 0)
        pairs = [tuple(of_bodies[k : k + 2]) for k in range(0, last, 2)]
        return tuple(group for group in (*pairs, tuple(of_bodies[last:])) if group)

    @property
    def models(self) -> tuple[Names, ...]:
        """Inputs of the Kriging models; the last one has those of `optimisation` that f knows."""
        models = self.surrogate.models
        if models is None:
            parameter = self.sensitivity.parameter
            models = tuple((*group, parameter) for group in self.groups if parameter is not None)
        searched = tuple(n for n in self.optimisation if not self.variable(n).silent)
        return (*(model for model in models if model != searched), searched)

    @property
    def optimisation(self) -> Names:
        """Variables of the optimisation: inputs of the model the swarm searches, and those that only random inputs know."""
        chosen = self.surrogate.optimisation
        return (
            tuple(one.name for one in self.variables if one.over is None)
            if chosen is None
            else chosen
        )

    @property
    def load_cases(self) -> Variable | None:
        """The variable whose values or rows are load cases of every design."""
        return next((one for one in self.variables if one.over is not None), None)

    def design_variables(self, case: str) -> Names:
        """Z of a case: inputs of the optimisation that are not random wherever the design is."""
        rows = {row.name: row for row in self.random}
        random = self.case(case).random
        return tuple(
            name for name in self.optimisation if not (name in random and rows[name].absolute)
        )

"""The entries of the [study] table: what is varied, how it is sampled, the settings of each stage; what follows from them."""

import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property, lru_cache
from typing import Annotated, Literal

from pydantic import StrictBool

from hpcclear.base import quantiles
from hpcclear.plugins import OBJECTIVES
from hpcclear.scene import stages
from hpcclear.scene.cases import Case, ObjectiveName
from hpcclear.scene.choices import input_entry
from hpcclear.scene.correlation import Correlation
from hpcclear.scene.fields import Count, NamedRows, Table, check_known, invalid
from hpcclear.scene.named import Range
from hpcclear.scene.random_inputs import RandomInput
from hpcclear.scene.variables import StudyVariable

MOST_EXTREMES = 1024
"""Designs at most at which a distribution that depends on the design is looked at."""


def claim(owner: dict[str, str], path: str, name: str, key: str) -> None:
    """Note that `name` drives an entry; an error for validators where another one does."""
    if owner.setdefault(path, name) != name:
        remedy = "Remove one, or give them different paths"
        raise invalid(f"{name} and {owner[path]} both drive {path}", remedy, key)


_LINKS = ("crank", "rod", "slider")  # in the order they are joined
_LINK_NUMBERS = ("mass", "mass_center", "inertia")

DRAWN = {
    "lhs": "Latin hypercube over the ranges of the study variables",
    "monte-carlo": "independent samples of the random inputs",
    "random-lhs": "Latin hypercube of the random inputs",
    "qmc": "Sobol sequence of the random inputs",
}
"""Sampling in words, by method (attribute ``sampling``)."""


class StudyTables(Table):
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
    objective: Annotated[str, ObjectiveName(OBJECTIVES)] = "mean-gap"
    """Objective f to minimise: the mean gap (eq. 13), another response, or an objective of your own."""
    accuracy: stages.MomentAccuracy | None = None
    """Target half-widths of the confidence intervals of mean and standard deviation of verified designs, relative: one number
    for both, or a table. Each design is simulated until it meets them. The half-widths include the error of the integration
    tolerance, measured by pairs of samples at a tighter tolerance. Default: `mean = 0.002`, `deviation = 0.005` for the
    sampling error alone; the printed intervals then still include the error of the tolerance, from a few pairs."""
    variables: Annotated[tuple[StudyVariable, ...], NamedRows()]
    random: Annotated[tuple[RandomInput, ...], NamedRows()] = ()
    correlation: Correlation | None = None
    cases: Annotated[tuple[Case, ...], NamedRows()] = ()
    sensitivity: stages.Sensitivity = stages.Sensitivity()
    surrogate: stages.Surrogate = stages.Surrogate()
    swarm: stages.Swarm = stages.Swarm()
    verification: stages.Verification = stages.Verification()
    worst_case: StrictBool = False
    """Whether to search the largest f of the best designs within the bounds of the random inputs (corners and inside).
    Inputs without bounds are taken within three standard deviations."""
    certificate: stages.CertificateOfEffects | None = None
    """Effect screening before the study. Without this table the stage is omitted."""

    @property
    def further(self) -> stages.Names:
        """Responses besides its objective that objectives and constraints of cases are of."""
        asked = (goal.of for case in self.cases for goal in (*case.goals, *case.kept))
        return tuple(dict.fromkeys(one for one in asked if one not in (None, self.objective)))  # type: ignore[arg-type]

    @property
    def names(self) -> stages.Names:
        """Names of the study variables, in file order: the columns of its designs."""
        return tuple(variable.name for variable in self.variables)

    def variable(self, name: str) -> StudyVariable:
        """The variable of that name; KeyError if there is none."""
        return {variable.name: variable for variable in self.variables}[name]

    def random_input(self, name: str) -> RandomInput:
        """The random input of that name; KeyError if there is none."""
        return {row.name: row for row in self.random}[name]

    @property
    def wanted(self) -> stages.MomentAccuracy:
        """Target half-widths of verified designs, or their defaults."""
        return self.accuracy or stages.MomentAccuracy()

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
    def groups(self) -> tuple[stages.Names, ...]:
        """Inputs of the response surfaces, fitted at each level of the sensitivity's parameter."""
        if self.sensitivity.groups is not None:
            return self.sensitivity.groups
        if self.sensitivity.parameter not in self.names:
            return ()
        owner = {row.paths[0]: row.name for row in self.variables if len(row.paths) == 1}
        pairs = list[stages.Names]()
        for number in _LINK_NUMBERS:
            own = [owner.get(f"mechanism.{link}.{number}", "") for link in _LINKS]
            pairs += [pair for pair in itertools.pairwise(own) if all(pair)]
        return tuple(pairs) or self._two_by_two()

    def _two_by_two(self) -> tuple[stages.Names, ...]:
        """Variables of a linkage's bodies in file order; the last of an odd number goes with the two before it."""
        rows = [row for row in self.variables if row.paths]
        named = [r.name for r in rows if all(p.startswith("mechanism.bodies.") for p in r.paths)]
        of_bodies = [name for name in named if name != self.sensitivity.parameter]
        last = max(len(of_bodies) - len(of_bodies) % 2 - 2, 0)
        pairs = [tuple(of_bodies[k : k + 2]) for k in range(0, last, 2)]
        return tuple(group for group in (*pairs, tuple(of_bodies[last:])) if group)

    @property
    def models(self) -> tuple[stages.Names, ...]:
        """Inputs of the Kriging models; the last one has those of `optimisation` that f knows."""
        models = self.surrogate.models
        if models is None:
            parameter = self.sensitivity.parameter
            models = tuple((*group, parameter) for group in self.groups if parameter is not None)
        searched = tuple(n for n in self.optimisation if not self.variable(n).silent)
        return (*(model for model in models if model != searched), searched)

    @property
    def optimisation(self) -> stages.Names:
        """Variables of the optimisation: inputs of the model the swarm searches, and those that only random inputs know."""
        if self.surrogate.optimisation is not None:
            return self.surrogate.optimisation
        return tuple(one.name for one in self.variables if one.over is None)

    @property
    def load_cases(self) -> StudyVariable | None:
        """The variable whose values or rows are load cases of every design."""
        return next((one for one in self.variables if one.over is not None), None)

    def design_variables(self, case: str) -> stages.Names:
        """Z of a case: inputs of the optimisation that are not random wherever the design is."""
        rows = {row.name: row for row in self.random}
        fixed = {name for name in self.case(case).random if rows[name].absolute}
        return tuple(name for name in self.optimisation if name not in fixed)

    def own_entries(self, variable: StudyVariable) -> tuple[str, ...]:
        """Numbers of the scene that rows of a variable have, but for clearances of fits that a random input draws."""
        rows = [row for row in self.random if f"random.{row.name}.fit" in variable.input_paths]
        drawn = {path for row in rows for path in row.paths}
        return tuple(path for path in variable.entry_paths if path not in drawn)

    @cached_property
    def _drivers(self) -> dict[str, tuple[StudyVariable, ...]]:
        """Variables that drive each random input."""
        found: dict[str, tuple[StudyVariable, ...]] = {row.name: () for row in self.random}
        for one in self.variables:
            for name in {input_entry(path)[0] for path in one.input_paths} & found.keys():
                found[name] += (one,)
        return found

    def drivers(self, row: RandomInput) -> tuple[str, ...]:
        """Names of the variables that drive entries of a random input."""
        return tuple(one.name for one in self._drivers[row.name])

    def moves(self, row: RandomInput) -> bool:
        """Whether the distribution of a random input depends on the design."""
        return bool(row.relative or self._drivers[row.name])

    def law(self, row: RandomInput, design: Mapping[str, float]) -> quantiles.Quantiles:
        """`RandomInput.law` of a random input at a design (SI, by name); what the design leaves out is as in the scene."""
        if not self.moves(row):
            return row.law
        entries: dict[str, object] = {}
        for one in self._drivers[row.name]:
            if one.name in design:
                for path, value in one.drives(float(design[one.name])).items():
                    name, entry = input_entry(path)
                    if name == row.name:
                        entries[entry] = value
        found = self._changed(row.name, tuple(entries.items())) if entries else row.law
        if row.relative and row.name in design:
            return quantiles.Scaled(found, abs(float(design[row.name])))
        return found

    @cached_property
    def _changed(self) -> Callable[[str, tuple[tuple[str, object], ...]], quantiles.Quantiles]:
        """Makes a random input's distribution with other entries, and keeps it: those of fits are tables."""
        return lru_cache(MOST_EXTREMES)(
            lambda name, entries: self.random_input(name).changed(dict(entries))
        )

    def reach(self, row: RandomInput) -> Range:
        """Least and largest value that counts of a random input, over all designs; of the difference from the design at the
        lower and at the upper bound of its variable, where it follows that."""
        spans = [self.law(row, design).span for design in self._extremes(row)] or [row.law.span]
        low, high = min(span[0] for span in spans), max(span[1] for span in spans)
        if row.relative:
            own = next(one for one in self.variables if one.name == row.name)
            return low * abs(own.bounds[0]), high * abs(own.bounds[1])
        return low, high

    def _extremes(self, row: RandomInput) -> Iterator[dict[str, float]]:
        """Designs between which the distribution of a random input changes; none where nothing drives it."""
        own = self._drivers[row.name]
        ends = [one.options if one.rows else one.bounds for one in own]
        if math.prod(len(one or ()) for one in ends) > MOST_EXTREMES:
            ends = [one and (one[0], one[-1]) for one in ends]
        if own:
            for values in itertools.product(*(one or () for one in ends)):
                yield dict(zip((one.name for one in own), values, strict=True))

    def check_laws(self) -> None:
        """An error for validators unless random inputs that variables drive are there, and make distributions at all their
        values."""
        owner: dict[str, str] = {}
        for variable in self.variables:
            for path in variable.input_paths:
                self._check_driven(variable, path)
                claim(owner, path, variable.name, f"variables.{variable.name}")
        for row in self.random:
            self._check_moving(row)

    def _check_driven(self, variable: StudyVariable, path: str) -> None:
        name, entry = input_entry(path)
        key, known = f"variables.{variable.name}", {row.name: row for row in self.random}
        check_known(name, known, "is not a random input of this study", key)
        if "." not in entry and getattr(known[name], entry) is None:
            remedy = f"Give study.random.{name}.{entry} the value of the design in this file"
            raise invalid(f"the random input {name} has no {entry}", remedy, key)

    def _check_moving(self, row: RandomInput) -> None:
        own = next((one for one in self.variables if one.name == row.name), None)
        if row.relative and (own is None or own.ratio is not None):
            reason = "is a share of a number that no variable of this study has"
            remedy = f"Add study.variables.{row.name} with a range or values, or write it in SI"
            raise invalid(reason, remedy, f"random.{row.name}.half_width")
        if own is not None and not own.paths:
            raise invalid("its variable has no number", "Name another entry", f"random.{row.name}")
        for design in self._extremes(row):
            try:
                self.law(row, design)
            except (ValueError, OverflowError) as error:
                shown = ", ".join(f"{name} = {value:g}" for name, value in design.items())
                reason = f"makes no distribution with {shown}: {getattr(error, 'reason', error)}"
                raise invalid(reason, "Narrow what drives it", f"random.{row.name}") from None

"""The [study] table: what a file may leave out, and whether its entries fit one another."""

import math
from collections.abc import Iterable, Mapping

from hpcclear.base.arithmetic import names_in
from hpcclear.base.errors import at
from hpcclear.plugins import OBJECTIVES
from hpcclear.scene.cases import Case, in_si
from hpcclear.scene.fields import Content, Entries, check_known, invalid
from hpcclear.scene.named import paths_of, texts_in
from hpcclear.scene.paths import replace
from hpcclear.scene.random_inputs import RandomInput
from hpcclear.scene.stages import Sensitivity, of_both
from hpcclear.scene.study_tables import StudyTables, claim

_NO_INPUT, _NO_VARIABLE = "is not a random input of this study", "is not a study variable"
LEAST_PER_INPUT = 3
"""Samples of a surface that chooses its terms for each of its linear ones, at least."""


class Study(StudyTables):
    """Sampling and optimisation over a scene."""

    @classmethod
    def _of_file(cls, row: Entries) -> Entries:
        """Cases as plain lists of names, random inputs with the paths of the variable of that name,
        and the sensitivity's parameter."""
        data = dict(row)
        stage = data.get("verification")
        if isinstance(stage, Mapping) and "accuracy" in stage and "accuracy" not in data:
            # files of earlier versions have it there
            data["verification"] = {k: entry for k, entry in stage.items() if k != "accuracy"}
            data["accuracy"] = stage["accuracy"]
        if "accuracy" in data:
            data["accuracy"] = of_both(data["accuracy"])
        cases, variables, random = data.get("cases"), data.get("variables"), data.get("random")
        if isinstance(cases, Mapping):
            asked = data.get("objective", "mean-gap")
            data["cases"] = {n: in_si(one, asked, f"cases.{n}") for n, one in cases.items()}
        if isinstance(random, Mapping) and isinstance(variables, Mapping):
            found = {name: _with_paths(one, variables.get(name)) for name, one in random.items()}
            data["variables"] = {name: _with_unit(one, found) for name, one in variables.items()}
            data["random"] = found
        stage = data.get("sensitivity", {})
        if isinstance(variables, Mapping) and isinstance(stage, Mapping):
            data["sensitivity"] = {"parameter": _only_clearance(variables), **stage}
        return data

    def _check(self) -> None:
        if not self.variables:
            remedy = "Name at least one, such as m2 = { range = [0.1, 0.4] }"
            raise invalid("the list of variables is empty", remedy, "variables")
        self._check_paths()
        self.check_laws()
        for row in self.random:
            self._check_width(row)
        self._check_correlation()
        self._check_cases()
        self._check_names()
        self._check_sizes()

    def _check_paths(self) -> None:
        owner: dict[str, str] = {}
        for variable in self.variables:
            for path in (*variable.paths, *self.own_entries(variable)):
                claim(owner, path, variable.name, f"variables.{variable.name}")
        for row in self.random:
            others = [owner[p] for p in row.paths if owner.get(p, row.name) != row.name]
            alike = row.name not in self.names or self.variable(row.name).paths == row.paths
            if others or not alike:
                other = (*others, row.name)[0]
                reason = f"drives what the study variable {other} drives"
                raise invalid(reason, f"Name it {other}, without a path", f"random.{row.name}")
            for path in row.paths:
                claim(owner, path, row.name, f"random.{row.name}")

    def _check_width(self, row: RandomInput) -> None:
        if row.worn and row.name not in self.names:
            reason = "worn clearances are no variable of this study, and would have no effect"
            remedy = f"Add study.variables.{row.name} with a range that contains them"
            raise invalid(reason, f"{remedy}, or leave it out", f"random.{row.name}")
        if row.name not in self.names:
            return
        if self.variable(row.name).ratio is not None:
            if row.absolute:
                reason = "a distribution that does not follow the design needs a domain in SI"
                remedy = f"Give study.variables.{row.name} a range instead of a ratio"
                raise invalid(reason, remedy, f"random.{row.name}")
            return
        if row.worn:
            return  # seen when its lives are known
        lower, upper = self.variable(row.name).bounds
        slack = 1e-12 * (upper - lower)  # half-widths of decimal numbers are not exact
        low, high = self.reach(row)
        if row.absolute:
            inside = lower - slack <= low and high <= upper + slack
        else:
            inside = bool(row.relative) or self.moves(row) or high - low <= upper - lower + slack
        if not inside:
            domain = f"{row.name} from {lower:g} to {upper:g}"
            reason = f"the distribution is wider than its domain, {domain}"
            remedy = f"Narrow it, or widen study.variables.{row.name}.range"
            remedy += f", so that it contains {low:.4g} to {high:.4g}" if row.absolute else ""
            raise invalid(reason, remedy, f"random.{row.name}")

    def _check_correlation(self) -> None:
        known = tuple(row.name for row in self.random)
        for name in self.correlation.inputs if self.correlation is not None else ():
            check_known(name, known, _NO_INPUT, "correlation.inputs")
            if self.random_input(name).worn:
                reason = f"{name!r} comes from the wear simulation, which has no other input"
                raise invalid(reason, "Leave it out", "correlation.inputs")

    def _check_cases(self) -> None:
        for case in self.cases:
            for name in case.random:
                inputs = [row.name for row in self.random]
                check_known(name, inputs, _NO_INPUT, f"cases.{case.name}")
                if name not in self.optimisation:
                    reason = f"the surrogate of the optimisation does not contain {name!r}"
                    remedy = "Add it to study.variables and to study.surrogate.optimisation"
                    raise invalid(reason, remedy, f"cases.{case.name}")
            if not self.design_variables(case.name):
                reason = "every distribution of this case is absolute: no design variable is left"
                remedy = "Add a study variable, or give a half_width instead of a range"
                raise invalid(reason, remedy, f"cases.{case.name}")
            self._check_goals(case)

    def _check_goals(self, case: Case) -> None:
        own = self.design_variables(case.name)
        if self.swarm.archive < len(case.goals):
            count = len(case.goals)
            reason = f"case {case.name} has {count} objectives, each with a best design of its own"
            raise invalid(reason, f"Request {count} solutions or more", "swarm.archive")
        met = set[object]()
        for place, goal in case.rows.items():
            key = f"cases.{case.name}.{place}"
            kind = "objective" if place[0] == "o" else "constraint"
            alike = kind, goal.alike(self.objective)
            if alike in met:
                article = "an" if kind == "objective" else "a"
                said = f"is {article} {kind} already", f"Remove it, or name another {kind}"
                raise invalid(*said, key, goal.formula or goal.statistic)
            met.add(alike)
            for name in () if goal.formula is None else names_in(goal.formula):
                with at(f"{key}.formula", goal.formula):
                    check_known(name, own, "is no design variable of this case")
                    if self.variable(name).rows:
                        remedy = 'Give its rows a cost, and write statistic = "cost"'
                        raise invalid(f"{name!r} is a row of a table and no number", remedy)
            if goal.of is not None and goal.of != self.objective:
                if why := self._not_recorded(goal.of):
                    remedy = f"Make it study.objective, and name {self.objective!r} here instead"
                    raise invalid(why, remedy, f"{key}.of", goal.of)
                goal.placed(2 + self.further.index(goal.of))
            if goal.statistic == "cost":
                priced = tuple(one for one in self.variables if one.name in own and one.priced)
                if not priced:
                    remedy = 'Add cost = { law = "reciprocal", at = "20 um", cost = 3 } to one'
                    raise invalid("no design variable has a cost", remedy, f"{key}.statistic")
                goal.priced_by(priced)

    @staticmethod
    def _not_recorded(name: str) -> str:
        """Why samples of a study do not record a response besides its objective; "" if they do."""
        found = OBJECTIVES.get(name)
        if found.rate is not None:
            return "is made of a rate, and a simulation integrates that of its own objective only"
        if "objective" in found.asks:
            return "is made of the mean gap, which samples with another objective do not keep"
        return ""

    def _check_names(self) -> None:
        of_loads = [one.name for one in self.variables if one.over is not None]
        if len(of_loads) > 1:
            reason = f"{of_loads[0]} and {of_loads[1]} both are load cases"
            remedy = "Use one catalogue, with a row for each combination"
            raise invalid(reason, remedy, f"variables.{of_loads[1]}.over")
        for row in self.random:
            if row.name in of_loads:
                raise invalid("is a load case", "Remove it, or name another", f"random.{row.name}")
        self._check_lists(of_loads)
        self._check_groups()

    def _check_lists(self, of_loads: list[str]) -> None:
        """Names in lists of the study's variables."""
        lists: list[tuple[str, Iterable[str]]] = [
            ("surrogate.optimisation", self.surrogate.optimisation or ()),
            *(("surrogate.models", model) for model in self.surrogate.models or ()),
            *(("sensitivity.groups", group) for group in self.sensitivity.groups or ()),
        ]
        for key, given in lists:
            names = tuple(given)
            if not names and "optimisation" not in key:
                raise invalid("a model needs an input", "Name one, or remove the empty list", key)
            for name in names:
                check_known(name, self.names, _NO_VARIABLE, key)
            if len(set(names)) < len(names):
                raise invalid("a variable is named twice", "Remove one", key=key)
            loads = [n for n in names if n in of_loads]
            if loads:
                raise invalid(f"{loads[0]!r} is a load case, chosen by no design", "Remove it", key)
            odd = [n for n in names if not self.variable(n).paths and "optimisation" not in key]
            if odd:
                raise invalid(
                    f"{odd[0]!r} has no slope: it is a row of a table, or a width that f does not know",
                    "Leave it out", key=key,
                )  # fmt: skip

    def _check_groups(self) -> None:
        """The fixed parameter of response surfaces."""
        parameter = self.sensitivity.parameter
        if parameter is not None:
            check_known(parameter, self.names, _NO_VARIABLE, "sensitivity.parameter")
        if self.sensitivity.groups:
            if parameter is None:
                reason = "not one variable drives clearances, so the fixed parameter is not known"
                raise invalid(reason, f"Name one: {', '.join(self.names)}", "sensitivity.parameter")
            if any(parameter in group for group in self.sensitivity.groups):
                reason = "the parameter is fixed, so it cannot be an input of a surface"
                raise invalid(reason, "Remove it from the group", "sensitivity.groups")

    def _check_sizes(self) -> None:
        stage = self.sensitivity
        for group in self.groups:
            _enough(stage, len(group), stage.order, stage.samples, "samples")
        together = len({name for group in self.groups for name in group})
        if together:
            order, samples = stage.together_order, stage.together_samples
            _enough(stage, together, order, samples, "together_samples")
        if self.cases:
            inputs = max(len(model) for model in self.models)
            if self.surrogate.model in (None, "kriging") and self.samples < inputs + 3:
                reason = f"a Kriging model in {inputs} inputs needs {inputs + 3} samples at least"
                raise invalid(reason, f"Request at least {10 * inputs} samples", "samples")


def _with_paths(row: object, variable: object) -> object:
    """A random input with the path or paths of the variable of the same name, unless it has its own."""
    if not isinstance(row, Mapping) or not isinstance(variable, Mapping):
        return row
    if "path" in row or "paths" in row:
        return row
    return {**{key: variable[key] for key in ("path", "paths") if key in variable}, **row}


def _with_unit(row: object, random: Mapping[str, object]) -> object:
    """A variable that drives a random input with an entry that has the same unit."""
    if not isinstance(row, Mapping) or "like" in row:
        return row
    first = next(iter(texts_in(row.get("follows", row.get("paths", row.get("path"))))), "")
    _, _, rest = first.partition("random.")
    name = rest.partition(".")[0]
    own = random.get(name)
    if not name or not isinstance(own, Mapping) or "fits" in row:
        return row
    paths = paths_of(name, own)
    return row if own.get("relative") or not paths else {**row, "like": paths[0]}


def _only_clearance(variables: Mapping[str, object]) -> str | None:
    """Name of the only study variable that drives clearances; None if there is none or another."""
    found = []
    for name, row in variables.items():
        own = row if isinstance(row, Mapping) else {}
        if "range" in own and {p.endswith(".clearance") for p in paths_of(name, own)} == {True}:
            found.append(name)
    return found[0] if len(found) == 1 else None


def with_open_parameter(content: Content) -> Content:
    """A scene's tables without the parameter of the sensitivity where that is the one that follows from the variables."""
    study = content.get("study", {})
    own = study.get("sensitivity", {}).get("parameter")
    follows = own is not None and own == _only_clearance(study["variables"])
    return replace(content, "study.sensitivity.parameter", None) if follows else content


def _enough(stage: Sensitivity, inputs: int, order: int, samples: int, entry: str) -> None:
    """Refuse fewer samples than a surface has terms; of one that chooses them, than its linear ones and a few."""
    terms = math.comb(inputs + order, order)
    what, least = f"of order {order} in {inputs} inputs with {terms} terms", terms
    remedy = f"Request at least {2 * terms} samples, or lower the order"
    if stage.chooses(inputs, order, samples):
        what, least = f"in {inputs} inputs that chooses its terms", LEAST_PER_INPUT * (inputs + 1)
        remedy = f"Request at least {10 * inputs} samples"
    if samples < least:
        reason = f"a surface {what} needs {least} samples at least"
        raise invalid(reason, remedy, f"sensitivity.{entry}")

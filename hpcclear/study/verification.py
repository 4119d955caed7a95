"""Verified designs: which of them is alpha, beta and the front, and where the surrogate missed the truth."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.objectives import ORDINALS, Usual
from hpcclear.base.verdict import Verdict, best, together
from hpcclear.report.constraints import ABSENT
from hpcclear.report.merit import SPAN
from hpcclear.results import dataset
from hpcclear.scene.cases import Case
from hpcclear.scene.domain import bound_at, shares
from hpcclear.statistics.search.certainty import Compared
from hpcclear.statistics.surrogate.piecewise import Piecewise
from hpcclear.study import contest
from hpcclear.study.goals import excess, most_of, wanted
from hpcclear.study.optimisation import Choice
from hpcclear.study.problem import problem_of
from hpcclear.study.run import Result, StudyRun

ROUND_OFF = 1.0001
"""Half-width over the one requested up to which an accuracy is reached."""


def original(run: StudyRun) -> list[Choice]:
    """The design in the scene file, in each case."""
    found = []
    for name in (case.name for case in run.study.cases):
        design = {n: run.scene.baseline(n) for n in run.study.design_variables(name)}
        found += [Choice(f"{name} original", name, design, None, "given")]
    return found


def predicted(run: StudyRun, choices: Sequence[Choice], model: Piecewise) -> Array:
    """Mean and standard deviation by the surrogate, (n, 2); NaN outside its domain."""
    problems = {case.name: problem_of(run.scene, case.name, model) for case in run.study.cases}
    found = []
    for choice in choices:
        problem = problems[choice.case]
        found += [problem.moments(np.array([[choice.design[name] for name in problem.names]]))[0]]
    return np.array(found).reshape(-1, 2)


def missed(run: StudyRun, choices: Sequence[Choice], true: Result, model: Piecewise) -> list[str]:
    """Where the surrogate of f is further from the truth than the study allows at the ends of fronts, in words."""
    settings, texts = run.study.verification, []
    rows = [k for k, one in enumerate(choices) if one.name in run.study.case(one.case).ends]
    surrogate = predicted(run, [choices[k] for k in rows], model)
    for k, guess in zip(rows, surrogate, strict=True):
        errors = guess / [true["mean"][k], true["deviation"][k]] - 1.0
        good = abs(errors) <= (settings.tolerance, settings.deviation_tolerance)  # False for NaN
        if not good.all():
            mean, deviation = 100.0 * errors
            texts.append(f"{choices[k].name} {mean:+.1f} % and {deviation:+.1f} %")
    if not texts:
        return []
    found = "; ".join(texts)
    return [f"Surrogate errors of mean and standard deviation: {found}. Use the simulated values."]


def undecided(run: StudyRun, choices: Sequence[Choice], true: Result) -> list[str]:
    """The best undecided design of each case where it would be better than all that keep the constraints, in words."""
    texts = []
    for case in run.study.cases:
        goal, met = case.goals[0], dict[Verdict, list[tuple[float, int]]]()
        for row, one in enumerate(choices):
            if case.kept and one.case == case.name:
                state = together(true["verdict"][row, : len(case.kept)].astype(int).tolist())
                met.setdefault(state, []).append((float(true["goal"][row, 0]), row))
        kept, _ = min(met.get(Verdict.HOLDS, [(np.nan, 0)]))
        value, row = min(met.get(Verdict.UNDECIDED, [(np.inf, 0)]))
        if value < kept:
            won = f"{(kept - value) / (abs(kept) or 1.0):.2g}"
            words, price = goal.words(run.scene.objective.unit), np.nanmax(true["price"][row])
            needs = f"; about {price:.0f} simulations would decide" if np.isfinite(price) else ""
            would = f"would lower the {words} by {won} of its value{needs}"
            texts.append(f"{choices[row].name} is undecided and {would}.")
    return texts


@dataclass(frozen=True)
class NamedDesigns:
    """Verified designs under their names."""

    choices: list[Choice]
    """Alpha, beta (and further ends) and the front of each case, then all others that were verified. An end of the swarm that
    is also alpha or beta stands there twice."""
    rows: list[int]
    """Number of each in what was simulated."""
    equivalent: list[list[str]]
    """All designs of its case that each is statistically indistinguishable from."""
    dominated: list[bool]
    """Whether another design of its case is significantly better in all that the case makes small."""
    deciding: list[bool]
    """Whether a decision is between it and others: the baseline, the ends of the front, and what is recommended."""
    recommended: list[bool]
    """Whether it is recommended in its case."""


def named(run: StudyRun, choices: Sequence[Choice], true: Result) -> NamedDesigns:
    """Verified designs under the names that they have earned.

    Of what its case makes small, alpha has the least of the first, beta of the second: mean and standard deviation, if
    nothing else is requested; gamma, delta and epsilon of further ones. Of designs that are indistinguishable from it at the
    study's confidence it is the best in the others. Each design of the front is significantly better than each
    other in one of them; among them stands the recommended one (`hpcclear.report.merit`). They are chosen among the designs
    that significantly satisfy all constraints, if there are any.
    """
    table = NamedDesigns([], [], [], [], [], [])
    for case in run.study.cases:
        rows = [k for k, choice in enumerate(choices) if choice.case == case.name]
        _name_case(run, case, rows, choices, true, table)
    return table


class Verified(NamedTuple):
    """Verified designs: under their names, what is known of them, and what a reader should know, a sentence each."""

    table: NamedDesigns
    true: Result
    """Arrays (n, ...) of `hpcclear.study.tolerance.verified`, over the named designs."""
    remarks: list[str]

    @property
    def deciding(self) -> list[Choice]:
        """The named designs that a decision is between."""
        return list(itertools.compress(self.table.choices, self.table.deciding))


def _name_case(
    run: StudyRun, case: Case, rows: Sequence[int], choices: Sequence[Choice], true: Result, table: NamedDesigns
) -> None:  # fmt: skip
    count, kept = len(case.goals), case.kept
    values = true["goal"][rows, :count]
    shifts = np.moveaxis(true["goal_shifts"][rows, :count], 1, 0)
    everything = Compared(values, shifts, run.study.verification.confidence)
    ours = [k for k, row in enumerate(rows) if choices[row].origin == "search"]
    if kept:
        broken = _broken(case, true)[rows]
        each = true["verdict"][rows, : len(kept)].astype(int).tolist()
        ours = _nearest(ours, [together(one) for one in each], broken)
    least = np.nanmin(values[ours], axis=0, initial=np.inf)
    near = np.array([contest.size_of(run, case, one, least) for one in np.eye(count)])
    mine = Compared(values[ours], shifts[:, ours], run.study.verification.confidence, near)
    known = mine.known.any()
    ends = [ours[mine.best(k)] for k in range(count)] if known else ours[:1] * count
    front = mine.front(run.study.verification.designs + count) if known else []
    merit = values[:, 0] + SPAN * values[:, 1] if case.plain else values[:, 0]
    recommended = min(ours, key=lambda k: float(merit[k])) if known else ends[0]
    between = {*(ours[k] for k in front), recommended} - {*ends}
    inner = sorted(between, key=lambda k: float(values[k, 0]))
    named = [*zip(ends, case.ends, strict=True)]
    named += [(k, f"{case.name} front {number + 1}") for number, k in enumerate(inner)]
    taken = {k for k, _ in named}
    left = [k for k in range(len(rows)) if k not in taken or choices[rows[k]].name]
    numbers = itertools.count(1)
    named += [(k, choices[rows[k]].name or f"{case.name} candidate {next(numbers)}") for k in left]
    best_name = next(name for k, name in named if k == recommended)
    for k, name in named:
        table.choices.append(replace(choices[rows[k]], name=name))
        table.rows.append(rows[k])
        alike = [label for j, label in named if everything.one[j, k] and label != name]
        table.equivalent.append(alike)
        table.dominated.append(bool(everything.beaten[k]))
        table.recommended.append(name == best_name)
        table.deciding.append(name in (f"{case.name} original", *case.ends, best_name))


def _nearest(rows: Sequence[int], verdicts: Sequence[Verdict], broken: Array) -> list[int]:
    """Designs that significantly satisfy all constraints; if none does, those that may, first those whose estimates do; else
    the nearest one. `verdicts`, `broken`: on all constraints, and the excess, of all designs, (n,)."""
    found, have = best([verdicts[k] for k in rows])
    level = [k for k, has in zip(rows, have, strict=True) if has]
    if found is Verdict.HOLDS:
        return level
    within = [k for k in level if broken[k] <= 0.0]
    return within or [min(level, key=lambda k: float(broken[k]))]


def _on_bounds(run: StudyRun, choice: Choice) -> str:
    """Variables of a design that sit on a bound, and on which: "m2 lower, u2 upper"."""
    ends = map(bound_at, shares(run.scene, choice.design))
    return ", ".join(f"{name} {end}" for name, end in zip(choice.design, ends, strict=True) if end)


def _goals(run: StudyRun, table: NamedDesigns, true: Result) -> dict[str, Array]:
    """Objectives and constraints of the cases with confidence intervals; empty if all have mean and standard deviation only."""
    if all(case.plain for case in run.study.cases):
        return {}
    unit, data = run.scene.objective.unit, {}
    cases = [run.study.case(choice.case) for choice in table.choices]
    for column, name in enumerate(ORDINALS[: most_of(run.study.cases)]):
        asked = [case.goals[column] if column < len(case.goals) else None for case in cases]
        there = np.array([goal is not None for goal in asked])
        data[f"{name}_goal"] = np.array([goal.words(unit) if goal else "" for goal in asked])
        data[f"{name}_unit"] = np.array([goal.unit(unit) if goal else "" for goal in asked])
        usual = [goal.usual if goal else Usual.OTHER for goal in asked]
        data[f"{name}_usual"] = np.array(usual, np.int8)
        for end in ("", "_lower", "_upper"):  # behind what a case makes small stand its constraints
            values = true[f"goal{end}"][:, column]
            data[f"{name}{end or '_true'}"] = np.where(there, values, np.nan)
    if any(case.kept for case in cases):
        each = {case.name: _broken(case, true) for case in cases}
        found = np.array([each[case.name][row] for row, case in enumerate(cases)])
        data["constraint_excess"] = np.where(np.isneginf(found), np.nan, found)
        data |= _constraints(cases, unit, true)
    return data


def _constraints(cases: Sequence[Case], unit: str, true: Result) -> dict[str, Array]:
    """Values of the constraints of the cases of designs (n,) with confidence intervals, and the verdicts on them."""
    many = max(len(case.kept) for case in cases)
    rows = [[*case.kept, *[None] * (many - len(case.kept))] for case in cases]
    words = [[one.words(unit) if one else "" for one in row] for row in rows]
    units = [[one.unit(unit) if one else "" for one in row] for row in rows]
    most = [[one.most if one else np.nan for one in row] for row in rows]
    data = {
        "constraint_goal": np.array(words),
        "constraint_unit": np.array(units),
        "constraint_most": np.array(most),
        "constraint_price": true["price"][:, :many],
        "constraint_verdict": np.nan_to_num(true["verdict"][:, :many], nan=ABSENT).astype(np.int8),
    }
    for end in ("", "_lower", "_upper"):  # they stand behind what a case makes small
        values = np.full((len(rows), many), np.nan)
        for row, case in enumerate(cases):
            first = len(case.goals)
            values[row, : len(case.kept)] = true[f"goal{end}"][row, first : first + len(case.kept)]
        data[f"constraint{end or '_true'}"] = values
    return data


def _broken(case: Case, true: Result) -> Array:
    """By how much designs break the constraints of a case by their estimates, (n,); the designs that fail always, by how far
    they lie beyond the limit."""
    count, size = len(case.goals), len(case.kept)
    return excess(case.kept, true["goal"][:, count : count + size], true["beyond"][:, :size])


def short_of_accuracy(run: StudyRun, table: NamedDesigns, true: Result) -> list[str]:
    """Of each design which objectives are known less well than the accuracy of the study, "mean ± 0.4 % (requested 0.2 %)"."""
    unit, texts = run.scene.objective.unit, []
    for k, choice in enumerate(table.choices):
        known = []
        for column, goal in enumerate(run.study.case(choice.case).goals):
            half = (true["goal_upper"][k, column] - true["goal_lower"][k, column]) / 2.0
            if goal.usual in (Usual.MEAN, Usual.DEVIATION):
                half = true[f"{goal.statistic}_reach"][k]
            share, relative = wanted(goal, run.study.wanted)
            size = abs(true["goal"][k, column]) if relative else 1.0
            if not goal.exact and half > ROUND_OFF * share * size > 0.0:
                half /= size
                words = "standard deviation" if goal.usual is Usual.DEVIATION else goal.words(unit)
                words = "mean" if goal.usual is Usual.MEAN else words
                known.append(f"{words} ± {100.0 * half:.2g} % (requested {100.0 * share:.2g} %)")
        texts.append(", ".join(known))
    return texts


def write(
    run: StudyRun, verified: Verified, model: Piecewise, printed: Result, over_life: Result
) -> None:
    """Write verification.nc.

    `model`: the surrogate that was searched; `printed`: ``mean`` and ``deviation`` (n,) of the same designs in a publication,
    to stand beside ours; `over_life`: (n,) of `hpcclear.study.lives.of_designs`, empty where nothing wears.
    """
    table, true, remarks = verified
    study, choices = run.study, table.choices
    surrogate = predicted(run, choices, model)
    used = [n for n in study.optimisation if any(n in choice.design for choice in choices)]
    data = {name: np.array([one.design.get(name, np.nan) for one in choices]) for name in used}
    data["case"] = np.array([choice.case for choice in choices])
    for column, name in enumerate(("mean", "deviation")):
        data[f"{name}_true"] = true[name]
        least = 0.0 if name == "deviation" else -np.inf
        data[f"{name}_lower"] = np.maximum(true[name] - true[f"{name}_reach"], least)
        data[f"{name}_upper"] = true[name] + true[f"{name}_reach"]
        data[f"{name}_surrogate"] = surrogate[:, column]
        data[f"{name}_error"] = surrogate[:, column] / true[name] - 1.0
        if over_life:
            value, reach = over_life[name], over_life[f"{name}_reach"]
            data[f"life_{name}"] = value
            data[f"life_{name}_lower"], data[f"life_{name}_upper"] = value - reach, value + reach
        if study.paired:
            data[f"{name}_within"] = true[f"{name}_reach"] / abs(true[name])
        data[f"{name}_tolerance"] = true["tolerance"][:, column]
        data[f"{name}_tolerance_error"] = true["tolerance_error"][:, column]
        if name in printed:
            data[f"{name}_paper"] = printed[name]
    for name in ("percentile", "percentile_lower", "percentile_upper"):
        data[name] = true[name]
    for name in ("samples", "failed", "beyond_hertz"):
        data[name] = true[name].astype(np.int64)
    data["simulations"] = np.array(run.simulations.next)
    if true["rare_samples"].any():
        data["rare_samples"] = true["rare_samples"].astype(np.int64)
    names = np.array([choice.name for choice in choices])
    data["equivalence"] = np.array([np.isin(names, alike) for alike in table.equivalent], np.int8)
    if study.paired:
        data["accuracy_missed"] = np.array(short_of_accuracy(run, table, true))
    data["dominated"] = np.array(table.dominated, np.int8)
    data["random"] = np.array([" ".join(study.case(choice.case).random) for choice in choices])
    data["on_bounds"] = np.array([_on_bounds(run, choice) for choice in choices])
    data |= _goals(run, table, true)
    units = {name: study.variable(name).unit or "1" for name in used}
    coords = {"design": names, "rival": names}
    if "constraint_verdict" in data:
        coords["constraint"] = np.arange(data["constraint_verdict"].shape[1])
    about = None, units, run.scene.objective, run.words
    content = dataset.dataset("verification", coords, data, *about)
    if "first_goal" in content:
        *others, last = (one.words(run.scene.objective.unit) for one in study.cases[0].goals)
        asked = f"{', '.join(others)} and {last}" if others else last
        asked = "the objectives of its case" if len(study.cases) > 1 else asked
        for name in ("equivalence", "dominated"):
            words = content[name].attrs["long_name"].replace("mean and standard deviation", asked)
            content[name].attrs["long_name"] = words
    content.attrs["confidence"] = study.verification.confidence
    content.attrs["method"] = "qmc" if study.verification.draws is None else "monte-carlo"
    content.attrs["remarks"] = " ".join(remarks) if remarks else "none"
    run.write(content)

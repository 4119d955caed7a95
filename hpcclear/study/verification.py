"""Verified designs: which of them is alpha, beta and the front, and where the surrogate missed the truth."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.results import dataset
from hpcclear.scene.cases import Case
from hpcclear.scene.domain import box, to_coordinates
from hpcclear.statistics.search.certainty import Compared
from hpcclear.statistics.surrogate.piecewise import PiecewiseKriging
from hpcclear.study.goals import excess
from hpcclear.study.optimisation import Choice, problem_of
from hpcclear.study.run import Result, StudyRun

ON_BOUND = 5e-3
"""Share of a variable's range within which a design sits on its bound."""


def original(run: StudyRun) -> list[Choice]:
    """The design in the scene file, in each case."""
    found = []
    for case in run.study.cases:
        names = run.study.design_variables(case.name)
        design = {n: run.scene.number(run.study.variable(n).paths[0]) for n in names}
        found.append(Choice(f"{case.name} original", case.name, design, origin="given"))
    return found


def predicted(run: StudyRun, choices: Sequence[Choice], model: PiecewiseKriging) -> Array:
    """Mean and deviation by the surrogate, (n, 2); NaN outside its domain."""
    problems = {case.name: problem_of(run.scene, case.name, model) for case in run.study.cases}
    found = [
        problems[choice.case].moments(
            np.array([[choice.design[name] for name in problems[choice.case].names]])
        )[0]
        for choice in choices
    ]
    return np.array(found).reshape(-1, 2)


def missed(
    run: StudyRun, choices: Sequence[Choice], true: Result, model: PiecewiseKriging
) -> list[str]:
    """Where the surrogate of f is further from the truth than the study allows at alpha and beta, in words."""
    settings, texts = run.study.verification, []
    rows = [k for k, choice in enumerate(choices) if choice.name in ends_of(choice.case)]
    surrogate = predicted(run, [choices[k] for k in rows], model)
    for k, guess in zip(rows, surrogate, strict=True):
        errors = guess / [true["mean"][k], true["deviation"][k]] - 1.0
        good = abs(errors) <= (settings.tolerance, settings.deviation_tolerance)  # False for NaN
        if not good.all():
            texts.append(
                f"At {choices[k].name} the surrogate's mean is {100 * errors[0]:+.1f} % and its "
                f"deviation {100 * errors[1]:+.1f} % off the true one: trust the true values."
            )
    return texts


def ends_of(case: str) -> tuple[str, str]:
    """Names of the designs that a case is about."""
    return f"{case} alpha", f"{case} beta"


@dataclass(frozen=True)
class Table:
    """Verified designs under their names.

    Attributes
    ----------
    choices : list of Choice
        Alpha, beta and the front of each case, then all others that were verified. An end of the swarm that is
        also alpha or beta stands there twice.
    rows : list of int
        Number of each in what was simulated.
    same_as : list of str
        The first design before it that it cannot be told apart from; empty if there is none.
    dominated : list of bool
        Whether another design of its case is surely better in both that the case makes small.
    """

    choices: list[Choice]
    rows: list[int]
    same_as: list[str]
    dominated: list[bool]


def named(run: StudyRun, choices: Sequence[Choice], true: Result) -> Table:
    """Verified designs under the names that they have earned.

    Of what its case makes small, alpha has the least of the first, beta of the second: mean and deviation, if
    nothing else is asked for; of those that cannot be told from it at the study's
    confidence, the best in the other. Each design of the front is surely better than each
    other in one of the two. Designs that break a constraint are none of these, unless all do.
    """
    table = Table([], [], [], [])
    for case in run.study.cases:
        rows = [k for k, choice in enumerate(choices) if choice.case == case.name]
        _name_case(run, case.name, rows, choices, true, table)
    return table


def _name_case(
    run: StudyRun,
    case: str,
    rows: Sequence[int],
    choices: Sequence[Choice],
    true: Result,
    table: Table,
) -> None:
    values = true["goal"][rows, :2]
    shifts = np.moveaxis(true["goal_shifts"][rows, :2], 1, 0)
    everything = Compared(values, shifts, run.study.verification.confidence)
    kept = run.study.case(case).kept
    keeps = excess(kept, true["goal"][rows, 2 : 2 + len(kept)]) <= 0.0
    ours = [k for k, row in enumerate(rows) if choices[row].origin == "search"]
    ours = [k for k in ours if keeps[k]] or ours
    mine = Compared(values[ours], shifts[:, ours], run.study.verification.confidence)
    ends = [ours[mine.best(0)], ours[mine.best(1)]] if mine.known.any() else ours[:1] * 2
    front = mine.front(run.study.verification.designs + 2) if mine.known.any() else []
    inner = sorted(
        (ours[k] for k in front if ours[k] not in ends), key=lambda k: float(values[k, 0])
    )
    named = [*zip(ends, ends_of(case), strict=True)]
    named += [(k, f"{case} front {number + 1}") for number, k in enumerate(inner)]
    taken = {k for k, _ in named}
    left = [k for k in range(len(rows)) if k not in taken or choices[rows[k]].name]
    unnamed = [k for k in left if not choices[rows[k]].name]
    named += [
        (k, choices[rows[k]].name or f"{case} candidate {unnamed.index(k) + 1}") for k in left
    ]
    seen: list[tuple[int, str]] = []
    for k, name in named:
        table.choices.append(replace(choices[rows[k]], name=name))
        table.rows.append(rows[k])
        table.same_as.append(next((label for j, label in seen if everything.one[j, k]), ""))
        table.dominated.append(bool(everything.beaten[k]))
        seen.append((k, name))


def _on_bounds(run: StudyRun, choice: Choice) -> str:
    """Variables of a design that sit on a bound, and on which: "m2 lower, u2 upper"."""
    names = tuple(choice.design)
    region = box(run.scene, names)
    values = np.array([list(choice.design.values())])
    place = (to_coordinates(run.scene, names, values)[0] - region.lower) / (
        region.upper - region.lower
    )
    ends = np.where(
        abs(place) < ON_BOUND, "lower", np.where(abs(place - 1) < ON_BOUND, "upper", "")
    )
    return ", ".join(f"{name} {end}" for name, end in zip(names, ends, strict=True) if end)


_ORDINALS = ("first", "second")


def _goals(run: StudyRun, table: Table, true: Result) -> dict[str, Array]:
    """What cases make small and keep, with limits, in words and numbers; empty where all ask for mean and deviation."""
    if all(case.plain for case in run.study.cases):
        return {}
    unit, data = run.scene.objective.unit, {}
    cases = [run.study.case(choice.case) for choice in table.choices]
    for column, name in enumerate(_ORDINALS):
        data[f"{name}_goal"] = np.array([case.goals[column].words(unit) for case in cases])
        data[f"{name}_unit"] = np.array([case.goals[column].unit(unit) for case in cases])
        data[f"{name}_true"] = true["goal"][:, column]
        data[f"{name}_lower"] = true["goal_lower"][:, column]
        data[f"{name}_upper"] = true["goal_upper"][:, column]
    data["constraints"] = np.array(
        [_kept(case, unit, *rows) for case, rows in zip(cases, _limits(true), strict=True)]
    )
    return data


def _limits(true: Result) -> list[tuple[Array, Array, Array]]:
    """Values and limits of constraints, a tuple a design."""
    return list(zip(*(true[f"goal{end}"][:, 2:] for end in ("", "_lower", "_upper")), strict=True))


def _kept(case: Case, unit: str, values: Array, lower: Array, upper: Array) -> str:
    """How a design stands to its constraints: "share with f above 0.0003 m 0.012 at most 0.05: kept"."""
    texts = []
    for goal, value, low, high in zip(case.kept, values, lower, upper, strict=False):
        surely = "kept" if high <= goal.most else "broken" if low > goal.most else "cannot be told"
        texts.append(f"{goal.words(unit)} {value:.4g} at most {goal.most:g}: {surely}")
    return "; ".join(texts)


def write(
    run: StudyRun,
    table: Table,
    true: Result,
    model: PiecewiseKriging,
    remarks: Sequence[str],
    printed: Mapping[str, Array],
    over_life: Mapping[str, Array],
    within: Array | None = None,
) -> None:
    """Write verification.nc.

    Parameters
    ----------
    run : StudyRun
    table : Table
    true : dict of arrays, shape (n, ...)
        Of `hpcclear.study.truth.simulate`, over the same designs.
    model : PiecewiseKriging
        The surrogate that was searched.
    remarks : sequence of str
        What a reader should know, a sentence each.
    printed : mapping of str to array, shape (n,)
        ``mean`` and ``deviation`` of the same designs in a publication, to stand beside ours.
    over_life : mapping of str to array, shape (n,)
        Of `hpcclear.study.lives.of_designs`; empty where nothing wears.
    within : array, shape (n, 2), optional
        What each reached of an accuracy asked of the study (`hpcclear.study.budget.within`).
    """
    study, choices = run.study, table.choices
    surrogate = predicted(run, choices, model)
    used = [n for n in study.optimisation if any(n in choice.design for choice in choices)]
    data: dict[str, np.ndarray] = {
        name: np.array([choice.design.get(name, np.nan) for choice in choices]) for name in used
    }
    data["case"] = np.array([choice.case for choice in choices])
    for column, name in enumerate(("mean", "deviation")):
        data[f"{name}_true"] = true[name]
        data[f"{name}_lower"] = true[name] - true[f"{name}_reach"]
        data[f"{name}_upper"] = true[name] + true[f"{name}_reach"]
        data[f"{name}_surrogate"] = surrogate[:, column]
        data[f"{name}_error"] = surrogate[:, column] / true[name] - 1.0
        if over_life:
            value, reach = over_life[name], over_life[f"{name}_reach"]
            data[f"life_{name}"] = value
            data[f"life_{name}_lower"], data[f"life_{name}_upper"] = value - reach, value + reach
        if within is not None:
            data[f"{name}_within"] = within[:, column]
        if name in printed:
            data[f"{name}_paper"] = printed[name]
    for name in ("percentile", "percentile_lower", "percentile_upper"):
        data[name] = true[name]
    for name in ("samples", "failed", "beyond_hertz"):
        data[name] = true[name].astype(np.int64)
    data["same_as"] = np.array(table.same_as)
    data["dominated"] = np.array(table.dominated, np.int8)
    data["random"] = np.array([" ".join(study.case(choice.case).random) for choice in choices])
    data["on_bounds"] = np.array([_on_bounds(run, choice) for choice in choices])
    data |= _goals(run, table, true)
    units = {name: study.variable(name).unit or "1" for name in used}
    coords = {"design": np.array([choice.name for choice in choices])}
    content = dataset.dataset(
        "verification", coords, data, None, units, run.scene.objective, run.words
    )
    if "first_goal" in content:
        both = f"{content['first_goal'].item(0)} and {content['second_goal'].item(0)}"
        both = "what its case makes small" if len(study.cases) > 1 else both
        for name in ("same_as", "dominated"):
            words = content[name].attrs["long_name"].replace("mean and deviation", both)
            content[name].attrs["long_name"] = words
    content.attrs["confidence"] = study.verification.confidence
    content.attrs["method"] = "qmc" if study.verification.draws is None else "monte-carlo"
    content.attrs["remarks"] = " ".join(remarks) if remarks else "none"
    run.write(content, "verification.nc")

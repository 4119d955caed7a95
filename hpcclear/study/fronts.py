"""front.nc: what the search of the surrogate came to."""

from collections.abc import Sequence

import numpy as np

from hpcclear.base.objectives import ORDINALS
from hpcclear.results import dataset
from hpcclear.scene.cases import Goal
from hpcclear.scene.domain import to_physical
from hpcclear.statistics.surrogate.piecewise import Piecewise
from hpcclear.study.goals import most_of
from hpcclear.study.optimisation import Choice
from hpcclear.study.problem import problem_of
from hpcclear.study.run import Result, StudyRun


def write(run: StudyRun, fronts: Result, verified: Sequence[Choice], model: Piecewise) -> None:
    """Write front.nc: every run's front of every case, and which solutions were simulated."""
    cases = [case.name for case in run.study.cases]
    names = run.study.optimisation
    solutions = max(fronts[f"front_{k}"].shape[1] for k in range(len(cases)))
    shape = (len(cases), run.study.swarm.runs, solutions)
    used = [n for n in names if any(n in run.study.design_variables(case) for case in cases)]
    data: Result = {name: np.full(shape, np.nan) for name in ("mean", "deviation", *used)}
    data["verified"] = np.zeros(shape, np.int8)
    plain = np.array([case.plain for case in run.study.cases])
    area = np.array([fronts[f"hypervolume_{k}"] for k in range(len(cases))])
    data["hypervolume"] = np.where(plain[:, None], area, np.nan)  # else it has another unit
    searched: list[str] = []
    if not plain.all():
        unit = run.scene.objective.unit
        searched = [f"searched_{name}" for name in ORDINALS[: most_of(run.study.cases)]]
        data |= {name: np.full(shape, np.nan) for name in searched}
        for column, name in enumerate(searched):
            asked = [() if case.plain else case.goals[column:] for case in run.study.cases]
            data[f"{name}_goal"] = np.array([one[0].words(unit) if one else "" for one in asked])
            data[f"{name}_unit"] = np.array([_unit(one[0], unit) if one else "" for one in asked])
    for k, case in enumerate(cases):
        padded, own = fronts[f"front_{k}"], run.study.design_variables(case)
        place = np.s_[k, :, : padded.shape[1]]
        values = padded[..., len(own) :]
        flat = to_physical(run.scene, own, padded[..., : len(own)].reshape(-1, len(own)))
        for column, name in enumerate(searched[: values.shape[-1]]):
            data[name][place] = values[..., column]
        if not run.study.case(case).plain:
            found = problem_of(run.scene, case, model).moments(flat)
            values = found.reshape(*padded.shape[:2], 2)
        data["mean"][place], data["deviation"][place] = values[..., 0], values[..., 1]
        for column, name in enumerate(own):
            data[name][place] = flat[:, column].reshape(padded.shape[:2])
    for choice in verified:
        if choice.place is not None:
            data["verified"][(cases.index(choice.case), *choice.place)] = 1
    coords = {"case": np.array(cases), "run": np.arange(shape[1]), "solution": np.arange(solutions)}
    units = {name: run.study.variable(name).unit or "1" for name in used}
    content = dataset.dataset("front", coords, data, None, units, run.scene.objective, run.words)
    run.write(content)


def _unit(goal: Goal, unit: str) -> str:
    """The unit of an objective by that of f: "1" of a probability, "" of a formula."""
    return goal.unit(unit) or ("1" if goal.statistic == "exceedance" else "")

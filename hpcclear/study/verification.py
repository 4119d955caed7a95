"""Chosen designs back through the true dynamics: direct Monte Carlo, and what the surrogate missed."""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.special import ndtri

from hpcclear.base.arrays import Array
from hpcclear.base.outcome import Flag
from hpcclear.results import dataset
from hpcclear.scene.domain import box, to_coordinates
from hpcclear.scene.points import Points
from hpcclear.scene.sampling import monte_carlo
from hpcclear.statistics.random.moments import sample_moments
from hpcclear.statistics.surrogate.piecewise import PiecewiseKriging
from hpcclear.study import surrogates
from hpcclear.study.optimisation import Choice, problem_of
from hpcclear.study.run import Result, StudyRun

_COLUMNS = ("mean", "mean_error", "deviation", "deviation_error", "failed")

ON_BOUND = 5e-3
"""Share of a variable's range within which a design sits on its bound."""


def original(run: StudyRun) -> list[Choice]:
    """The design in the scene file, in each case."""
    found = []
    for case in run.study.cases:
        names = run.study.design_variables(case.name)
        design = {n: run.scene.number(run.study.variable(n).paths[0]) for n in names}
        found.append(Choice(f"{case.name} original", case.name, design))
    return found


def samples_of(run: StudyRun, choice: Choice, count: int, purpose: str = "verification") -> Points:
    """Monte Carlo samples of a design in all study variables.

    Every design of a case meets the same scatter, so that differences between designs are not
    noise.
    """
    random = run.study.case(choice.case).random
    points = monte_carlo(
        run.scene, count, random=random, design=dict(choice.design), purpose=purpose
    )
    return run.simulations.filled(points.names, points.values)


def simulate(run: StudyRun, choices: Sequence[Choice], stage: str) -> Result:
    """True mean and deviation of designs with standard errors, and counts, arrays over the designs.

    Raises
    ------
    InputError
        If all simulations fail.
    """
    count = run.study.verification.samples
    batches = [samples_of(run, choice, count) for choice in choices]
    points = Points(
        batches[0].names, np.concatenate([batch.values for batch in batches]), batches[0].paths
    )
    records = run.simulations.records(points, stage)
    values = run.simulations.objective(records)
    table = np.array([moments(one) for one in values.reshape(len(choices), count)])
    beyond = (records["flags"] & Flag.BEYOND_HERTZ) != 0
    found = {name: table[:, k] for k, name in enumerate(_COLUMNS)}
    return found | {"beyond_hertz": beyond.reshape(len(choices), count).sum(axis=1)}


def moments(values: Array) -> tuple[float, float, float, float, int]:
    """Mean, deviation (each followed by its standard error) and number of failed samples (NaN).

    All NaN when fewer than four are left.
    """
    finite = values[np.isfinite(values)]
    failed = len(values) - len(finite)
    if len(finite) < 4:
        return np.nan, np.nan, np.nan, np.nan, failed
    found = sample_moments(finite[None])
    mean, mean_error = float(found.mean[0]), float(found.mean_error[0])
    return mean, mean_error, float(found.deviation[0]), float(found.deviation_error[0]), failed


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


def misses(
    run: StudyRun, choices: Sequence[Choice], true: Result, model: PiecewiseKriging
) -> tuple[list[Choice], list[str]]:
    """Designs at which the surrogate is further from the truth than the study allows; in words."""
    settings, missed, texts = run.study.verification, [], []
    surrogate = predicted(run, choices, model)
    for k, choice in enumerate(choices):
        errors = surrogate[k] / [true["mean"][k], true["deviation"][k]] - 1.0
        good = abs(errors) <= (settings.tolerance, settings.deviation_tolerance)  # False for NaN
        if not good.all():
            missed.append(choice)
            texts.append(
                f"At {choice.name} the surrogate's mean is {100 * errors[0]:+.1f} % and its "
                f"deviation {100 * errors[1]:+.1f} % off the true one."
            )
    return missed, texts


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


def infill_points(run: StudyRun, choices: Sequence[Choice], label: str) -> Array:
    """Where the surrogate needs more points: over the scatter of the designs it missed, (n, d).

    In sampling coordinates of the optimisation's model.
    """
    names = run.study.optimisation
    count = -(-run.study.verification.infill_samples // len(choices))
    found = []
    for choice in choices:
        points = samples_of(run, choice, count, f"infill {label} {choice.name}")
        values = np.column_stack([points.column(name) for name in names])
        region = surrogates.domain(run, names)
        coordinates = to_coordinates(run.scene, names, values)
        found.append(np.clip(coordinates, region.lower, region.upper))  # round-off at the border
    return np.concatenate(found)


def write(
    run: StudyRun,
    choices: Sequence[Choice],
    true: Result,
    model: PiecewiseKriging,
    remarks: Sequence[str],
    printed: Mapping[str, Array],
) -> None:
    """Write verification.nc.

    Parameters
    ----------
    run : StudyRun
    choices : sequence of Choice
    true : dict of arrays, shape (n,)
        Of `simulate`, over the same designs.
    model : PiecewiseKriging
        The surrogate that was searched.
    remarks : sequence of str
        What a reader should know, a sentence each.
    printed : mapping of str to array, shape (n,)
        ``mean`` and ``deviation`` of the same designs in a publication, to stand beside ours.
    """
    study, surrogate = run.study, predicted(run, choices, model)
    z = float(ndtri(0.5 + study.verification.confidence / 2.0))
    used = [n for n in study.optimisation if any(n in choice.design for choice in choices)]
    data: dict[str, np.ndarray] = {
        name: np.array([choice.design.get(name, np.nan) for choice in choices]) for name in used
    }
    data["case"] = np.array([choice.case for choice in choices])
    for column, name in enumerate(("mean", "deviation")):
        data[f"{name}_true"] = true[name]
        data[f"{name}_lower"] = true[name] - z * true[f"{name}_error"]
        data[f"{name}_upper"] = true[name] + z * true[f"{name}_error"]
        data[f"{name}_surrogate"] = surrogate[:, column]
        data[f"{name}_error"] = surrogate[:, column] / true[name] - 1.0
        if name in printed:
            data[f"{name}_paper"] = printed[name]
    data["failed"] = true["failed"].astype(np.int64)
    data["beyond_hertz"] = true["beyond_hertz"]
    data["random"] = np.array([" ".join(study.case(choice.case).random) for choice in choices])
    data["on_bounds"] = np.array([_on_bounds(run, choice) for choice in choices])
    data["samples"] = np.full(len(choices), study.verification.samples)
    units = {name: study.variable(name).unit or "1" for name in used}
    coords = {"design": np.array([choice.name for choice in choices])}
    content = dataset.dataset(
        "verification", coords, data, None, units, run.scene.objective, run.words
    )
    content.attrs["confidence"] = study.verification.confidence
    content.attrs["remarks"] = " ".join(remarks) if remarks else "none"
    run.write(content, "verification.nc")

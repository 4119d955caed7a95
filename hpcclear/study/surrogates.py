"""Kriging models of the objective: fitted, checked on fresh points, written and read back."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from hpcclear.results import dataset
from hpcclear.scene.domain import Box, box
from hpcclear.scene.sampling import unit_lhs
from hpcclear.scene.study import Study
from hpcclear.scene.variables import Variable
from hpcclear.statistics.surrogate.kernels import SQUARED_EXPONENTIAL
from hpcclear.statistics.surrogate.kriging import Kriging
from hpcclear.statistics.surrogate.metrics import accuracy
from hpcclear.statistics.surrogate.piecewise import PIECEWISE_FIELDS, PiecewiseKriging
from hpcclear.statistics.surrogate.stored import KERNEL, SCALARS, models_in
from hpcclear.statistics.surrogate.subintervals import SubintervalSettings, fit_subintervals
from hpcclear.study.run import Result, StudyRun

STAGE = "kriging"
_CHECKS = ("r2", "rmae", "r2_explained", "rmae_mean", "rmse")


def coordinate(variable: Variable) -> str:
    """Name of what is sampled for a variable: I2_ratio for an inertia I2 that is given as a ratio."""
    return variable.name if variable.ratio is None else f"{variable.name}_ratio"


def domain(run: StudyRun, names: Sequence[str]) -> Box:
    """Where a model holds; the optimisation's is widened so that no random input leaves it."""
    widen = {name for case in run.study.cases for name in case.random}
    return box(run.scene, names, sorted(widen) if tuple(names) == run.study.optimisation else ())


def fit_all(run: StudyRun) -> Result:
    """Fit every model of the study (method: `hpcclear.statistics.surrogate.subintervals`), and check each.

    Returns
    -------
    dict of arrays
        For `models_of` and `write`.
    """
    result: Result = {}
    for k, names in enumerate(run.study.models):
        region, settings = domain(run, names), run.study.surrogate
        model = fit_subintervals(
            lambda points, names=names: run.simulations.values(names, points, STAGE),  # type: ignore[misc]
            np.column_stack([region.lower, region.upper]),
            SubintervalSettings(
                samples=run.study.samples,
                test_samples=_tests(run.study),
                r2_min=settings.r2,
                rmae_max=settings.rmae,
                max_resamples=settings.resamplings,
                max_depth=settings.cuts,
                restarts=settings.restarts,
                kernel=settings.kernel or SQUARED_EXPONENTIAL,
            ),
            rng=run.rng("kriging", " ".join(names)),
            names=[coordinate(run.study.variable(name)) for name in names],
        )
        result |= _packed(k, model) | _checked(run, k, model)
    return result


def simulations(study: Study) -> int:
    """Simulations of `fit_all`, unless a model is refused."""
    return len(study.models) * (study.samples + 2 * _tests(study))


def _tests(study: Study) -> int:
    """Fresh points that a fit, and again the check of its result, are judged by."""
    return max(study.test_samples, 2)


def models_of(result: Mapping[str, np.ndarray]) -> list[PiecewiseKriging]:
    """The models in a result of `fit_all` (arrays of any shape, by name), in the order of the study's."""
    found: list[PiecewiseKriging] = []
    while f"model{len(found)}_names" in result:
        start = f"model{len(found)}_"
        found.append(
            PiecewiseKriging.from_arrays({name: result[start + name] for name in PIECEWISE_FIELDS})
        )
    return found


def _packed(k: int, model: PiecewiseKriging) -> Result:
    return {f"model{k}_{name}": array for name, array in model.to_arrays().items()}


def _checked(run: StudyRun, k: int, model: PiecewiseKriging) -> Result:
    """Accuracy over the whole domain on fresh points, which decided nothing."""
    names = run.study.models[k]
    rng = run.rng("kriging check", " ".join(names))
    unit = unit_lhs(_tests(run.study), len(names), rng)
    points = model.lower + unit * (model.upper - model.lower)
    truth = run.simulations.values(names, points, f"{STAGE} check")
    reached = accuracy(truth, model.predict(points))
    return {f"model{k}_check": np.array([getattr(reached, name) for name in _CHECKS])}


def write(run: StudyRun, result: Result) -> None:
    """Write kriging.nc: a row for each subinterval's model."""
    models = models_of(result)
    leaves = [(k, leaf) for k, model in enumerate(models) for leaf in model.leaves]
    parameters = list(dict.fromkeys(name for _, leaf in leaves for name in leaf.names))
    points = max(len(leaf.values) for _, leaf in leaves)
    families = [" ".join(model.names) for model in models]
    shape = (len(leaves), points)
    data: dict[str, np.ndarray] = {
        name: np.full(shape, np.nan) for name in ("training_output", "weight", *parameters)
    }
    data["length_scale"] = np.full((len(leaves), len(parameters)), np.nan)
    data["used"] = np.zeros((len(leaves), len(parameters)), np.int8)
    for name in parameters:
        data |= {f"{name}_{end}": np.full(len(leaves), np.nan) for end in ("lower", "upper")}
    for row, (_, leaf) in enumerate(leaves):
        data["training_output"][row, : len(leaf.values)] = leaf.values
        data["weight"][row, : len(leaf.values)] = leaf.alpha
        for column, name in enumerate(leaf.names):
            place = parameters.index(name)
            data["length_scale"][row, place] = leaf.length_scales[column]
            data["used"][row, place] = 1
            data[name][row, : len(leaf.values)] = leaf.inputs[:, column]
            data[f"{name}_lower"][row] = leaf.lower[column]
            data[f"{name}_upper"][row] = leaf.upper[column]
    for name, field in SCALARS.items():
        data[name] = np.array([getattr(leaf, field) for _, leaf in leaves])
    if any(leaf.kernel != SQUARED_EXPONENTIAL for _, leaf in leaves):
        data[KERNEL] = np.array([leaf.kernel for _, leaf in leaves])
    data["points"] = np.array([len(leaf.values) for _, leaf in leaves])
    data["accepted"] = np.concatenate([model.accepted for model in models]).astype(np.int8)
    checks = np.array([result[f"model{k}_check"] for k, _ in leaves])
    data |= {name: checks[:, column] for column, name in enumerate(_CHECKS)}
    data["family"] = np.array([families[k] for k, _ in leaves])
    names = [_label(models[k], families[k], leaf) for k, leaf in leaves]
    coords = {
        "model": np.array(names),
        "point": np.arange(points),
        "parameter": np.array(parameters),
    }
    content = dataset.dataset(
        "kriging", coords, data, None, _units(run), run.scene.objective, run.words
    )
    run.write(content, "kriging.nc")


def _label(model: PiecewiseKriging, family: str, leaf: Kriging) -> str:
    return family if len(model.leaves) == 1 else f"{family} {model.leaves.index(leaf) + 1}"


def _units(run: StudyRun) -> dict[str, str]:
    """Units of sampling coordinates, "1" for ratios."""
    return {
        coordinate(variable): "1"
        if variable.ratio is not None or not variable.unit
        else variable.unit
        for variable in run.study.variables
    }


def read_kriging(path: str | Path) -> dict[str, PiecewiseKriging]:
    """The models in a kriging.nc, by their inputs ("m2 m3 u2 I2_ratio C"), ready to predict.

    Raises
    ------
    InputError
        The file is not one, or is damaged.
    """
    return models_in(dataset.read(path, "kriging"))

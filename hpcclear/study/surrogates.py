"""Surrogates of the objective: fitted, checked on fresh points, written and read back."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from hpcclear.plugins import SURROGATES
from hpcclear.results import dataset
from hpcclear.scene import Scene
from hpcclear.scene.domain import Box, box, to_coordinates
from hpcclear.scene.points import snapped
from hpcclear.scene.sampling import unit_lhs
from hpcclear.scene.study import Study
from hpcclear.scene.variables import StudyVariable
from hpcclear.statistics.surrogate.fitting import KrigingMethod
from hpcclear.statistics.surrogate.kernels import SQUARED_EXPONENTIAL
from hpcclear.statistics.surrogate.metrics import accuracy
from hpcclear.statistics.surrogate.piecewise import Piecewise
from hpcclear.statistics.surrogate.regression import Regression, RegressionMethod, made
from hpcclear.statistics.surrogate.stored import arrays_of, models_in, rows_of
from hpcclear.statistics.surrogate.subintervals import Method, SubintervalSettings, fit_subintervals
from hpcclear.study.run import Result, StudyRun

STAGE = "kriging"
_CHECKS = ("r2", "rmae", "r2_explained", "rmae_mean", "rmse")


def coordinate(variable: StudyVariable) -> str:
    """Name of what is sampled for a variable: I2_ratio for an inertia I2 that is given as a ratio."""
    return variable.name if variable.ratio is None else f"{variable.name}_ratio"


def domain(run: StudyRun, names: Sequence[str]) -> Box:
    """Where a model holds; the one that is searched is widened so that no random input leaves it."""
    widen = {name for case in run.study.cases for name in case.random}
    return box(run.scene, names, sorted(widen) if tuple(names) == run.study.models[-1] else ())


def method_of(scene: Scene) -> Method:
    """The kind of surrogate that a study requests. Raises InputError if what its scene names has no `fit` or no `predict`."""
    settings = scene.required_study.surrogate
    if settings.model is not None and not SURROGATES.is_ours(settings.model):
        source = SURROGATES.get(settings.model, scene.plugin_texts)
        made(source, settings.model, 0)  # so that it is refused before anything is simulated
        return RegressionMethod(source, settings.model)
    return KrigingMethod(settings.restarts, settings.kernel or SQUARED_EXPONENTIAL)


def fit_all(run: StudyRun) -> Result:
    """Fit every model of the study (method: `hpcclear.statistics.surrogate.subintervals`), and check each: arrays for
    `models_of` and `write`."""
    result: Result = {}
    method = method_of(run.scene)
    for k, names in enumerate(run.study.models):
        region, settings = domain(run, names), run.study.surrogate
        begins = tuple(names) == run.study.models[-1] and run.study.verification.infill_rounds > 0
        more = int(not begins)  # the search by simulation is not better for a better start
        wanted = SubintervalSettings(
            samples=run.study.samples,
            test_samples=_tests(run.study),
            r2_min=settings.r2,
            rmae_max=settings.rmae,
            max_resamples=more if settings.resamplings is None else settings.resamplings,
            max_depth=more if settings.cuts is None else settings.cuts,
        )
        model = fit_subintervals(
            partial(run.simulations.values, names, stage=STAGE), region.bounds, wanted,
            method=method, rng=run.rng("kriging", " ".join(names)),
            names=[coordinate(run.study.variable(name)) for name in names],
            snap=partial(snapped, run.study, names, model=True),
        )  # fmt: skip
        result |= {f"model{k}_{name}": array for name, array in arrays_of(model).items()}
        result |= _checked(run, k, model)
    return result


def simulations(study: Study) -> int:
    """Simulations of `fit_all`, unless a model is refused."""
    return len(study.models) * (study.samples + 2 * _tests(study))


def _tests(study: Study) -> int:
    """Fresh points that a fit, and again the check of its result, are judged by."""
    return max(study.test_samples, 2)


def models_of(scene: Scene, result: Mapping[str, np.ndarray]) -> list[Piecewise]:
    """The models in a result of `fit_all` (arrays of any shape, by name), in the order of the study's. Raises InputError if
    a model that is fitted again comes out as another one."""
    found: list[Piecewise] = []
    method = method_of(scene)
    while arrays := _named(result, f"model{len(found)}_"):
        (model,) = models_in(arrays).values()
        if isinstance(method, RegressionMethod):
            ours = (leaf for leaf in model.leaves if isinstance(leaf, Regression))
            model = replace(model, leaves=tuple(map(method.restored, ours)))
        found.append(model)
    return found


def _named(result: Mapping[str, np.ndarray], start: str) -> Result:
    """Arrays whose names begin so, by what follows."""
    return {name[len(start) :]: one for name, one in result.items() if name.startswith(start)}


def of_further(run: StudyRun, model: Piecewise) -> list[Piecewise]:
    """Surrogates of responses besides f that cases require (`Study.further`), of the designs simulated so far in the inputs
    of the model that is searched, as it is of f. Raises InputError if nearly all of these simulations failed."""
    study, names = run.study, run.study.models[-1]
    if not study.further:
        return []
    values, responses = run.simulations.met()
    columns = [study.names.index(name) for name in names]
    loads = study.load_cases
    apart = names if loads is None else (*names, loads.name)
    rest = [k for k, name in enumerate(study.names) if name not in apart]
    here = values[:, rest] == np.array([run.scene.baseline(study.names[k]) for k in rest])
    points = to_coordinates(run.scene, names, values[:, columns])
    inside = (points >= model.lower) & (points <= model.upper)
    rows = here.all(axis=1) & inside.all(axis=1)
    bounds, found = np.column_stack([model.lower, model.upper]), []
    fitted = [coordinate(study.variable(name)) for name in names]
    for name, one in zip(study.further, responses[1:], strict=True):
        data, rng = (points[rows], one[rows], bounds), run.rng("kriging", name)
        leaf = method_of(run.scene).fit(*data, rng=rng, names=fitted)
        found.append(Piecewise((leaf,), np.zeros(1, bool)))
    return found


def _checked(run: StudyRun, k: int, model: Piecewise) -> Result:
    """Accuracy over the whole domain on fresh points, which decided nothing."""
    names = run.study.models[k]
    rng = run.rng("kriging check", " ".join(names))
    unit = unit_lhs(_tests(run.study), len(names), rng)
    points = snapped(run.study, names, model.lower + unit * (model.upper - model.lower), model=True)
    truth = run.simulations.values(names, points, f"{STAGE} check")
    reached = accuracy(truth, model.predict(points))
    return {f"model{k}_check": np.array([getattr(reached, name) for name in _CHECKS])}


def write(run: StudyRun, result: Result, models: Sequence[Piecewise]) -> None:
    """Write kriging.nc: a row for each subinterval's model, of whatever kind."""
    leaves = [(k, leaf) for k, model in enumerate(models) for leaf in model.leaves]
    parameters = list(dict.fromkeys(name for _, leaf in leaves for name in leaf.names))
    families = [" ".join(model.names) for model in models]
    data = rows_of([leaf for _, leaf in leaves], parameters)
    data["accepted"] = np.concatenate([model.accepted for model in models]).astype(np.int8)
    checks = np.array([result[f"model{k}_check"] for k, _ in leaves])
    data |= {name: checks[:, column] for column, name in enumerate(_CHECKS)}
    data["family"] = np.array([families[k] for k, _ in leaves])
    names = [
        f"{families[k]} {models[k].leaves.index(leaf) + 1}" if models[k].leaves[1:] else families[k]
        for k, leaf in leaves
    ]
    points = np.arange(data["training_output"].shape[1])
    coords = {"model": np.array(names), "point": points, "parameter": np.array(parameters)}
    every = {coordinate(one): one for one in run.study.variables}
    units = {n: (one.unit if one.ratio is None else "") or "1" for n, one in every.items()}
    about = None, units, run.scene.objective, run.words
    content = dataset.dataset("kriging", coords, data, *about)
    if leaves[0][1].label and "surrogate" in content:
        content.attrs["title"] = f"Surrogates of the objective, {leaves[0][1].label}"
    run.write(content)

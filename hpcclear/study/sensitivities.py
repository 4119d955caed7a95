"""Response surfaces, first-order sensitivities against clearance, and global indices."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.results import dataset
from hpcclear.results.content import Results
from hpcclear.scene.domain import box
from hpcclear.scene.points import snapped
from hpcclear.scene.study import Study
from hpcclear.statistics.sensitivity import intervals
from hpcclear.statistics.sensitivity.convergence import best_estimates, convergence_intervals
from hpcclear.statistics.sensitivity.intervals import IntervalDesign, IntervalSettings
from hpcclear.statistics.sensitivity.selection import select_influential
from hpcclear.statistics.sensitivity.sobol import analyse_sobol, noise_share, sobol_design
from hpcclear.statistics.surrogate import surface_search
from hpcclear.statistics.surrogate.metrics import Accuracy
from hpcclear.statistics.surrogate.response_surface import fit_response_surface
from hpcclear.statistics.surrogate.surface_search import SearchSettings, SurfaceSearch
from hpcclear.study.run import Result, StudyRun

STAGE = "sensitivity"
NEARBY = 1e-4
"""Parts of their ranges that variables are moved by to see chaos: no input makes a difference by so little, and perturbations
so large have grown within the transient."""

_NORMAL_95 = 1.959963984540054


class Sampled(NamedTuple):
    """A surface that was simulated: its inputs, its design, and the objective there, (n,)."""

    inputs: tuple[str, ...]
    design: IntervalDesign
    values: Array


def surfaces(study: Study) -> tuple[tuple[str, ...], ...]:
    """Inputs of each surface: the groups, and all of them together if they are more than one."""
    groups = study.groups
    together = {name for group in groups for name in group}
    everything = tuple(name for name in study.names if name in together)
    return groups if len(groups) < 2 else (*groups, everything)


def simulations(study: Study) -> int:
    """Simulations of `analyse`, unless a surface is refused."""
    if not study.groups:
        return 0
    each = sum(one.steps * (one.n_points + one.n_test) for one in _layouts(study))
    sobol = _sobol_rows(study) * (len(study.names) + 2) + _beside(study)
    return study.sensitivity.levels * each + sobol


def parameter(run: StudyRun) -> str:
    """The study variable that is held fixed for each surface."""
    name = run.study.sensitivity.parameter
    assert name is not None  # by validation, where there are surfaces
    return name


def analyse(run: StudyRun) -> Result:
    """Simulate all surfaces' points as one batch, then fit, differentiate and rank. Returns the data variables of
    sensitivity.nc, its coordinates but for names, and ``failed``."""
    designs = _designs(run)
    inputs = surfaces(run.study)
    each = zip(inputs, (design.points for design in designs), strict=True)
    batches = [_filled(run, names, points) for names, points in each]
    sobol = _sobol_points(run)
    if len(sobol):
        batches.append(run.simulations.designs(run.study.names, sobol).values)
    parts = _simulated(run, batches)
    made = [Sampled(*one) for one in zip(inputs, designs, parts[: len(designs)], strict=True)]
    result = _first_order(run, made)
    result |= _accepted(run, made)
    result |= _global(run, parts[-1] if len(sobol) else None)
    result["failed"] = np.asarray(sum(np.count_nonzero(np.isnan(part)) for part in parts))
    return result


def _filled(run: StudyRun, names: Sequence[str], points: Array) -> Array:
    """Designs in all study variables, from coordinates in these and, last, the variable that is held fixed."""
    return run.simulations.designs((*names, parameter(run)), points).values


def _simulated(run: StudyRun, batches: Sequence[Array]) -> list[Array]:
    """Objectives of designs in all study variables, (n, d) each, at once."""
    points = run.simulations.filled(run.study.names, np.concatenate(batches))
    values = run.simulations.objective(run.simulations.records(points, STAGE))
    return np.split(values, np.cumsum([len(batch) for batch in batches])[:-1])


def write(run: StudyRun, result: Result) -> None:
    """Write sensitivity.nc."""
    data = {k: v for k, v in result.items() if k not in ("interval", "clearance", "failed")}
    coords = {
        "surface": np.array([" ".join(names) for names in surfaces(run.study)]),
        "interval": result["interval"],
        "clearance": result["clearance"],
        "parameter": np.array(run.study.names),
    }
    content: Results = dataset.dataset("sensitivity", coords, data, objective=run.scene.objective)
    held = run.study.variable(parameter(run))
    content["clearance"].attrs.update(long_name=held.words, units=held.unit or "1")
    content.attrs["failed_simulations"] = int(result["failed"])
    content.attrs["inertias"] = "varied as the ratio to m L^2/12 where the study gives a ratio"
    run.write(content)


def _designs(run: StudyRun) -> list[IntervalDesign]:
    settings = run.study.sensitivity
    lower, upper = run.study.variable(parameter(run)).bounds
    clearances = np.linspace(lower, upper, settings.levels)
    found = []
    for names, laid_out in zip(surfaces(run.study), _layouts(run.study), strict=True):
        rng = run.rng("sensitivity", " ".join(names))
        bounds = box(run.scene, names).bounds
        found.append(intervals.design_intervals(bounds, clearances, rng, laid_out))
    return found


def _layouts(study: Study) -> list[IntervalSettings]:
    """How many points each surface gets."""
    settings, found = study.sensitivity, []
    for k, names in enumerate(surfaces(study)):
        together = k == len(study.groups)
        order = settings.together_order if together else settings.order
        points = settings.together_samples if together else settings.samples
        tests = max(settings.test_samples, 20) if together else settings.test_samples
        surface = points, tests, order, settings.chooses(len(names), order, points)
        found.append(IntervalSettings(settings.rounds, settings.shrink, *surface))
    return found


def _columns(run: StudyRun, names: Sequence[str]) -> list[int]:
    return [run.study.names.index(name) for name in names]


def _first_order(run: StudyRun, made: Sequence[Sampled]) -> Result:
    settings = run.study.sensitivity
    shape = (len(made), settings.rounds, settings.levels)
    every = (*shape, len(run.study.names))
    of_clearance = (every[0], *every[2:])
    result = {name: np.full(every, np.nan) for name in ("sensitivity", "standard_error")}
    result |= {name: np.full(shape, np.nan) for name in ("r2", "rmae", "leave_one_out_r2")}
    result["converged"] = np.zeros(of_clearance, np.int8)
    for name in ("convergence_interval", "plateau_interval", "best_sensitivity", "uncertainty"):
        result[name] = np.full(of_clearance, np.nan)
    fractions = (1.0 - settings.shrink) ** np.arange(settings.rounds)
    for k, (names, design, values) in enumerate(made):
        history = intervals.analyse_intervals(design, values)
        found = convergence_intervals(history)
        slope, uncertainty = best_estimates(history, found)
        at, span = _columns(run, names), np.ptp(box(run.scene, names).bounds, axis=1)
        result["sensitivity"][k][..., at] = history.sensitivity * span
        result["standard_error"][k][..., at] = history.standard_error * span
        for name in ("r2", "rmae", "leave_one_out_r2"):
            result[name][k] = getattr(history, name)
        result["converged"][k][:, at] = found.found
        reached = {"convergence_interval": found.interval, "plateau_interval": found.plateau}
        for name, index in reached.items():
            result[name][k][:, at] = np.where(index >= 0, fractions[index], np.nan)
        result["best_sensitivity"][k][:, at] = slope * span
        result["uncertainty"][k][:, at] = uncertainty * span
    result |= _ranked(run, [one.inputs for one in made], result) | _levels(made[-1])
    return result | {"interval": fractions, "clearance": made[0].design.clearances}


def _levels(last: Sampled) -> Result:
    """Mean objective over the box of the last surface at each clearance, and its standard error.

    The mean of a Latin hypercube has only the scatter that is left after all that is additive in
    the inputs (Stein 1987, doi:10.1080/00401706.1987.10488205); a linear fit takes most of it.
    """
    design, cut = last.design, last.design.settings.n_points
    points, values = (part[0, :, :cut] for part in design.by_surface(last.values))
    found = np.full((2, len(values)), np.nan)
    for level, (at, outcomes) in enumerate(zip(points, values, strict=True)):
        if np.isfinite(outcomes).sum() > at.shape[1] + 2:
            plane = fit_response_surface(at, outcomes, design.intervals[0], 1)
            error = np.sqrt(plane.residual_variance / plane.n_points)
            found[:, level] = np.nanmean(outcomes), error
    return {"mean_objective": found[0], "mean_objective_error": found[1]}


def _ranked(run: StudyRun, inputs: Sequence[Sequence[str]], result: Result) -> Result:
    """Ranking and X_G-I; each variable in each surface is a column of its own."""
    where = [(k, name) for k, names in enumerate(inputs) for name in names]
    names = [name for _, name in where]
    at = _columns(run, names)
    rows = [k for k, _ in where]
    every = (result[key][rows, :, at].T for key in ("best_sensitivity", "uncertainty"))
    slope, error = map(np.ascontiguousarray, every)
    fraction = run.study.sensitivity.influence
    chosen = select_influential(names, slope, error, fraction=fraction)
    influence = np.full(len(run.study.names), np.nan)
    for column, place in enumerate(at):
        known = chosen.effect[:, column]
        if np.isfinite(known).any():
            influence[place] = np.fmax(influence[place], np.nanmean(known))
    selected = np.array([name in chosen.selected for name in run.study.names], np.int8)
    return {"influence": influence, "selected": selected}


def _accepted(run: StudyRun, sampled: Sequence[Sampled]) -> Result:
    """The surface over each global interval; a refused one gets more points or another order."""
    shape = (len(sampled), run.study.sensitivity.levels)
    reasons = ("r2", "rmae", "r2_explained", "rmae_mean")
    result: Result = {f"surface_{name}": np.full(shape, np.nan) for name in reasons}
    result |= {name: np.zeros(shape, np.int64) for name in ("surface_order", "surface_points")}
    result["surface_accepted"] = np.zeros(shape, np.int8)
    made = {(k, c): _surface(run, sampled[k], c) for k, c in np.ndindex(*shape)}
    if run.study.sensitivity.resamplings > 0:
        refused = [place for place, one in made.items() if not one[-1]]
        for place, one in zip(refused, _searched(run, sampled, refused), strict=True):
            assert one.best is not None  # or the search would have been refused
            surface, tested = one.best
            counts = surface.order, surface.n_points, len(surface.coefficients)
            made[place] = tested, *counts, one.accepted
    if any(one.design.settings.chosen for one in sampled):
        result["surface_terms"] = np.zeros(shape, np.int64)
    for (k, c), (reached, order, count, terms, accepted) in made.items():
        for name in reasons if reached is not None else ():
            result[f"surface_{name}"][k, c] = getattr(reached, name)
        result["surface_order"][k, c], result["surface_points"][k, c] = order, count
        result["surface_accepted"][k, c] = accepted
        if "surface_terms" in result:
            result["surface_terms"][k, c] = terms
    return result


def _surface(
    run: StudyRun, sampled: Sampled, level: int
) -> tuple[Accuracy | None, int, int, int, bool]:
    """Accuracy, order, points and terms of a surface at a level, and whether it was accepted."""
    settings, laid_out = run.study.sensitivity, sampled.design.settings
    points, values = (part[0, level] for part in sampled.design.by_surface(sampled.values))
    surface, reached = sampled.design.fitted(0, points, values)
    count = int(np.isfinite(values[: laid_out.n_points]).sum())
    if surface is None or reached is None:
        return None, laid_out.order, count, 0, False
    accepted = reached.meets(settings.r2, settings.rmae)
    return reached, laid_out.order, count, len(surface.coefficients), accepted


def _searched(
    run: StudyRun, sampled: Sequence[Sampled], places: Sequence[tuple[int, int]]
) -> list[SurfaceSearch]:
    """More points or another order for the surfaces at these places, (surface, level), all in the same batches."""
    settings = run.study.sensitivity
    searches = []
    for k, level in places:
        design = sampled[k].design
        laid_out = design.settings
        count, order = laid_out.n_points, laid_out.order
        most, tests = count * 2**settings.resamplings, max(laid_out.n_test, 20)
        tried = SearchSettings(
            orders=(order, order + 1, max(order - 1, 1)), n_points=2 * count, n_test=tests, max_points=most,
            r2_min=settings.r2, rmae_max=settings.rmae, chosen=laid_out.chosen,
        )  # fmt: skip
        rng = run.rng("surface", " ".join(sampled[k].inputs), str(level))
        searches.append(SurfaceSearch(design.intervals[0], rng, tried))

    def evaluate(asked: Mapping[int, Array]) -> dict[int, Array]:
        batches = []
        for number, at in asked.items():
            k, level = places[number]
            inputs, design, _ = sampled[k]
            where = np.column_stack([at, np.full(len(at), design.clearances[level])])
            batches.append(_filled(run, inputs, where))
        return dict(zip(asked, _simulated(run, batches), strict=True))

    surface_search.fit_until_accepted(evaluate, searches)
    return searches


def _sobol_points(run: StudyRun) -> Array:
    rows = _sobol_rows(run.study)
    if rows == 0:
        return np.empty((0, len(run.study.names)))
    names = run.study.names
    bounds = box(run.scene, names).bounds
    points = snapped(run.study, names, sobol_design(bounds, rows, run.rng("sobol")))
    near = points[: _beside(run.study)]
    moved = run.rng("sobol noise").uniform(-1.0, 1.0, near.shape)
    steps = NEARBY * (bounds[:, 1] - bounds[:, 0]) * moved
    near = snapped(run.study, names, np.clip(near + steps, *bounds.T))
    return np.concatenate([points, near])


def _beside(study: Study) -> int:
    """How many of the first points are simulated again right beside, for the share of chaos. Of 16 its error was too small:
    inputs that do nothing were 0 within their error in 91 % (`analysis/noise_floor.py`), of 32 in 95 %."""
    return max(_sobol_rows(study) // 4, min(_sobol_rows(study), 32))


def _sobol_rows(study: Study) -> int:
    """Rows of each of the two samples; none where fewer than two were requested."""
    rows = study.sensitivity.sobol_samples
    return rows if rows >= 2 else 0


def _global(run: StudyRun, values: Array | None) -> Result:
    """Sobol indices over the whole box, the clearance among the inputs."""
    count = len(run.study.names)
    if values is None:
        nothing = np.full(count, np.nan)
        names = ("sobol_first", "sobol_total", "sobol_first_error", "sobol_total_error")
        unknown = {"sobol_noise": np.array(np.nan), "sobol_noise_error": np.array(np.nan)}
        return dict.fromkeys(names, nothing) | unknown
    beside = _beside(run.study)
    values, near = values[:-beside], values[-beside:]
    found = analyse_sobol(values, count)
    noise, error = noise_share(values[:beside], near, found.variance)
    total_error = np.ptp(found.total_interval, axis=1) / (2 * _NORMAL_95)
    return {
        "sobol_first": found.first,
        "sobol_total": found.total - np.nan_to_num(noise),
        "sobol_first_error": np.ptp(found.first_interval, axis=1) / (2 * _NORMAL_95),
        "sobol_total_error": np.hypot(total_error, np.nan_to_num(error)),
        "sobol_noise": np.array(noise),
        "sobol_noise_error": np.array(error),
    }

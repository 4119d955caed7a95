"""The `accuracy` command: every panel measured, written, drawn and printed."""

import shlex
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from hpcclear.accuracy import averaging, integration, parallel, random_inputs, surrogate
from hpcclear.accuracy.methods import QUANTITIES
from hpcclear.accuracy.profile import Profile
from hpcclear.accuracy.standin import with_case
from hpcclear.base.errors import InputError
from hpcclear.ranks.team import Ranks
from hpcclear.results import dataset, files
from hpcclear.scene import Scene


def measure(
    scene: Scene, ranks: Ranks, profile: Profile, tell: Callable[[str], object] = lambda text: None
) -> xr.Dataset:
    """Measure what accuracy costs for a scene; on root.

    Parameters
    ----------
    scene : Scene
        With a clearance joint at least.
    ranks : Ranks
    profile : Profile
    tell : callable
        Gets what is going on, a line at a time.

    Returns
    -------
    xarray.Dataset
        Kind ``accuracy``.

    Raises
    ------
    InputError
        If both joints are ideal: the objective is 0 then, whatever the settings.
    """
    if not scene.clearance_joints():
        raise InputError(
            "joints", "ideal", "the objective is 0 without clearance", "Give a joint clearance"
        )
    studied, case, where = with_case(scene)
    tell("compilation")
    surrogate.simulated_middle(studied, case, ranks)  # first of all, so that its time is seen
    parts: list[tuple[Mapping[str, Any], Mapping[str, Any]]] = []
    with ranks.stage("integration"):
        parts.append(_integration(integration.measure(scene, profile, _checked(tell, ranks))))
    tell("averaging")
    with ranks.stage("averaging"):
        parts.append(_averaging(averaging.measure(scene, profile)))
    tell("surrogates")
    fitted = surrogate.measure(studied, case, profile, ranks)
    parts.append(_surrogates(fitted))
    tell("random inputs")
    parts.append(_random(random_inputs.measure(studied, case, fitted.model, profile, ranks)))
    tell("ranks")
    scaling = parallel.measure(studied, case, fitted.sample_seconds, profile, ranks)
    parts.append(_parallel(scaling))
    coords: dict[str, Any] = {}
    data: dict[str, Any] = {}
    for some_coords, some_data in parts:
        coords.update(some_coords)
        data.update(some_data)
    attributes = {
        **dataset.provenance(scene.text or scene.to_toml(), scene.hash, scene.references),
        "profile": profile.name,
        "command": shlex.join(sys.argv),
        "designs": f"integration: {profile.designs} designs near the scene, one revolution from the start",
        "repeats": f"medians of {profile.repeats} runs ({profile.outside_repeats} for scipy's solvers)",
        "copies": f"averaging: {profile.copies} copies over {profile.revolutions} revolutions",
        "study": where,
        "batch": f"ranks: {scaling.samples} samples, or as many a rank",
        "mpi_ranks": ranks.size,
    }
    return dataset.dataset("accuracy", coords, data, attributes)


def _checked(tell: Callable[[str], object], ranks: Ranks) -> Callable[[str], object]:
    """Say it, after looking whether the run shall stop."""

    def say(text: str) -> None:
        ranks.raise_if_stopped()
        tell(text)

    return say


def _integration(found: integration.Integration) -> tuple[dict[str, Any], dict[str, Any]]:
    coords = {
        "integrator": np.array(found.methods),
        "rung": np.arange(found.setting.shape[1]),
        "quantity": np.array(QUANTITIES),
    }
    names = ("setting", "error", "seconds", "evaluations", "order", "reference_error")
    return coords, {name: getattr(found, name) for name in names}


def _averaging(found: averaging.Averaging) -> tuple[dict[str, Any], dict[str, Any]]:
    data = {
        "averaging_error": found.error,
        "averaging_floor": found.floor,
        "turn_seconds": found.seconds,
    }
    return {"transient": found.transient, "averaged": found.averaged}, data


def _surrogates(found: surrogate.Surrogates) -> tuple[dict[str, Any], dict[str, Any]]:
    coords = {"surrogate": np.array(surrogate.SURROGATES), "training": found.training}
    names = ("r2", "rmae", "leave_one_out", "fit_seconds", "sample_seconds")
    return coords, {name: getattr(found, name) for name in names}


def _random(found: random_inputs.RandomInputs) -> tuple[dict[str, Any], dict[str, Any]]:
    coords = {
        "estimate": np.array(random_inputs.ESTIMATES),
        "moment": np.array(random_inputs.MOMENTS),
        "draws": found.draws,
    }
    data = {
        "moment_error": found.error,
        "moment_lower": found.lower,
        "moment_upper": found.upper,
        "moment_seconds": found.seconds,
        "moment_bias": found.bias,
        "bias_error": found.bias_error,
        "closed_form": found.closed_form,
        "quadrature_seconds": found.quadrature_seconds,
    }
    return coords, data


def _parallel(found: parallel.Parallel) -> tuple[dict[str, Any], dict[str, Any]]:
    coords = {"ranks": found.ranks, "loss": np.array(parallel.LOSSES)}
    data = {"strong_seconds": found.strong, "weak_seconds": found.weak, "lost_seconds": found.lost}
    return coords, data


def run_accuracy(
    scene: Scene, directory: Path, ranks: Ranks, profile: Profile, tell: Callable[[str], object]
) -> tuple[xr.Dataset, dict[str, Path]]:
    """Measure, write ``accuracy.nc`` and the figures; the dataset and the files by what they show.

    `tell` gets what is going on, a line at a time.

    Raises
    ------
    InputError, StorageError, Stopped, RankFailed
    """
    from hpcclear.report.figures import accuracy as accuracy_figures
    from hpcclear.report.figures import style

    style.matplotlib()  # said before the measuring, not after
    place = directory / "accuracy.nc"
    try:
        directory.mkdir(exist_ok=True)
    except OSError as error:
        raise files.refused(directory, error) from error
    files.probe(place)

    found = measure(scene, ranks, profile, tell)
    dataset.write(found, place)
    written = {"accuracy": place}
    for name, draw in accuracy_figures.FIGURES.items():
        written[name] = style.save(draw(found), directory / f"{name}.png")
    return found, written

"""The `reproduce` command: whether what result files hold is what their scenes come to here, bit by bit."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.base.objectives import MEAN_GAP
from hpcclear.dynamics.evaluation import evaluate_records
from hpcclear.dynamics.response import simulated
from hpcclear.ensemble.api import as_points, evaluated
from hpcclear.ensemble.session import samples_of
from hpcclear.report.figures import labels
from hpcclear.results import dataset
from hpcclear.results.content import Results
from hpcclear.results.grids import SHAPE
from hpcclear.results.provenance import program
from hpcclear.scene import Scene
from hpcclear.scene.loading import scene_of_text

REPEATED = ("samples", "response")
"""Kinds of files of which something is simulated again; all others follow from these, or take as long again."""


@dataclass(frozen=True)
class Repeated:
    """What came of one file."""

    file: str
    extent: str
    """How much of it was simulated again, or why nothing was."""
    differing: tuple[str, ...] = ()
    """Variables that are other ones here, with the largest relative difference."""
    changed: tuple[str, ...] = ()
    """Versions and processor of the file that are not those here."""
    unread: bool = False
    """Whether the file is damaged, or its scene cannot be read."""


def repeated(place: Path, count: int) -> Iterator[Repeated]:
    """Simulate some of what a result file, or those of a directory, hold again, at most `count` samples spread over each, and
    compare.

    Yields the outcome of each file that was read, in order; of a damaged one in a directory, too.
    Raises InputError: there is no result file; or `place` is a file that is damaged, or was made from no valid scene.
    """
    every = place.is_dir()
    for path, content in dataset.each_in(place) if every else [(place, dataset.read(place))]:
        name = str(path.relative_to(place) if every else path)
        try:
            if isinstance(content, InputError):
                raise content
            if (kind := str(content.attrs["hpcclear_kind"])) in REPEATED:
                yield _compared(name, content, kind, count)
        except InputError as error:
            if not every:
                raise
            yield Repeated(name, f"not simulated: {error.reason}", unread=True)


def _compared(name: str, content: Results, kind: str, count: int) -> Repeated:
    scene = scene_of_text(str(content.attrs.get("scene", "")), name)
    changed = tuple(_changed(content, scene))
    if content.attrs.get("scene_hash") != scene.hash:
        why = "not simulated: its scene reads otherwise in this version"
        return Repeated(name, why, (), changed)
    if kind == "response":
        extent, (ours, theirs) = "its series", _series(content, scene)
    else:
        chosen = np.unique(np.linspace(0, content.sizes["sample"] - 1, count).round().astype(int))
        theirs = content.isel(sample=chosen)
        extent = f"{len(chosen)} of {content.sizes['sample']} samples"
        ours = _samples(theirs, scene)
    return Repeated(name, extent, tuple(_differing(ours, theirs)), changed)


def _samples(content: Results, scene: Scene) -> Results:
    """The same designs, simulated here."""
    rows = labels.design_variables(content)
    values = {str(one.attrs.get("scene_path", one.name)): one.values for one in rows}
    names = tuple(one.name for one in rows)
    named = tuple(content["label"].values) if "label" in content else ()
    points = replace(as_points(scene, values), names=names, labels=named)
    if SHAPE not in content.attrs:
        return evaluated(scene, points)
    return samples_of(scene, points, evaluate_records(scene, points, mapped=True), {}, MEAN_GAP)


def _series(content: Results, scene: Scene) -> tuple[Results, Results]:
    """Series over time here and there; a study keeps those after the transient."""
    ours = simulated(scene, checked=False, spectra=False)
    kept = {name: one for name, one in content.data_vars.items() if "time" in one.dims}
    return ours.isel(time=slice(ours.sizes["time"] - content.sizes["time"], None)), Results(kept)


def _differing(ours: Results, theirs: Results) -> Iterator[str]:
    """Variables that are not the same to the last bit, and how far off."""
    for name, there in theirs.data_vars.items():
        if name not in ours:
            yield f"{name} (not here)"
            continue
        here, was = ours[name].values, there.values
        if here.shape != was.shape:
            yield f"{name} (another length)"
        elif not np.array_equal(here, was, equal_nan=was.dtype.kind == "f"):
            first, second = here.astype(float), was.astype(float)
            off = np.nanmax(np.abs(first - second), initial=0.0)
            far = f"{off / max(np.nanmax(np.abs(second), initial=0.0), 1e-300):.1e}"
            yield f"{name} ({far if off > 0.0 else 'known in one only'})"


def _changed(content: Results, scene: Scene) -> Iterator[str]:
    """What the file says of programs and processor, where that is not what is here."""
    now = program()
    for name in ("hpcclear_version", "processor"):
        if content.attrs.get(name) != now[name]:
            yield f"{name}: {content.attrs.get(name)}, here {now[name]}"
    here = dict(one.rsplit(" ", 1) for one in now["versions"].split(", "))
    for one in str(content.attrs.get("versions", "")).split(", "):
        package, _, version = one.rpartition(" ")
        if package and here.get(package) != version:
            yield f"{package}: {version}, here {here.get(package, 'not installed')}"

"""The `sample` command: points -> ranks -> one dataset, checkpointed on the way."""

import time
from pathlib import Path

import xarray as xr

from hpcclear.base.errors import InputError
from hpcclear.dynamics.evaluation.steady.wording import recorded
from hpcclear.ensemble.identity import sample_key
from hpcclear.ensemble.session import DEFAULT_OPTIONS, Finished, Options, Place, Session, samples_of
from hpcclear.ensemble.simulate import sample_points, saving
from hpcclear.ensemble.split import Part
from hpcclear.ranks.progress import Progress
from hpcclear.ranks.team import Ranks
from hpcclear.scene import Scene
from hpcclear.scene.points import Points
from hpcclear.scene.sampling import read_points, sampled

MEMORY = 2.3e-6
"""GB that root takes for a sample (`analysis/many_ranks.py`)."""

NOTABLE = 1.0
"""Memory (GB) above which a warning is printed."""


def design(scene: Scene, table: Path | None) -> Points:
    """The points to simulate: a user's table, or the study's sampling.

    Raises
    ------
    InputError
        If there is neither, or a point makes no mechanism.
    """
    if table is not None:
        return read_points(table, scene)
    if scene.study is None:
        raise InputError(
            "study",
            None,
            "the scene has no [study] table",
            "Add a [study] table, or give --points designs.csv",
        )
    return sampled(scene)


def run_sample(
    scene: Scene,
    output: Path,
    ranks: Ranks,
    *,
    table: Path | None = None,
    part: Part | None = None,
    options: Options = DEFAULT_OPTIONS,
) -> Finished:
    """Simulate a design on all ranks and write it; on root.

    Parameters
    ----------
    output : Path
        NetCDF file; NAME.timing.nc goes beside it, finished samples into a hidden directory until it is written.
    table : Path, optional
        CSV of designs.
    part : Part, optional
        Only these samples, into a file of their own beside `output`.

    Returns
    -------
    Finished
        The samples.

    Raises
    ------
    InputError, StorageError, Stopped, RankFailed
    """
    began = time.perf_counter()
    points = design(scene, table)
    if part is None:
        rows, key = range(len(points)), sample_key(scene, points)
        place = Place.of_file(output, options.fresh)
    else:
        rows, key = part.rows(len(points)), part.key(scene, points)
        place = Place.of_file(part.place(output), False)
    with Session(place, key, ranks, options) as session:
        samples = session.found("samples")
        if samples is None:
            samples = _simulate(
                scene, points.take(slice(rows.start, rows.stop)), session, rows.start
            )
        session.close()
    return session.finished(samples, began)


def _simulate(scene: Scene, points: Points, session: Session, first: int) -> xr.Dataset:
    """Simulate what is not finished yet, and write the dataset; the samples are numbered from `first`."""
    units = dict(zip(points.names, points.units, strict=True))
    session.describe(scene)
    if len(points) * MEMORY >= NOTABLE:
        session.notify(
            f"root keeps all {len(points)} samples in memory, {len(points) * MEMORY:.1f} GB at the end; "
            "Monte Carlo samples it can write as they come: --statistics --raw DIR"
        )
    checkpoint = session.opened(points.names, units)
    progress = Progress("samples", session.options.style)
    records = sample_points(scene, points, session.ranks, checkpoint, progress, first=first)
    records["sample"] += first
    attributes = session.attributes | recorded(scene, records)
    with saving(checkpoint.flush):  # what came since the last save, if the file cannot be written
        return session.write(
            samples_of(points, records, attributes, scene.objective, session.joints)
        )

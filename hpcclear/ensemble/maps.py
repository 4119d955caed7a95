"""The `map` command: one or two entries of a scene over a grid, and at each point what the motion does."""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hpcclear.base.errors import InputError, at
from hpcclear.base.objectives import MEAN_GAP
from hpcclear.base.units import note, to_si
from hpcclear.ensemble.api import paths_of
from hpcclear.ensemble.identity import sample_key
from hpcclear.ensemble.session import Finished, Options, Session, sample_points, samples_of, saving
from hpcclear.ensemble.simulate import Payload, first_compiled
from hpcclear.ranks.progress import Progress
from hpcclear.ranks.schedule import Worker
from hpcclear.ranks.team import Ranks
from hpcclear.results.content import Results
from hpcclear.results.grids import SHAPE
from hpcclear.results.places import Place
from hpcclear.scene import Scene
from hpcclear.scene.fields import Quantity
from hpcclear.scene.points import Points, check_apart, check_points


def axis(scene: Scene, words: str, option: str = "--x") -> tuple[str, tuple[str, ...], np.ndarray]:
    """Name, scene entries and values (n,) of ``PATH=LO:HI:N``; bounds in SI or with a unit.

    Raises InputError at the option if the words do not say that.
    """
    found = re.fullmatch(r"([^=]+)=([^:]+):([^:]+):\s*(0*[1-9]\d{0,3})\s*", words)
    if found is None:
        example = 'For example C=0.1mm:1mm:40, or drive.speed="500 rpm:6000 rpm:60"'
        raise InputError(option, words, "is not PATH=LO:HI:N with N up to 9999", example)
    name, *ends, count = map(str.strip, found.groups())
    paths = paths_of(scene, name)
    bounds = range_of(option, words, ends, scene.unit(paths[0]))
    return name, paths, np.linspace(*bounds, int(count))


def range_of(
    key: str, words: str, ends: Sequence[str], unit: str, least: float | None = None
) -> tuple[float, float]:
    """Two bounds in rising order, each in SI or with a unit; raises InputError at `key`, which has `words`."""
    with at(key, words):
        return Quantity(unit, least=least).range([_number(end, unit) for end in ends], "")


def _number(words: str, unit: str) -> float:
    """A limit: a plain number in SI, or one with a unit."""
    try:
        value = float(words)
    except ValueError:
        return to_si(words.strip().strip('"'), unit)
    if unit == "rad/s":  # a slip for rpm is a factor of ten
        turns = f"{value * 30.0 / np.pi:.5g} rpm; if rpm are meant, write {value:g} rpm"
        note(words, f"{value:g} rad/s, {turns}")
    return value


def number_of(
    key: str, words: str, unit: str, above: float | None = None, least: float | None = None
) -> float:
    """A plain number in SI, or one with a unit; raises InputError at `key` where it is neither, or beyond a bound."""
    with at(key, words):
        return Quantity(unit, above, least=least).convert(_number(words, unit))


def cells(scene: Scene, axes: tuple[str, ...]) -> tuple[Points, tuple[int, ...]]:
    """All cells of a grid, the first entry's values changing slowest, and how many there are along each.

    Raises InputError if an axis is not one, two are the same, or a cell makes no mechanism.
    """
    parsed = (axis(scene, *one) for one in zip(axes, ("--x", "--y"), strict=False))
    names, paths, along = zip(*parsed, strict=True)
    check_apart("--y", "axes", axes, paths)
    grid = np.meshgrid(*along, indexing="ij")
    points = Points(names, np.column_stack([one.ravel() for one in grid]), paths)
    check_points(scene, points)
    if not scene.clearance_joints():
        remedy = 'Set a joint\'s kind = "clearance"'
        raise InputError("joints", None, "there is no joint with clearance", remedy)
    return points, grid[0].shape


def make_mapper(payload: Payload, ranks: Ranks) -> Worker:
    """A rank's worker."""
    from hpcclear.dynamics.evaluation import evaluator_of

    worker = evaluator_of(payload.scene, payload.columns, payload.lanes, mapped=True)
    return first_compiled(worker, ranks)


def run_map(
    scene: Scene, axes: tuple[str, ...], output: Path, ranks: Ranks, options: Options = Options()
) -> Finished:  # fmt: skip
    """Judge every cell of a grid of one or two axes (``PATH=LO:HI:N``) on all ranks and write it, a sample a cell; on root.

    `hpcclear.results.grids.grid` gives the file back as a grid. Raises InputError, StorageError, Stopped, RankFailed.
    """
    place = Place.of_file(output, options.fresh)
    points, shape = cells(scene, axes)
    key = {**sample_key(scene, points), "command": "map"}

    def make(session: Session) -> Results:
        checkpoint = session.opened(scene, points.units, mapped=True)
        where, kind = (ranks, checkpoint, Progress("cells", options.style)), session.record
        records = sample_points(scene, points, *where, stage="map", maker=make_mapper, record=kind)
        attributes = {**session.attributes, SHAPE: " ".join(map(str, shape))}
        with saving(checkpoint.flush):
            return session.write(samples_of(scene, points, records, attributes, MEAN_GAP))

    return Session(place, key, ranks, options).finished(make)

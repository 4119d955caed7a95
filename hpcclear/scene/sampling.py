"""Random inputs drawn: Monte Carlo samples, scrambled Sobol sequences.

Every number follows from the study's seed, a purpose ("train", "test", ...) and, for Monte Carlo,
the index of the sample, so that nothing depends on how many points are drawn at a time, or by whom.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import lru_cache

import numpy as np

from hpcclear.base.arrays import Array, Integers
from hpcclear.base.errors import InputError
from hpcclear.base.quantiles import Empirical
from hpcclear.scene.domain import slender_inertias
from hpcclear.scene.points import Points, check_points, count_of
from hpcclear.scene.random_inputs import RandomInput
from hpcclear.scene.scene import Scene
from hpcclear.scene.streams import generator, sobol, uniform, unit_lhs as unit_lhs
from hpcclear.scene.study import Study


def _chances(
    seed: int, purpose: str, names: Sequence[str], span: tuple[int, int], replicates: Sequence[int] | None, stratified: bool
) -> list[Array]:  # fmt: skip
    """Independent probabilities of each name, `span`: from which index on and how many; as `monte_carlo` has them."""
    first, count = span
    if stratified:
        if first:
            raise InputError("first", first, "a Latin hypercube cannot be divided", "Begin at 0")
        rng = generator(seed, f"stratified {purpose}")
        return list(np.maximum(unit_lhs(count, len(names), rng), 2.0**-54).T)
    if replicates is None:
        return [uniform(seed, f"monte-carlo {purpose}", name, first, count) for name in names]
    sequences = [(seed, purpose, one, len(names)) for one in replicates]
    if first + count <= _BEGINNING:
        parts = [_scrambled(*one, 0, _BEGINNING)[first : first + count] for one in sequences]
    else:
        parts = [_scrambled(*one, *span) for one in sequences]
    return list(np.concatenate(parts).T)


_BEGINNING = 128  # points of a sequence that are kept together


@lru_cache(maxsize=128)
def _scrambled(seed: int, purpose: str, replicate: int, size: int, first: int, count: int) -> Array:
    """Points of a randomised sequence, (count, size), read only: all designs of a study meet the same."""
    points = sobol(size, generator(seed, f"sobol {purpose}", str(replicate)), first, count)
    points.flags.writeable = False
    return points


def monte_carlo(
    scene: Scene,
    samples: int | None = None,
    *,
    random: Sequence[str] | None = None,
    design: Mapping[str, float] | None = None,
    purpose: str = "train",
    first: int = 0,
    replicate: int | Sequence[int] | None = None,
    stratified: bool = False,
) -> Points:
    """Samples `first` to `first + samples` of the study's random inputs (all of them, or those in `random`), SI.

    Sample k is the same however many are drawn, and each input has a stream of its own, so that a
    further random input leaves the others as they were; another `purpose` has other streams.

    Columns that are not random hold the `design`, and inputs that follow it scatter about it. Without one, variables without a
    distribution are uniform over their range, and inputs scatter about the scene.

    With a `replicate`, samples of the randomised Sobol sequence of this number replace independent ones; each sequence is one
    independent estimate: begin and end at powers of two. Of several, as many samples of each, one sequence after the other.
    `stratified`: a Latin hypercube of probabilities in their place; all of it, so from index 0 on. Of inputs that vary together
    the first alone keeps its strata. Raises InputError as `hpcclear.scene.points.latin_hypercube`.
    """
    study = scene.required_study
    count = count_of(study, samples, first)
    inputs = {row.name: row for row in study.random}
    chosen = _known("random", inputs if random is None else random, inputs)
    named = _known("design", design or (), study.names)
    fixed = None if design is None else {name: design[name] for name in named}
    free = tuple(name for name in study.names if fixed is None or name in fixed)
    names = (*free, *(name for name in chosen if name not in free))
    paths = tuple(inputs[n].paths if n in chosen else study.variable(n).paths for n in names)
    moving = [name for name in names if name in chosen or fixed is None]
    replicates = [replicate] if isinstance(replicate, int) else replicate
    uniform = _chances(study.seed, purpose, moving, (first, count), replicates, stratified)
    each, count = count, count * len(replicates or [0])
    if study.correlation is not None:  # of the random inputs
        rows = [k for k, name in enumerate(moving) if name in chosen]
        own = [moving[k] for k in rows], [uniform[k] for k in rows]
        for k, one in zip(rows, study.correlation.together(*own), strict=True):
            uniform[k] = one
    places = dict(zip(moving, uniform, strict=True))
    values = np.empty((count, len(names)))
    for column, name in enumerate(names):
        if name not in chosen:
            values[:, column] = _free(study, name, places[name]) if fixed is None else fixed[name]
    for name in chosen:
        column = names.index(name)
        centre = (fixed or {}).get(name, scene.number(paths[column][0]))
        if fixed is not None or not study.moves(inputs[name]):
            found = study.law(inputs[name], {**(fixed or {}), name: centre})(places[name])
        else:
            found = _by_designs(study, inputs[name], names, values, places[name], centre)
        values[:, column] = found if inputs[name].absolute else centre + found
    if fixed is None:
        for column, name in enumerate(names):
            if name not in chosen and study.variable(name).ratio is not None:
                values[:, column] *= slender_inertias(scene, paths, values, paths[column][0])
    points = Points(names, values, paths)
    check_points(scene, points, lambda row: f"sample {first + row % each}")
    return points


def _free(study: Study, name: str, place: Array) -> Array:
    """A variable without a distribution, uniform over its range, at probabilities (n,)."""
    variable = study.variable(name)
    if variable.options is not None:
        return Empirical(variable.options)(place)
    lower, upper = variable.bounds
    return lower + place * (upper - lower)


def _by_designs(
    study: Study, row: RandomInput, names: Sequence[str], values: Array, place: Array, centre: float
) -> Array:
    """A random input at probabilities (n,) where every row of `values` (n, d) is a design of its own."""
    drivers = [name for name in study.drivers(row) if name in names]
    columns = [names.index(name) for name in drivers]
    keys, which = np.unique(values[:, columns], axis=0, return_inverse=True)
    found = np.empty(len(values))
    for k, key in enumerate(keys):
        design = dict(zip(drivers, key.tolist(), strict=True)) | {row.name: centre}
        here = which.ravel() == k
        found[here] = study.law(row, design)(place[here])
    return found


def offsets(
    scene: Scene, random: Sequence[str], chances: Sequence[Array], design: Mapping[str, float] | None = None
) -> dict[str, Array]:  # fmt: skip
    """Random inputs at independent probabilities, (n,) each, which are made to vary together as the study says: values of
    those that are absolute, else differences from the design (SI, by name), which counts where distributions depend on it."""
    study = scene.required_study
    if study.correlation is not None:
        chances = study.correlation.together(random, chances)
    laws = (study.law(study.random_input(name), design or {}) for name in random)
    return {name: law(one) for name, law, one in zip(random, laws, chances, strict=True)}


def _known(what: str, names: Iterable[str], known: Collection[str]) -> tuple[str, ...]:
    chosen = tuple(names)
    for name in chosen:
        if name not in known:
            raise InputError(what, name, "is not one of the study's", f"Use {', '.join(known)}")
    return chosen


_PAGE = 4096  # points made at a time
_PAGES = 8  # pages kept, since neighbouring ranks ask for neighbouring points


class MonteCarloPoints:
    """The study's Monte Carlo points by index, `total` of them, generated on request and not stored."""

    def __init__(self, scene: Scene, total: int) -> None:
        self._scene, self._total = scene, total
        self.page = lru_cache(_PAGES)(self._page)

    def __len__(self) -> int:
        return self._total

    def _page(self, number: int) -> Points:
        """Points `number` * 4096 and on, at most 4096 of them."""
        first = number * _PAGE
        return monte_carlo(self._scene, min(_PAGE, self._total - first), first=first)

    def __getitem__(self, index: Integers) -> Array:
        index = np.asarray(index, np.int64)
        values = np.empty((index.size, len(self.page(0).names)))
        numbers = index // _PAGE
        for number in np.unique(numbers).tolist():
            here = numbers == number
            values[here] = self.page(number).values[index[here] - number * _PAGE]
        return values

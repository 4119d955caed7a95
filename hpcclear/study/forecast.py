"""What a study simulates as a rule, and what a simulation of it costs: it is rehearsed on surrogates of a few simulations.

`hpcclear.study.stages.samples_of` has the most that there can be. How much search and verification take less than that depends
on f, so both are carried out as they are, on what surrogates of a pilot's simulations say in place of simulations. What these
surrogates do not explain is in it as waves that are too short for any model.
"""

import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import cast

import numpy as np

from hpcclear.base.arrays import Array, Records
from hpcclear.base.errors import InputError
from hpcclear.base.outcome import Status
from hpcclear.base.threads import one_thread
from hpcclear.ranks.boundary import alone
from hpcclear.results.checkpoint import Checkpoint
from hpcclear.scene import Scene
from hpcclear.scene.domain import box, to_coordinates
from hpcclear.scene.points import Points, snapped
from hpcclear.scene.sampling import unit_lhs
from hpcclear.scene.stages import REPLICATES
from hpcclear.statistics.surrogate.piecewise import Piecewise
from hpcclear.study import optimisation, rare, search, stages, surrogates, truth
from hpcclear.study.run import StudyRun
from hpcclear.study.simulations import Simulations, loads_of

LONGEST = 10.0
"""Seconds that pilots may take."""

LEAST = 5
"""Simulations per input that a pilot needs."""

REHEARSALS = 3
"""Rehearsals, each of a pilot and a seed of its own, as far as pilots stay within `LONGEST`: one alone scatters as
much as a study does."""

DESIGNS, LENGTH = 4, 8
"""Designs, and points of each of their replicates, that show how much scatter a surrogate leaves."""

WAVES, SHORT = 128, 0.02
"""Waves that stand for what a surrogate does not explain, and their length scale, over the range of each input."""

OFTEN = "in nine of ten studies 0.6 to 1.7 times that"
"""How far studies are from what is expected: set on 40 random ones, and so on 40 others (`analysis/fresh_studies.py`)."""

Evaluate = Callable[[Points], Records]


class _Pilot(Simulations):
    """Simulations by a function, without files; what they took is measured."""

    def __init__(self, scene: Scene, evaluate: Evaluate) -> None:
        super().__init__(scene, alone(), cast(Checkpoint, None))
        self._evaluate = evaluate
        self.count, self.seconds = 0, 0.0

    def _records(self, points: Points, stage: str) -> Records:
        """Outcome records of designs, in their order."""
        if not self.count:
            self._evaluate(points.take(np.arange(1)))  # compiles
        start = time.perf_counter()
        found = self._evaluate(points)
        self.seconds += time.perf_counter() - start
        self.count += len(points)
        return found


class _Rehearsal(Simulations):
    """Surrogates of a pilot in place of simulations, which are counted by stage."""

    def __init__(self, run: StudyRun, count: int, designs: int) -> None:
        super().__init__(run.scene, alone(), cast(Checkpoint, None), "quiet")
        names, region = run.study.models[-1], surrogates.domain(run, run.study.models[-1])
        rng, self._names = run.rng("pilot"), names
        places = region.at(unit_lhs(count, len(names), rng))
        points = run.simulations.designs(names, snapped(run.study, names, places, model=True))
        records, responses = run.simulations.judged(points, "pilot")
        self._made, self._like = (points.values, responses), records[:1]
        self._like["status"] = Status.OK
        method = surrogates.method_of(run.scene)
        labels = [surrogates.coordinate(run.study.variable(name)) for name in names]
        fit = partial(method.fit, bounds=region.bounds, rng=rng, names=labels)
        self._models = [fit(places, one) for one in responses]
        self._sizes = self._unexplained(run, designs)
        self._waves = rng.standard_normal((len(names), WAVES)) / SHORT
        self._phases = rng.uniform(0.0, 2.0 * np.pi, WAVES)
        self.counts = Counter[str]()

    @property
    def model(self) -> Piecewise:
        """The surrogate of f."""
        return Piecewise((self._models[0],), np.zeros(1, bool))

    def _places(self, points: Points) -> Array:
        """Inputs of the surrogates, within their bounds."""
        leaf, names = self._models[0], [points.names.index(name) for name in self._names]
        places = to_coordinates(self.scene, self._names, points.values[:, names])
        return np.clip(places, leaf.lower, leaf.upper)

    def _unexplained(self, run: StudyRun, count: int) -> Array:
        """Standard deviation of what surrogates leave of each response: of it replicates of so many designs scatter."""
        case, squares = run.study.cases[0].name, []
        region = box(run.scene, run.study.design_variables(case))
        places = region.at(unit_lhs(count, len(region.lower), run.rng("pilot", case)))
        for choice in optimisation.choices(run, case, places):
            points = truth.scattered(run, choice, LENGTH, "pilot")
            _, found = run.simulations.judged(points, "pilot")
            off = found - [one.predict(self._places(points)) for one in self._models]
            means = np.nanmean(off.reshape(len(off), -1, LENGTH), axis=2)
            squares.append(LENGTH * np.nanvar(means, axis=1))
        return np.asarray(np.sqrt(np.nanmean(squares, axis=0)))

    def judged(self, points: Points, stage: str) -> tuple[Records, Array]:
        """What surrogates say, with waves as large as the scatter that they leave."""
        leaf, places = self._models[0], self._places(points)
        phases = (places - leaf.lower) / (leaf.upper - leaf.lower) @ self._waves + self._phases
        waves = np.sqrt(2.0 / WAVES) * np.cos(phases).sum(axis=1)
        models = zip(self._models, self._sizes, strict=True)
        found = np.array([one.predict(places) + size * waves for one, size in models])
        records = np.repeat(self._like, len(points))
        records["objective"] = found[0]
        self.counts[stage] += len(points)
        self.next += len(points) * loads_of(self.scene)
        return records, found

    def met(self) -> tuple[Array, Array]:
        """Designs of the pilot and their responses."""
        return self._made


class _Run(StudyRun):
    """A run without files, whose simulations are the same at any tolerance."""

    def of(self, scene: Scene) -> StudyRun:
        """The same run with other settings."""
        return replace(self, scene=scene)


def expected(scene: Scene, evaluate: Evaluate, seconds: float) -> tuple[int, float]:
    """Simulations that a study with cases takes as a rule, to two digits, and what one of them costs on one core.

    Where fewer than `LEAST` simulations per input take longer than `LONGEST`, designs of the pilot make no mechanisms, or
    worn clearances are needed that are not known yet, these are `hpcclear.study.stages.samples_of` and `seconds`, the cost
    as far as it is known without a pilot. `evaluate`: from points to records of the study's objective.
    """
    study, samples = scene.required_study, stages.samples_of(scene)
    loads = loads_of(scene)
    most = int(LONGEST / max(seconds * loads, 1e-9))
    least, looked = LEAST * len(study.models[-1]), REPLICATES * LENGTH
    times = int(np.clip(most // (study.samples + DESIGNS * looked), 1, REHEARSALS))
    most //= times
    designs = min(DESIGNS, (most - least) // looked)
    count = min(study.samples, most - designs * looked)
    if study.worn or designs < 1 or count < least:
        return sum(samples.values()), seconds
    pilot, counts = _Pilot(scene, evaluate), Counter[str]()
    try:
        with one_thread():
            for k in range(times):
                own = scene.with_({"study.seed": study.seed + k}) if k else scene
                run = _Run(own, Path(), alone(), cast(Checkpoint, None), pilot, lambda text: None)
                counts += _rehearsed(run, count, designs, samples)
    except InputError:
        return sum(samples.values()), seconds
    for name in ("search", "verification", "pairs"):
        samples[name] = loads * round(counts[name] / times)
    return int(float(f"{sum(samples.values()):.2g}")), pilot.seconds / pilot.count


def _rehearsed(run: StudyRun, count: int, looked: int, samples: Mapping[str, int]) -> Counter[str]:
    """Simulations by stage of search and verification, if f is as by so many simulations and designs that are looked at."""
    simulations = _Rehearsal(run, count, looked)
    run = replace(run, simulations=simulations)
    simulations.next = sum(samples[name] for name in ("sensitivity", "kriging") if name in samples)
    found = optimisation.optimise(run, simulations.model)
    ends, between = optimisation.extremes(run, found), optimisation.spread(run, found)
    better = search.search(run, [*ends, *between], simulations.model)
    rare.decided(run, stages.to_verify(run, ends, between, better))
    return simulations.counts

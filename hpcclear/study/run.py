"""One run of a study: what its stages share, and how each is done once and kept."""

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from hpcclear.ensemble.session import describe_variables
from hpcclear.ranks.team import Ranks
from hpcclear.results import dataset
from hpcclear.results.checkpoint import Checkpoint
from hpcclear.results.content import Results
from hpcclear.scene import Scene
from hpcclear.scene.streams import generator
from hpcclear.scene.study import Study
from hpcclear.study.simulations import Simulations

Result = dict[str, np.ndarray]
Work = Callable[..., Mapping[str, ArrayLike]]
"""Makes the result of a stage, from its run and further arguments."""


@dataclass(frozen=True)
class StudyRun:
    """What every stage needs."""

    scene: Scene
    directory: Path
    """Where results go."""
    ranks: Ranks
    checkpoint: Checkpoint
    simulations: Simulations
    notify: Callable[[str], object]
    """Gets what the user should know, a sentence at a time."""
    announce: Callable[[str], object] = lambda name: None
    """Gets the name of each stage when it begins."""
    times: dict[str, str] = field(default_factory=dict)
    """What stages measured of time, for the file of times: no result has time in it."""

    @property
    def study(self) -> Study:
        """The study of the scene."""
        return self.scene.required_study

    @property
    def words(self) -> dict[str, str]:
        """What the study variables are, by their names, and the ratios of inertias among them."""
        variables = self.study.variables
        ratios = {f"{x.name}_ratio": x.ratio_words for x in variables if x.ratio is not None}
        return {one.name: one.words for one in variables} | ratios

    def of(self, scene: Scene) -> "StudyRun":
        """The same run of a scene whose settings are other ones; what follows is numbered on."""
        simulations = Simulations(scene, self.ranks, self.checkpoint, self.simulations.style)
        simulations.next = self.simulations.next
        return replace(self, scene=scene, simulations=simulations)

    def rng(self, *labels: str) -> np.random.Generator:
        """A stream of random numbers for one purpose."""
        return generator(self.study.seed, *labels)

    def stage(self, name: str, work: Work, *arguments: object) -> Result:
        """What `work` returns for the run and further arguments; from disk when done before.

        Either way the samples that follow are numbered alike, so that a run that was interrupted
        ends like one that was not.
        """
        self.announce(name)
        return self._kept(name, self.ranks.stage(name), work, arguments)

    def part(self, name: str, work: Work, *arguments: object) -> Result:
        """The same for a part of a stage, kept by itself: long stages lose a part at most."""
        return self._kept(name, nullcontext(), work, arguments)

    def _kept(
        self, name: str, context: AbstractContextManager[None], work: Work, arguments: tuple[object, ...]
    ) -> Result:  # fmt: skip
        found = self.checkpoint.load_stage(name)
        count = 0 if found is None else int(found["next_sample"])
        # a file of the samples that a kept stage stands on may be damaged
        if found is None or len(self.checkpoint.completed(0, count)) != count:
            with context:
                self.ranks.raise_if_stopped()
                found = {key: np.asarray(value) for key, value in work(self, *arguments).items()}
                found["next_sample"] = np.asarray(self.simulations.next)
                with self.ranks.writing():
                    self.checkpoint.flush()
                    self.checkpoint.save_stage(name, found)
        self.simulations.next = int(found["next_sample"])
        return {key: value for key, value in found.items() if key != "next_sample"}

    def write(
        self, content: Results, name: str = "", attributes: Mapping[str, str] | None = None
    ) -> None:
        """Write a result file, called after its kind unless it has a name, with what made it; `attributes` where that differs
        from the study's."""
        content.attrs.update(self.checkpoint.attributes | dict(attributes or {}))
        describe_variables(content, self.study)
        file = self.directory / (name or f"{content.attrs['hpcclear_kind']}.nc")
        with self.ranks.stage("results"), self.ranks.writing():
            dataset.write(content, file)

    def write_samples(self) -> None:
        """Write samples.nc: all simulations so far, the points that surfaces and models are made of."""
        with self.ranks.writing():
            self.checkpoint.flush()
        records, values = self.checkpoint.contents()
        before = records["sample"] < self.simulations.next
        units = {variable.name: variable.unit for variable in self.study.variables}
        found = self.study.names, values[before], units, records[before]
        about = None, self.scene.objective, self.words, self.scene.joint_labels
        self.write(dataset.samples_dataset(*found, *about))

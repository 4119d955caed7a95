"""The study, from a scene to verified designs (the paper's Fig. 4): read this after the README.

1. Sensitivity: response surfaces at several clearances, first-order sensitivities and the interval
   in which they can be trusted, the influential variables, global indices.
2. Kriging: models of the objective; the swarm searches one of them.
3. Optimisation: fronts of mean and deviation of every case, several runs each; alpha has the least
   mean, beta the least deviation.
4. Verification: these designs back through the true dynamics by direct Monte Carlo. Where the
   surrogate's mean is off, it gets more points there and the swarm starts again.
5. Findings: responses of the optimised designs, the paper's claims tested on them, and the paper's
   own designs under the possible readings of its text.

Root tells this story; every simulation in it goes to all ranks. Each stage is kept on disk when it
is done, and each finished sample within seconds, so that the same command goes on where it stopped
and ends with the same bytes.
"""

import shlex
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.ensemble.compiling import compile_ahead
from hpcclear.ensemble.simulate import run_key
from hpcclear.ranks.progress import Style
from hpcclear.ranks.team import COLUMNS, Ranks
from hpcclear.results import dataset, files
from hpcclear.results.checkpoint import Checkpoint, check_key, discard, key_attribute, unfinished
from hpcclear.results.lock import Lock
from hpcclear.results.places import fresh_sibling
from hpcclear.scene import Scene
from hpcclear.scene.points import Points
from hpcclear.statistics.surrogate.piecewise import PiecewiseKriging
from hpcclear.study import optimisation, responses, sensitivities, surrogates, verification
from hpcclear.study.optimisation import Choice
from hpcclear.study.paper import claims
from hpcclear.study.paper import printed as paper
from hpcclear.study.paper import readings as audit
from hpcclear.study.run import Result, Run
from hpcclear.study.simulations import Simulations

__all__ = ["run_study"]


def run_study(
    scene: Scene,
    directory: str | Path,
    ranks: Ranks,
    *,
    fresh: bool = False,
    progress_style: Style = "auto",
    tell: Callable[[str], object] = lambda text: None,
) -> int | None:
    """Carry a study through; call it on root, under `hpcclear.ranks.boundary.run_on_ranks`.

    Parameters
    ----------
    scene : Scene
        With a study.
    directory : path
        Where results go; made if its parent exists. What an earlier run of the same study finished
        there is not done again.
    ranks : Ranks
        Made with `hpcclear.ensemble.simulate.MAKERS`.
    fresh : bool
        Start anew in a directory beside it, if there is one already.
    progress_style : {"auto", "bar", "log", "quiet"}
    tell : callable
        Gets what the user should know, a sentence at a time.

    Returns
    -------
    None
        When all is done.

    Raises
    ------
    InputError
        The scene has no study, the directory holds results of
        another run, or all simulations of a stage failed.
    Stopped
        If asked to end early; everything finished is on disk.
    """
    study = scene.required_study
    if not study.cases:
        raise InputError("study.cases", None, "there is nothing to optimise", "Name a case")
    place = _made(Path(directory), fresh, tell)
    key = run_key(scene, "run")
    with Lock(place):
        for folder in (place, place / "responses"):
            files.remove_leftovers(folder)
        if _finished(place, key, scene):
            discard(place / "checkpoint")  # the run that finished may have been killed over it
            tell(f"{place} holds the finished study.")
            return None
        attributes = {**dataset.provenance(scene.text, scene.hash), **key_attribute(key)}
        units = {variable.name: variable.unit for variable in study.variables}
        checkpoint = Checkpoint(
            place / "checkpoint", key, names=study.names, units=units, attributes=attributes
        )
        for problem in checkpoint.problems:
            tell(problem)
        simulations = Simulations(scene, ranks, checkpoint, progress_style)
        columns = tuple(variable.paths for variable in study.variables)
        points = Points(study.names, np.empty((0, len(columns))), columns)
        compile_ahead(scene, ranks, points, progress_style)
        _tell_the_story(Run(scene, place, ranks, checkpoint, simulations, tell))
        _write_timing(place, ranks, attributes)
        checkpoint.finish()
    return None


def _tell_the_story(run: Run) -> None:
    sensitivity: Result | None = None
    if run.study.groups:
        sensitivity = run.stage("sensitivity", sensitivities.analyse)
        sensitivities.write(run, sensitivity)
    kriging = run.stage("kriging", surrogates.fit_all)
    _write_samples(run)

    found = _search_until_true(run, kriging)
    surrogates.write(run, found.kriging)
    designs = [
        *optimisation.spread(run, found.fronts),
        *verification.original(run),
        *paper.printed_designs(run.scene),
    ]
    rest = run.stage("verification", verification.simulate, designs, "verification")
    true = {name: np.concatenate([found.true[name], rest[name]]) for name in rest}
    designs = [*found.designs, *designs]
    optimisation.write(run, found.fronts, designs)
    verification.write(run, designs, true, found.model, found.remarks)

    series = run.stage("responses", responses.simulate_all, designs)
    responses.write(run, designs)
    if audit.applies(run.scene):
        audit.write(run, run.stage("readings", audit.evaluate))
    if paper.is_comparable(run.scene):
        claims.write(run, claims.judge(run, sensitivity, found.kriging, series))


@dataclass(frozen=True)
class _Found:
    """Outcome of the search: the last models and fronts, alpha and beta with their true moments."""

    kriging: Result
    fronts: Result
    designs: list[Choice]
    true: Result
    remarks: list[str]

    @property
    def model(self) -> PiecewiseKriging:
        """The surrogate the swarm searched."""
        return surrogates.models_of(self.kriging)[-1]


def _search_until_true(run: Run, kriging: Result) -> _Found:
    """Optimise and verify alpha and beta; add points where the surrogate fails, until it holds."""
    remarks: list[str] = []
    round_ = 0
    while True:
        model = surrogates.models_of(kriging)[-1]
        fronts = run.stage(f"optimisation-{round_}", optimisation.optimise, model)
        designs = optimisation.extremes(run, fronts)
        stage = f"check-{round_}"
        true = run.stage(stage, verification.simulate, designs, stage)
        missed, texts = verification.misses(run, designs, true, model)
        if missed and round_ == run.study.verification.infill_rounds:
            texts.append("The surrogate failed there to the end: trust the true values.")
        for text in texts:
            run.tell(text)
        remarks += texts
        if not missed or round_ == run.study.verification.infill_rounds:
            return _Found(kriging, fronts, designs, true, remarks)
        where = verification.infill_points(run, missed, str(round_))
        stage = f"infill-{round_}"
        kriging = run.stage(stage, surrogates.grow, kriging, where, stage)
        round_ += 1


def _write_samples(run: Run) -> None:
    """Write samples.nc: all simulations so far, the points that surfaces and models are made of."""
    with run.ranks.writing():
        run.checkpoint.flush()
    records, values = run.checkpoint.contents()
    before = records["sample"] < run.simulations.next
    units = {variable.name: variable.unit for variable in run.study.variables}
    content = dataset.samples_dataset(run.study.names, values[before], units, records[before])
    run.write(content, "samples.nc")


def _write_timing(place: Path, ranks: Ranks, attributes: dict[str, str]) -> None:
    table = np.stack(list(ranks.stage_seconds.values()), axis=1)
    data = {name: table[:, :, k] for k, name in enumerate(COLUMNS)}
    content = dataset.timing_dataset(
        list(ranks.stage_seconds), data, shlex.join(sys.argv), attributes
    )
    dataset.write(content, place / "timing.nc")


def _made(directory: Path, fresh: bool, tell: Callable[[str], object]) -> Path:
    """The directory to work in, made if need be."""
    try:
        if fresh and directory.exists() and any(directory.iterdir()):
            directory = fresh_sibling(directory)
            tell(f"Results go to {directory}.")
        directory.mkdir(exist_ok=True)
    except OSError as error:
        raise files.refused(directory, error) from None
    return directory


def _finished(place: Path, key: dict[str, str], scene: Scene) -> bool:
    """Whether all results of this run are there; results of another run are refused."""
    study = scene.required_study
    names = ["samples.nc", "kriging.nc", "front.nc", "verification.nc"]
    names += ["claims.nc"] if paper.is_comparable(scene) else []
    names += ["sensitivity.nc"] if study.groups else []
    names += ["readings.nc"] if audit.applies(scene) else []
    there = [place / name for name in names if (place / name).exists()]
    for path in there:
        check_key(dataset.read(path), key, path)
    return len(there) == len(names) and not unfinished(place / "checkpoint")

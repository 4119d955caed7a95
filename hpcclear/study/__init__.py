"""The study, from a scene to verified designs: read this after the README.

0. Lives, where a clearance is random as wear leaves it: they are followed, and what their joints come to is the distribution.
0. On request the certificate of effects: what the scene could do without.
1. Sensitivity: response surfaces at several clearances, first-order sensitivities and the interval
   in which they can be trusted, the influential variables, global indices.
2. Kriging: models of the objective; the swarm searches one of them.
3. Optimisation: fronts of mean and deviation, or of what else a case makes small, by the model, several runs each.
4. Refinement: designs of these fronts and others through the true dynamics, more where the front is
   decided, until it stands.
5. Verification: the best of them, on scatter of their own. Alpha has the least mean, beta the least
   deviation (gamma, delta, epsilon the least of what a case makes small besides), and each design of the front is surely
   better than each other in one of them.
6. Chaos: samples of these designs twice, a hair beside, for the share of their scatter that is chaos.
7. Findings: responses of the optimised designs; for the scene of a publication also what it prints
   and claims, beside ours (`hpcclear.study.paper`).

Root tells this story; every simulation in it goes to all ranks. Each stage is kept on disk when it
is done, and each finished sample within seconds, so that the same command goes on where it stopped
and ends with the same bytes.
"""

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from types import ModuleType

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.ensemble.compiling import compile_ahead
from hpcclear.ensemble.identity import run_key
from hpcclear.ensemble.session import Options, Place, Session
from hpcclear.ensemble.simulate import saving
from hpcclear.ranks.boundary import alone
from hpcclear.ranks.progress import Style
from hpcclear.ranks.team import Ranks
from hpcclear.results import dataset
from hpcclear.results.checkpoint import unfinished
from hpcclear.scene import Scene
from hpcclear.scene.describing import unused
from hpcclear.scene.points import Points
from hpcclear.study import (
    certificate,
    chaos,
    fronts,
    launched,
    lives,
    optimisation,
    paper,
    refinement,
    responses,
    sensitivities,
    surrogates,
    tolerance,
    truth,
    verification,
)
from hpcclear.study.optimisation import Choice
from hpcclear.study.run import Result, StudyRun
from hpcclear.study.simulations import Simulations
from hpcclear.study.stages import Stages

__all__ = ["run_study"]


def run_study(
    scene: Scene,
    directory: str | Path,
    ranks: Ranks | int = 1,
    *,
    fresh: bool = False,
    progress_style: Style = "auto",
    tell: Callable[[str], object] = lambda text: None,
) -> Path:
    """Run a complete study: sensitivity analysis, surrogates, robust optimisation, verification of the designs.

    Parameters
    ----------
    scene : Scene
        With a study.
    directory : path
        Where results go; made if its parent exists. What an earlier run of the same study finished
        there is not done again.
    ranks : int or Ranks
        Number of processes: 1 is this one, more are started by mpiexec. Results have the same bytes for any number. `Ranks` is
        what `hpcclear.ranks.boundary.run_on_ranks` gives a program, on root.
    fresh : bool
        Start anew in a directory beside it, if there is one already.
    progress_style : {"auto", "bar", "log", "quiet"}
    tell : callable
        Gets what the user should know, a sentence at a time.

    Returns
    -------
    Path
        The directory of the results, when all is done.

    Raises
    ------
    InputError
        The scene has no study, the directory holds results of
        another run, or all simulations of a stage failed.
    Stopped
        If asked to end early; everything finished is on disk.
    """
    if isinstance(ranks, int) and ranks > 1:
        return launched.launch(
            scene, Path(directory), ranks, fresh=fresh, progress_style=progress_style
        )
    if isinstance(ranks, int):
        ranks = alone()
    study = scene.required_study
    if not study.cases:
        raise InputError("study.cases", None, "there is nothing to optimise", "Name a case")
    lives.check(scene)
    optimisation.check(scene)
    for text in unused(scene):
        tell(f"Warning: {text}")
    place = Place.of_directory(Path(directory), fresh, ("responses",), lives.files(scene))
    if place.output != Path(directory):
        tell(f"Results go to {place.output}.")
    options = Options(fresh, style=progress_style)
    with Session(place, run_key(scene, "run"), ranks, options, tell) as session:
        times: dict[str, str] = {}
        followed = all((place.output / name).exists() for name in lives.files(scene))
        if session.has_all(_results(scene)) and followed and not unfinished(place.parts):
            tell(f"{place.output} holds the finished study.")
        else:
            times = _carry_out(scene, session)
        session.close(session.attributes | times)
    return place.output


def _carry_out(scene: Scene, session: Session) -> dict[str, str]:
    """Go on from what is there, to the end; what stages measured of time."""
    study, style = scene.required_study, session.options.style
    session.describe(scene)
    units = {variable.name: variable.unit for variable in study.variables}
    checkpoint = session.opened(study.names, units)
    columns = tuple(variable.paths for variable in study.variables)
    points = Points(study.names, np.empty((0, len(columns))), columns)
    compile_ahead(scene, session.ranks, points, style)
    announce = Stages(scene).announced if style != "quiet" else Stages.silent
    announce("wear")
    known = lives.known(scene, session)
    simulations = Simulations(known, session.ranks, checkpoint, style)
    directory = session.place.output
    run = StudyRun(known, directory, session.ranks, checkpoint, simulations, session.tell, announce)
    with saving(checkpoint.flush):  # samples of small stages wait for the next save
        _tell_the_story(run, scene)
    return run.times


def _tell_the_story(given: StudyRun, written: Scene) -> None:
    """All stages after the lives; `written` is the scene as it was, without what these told."""
    run = given
    sensitivity: Result | None = None
    if run.study.certificate is not None:
        certificate.certify(run)
    if run.study.groups:
        sensitivity = run.stage("sensitivity", sensitivities.analyse)
        sensitivities.write(run, sensitivity)
    kriging = run.stage("kriging", surrogates.fit_all)
    _write_samples(run)

    models = surrogates.models_of(run.scene, kriging)
    model = models[-1]
    surrogates.write(run, kriging, models)
    found = run.stage("optimisation", optimisation.optimise, model)
    ends, between = optimisation.extremes(run, found), optimisation.spread(run, found)
    fronts.write(run, found, [*ends, *between], model)
    finalists, remarks = refinement.search(run, [*ends, *between])

    designs = [*ends, *(finalists or between)]
    designs += [*verification.original(run), *paper.printed_designs(run.scene)]
    true = run.stage("verification", _verified, designs)
    table = verification.named(run, designs, true)
    true = {name: values[table.rows] for name, values in true.items()}
    if run.study.paired:
        text, more = tolerance.reached(run, true, [choice.name for choice in table.choices])
        run.tell(text)
        remarks += more
    remarks += verification.missed(run, table.choices, true, model)
    for text in remarks:
        run.tell(text)
    printed = paper.printed_moments(run.scene, table.choices)
    over_life: Result = {}
    if written.required_study.worn:
        over_life = run.stage("lives", lives.of_designs, written, table.choices)
    verification.write(run, table, true, model, remarks, printed, over_life)

    scatter = run.stage("chaos", chaos.simulate, designs)
    chaos.write(run, table.choices, {name: one[table.rows] for name, one in scatter.items()})

    series = given.stage("responses", responses.simulate_all, table.choices)
    responses.write(given, table.choices)
    paper.write_findings(run, sensitivity, kriging, series)


def _verified(run: StudyRun, designs: Sequence[Choice]) -> Result:
    """Moments of designs to the accuracy that is asked, or to the usual one of the samples alone."""
    if run.study.paired:
        return tolerance.verified(run, designs)
    return truth.simulate(run, designs, "verification")


def _write_samples(run: StudyRun) -> None:
    """Write samples.nc: all simulations so far, the points that surfaces and models are made of."""
    with run.ranks.writing():
        run.checkpoint.flush()
    records, values = run.checkpoint.contents()
    before = records["sample"] < run.simulations.next
    units = {variable.name: variable.unit for variable in run.study.variables}
    content = dataset.samples_dataset(
        run.study.names,
        values[before],
        units,
        records[before],
        objective=run.scene.objective,
        words=run.words,
        joints=run.scene.joint_labels,
    )
    run.write(content, "samples.nc")


def _results(scene: Scene) -> list[str]:
    """Files of a study that is finished."""
    names = ["samples.nc", "kriging.nc", "front.nc", "verification.nc"]
    names += ["sensitivity.nc"] if scene.required_study.groups else []
    names += ["effects.nc"] if scene.required_study.certificate is not None else []
    return names + paper.files(scene)


class _Study(ModuleType):
    """This package, which can be called: ``hpcclear.study(scene, directory, ranks=4)`` stands beside ``hpcclear.map``."""

    __call__ = staticmethod(run_study)


sys.modules[__name__].__class__ = _Study

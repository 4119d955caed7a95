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
6. Chaos: samples of these designs twice, with a relative perturbation of 1e-9, for the share of their scatter that is chaos.
7. Findings: responses of the optimised designs; for the scene of a publication also what it prints
   and claims, beside ours (`hpcclear.study.paper`).

Root tells this story; every simulation in it goes to all ranks. Each stage is kept on disk when it
is done, and each finished sample within seconds, so that the same command goes on where it stopped
and ends with the same bytes.
"""

import sys
from collections.abc import Callable
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
from hpcclear.results.checkpoint import unfinished
from hpcclear.scene import Scene
from hpcclear.scene.choices import expanded
from hpcclear.scene.describing import unused
from hpcclear.scene.points import Points
from hpcclear.study import launched, lives, optimisation
from hpcclear.study.extent import certificate_extent
from hpcclear.study.run import StudyRun
from hpcclear.study.simulations import Simulations
from hpcclear.study.stages import Announcer, carry_out, files_of

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
        raise InputError("study.cases", None, "there is no case to optimise", "Name a case")
    lives.check(scene)
    optimisation.check(scene)
    for text in unused(scene):
        tell(f"Warning: {text}")
    worn = [lives.NAME] if study.worn else []
    place = Place.of_directory(Path(directory), fresh, ("responses",), worn)
    if place.output != Path(directory):
        tell(f"Results go to {place.output}.")
    options = Options(fresh, style=progress_style)
    with Session(place, run_key(scene, "run"), ranks, options, tell) as session:
        times: dict[str, str] = {}
        followed = all((place.output / name).exists() for name in worn)
        if session.has_all(files_of(scene)) and followed and not unfinished(place.parts):
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
    points = expanded(study, Points(study.names, np.empty((0, len(columns))), columns))
    compile_ahead(scene, session.ranks, points, style)
    announce = Announcer(scene).announced if style != "quiet" else Announcer.silent
    simulations = Simulations(scene, session.ranks, checkpoint, style)
    directory = session.place.output
    run = StudyRun(scene, directory, session.ranks, checkpoint, simulations, session.tell, announce)
    with saving(checkpoint.flush):  # samples of small stages wait for the next save
        carry_out(run, certificate_extent)
    return run.times


class _Study(ModuleType):
    """This package, which can be called: ``hpcclear.study(scene, directory, ranks=4)`` stands beside ``hpcclear.map``."""

    __call__ = staticmethod(run_study)


sys.modules[__name__].__class__ = _Study

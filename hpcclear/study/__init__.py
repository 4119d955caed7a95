"""The study, from a scene to verified designs: read this after the README.

0. Wear: if a clearance is distributed as wear leaves it, service lives give the distribution.
0. On request, effect screening: effects that can be neglected.
1. Sensitivity: response surfaces at several clearances, first-order sensitivities with their range of validity, influential
   variables, Sobol indices.
2. Kriging: surrogates of the objective; the swarm searches one of them.
3. Optimisation: Pareto fronts of the objectives of each case on the surrogate, several runs each.
4. Refinement: these and further designs by simulation, more where the front is undecided.
5. Verification: the best designs on independent samples. Alpha minimises the first objective (mean), beta the second (standard
   deviation), gamma, delta and epsilon further ones. Each design of the front is significantly better than each other in one.
6. Chaos: pairs of samples with a relative perturbation of 1e-9 give the fraction of the variance that is due to chaos.
7. Responses of the optimised designs; for the scene of the paper also its printed values and claims (`hpcclear.study.paper`).

Root runs the stages, and all ranks simulate. Finished stages and, within seconds, finished samples are on disk. The same
command resumes from them and ends with the same bytes.
"""

import sys
from collections.abc import Callable
from inspect import signature
from pathlib import Path
from types import ModuleType

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.ensemble.compiling import compile_ahead
from hpcclear.ensemble.identity import run_key
from hpcclear.ensemble.session import Options, Session, saving
from hpcclear.ranks.boundary import alone
from hpcclear.ranks.team import Ranks
from hpcclear.ranks.terminal import Style
from hpcclear.results.checkpoint import unfinished
from hpcclear.results.places import Place
from hpcclear.scene import Scene
from hpcclear.scene.describing import unused
from hpcclear.scene.points import Points, expanded
from hpcclear.study import launched, lives, optimisation
from hpcclear.study.run import StudyRun
from hpcclear.study.simulations import Simulations
from hpcclear.study.stages import announcer, carry_out, files_of

__all__ = ["run_study"]


def run_study(
    scene: Scene,
    directory: str | Path,
    ranks: Ranks | int = 1,
    *,
    fresh: bool = False,
    progress_style: Style = "auto",
    notify: Callable[[str], object] = lambda text: None,
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
    notify : callable
        Gets messages to the user, a sentence at a time.

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
        If requested to end early; everything finished is on disk.
    """
    if isinstance(ranks, int) and ranks > 1:
        where, style = Path(directory), progress_style
        return launched.launch(scene, where, ranks, fresh=fresh, progress_style=style)
    if isinstance(ranks, int):
        ranks = alone()
    study = scene.required_study
    if not study.cases:
        raise InputError("study.cases", None, "there is no case to optimise", "Name a case")
    lives.check(scene)
    optimisation.check(scene)
    for text in unused(scene):
        notify(f"Warning: {text}")
    worn = [lives.NAME] if study.worn else []
    place = Place.of_directory(Path(directory), fresh, ("responses",), worn)
    if place.output != Path(directory):
        notify(f"Results go to {place.output}.")
    options = Options(fresh, style=progress_style)
    with Session(place, run_key(scene, "run"), ranks, options, notify) as session:
        times: dict[str, str] = {}
        followed = all((place.output / name).exists() for name in worn)
        if session.has_all(files_of(scene)) and followed and not unfinished(place.parts):
            notify(f"{place.output} holds the finished study.")
        else:
            times = _carry_out(scene, session)
        session.close(session.attributes | times)
    return place.output


def _carry_out(scene: Scene, session: Session) -> dict[str, str]:
    """Go on from what is there, to the end; what stages measured of time."""
    study, style = scene.required_study, session.options.style
    units = {variable.name: variable.unit for variable in study.variables}
    checkpoint = session.opened(scene, units)
    columns = tuple(variable.paths for variable in study.variables)
    points = expanded(study, Points(study.names, np.empty((0, len(columns))), columns))
    compile_ahead(scene, session.ranks, points, style)
    simulations = Simulations(scene, session.ranks, checkpoint, style)
    where = scene, session.place.output, session.ranks, checkpoint, simulations
    run = StudyRun(*where, session.notify, announcer(scene, style))
    with saving(checkpoint.flush):  # samples of small stages wait for the next save
        carry_out(run)
    return run.times


class _Study(ModuleType):
    """This package, which can be called: ``hpcclear.study(scene, directory, ranks=4)`` stands beside ``hpcclear.map``."""

    __call__ = staticmethod(run_study)
    # Python before 3.13 would leave out the first parameter
    __signature__ = signature(run_study)


sys.modules[__name__].__class__ = _Study

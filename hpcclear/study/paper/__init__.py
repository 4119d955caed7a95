"""All that belongs to one publication (`hpcclear.scene.citation`), for scenes that are its own.

Its Table 4 beside our designs, its claims tested on our data, and its designs under the readings of
its text. For any other scene nothing here does anything, and no file of it is written.
"""

from hpcclear.scene import Scene
from hpcclear.study.paper import claims, readings
from hpcclear.study.paper.printed import printed_designs, printed_moments
from hpcclear.study.paper.recognition import is_the_papers, own_names
from hpcclear.study.run import Result, StudyRun

__all__ = [
    "files",
    "is_the_papers",
    "own_names",
    "printed_designs",
    "printed_moments",
    "write_findings",
]


def files(scene: Scene) -> list[str]:
    """Names of the result files that are written of a scene."""
    found = ["claims.nc"] if is_the_papers(scene) else []
    return found + (["readings.nc"] if readings.applies(scene) else [])


def write_findings(
    run: StudyRun, sensitivity: Result | None, kriging: Result, series: Result
) -> None:
    """Evaluate the readings and judge the claims, as far as they apply.

    Parameters
    ----------
    run : StudyRun
    sensitivity, kriging, series : dict of arrays
        Results of the stages of sensitivities (None: left out), Kriging models and responses.
    """
    if readings.applies(run.scene):
        readings.write(run, run.stage("readings", readings.evaluate))
    if is_the_papers(run.scene):
        claims.write(run, claims.judge(run, sensitivity, kriging, series))

"""Everything a study compiles, shared out over the ranks at its start.

Compilation takes longer than many a study's simulations. What one rank has compiled the others on
its node load from disk.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from hpcclear.base.quantiles import Uniform
from hpcclear.dynamics.evaluation.evaluator import Evaluator
from hpcclear.dynamics.response import simulated
from hpcclear.ensemble.simulate import Payload, payload_of
from hpcclear.ensemble.single import SHORTEST
from hpcclear.ranks.team import Ranks
from hpcclear.ranks.terminal import Style, announce
from hpcclear.scene import Scene
from hpcclear.scene.points import Points
from hpcclear.statistics.random.inputs import RandomVariable
from hpcclear.statistics.random.moments import RobustObjective
from hpcclear.statistics.search.mopso import minimise
from hpcclear.statistics.surrogate.fitting import fit_kriging


def compile_share(payload: Payload, ranks: Ranks) -> None:
    """Compile this rank's share of the parts; root and the others are at it together."""
    scene = payload.scene
    mine: tuple[Callable[[], object], ...] = (
        lambda: Evaluator(scene, payload.columns, payload.lanes).advance(0.0),  # of many samples
        lambda: simulated(scene.with_(SHORTEST)),  # of one response
        lambda: _statistics(scene),
    )
    if ranks.size > 1 and ranks.is_root:
        # the first takes as long as the others together; then the second is there to load
        mine = mine[:2]
    elif ranks.size > 1:
        mine = mine[1:][ranks.rank - 1 :: ranks.size - 1]
    for part in mine:
        part()


def _statistics(scene: Scene) -> None:
    """Surrogate, its moments, and the swarm."""
    rng = np.random.default_rng(0)
    points = rng.random((12, 2))
    bounds = np.array([[0.0, 1.0], [0.0, 1.0]])
    model = fit_kriging(points, points.sum(axis=1), bounds, rng=rng, names=("x", "y"))
    model.predict(points)
    study = scene.study
    if study is not None and study.surrogate.kernel not in (None, model.kernel):
        replace(model, kernel=study.surrogate.kernel).predict(points)
    objective = RobustObjective(model, ("x",), [RandomVariable("y", Uniform(0.5, 0.5))])
    minimise(objective, bounds[:1], iterations=4, rng=rng, size=2)


def compile_ahead(scene: Scene, ranks: Ranks, points: Points, style: Style) -> None:
    """Compile what a study of this scene needs, each part on a rank of its own if there are three.

    Of the points, perhaps none, the columns are what counts; `style`: how progress is shown.
    """
    announce("compiling what this study needs: up to a minute the first time", style)
    ranks.everywhere("compile", compile_share, payload_of(scene, points))

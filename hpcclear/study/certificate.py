"""The effect screening as a stage of a study: which effects it could do without."""

import itertools

import numpy as np

from hpcclear.base.arrays import Records
from hpcclear.ensemble.effects import effects_dataset, times_of
from hpcclear.ensemble.session import sample_points
from hpcclear.ensemble.trial import Trial, Wanted
from hpcclear.report.figures.effects import statements
from hpcclear.scene import Scene
from hpcclear.scene.points import Points
from hpcclear.study.run import Result, StudyRun


def certify(run: StudyRun, extent: tuple[int, float]) -> None:
    """Simulate with effects on and off, each design of it kept by itself; write effects.nc and report what can be left out.

    `extent`: samples of each variant at most, and of the whole scene that all come to. Raises InputError if no effect of the
    scene can be off, or its objective is zero.
    """
    asked = run.study.certificate
    assert asked is not None
    trial, numbers = Trial(run.scene), itertools.count(1)

    def simulate(scene: Scene, points: Points) -> Records:
        return _records(run.part(f"effects-{next(numbers)}", _simulated, scene, points))

    run.announce("effects")
    with run.ranks.stage("effects"):
        plan = trial.plan(Wanted(asked.tolerance, *extent, asked.forces))
        found = trial.certify(plan, simulate)
    content = effects_dataset(trial, found, {})
    run.write(content)
    with run.ranks.stage("effects: cost"):
        seconds = trial.seconds(found.variants)
    run.times.update(times_of(seconds))
    for text in statements(content, seconds):
        run.notify(text)


_KEPT = ("objective", "peak_contact_force", "rhs_evaluations", "steady_revolutions", "flags")


def _simulated(run: StudyRun, scene: Scene, points: Points) -> Result:
    records = sample_points(scene, points, run.ranks, stage="effects: simulations")
    return {name: records[name] for name in _KEPT if name in (records.dtype.names or ())}


def _records(kept: Result) -> Records:
    """What was kept of records, as records."""
    types = [(name, kept[name].dtype, kept[name].shape[1:]) for name in kept]
    found = np.zeros(len(kept["objective"]), types)
    for name in kept:
        found[name] = kept[name]
    return found

"""Responses of the baseline and the optimised designs beside each other (the paper's Fig. 10)."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.outcome import Status
from hpcclear.dynamics.response import simulated
from hpcclear.ensemble.single import responses_of
from hpcclear.report.figures.motion import phase
from hpcclear.results.content import Results
from hpcclear.results.dataset import variable_name
from hpcclear.results.provenance import program
from hpcclear.scene import Scene
from hpcclear.scene.planar import turns_of
from hpcclear.scene.study import Study
from hpcclear.study.goals import ends_in_all
from hpcclear.study.optimisation import Choice
from hpcclear.study.run import Result, StudyRun

QUANTITIES = ("contact force 1", "contact force 2", "crank moment", "slider acceleration")
"""O12, O23, the reaction moment on the crank, and the slider."""

STATISTICS = ("mean", "fluctuation", "peak")
"""Mean of the magnitude, standard deviation, largest magnitude."""


def compared(run: StudyRun, designs: Sequence[Choice]) -> list[tuple[str, Choice]]:
    """Names and designs whose responses are compared, of those that decide: the baseline design of one case, and all others."""
    name = f"{run.study.cases[0].name} original"
    original = next(one for one in designs if one.name == name)
    return [("original", original), *((one.name, one) for one in designs if one.origin == "search")]


def simulations(study: Study) -> int:
    """Single responses: each and its copies are simulated for their statistics, and it for its file."""
    return (study.verification.response_copies + 1) * (1 + ends_in_all(study) + len(study.cases))


def scene_of(run: StudyRun, choice: Choice, revolutions: int) -> Scene:
    """The scene of one design, at the clearance of the comparison if the study names one, without a study."""
    return run.scene.with_({"study": None, **_changes(run, choice, revolutions)})


def _changes(run: StudyRun, choice: Choice, revolutions: int) -> dict[str, object]:
    """Entries of the scene of one design that are other ones."""
    settings = run.study.verification
    changes: dict[str, object] = {
        "numerics.averaged_revolutions": revolutions,
        "numerics.responses": run.scene.responses_asked(),
        "numerics.objective": run.scene.objective.name,
    }
    for name, value in choice.design.items():
        changes |= run.study.variable(name).entries(value)
    if settings.response_clearance is not None:
        for joint in run.scene.clearance_joints():
            changes[f"{run.scene.joint_key(joint)}.clearance"] = settings.response_clearance
    return changes


def simulate_all(run: StudyRun, designs: Sequence[Choice]) -> Result:
    """Statistics of each design's steady response and of copies perturbed at their start, segment by segment.

    Where motion is chaotic one response says little of a design: copies see other segments of the same motion. Returns
    ``names`` (designs,) and ``statistics`` (designs, copies, windows, `STATISTICS`, `QUANTITIES`), SI; NaN where a
    simulation failed.
    """
    settings = run.study.verification
    chosen = compared(run, designs)
    revolutions = settings.response_revolutions * settings.response_windows
    windows, copies = settings.response_windows, settings.response_copies
    variants = [_changes(run, choice, revolutions) for _, choice in chosen]
    shape = windows, len(STATISTICS), len(run.scene.joint_labels) + 2
    work = partial(_statistics, shape=shape)
    what = run.scene, variants, work, shape, run.ranks, "responses: simulations"
    table = responses_of(*what, copies=copies)
    return {"names": np.array([name for name, _ in chosen]), "statistics": table}


def write(run: StudyRun, designs: Sequence[Choice]) -> None:
    """Write each response to responses/NAME.nc: the first steady revolutions, as Fig. 10. Failures are reported."""
    (run.directory / "responses").mkdir(exist_ok=True)
    for name, choice in compared(run, designs):
        scene = scene_of(run, choice, run.study.verification.response_revolutions)
        with run.ranks.stage("responses"):
            response = simulated(scene)
        status = Status(int(response["status"]))
        if status is not Status.OK:
            why = f"ended as {status.name.lower()}: {status.message}. {status.remedy}"
            run.notify(f"The response of {name} has no file: its simulation {why}")
            continue
        content = _steady(scene, response)
        made_by = {**scene.origin, "scene": scene.to_toml(), **program()}
        file = f"responses/{variable_name(name.replace(' ', '_'), 'response')}.nc"
        run.write(content, file, {**made_by, "design": name})


def _steady(scene: Scene, response: Results) -> Results:
    """The response after its transient, all of which is averaged."""
    turns = turns_of(scene.linkage)
    begin = 2.0 * np.pi * turns * scene.numerics.transient_revolutions
    kept = response.isel(time=np.flatnonzero(phase(response) >= begin - 1e-9))
    return kept.assign_attrs(transient_turns=0)


def _statistics(scene: Scene, response: Results, shape: tuple[int, int, int]) -> Array:
    """Statistics of each segment of a steady response, of shape (windows, statistics, quantities); NaN if it failed."""
    if int(response["status"]) != Status.OK:
        return np.full(shape, np.nan)
    steady = _steady(scene, response)
    widths = {"contact_force": len(scene.joint_labels), "crank_moment": 1, "slider_acceleration": 1}
    table = np.full((steady.sizes["time"], shape[2]), np.nan)
    begin = 0
    for name, width in widths.items():
        if name in steady:  # a linkage may have no slider
            table[:, begin : begin + width] = steady[name].values.reshape(-1, width)
        begin += width
    parts = np.array_split(table, shape[0])
    found = [[abs(part).mean(axis=0), part.std(axis=0), abs(part).max(axis=0)] for part in parts]
    return np.array(found)

"""The paper's own designs under the possible readings of its text: which comes nearest?

Open are: whether the stiffness of eq. 4 has the factor sqrt(R_J), which its dimension requests and
the print lacks; the coefficient of restitution (0.9 here, 0.46 in works it builds on); whether the
bearing's or the journal's radius stays as built when the clearance varies; and whether the mean of
eq. 13 runs over time or over the steps of the solver. Nothing is fitted to the printed values.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.outcome import JOINTS, Status
from hpcclear.ensemble.session import sample_points
from hpcclear.ensemble.single import responses_of
from hpcclear.ranks.progress import Progress
from hpcclear.report.figures.motion import eccentricity
from hpcclear.results import dataset
from hpcclear.results.content import Results
from hpcclear.scene import Scene
from hpcclear.scene.points import Points
from hpcclear.scene.stages import REPLICATES
from hpcclear.statistics.random.replicates import moments
from hpcclear.study.optimisation import Choice
from hpcclear.study.paper.printed import own_names, printed_designs, printed_moments
from hpcclear.study.run import Result, StudyRun
from hpcclear.study.truth import scattered, scrambled_length

STAGE = "readings"
OTHER_RESTITUTION = 0.46
STEP_SAMPLES = 16
"""Samples whose every solver step is recorded; a response at a time, so they are few."""

_COLUMNS = ("mean", "mean_error", "deviation", "deviation_error", "failed")


@dataclass(frozen=True)
class Interpretation:
    """One way to read the text."""

    restitution: float
    with_journal_radius: bool  # in eq. 4
    bearing_fixed: bool  # else the journal
    over_steps: bool = False

    @property
    def text(self) -> str:
        """For people."""
        stiffness = f"eq. 4 {'with' if self.with_journal_radius else 'without'} R_J"
        fixed = f"{'R_B' if self.bearing_fixed else 'R_J'} fixed"
        over = "f over solver steps" if self.over_steps else "f over time"
        return f"c_e {self.restitution:g}, {stiffness}, {fixed}, {over}"


def applies(scene: Scene) -> bool:
    """Whether the scene is the paper's and requests the comparison."""
    contact, verification = scene.effects.contact, scene.required_study.verification
    if contact is None or contact.law != "lankarani-nikravesh":
        return False
    return verification.audit_samples > 0 and bool(printed_designs(scene))


def simulations(scene: Scene) -> tuple[int, int]:
    """Samples on the ranks, and single responses, of `evaluate`."""
    if not applies(scene):
        return 0, 0
    designs, made = len(printed_designs(scene)), readings(scene)
    over_steps = sum(reading.over_steps for reading in made)
    each = REPLICATES * scrambled_length(scene.required_study.verification.audit_samples) + 1
    return designs * each * (len(made) - over_steps), designs * (STEP_SAMPLES + 1) * over_steps


def readings(scene: Scene) -> list[Interpretation]:
    """All combinations over time, and the scene's own over solver steps."""
    own = scene.number("effects.contact.restitution")
    restitutions = [own] if own == OTHER_RESTITUTION else [own, OTHER_RESTITUTION]
    combinations = itertools.product(restitutions, (True, False), (True, False))
    return [*(Interpretation(*one) for one in combinations), Interpretation(own, True, True, True)]


def evaluate(run: StudyRun) -> Result:
    """Mean, standard deviation and f at the smallest clearance for each reading and printed design: the data variables of
    readings.nc, (readings, designs)."""
    every = enumerate(readings(run.scene))
    table = np.array([run.part(f"{STAGE}-{k}", _row, reading)["row"] for k, reading in every])
    result = {name: table[..., k] for k, name in enumerate((*_COLUMNS, "objective_smallest"))}
    result["failed"] = result["failed"].astype(np.int64)
    return result


def write(run: StudyRun, result: Result) -> None:
    """Write readings.nc; `distance` says how far a reading is from the printed means."""
    designs = printed_designs(run.scene)
    printed = printed_moments(run.scene, designs)
    coords = {"reading": np.array([reading.text for reading in readings(run.scene)])}
    coords["design"] = np.array([choice.name for choice in designs])
    data = {**result, "mean_paper": printed["mean"], "deviation_paper": printed["deviation"]}
    data["case"] = np.array([choice.case for choice in designs])
    data["distance"] = np.sqrt(np.mean(np.log(result["mean"] / printed["mean"]) ** 2, axis=1))
    run.write(dataset.dataset("readings", coords, data))


def _row(run: StudyRun, reading: Interpretation) -> dict[str, Array]:
    """Moments and f at the smallest clearance of all printed designs in one reading."""
    designs = printed_designs(run.scene)
    found = (_over_steps if reading.over_steps else _over_time)(run, reading, designs)
    return {"row": np.array(found)}


def _over_time(
    run: StudyRun, reading: Interpretation, designs: Sequence[Choice]
) -> list[tuple[float, ...]]:
    """All designs as one batch, each with its samples and, last, itself at the smallest gap."""
    length = scrambled_length(run.study.verification.audit_samples)
    batches = [batch for d in designs for batch in (scattered(run, d, length), _smallest(run, d))]
    values = np.vstack([batch.values for batch in batches])
    points = _read(run, reading, Points(batches[0].names, values, batches[0].paths))
    where = run.ranks, None, Progress("", style="quiet")
    records = sample_points(_scene(run, reading), points, *where, stage=f"{STAGE}: simulations")
    f = np.where(records["status"] == Status.OK, records["objective"], np.nan)
    parts = f.reshape(len(designs), -1)
    return [(*_moments(one[:-1].reshape(REPLICATES, length)), float(one[-1])) for one in parts]


def _over_steps(
    run: StudyRun, reading: Interpretation, designs: Sequence[Choice]
) -> list[tuple[float, ...]]:
    """The same, a response each."""
    variants: list[dict[str, object]] = []
    for one in designs:
        for batch in (scattered(run, one, STEP_SAMPLES, first=None), _smallest(run, one)):
            for row in batch.values:
                variants.append({"output.instants_per_revolution": 0})
                for name, value in zip(batch.names, row, strict=True):
                    variants[-1] |= dict.fromkeys(run.study.variable(name).paths, float(value))
    what = _scene(run, reading), variants, _mean_over_steps, (), run.ranks
    f = responses_of(*what, f"{STAGE}: simulations")
    parts = f.reshape(len(designs), -1)
    return [(*_moments(part[:-1, None]), float(part[-1])) for part in parts]


def _moments(values: Array) -> tuple[float, ...]:
    """`_COLUMNS` of replicates (r, values): randomised replicates, or independent draws."""
    mean, deviation = moments(values)
    failed = int(np.isnan(values).sum())
    return mean.value, mean.error, deviation.value, deviation.error, failed


def _mean_over_steps(scene: Scene, response: Results) -> Array:
    """f of one sample, the mean of eq. 13 taken over the accepted steps; NaN if it failed."""
    if int(response["status"]) != Status.OK:
        return np.array(np.nan)
    turn = 2.0 * np.pi * scene.numerics.transient_revolutions
    steady = response["crank_angle"].values >= turn
    distance = eccentricity(response)[steady]
    clearance = [scene.number(f"joints.{joint}.clearance") for joint in JOINTS]
    return np.array(np.sqrt(np.sum(abs(distance - clearance).mean(axis=0) ** 2)))


def _smallest(run: StudyRun, choice: Choice) -> Points:
    """The design itself at the smallest clearance."""
    clearance = own_names(run.scene)["C"]
    names = (*choice.design, clearance)
    lowest = run.study.variable(clearance).bounds[0]
    return run.simulations.filled(names, np.array([[*choice.design.values(), lowest]]))


def _scene(run: StudyRun, reading: Interpretation) -> Scene:
    return run.scene.with_({"study": None, "effects.contact.restitution": reading.restitution})


def _read(run: StudyRun, reading: Interpretation, points: Points) -> Points:
    """Samples with the further columns that a reading moves."""
    clearance = points.column(own_names(run.scene)["C"])
    built = {joint: run.scene.number(f"joints.{joint}.bearing_radius") for joint in JOINTS}
    names, columns, paths = list(points.names), [points.values], list(points.paths)

    def add(path: str, values: Array) -> None:
        names.append(path)
        columns.append(values[:, None])
        paths.append((path,))

    for joint in JOINTS:
        bearing = np.full(len(points), built[joint])
        if not reading.bearing_fixed:
            bearing = 19.95e-3 + clearance  # the journal's radius as built, m (the paper's Table 2)
            add(f"joints.{joint}.bearing_radius", bearing)
        if not reading.with_journal_radius:
            # K is proportional to the moduli, so they can take the factor 1 / sqrt(R_J)
            for part in ("bearing", "journal"):
                path = f"joints.{joint}.{part}.youngs_modulus"
                add(path, run.scene.number(path) / np.sqrt(bearing - clearance))
    return Points(tuple(names), np.hstack(columns), tuple(paths))

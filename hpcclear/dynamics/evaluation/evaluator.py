"""Points to outcome records, in this process: what every rank runs, and what a script calls without MPI."""

import os
from collections.abc import Sequence

import numpy as np

from hpcclear.base.arrays import Array, Integers, Records
from hpcclear.base.errors import InputError
from hpcclear.base.objectives import MEAN_GAP, RATE, Objective, asked
from hpcclear.base.outcome import FIELDS, IMPACTS, RESPONSES, Flag, Status, unknown
from hpcclear.base.width import doubles_in_a_vector, first_level_cache
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout.views import Outcome, Parameters, Start
from hpcclear.dynamics.linkage.mechanism import modes_of
from hpcclear.dynamics.planar import energy
from hpcclear.dynamics.setup.parameters import parameters, widest_contact
from hpcclear.dynamics.setup.problem import problem_of
from hpcclear.dynamics.setup.start import start_states
from hpcclear.dynamics.stepping.lanes import Lanes
from hpcclear.dynamics.stepping.prescribed import PrescribedSamples
from hpcclear.dynamics.stepping.problem import Problem
from hpcclear.ranks.schedule import Worker
from hpcclear.scene import Scene
from hpcclear.scene.points import Numbers, Points
from hpcclear.scene.scene import record_of

VECTORS = 4
"""Vectors that the lanes of an ensemble fill at most: enough for the processor to work on one while another waits for a root or
a quotient, few enough for a first-level cache of 48 KiB. There 16 to 48 lanes are within 3 to 10 %, 8 are left scalar."""

CACHE_OF_A_VECTOR = 12 * 1024
"""Bytes of the first-level cache for each of them: in 32 KiB 16 lanes take 0.84 of the time of 32, whose states, stages and
parameters do not fit."""

LEAST_LANES = 16  # shorter loops the compiler does not vectorise where it must check at run time whether arrays overlap


def default_lanes() -> int:
    """Lanes of an ensemble on this processor, or as many as ``HPCCLEAR_LANES`` says; no result depends on them.

    Raises InputError if that is not a whole number from 1 to 1024.
    """
    asked = os.environ.get("HPCCLEAR_LANES", "")
    if not asked:
        vectors = min(VECTORS, first_level_cache() // CACHE_OF_A_VECTOR)
        return max(LEAST_LANES, vectors * doubles_in_a_vector())
    if not (asked.isdecimal() and 1 <= int(asked) <= 1024):
        remedy = "Set it to a whole number from 1 to 1024, or not at all"
        raise InputError("HPCCLEAR_LANES", asked, "is not a number of lanes", remedy)
    return int(asked)


DEFAULT_LANES = default_lanes()  # lanes of an ensemble in this process; root's are everybody's
PERTURBATION = 1e-10  # relative size of the perturbations to the start of a sample's copies

PERTURBATIONS = (0, 1, -1)
"""Signs of the perturbations to copies of a response at a tight tolerance."""

PERTURBATIONS_ALONE = (*PERTURBATIONS, 10, -10, 100, -100, 1000, -1000)
"""Perturbations of the replicas of a single response, which take lanes that would stay empty. With the larger ones chaotic
replicas separate before the average begins; none is beyond `PERTURBATION_OF_TOLERANCE`."""

PERTURBATION_OF_TOLERANCE = 0.1
"""Largest perturbation over the relative tolerance: errors of the sample's own steps are larger."""


def alone(rtol: float) -> tuple[int, ...]:
    """Perturbations of replicas of a single response: `PERTURBATIONS_ALONE`, or `PERTURBATIONS` at tight tolerances."""
    largest = max(map(abs, PERTURBATIONS_ALONE)) * PERTURBATION
    large = largest > 1.001 * PERTURBATION_OF_TOLERANCE * rtol
    return PERTURBATIONS if large else PERTURBATIONS_ALONE


STRICTER = 300.0
"""Tolerance of a sample over that of its copies, whose own errors then count for little."""

TIGHTEST = 1e-14  # tolerance of a copy at least: beyond it all is rounding

COVERAGE = 1.7
"""Stated uncertainty over the distance of the farthest copy; `analysis/uncertainty.py` measures its width and how often it
holds. Copies no stricter than the sample would add errors of their own in nearly regular motion: equally reliable
intervals were up to 12 times the error there."""

COVERAGE_ALONE = 1.25
"""The same factor for the replicas of a single response: of normal variates, one more differs from the first by more than this
times the largest difference of nine others in 4 % of cases, by more than 1.7 times that of three others in 8 %."""


class Evaluator:
    """Simulates points of one scene as a stream: submit some, advance, submit more while others run.

    All submitted values share names and paths of the `columns`. `lanes`: samples of a batch; those of `recorder` replace its
    own. `perturbations`, in units of `PERTURBATION`: of replicas at a tighter tolerance that run beside each sample and give
    its `objective` a half-width, as `alone` gives those of a single response. Raises InputError if the scene requires what
    the kernel cannot do.
    """

    def __init__(
        self, scene: Scene, columns: Points, lanes: int = DEFAULT_LANES, perturbations: Sequence[int] = (),
        objective: Objective = MEAN_GAP, recorder: Lanes | None = None,
    ) -> None:  # fmt: skip
        self.scene = scene
        self.lanes = lanes
        self._columns = columns
        self._perturbations = tuple(perturbations)
        self._copies = 1 + len(self._perturbations)
        self._objective = objective
        self._problem = problem = problem_of(scene)
        moves = problem.coordinates > 0
        self._lanes = (recorder or Lanes(problem, lanes)) if moves else PrescribedSamples(problem)
        self._record, self._pressed = record_of(scene), scene.effects.has_pressure
        self._asked = self._record, responses_reported(problem), scene.objective
        self._starts: dict[int, float] = {}  # energy of what runs, J
        self._values: dict[int, Array] = {}  # of what runs, for its pressures
        self._partial: dict[int, dict[int, Records]] = {}  # of samples, copies that came in

    @property
    def pending(self) -> int:
        """Samples submitted and not finished (copies count for a share)."""
        return -(-self._lanes.pending // self._copies)

    def submit(self, index: Integers, points: Array) -> None:
        """Queue samples: indices (m,), values (m, d) in the columns' order, SI."""
        made = Points(self._columns.names, points, self._columns.paths)
        par = parameters(self.scene, made)
        self.queue(index, par, start_states(self.scene, par, made), points)

    def queue(self, index: Integers, par: Array, start: Start, points: Array | None = None) -> None:
        """Queue samples by their indices (m,), kernel parameters (m, PARAMETERS), m starts, and their values (m, d) if any."""
        labels = np.asarray(index, np.int64) * self._copies
        if self._pressed and points is not None:
            for k in range(self._copies):
                self._values.update(zip((labels + k).tolist(), points, strict=True))
        if self._copies > 1:
            rtol = self.scene.numerics.rtol
            par, start, labels = with_copies(par, start, labels, rtol, self._perturbations)
        if self._problem.effects.energies and self._problem.coordinates:
            before = energy.of_starts(self.scene, par, start, self._problem.coordinates)
            self._starts.update(zip(labels.tolist(), before.tolist(), strict=True))
        self._lanes.queue(par, start, labels)

    def advance(self, seconds: float) -> Records:
        """Work for about `seconds`; return the records of what finished meanwhile."""
        self._lanes.advance(seconds)
        labels, outcome, par = self._lanes.collect()
        records = outcome_records(labels, outcome, par, *self._asked)
        if self._pressed:
            nothing = np.zeros(len(self._columns.names))
            values = [self._values.pop(label, nothing) for label in labels.tolist()]
            with_pressures(self.scene, self._columns, values, records)
        if self._starts and len(labels):
            before = np.array([self._starts.pop(label) for label in labels.tolist()])
            off = energy.errors(self.scene, par, before, outcome, self._problem.coordinates)
            valid = np.isfinite(records["objective"])
            records["energy_error"] = np.where(valid, off, np.nan)
        return records if self._copies == 1 else self._join(records)

    def _join(self, records: Records) -> Records:
        """Records of samples whose copies are all in, with the uncertainty these state."""
        done = []
        for record in records:
            sample, copy = divmod(int(record["sample"]), self._copies)
            group = self._partial.setdefault(sample, {})
            group[copy] = record
            if len(group) == self._copies:
                every = np.array([group[k] for k in range(self._copies)], self._record)
                done.append(joined(sample, every, self._objective))
                del self._partial[sample]
        return np.array(done, self._record)


class Judge:
    """A rank's worker: an evaluator whose records contain the requested objective; see `hpcclear.ranks.schedule.Worker`."""

    def __init__(self, evaluator: Worker, objective: Objective) -> None:
        self._evaluator, self._objective = evaluator, objective
        self.lanes = evaluator.lanes
        self.submit = evaluator.submit

    @property
    def pending(self) -> int:
        """Samples submitted and not finished."""
        return self._evaluator.pending

    def advance(self, seconds: float) -> Records:
        """Work for about `seconds`; records of what finished meanwhile."""
        return asked(self._evaluator.advance(seconds), self._objective)


def with_pressures(
    scene: Scene, columns: Points, values: Sequence[Array], records: Records
) -> Records:
    """Records (m,) with pressures and angles of contact at their peak forces filled in; `values`: m rows (d,) of `columns`."""
    points = np.reshape(values, (len(records), len(columns.names)))
    made = Points(columns.names, points, columns.paths)
    forces = records["peak_contact_force"]
    for name, found in widest_contact(scene, Numbers(scene, made), forces).items():
        records[name] = found
    return records


def responses_reported(problem: Problem) -> tuple[str, ...]:
    """Which of `RESPONSES` samples record: those requested, of a slider or a point only where one is followed."""
    if not problem.effects.responses:
        return ()
    follow, impacts = problem.linkage.follow, impacts_reported(problem)
    if follow and "." not in follow:
        return (*impacts, *(name for name in RESPONSES if "point" not in name))
    followed = "point" if follow else "nothing"
    names = (name for name in RESPONSES if followed in name or "acceleration" not in name)
    return (*impacts, *names)


def impacts_reported(problem: Problem) -> tuple[str, ...]:
    """Which of `IMPACTS` samples report: the force on the frame is that of rigid bodies only."""
    rigid = modes_of(problem.linkage.mechanism) == 0
    asked = IMPACTS if problem.effects.impacts else ()
    return tuple(name for name in asked if rigid or name != "rms_frame_force")


def with_copies(
    par: Array, start: Start, labels: Integers, rtol: float, perturbations: Sequence[int]
) -> tuple[Array, Start, Integers]:
    """Each sample followed by its copies: perturbed starts, and stricter tolerances."""
    sizes = np.array([0, *perturbations])
    count = len(sizes)
    strict = np.array([1.0] + len(perturbations) * [max(1.0, min(STRICTER, rtol / TIGHTEST))])
    par, start = np.repeat(par, count, axis=0), Start(np.repeat(start.rows, count, axis=0))
    Parameters(par).strictness = np.tile(strict**2, len(labels))
    # Signs alternate over the coordinates, so that the perturbation is no motion of the mechanism as a whole.
    signs = np.where(np.arange(at.MAX_COORDINATES) % 2 == 0, 1.0, -1.0)
    pattern = np.concatenate([signs, -signs])  # of coordinates, then of velocities
    start.moving *= 1.0 + PERTURBATION * np.tile(sizes, len(labels))[:, None] * pattern
    return par, start, (labels[:, None] + np.arange(count)).ravel()


def joined(sample: int, group: Records, objective: Objective = MEAN_GAP) -> Records:
    """One record from a sample (first) and its copies: its own numbers, and how far they can be trusted."""
    record = group[0].copy()
    record["sample"] = sample
    values = objective.of(group)
    # A copy that failed leaves the uncertainty unknown, and NaN says so.
    coverage = COVERAGE if len(group) == 1 + len(PERTURBATIONS) else COVERAGE_ALONE
    record["objective_uncertainty"] = coverage * np.max(np.abs(values[1:] - values[0]))
    return record


NO_RATE = -1e299  # a place whose largest rate is below this has none


def outcome_records(
    labels: Integers, outcome: Outcome, par: Array, record: np.dtype, responses: Sequence[str] = (),
    objective: Objective = MEAN_GAP,
) -> Records:  # fmt: skip
    """Outcomes (m) and parameters (m, PARAMETERS) as records of the type `record`, with what is made of the `objective`'s rate.

    Numbers of failed samples are NaN, and so are further responses unless they are among
    `responses` (as of `responses_reported`), and uncertainty and energy error until their makers fill them in.
    """
    records = unknown(len(labels), record)
    records["sample"] = labels
    records["status"] = outcome.status
    records["rhs_evaluations"] = outcome.evaluations
    valid = np.isin(records["status"], [status for status in Status if status.valid])
    known = {
        name: one.values(outcome)
        for name, one in FIELDS.items()
        if one.of and name in (record.names or ())
        if name in responses or one.when not in ("response", "impact")
    }
    if objective.rate is not None:
        largest = np.where(outcome.largest_rate > NO_RATE, outcome.largest_rate, 0.0)
        known[RATE] = objective.made_of(outcome.mean_rate, largest, outcome.revolution[:, None])
    for name, values in known.items():
        there = (valid, *map(slice, record[name].shape))
        records[name][valid] = values[there]
    latched = outcome.latched == 1.0
    records["latched"] = (latched & valid[:, None])[:, : records["latched"].shape[1]]
    flags = int(Flag.LATCHED) * latched.any(axis=1)
    deep = outcome.deepest > Parameters(par).deepest_valid  # nowhere at places without a joint
    flags += int(Flag.BEYOND_HERTZ) * deep.any(axis=1)
    flags += int(Flag.STIFF) * (outcome.stiff_steps > 0.0)
    records["flags"] = np.where(valid, flags, 0)
    return records

"""Steady means of a stream of designs: their procedures share the lanes."""

import time
from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from hpcclear.base.arrays import Array, Integers, Records
from hpcclear.base.errors import InputError
from hpcclear.base.objectives import RATE, Objective
from hpcclear.base.outcome import RESPONSES, Flag, Status, failed
from hpcclear.dynamics.evaluation import evaluator
from hpcclear.dynamics.evaluation.evaluator import DEFAULT_LANES
from hpcclear.dynamics.evaluation.steady.copies import scales
from hpcclear.dynamics.evaluation.steady.effort import Mean, Sample, Segment
from hpcclear.dynamics.evaluation.steady.ensemble import steady_mean
from hpcclear.dynamics.evaluation.steady.judging import objective
from hpcclear.dynamics.layout.views import Outcome, Start
from hpcclear.dynamics.planar.problem import linkage_of
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.problem import problem_of
from hpcclear.dynamics.setup.start import start_states
from hpcclear.dynamics.stepping.lanes import Lanes
from hpcclear.scene import Scene
from hpcclear.scene.points import Points
from hpcclear.scene.scene import record_of

TURN_SECONDS = 0.02  # how long one set of lanes works before the next one does


Procedure = Callable[[Sample], Generator[Segment, Outcome, Mean]]


@dataclass
class _Ask:
    """A design's procedure, the segment it waits for, and what of that has come in."""

    sample: int
    values: Array
    par: Array
    asking: Generator[Segment, Outcome, Mean]
    rows: dict[int, Array] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.segment = next(self.asking)

    def take(self, copy: int, row: Array) -> Mean | None:
        """A copy's outcome; the procedure's result if that was the last thing it waited for."""
        self.rows[copy] = row
        if len(self.rows) < len(self.segment.start):
            return None
        outcome = Outcome(np.stack([self.rows[k] for k in range(len(self.rows))]))
        self.rows = {}
        try:
            self.segment = self.asking.send(outcome)
        except StopIteration as end:
            return end.value
        return None


class SteadyEvaluator:
    """Finds the steady mean of points of one scene as a stream; to be used like `evaluation.evaluator.Evaluator`.

    `procedure`: what is done to each design; by default `steady_mean` to the scene's ``numerics.target_error`` with
    ``numerics.target_revolutions``. Raises InputError if the scene requires what the kernel cannot do.
    """

    def __init__(
        self, scene: Scene, columns: Points, lanes: int = DEFAULT_LANES, procedure: Procedure | None = None
    ) -> None:  # fmt: skip
        if linkage_of(scene).mechanism.clocked:
            raise InputError(
                "numerics.target_error", scene.numerics.target_error,
                "a load or drive goes by the time since the start, so there is no steady mean",
                "Leave it out, and average the revolutions of interest (numerics.averaged_revolutions)",
            )  # fmt: skip
        target, budget = scene.numerics.target_error or 0.0, scene.numerics.target_revolutions
        self._procedure = procedure or (lambda sample: steady_mean(sample, target, budget))
        self.scene = scene
        self.lanes = lanes
        self._columns = columns
        self._plain = scene.with_({"numerics.target_error": None})
        self._sets: dict[tuple[float, int], Lanes] = {}
        self._asks: dict[int, _Ask] = {}
        contact = scene.effects.contact
        self._latched = contact is not None and contact.latched
        problem = self._lanes_of(1e-4, 1).problem  # refuses what cannot be simulated
        self._free = problem.effects.torque is not None
        self._responses = evaluator.responses_reported(problem)
        self._record = record_of(scene, mapped=procedure is not None)

    def _lanes_of(self, rtol: float, revolutions: int) -> Lanes:
        """The lanes for segments of this kind."""
        if (rtol, revolutions) not in self._sets:
            changes = {
                "numerics.rtol": rtol,
                "numerics.atol": None,
                "numerics.transient_revolutions": 0,
                "numerics.averaged_revolutions": revolutions,
                "numerics.energy": False,
            }
            problem = problem_of(self._plain.with_(changes))
            self._sets[rtol, revolutions] = Lanes(problem, self.lanes)
        return self._sets[rtol, revolutions]

    @property
    def pending(self) -> int:
        """Designs submitted and not finished."""
        return len(self._asks)

    def submit(self, index: Integers, points: Array) -> None:
        """Queue designs: indices (m,), values (m, d) in the columns' order, SI."""
        made = Points(self._columns.names, points, self._columns.paths)
        par = parameters(self.scene, made)
        start = start_states(self.scene, par, made)
        numbers = np.asarray(index, np.int64).tolist()
        for k, sample in enumerate(numbers):
            own = slice(k, k + 1)
            scale = scales(self.scene, par[k])
            design = Sample(par[own], start[own], scale, self._latched, self._free)
            self._asks[sample] = _Ask(sample, points[k], design.par, self._procedure(design))
        self._queue([self._asks[sample] for sample in numbers])

    def _queue(self, asks: "list[_Ask]") -> None:
        """Hand the segments that procedures request to the lanes."""
        by_kind: dict[tuple[float, int], list[_Ask]] = {}
        for ask in asks:
            by_kind.setdefault((ask.segment.rtol, ask.segment.revolutions), []).append(ask)
        for kind, group in by_kind.items():
            par = np.concatenate([ask.segment.par for ask in group])
            start = Start(np.concatenate([ask.segment.start.rows for ask in group]))
            copies = [np.arange(len(ask.segment.start)) for ask in group]
            labels = [_MOST_COPIES * ask.sample + k for ask, k in zip(group, copies, strict=True)]
            self._lanes_of(*kind).queue(par, start, np.concatenate(labels))

    def advance(self, seconds: float) -> Records:
        """Work for about `seconds`; return the records of the designs that finished meanwhile."""
        end = time.perf_counter() + seconds
        done: list[Records] = []
        if not self._asks:
            self._lanes_of(1e-4, 1).step(1)  # without samples it only compiles
        while self._asks:
            for lanes in [lanes for lanes in self._sets.values() if lanes.pending]:
                lanes.advance(min(seconds, TURN_SECONDS))
                done += self._collect(lanes)
            if time.perf_counter() >= end:
                break
        return np.concatenate(done) if done else np.zeros(0, self._record)

    def _collect(self, lanes: Lanes) -> Iterator[Records]:
        """Take in what finished; procedures that have all they waited for go on or end."""
        labels, outcome, _ = lanes.collect()
        going = []
        for label, row in zip(labels.tolist(), outcome.rows, strict=True):
            sample, copy = divmod(label, _MOST_COPIES)
            ask = self._asks[sample]
            mean = ask.take(copy, row)
            if mean is not None:
                del self._asks[sample]
                about = self._record, self._responses, self.scene.objective
                record = summed_up(sample, ask.par, mean, *about)
                yield evaluator.with_pressures(self.scene, self._columns, [ask.values], record)
            elif not ask.rows:  # it requests another segment
                going.append(ask)
        self._queue(going)


_MOST_COPIES = 1 << 20


_PEAKS = {"peak_contact_force", "peak_crank_moment", "peak_point_acceleration"}
_AVERAGED = {*RESPONSES, *_PEAKS, "sliding_work", "sliding_waves"}


def summed_up(
    sample: int, par: Array, mean: Mean, kind: np.dtype, responses: Sequence[str], judged: Objective
) -> Records:
    """What was found as a record (1,): means over segments and copies, of the peaks too unless the motion is regular.

    `par` (1, PARAMETERS); `kind`: type of the record (`hpcclear.scene.scene.record_of`); `responses`: as of
    `responses_reported`.
    """
    rows = mean.outcomes.rows.reshape(-1, Outcome.size)
    if mean.status != Status.OK:
        return failed(sample, mean.status, int(mean.evaluations), kind)
    labels, each_par = np.zeros(len(rows), np.int64), np.repeat(par, len(rows), axis=0)
    each = evaluator.outcome_records(labels, Outcome(rows), each_par, kind, responses, judged)
    record = each[:1].copy()
    for name in _AVERAGED & {*(kind.names or ())}:
        record[name] = each[name].mean(axis=0)
    if judged.rate is not None:
        power = 2.0 if judged.made == "rms" else 1.0
        record[RATE] = (each[RATE] ** power).mean(axis=0) ** (1.0 / power)
        if judged.made == "peak":
            record[RATE] = each[RATE].max(axis=0)
    if mean.segment == 1:
        for name in _PEAKS & {*(kind.names or ())}:
            record[name] = each[name].max(axis=0)
    record["sample"] = sample
    record["mean_gap"] = mean.gaps[: kind["mean_gap"].shape[0]]
    record["objective"] = objective(mean.gaps)
    record["objective_spread"] = np.std(objective(mean.outcomes.mean_gap), ddof=1)
    record["objective_limit"] = record["objective_uncertainty"] = mean.limit
    record["regime"] = mean.regime
    record["period"] = np.nan if mean.period is None else mean.period
    record["lyapunov_exponent"] = mean.growth
    if "attractors" in (kind.names or ()):
        record["lyapunov_exponent_limit"] = mean.growth_limit
        record["attractors"] = np.nan if mean.attractors is None else mean.attractors
    record["steady_rtol"] = mean.tightest
    record["steady_revolutions"] = mean.revolutions
    # now and then a revolution is, by chance
    record["latched"] = each["latched"].mean(axis=0) > 0.5
    record["rhs_evaluations"] = int(mean.evaluations)
    flags = np.bitwise_or.reduce(each["flags"])
    record["flags"] = flags | (0 if mean.met else int(Flag.TARGET_MISSED))
    return record

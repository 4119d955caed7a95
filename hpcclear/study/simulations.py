"""The true function of a study: designs to objectives, through the dynamics at all load cases, on all ranks."""

from collections.abc import Sequence

import numpy as np

from hpcclear.base.arrays import Array, Records
from hpcclear.base.errors import InputError
from hpcclear.base.outcome import Status
from hpcclear.ensemble.session import sample_points
from hpcclear.ranks.progress import Progress
from hpcclear.ranks.team import Ranks
from hpcclear.ranks.terminal import Style
from hpcclear.results.checkpoint import Checkpoint
from hpcclear.scene import Scene
from hpcclear.scene.domain import to_physical
from hpcclear.scene.points import Points, check_points
from hpcclear.scene.variables import StudyVariable


def loads_of(scene: Scene) -> int:
    """How many load cases each design is simulated at."""
    loads = scene.required_study.load_cases
    return 1 if loads is None else len(loads.options or ())


def at_all(loads: StudyVariable, points: Points) -> Points:
    """Designs (n, d) at all load cases, (n * cases, d), those of a design one behind the other."""
    options = np.array(loads.options)
    values = np.repeat(points.values, len(options), axis=0)
    values[:, points.names.index(loads.name)] = np.tile(options, len(points))
    return Points(points.names, values, points.paths)


def combined(records: Records, responses: Array, loads: StudyVariable) -> tuple[Records, Array]:
    """A record for each design, (n,), of those at its load cases, (n * cases,), and its responses, (k, n), of theirs.

    Each response is the largest or the weighted mean of the load cases; the record is that with the largest objective, whose
    place is taken by what is made of them. A design that failed at one of them counts as failed.
    """
    cases = len(loads.options or ())
    table, each = records.reshape(-1, cases), responses.reshape(len(responses), -1, cases)
    failed = table["status"] != Status.OK
    values = np.where(failed | np.isnan(each[0]), np.inf, each[0])
    found: Records = table[np.arange(len(table)), values.argmax(axis=1)].copy()
    if loads.over == "worst":
        made = each.max(axis=2)
    else:
        weights = np.array(loads.over, dtype=float)
        made = each @ (weights / weights.sum())
    made = np.where(failed.any(axis=1), np.nan, made)
    found["objective"] = np.where(failed.any(axis=1), found["objective"], made[0])
    found["flags"] = np.bitwise_or.reduce(table["flags"], axis=1)
    found["rhs_evaluations"] = table["rhs_evaluations"].sum(axis=1)
    return found, made


SHOWN = {"pairs": "runs at two tolerances", "chaos": "perturbed runs"}
"""Names of stages on the progress display, where the stage has another one."""

SPARED = ("search", "pairs", "chaos", "worst")
"""Stages that all simulations may fail of: the first then looks elsewhere, the others leave a number unknown."""


class Simulations:
    """Simulates batches of designs of a scene with a study, numbered one after the other through the whole study.

    What an earlier run of the same command finished is taken from the checkpoint, whose names are the study variables.
    `style`: how progress is shown; `next`: number of the next sample. A stage that is not done again sets it to where it had
    ended.
    """

    def __init__(
        self, scene: Scene, ranks: Ranks, checkpoint: Checkpoint, style: Style = "auto"
    ) -> None:
        self.scene, self.style, self.next = scene, style, 0
        self._ranks, self._checkpoint = ranks, checkpoint
        self._variables = scene.required_study.variables

    def designs(self, names: Sequence[str], coordinates: Array) -> Points:
        """Designs in all study variables from sampling coordinates (n, d), in which an inertia may be a ratio
        (`hpcclear.scene.domain`); those not named stay as in the scene.

        Raises InputError if a design makes no mechanism, or a variable that is not named drives entries that differ in the
        scene.
        """
        return self.filled(names, to_physical(self.scene, names, coordinates))

    def filled(self, names: Sequence[str], values: Array, checked: bool = False) -> Points:
        """The same from values in SI, shape (n, d); the other variables as in the scene. `checked`: values known to make
        mechanisms. Raises InputError if a variable that is left out drives entries that differ in the scene."""
        columns = []
        for variable in self._variables:
            if variable.name in names:
                columns.append(values[:, list(names).index(variable.name)])
                continue
            numbers = {self.scene.number(path) for path in variable.paths}
            if len(numbers) > 1:
                key = f"study.variables.{variable.name}"
                reason = "a model leaves it out, but the entries that it drives differ in the scene"
                remedy = "Make these entries equal, or give each a variable of its own"
                raise InputError(key, sorted(numbers), reason, remedy)
            columns.append(np.full(len(values), self.scene.baseline(variable.name)))
        every, paths = zip(*((one.name, one.paths) for one in self._variables), strict=True)
        points = Points(every, np.column_stack(columns), paths)
        if not checked:
            check_points(self.scene, points)
        return points

    def records(self, points: Points, stage: str) -> np.ndarray:
        """Outcome records of designs in all study variables, in their order; of load cases that which counts. Raises
        InputError if every single simulation failed."""
        return self.judged(points, stage)[0]

    def judged(self, points: Points, stage: str) -> tuple[np.ndarray, Array]:
        """The same, and the responses of the study: its objective and `Study.further`, (k, n), NaN where it failed."""
        loads = self.scene.required_study.load_cases
        records = self._records(at_all(loads, points) if loads else points, stage)
        responses = self._responses(records)
        return combined(records, responses, loads) if loads else (records, responses)

    def _responses(self, records: np.ndarray) -> Array:
        further = [self.scene.objective_named(name) for name in self.scene.required_study.further]
        fine = records["status"] == Status.OK
        found = [np.where(fine, one.of(records), np.nan) for one in further]
        return np.stack([self.objective(records), *found])

    def met(self) -> tuple[Array, Array]:
        """All designs so far, (n, d) in the study's variables, SI, and their responses, (k, n)."""
        self._checkpoint.flush()
        records, values = self._checkpoint.contents()
        before = records["sample"] < self.next
        records, values = records[before], values[before]
        loads, found = self.scene.required_study.load_cases, self._responses(records)
        if loads is not None:
            found = combined(records, found, loads)[1]
            values = values[:: loads_of(self.scene)]
        return values, found

    def _records(self, points: Points, stage: str) -> np.ndarray:
        style = self.style if len(points) >= 1000 else "quiet"
        progress = Progress(SHOWN.get(stage.partition("-")[0], stage), style=style)
        where = self._ranks, self._checkpoint, progress
        name = f"{stage}: simulations"
        records = sample_points(self.scene, points, *where, stage=name, first=self.next)
        with self._ranks.writing():  # a long fit may follow
            self._checkpoint.flush_when_due()
        self.next += len(points)
        failed = len(records) > 0 and not (records["status"] == Status.OK).any()
        if failed and stage not in SPARED:
            codes, counts = np.unique(records["status"], return_counts=True)
            worst = Status(int(codes[counts.argmax()]))
            reason = f"all of these simulations failed, most often because {worst.message}"
            raise InputError(stage, len(records), reason, worst.remedy)
        return records

    def objective(self, records: np.ndarray) -> Array:
        """The study's objective in records, NaN where the simulation failed."""
        return np.where(records["status"] == Status.OK, records["objective"], np.nan)

    def values(self, names: Sequence[str], coordinates: Array, stage: str) -> Array:
        """Objectives of designs in sampling coordinates, shape (n,), NaN where failed."""
        return self.objective(self.records(self.designs(names, coordinates), stage))

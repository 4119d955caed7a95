"""Error against core-hours, measured on some of the samples: what `accuracy --plan` knows."""

import os
import pickle
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from hpcclear.accuracy.parallel import process_age_at_start
from hpcclear.base import host, isolated, markup
from hpcclear.base.arrays import Records
from hpcclear.base.errors import InputError
from hpcclear.base.objectives import MEAN_GAP
from hpcclear.base.plain import counted
from hpcclear.dynamics.evaluation.evaluator import DEFAULT_LANES, Evaluator
from hpcclear.dynamics.evaluation.steady import wording
from hpcclear.ensemble.session import design, sample_points
from hpcclear.ranks.boundary import alone
from hpcclear.ranks.progress import Progress, duration
from hpcclear.ranks.schedule import COLUMNS
from hpcclear.ranks.team import Ranks
from hpcclear.ranks.terminal import Style
from hpcclear.scene import Scene, load_scene
from hpcclear.scene.points import Points
from hpcclear.scene.scene import record_of
from hpcclear.study import forecast, lives, stages

TARGETS = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4)
"""Errors of the ladder."""

PROBE = 2 * DEFAULT_LANES
"""Samples of the first look at what one costs."""

STEADY_PROBE = 8
"""Likewise where each is a steady mean: its copies fill the lanes."""

FILE_SECONDS, LEVEL_SECONDS = 4.0, 1.0
"""How long the settings of the file, and each target error, are measured on every rank."""

LARGEST_DESIGN = 4096
"""Points of the design that are drawn for measuring: the cost of a sample depends on where it lies."""

USUAL_STARTUP, USUAL_MEMORY = 3.0, 400.0 * 2**20
"""Seconds and bytes of a rank that are assumed where the system does not say, as outside Linux."""

EFFICIENCY = 0.95
"""Of ranks that share out samples: the rest is waiting at the end."""


@dataclass(frozen=True)
class Row:
    """One line of the plan."""

    error: float | None
    """Target error of f; None: the settings of the file."""
    scene: Scene
    """With the settings."""
    seconds: float
    """Core-seconds of one sample."""
    reached: str
    """Half-widths that the measured samples reached; empty without a target error in the file."""
    spread: float = np.nan
    """95 % half-width of `seconds`, relative, from the differences between designs; NaN if unknown.

    The load of other programs adds to it.
    """

    def settings(self) -> str:
        """Tolerance and revolutions in words; of a steady mean its half-width and the share of designs that meet the error."""
        n = self.scene.numerics
        if self.reached:
            return ", ".join(self.reached.split(", ")[:2])
        return f"rtol {n.rtol:.1e}, {n.transient_revolutions}+{n.averaged_revolutions} rev"


@dataclass(frozen=True)
class Plan:
    """What was measured."""

    rows: tuple[Row, ...]
    """The file's own settings first, then the ladder."""
    samples: int
    """Simulations of `sample`."""
    study: int | None
    """Simulations of `run`, unless surrogates are refused, which takes more; None if the study has no case."""
    startup: float
    """Seconds each rank needs before it simulates."""
    memory: float
    """Bytes a rank."""
    columns: int
    """Study variables."""
    responses: int = 0
    """Single responses of `run`, which rank 0 simulates alone."""
    workers: int = 1
    """Ranks planned for."""
    first: bool = False
    """Whether this is the first look, from a few samples on a quiet machine."""

    @property
    def simulations(self) -> int:
        """Of the command that is planned."""
        return self.samples if self.study is None else self.study

    def core_seconds(self, row: Row, simulations: int, ranks: int) -> float:
        """Core-seconds of a job, start-up on every rank included."""
        return simulations * row.seconds + ranks * self.startup

    def wall_seconds(self, row: Row, simulations: int, ranks: int) -> float:
        """Wall time of a job."""
        used = ranks * EFFICIENCY if ranks > 1 else 1.0
        return simulations * row.seconds / used + self.startup

    def _repr_html_(self) -> str:
        """What a notebook shows: each error with its settings and cost, on as many ranks as were planned for."""
        count, rows = self.simulations, []
        for row in self.rows:
            error = "as in the scene" if row.error is None else f"{row.error:g}"
            spent = (self.core_seconds, self.wall_seconds)
            times = (duration(one(row, count, self.workers)) for one in spent)
            rows.append((error, row.settings(), f"{1e3 * row.seconds:.3g}", *times))
        header = ("target error", "settings", "ms per sample", "core time", "wall time")
        title = f"{count} simulations on {counted(self.workers, 'rank')}"
        return markup.table(title, rows, header)

    def disk(self, simulations: int) -> float:
        """Bytes of the samples and of the checkpoint that stands beside them meanwhile."""
        return 2.0 * simulations * (record_of(self.rows[0].scene).itemsize + 8 * self.columns)


def measure(
    scene: Scene,
    ranks: Ranks,
    errors: tuple[float, ...] = TARGETS,
    workers: int = 1,
    notify: Callable[[str], object] = lambda text: None,
    show: Callable[["Plan"], object] = lambda plan: None,
    progress_style: Style = "quiet",
) -> Plan:
    """Measure what samples cost at the settings of the file and at those chosen for each target error; on root.

    `workers`: ranks planned for: a lone process keeps as many cores busy beside it, since cores that share caches and clock
    are slower together. `notify` gets what is measured, line by line, as it begins; `show` a first look at once, and the plan
    as far as it is measured after each of its rows but the last. Raises InputError if the scene has no study.
    """
    study = scene.study
    few = scene
    if study is not None and study.samples > LARGEST_DESIGN:
        few = scene.with_({"study.samples": LARGEST_DESIGN})
    points = design(few, None)
    assert study is not None  # refused by `design`
    if scene.objective.name != MEAN_GAP.name or scene.numerics.objective_joints:
        errors = ()  # which steady means of the mean gap have
    wanted = [(None, scene), *((e, scene.with_({"numerics.target_error": e})) for e in errors)]
    rows: list[Row] = []
    whole: int | None = None
    single = stages.responses_of(scene) if study.cases else 0

    def made() -> Plan:
        peak, startup = host.peak_memory(), process_age_at_start()
        if not np.isfinite([peak, startup]).all():
            peak, startup = USUAL_MEMORY, USUAL_STARTUP
        columns = len(study.variables)
        return Plan(tuple(rows), study.samples, whole, startup, peak, columns, single, workers)

    if not np.isfinite([host.peak_memory(), process_age_at_start()]).all():
        usual = f"{USUAL_STARTUP:g} s and {USUAL_MEMORY / 2**20:g} MB a rank are assumed"
        notify(f"start-up and memory are not measured on this system; {usual}")
    seconds, first = _busy(scene, points, ranks, _block(scene) * ranks.size, "plan: first look")
    rows.append(Row(None, scene, seconds, "", _spread(first)))
    if study.cases:
        pilot = partial(sample_points, scene, ranks=ranks, stage="plan: pilot")
        whole, _ = forecast.expected(scene, pilot, seconds)
    show(replace(made(), first=True))
    rows.clear()
    with _company(scene, points, workers if ranks.size == 1 else 1, notify):
        for k, (error, one) in enumerate(wanted):
            limit, setting = FILE_SECONDS, "the settings of the file"
            if error is not None:
                limit, setting = LEVEL_SECONDS, f"a target error of {error:g}"
            notify(f"measuring {k + 1} of {len(wanted)}: {setting}")
            seconds, records = cost(one, points, ranks, limit, str(k), progress_style)
            rows.append(Row(error, one, seconds, wording.in_short(one, records), _spread(records)))
            if k + 1 < len(wanted):
                show(made())
    return made()


def cost(
    scene: Scene, points: Points, ranks: Ranks, seconds: float, label: str, style: Style = "quiet"
) -> tuple[float, Records]:
    """Core-seconds of one sample in a long batch, measured for about `seconds` on every rank; and the samples."""

    steady = scene.numerics.target_error is not None
    block = (STEADY_PROBE if steady else DEFAULT_LANES) * ranks.size
    first = _block(scene) * ranks.size
    once, found = _busy(scene, points, ranks, first, f"plan {label}: probe", style)
    if steady and once * block > seconds * ranks.size:
        return once, found
    count = block * int(np.clip(seconds * ranks.size / (once * block), 2, 2000))
    return _busy(scene, points, ranks, count, f"plan {label}", style)


def _spread(records: Records) -> float:
    """Relative 95 % half-width of the mean cost of these samples, by their force evaluations."""
    _, once = np.unique(records["sample"], return_index=True)
    spent = records["rhs_evaluations"][once].astype(float)
    if len(spent) < 2 or spent.mean() == 0.0:
        return np.nan
    return float(1.96 * spent.std(ddof=1) / spent.mean() / np.sqrt(len(spent)))


def _block(scene: Scene) -> int:
    """Samples of a first look on each rank."""
    return PROBE if scene.numerics.target_error is None else STEADY_PROBE


def _busy(
    scene: Scene, points: Points, ranks: Ranks, count: int, stage: str, style: Style = "quiet"
) -> tuple[float, Records]:
    """Core-seconds of one sample of so many, spread over the design; and the samples."""
    spread = np.linspace(0, len(points), count, endpoint=False).astype(int)
    rows = spread if count <= len(points) else np.arange(count) % len(points)
    progress = Progress("plan", style)
    records = sample_points(scene, points.take(rows), ranks, progress=progress, stage=stage)
    spent = float(ranks.stage_seconds[stage][:, COLUMNS.index("busy")].sum())
    return spent / count, records


@contextmanager
def _company(
    scene: Scene, points: Points, workers: int, notify: Callable[[str], object] = lambda text: None
) -> Iterator[None]:
    """Keep other cores busy with the same work, as the ranks of the job will."""
    others = max(min(workers, len(host.cores())) - 1, 0)
    content = {k: v for k, v in scene.resolved().items() if k != "study"}
    if others:
        why = "to measure on cores that are as busy as those of the job"
        notify(f"starting {others} more processes, {why}")
    with tempfile.NamedTemporaryFile() as work, ExitStack() as stack:
        work.write(pickle.dumps((content, points)))
        work.flush()
        words = isolated.python("hpcclear.accuracy.plan:keep_busy", work.name)
        start = partial(subprocess.Popen, words, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        for process in [stack.enter_context(start()) for _ in range(others)]:
            if process.stdout is not None:
                process.stdout.readline()  # it has begun, or has ended
        yield


def keep_busy(work: str) -> None:
    """Simulate points over and over, until nobody can write to the standard input; `work`: file of scene and points."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C ends the process that started this one
    content, points = pickle.loads(Path(work).read_bytes())
    threading.Thread(target=_end_with_input, daemon=True).start()
    scene = load_scene(content, trust=True).with_({"numerics.target_error": None})
    evaluator = Evaluator(scene, points)
    evaluator.advance(0.0)
    sys.stdout.write("busy\n")
    sys.stdout.flush()
    while True:
        if evaluator.pending < 2 * DEFAULT_LANES:
            evaluator.submit(np.arange(len(points)), points.values)
        evaluator.advance(0.2)


def _end_with_input() -> None:
    """End this process as soon as nobody can write to it any more."""
    sys.stdin.buffer.read()
    os._exit(0)


def ladder(scene: Scene, error: float | None) -> tuple[float, ...]:
    """Errors to measure: `TARGETS`, and the requested one; none for service lives, which have replicas of their own.

    Raises InputError: service lives cannot be simulated, or an error was requested that they do not use.
    """
    lives.check(scene)
    study = scene.study
    if study is None or not study.worn:
        return TARGETS if error is None else tuple(sorted({*TARGETS, error}, reverse=True))
    if error is not None:
        reason = "service lives are simulated at the settings of the file"
        remedy = "Leave it out, and set wear.tolerance and wear.copies"
        raise InputError("--error", error, reason, remedy)
    return ()


def plan(scene: Scene, error: float | None = None, ranks: int = 1) -> Plan:
    """Estimate core-hours and wall time of a study from a few measured samples, in this process.

    Parameters
    ----------
    scene : Scene
        With a study.
    error : float, optional
        Target error of the objective, relative, in addition to those of the ladder.
    ranks : int
        Ranks to plan for.

    Returns
    -------
    Plan
        A notebook shows it as a table.

    Raises
    ------
    InputError
        The scene has no study.
    """
    return measure(scene, alone(), ladder(scene, error), ranks)

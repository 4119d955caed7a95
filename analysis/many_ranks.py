"""What root spends on many real ranks, against the costs that `scaling.py` models with; and memory of root by records.

    python analysis/many_ranks.py            # 64 ranks on this machine, ten minutes; up to 1e7 records
    python analysis/many_ranks.py --quick    # 16 ranks, up to 1e5 records, two minutes

No kernel: a rank's samples take as long as they would, asleep, so that as many ranks fit on few cores as sleep there.
Root's seconds are those of its own thread, so that others on its core do not count. A line is fitted to what messages took
with 8 ranks against how many samples came and went with each; it says what those of 64 ranks should have taken together,
and that is set against what they took. So are samples written by root. With 2 ranks a message takes a quarter more: root
sleeps between them, and finds its caches cold.

Then samples that root makes at once, so that only what is done with them counts: `sample`, which keeps them all, and
`sample --statistics --raw`, which writes them as they come, with memory of root and time to write.
"""

import argparse
import functools
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

MILLISECONDS = 3.3  # a sample takes, asleep
SECONDS = 20.0  # of the trial
FITTED = 8  # ranks that the line is fitted to


# ---- on the ranks ----------------------------------------------------------------------------------


class Asleep:
    """Made-up outcomes, so many a second; 0: at once."""

    lanes = 32

    def __init__(self, rate: float) -> None:
        self._rate = rate
        self._queue: list[np.ndarray] = []

    @property
    def pending(self) -> int:
        """Samples submitted and not finished."""
        return sum(map(len, self._queue))

    def submit(self, index: np.ndarray, points: np.ndarray) -> None:
        """Queue samples."""
        self._queue.append(index)

    def advance(self, seconds: float) -> np.ndarray:
        """Records of what would have finished in these seconds."""
        from hpcclear.base.outcome import OUTCOME

        if not self._queue:
            return np.zeros(0, OUTCOME)
        index = self._queue.pop(0)
        most = max(int(self._rate * seconds), 1) if self._rate else 4096
        if len(index) > most:
            self._queue.insert(0, index[most:])
            index = index[:most]
        if self._rate:
            time.sleep(len(index) / self._rate)
        records = np.zeros(len(index), OUTCOME)
        records["sample"] = index
        records["objective"] = 3e-4 + 1e-9 * (index % 1013)
        for name in OUTCOME.names or ():
            if OUTCOME[name].base.kind == "f" and name != "objective":
                records[name] = np.nan
        records["mean_gap"] = records["objective"][:, None]
        return records


def make_asleep(payload: Any, ranks: Any) -> Asleep:
    """The maker of every rank's worker, by a name that pickle finds."""
    return Asleep(float(os.environ["RATE"]))


class Books:
    """What root spends on messages of ranks about samples, and on writing: seconds of its thread."""

    def __init__(self) -> None:
        self.messages: list[tuple[float, int, int]] = []  # seconds, records, samples handed out
        self.written: list[tuple[float, int]] = []  # seconds, records
        self._waited = self._apart = 0.0
        self._handed = 0

    def open(self) -> None:
        """Watch from now on."""
        from hpcclear.ensemble.statistics import _Streaming
        from hpcclear.ranks.leading import Lead
        from hpcclear.ranks.mailbox import Mail
        from hpcclear.ranks.schedule import HandOut
        from hpcclear.results.checkpoint import Checkpoint

        self._wrap(Mail, "poll", self._polled)
        self._wrap(HandOut, "grant", self._granted)
        self._wrap(Lead, "_answer", self._answered)
        self._wrap(_Streaming, "_keep", self._wrote)
        self._wrap(Checkpoint, "save_stage", self._wrote)

    def _wrap(self, owner: Any, name: str, note: Callable[..., None]) -> None:
        function = getattr(owner, name)

        @functools.wraps(function)
        def timed(*arguments: Any, **options: Any) -> Any:
            began = time.thread_time()
            result = function(*arguments, **options)
            note(time.thread_time() - began, result, *arguments[1:])
            return result

        setattr(owner, name, timed)

    def _polled(self, seconds: float, message: Any) -> None:
        self._apart, self._handed, self._waited = 0.0, 0, seconds

    def _granted(self, seconds: float, granted: Any, need: Any) -> None:
        self._handed += len(granted[0])

    def _answered(self, seconds: float, result: None, message: Any) -> None:
        body = message.body[0] if isinstance(message.body, tuple) else message.body
        records = 0 if body is None else len(body)
        self.messages.append((self._waited + seconds - self._apart, records, self._handed))

    def _wrote(self, seconds: float, result: None, what: object, records: Any) -> None:
        self._apart += seconds
        if isinstance(records, np.ndarray):
            self.written.append((seconds, len(records)))


def inside(task: str, samples: int) -> int:
    """One rank of a trial; root prints a line about itself."""
    from hpcclear.ensemble import session as plain, simulate, statistics
    from hpcclear.ensemble.session import Options
    from hpcclear.ranks.boundary import run_on_ranks
    from hpcclear.ranks.team import Ranks
    from hpcclear.scene import load_scene

    statistics.make_evaluator = simulate.make_evaluator = make_asleep
    books = Books()
    if task == "costs":
        books.open()

    def program(ranks: Ranks) -> None:
        job = Path(__file__).parents[1] / "jobs" / "quickstart.toml"
        scene = load_scene(job, ['study.method="monte-carlo"', f"study.samples={samples}"])
        folder, options = Path(os.environ["FOLDER"]), Options(style="quiet")
        began = time.perf_counter()
        if task == "sample":
            plain.run_sample(scene, folder / "samples.nc", ranks, options=options)
        else:
            raw = folder / "raw"
            statistics.run_statistics(scene, folder / "out.nc", ranks, raw=raw, options=options)
        line = {"seconds": time.perf_counter() - began}
        line["memory"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
        print(json.dumps(line | {"messages": books.messages, "written": books.written}), flush=True)

    return run_on_ranks(program)


# ---- outside ----------------------------------------------------------------------------------------


def launch(task: str, ranks: int, samples: int, folder: Path, rate: float) -> dict[str, Any]:
    """A trial on so many ranks: what root said."""
    mpiexec = Path(sys.executable).parent / "mpiexec"
    environment = os.environ | {
        "PYTHONPATH": str(Path(__file__).parents[1]),
        "RATE": str(rate),
        "FOLDER": str(folder),
    }
    command = [str(mpiexec), "-n", str(ranks), sys.executable, __file__, "--inside", task]
    done = subprocess.run(
        [*command, str(samples)], capture_output=True, text=True, check=False, env=environment
    )
    if done.returncode:
        raise SystemExit(done.stdout + done.stderr)
    line = next(line for line in done.stdout.splitlines() if line.startswith("{"))
    found: dict[str, Any] = json.loads(line)
    return found


class Line(NamedTuple):
    """What root spends on a message: so much, and so much for each sample that comes or goes with it; and on writing one."""

    message: float
    sample: float
    written: float


def trial(ranks: int, rate: float, seconds: float) -> dict[str, Any]:
    """What root spent while so many ranks made `rate` samples a second each."""
    with tempfile.TemporaryDirectory() as folder:
        samples = round(seconds * rate * ranks) + 4096
        return launch("costs", ranks, samples, Path(folder), rate)


def fitted(seconds: float = SECONDS) -> Line:
    """The line of `FITTED` ranks, from short and long samples: least squares without the longest tenth of the messages."""
    trials = [trial(FITTED, rate, seconds) for rate in (100.0, 1e3 / MILLISECONDS, 3000.0)]
    rows = np.array([row for one in trials for row in one["messages"]])
    size = 0.5 * (rows[:, 1] + rows[:, 2])
    kept = np.full(len(rows), True)
    for _ in range(3):
        matrix = np.column_stack([np.ones(len(rows)), size])
        weight = 1.0 / (1.0 + size / 100.0)
        line = np.linalg.lstsq(
            (matrix * weight[:, None])[kept], (rows[:, 0] * weight)[kept], rcond=None
        )[0]
        excess = rows[:, 0] / (matrix @ line)
        kept = excess < np.quantile(excess, 0.9)
    written = np.array([row for one in trials for row in one["written"]])
    return Line(*line, written=float(np.median(written[:, 0] / written[:, 1])))


def confirmed(line: Line, ranks: int) -> str:
    """What root spent with many ranks, against the line."""
    found = trial(ranks, 1e3 / MILLISECONDS, SECONDS)
    rows, written = np.array(found["messages"]), np.array(found["written"])
    expected = line.message * len(rows) + line.sample * 0.5 * (rows[:, 1] + rows[:, 2]).sum()
    spent = rows[:, 0].sum()
    files = float(np.median(written[:, 0] / written[:, 1]))
    return "\n".join(
        [
            f"{FITTED} ranks: {line.message * 1e6:.3g} us a message, {line.sample * 1e6:.3g} us a sample handed out and taken, "
            f"{line.written * 1e6:.3g} us one written",
            f"{ranks} ranks, {found['seconds']:.0f} s: {len(rows)} messages, {rows[:, 1].sum():.0f} records of others",
            f"  messages: {expected:.3f} s expected, {spent:.3f} s spent: ratio {spent / expected:.2f}",
            f"  written:  {files * 1e6:.3g} us a record: ratio {files / line.written:.2f}",
        ]
    )


def memory(counts: list[int]) -> str:
    """Memory of root and seconds to write by records."""
    lines = [f"{'records':>9} {'':<18}{'root MB':>9}{'run s':>8}{'on disk MB':>12}"]
    for task, words, most in (("sample", "sample", 10**6), ("raw", "--statistics --raw", 10**7)):
        for samples in counts:
            if samples > most:
                continue
            with tempfile.TemporaryDirectory() as place:
                found = launch(task, 1, samples, Path(place), 0.0)
                size = sum(file.stat().st_size for file in Path(place).rglob("*.nc")) / 1e6
                lines.append(
                    f"{samples:>9.0e} {words:<18}{found['memory']:>9.0f}{found['seconds']:>8.1f}{size:>12.0f}"
                )
    return "\n".join(lines)


def main() -> int:
    """Trials and tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--memory", action="store_true", help="memory alone")
    parser.add_argument("--inside", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.inside:
        return inside(options.inside[0], int(options.inside[1]))
    if not options.memory:
        print(confirmed(fitted(), 16 if options.quick else 64), end="\n\n", flush=True)
    print(memory([10**k for k in range(4, 6 if options.quick else 8)]))
    return 0


if __name__ == "__main__":
    sys.exit(main())

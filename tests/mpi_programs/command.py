"""The real command, watched or sabotaged: command.py ARGUMENTS OF hpcclear; settings in the environment.

TEST_LOG    file that gets a line for all that matters to finished samples, see `note`
TEST_BEGAN  file that a rank touches when it listens to signals; the rank is added to the name
TEST_FAIL   what fails, see `sabotage`
TEST_RANK   on which rank
TEST_MARK   file that is touched when it does
TEST_ERROR  name of the exception, ArithmeticError by default
"""

import builtins
import importlib
import importlib.abc
import os
import pathlib
import sys
import time
import zlib
from collections.abc import Iterable

import last_bits
import numpy as np

from hpcclear import cli
from hpcclear.ensemble import simulate, single
from hpcclear.ranks import launcher, leading, stopping
from hpcclear.ranks.schedule import Task
from hpcclear.ranks.team import Ranks
from hpcclear.results import checkpoint

RANK = launcher.launched_rank() or 0
FAIL = os.environ.get("TEST_FAIL", "")
HERE = int(os.environ.get("TEST_RANK", "0")) == RANK


def fail(*arguments: object, **options: object) -> None:
    """What a program error looks like."""
    if "TEST_MARK" in os.environ:
        pathlib.Path(os.environ["TEST_MARK"]).touch()
    raise getattr(builtins, os.environ.get("TEST_ERROR", "ArithmeticError"))("raised on purpose")


class NoImport(importlib.abc.MetaPathFinder):
    """Refuses one module."""

    def find_spec(self, name: str, path: object, target: object = None) -> None:
        if f"import {name}" == FAIL:
            fail()


def note(event: str, samples: Iterable[str] = ()) -> None:
    """Log what happened, in one write: seconds, rank, event, and the samples it concerns.

    ``finished`` by a rank's worker, each time it has advanced; ``received`` by root; ``saving`` and
    ``saved``: root begins and has done a write of the samples it received, the same with ``a stage``
    of a result; ``opened``: the checkpoint;
    ``stage``: root begins one, which stands for a sample here.
    """
    line = "\t".join([f"{time.monotonic():.6f}", str(RANK), event, *samples])
    with open(os.environ.get("TEST_LOG", os.devnull), "ab", buffering=0) as log:
        log.write(f"{line}\n".encode())


def names(stage: str, payload: object, samples: np.ndarray, points: np.ndarray) -> list[str]:
    """What tells a sample from every other of a run: stage, number, scene and design."""
    scene = zlib.crc32(repr(payload).encode())
    return [
        f"{stage}#{n}:{zlib.crc32(row.tobytes(), scene):08x}"
        for n, row in zip(samples, points, strict=True)
    ]


class Watched:
    """A worker that logs what it finishes, and may fail after that."""

    def __init__(self, worker: object, stage: str, payload: object) -> None:
        self._worker, self._stage, self._payload = worker, stage, payload
        self._names: dict[int, str] = {}
        self._finished = 0

    def __getattr__(self, name: str) -> object:
        return getattr(self._worker, name)

    def submit(self, index: np.ndarray, points: np.ndarray) -> None:
        known = names(self._stage, self._payload, index, points)
        self._names |= zip(index.tolist(), known, strict=True)
        self._worker.submit(index, points)

    def advance(self, seconds: float) -> object:
        if FAIL == "simulation" and HERE and self._finished > 0:  # a starved rank may not get many
            fail()
        records = self._worker.advance(seconds)
        self._finished += records.size
        note("finished", [self._names[sample] for sample in records["sample"].tolist()])
        return records


def tell_when_it_listens(mark: pathlib.Path) -> None:
    enter = stopping.StopSwitch.__enter__

    def entered(switch: stopping.StopSwitch) -> stopping.StopSwitch:
        enter(switch)
        mark.touch()
        return switch

    stopping.StopSwitch.__enter__ = entered  # type: ignore[method-assign]


class WatchedResponses(Watched):
    """The worker of single responses, likewise."""

    def __init__(self, payload: dict, ranks: Ranks) -> None:
        super().__init__(Responses(payload, ranks), ranks.where.split("'")[1], payload)


Responses = single.Responses
make_evaluator = simulate.make_evaluator


def make_watched(payload: dict, ranks: Ranks) -> Watched:
    """The maker of every rank's worker, by a name that pickle finds."""
    if FAIL == "maker" and HERE:
        fail()
    return Watched(make_evaluator(payload, ranks), ranks.where.split("'")[1], payload)


def watch() -> None:
    run_points, everywhere, stage = leading.run_points, Ranks.everywhere, Ranks.stage

    def watched_run_points(ranks: Ranks, task: Task, points, *, on_records=None, **options):
        note("stage", [task.name])

        def receive(records: np.ndarray) -> None:
            known = records["sample"]
            note("received", names(task.name, task.payload, known, points[known]))
            if on_records is not None:
                on_records(records)

        return run_points(ranks, task, points, on_records=receive, **options)

    def watched_everywhere(self: Ranks, name: str, *rest: object) -> None:
        note("stage", [name])
        everywhere(self, name, *rest)

    def watched_stage(self: Ranks, name: str) -> object:
        note("stage", [name])
        return stage(self, name)

    simulate.make_evaluator = make_watched  # type: ignore[assignment]
    single.Responses = WatchedResponses  # type: ignore[assignment,misc]
    Ranks.stage = watched_stage  # type: ignore[method-assign]
    Ranks.everywhere = watched_everywhere  # type: ignore[method-assign]
    leading.run_points = watched_run_points  # type: ignore[assignment]
    bracket(checkpoint.Checkpoint, "__init__", "", "opened")
    bracket(checkpoint.Checkpoint, "flush", "saving", "saved")
    bracket(checkpoint.Checkpoint, "save_stage", "saving a stage", "saved a stage")


def bracket(owner: type, name: str, before: str, after: str) -> None:
    """Log the begin and the end of a method."""
    original = getattr(owner, name)

    def noted(*arguments: object, **options: object) -> None:
        if before:
            note(before)
        original(*arguments, **options)
        note(after)

    setattr(owner, name, noted)


def sabotage() -> None:
    """Let FAIL happen: "maker", "simulation", "import MODULE", "call MODULE:NAME" or, from the n-th call
    on, "call MODULE:NAME n"; "once" in place of "call": this call only; "sleep": it does not return, for
    a minute."""
    if not HERE:
        return
    if FAIL.startswith("import "):
        sys.modules.pop(FAIL.removeprefix("import "), None)  # loaded above, for what is noted
        sys.meta_path.insert(0, NoImport())
    if FAIL.startswith(("call ", "once ", "sleep ")):
        what, place, *count = FAIL.split()
        module, _, path = place.partition(":")
        owner: object = importlib.import_module(module)
        *above, name = path.split(".")
        for step in above:
            owner = getattr(owner, step)
        original, calls = getattr(owner, name), iter(range(1, 10**9))
        first = int(count[0] if count else 1)

        def replaced(*arguments: object, **options: object) -> object:
            call = next(calls)
            if call == first or (call > first and what != "once"):
                time.sleep(60.0) if what == "sleep" else fail()
            return original(*arguments, **options)

        setattr(owner, name, replaced)


if __name__ == "__main__":
    if "TEST_BEGAN" in os.environ:
        tell_when_it_listens(pathlib.Path(f"{os.environ['TEST_BEGAN']}{RANK}"))
    last_bits.disturb()
    watch()
    sabotage()
    cli.main()

"""The real command, watched or sabotaged: command.py ARGUMENTS OF hpcclear; settings in the environment.

TEST_LOG    file that gets a line "seconds rank sample" for every sample that a rank finishes
TEST_BEGAN  file that root touches when it begins
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

from hpcclear import cli, launcher, work

FAIL = os.environ.get("TEST_FAIL", "")
HERE = (launcher.launched_rank() or 0) == int(os.environ.get("TEST_RANK", "0"))


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


class Watched:
    """A worker that logs what it finishes, and may fail after that."""

    def __init__(self, worker: object) -> None:
        self._worker = worker
        self._log = open(os.environ.get("TEST_LOG", os.devnull), "a")  # noqa: SIM115
        self._finished = 0

    def __getattr__(self, name: str) -> object:
        return getattr(self._worker, name)

    def advance(self, seconds: float) -> object:
        if FAIL == "simulation" and HERE and self._finished > 100:
            fail()
        records = self._worker.advance(seconds)
        self._finished += records.size
        now, rank = time.time(), launcher.launched_rank() or 0
        self._log.write("".join(f"{now:.3f} {rank} {sample}\n" for sample in records["sample"]))
        self._log.flush()
        return records


def watch() -> None:
    make = work.MAKERS[work.KIND]

    def made(payload: object, ranks: object) -> Watched:
        if FAIL == "maker" and HERE:
            fail()
        return Watched(make(payload, ranks))

    work.MAKERS[work.KIND] = made  # type: ignore[index]


def sabotage() -> None:
    """Let FAIL happen: "maker", "simulation", "import MODULE", "call MODULE:NAME" or, from the n-th call
    on, "call MODULE:NAME n"; with "sleep" in place of "call" it does not return, for a minute."""
    if not HERE:
        return
    if FAIL.startswith("import "):
        sys.meta_path.insert(0, NoImport())
    if FAIL.startswith(("call ", "sleep ")):
        what, place, *count = FAIL.split()
        module, _, path = place.partition(":")
        owner: object = importlib.import_module(module)
        *above, name = path.split(".")
        for step in above:
            owner = getattr(owner, step)
        original, calls = getattr(owner, name), iter(range(1, 10**9))

        def replaced(*arguments: object, **options: object) -> object:
            if next(calls) >= int(count[0] if count else 1):
                fail() if what == "call" else time.sleep(60.0)
            return original(*arguments, **options)

        setattr(owner, name, replaced)


if __name__ == "__main__":
    if launcher.launched_rank() in (0, None) and "TEST_BEGAN" in os.environ:
        pathlib.Path(os.environ["TEST_BEGAN"]).touch()
    watch()
    sabotage()
    cli.main()

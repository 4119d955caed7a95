"""What the compile cache withstands: damaged files, many cold processes at once, kills, two versions of the package.

    python analysis/compile_cache.py --keep         # all, some 15 minutes; writes results/compile_cache.csv beside this file
    python analysis/compile_cache.py --only together --processes 4

Every trial runs commands of the `hpcclear` beside this Python in processes of their own, and compares what they
write with the bytes from an undamaged cache. Compilations are counted where compiled code is stored.
"""

import argparse
import collections
import contextlib
import csv
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
RESULTS = ROOT / "analysis" / "results" / "compile_cache.csv"
BIN = Path(sys.executable).parent
SHORT = ["--set", "numerics.transient_revolutions=0", "--set", "numerics.averaged_revolutions=1"]
COMMANDS = {
    "simulate": ["simulate", str(ROOT / "jobs" / "slider_crank.toml"), *SHORT, "-o"],
    "sample": ["sample", str(ROOT / "jobs" / "quickstart.toml"), *SHORT, "--set", "study.samples=8", "-o"],
}  # fmt: skip
"""Words before the name of the file that is written."""

COUNTING = """
import importlib.abc, importlib.machinery, os, sys

class Loader(importlib.machinery.SourceFileLoader):
    def exec_module(self, module):
        super().exec_module(module)
        usual = module.write
        def write(path, content):
            with open(os.environ["COMPILED"], "a") as log:
                log.write(f"{path.name} {os.getpid()}\\n")
            usual(path, content)
        module.write = write

class Finder(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name != "hpcclear.base.kept":
            return None
        found = importlib.machinery.PathFinder.find_spec(name, path)
        found.loader = Loader(name, found.origin)
        return found

sys.meta_path.insert(0, Finder())
"""
"""A sitecustomize module that notes each compilation that is stored, in whatever process."""


class Outcome(NamedTuple):
    """What a command did."""

    code: int
    said: str
    written: bytes


class Count(NamedTuple):
    """One line of the results."""

    what: str
    trials: int
    right: int
    """Trials with exit code 0 and the right bytes."""
    said: int
    """Trials with one line about the cache; with none where the file was not read, or is the sources' key."""
    most: int
    """Largest number of compilations of one source."""
    left: int
    """Files of killed writers, and locks, that are left at the end."""


class Place:
    """A compile cache of one's own, and commands that use it."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.cache = folder, folder / "cache"
        self.log = folder / "compiled"
        self.cache.mkdir(parents=True)
        (folder / "sitecustomize.py").write_text(COUNTING)
        self._number = 0

    def start(
        self, command: str, ranks: int = 0, program: list[str] | None = None, **settings: str
    ) -> tuple[subprocess.Popen, Path]:
        """A command that was started, and the file that it will write."""
        self._number += 1
        out = self.folder / f"{self._number}.nc"
        launcher = [str(BIN / "mpiexec"), "-n", str(ranks)] if ranks else []
        words = [*launcher, *(program or [str(BIN / "hpcclear")]), *COMMANDS[command], str(out)]
        known = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"}
        mine = {"HPCCLEAR_CACHE": str(self.cache), "PYTHONPATH": str(self.folder), "COMPILED": str(self.log)}  # fmt: skip
        process = subprocess.Popen(
            words, env={**known, **mine, **settings}, cwd=self.folder, text=True, start_new_session=True,
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
        )  # fmt: skip
        return process, out

    def run(self, command: str, ranks: int = 0, **more: object) -> Outcome:
        """Run a command to its end."""
        return finished(*self.start(command, ranks, **more))  # type: ignore[arg-type]

    def most(self) -> int:
        """Largest number of compilations of one source, and forget all."""
        lines = self.log.read_text().splitlines() if self.log.exists() else []
        self.log.unlink(missing_ok=True)
        return max(
            collections.Counter(line.rpartition(" ")[0] for line in lines).values(), default=0
        )

    def left(self) -> int:
        """Parts of files, and locks."""
        return sum(path.suffix in (".part", ".lock") for path in self.cache.rglob("*"))


def finished(process: subprocess.Popen, out: Path) -> Outcome:
    """What a command did, at its end."""
    said = process.communicate()[1]
    written = out.read_bytes() if out.exists() else b""
    return Outcome(process.returncode, said, written)


def damaged(content: bytes, kind: str, rng: random.Random) -> bytes:
    """The content of a file after some mishap."""
    place = rng.randrange(max(len(content), 1))
    if kind == "emptied":
        return b""
    if kind == "shortened":
        return content[:place]
    if kind == "random bytes":
        return rng.randbytes(len(content))
    return content[:place] + bytes([content[place] ^ 1 << rng.randrange(8)]) + content[place + 1 :]


KINDS = ("emptied", "shortened", "random bytes", "one bit")


def damage(place: Place, rng: random.Random, most: int) -> Iterator[Count]:
    """Damage one file after the other, by each kind, and run a command that needs it."""
    runs = (("simulate", 0), ("sample", 2))
    right = {run: place.run(*run) for run in runs}
    assert all(one.code == 0 for one in right.values()), right
    files = sorted(p for p in place.cache.rglob("*") if p.is_file() and p.stat().st_size)
    kept = place.folder / "kept"
    shutil.copytree(place.cache, kept)
    place.most()
    for kind in KINDS:
        chosen = rng.sample(files, min(most, len(files)))
        good = said = repeated = 0
        for path in chosen:
            bad = damaged(path.read_bytes(), kind, rng)
            path.write_bytes(bad)
            each = [(run, place.run(*run)) for run in runs]
            good += all(one.code == 0 and one.written == right[run].written for run, one in each)
            lines = [line for _, one in each for line in one.said.splitlines() if "damaged" in line]
            unread = path.exists() and path.read_bytes() == bad  # code that is part of other code
            said += len(lines) == (path.name != "sources" and not unread)
            repeated = max(repeated, place.most())
            shutil.rmtree(place.cache)
            shutil.copytree(kept, place.cache)  # with the times of the files
        yield Count(f"damaged: {kind}", len(chosen), good, said, repeated, place.left())


def together(place: Place, processes: int) -> Iterator[Count]:
    """Many cold processes at once."""
    started = [place.start("simulate") for _ in range(processes)]
    found = [finished(*one) for one in started]
    first = found[0].written
    good = sum(one.code == 0 and one.written == first != b"" for one in found)
    quiet = sum("Error" in one.said or "Traceback" in one.said for one in found)
    yield Count(f"cold processes at once ({quiet} errors)", processes, good, 0, place.most(), place.left())  # fmt: skip


def kills(place: Place, rng: random.Random, trials: int) -> Iterator[Count]:
    """Kill everything in the midst of compiling, again and again in one cache; then go on from what is there."""
    whole = Place(place.folder / "whole").run("simulate")
    good = 0
    for _ in range(trials):
        process, _ = place.start("simulate")
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(rng.uniform(1.0, 6.0))
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        if rng.random() < 0.5:
            shutil.rmtree(place.cache)  # so that the next kill hits other places
            place.cache.mkdir()
            continue
    place.most()
    found = place.run("simulate")
    good = found.code == 0 and found.written == whole.written
    yield Count(f"{trials} kills while compiling, then a result", 1, int(good), 0, place.most(), place.left())  # fmt: skip


def versions(place: Place) -> Iterator[Count]:
    """Two versions of the package with one cache, cold at once and then warm; the second has another constant."""
    programs, alone = [], []
    for name in ("one", "two"):
        copy = place.folder / name
        shutil.copytree(ROOT / "hpcclear", copy / "hpcclear", symlinks=False)
        if name == "two":
            source = copy / "hpcclear" / "dynamics" / "physics" / "powers.py"
            source.write_text(f"{source.read_text()}\n_OTHER = 1.0\n")
        start = f"import sys; sys.path.insert(0, {str(copy)!r}); from hpcclear.__main__ import main; main()"
        programs.append([sys.executable, "-P", "-c", start])
        alone.append(Place(place.folder / f"alone {name}").run("simulate", program=programs[-1]))
    for settings in ({}, {"NUMBA_CACHE_DIR": str(place.folder / "named")}):
        good = 0
        for _ in range(2):
            began = [place.start("simulate", program=one, **settings) for one in programs * 2]
            found = [finished(*one) for one in began]
            good += sum(
                one.code == 0 and one.written == own.written
                for one, own in zip(found, alone * 2, strict=True)
            )
        name = "NUMBA_CACHE_DIR" if settings else "HPCCLEAR_CACHE"
        # each version compiles each source once: two of one name
        yield Count(f"two versions, one {name}", 8, good, 0, place.most(), place.left())


def keep(rows: list[Count]) -> None:
    """Write rows to the results, in place of former ones of the same name."""
    known = {}
    if RESULTS.exists():
        with RESULTS.open(newline="") as file:
            known = {row[0]: row for row in list(csv.reader(file))[1:]}
    known |= {row.what: [str(cell) for cell in row] for row in rows}
    with RESULTS.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerows([Count._fields, *known.values()])


def main() -> None:
    """Measure, print, and write the results."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", choices=["damage", "together", "kills", "versions"])
    parser.add_argument("--processes", type=int, default=20)
    parser.add_argument("--files", type=int, default=8, help="damaged files of each kind")
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", action="store_true", help="write results/compile_cache.csv")
    given = parser.parse_args()
    rng = random.Random(given.seed)
    parts: dict[str, Callable[[Place], Iterator[Count]]] = {
        "damage": lambda place: damage(place, rng, given.files),
        "together": lambda place: together(place, given.processes),
        "kills": lambda place: kills(place, rng, given.kills),
        "versions": versions,
    }
    rows = []
    print(f"{'':<48}{'trials':>8}{'right':>8}{'said':>8}{'most':>8}{'left':>8}{'s':>8}")
    for name, part in parts.items():
        if given.only not in (None, name):
            continue
        with tempfile.TemporaryDirectory() as folder:
            began = time.perf_counter()
            for count in part(Place(Path(folder) / name)):
                rows.append(count)
                numbers = (*count[1:], round(time.perf_counter() - began))
                print(f"{count.what:<48}" + "".join(f"{n:>8}" for n in numbers), flush=True)
    if given.keep:
        keep(rows)


if __name__ == "__main__":
    main()

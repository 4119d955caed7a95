"""The compile cache: a damaged file is compiled again, one process compiles while others wait, and no wait is for ever."""

import errno
import importlib
import inspect
import os
import random
import subprocess
import sys
import time
from pathlib import Path

import pytest
from compile_cache import KINDS, damaged
from patience import crowded

from hpcclear.base import cached, code_folder, host, kept


@pytest.fixture
def said(monkeypatch, capsys):
    """What is said of damaged files."""
    monkeypatch.setattr(kept, "_said", [])
    return lambda: [line for line in capsys.readouterr().err.splitlines() if "damaged" in line]


@pytest.fixture
def compiled(tmp_path, monkeypatch):
    """Two functions, each loaded or compiled anew: their values, and how many were loaded."""
    monkeypatch.setattr(cached, "chosen_folder", lambda: str(tmp_path / "cache"))
    (tmp_path / "cache").mkdir()
    (tmp_path / "module.py").write_text(
        "def twice(x):\n    return 2.0 * x\n\n\ndef thrice(x):\n    return 3.0 * x\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    module = importlib.import_module("module")

    def load():
        functions = [cached.cached(one) for one in (module.twice, module.thrice)]
        values = [function(1.0) for function in functions]
        return values, sum(sum(one.stats.cache_hits.values()) for one in functions)

    yield load
    sys.modules.pop("module")


def test_a_damaged_file_of_any_sort_is_made_again_and_that_is_said(tmp_path, compiled, said):
    assert compiled() == ([2.0, 3.0], 0)
    assert compiled() == ([2.0, 3.0], 2)
    files = sorted(path for path in (tmp_path / "cache").rglob("*") if path.is_file())
    assert sorted(path.suffix for path in files) == [".code", ".code"]
    rng = random.Random(4)
    for path in files:
        for kind in KINDS:
            path.write_bytes(damaged(path.read_bytes(), kind, rng))
            kept._said.clear()
            values, loaded = compiled()
            assert values == [2.0, 3.0]
            assert loaded >= 1  # what was not damaged
            assert len(said()) == 1, (path, kind)
        assert compiled() == ([2.0, 3.0], 2)
        assert not said()
    one, other = (path.read_bytes() for path in files)
    files[0].write_bytes(other)  # whole files, each under the name of another function
    files[1].write_bytes(one)
    kept._said.clear()
    assert compiled() == ([2.0, 3.0], 0)
    assert len(said()) == 1


HOLD = """
import fcntl, sys, time
file = open(sys.argv[1], "w")
fcntl.flock(file, fcntl.LOCK_EX)
print("held", flush=True)
time.sleep(1000)
"""


@pytest.fixture
def holder(tmp_path):
    """A process that holds the lock of a file, and compiles for ever."""
    words = [sys.executable, "-I", "-S", "-c", HOLD, str(tmp_path / "code.lock")]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "held\n"
        yield process
        process.kill()


def test_nobody_waits_for_ever_and_only_once(tmp_path, holder, monkeypatch):
    """For a process that was stopped, or hangs: this one compiles for itself, and waits for no other source either."""
    monkeypatch.setattr(kept, "PATIENCE", 0.2)
    monkeypatch.setattr(kept, "_given_up", False)
    assert kept.lock(tmp_path / "code") is None
    monkeypatch.setattr(kept, "PATIENCE", 1000.0)
    began = time.monotonic()
    assert kept.lock(tmp_path / "code") is None
    assert time.monotonic() - began < crowded(10.0)
    assert holder.poll() is None


@pytest.mark.parametrize("fault", ["no locks", "read-only", "full"])
def test_where_nothing_can_be_locked_or_kept_everyone_compiles(tmp_path, compiled, monkeypatch, fault):  # fmt: skip
    """As on some network file systems, and where a place has become read-only since the process began."""

    def refuse(*words, **more):
        raise OSError(errno.EROFS if fault == "read-only" else errno.ENOLCK, "refused")

    if fault == "no locks":
        monkeypatch.setattr(host, "lock_file", refuse)
    else:
        compiled()
        for path in (tmp_path / "cache").rglob("*.code"):
            path.unlink()
        monkeypatch.setattr(kept, "replace", refuse)
    if fault == "read-only":
        monkeypatch.setattr(kept.os, "open", refuse)
    assert compiled() == ([2.0, 3.0], 0)
    assert compiled() == ([2.0, 3.0], 2 if fault == "no locks" else 0)


def test_an_error_while_compiling_gives_the_lock_back(tmp_path, monkeypatch):
    monkeypatch.setattr(cached, "chosen_folder", lambda: str(tmp_path))

    def wrong(x):
        return x.nothing

    for _ in range(2):
        with pytest.raises(Exception, match="nothing"):
            cached.cached(wrong)(1.0)
        assert not list(tmp_path.rglob("*.lock"))


@pytest.mark.nightly
@pytest.mark.parametrize("part", ["damage", "together", "kills", "versions"])
def test_commands_with_such_a_cache(part):
    """`analysis/compile_cache.py` in small: exit codes, bytes, lines and counts of compilations of real commands and ranks."""
    import compile_cache

    program = Path(inspect.getfile(compile_cache))
    few = ["--only", part, "--processes", "6", "--files", "2", "--kills", "6", "--seed", "2"]
    done = subprocess.run(
        [sys.executable, str(program), *few], capture_output=True, text=True, timeout=crowded(900.0)
    )
    assert done.returncode == 0, done.stderr
    for line in done.stdout.splitlines()[1:]:
        trials, right, said, most, left = map(int, line.split()[-6:-1])
        assert right == trials, done.stdout
        assert left == 0
        assert most <= (2 if part == "versions" else 1), done.stdout
        assert said == (trials if part == "damage" else 0), done.stdout
        assert "errors" not in line or "(0 errors)" in line


def test_a_source_that_was_written_is_noticed_whatever_its_size_and_time(tmp_path):
    path = tmp_path / "law.py"
    path.write_text("k = 1.0\n")
    about, before = path.stat(), code_folder._listing(tmp_path)
    assert code_folder._listing(tmp_path) == before
    path.write_text("k = 2.0\n")
    os.utime(path, ns=(about.st_atime_ns, about.st_mtime_ns))
    assert code_folder._listing(tmp_path) != before


def test_the_key_of_the_sources_is_the_same_read_or_computed(tmp_path):
    tmp_path.chmod(0o700)
    code = "from hpcclear.base import code_folder as c; print(c.source_key(), c._place()[0])"
    found, kept = [], None
    for line in (None, "another key\n", "damaged", None):
        if line is not None and kept is not None:
            kept.write_text(line)
        done = subprocess.run(
            [sys.executable, "-c", code],
            env={**os.environ, "HPCCLEAR_CACHE": str(tmp_path)},
            capture_output=True, text=True, check=True, timeout=crowded(120),
        )  # fmt: skip
        key, folder = done.stdout.split()
        kept = Path(folder) / "sources"
        assert kept.read_text().split()[1] == key
        found.append(key)
    assert set(found) == {code_folder.source_key()}

"""Functions written out as one text: it does what their calls do, holds what is on, and is kept for the next process."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from numba import njit
from patience import crowded
from running import scene_with
from some_laws import effects_with

from hpcclear.base import code_folder
from hpcclear.base.jit import lane_function, scalar_function
from hpcclear.base.one_text import one_text
from hpcclear.base.unrolled import written_out
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.planar.problem import linkage_of


@scalar_function
def first_beyond(x, limit):
    """The first place above a limit, in a loop that returns."""
    for k in range(len(x)):
        if x[k] > limit:
            return k
    return -1


@lane_function
def clipped(x, low, high):
    """An early return."""
    if x < low:
        return low, -1
    if x > high:
        return high, 1
    return x, 0


@lane_function
def doubled(flag, x):
    if flag is not None:
        return 3.0 * x
    else:
        return x


class Switches(NamedTuple):
    joints: Any = None


@lane_function
def everything(flag, gaps, x, n):
    """Calls within calls, tuples, loops written out and not, a function of the other kind beside."""
    total = 0.0
    sides = 0
    kept: dict = {}
    for k in range(n):
        value, side = clipped(doubled(flag, x[k]), -1.0, 1.0)
        total += value
        sides += side
    for gap in written_out(at.GAPS):
        kept[gap] = gap.rate * 1.0
    for gap in written_out(at.GAPS):
        total += kept[gap] if getattr(gaps, gap.asked_by) is not None else 0.0
    low, high = (total, -total) if total < 0.0 else (-total, total)
    return first_beyond(x, 0.5), sides, low + 2.0 * high


def plain(flag, gaps, x, n):
    """The same by hand."""
    values = np.array([3.0 * v if flag else v for v in x[:n]])
    total = np.clip(values, -1.0, 1.0).sum()
    total += sum(gap.rate for gap in at.GAPS if getattr(gaps, gap.asked_by))
    first = next((k for k, v in enumerate(x) if v > 0.5), -1)
    return first, int((values > 1.0).sum() - (values < -1.0).sum()), abs(total)


@pytest.mark.parametrize("flag", [None, 1])
@pytest.mark.parametrize("gaps", [Switches(), Switches(joints=1)])
def test_the_text_does_what_the_calls_do(flag, gaps):
    x = np.random.default_rng(3).normal(size=6)
    text = njit(one_text(everything, "everything", flag=flag, gaps=gaps, n=5))
    found, expected = text(x), plain(flag, gaps, x, 5)
    assert found[:2] == expected[:2]
    assert found[2] == pytest.approx(expected[2], rel=1e-14)


def test_a_text_is_a_file_and_written_once():
    effects = effects_with((), joints=2)
    motion = linkage_of(scene_with()).module(effects).motion
    text = one_text(motion, "kept", effects=effects, W=3)
    path = Path(text.__code__.co_filename)
    assert path.stem == text.__name__
    assert sys.modules[text.__module__].__file__ == str(path)
    written = path.stat().st_mtime_ns
    del sys.modules[text.__module__]
    again = one_text(motion, "kept", effects=effects, W=3)
    assert again is not text
    assert path.stat().st_mtime_ns == written
    assert one_text(motion, "kept", effects=effects, W=4).__name__ != text.__name__


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

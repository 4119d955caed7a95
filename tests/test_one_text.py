"""Functions written out as one text: it does what their calls do, holds what is on, and is kept for the next process."""

import ast
import os
import re
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
from hpcclear.base.jit import lane_function, scalar_function, written_kind
from hpcclear.base.one_text import one_text, text_of
from hpcclear.base.text.alike import written_once
from hpcclear.base.unrolled import written_out
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.planar.problem import linkage_of
from hpcclear.dynamics.stepping.stops import impact_fraction


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


def test_what_is_off_is_not_in_the_text():
    with_, without = (
        text_of(everything, "everything", {"flag": flag, "gaps": Switches(), "n": 2})
        for flag in (1, None)
    )
    assert "3.0 *" in with_
    assert "3.0 *" not in without


def test_a_function_of_the_other_kind_stands_beside():
    """It is compiled with its own rules of arithmetic."""
    assert (written_kind(everything), written_kind(first_beyond)) == ("lane", "scalar")
    text = text_of(everything, "everything", {"flag": None, "gaps": Switches(), "n": 2})
    beside = text[: text.index("def first_beyond")].splitlines()[-1]
    assert beside.startswith("@njit(")
    assert "fastmath" not in beside
    assert "clipped" not in text


def test_two_branches_that_return_keep_their_order():
    text = njit(one_text(impact_fraction, "impact"))
    for case in [
        (-1.0, 3.0, 1.0, 1.0, 0.0),
        (-1.0, 6.0, -1.0, -6.0, 0.0),
        (0.5, 0.1, 0.7, 0.1, 0.0),
    ]:
        assert text(*case) == impact_fraction(*case)


def test_a_motion_holds_its_effects_alone():
    linkage = linkage_of(scene_with({"effects.friction": {"law": "none"}}))
    known = {"effects": effects_with((), joints=2), "W": 16}
    text = text_of(linkage.module(known["effects"]).motion, "motion", known)
    friction = rf"work\w*\[{(at.RATE_NOW + at.FRICTIONS) * 16} \+ i\w*\]"
    assert re.search(rf"par\w*\[{(at.JOINTS[0].block + at.CLEARANCE) * 16} \+ i\w*\]", text)
    assert not re.search(friction, text)
    known["effects"] = known["effects"]._replace(series=1)
    text = text_of(linkage.module(known["effects"]).motion, "motion", known)
    assert re.search(friction, text)


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


def defined(text):
    """Functions of a text, the last the one that is asked for, as `written_once` takes them."""
    return [(f, "scalar" if f.name.startswith("scalar") else "lane") for f in ast.parse(text).body]


def merged(text):
    return ast.unparse(ast.Module([ast.fix_missing_locations(f) for f, _ in written_once(defined(text))], []))  # fmt: skip


ALIKE = """
def gap(work, i):
    r = work[4 + i] * work[10 + i]
    return r

def gap_2(work_2, i_2):
    r_2 = work_2[5 + i_2] * work_2[17 + i_2]
    return r_2

def gap_3(work_3, i_3):
    r_3 = work_3[6 + i_3] * work_3[24 + i_3]
    return r_3

def asked(work, i):
    return (gap(work, i), gap_2(work, i), gap_3(work, i))
"""


def test_functions_that_differ_by_addresses_are_written_once():
    text = merged(ALIKE)
    assert text.count("def ") == 2
    before, after = {}, {}
    exec(ALIKE, before)
    exec(text, after)
    work = np.random.default_rng(1).normal(size=40)
    assert after["asked"](work, 3) == before["asked"](work, 3)


def test_what_is_alike_by_chance_alone_stays():
    """Another operation, a number that is no address, a function that is not inlined, more distances than are worth it."""
    for old, new in (
        ("work_2[5 + i_2] *", "work_2[5 + i_2] +"),
        ("work_2[5 + i_2] *", "2.0 * work_2[5 + i_2] *"),
        ("work_2[5 + i_2] *", "work_2[5 * i_2] *"),
    ):
        assert merged(ALIKE.replace(old, new)).count("def ") == 3
    assert merged(ALIKE.replace("gap", "scalar_gap")).count("def ") == 4
    sums = "def f{n}(w{n}):\n    return ({items})\n\n"
    rows = ((1, 2, 3, 4, 5), (2, 4, 6, 8, 10))
    two = "".join(
        sums.format(n=n, items=", ".join(f"w{n}[{a}]" for a in row)) for n, row in enumerate(rows)
    )
    assert merged(two + "def asked(w):\n    return (f0(w), f1(w))").count("def ") == 3


def test_what_does_nothing_is_not_called():
    """And what then does nothing either is left out as well; equal functions that are not inlined are one."""
    text = merged(
        "def empty(a):\n    pass\n\ndef outer(b):\n    empty(b)\n\ndef scalar_one(c):\n    return c\n\n"
        "def scalar_two(d):\n    return d\n\ndef asked(e):\n    outer(e)\n    return scalar_one(e) + scalar_two(e)"
    )
    assert text == (
        "def scalar_one(c):\n    return c\n\ndef asked(e):\n    pass\n    return scalar_one(e) + scalar_one(e)"
    )


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

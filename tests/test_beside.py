"""Another process compiles beside this one: what it did is loaded, and where it fails nothing is lost."""

import subprocess
import sys

import pytest
from running import scene_with

from hpcclear.base import beside, cores
from hpcclear.dynamics.evaluation.evaluator import DEFAULT_LANES
from hpcclear.dynamics.setup.problem import problem_of
from hpcclear.dynamics.stepping.lanes import Lanes

PROGRAM = """
import sys
from hpcclear.base import beside
with beside.compiled_beside(sys.argv[1:]):
    pass
print(*(beside._mark(part).exists() for part in sys.argv[1:]))
"""
HEAVY = "hpcclear.dynamics.stepping.special:special_code"


def run(folder, *parts):
    """Which parts are compiled after the block, by a process with a cache of its own."""
    found = subprocess.run(
        [sys.executable, "-c", PROGRAM, *parts],
        env={"HPCCLEAR_CACHE": str(folder), "PATH": "/usr/bin:/bin"},
        capture_output=True, text=True, check=True, timeout=300,
    )  # fmt: skip
    return found.stdout.split()


@pytest.mark.skipif(cores.own_cores() < 2, reason="one core: nothing is compiled beside")
@pytest.mark.nightly
def test_what_is_not_there_is_compiled_by_another_process(tmp_path):
    assert run(tmp_path, HEAVY) == ["True"]


@pytest.mark.skipif(cores.own_cores() < 2, reason="one core: nothing is compiled beside")
def test_a_part_that_fails_is_left_to_this_process(tmp_path):
    assert run(tmp_path, "hpcclear.nowhere:nothing") == ["False"]


def test_an_interrupted_compilation_is_taken_up_again(monkeypatch):
    """A stepper never runs on addresses that are not there yet."""
    lanes = Lanes(problem_of(scene_with()), DEFAULT_LANES)

    def interrupted(width, stages):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("hpcclear.dynamics.stepping.lanes.explicit_code", interrupted)
        with pytest.raises(KeyboardInterrupt):
            lanes.step(1)
    assert not lanes.step(1)  # compiled now; nothing is queued
    assert all(lanes._codes[:2])


class Started(Exception):
    """Another process was started."""


def refuse(*words, **more):
    raise Started


def test_no_process_is_started_for_what_is_there_or_among_ranks(monkeypatch, tmp_path):
    monkeypatch.setattr(beside.subprocess, "Popen", refuse)
    monkeypatch.setattr(beside, "_mark", lambda part: tmp_path / part)
    monkeypatch.setattr(beside, "own_cores", lambda: 2)
    with pytest.raises(Started), beside.compiled_beside(["heavy", "light"]):
        pass
    (tmp_path / "heavy").touch()
    with beside.compiled_beside(["heavy", "light"]):
        pass
    monkeypatch.setattr(beside, "own_cores", lambda: 1)
    with beside.compiled_beside(["other"]):
        pass


def test_a_rank_among_others_has_one_core(monkeypatch):
    monkeypatch.setitem(cores._state, "alone", True)
    cores.among_ranks()
    assert cores.own_cores() == 1

"""Vectors of 128, 256 or 512 bits: by the processor, by the environment, and that no result depends on it."""

import inspect
import os
import subprocess
import sys
from pathlib import Path

import llvmlite.binding as llvm
import numpy as np
import pytest
from numba import njit

from hpcclear.base import width
from hpcclear.base.cached import features_in_use
from hpcclear.base.errors import InputError
from hpcclear.base.jit import narrow_vectors
from hpcclear.base.one_text import one_text
from hpcclear.dynamics.stepping.explicit.steps import explicit_steps

WIDE = llvm.get_host_cpu_features().get("avx512f", False)
SCENE = Path(__file__).parent.parent / "jobs" / "slider_crank.toml"
wide = pytest.mark.skipif(not WIDE, reason="this processor has no vectors of 512 bits")


@pytest.mark.parametrize("processor", [{"avx2": True}, {"avx512f": False}])
def test_without_wide_vectors_there_is_nothing_to_choose(processor, monkeypatch):
    known = llvm.FeatureMap(processor)
    monkeypatch.setattr(llvm, "get_host_cpu_features", lambda: known)
    assert width.features() is None


@pytest.mark.parametrize(("name", "sign"), [("znver5", "-"), ("skylake-avx512", "+")])
def test_processors_that_slow_their_clock_have_narrow_vectors(name, sign, monkeypatch):
    known = llvm.FeatureMap({"avx512f": True})
    monkeypatch.setattr(llvm, "get_host_cpu_features", lambda: known)
    monkeypatch.setattr(llvm, "get_host_cpu_name", lambda: name)
    monkeypatch.delenv("HPCCLEAR_VECTOR_BITS", raising=False)
    assert width.features() == f"+avx512f,{sign}prefer-256-bit"


@pytest.mark.parametrize(
    ("asked", "preference"),
    [("128", "+prefer-128-bit"), ("256", "+prefer-256-bit"), ("512", "-prefer-256-bit")],
)
def test_a_width_may_be_set(asked, preference, monkeypatch):
    known = llvm.FeatureMap({"avx512f": True})
    monkeypatch.setattr(llvm, "get_host_cpu_features", lambda: known)
    monkeypatch.setenv("HPCCLEAR_VECTOR_BITS", asked)
    assert width.features() == f"+avx512f,{preference}"


def test_narrow_vectors_may_be_set_on_any_processor(monkeypatch):
    known = llvm.FeatureMap({"avx2": True})
    monkeypatch.setattr(llvm, "get_host_cpu_features", lambda: known)
    monkeypatch.setenv("HPCCLEAR_VECTOR_BITS", "128")
    assert width.features() == "+avx2,+prefer-128-bit"


@pytest.mark.parametrize(
    "named", [{}, {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "+avx2"}], ids=len
)
def test_another_width_is_refused(monkeypatch, tmp_path, named):
    """Also where the user names the processor to Numba, and the width would say nothing."""
    monkeypatch.setenv("HPCCLEAR_VECTOR_BITS", "64")
    for name, value in named.items():
        monkeypatch.setenv(name, value)
    with pytest.raises(InputError, match="256 or 512"):
        width.features()
    answer = subprocess.run(
        [sys.executable, "-m", "hpcclear", "simulate", SCENE, "-o", tmp_path / "r.nc"],
        capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    assert answer.returncode == 2
    assert "HPCCLEAR_VECTOR_BITS" in answer.stderr
    assert "Traceback" not in answer.stderr


@wide
@pytest.mark.full
def test_no_result_depends_on_it(tmp_path):
    """An ensemble in lanes, responses by pairs of order 8 and 5, compiled for each."""
    files = {}
    for bits in map(str, width.WIDTHS):
        settings = {**os.environ, "HPCCLEAR_VECTOR_BITS": bits}
        out = tmp_path / bits
        for words in (
            ["sample", "jobs/quickstart.toml", "--set", "study.samples=64", "-o", out / "samples.nc"],
            ["simulate", "jobs/slider_crank.toml", "-o", out / "response.nc",
             "--set", "effects.friction=none", "--set", "numerics.method=prince-dormand"],
            ["simulate", "jobs/slider_crank.toml", "-o", out / "steps.nc", "--set", "numerics.method=tsitouras"],
        ):  # fmt: skip
            out.mkdir(exist_ok=True)
            command = [sys.executable, "-m", "hpcclear", *map(str, words)]
            subprocess.run(command, env=settings, cwd=SCENE.parents[1], check=True, timeout=600)
        written = [path for path in sorted(out.glob("*.nc")) if "timing" not in path.name]
        files[bits] = [path.read_bytes() for path in written]
        assert len(files[bits]) == 3
    assert files["128"] == files["256"] == files["512"]


@wide
def test_loops_over_coordinates_take_no_vector_that_they_do_not_fill():
    """With 512 bits preferred, four coordinates went one by one."""

    def doubled(narrow):
        def double(x):
            if narrow:
                narrow_vectors()
            for k in range(len(x)):
                x[k] *= 2.0

        compiled = njit(double)
        compiled(np.ones(4))
        return compiled.inspect_asm(compiled.signatures[0])

    assert "zmm" not in doubled(True)
    if "-prefer-256-bit" in features_in_use():
        assert "zmm" in doubled(False)


@pytest.mark.parametrize("lanes", [1, 16])
def test_single_responses_ask_for_such_vectors_and_ensembles_do_not(lanes):
    text = inspect.getsource(one_text(explicit_steps, f"explicit_{lanes}", W=lanes, stages=7))
    assert ("narrow_vectors()" in text) == (lanes == 1)

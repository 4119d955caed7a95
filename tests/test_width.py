"""Vectors of 128, 256 or 512 bits: by the processor, by the environment, and that no result depends on it."""

import os
import subprocess
import sys
from pathlib import Path

import llvmlite.binding as llvm
import pytest

from hpcclear.base import width
from hpcclear.base.errors import InputError

WIDE = llvm.get_host_cpu_features().get("avx512f", False)
SCENE = Path(__file__).parent.parent / "jobs" / "slider_crank.toml"
wide = pytest.mark.skipif(not WIDE, reason="this processor has no vectors of 512 bits")


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

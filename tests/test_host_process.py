"""What a program that imports this package keeps: Numba's settings, the compiler's options, threads, signals, warnings."""

import subprocess
import sys
from pathlib import Path

from patience import crowded

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = """
import gc, os, signal, sys, warnings

import numba
import scipy.interpolate, scipy.special, sklearn  # which add warning filters of their own
import numpy as np
from numba import config

def state():
    found = {name: getattr(config, name) for name in dir(config) if name.isupper()}
    heard = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGUSR1)]
    found |= {"errors": np.geterr(), "threads": numba.get_num_threads(), "signals": heard, "hook": sys.excepthook}
    found |= {"collections": gc.get_threshold(), "shown by": warnings.showwarning, "filters": list(warnings.filters)}
    return found | {"environment": dict(os.environ)}

before = state()
import hpcclear
from hpcclear.statistics.search import pareto
from hpcclear.statistics.surrogate import predictor
scene = hpcclear.load_scene(sys.argv[1])
hpcclear.simulate(scene.with_({"numerics.transient_revolutions": 0, "numerics.averaged_revolutions": 1}))
after = state()
assert before == after, {name: (before[name], after[name]) for name in before if before[name] != after[name]}

@numba.njit(cache=True)
def own(x):
    return x + 1.0

own(1.0)
print(own._cache.cache_path)
"""


def test_a_program_that_simulates_keeps_its_settings_and_its_cache(tmp_path):
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    words = [sys.executable, str(program), str(ROOT / "jobs" / "quickstart.toml")]
    done = subprocess.run(words, capture_output=True, text=True, timeout=crowded(600.0))
    assert done.returncode == 0, done.stderr
    assert Path(done.stdout.strip()) == tmp_path / "__pycache__"

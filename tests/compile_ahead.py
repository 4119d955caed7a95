"""Compile what most tests need before they begin: else pytest's workers wait for the one that compiles.

`compile_ahead.py [LANES]`, by default as many as ensembles have. Steppers, steps of both orders, implicit steps and the motion
of the quickstart; a second run finds all of it on disk.
"""

import sys
from pathlib import Path

import numpy as np

from hpcclear.dynamics.evaluation import evaluate_records
from hpcclear.dynamics.evaluation.evaluator import DEFAULT_LANES
from hpcclear.scene import load_scene
from hpcclear.scene.points import Points

SCENE = Path(__file__).parent.parent / "jobs" / "quickstart.toml"


def main() -> None:
    lanes = int(sys.argv[1]) if len(sys.argv) > 1 else DEFAULT_LANES
    nothing = Points((), np.empty((1, 0)), ())
    scene = load_scene(SCENE, ["numerics.max_steps=100"])
    for method in ("tsitouras", "prince-dormand", "auto", "radau"):
        evaluate_records(scene.with_({"numerics.method": method}), nothing, lanes=lanes)


if __name__ == "__main__":
    main()

"""Largest Lyapunov exponents of a map's cells against those of an independent model, integrated by scipy at 1e-12 with shadows.

python analysis/lyapunov.py             (a quarter of an hour on one core)
python analysis/lyapunov.py --signs 40  (the sign alone, on random cells: fewer revolutions)
"""

import argparse
import math
import sys
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from oracle import SliderCrank

from hpcclear.dynamics.evaluation.steady.evaluator import SteadyEvaluator
from hpcclear.dynamics.evaluation.steady.mapping import mapped
from hpcclear.scene import Scene, load_scene
from hpcclear.scene.points import Points

JOB = Path(__file__).parent.parent / "jobs" / "hunt_crossley.toml"
CELLS = ((0.5, 0.3e-3), (0.1, 0.6e-3), (0.05, 0.6e-3), (0.05, 0.9e-3), (0.02, 1e-3))
"""Damping, s/m, and clearance, m."""

NEAR = 1e-7
"""Distance of the shadow over `SCALE`: the tolerance is so tight that it may be nearer than in a map."""

SCALE = np.array([1e-3, 1e-3, 1e-2, 1e-3, 1.0, 1.0, 50.0, 1.0])
SPIN_UP = 10
CLOSE = 0.5
"""Exponent of 12 revolutions that is so near to 0 that it takes 240 to know its sign."""


def scene_of(damping: float, clearance: float) -> Scene:
    changes = {f"joints.{joint}.clearance": clearance for joint in ("crank_rod", "rod_slider")}
    return load_scene(JOB).with_({**changes, "effects.contact.damping": damping})


def ours(scene: Scene) -> np.void:
    """The cell's record."""
    worker = SteadyEvaluator(
        scene, Points((), np.empty((0, 0)), ()), procedure=partial(mapped, sure=0.05)
    )
    worker.submit(np.zeros(1, int), np.empty((1, 0)))
    found = []
    while worker.pending:
        found.append(worker.advance(1.0))
    return np.concatenate(found)[0]


def theirs(scene: Scene, revolutions: int, seed: int) -> float:
    """Mean logarithm of the growth of a distance over a revolution, set back after each."""
    rng = np.random.default_rng(seed)
    model = SliderCrank(scene.resolved())
    period = 2.0 * math.pi / model.speed
    y = model.start()
    y[:8] += 1e-5 * SCALE * rng.standard_normal(8)

    def revolution(state: np.ndarray, k: int) -> np.ndarray:
        return model.leg(state, k * period, (k + 1) * period, "DOP853", 1e-12)

    for k in range(SPIN_UP):
        y = revolution(y, k)
    away = rng.standard_normal(8)
    away /= np.sqrt(np.mean(away**2))
    logs = []
    for k in range(SPIN_UP, SPIN_UP + revolutions):
        shadow = y.copy()
        shadow[:8] += NEAR * SCALE * away
        y, shadow = revolution(y, k), revolution(shadow, k)
        away = (shadow - y)[:8] / SCALE
        distance = np.sqrt(np.mean(away**2))
        away /= distance
        logs.append(math.log(distance / NEAR))
    return float(np.mean(logs[2:]))  # the direction has to turn first


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--revolutions", type=int, default=60)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--signs", type=int, default=0, metavar="CELLS")
    options = parser.parse_args()
    if options.signs:
        signs(options.signs)
    else:
        values(options.revolutions, options.seeds)


def values(revolutions: int, seeds: int) -> None:
    """Exponents of five cells."""
    print("damping   play     ours              theirs            difference")
    for damping, clearance in CELLS:
        scene = scene_of(damping, clearance)
        record = ours(scene)
        found = [theirs(scene, revolutions, seed) for seed in range(seeds)]
        mean, error = np.mean(found), np.std(found, ddof=1) / math.sqrt(len(found))
        growth, limit = float(record["lyapunov_exponent"]), float(record["lyapunov_exponent_limit"])
        print(
            f"{damping:7.2f} {1e3 * clearance:5.2f} mm  {growth:6.3f} +- {limit:.3f}  {mean:6.3f} +- {error:.3f} (s.e.)  "
            f"{growth / mean - 1.0:+.1%}",
            flush=True,
        )


def signs(cells: int) -> None:
    """Signs of the exponents of random cells."""
    rng = np.random.default_rng(7)
    right = 0
    for cell in range(cells):
        damping, clearance = 10.0 ** rng.uniform(-1.7, 0.0), rng.uniform(0.1e-3, 1e-3)
        scene = scene_of(damping, clearance)
        growth, other = float(ours(scene)["lyapunov_exponent"]), theirs(scene, 12, cell)
        if abs(other) < CLOSE:
            other = theirs(scene, 240, cell)
        right += growth * other > 0.0
        print(
            f"{cell:3} {damping:6.3f} s/m {1e3 * clearance:5.2f} mm  ours {growth:+6.2f}  theirs {other:+6.2f}  "
            f"{right} of {cell + 1} alike",
            flush=True,
        )


if __name__ == "__main__":
    main()

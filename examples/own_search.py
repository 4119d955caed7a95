"""Search designs with an optimiser of your own: SciPy's differential evolution, a whole generation in each call.

    python examples/own_search.py

The objective is the mean over the same random clearances for every design (common random numbers), so that designs are
compared on equal terms.
"""

from pathlib import Path

import numpy as np
from scipy.optimize import differential_evolution

import hpcclear

JOBS = Path(__file__).resolve().parent.parent / "jobs"
BOUNDS = {"mechanism.rod.mass": (0.15, 0.25), "mechanism.slider.mass": (0.10, 0.20)}  # kg


def main(generations: int = 10) -> None:
    scene = hpcclear.load_scene(
        JOBS / "slider_crank.toml",
        ["numerics.transient_revolutions=2", "numerics.averaged_revolutions=2"],
    )
    clearances = np.linspace(0.2e-3, 0.4e-3, 8)  # m
    searched: list[int] = []

    def mean_gap(candidates: np.ndarray) -> np.ndarray:
        """Mean objective of designs, shape (variables, designs), over all clearances."""
        count = candidates.shape[1]
        searched.append(count)
        points = {
            name: np.repeat(values, len(clearances))
            for name, values in zip(BOUNDS, candidates, strict=True)
        }
        samples = hpcclear.evaluate(scene, {**points, "C": np.tile(clearances, count)})
        f = samples.objective.values.reshape(count, len(clearances))
        return np.where(np.isfinite(f).all(axis=1), f.mean(axis=1), np.inf)

    found = differential_evolution(
        mean_gap,
        list(BOUNDS.values()),
        maxiter=generations,
        popsize=8,
        vectorized=True,
        updating="deferred",
        polish=False,
        rng=1,
    )
    for name, value in zip(BOUNDS, found.x, strict=True):
        print(f"{name} = {value * 1e3:.1f} g")
    print(f"mean f = {found.fun * 1e6:.2f} um")
    print(f"{sum(searched)} designs, each with {len(clearances)} clearances")


if __name__ == "__main__":
    main()

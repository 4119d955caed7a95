"""Estimate the scatter of the peak force from the tolerances of bore and pin, with a 95 % confidence interval.

python examples/scatter_of_a_fit.py
"""

from pathlib import Path

import numpy as np
from scipy import stats

import hpcclear

JOBS = Path(__file__).resolve().parent.parent / "jobs"
LIMIT = 11000.0  # N


def main(count: int = 256) -> None:
    scene = hpcclear.load_scene(JOBS / "slider_crank.toml")
    # Bore and pin of each joint scatter independently, so each has draws of its own.
    draws = stats.qmc.Sobol(d=4, seed=1).random(count)
    bore, pin = stats.norm(0.25e-3, 20e-6), stats.norm(0.0, 15e-6)  # m, radial
    clearance = {
        f"joints.{joint}.clearance": bore.ppf(draws[:, k]) - pin.ppf(draws[:, k + 1])
        for k, joint in ((0, "crank_rod"), (2, "rod_slider"))
    }
    machines = hpcclear.evaluate(scene, clearance)

    force = machines.peak_contact_force.sel(joint="crank_rod").values
    force = force[np.isfinite(force)]  # a failed simulation is NaN
    above = int((force > LIMIT).sum())
    low, high = stats.binomtest(above, len(force)).proportion_ci(method="wilson")
    print(
        f"{len(force)} machines: mean {force.mean():.0f} N, standard deviation {force.std(ddof=1):.0f} N"
    )
    print(f"P95 {np.quantile(force, 0.95):.0f} N")
    print(f"P(force > {LIMIT:.0f} N) = {above / len(force):.3f}, 95 % CI {low:.3f} to {high:.3f}")


if __name__ == "__main__":
    main()

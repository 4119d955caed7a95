"""Does the stated uncertainty of f hold the true f, and how much wider than the error is it?

    python analysis/uncertainty.py                   # 2000 designs, both laws, five tolerances: ten minutes
    python analysis/uncertainty.py --designs 300     # a look: medians of so few scatter by a tenth

Designs of the paper's box; the truth is f at rtol 1e-12. Under the paper's law, which holds on to old impact speeds, most of
them are chaotic. Standard errors are by the bootstrap.
"""

import argparse
from pathlib import Path

import numpy as np

from hpcclear.dynamics.evaluation import evaluate_records
from hpcclear.dynamics.evaluation.evaluator import PERTURBATIONS
from hpcclear.scene import load_scene
from hpcclear.scene.points import latin_hypercube

JOB = Path(__file__).parents[1] / "jobs" / "robust_slider_crank.toml"
LAWS = {
    "lankarani-nikravesh": {"law": "lankarani-nikravesh", "restitution": 0.9},
    "hunt-crossley": {"law": "hunt-crossley", "damping": 0.5},
}
TOLERANCES = (1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
TRUTH = 1e-12


def main() -> None:
    """Print, for each law and tolerance, the share held and medians of error and of what is stated."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--designs", type=int, default=2000)
    parser.add_argument("--laws", nargs="+", choices=LAWS, default=list(LAWS))
    parser.add_argument("--seed", type=int, default=1)
    words = parser.parse_args()
    rng = np.random.default_rng(words.seed)
    print(
        f"{'law':<22}{'rtol':>8}{'held':>8}{'median error':>14}{'stated/error':>17}{'force evaluations':>20}"
    )
    for law in words.laws:
        scene = load_scene(JOB, (f"study.seed={words.seed}",)).with_({"effects.contact": LAWS[law]})
        points = latin_hypercube(scene, words.designs)
        truth = evaluate_records(scene.with_({"numerics.rtol": TRUTH}), points)["objective"]
        for rtol in TOLERANCES:
            found = evaluate_records(
                scene.with_({"numerics.rtol": rtol}), points, perturbations=PERTURBATIONS
            )
            error, stated = np.abs(found["objective"] - truth), found["objective_uncertainty"]
            held = np.mean(error <= stated)  # what is not known is not held
            known = np.isfinite(error) & np.isfinite(stated)
            error, stated, exact = error[known], stated[known], truth[known]
            ratio = np.median(stated) / np.median(error)
            drawn = rng.integers(len(error), size=(200, len(error)))
            scatter = (np.median(stated[drawn], 1) / np.median(error[drawn], 1)).std()
            print(
                f"{law:<22}{rtol:>8.0e}{held:>8.1%}{np.median(error / exact):>14.1e}"
                f"{ratio:>9.2f} +- {scatter:.2f}{int(found['rhs_evaluations'].sum()):>20}"
            )  # fmt: skip


if __name__ == "__main__":
    main()

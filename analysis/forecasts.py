"""Does a study simulate as much as its forecast says? Random studies whose f is a formula, none of them used for its constants.

    python analysis/forecasts.py                # ten studies, a minute on one core; writes analysis/results/forecasts.csv
    python analysis/forecasts.py --first 500 --studies 20

Kinds of f (closed_forms.py), objectives, constraints, accuracies, numbers of designs and of rounds are drawn. Printed is the
forecast over what is simulated.
"""

import argparse
import csv
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from closed_forms import DESIGN, PATHS, Form, Judge, dynamics, form_of, random_inputs, scene_of
from regret import carried_out

from hpcclear.ensemble.session import sample_points
from hpcclear.ranks.boundary import alone
from hpcclear.scene import Scene
from hpcclear.study import forecast

RESULTS = Path(__file__).parent / "results" / "forecasts.csv"
FIELDS = "seed", "kind", "asked", "forecast", "simulations", "ratio"
WITHIN = 1.5

MASS = {"formula": "0 - m2 - m3"}
ASKED: dict[str, tuple[list[Any], float | None]] = {
    "mean and deviation": (["mean", "deviation"], None),
    "percentile and mass": ([{"statistic": "quantile", "level": 0.9}, MASS], None),
    "failures of 5 %": ([MASS, "mean"], 0.05),
    "failures of 0.1 %": ([MASS, "mean"], 1e-3),
    "deviation": (["deviation"], None),
}
"""Objectives, and the probability of failure that is allowed."""

KINDS = "smooth", "rough", "two modes", "chaotic", "very rough"


def main() -> None:
    """Forecast, carry out, print and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=600)
    parser.add_argument("--studies", type=int, default=10)
    parser.add_argument("--out", type=Path, default=RESULTS)
    words = parser.parse_args()
    rows = []
    for seed in range(words.first, words.first + words.studies):
        scene, form, kind, asked = study(seed)
        with dynamics(form), tempfile.TemporaryDirectory() as name:
            said, _ = forecast.expected(scene, partial(sample_points, scene, ranks=alone()), 1e-6)
            _, count = carried_out(scene, Path(name) / "out")
        values = seed, kind, asked, said, count, round(said / count, 3)
        rows.append(dict(zip(FIELDS, values, strict=True)))
        print(*values, flush=True)
        with words.out.open("w", newline="") as file:
            table = csv.DictWriter(file, FIELDS)
            table.writeheader()
            table.writerows(rows)
    right = sum(1.0 / WITHIN <= row["ratio"] <= WITHIN for row in rows)
    print(f"within a factor of {WITHIN} in {right} of {len(rows)}")


def study(seed: int) -> tuple[Scene, Form, str, str]:
    """A random study, its formula, the kind of this, and what is asked."""
    rng = np.random.default_rng([41, seed])
    kind = str(rng.choice(KINDS))
    form, random, asked = form_of(rng, kind), random_inputs(rng), list(ASKED)[seed % len(ASKED)]
    objectives, most = ASKED[asked]
    case: dict[str, Any] = {"objectives": objectives}
    if most is not None:
        centre = {name: 0.5 * (PATHS[name][1] + PATHS[name][2]) for name in DESIGN}
        limit = Judge(scene_of(seed, random, case), form, 100_000, seed).quantile(centre, most)
        case["constraints"] = [{"statistic": "exceedance", "limit": limit, "most": most}]
    verification = {
        "designs": int(rng.integers(1, 7)),
        "infill_rounds": int(rng.integers(1, 4)),
        "infill_designs": int(rng.integers(3, 10)),
        "infill_samples": int(rng.choice([64, 128, 256])),
        "most_samples": int(rng.choice([2048, 8192])),
    }
    accuracy = {
        "mean": float(rng.uniform(0.001, 0.005)),
        "deviation": float(rng.uniform(0.005, 0.03)),
    }
    scene = scene_of(seed, random, case, verification=verification, accuracy=accuracy)
    return scene, form, kind, asked


if __name__ == "__main__":
    main()

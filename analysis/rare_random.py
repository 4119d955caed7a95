"""Is a design ever called safe that is not? Random studies of rare failures, whose f is a formula, judged.

    python analysis/rare_random.py                 # 40 studies, minutes on one core; writes results/rare_random.csv here
    python analysis/rare_random.py --first 200 --studies 10

Each study seeks the heaviest masses whose probability of exceeding a limit stays below an allowed one, 1e-2 to 1e-4. All
designs that it verifies and calls kept are judged by `JUDGED` weighted draws of the same formula, of a wide normal density.
One is false if its probability exceeds the allowed one by more than two standard errors of the judge, some 1 % of it each.
The recommended design is also compared with the best of `SCANNED` designs, judged in the same way ("given away").
"""

import argparse
import csv
import tempfile
import time
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from closed_forms import DESIGN, PATHS, Form, Judge, dynamics, form_of, random_inputs, scene_of
from regret import carried_out

from hpcclear.base.verdict import Verdict
from hpcclear.ensemble.session import sample_points
from hpcclear.ranks.boundary import alone
from hpcclear.report.merit import recommended
from hpcclear.results import dataset
from hpcclear.scene import Scene
from hpcclear.scene.domain import box
from hpcclear.study import forecast

RESULTS = Path(__file__).parent / "results" / "rare_random.csv"
KINDS = "smooth", "rough", "two modes", "chaotic"
JUDGED, SCANNED = 100_000, 120

VERIFICATION = {
    "designs": 1,
    "most_samples": 8192,
    "infill_rounds": 2,
    "infill_samples": 256,
    "infill_designs": 6,
}
FIELDS = (
    "seed",
    "kind",
    "most",
    "kept",
    "false",
    "probability",
    "error",
    "given_away",
    "simulations",
    "forecast",
    "seconds",
)


def main() -> None:
    """Carry out, judge, write and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--studies", type=int, default=40)
    parser.add_argument("--out", type=Path, default=RESULTS)
    words = parser.parse_args()
    words.out.parent.mkdir(exist_ok=True)
    rows = []
    for seed in range(words.first, words.first + words.studies):
        rows.append(judged(seed))
        print(", ".join(f"{name} {rows[-1][name]}" for name in FIELDS), flush=True)
        with words.out.open("w", newline="") as file:
            table = csv.DictWriter(file, FIELDS)
            table.writeheader()
            table.writerows(rows)
    kept, false = (sum(row[name] for row in rows) for name in ("kept", "false"))
    print(f"{kept} designs kept in {len(rows)} studies; {false} of them are not")


def study(seed: int) -> tuple[Scene, Form, str, float]:
    """A random study, its formula, kind and allowed probability: what a design in the middle of the box has."""
    rng, kind = np.random.default_rng([29, seed]), KINDS[seed % len(KINDS)]
    form, random = form_of(rng, kind), random_inputs(rng)
    most = float(10.0 ** rng.uniform(-4.0, -2.0))
    objectives: list[Any] = [{"formula": "0 - m2 - m3"}, "mean"]
    plain = scene_of(seed, random, {"objectives": objectives})
    centre = {name: 0.5 * (PATHS[name][1] + PATHS[name][2]) for name in DESIGN}
    limit = Judge(plain, form, JUDGED, seed).quantile(centre, most)
    row = {"statistic": "exceedance", "limit": limit, "most": most}
    case = {"objectives": objectives, "constraints": [row]}
    return scene_of(seed, random, case, verification=VERIFICATION), form, kind, most


def judged(seed: int) -> dict[str, Any]:
    """One study, and what is true of its designs."""
    scene, form, kind, most = study(seed)
    begun = time.process_time()
    with dynamics(form), tempfile.TemporaryDirectory() as name:
        said, _ = forecast.expected(scene, partial(sample_points, scene, ranks=alone()), 1e-6)
        place, simulations = carried_out(scene, Path(name) / "out")
        table = dataset.read(place / "verification.nc", "verification").to_xarray()
    found: dict[str, Any] = {"seed": seed, "kind": kind, "most": float(f"{most:.3g}")}
    found |= {
        "simulations": simulations,
        "forecast": said,
        "seconds": round(time.process_time() - begun, 1),
    }
    names = scene.required_study.design_variables("made")
    judge, limit = (
        Judge(scene, form, JUDGED, seed + 1000),
        scene.required_study.cases[0].kept[0].limit,
    )
    assert limit is not None
    kept = (table["constraint_verdict"].to_numpy() == Verdict.HOLDS).all(axis=1)
    designs = [{n: float(table[n][k]) for n in names} for k in range(len(kept))]
    shares = [
        judge.probability(one, limit) if its else (0.0, 0.0)
        for one, its in zip(designs, kept, strict=True)
    ]
    found |= {
        "kept": int(kept.sum()),
        "false": sum(share - 2.0 * error > most for share, error in shares),
    }
    best = list(table["design"].to_numpy()).index(recommended(table))
    if kept[best]:
        share, error = shares[best]
        given = heaviest(judge, scene, designs[best], limit, most) / weight(designs[best]) - 1.0
        found |= {
            "probability": float(f"{share:.4g}"),
            "error": float(f"{error:.2g}"),
            "given_away": round(given, 5),
        }
    return dict.fromkeys(FIELDS, "") | found


def weight(design: dict[str, float]) -> float:
    """What is made large."""
    return design["m2"] + design["m3"]


def heaviest(
    judge: Judge, scene: Scene, design: dict[str, float], limit: float, most: float
) -> float:
    """The largest weight that is allowed, of designs all over the box and, by smaller and smaller steps, about the best."""
    region, rng = box(scene, list(design)), np.random.default_rng(37)
    best, step = dict(design), region.upper - region.lower
    for number in range(SCANNED):
        moves = 0.97**number * step * rng.uniform(-1.0, 1.0, len(step))
        row = np.clip(np.array(list(best.values())) + moves, region.lower, region.upper)
        trial = dict(zip(design, row.tolist(), strict=True))
        if weight(trial) > weight(best) and judge.probability(trial, limit)[0] <= most:
            best = trial
    return weight(best)


if __name__ == "__main__":
    main()

"""What a study's decision takes with ten seeds, and how far the recommended designs are from the best of all.

    python analysis/ten_seeds.py OUT STUDY.toml                # 20 minutes on one core; writes results/ten_seeds.csv
    python analysis/ten_seeds.py OUT STUDY.toml --first 1671   # other seeds

The best of all is that of the recommended designs or of a long search that begins with them (`analysis/regret.py`), judged
by simulations that none of them has seen. The samples of the surrogates are not counted: they are the study's own setting.
Results are kept in OUT, so that the command goes on where it was stopped.
"""

import argparse
import csv
import json
from pathlib import Path

import numpy as np
from regret import (
    CHOSEN,
    REPLICATES,
    ROUNDS,
    carried_out,
    choices_of,
    judged,
    merits,
    reference,
    scene_of,
    told,
)

from hpcclear.report.merit import recommended
from hpcclear.results import dataset

RESULTS = Path(__file__).parent / "results" / "ten_seeds.csv"
FIELDS = "study", "seed", "search", "decision", "both", "regret", "error"
SEEDS, MODELS = 10, ("kriging", "kriging check", "sensitivity")


def main() -> None:
    """Carry out, judge, print and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("study")
    parser.add_argument("--first", type=int, default=1661)
    words = parser.parse_args()
    words.out.mkdir(exist_ok=True)
    plain, taken, counts = scene_of(words.study), [], []
    case = plain.required_study.cases[0].name
    names = plain.required_study.design_variables(case)
    for seed in range(words.first, words.first + SEEDS):
        place = words.out / f"study_{seed}"
        directory, _ = carried_out(plain.with_({"study.seed": seed}), place)
        spent = json.loads(place.with_suffix(".json").read_text())
        rest = sum(count for stage, count in spent.items() if stage not in (*MODELS, "search"))
        counts.append((spent["search"], rest))
        table = dataset.read(directory / "verification.nc", "verification").to_xarray()
        best = table.sel(design=recommended(table))
        taken.append([float(best[name]) for name in names])
        print(seed, *counts[-1], flush=True)
    scene = plain.with_({"study.seed": words.first + SEEDS})
    found = choices_of(scene, case, reference(scene, case, ROUNDS, np.array(taken)))
    values, _, broken = merits(scene, found, told(scene, found, CHOSEN // REPLICATES, "chosen"))
    taken.append(list(found[int(np.where(broken, np.inf, values).argmin())].design.values()))
    values, errors, broken, least = judged(scene, choices_of(scene, case, taken))
    regrets = (values - values[least]) / abs(values[least])
    with RESULTS.open("w", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(FIELDS)
        for k, (search, rest) in enumerate(counts):
            assert not broken[k]
            last = search + rest, round(regrets[k], 5), round(float(errors[k]), 5)
            rows.writerow([Path(words.study).stem, words.first + k, search, rest, *last])
    both, its = np.sum(counts, axis=1), regrets[:SEEDS]
    print(
        f"search and decision: {np.median(both):.0f} simulations in the median, {both.max()} at most"
    )
    print(
        f"regret: {np.median(its):.2%} in the median, {its.max():.2%} at most; best of all {values[least]:.6g}"
    )


if __name__ == "__main__":
    main()

"""Does the paper's study cost as much as at an earlier commit, and does it come to the same designs? A pair of runs a seed.

    python analysis/study_pairs.py 2e8158b                       # six seeds on two ranks, about twelve minutes
    python analysis/study_pairs.py 2e8158b --seeds 21 --after HEAD --csv pairs.csv

Each seed runs the study of `jobs/robust_slider_crank.toml` at the earlier commit and in this checkout, in turns. Processor time
is that of all ranks, start and page included. The ends of a front are the designs of its case with the least mean and the least
standard deviation, by simulation. They agree if their 95 % confidence intervals overlap. Both versions compile first, untimed.
"""

import argparse
import os
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from same_bytes import ROOT, run, sources

RESULTS = ROOT / "analysis" / "results" / "study_pairs.csv"
SEEDS = (21, 22, 23, 24, 25, 26)
ENDS = {"least mean": "mean", "least standard deviation": "deviation"}
OTHERS = ("original", "paper alpha", "paper beta")  # verified for comparison, on no front


def study(root: Path, out: Path, seed: int) -> pd.DataFrame:
    """Run the study of a version; its cost and the ends of its fronts, a row each with the ends of the interval."""
    began, scene = os.times(), str(root / "jobs" / "robust_slider_crank.toml")
    run(root, ["run", scene, "-o", str(out), "--set", f"study.seed={seed}"], 2)
    spent = sum(os.times()[2:4]) - sum(began[2:4])  # user and system time of children
    with xr.open_dataset(out / "verification.nc") as verified:
        samples = int(verified["samples"].sum())
        costs = [("processor time [s]", spent), ("verification samples", samples)]
        costs += [("processor time per verification sample [ms]", 1e3 * spent / samples)]
        rows = [*((*cost, np.nan, np.nan) for cost in costs), *ends(verified)]
    return pd.DataFrame(rows, columns=["quantity", "value", "lower", "upper"])


def ends(verified: xr.Dataset) -> list[tuple[str, float, float, float]]:
    """Least mean and least standard deviation of each case, with their intervals, mm."""
    columns = [f"{n}_{e}" for n in ENDS.values() for e in ("true", "lower", "upper")]
    table, found = 1e3 * verified[columns].to_dataframe(), []
    for case in dict.fromkeys(verified["case"].values.tolist()):
        others = table.index.isin([f"{case} {name}" for name in OTHERS])
        own = table[(verified["case"].values == case) & ~others]
        for words, name in ENDS.items():
            best = own.loc[own[f"{name}_true"].idxmin()]
            numbers = (float(best[f"{name}_{end}"]) for end in ("true", "lower", "upper"))
            found.append((f"{case}: {words} [mm]", *numbers))
    return found


def report(rows: pd.DataFrame) -> None:
    """Print ratios of costs with their quarters, and how many ends of fronts agree."""
    first, second = (rows[rows["version"] == name] for name in ("before", "after"))
    pairs = first.merge(second, on=["seed", "quantity"], suffixes=("_before", "_after"))
    for name, pair in pairs.groupby("quantity", sort=False):
        before, after = pair["value_before"], pair["value_after"]
        low, middle, high = np.quantile(after / before, (0.25, 0.5, 0.75))
        words = f"{name:44s} {before.median():10.4g} {after.median():10.4g} {middle:7.3f} {low:6.3f}-{high:.3f}"
        if pair["lower_before"].notna().all():
            apart = np.maximum(pair["lower_before"], pair["lower_after"])
            agree = apart <= np.minimum(pair["upper_before"], pair["upper_after"])
            words += f"  {agree.sum()} of {len(pair)} agree"
        print(words)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("commit", help="of the earlier version, or a directory with its source")
    parser.add_argument("--after", help="of the later one; by default this checkout")
    parser.add_argument("--seeds", type=int, nargs="+", default=SEEDS)
    parser.add_argument("--csv", type=Path, default=RESULTS)
    words = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        versions = {"before": words.commit, "after": words.after}
        roots = {name: sources(one, place / name) for name, one in versions.items()}
        rows: list[pd.DataFrame] = []
        for name, root in roots.items():
            quickstart = str(root / "jobs" / "quickstart.toml")
            run(root, ["run", quickstart, "-o", str(place / f"compiled-{name}")], 2)
        for seed in words.seeds:
            for name in sorted(roots, reverse=bool(len(rows) // 2 % 2)):
                found = study(roots[name], place / f"{name}-{seed}", seed)
                rows.append(found.assign(seed=seed, version=name))
            pd.concat(rows).to_csv(words.csv, index=False, float_format="%.6g")
    print(f"{'quantity':44s} {'before':>10s} {'after':>10s} {'ratio':>7s} {'quarters':>12s}")
    report(pd.concat(rows))


if __name__ == "__main__":
    main()

"""Is the front that a study printed true? Its designs under a judge of their own, beside a scan of others.

    python analysis/judge_front.py results/robust                 # 8192 simulations a design, 200 others; minutes
    python analysis/judge_front.py results/seed20 results/seed21  # and whether studies agree within their limits

Alpha, beta and the front of each case are simulated on scatter that the study never saw. The scan looks at as many designs
on lines along each variable through alpha and beta, and within a tenth of each range about printed designs;
its best ten are judged as the printed ones are.
"""

import argparse
import tomllib
from pathlib import Path

import numpy as np
import xarray as xr
from directly import run_of

from hpcclear.results import dataset
from hpcclear.scene import Scene, load_scene
from hpcclear.scene.domain import box, to_coordinates, to_physical
from hpcclear.scene.stages import REPLICATES
from hpcclear.statistics.search.certainty import Compared
from hpcclear.study import truth
from hpcclear.study.optimisation import Choice

LOOK = 512
"""Simulations of each design of the scan."""

FINALS = 5
"""Designs of the scan that are judged, for each objective."""


def main() -> None:
    """Judge every study named, then compare them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("directories", nargs="+", type=Path)
    parser.add_argument("--simulations", type=int, default=8192)
    parser.add_argument("--scan", type=int, default=200)
    words = parser.parse_args()
    tables = [
        dataset.read(one / "verification.nc", "verification").to_xarray()
        for one in words.directories
    ]
    for place, table in zip(words.directories, tables, strict=True):
        scene = load_scene(tomllib.loads(table.attrs["scene"]))
        for case in scene.required_study.cases:
            print(f"\n{place}, case {case.name}")
            judge(scene, table, case.name, words.simulations, words.scan)
    if len(tables) > 1:
        agreement(tables)


def simulated(scene: Scene, designs: list[Choice], count: int) -> tuple[np.ndarray, np.ndarray]:
    """Mean and deviation, (n, 2), and what each replicate shifts them by, (2, n, 16)."""
    run = run_of(scene)
    made = truth.drawn(run, designs, "judge", count // REPLICATES)
    found = truth.results_of(run, designs, made)
    values = np.column_stack([found["mean"], found["deviation"]])
    return values, np.stack([found["mean_shifts"], found["deviation_shifts"]])


def judge(scene: Scene, table: xr.Dataset, case: str, count: int, others: int) -> None:
    """Print whether one front stands, and how far its ends are from the best of a scan."""
    printed = designs_of(scene, table, case)
    values, shifts = simulated(scene, printed, count)
    compared = Compared(values, shifts, 0.95)
    for k, choice in enumerate(printed):
        row = table.sel(design=choice.name)
        off = [values[k, j] / float(row[f"{name}_true"]) - 1 for j, name in enumerate(MOMENTS)]
        print(
            f"  {choice.name:28} mean {values[k, 0]:.5e} ({off[0]:+.2%})  deviation {values[k, 1]:.4e} ({off[1]:+.2%})"
        )
    below = (values[:, None] < values).all(axis=2).any(axis=0)
    print(
        f"  dominated by another printed one: {below.sum()} of {len(printed)}, surely {compared.beaten.sum()}"
    )
    scanned = scan(scene, case, printed, others)
    seen, _ = simulated(scene, scanned, LOOK)
    best = sorted({int(k) for j in range(2) for k in np.argsort(seen[:, j])[:FINALS]})
    finals, _ = simulated(scene, [scanned[k] for k in best], count)
    for j, end in enumerate(("alpha", "beta")):
        own = values[[choice.name for choice in printed].index(f"{case} {end}"), j]
        ratio = own / min(finals[:, j].min(), values[:, j].min()) - 1.0
        print(
            f"  {end}'s {MOMENTS[j]} above the least of {others} scanned and the printed: {ratio:+.2%}"
        )
    ours = values[:, None] * (0.998, 0.995)  # the accuracy that was asked for
    lost = (finals[None] < ours).all(axis=2).any(axis=1).sum()
    print(f"  printed designs that a scanned one dominates by more than 0.2 % and 0.5 %: {lost}")


MOMENTS = ("mean", "deviation")


def designs_of(scene: Scene, table: xr.Dataset, case: str) -> list[Choice]:
    """Alpha, beta and the front of a case."""
    names = scene.required_study.design_variables(case)
    wanted = [
        str(name) for name in table["design"].to_numpy()
        if str(name) in (f"{case} alpha", f"{case} beta") or str(name).startswith(f"{case} front ")
    ]  # fmt: skip
    rows = {name: table.sel(design=name) for name in wanted}
    return [Choice(name, case, {v: float(row[v]) for v in names}) for name, row in rows.items()]


def scan(scene: Scene, case: str, printed: list[Choice], count: int) -> list[Choice]:
    """Designs on lines through alpha and beta, and about printed ones."""
    names, rng = scene.required_study.design_variables(case), np.random.default_rng(1)
    region = box(scene, names)
    width = region.upper - region.lower
    centres = to_coordinates(scene, names, np.array([list(c.design.values()) for c in printed]))
    on_lines = []
    for k in range(count // 2):
        point = centres[k % 2].copy()
        variable = k // 2 % len(names)
        point[variable] = region.lower[variable] + rng.random() * width[variable]
        on_lines.append(point)
    chosen = centres[rng.integers(len(centres), size=count - len(on_lines))]
    about = chosen + rng.uniform(-0.1, 0.1, chosen.shape) * width
    points = np.clip(np.vstack([on_lines, about]), region.lower, region.upper)
    rows = to_physical(scene, names, points)
    return [Choice("", case, dict(zip(names, row.tolist(), strict=True))) for row in rows]


def agreement(tables: list[xr.Dataset]) -> None:
    """Print the ends of all studies, with limits, and whether these overlap."""
    print("\nstudies beside each other")
    for name in (str(name) for name in tables[0]["design"].to_numpy()):
        if name.rpartition(" ")[2] not in ("alpha", "beta") or len(name.split()) != 2:
            continue
        moment = MOMENTS[name.endswith("beta")]
        rows = [table.sel(design=name) for table in tables]
        ends = [[float(row[f"{moment}_{side}"]) for side in ("lower", "upper")] for row in rows]
        apart = max(low for low, _ in ends) / min(high for _, high in ends) - 1.0
        shown = ", ".join(f"{low:.4e} to {high:.4e}" for low, high in ends)
        print(
            f"  {name}, {moment}: {shown}; "
            + ("overlap" if apart <= 0 else f"apart by {apart:.2%}")
        )


if __name__ == "__main__":
    main()

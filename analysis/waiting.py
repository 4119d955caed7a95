"""How long ranks wait in a study: its batches are small where each simulation says which one comes next.

    python analysis/waiting.py SCENE...        # each scene once on one rank; writes results/waiting.csv

Measured are the batches of a study, what root computes between them and what a simulation costs, in processor time. From them
follows what any number of ranks would wait, had all simulations of a batch the same cost and were messages free: of a batch a
rank gets an equal share, rounded up, and while root computes all others wait. Besides it is printed for simulations that cost
10 and 100 times as much. The same batches serve any number of ranks, so that results have the same bytes.
"""

import argparse
import csv
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from hpcclear.scene import load_scene
from hpcclear.study import run_study, simulations

RESULTS = Path(__file__).parent / "results" / "waiting.csv"
RANKS, DEARER = (2, 8, 64), (1, 10, 100)
PARTS = {
    "sensitivity": "models",
    "kriging": "models",
    "kriging check": "models",
    "search": "search",
}
FIELDS = (
    "scene",
    "part",
    "simulations",
    "batches",
    "root_over_simulations",
    "cost_s",
    *(f"ranks_{n}" for n in RANKS),
)


def main() -> None:
    """Carry out, print and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="+", type=Path)
    words, rows = parser.parse_args(), []
    for path in words.scenes:
        batches = measured(path)
        for part in ("models", "search", "verification", "all"):
            chosen = [one[1:] for one in batches if part in (one[0], "all")]
            count, spent, root = np.array(chosen).T
            for dearer in DEARER:
                cost = dearer * spent.sum() / count.sum()
                waits = [round(waiting(count, root, cost, ranks), 2) for ranks in RANKS]
                share = round(root.sum() / (cost * count.sum()), 3)
                values = path.name, part, int(count.sum()), len(count), share, f"{cost:.2g}", *waits
                rows.append(dict(zip(FIELDS, values, strict=True)))
                print(*values, flush=True)
    with RESULTS.open("w", newline="") as file:
        table = csv.DictWriter(file, FIELDS, lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


def waiting(count: np.ndarray, root: np.ndarray, cost: float, ranks: int) -> float:
    """Share of the time of all ranks in which they do nothing."""
    taken = np.ceil(count / ranks) * cost + root
    return float(1.0 - (count.sum() * cost + root.sum()) / (ranks * taken.sum()))


def measured(path: Path) -> list[tuple[str, int, float, float]]:
    """Of each batch the part of the study, its simulations, and the seconds that they and root before them took."""
    found, ended = list[tuple[str, int, float, float]](), [time.process_time()]
    sampled = simulations.sample_points

    def timed(scene: Any, points: Any, *words: Any, stage: str, **more: Any) -> Any:
        begun = time.process_time()
        records = sampled(scene, points, *words, stage=stage, **more)
        name = stage.partition(":")[0]
        root, ended[0] = begun - ended[0], time.process_time()
        found.append((PARTS.get(name, "verification"), len(points), ended[0] - begun, root))
        return records

    simulations.sample_points = timed
    try:
        for _ in range(2):  # the first run compiles
            found.clear()
            with tempfile.TemporaryDirectory() as folder:
                ended[0] = time.process_time()
                run_study(load_scene(path), Path(folder) / "out", progress_style="quiet")
    finally:
        simulations.sample_points = sampled
    return found


if __name__ == "__main__":
    main()

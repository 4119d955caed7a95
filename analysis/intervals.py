"""Whether stated intervals hold the truth at any tolerance: verified designs at loose tolerances against a strict one.

    python analysis/intervals.py                  # ten studies, half an hour; writes analysis/results/intervals.csv
    python analysis/intervals.py press my.toml    # some of them, or a scene with one case of one's own

Studies are those of analysis/regret.py. Designs spread over the box are verified as a study does, at relative tolerances of
1e-4, 1e-5 and 1e-6. The truth of a design is `TRUTH` simulations at 1e-9, on scatter of their own. It has an error too, which
is independent of that of the intervals: their reaches, and that of the truth, add up as the root of their squares.
`by_samples_alone` counts the intervals without the share of the tolerance, `wider` is the median ratio of widths.
"""

import argparse
import csv
import itertools
from pathlib import Path

import numpy as np
from directly import Here, run_of
from regret import STUDIES, scene_of

from hpcclear.scene import Scene
from hpcclear.scene.domain import box, to_physical
from hpcclear.scene.points import Points
from hpcclear.scene.stages import REPLICATES
from hpcclear.scene.streams import unit_lhs
from hpcclear.statistics.random.replicates import spread, student
from hpcclear.study import tolerance, truth
from hpcclear.study.optimisation import Choice

RESULTS = Path(__file__).parent / "results" / "intervals.csv"
FIELDS = "study", "seed", "rtol", "hold", "by_samples_alone", "intervals", "wider"
TRUTH, STRICT = 2048, 1e-9
FIRST = 2
"""Seed: 0 and 1 served to develop the intervals."""

TOLERANCES = 1e-4, 1e-5, 1e-6
DESIGNS = 6
"""Verified at each tolerance, the two ends of their case among them: fewer than in a study, which know more of each other."""


def main() -> None:
    """Check and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("studies", nargs="*", default=list(STUDIES))
    parser.add_argument("--truth", type=int, default=TRUTH)
    parser.add_argument("--samples", type=int, default=1024)
    parser.add_argument("--seeds", type=int, default=2, help="designs and scatter of so many kinds")
    parser.add_argument("--first", type=int, default=FIRST, help="seed")
    parser.add_argument("--csv", type=Path, default=RESULTS)
    parser.add_argument(
        "--truths", type=Path, help="directory that keeps the truths, to go on or to judge anew"
    )
    words = parser.parse_args()
    rows = []
    print(*FIELDS)
    for name, seed in itertools.product(
        words.studies, range(words.first, words.first + words.seeds)
    ):
        changes = {"study.verification.most_samples": words.samples, "study.accuracy": None}
        scene = scene_of(name).with_(changes | {"study.seed": 31 + seed})
        designs = spread_out(scene, seed)
        kept = words.truths and words.truths / f"{Path(name).stem}_{seed}_{words.truth}.npy"
        if kept and kept.exists():
            exact = np.load(kept)
        else:
            exact = truths(scene, designs, words.truth)
        if kept:
            words.truths.mkdir(parents=True, exist_ok=True)
            np.save(kept, exact)
        for rtol in TOLERANCES:
            found = checked(scene.with_({"numerics.rtol": rtol}), designs, exact)
            rows.append((Path(name).stem, seed, rtol, *found))
            print(*rows[-1], flush=True)
        with words.csv.open("w", newline="") as file:
            csv.writer(file).writerows([FIELDS, *rows])
    hold, plain, count = np.array([row[3:6] for row in rows]).sum(axis=0)
    print(
        f"{hold} of {count} hold ({hold / count:.1%}), by samples alone {plain} ({plain / count:.1%})"
    )


def spread_out(scene: Scene, seed: int) -> list[Choice]:
    """Designs all over the box of the first case."""
    case = scene.required_study.cases[0].name
    names = scene.required_study.design_variables(case)
    region = box(scene, names)
    unit = unit_lhs(DESIGNS, len(names), np.random.default_rng([4, seed]))
    rows = to_physical(scene, names, region.lower + unit * (region.upper - region.lower))
    return [Choice("", case, dict(zip(names, row.tolist(), strict=True))) for row in rows]


def truths(scene: Scene, designs: list[Choice], count: int) -> np.ndarray:
    """Values and standard errors of mean, deviation and percentile by a strict tolerance, (n, 3, 2)."""
    run = run_of(scene.with_({"numerics.rtol": STRICT}))
    made = truth.drawn(run, designs, "truth", count // REPLICATES)
    return np.array(
        [
            [
                [one.value, float(spread(one.shifts[None])[0])]
                for one in truth.estimates_of(run, choice, values)[:3]
            ]
            for choice, values in zip(designs, made, strict=True)
        ]
    )


def checked(scene: Scene, designs: list[Choice], exact: np.ndarray) -> tuple[int, int, int, float]:
    """How many intervals hold, how many would without the share of the tolerance, of how many; and how much wider they are."""
    run = run_of(scene)
    run.simulations = Once(scene)
    plain = limits(truth.results_of(run, designs, truth.made(run, designs)))
    run.of = lambda other: run_of(other)
    run.simulations.next = 40_000  # as large a study as usual, of which pairs take a share
    whole = limits(tolerance.verified(run, designs))
    far = student(scene.required_study.verification.confidence, REPLICATES - 1)
    known = np.isfinite(exact).all(axis=2) & np.isfinite([*plain, *whole]).all(axis=0)
    hold = [
        abs(exact[..., 0] - value)
        <= np.hypot(
            np.where(exact[..., 0] < value, value - lower, upper - value), far * exact[..., 1]
        )
        for value, lower, upper in (whole, plain)
    ]
    wider = (whole[2] - whole[1]) / (plain[2] - plain[1])
    return (
        *(int(one[known].sum()) for one in hold),
        int(known.sum()),
        round(float(np.median(wider[known])), 2),
    )


class Once(Here):
    """Simulates nothing twice."""

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        self._kept: dict[bytes, np.ndarray] = {}

    def _records(self, points: Points, stage: str) -> np.ndarray:
        key = points.values.tobytes()
        if key not in self._kept:
            self._kept[key] = super()._records(points, stage)
        return self._kept[key]


def limits(true: dict[str, np.ndarray]) -> np.ndarray:
    """Mean, deviation and percentile of designs with their confidence limits, (3, n, 3): value, lower, upper."""
    rows = [
        [true[name] + sign * true[f"{name}_reach"] for sign in (0.0, -1.0, 1.0)]
        for name in ("mean", "deviation")
    ]
    rows.append([true[name] for name in ("percentile", "percentile_lower", "percentile_upper")])
    return np.moveaxis(np.array(rows), 0, 2)


if __name__ == "__main__":
    main()

"""Whether stated intervals hold the truth at any tolerance: verified designs at loose tolerances against a strict one.

    python analysis/coverage.py                  # all studies of analysis/regret.py and the paper's; many minutes
    python analysis/coverage.py press my.toml    # some of them, or a scene with one case of one's own

Designs spread over the box are verified as a study does, at relative tolerances of 1e-4, 1e-5 and 1e-6.
The truth of a design is `TRUTH` simulations at 1e-9, on scatter of their own; its own error is taken into account: an interval
holds if it meets the truth's interval at one standard error.
"""

import argparse
import itertools

import numpy as np
from directly import run_of
from regret import STUDIES, scene_of

from hpcclear.scene import Scene
from hpcclear.scene.domain import box, to_physical
from hpcclear.scene.sampling import unit_lhs
from hpcclear.scene.stages import REPLICATES
from hpcclear.study import tolerance, truth
from hpcclear.study.optimisation import Choice

TRUTH, STRICT = 4096, 1e-9
TOLERANCES = 1e-4, 1e-5, 1e-6
DESIGNS = 3
"""Verified at each tolerance, the ends of their case among them."""


def main() -> None:
    """Check and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("studies", nargs="*", default=list(STUDIES))
    parser.add_argument("--truth", type=int, default=TRUTH)
    parser.add_argument("--samples", type=int, default=1024)
    parser.add_argument("--seeds", type=int, default=1, help="designs and scatter of so many kinds")
    words = parser.parse_args()
    total = np.zeros(3, int)
    print(f"{'study':16} {'rtol':>7}  hold, by samples alone, of")
    for name, seed in itertools.product(words.studies, range(words.seeds)):
        changes = {"study.verification.most_samples": words.samples, "study.accuracy": None}
        scene = scene_of(name).with_(changes | {"study.seed": 31 + seed})
        designs = spread_out(scene, seed)
        exact = truths(scene, designs, words.truth)
        for rtol in TOLERANCES:
            found = np.array(checked(scene.with_({"numerics.rtol": rtol}), designs, exact))
            total += found
            print(
                f"{name.split('/')[-1]:16} {rtol:7.0e}  {found[0]}, {found[1]}, {found[2]}",
                flush=True,
            )
    hold, plain, count = total
    print(f"{'all':16} {'':7}  {hold} ({hold / count:.1%}), {plain} ({plain / count:.1%}), {count}")  # fmt: skip


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
    made = truth.doubled(run, designs, "truth", "truth", count // REPLICATES, count)
    return np.array(
        [
            [[one.value, one.error] for one in truth.estimates_of(run, choice, values)[:3]]
            for choice, values in zip(designs, made, strict=True)
        ]
    )


def checked(scene: Scene, designs: list[Choice], exact: np.ndarray) -> tuple[int, int, int]:
    """How many intervals hold, how many would without the share of the tolerance, of how many."""
    run = run_of(scene)
    run.of = lambda other: run_of(other)
    run.simulations.next = 40_000  # as large a study as usual, of which pairs take a share
    true = tolerance.verified(run, designs)
    hold = plain = count = 0
    for k in range(len(designs)):
        for column, name in enumerate(("mean", "deviation", "percentile")):
            if column < 2:
                lower = true[name][k] - true[f"{name}_reach"][k]
                upper = true[name][k] + true[f"{name}_reach"][k]
                more = true["tolerance"][k, column] * abs(true[name][k])
            else:
                lower, upper = true["percentile_lower"][k], true["percentile_upper"][k]
                more = 0.0
            value, error = exact[k, column]
            if not np.isfinite([lower, upper, value, error]).all():
                continue
            hold += lower - error <= value <= upper + error
            plain += lower + more - error <= value <= upper - more + error
            count += 1
    return int(hold), int(plain), count


if __name__ == "__main__":
    main()

"""Do limits of verified designs hold as often as they say, and what do they cost beside plain Monte Carlo?

    python analysis/limits.py                  # 200 repeats of three designs, ten designs of the box; some twenty minutes
    python analysis/limits.py --repeats 20     # a look
    python analysis/limits.py --set study.accuracy.deviation=0.01 --truth 32768

Mean, deviation and 95th percentile of the paper's case 2, as `hpcclear run` finds them: scrambled Sobol sequences,
doubled until the accuracy asked for is met. Each repeat has replicates of its own; the truth is one long sequence.
"""

import argparse
from pathlib import Path

import numpy as np
from directly import run_of

from hpcclear.scene import Scene, load_scene
from hpcclear.scene.points import latin_hypercube
from hpcclear.scene.stages import REPLICATES
from hpcclear.statistics.random.replicates import student
from hpcclear.study import truth
from hpcclear.study.optimisation import Choice

JOB = Path(__file__).parents[1] / "jobs" / "robust_slider_crank.toml"
CASE = "robust"
DESIGNS = (
    Choice("the original", CASE, {"m2": 0.21, "m3": 0.14, "u2": 0.06, "I2": 2.5e-4}),
    Choice("least deviation", CASE, {"m2": 0.105, "m3": 0.07, "u2": 0.0654, "I2": 1.26e-4}),
    Choice("least mean", CASE, {"m2": 0.105, "m3": 0.07, "u2": 0.08, "I2": 1.26e-4}),
)
WORDS = ("mean", "deviation", "percentile")


def main() -> None:
    """Count how often limits hold, then compare costs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=200)
    parser.add_argument("--set", action="append", default=[], help="another entry of the job")
    parser.add_argument("--truth", type=int, default=2**17, help="simulations to compare with")
    words = parser.parse_args()
    scene = load_scene(JOB, words.set)
    for choice in DESIGNS:
        coverage(scene, choice, words.repeats, words.truth)
    cost(scene)


def coverage(scene: Scene, choice: Choice, repeats: int, most: int) -> None:
    """Print in how many repeats each limit holds."""
    run = run_of(scene)
    settings = run.study.verification
    whole = truth.results_of(run, [choice], truth.drawn(run, [choice], "truth", most // REPLICATES))
    exact = [float(whole[name][0]) for name in WORDS]
    held, spent = np.zeros(3, int), 0
    for k in range(repeats):
        made = truth.drawn(run, [choice], f"repeat {k}", truth.first_length(settings))
        found = truth.results_of(run, [choice], truth.made(run, [choice], made))
        spent += int(found["samples"][0])
        for j, name in enumerate(WORDS[:2]):
            held[j] += abs(found[name][0] - exact[j]) <= found[f"{name}_reach"][0]
        lower, upper = (found[f"percentile_{end}"][0] for end in ("lower", "upper"))
        held[2] += lower <= exact[2] <= upper
    counts = ", ".join(f"{name} {n}" for name, n in zip(WORDS, held, strict=True))
    print(
        f"{choice.name}: of {repeats} limits hold: {counts}; {spent // repeats} simulations each",
        flush=True,
    )


def cost(scene: Scene, designs: int = 10, count: int = 1024) -> None:
    """Print how many simulations plain Monte Carlo needs for the same limits."""
    run = run_of(scene)
    names = scene.required_study.design_variables(CASE)
    points = latin_hypercube(scene, designs, names=names, purpose="limits")
    rows = [
        Choice("", CASE, {name: float(points.column(name)[k]) for name in names})
        for k in range(designs)
    ]
    found = truth.results_of(run, rows, truth.drawn(run, rows, "cost", count // REPLICATES))
    draws = [truth.scattered(run, row, 4096, "draws", None) for row in rows]
    normal = student(0.95, 10**6)
    gains = []
    for k, one in enumerate(draws):
        f = run.simulations.objective(run.simulations.records(one, "draws"))
        steps = (f - np.nanmean(f)) ** 2
        spread = np.nanstd(f), np.nanstd(steps) / (2 * np.nanstd(f))  # of one draw
        reach = found["mean_reach"][k], found["deviation_reach"][k]
        gains.append([(normal * s / r) ** 2 / count for s, r in zip(spread, reach, strict=True)])
    middle, least = np.median(gains, axis=0), np.min(gains, axis=0)
    print(
        f"simulations of plain Monte Carlo for the same limits, over ours ({count}), {designs} designs of the box: "
        f"mean {middle[0]:.0f} (least {least[0]:.0f}), deviation {middle[1]:.0f} (least {least[1]:.0f}), medians"
    )


if __name__ == "__main__":
    main()

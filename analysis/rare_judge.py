"""Does the recommended design of a study keep its probability of failure? A judge of its own, by subset simulation.

    python analysis/rare_judge.py OUT scene.toml                      # carries the study out in OUT, then judges
    python analysis/rare_judge.py OUT scene.toml --most 1e-2 1e-3 1e-4 --simulations 100000

For each allowed probability the study is carried out (or found in OUT), and its recommended design is judged on random inputs
that the study never saw: `REPEATS` subset simulations, whose disagreement is the judge's error. Printed are the allowed
probability, what the study states, what the judge finds, and the first objective.

Source: S.-K. Au and J. L. Beck, "Estimation of small failure probabilities in high dimensions by subset simulation", Prob. Eng.
Mech. 16 (2001), doi:10.1016/S0266-8920(01)00019-4; conditional steps I. Papaioannou, W. Betz, K. Zwirglmaier and D. Straub,
"MCMC algorithms for subset simulation", Prob. Eng. Mech. 41 (2015), doi:10.1016/j.probengmech.2015.06.006.
"""

import argparse
import json
from pathlib import Path

import numpy as np
from directly import run_of

from hpcclear.report.merit import recommended
from hpcclear.results import dataset
from hpcclear.scene import Scene, load_scene
from hpcclear.statistics.random.replicates import student
from hpcclear.study import rare, run_study
from hpcclear.study.optimisation import Choice

REPEATS, SHARE, CORRELATION, LEVELS = 8, 0.1, 0.8, 9


def main() -> None:
    """Carry out, judge and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("scene")
    parser.add_argument("--most", type=float, nargs="*")
    parser.add_argument("--simulations", type=int, default=100_000)
    words = parser.parse_args()
    words.out.mkdir(exist_ok=True)
    scene = load_scene(words.scene)
    (case,) = scene.required_study.cases
    for most in words.most or [case.kept[0].most]:
        row = case.kept[0].model_dump(exclude_none=True) | {"most": most}
        changed = scene.with_({f"study.cases.{case.name}.constraints": [row]})
        judged(changed, words.out / f"{Path(words.scene).stem}_{most:g}", words.simulations)


def judged(scene: Scene, place: Path, simulations: int) -> None:
    """One study and its recommended design."""
    run_study(scene, place, progress_style="quiet")
    table = dataset.read(place / "verification.nc", "verification")
    best = table.sel(design=recommended(table))
    (case,) = scene.required_study.cases
    names = scene.required_study.design_variables(case.name)
    choice = Choice("", case.name, {name: float(best[name]) for name in names})
    kept = place / f"judge_{simulations}.json"
    if not kept.exists():
        each = [
            probability(scene, choice, simulations // REPEATS, np.random.default_rng([81, k]))
            for k in range(REPEATS)
        ]
        kept.write_text(json.dumps(each))
    each = np.array(json.loads(kept.read_text()))
    reach = student(0.95, REPEATS - 1) * each.std(ddof=1) / REPEATS**0.5
    print(f"allowed {case.kept[0].most:g}; study: {best['constraints'].item()}")
    first = float(best["first_true"])
    print(f"  judge {each.mean():.3g} ± {reach:.2g} (95 %); first objective {first:.4f}; {choice.design}")  # fmt: skip


def probability(scene: Scene, choice: Choice, simulations: int, rng: np.random.Generator) -> float:
    """The probability that f exceeds the limit of the first constraint, by one subset simulation of about that size."""
    run = run_of(scene)
    goal = scene.required_study.case(choice.case).kept[0]
    levels = 1.0 + max(np.log(goal.most) / np.log(SHARE), 0.0)
    count = int(simulations / (1.0 + (levels - 1.0) * (1.0 - SHARE)))
    size = len(scene.required_study.case(choice.case).random)

    def value(u: np.ndarray) -> np.ndarray:
        f = rare.simulated(run, [(choice, u)], "judge")[0][goal.place]
        return np.where(np.isfinite(f), f, -np.inf)

    u = rng.standard_normal((count, size))
    f, found = value(u), 1.0
    for _ in range(LEVELS):
        level = float(np.quantile(f, 1.0 - SHARE))
        if level >= goal.limit:
            break
        seeds = np.flatnonzero(f > level)
        found *= len(seeds) / len(f)
        u, f = u[seeds], f[seeds]
        chains_u, chains_f = [u], [f]
        for _ in range(count // len(seeds) - 1):
            moved = CORRELATION * u + (1.0 - CORRELATION**2) ** 0.5 * rng.standard_normal(u.shape)
            theirs = value(moved)
            good = theirs > level
            u, f = np.where(good[:, None], moved, u), np.where(good, theirs, f)
            chains_u.append(u)
            chains_f.append(f)
        u, f = np.concatenate(chains_u), np.concatenate(chains_f)
    return found * float((f > goal.limit).mean())


if __name__ == "__main__":
    main()

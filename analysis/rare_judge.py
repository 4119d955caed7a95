"""Does the recommended design of a study keep its probability of failure? A judge of its own, by subset simulation.

    python analysis/rare_judge.py OUT scene.toml                      # carries the study out in OUT, then judges
    python analysis/rare_judge.py OUT scene.toml --most 1e-2 1e-3 1e-4 --simulations 100000
    python analysis/rare_judge.py OUT                                 # `OWN` scenes; writes analysis/results/rare_scenes.csv
    python analysis/rare_judge.py OUT --only four_stroke press        # renews these rows of it

For each allowed probability the study is carried out (or found in OUT), and its recommended design is judged on random inputs
that the study never saw: `REPEATS` subset simulations, whose disagreement is the judge's error. Printed are the allowed
probability, what the study states, what the judge finds, the first objective, and how much of it is given away: to the best
design that is allowed, which is sought by a model of the reliability index over `WIDE` designs and then, by judging, between
designs that are allowed and not.

Source: S.-K. Au and J. L. Beck, "Estimation of small failure probabilities in high dimensions by subset simulation", Prob. Eng.
Mech. 16 (2001), doi:10.1016/S0266-8920(01)00019-4; conditional steps I. Papaioannou, W. Betz, K. Zwirglmaier and D. Straub,
"MCMC algorithms for subset simulation", Prob. Eng. Mech. 41 (2015), doi:10.1016/j.probengmech.2015.06.006.
"""

import argparse
import csv
import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import regret
from directly import run_of

from hpcclear.report.constraints import worded
from hpcclear.report.merit import recommended
from hpcclear.results import dataset
from hpcclear.scene import Scene, load_scene
from hpcclear.statistics.random.replicates import student
from hpcclear.statistics.random.tail import of_share
from hpcclear.study import rare, search, truth
from hpcclear.study.optimisation import Choice

REPEATS, SHARE, CORRELATION, LEVELS = 8, 0.1, 0.8, 9
LENGTH, ROUNDS = 64, 3
"""Points of each replicate that a limit is taken from, and designs of the judge's own search that it judges."""

HALVINGS, CLOSE = 4, 5e-4
"""Designs that are judged between one that is allowed and one that is not, at most, and the relative difference of their first
objective that is small enough."""

RESULTS = Path(__file__).parent / "results" / "rare_scenes.csv"
FIELDS = "scene", "f", "most", "stated", "judge", "error", "objective", "given_away", "simulations", "seconds"  # fmt: skip

OWN = {
    "torque": (1e-4, "m2 + m3"),
    "slider_crank": (1e-3, "0 - m2 - m3"),
    "quick_return": (3e-3, "0 - lever"),
    "four_stroke": (3e-4, "0 - rod - piston"),
    "press": (1e-2, "0 - ram"),
}
"""Studies of analysis/regret.py with a rare failure: its allowed probability, and what is made small."""

BRIEF = {"rtol": 1e-4, "transient_revolutions": 1, "averaged_revolutions": 1}
"""Short and loose simulations: how they are decided is tested, not what they say of a machine."""

VERIFICATION = {
    "designs": 2,
    "most_samples": 16384,
    "infill_rounds": 3,
    "infill_samples": 256,
    "infill_designs": 6,
}


def main() -> None:
    """Carry out, judge, print and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("scene", nargs="?")
    parser.add_argument("--most", type=float, nargs="*")
    parser.add_argument("--simulations", type=int, default=100_000)
    parser.add_argument("--only", nargs="*", default=list(OWN), help="of the `OWN` scenes")
    words = parser.parse_args()
    words.out.mkdir(exist_ok=True)
    if words.scene is None:
        for name in words.only:
            write({"scene": name} | judged(own(name), words.out / name, words.simulations))
        return
    scene = load_scene(words.scene)
    (case,) = scene.required_study.cases
    for most in words.most or [case.kept[0].most]:
        row = case.kept[0].model_dump(exclude_none=True) | {"most": most}
        changed = scene.with_({f"study.cases.{case.name}.constraints": [row]})
        judged(changed, words.out / f"{Path(words.scene).stem}_{most:g}", words.simulations)


def write(row: dict[str, Any]) -> None:
    """Renew a row of the results; those of other scenes stay."""
    rows = {}
    if RESULTS.exists():
        with RESULTS.open(newline="") as file:
            rows = {one["scene"]: one for one in csv.DictReader(file)}
    rows[row["scene"]] = row
    with RESULTS.open("w", newline="") as file:
        table = csv.DictWriter(file, FIELDS)
        table.writeheader()
        table.writerows(rows[name] for name in OWN if name in rows)


def own(name: str) -> Scene:
    """One of `OWN`. The limit is that of a normal f in the middle of the box."""
    most, objective = OWN[name]
    scene = regret.scene_of(name).with_({f"numerics.{key}": value for key, value in BRIEF.items()})
    (case,) = scene.required_study.cases
    choice = regret.choice_at(scene, [0.5] * len(scene.required_study.design_variables(case.name)))
    run = run_of(scene)
    made = truth.drawn(run, [choice], "limit", LENGTH)
    found = truth.results_of(run, [choice], made)
    limit = float(found["mean"][0] + of_share(most) * found["deviation"][0])
    row = {"statistic": "exceedance", "limit": float(f"{limit:.4g}"), "most": most}
    return scene.with_(
        {
            f"study.cases.{case.name}.objectives": [{"formula": objective}, "mean"],
            f"study.cases.{case.name}.constraints": [row],
            "study.samples": 80,
            "study.accuracy": None,
            "study.verification": VERIFICATION,
        }
    )


def judged(scene: Scene, place: Path, simulations: int) -> dict[str, Any]:
    """One study and its recommended design."""
    kept, begun = place / f"row_{simulations}.json", time.process_time()
    place, count = regret.carried_out(scene, place)
    if kept.exists():
        row: dict[str, Any] = json.loads(kept.read_text())
        return row
    seconds = time.process_time() - begun
    table = dataset.read(place / "verification.nc", "verification").to_xarray()
    best = table.sel(design=recommended(table))
    (case,) = scene.required_study.cases
    names = scene.required_study.design_variables(case.name)
    choice = Choice("", case.name, {name: float(best[name]) for name in names})
    each = np.array([
        probability(scene, choice, simulations // REPEATS, np.random.default_rng([81, k]))
        for k in range(REPEATS)
    ])  # fmt: skip
    reach = student(0.95, REPEATS - 1) * each.std(ddof=1) / REPEATS**0.5
    stated = "; ".join(worded(best))
    print(f"allowed {case.kept[0].most:g}; study: {stated}")
    first = float(best["first_true"])
    given = (first - best_allowed(scene, choice, float(each.mean()), simulations)) / abs(first)
    print(f"  judge {each.mean():.3g} ± {reach:.2g} (95 %); first objective {first:.4f}; {choice.design}")  # fmt: skip
    print(f"  given away {given:.2%}; {count} simulations, {seconds:.0f} s of one core", flush=True)
    row = {
        "f": scene.objective.name, "most": case.kept[0].most, "stated": stated,
        "judge": f"{each.mean():.3g}", "error": f"{reach:.2g}", "objective": f"{first:.5g}",
        "given_away": f"{given:.4f}", "simulations": count, "seconds": round(seconds, 1),
    }  # fmt: skip
    kept.write_text(json.dumps(row))
    return row


def best_allowed(scene: Scene, choice: Choice, share: float, simulations: int) -> float:
    """The least first objective that a probability of failure allows, of designs that were judged.

    A search on scatter of its own begins with the recommended design and is given four times the simulations. Designs are then
    judged between the best one that is allowed and the best one that is not (halving), all on the same random numbers.
    """
    case, names = scene.required_study.cases[0], list(choice.design)
    goal, place = case.kept[0], np.array(list(choice.design.values()))
    settings = scene.required_study.verification
    own = scene.with_({
        "study.seed": 83,
        "study.verification.infill_rounds": 2 * settings.infill_rounds,
        "study.verification.infill_samples": 2 * settings.infill_samples,
    })  # fmt: skip
    found, _ = search.searched(run_of(own), [choice])
    met = {goal.most >= share: (float(case.goals[0].of_design(choice.design)), place)}

    def judged(place: np.ndarray) -> float:
        """The share of a design, which takes the place of a worse one that is allowed or not as it is."""
        trial = Choice("", case.name, dict(zip(names, place.tolist(), strict=True)))
        found = np.mean([
            probability(scene, trial, simulations // REPEATS, np.random.default_rng([84, k]))
            for k in range(REPEATS // 2)
        ])  # fmt: skip
        least, kept = float(case.goals[0].of_design(trial.design)), bool(found <= goal.most)
        print(f"  tried: {trial.design}: {found:.3g}, objective {least:.5g}", flush=True)
        if kept not in met or least < met[kept][0] or not kept:
            met[kept] = least, place
        return float(found)

    for one in found[-ROUNDS:]:
        judged(np.array(list(one.design.values())))
    for _ in range(HALVINGS if len(met) == 2 else 0):
        (kept, inside), (broken, outside) = met[True], met[False]
        if kept - broken <= CLOSE * abs(kept):
            break
        judged((inside + outside) / 2.0)
    return met[True][0] if True in met else np.nan


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
        if not len(seeds):
            break  # the largest f is that of many: none is larger
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

"""Random scenes with random sets of effects: does the reduced scene stay within the tolerance, what is saved, at what cost?

python analysis/effects_kept.py --scenes 60      (three quarters of an hour on one core: most of it to compare with)
python analysis/effects_kept.py --linkages --scenes 20 -o results/linkages.jsonl      (four-bars and six-bars)

Each scene is a slider-crank of ordinary size (that of target_error.py) with a random set of effects, a random objective and a
study of its masses and clearances (1 um to 0.8 mm) with default sizes. The reduced scene is judged at points that the
certificate has not seen. Results are kept scene by scene, a line of JSON each; the same command goes on from there.
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np
from scenes import JOB
from target_error import random_linkage, random_scene

from hpcclear.base.arrays import Records
from hpcclear.base.errors import InputError
from hpcclear.base.objectives import asked
from hpcclear.dynamics.evaluation import evaluator_of
from hpcclear.ensemble.certificate import Asked
from hpcclear.ensemble.trial import CONFIDENCE, Trial, Wanted
from hpcclear.scene import Scene
from hpcclear.scene.points import Points
from hpcclear.statistics.random.paired import Change, deviation_change, mean_change
from hpcclear.study.extent import certificate_samples, samples_of

TOLERANCES = (0.01, 0.02, 0.05)
OBJECTIVES = (
    "mean-gap", "mean-gap of one joint", "mean-contact-force", "peak-crank-moment", "slider-acceleration-deviation",
)  # fmt: skip
FRESH = 4096  # replicates from here on the certificate never comes to


def scene_of(number: int, linkages: bool) -> tuple[str, float, Scene]:
    """Objective, tolerance and scene of a number."""
    rng = np.random.default_rng([2028, number])
    _, scene = random_linkage(number) if linkages else random_scene(number)
    free = not linkages and scene.drive.kind == "torque"  # whose moment is given
    objectives = OBJECTIVES[:-1] if linkages else OBJECTIVES
    objective = str(rng.choice([name for name in objectives if not (free and "moment" in name)]))
    changes: dict[str, object] = {
        "numerics.target_error": None,
        "numerics.transient_revolutions": 5,
        "numerics.averaged_revolutions": 5,
        "numerics.max_steps": 2_000_000,
        "effects.gravity": 9.81 if rng.random() < 0.7 else 0.0,
    }
    for name in scene.clearance_joints():  # from a fit without play to speak of to a worn bearing
        changes[f"{scene.joint_key(name)}.clearance"] = 10.0 ** rng.uniform(-6.0, -3.1)
    if not linkages:
        changes |= loads(scene, rng)
    if rng.random() < 0.3:
        changes["effects.friction"] = {"law": "none"}
    if objective.endswith("one joint"):
        changes["numerics.objective_joints"] = [str(rng.choice(scene.clearance_joints()))]
    changes["study"] = study(scene.with_(changes), objective.partition(" ")[0])
    return objective, TOLERANCES[number % 3], scene.with_(changes)


def loads(scene: Scene, rng: np.random.Generator) -> dict[str, object]:
    """What acts on the slider of a slider-crank, from a breath to as much as inertia."""
    crank = scene.slider_crank.crank.length
    free = scene.drive.kind == "torque"
    speed = scene.number("drive.initial_speed" if free else "drive.speed")
    changes: dict[str, object] = {}
    if rng.random() < 0.5:
        inertia = scene.slider_crank.slider.mass * crank * speed**2
        changes["effects.slider_load"] = inertia * 10.0 ** rng.uniform(-4.0, 0.0)
    if rng.random() < 0.5:
        changes["effects.guide_friction"] = {"coefficient": 10.0 ** rng.uniform(-3.0, -0.7)}
    return changes


def study(scene: Scene, objective: str) -> dict[str, object]:
    """Masses of two bodies as design variables, each clearance random by 20 %."""
    masses = [path for path in scene.numeric_paths() if path.endswith(".mass")][-2:]
    variables = {
        f"mass{k}": {"path": path, "range": [0.8 * scene.number(path), 1.25 * scene.number(path)]}
        for k, path in enumerate(masses)
    }
    random = {}
    for name in scene.clearance_joints():
        path = f"{scene.joint_key(name)}.clearance"
        own = scene.number(path)
        variables[f"C_{name}"] = {"path": path, "range": [0.7 * own, 1.4 * own]}
        random[f"C_{name}"] = {"distribution": "uniform", "half_width": 0.2 * own}
    return {
        "objective": objective, "variables": variables, "random": random, "cases": {"play": list(random)},
    }  # fmt: skip


class Simulated:
    """Simulates in this process and keeps apart what compiling took, s."""

    def __init__(self) -> None:
        self.compiling = self.samples = 0.0

    def __call__(self, scene: Scene, points: Points) -> Records:
        began = time.process_time()
        evaluator = evaluator_of(scene, points)
        evaluator.advance(0.0)
        ready = time.process_time()
        evaluator.submit(np.arange(len(points)), points.values)
        parts = []
        while evaluator.pending:
            parts.append(evaluator.advance(0.2))
        self.compiling += ready - began
        self.samples += time.process_time() - ready
        records = np.concatenate(parts)
        return asked(records[np.argsort(records["sample"])], scene.objective)


def judged(number: int, replicates: int, linkages: bool) -> dict[str, object]:
    """One scene: certificate, its cost, and the reduced scene at fresh points."""
    objective, tolerance, scene = scene_of(number, linkages)
    trial, spent = Trial(scene), Simulated()
    plan = trial.plan(Wanted(tolerance, certificate_samples(scene)))
    found = trial.certify(plan, spent)
    off = found.recommended
    seconds = trial.seconds([(), off]) if off else {}
    whole = spent.samples / sum(found.book.all(one).objective.size for one in found.variants)
    names = trial.names(off)
    saved = seconds["all on"] / seconds[" + ".join(names)] if off else 1.0
    size = sum(samples_of(scene).values())
    result: dict[str, object] = {
        "number": number, "objective": objective, "tolerance": tolerance, "off": list(names),
        "tried": [one.name for one in trial.switches], "times": saved, "size": size,
        "share": spent.samples / (size * (seconds.get("all on") or whole)),
        "share_compiled": (spent.samples + spent.compiling) / (size * (seconds.get("all on") or whole)),
        "untold": [trial.names(one)[0] for one in found.variants if len(one) == 1 and found.book.verdict(one) == 2],
    }  # fmt: skip
    if off:
        result |= truth(trial, off, replicates)
    return result


def truth(trial: Trial, off: tuple[int, ...], replicates: int) -> dict[str, object]:
    """Changes of mean and deviation at points that the certificate has not seen, with limits."""
    simulate, values = Simulated(), []
    for variant in ((), off):
        one = Asked(variant, FRESH, FRESH + replicates)
        records = simulate(trial.variant(variant).scene, trial.points(one))
        values.append(records["objective"].reshape(replicates, -1))
    changes = {
        "mean": mean_change(*values, CONFIDENCE), "deviation": deviation_change(*values, CONFIDENCE),
    }  # fmt: skip
    return {name: [change.value, change.limit] for name, change in changes.items()}


def summary(rows: list[dict]) -> None:
    """Print how many stay within, what is saved and what certificates cost."""
    within, surely, beyond = 0, 0, 0
    for row in rows:
        changes = [Change(*row[name]) for name in ("mean", "deviation") if name in row]
        within += all(abs(c.value) <= row["tolerance"] for c in changes)
        surely += all(c.within(row["tolerance"]) for c in changes)
        beyond += any(c.beyond(row["tolerance"]) for c in changes)
    times = np.array([row["times"] for row in rows])
    some = times[[bool(row["off"]) for row in rows]]
    print(f"scenes {len(rows)}; of {len(some)} something was left out")
    print(
        f"within the tolerance: {within} ({within / len(rows):.1%}), surely {surely}, surely beyond {beyond}"
    )
    print(
        f"times faster: median {np.median(times):.2f} of all, {np.median(some):.2f} where something went; "
        f"at most {times.max():.3g}"
    )
    for key, what in (("share", "simulations"), ("share_compiled", "with compiling")):
        share = np.array([row[key] for row in rows])
        print(
            f"cost over the study's, {what}: median {np.median(share):.2%}, at most {share.max():.2%}, "
            f"up to 5 %: {np.mean(share <= 0.05):.0%}"
        )
    for name in OBJECTIVES:
        own = [row["times"] for row in rows if row["objective"] == name]
        if own:
            print(f"  {name}: {len(own)}, median {np.median(own):.2f} times faster")


def main() -> None:
    """Judge the scenes that are not done yet, then sum up."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--scenes", type=int, default=60)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--linkages", action="store_true")
    parser.add_argument(
        "--replicates", type=int, default=256, help="of fresh points, a power of two"
    )
    parser.add_argument(
        "-o", "--output", type=Path, default=JOB.parent.parent / "results" / "effects_kept.jsonl"
    )
    options = parser.parse_args()
    options.output.parent.mkdir(parents=True, exist_ok=True)
    rows = (
        [json.loads(line) for line in options.output.read_text().splitlines()]
        if options.output.exists()
        else []
    )
    done = {row["number"] for row in rows}
    for number in range(options.first, options.first + options.scenes):
        if number in done:
            continue
        try:
            row = judged(number, options.replicates, options.linkages)
        except InputError as error:
            print(f"scene {number}: {error}", flush=True)
            continue
        rows.append(row)
        with options.output.open("a") as file:
            file.write(json.dumps(row) + "\n")
        print(
            number, row["objective"], f"{row['tolerance']:.0%}", row["off"], f"{row['times']:.2f} times",
            row.get("mean"), row.get("deviation"), flush=True,
        )  # fmt: skip
    summary(rows)


if __name__ == "__main__":
    main()

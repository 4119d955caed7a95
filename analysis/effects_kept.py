"""Random scenes with random sets of effects: does the reduced scene stay within the tolerance, what is saved, at what cost?

python analysis/effects_kept.py --scenes 60      (some hours on one core: most of it to compare with)
python analysis/effects_kept.py --linkages --scenes 20 -o results/linkages.jsonl      (four-bars and six-bars)

Each scene is a slider-crank of ordinary size (that of target_error.py) with a study of its masses and clearances with default
sizes, an objective drawn evenly among seven, and a tolerance of 1, 2 or 5 % in turn. Its effects are drawn on their own:

- play: 1 um to 0.8 mm (even in the logarithm) in a dry joint, 0.5 to 2 thousandths of the bearing's radius in one with oil
- oil in 40 % of the scenes, then in each joint with play with a chance of 70 %: 10 to 300 mPa s, bearings 0.3 to 1 diameters
  long, short and finite films alike
- friction: none 20 %, Coulomb 40 % (ramps of 0.3 to 10 mm/s), Ambrosio 15 %, bristles 25 % (that give way by 1 to 20 um)
- a rod that bends in 40 %, if as a round steel bar of its mass it is eight diameters long or more: 1 to 4 modes, damped by 0.2
  to 1 %
- waves around a dry bearing 15 % (where no rod bends), wear of a joint 20 %, gravity 70 %, a load on the slider 50 % (half of
  them as a table), friction of the guide 50 %

Contact laws and drives are those of target_error.py: a latched law in every fifth scene, guide friction in another, a torque
that drives the crank in another, one joint without play in another. The reduced scene is judged at points that the certificate
has not seen. Times are processor times of ensembles in lanes. Results are kept scene by scene, a line of JSON each; the same
command goes on from there.
"""

import argparse
import json
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from scenes import JOB
from target_error import random_linkage, random_scene

from hpcclear.base.arrays import Records
from hpcclear.base.errors import InputError
from hpcclear.base.objectives import asked
from hpcclear.base.verdict import Verdict, together
from hpcclear.dynamics.evaluation import evaluator_of
from hpcclear.ensemble.certificate import Certificate, VariantRequest
from hpcclear.ensemble.trial import CONFIDENCE, Trial, Wanted
from hpcclear.results.names import ALL_ON
from hpcclear.scene import Scene
from hpcclear.scene.points import Points
from hpcclear.statistics.random.paired import Change, deviation_change, mean_change
from hpcclear.study.stages import certificate_extent, samples_of

TOLERANCES = (0.01, 0.02, 0.05)
OBJECTIVES = (
    "mean-gap", "mean-gap of one joint", "mean-contact-force", "mean-contact-force of one joint", "peak-contact-force",
    "peak-crank-moment", "slider-acceleration-deviation",
)  # fmt: skip
STEEL, MODULUS = 7850.0, 206e9  # kg/m3, Pa
FRESH = 4096  # replicates from here on the certificate never comes to


def scene_of(number: int, linkages: bool) -> tuple[str, float, Scene]:
    """Objective, tolerance and scene of a number."""
    rng = np.random.default_rng([2029, number])
    _, scene = random_linkage(number) if linkages else random_scene(number)
    free = not linkages and scene.drive.kind == "torque"  # whose moment is given
    objectives = OBJECTIVES[:-1] if linkages else OBJECTIVES
    objective = str(rng.choice([name for name in objectives if not (free and "moment" in name)]))
    scene = scene.with_({
        "numerics.target_error": None,
        "numerics.transient_revolutions": 5,
        "numerics.averaged_revolutions": 5,
        "numerics.max_steps": 2_000_000,
        "effects.gravity": 9.81 if rng.random() < 0.7 else 0.0,
        **friction(scene, rng),
        **({} if linkages else loads(scene, rng) | bending(scene, rng)),
    })  # fmt: skip
    scene = scene.with_(joints(scene, rng))
    changes: dict[str, object] = {}
    if objective.endswith("one joint"):
        changes["numerics.objective_joints"] = [str(rng.choice(scene.clearance_joints()))]
    changes["study"] = study(scene, objective.partition(" ")[0])
    return objective, TOLERANCES[number % 3], scene.with_(changes)


def joints(scene: Scene, rng: np.random.Generator) -> dict[str, object]:
    """Of every joint: play, from a fit hardly with any to a worn bearing, or that of a bearing with oil; waves, wear."""
    oil = rng.random() < 0.4
    changes: dict[str, object] = {}
    for name in scene.clearance_joints():
        key, radius = scene.joint_key(name), scene.clearance_joint(name).bearing_radius
        draws, clearance = rng.random(5), 10.0 ** rng.uniform(-6.0, -3.1)
        if oil and draws[0] < 0.7:
            clearance = radius * 10.0 ** rng.uniform(-3.3, -2.7)
            changes[f"{key}.film"] = {
                "viscosity": 10.0 ** rng.uniform(-2.0, -0.5),
                "length": 2.0 * radius * rng.uniform(0.3, 1.0),
                "model": "short" if draws[1] < 0.5 else "finite",
                "roughness": min(1e-6, 0.1 * clearance),
            }
        elif draws[2] < 0.15 and not scene.bending():
            wave = {f"cosine_{rng.integers(2, 5)}": clearance * rng.uniform(0.01, 0.1)}
            changes[f"{key}.out_of_round"] = {"bearing": wave}
        if draws[3] < 0.2:
            changes[f"{key}.wear"] = {"length": radius, "bearing": {"coefficient": 1e-15}}
        changes[f"{key}.clearance"] = clearance
    return changes


def friction(scene: Scene, rng: np.random.Generator) -> dict[str, object]:
    """Friction in the joints by one of four laws, with the coefficient that the scene has."""
    coefficient, draw = scene.number("effects.friction.coefficient"), rng.random()
    law: dict[str, object] = {"law": "none"}
    if draw < 0.4:
        law = {
            "law": "coulomb",
            "coefficient": coefficient,
            "ramp_speed": 10.0 ** rng.uniform(-3.5, -2.0),
        }
    elif draw < 0.55:
        law = {"law": "ambrosio", "coefficient": coefficient, "speeds": [1e-3, 1e-2]}
    elif draw < 0.8:
        static = 1.5 * coefficient
        law = {
            "law": "lugre", "coefficient": coefficient, "static_coefficient": static, "stribeck_speed": 0.01,
            "bristle_stiffness": static / 10.0 ** rng.uniform(-6.0, -4.7),
        }  # fmt: skip
    return {"effects.friction": law}


def bending(scene: Scene, rng: np.random.Generator) -> dict[str, object]:
    """The rod as a round bar of steel, if it is slender."""
    drawn, modes, damping = rng.random() < 0.4, int(rng.integers(1, 5)), rng.uniform(0.002, 0.01)
    rod = scene.slider_crank.rod
    section = rod.mass / (STEEL * rod.length)
    if not drawn or rod.length < 8.0 * (4.0 * section / np.pi) ** 0.5:
        return {}
    stiffness = MODULUS * section**2 / (4.0 * np.pi)
    return {"mechanism.rod.bending": {"stiffness": stiffness, "modes": modes, "damping": damping}}


def loads(scene: Scene, rng: np.random.Generator) -> dict[str, object]:
    """What acts on the slider of a slider-crank, from a breath to as much as inertia."""
    crank = scene.slider_crank.crank.length
    free = scene.drive.kind == "torque"
    speed = scene.number("drive.initial_speed" if free else "drive.speed")
    changes: dict[str, object] = {}
    if rng.random() < 0.5:
        inertia = scene.slider_crank.slider.mass * crank * speed**2
        size = inertia * 10.0 ** rng.uniform(-4.0, 0.0)
        stroke = [[0.0, size], [0.8, 0.5 * size], [3.0, 0.1 * size], [5.5, 0.3 * size]]
        changes["effects.slider_load"] = size if rng.random() < 0.5 else stroke
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
    plan = trial.plan(Wanted(tolerance, *certificate_extent(scene)))
    found = trial.certify(plan, spent)
    off = found.recommended
    began = time.process_time()
    seconds = trial.seconds(found.variants)
    timing = time.process_time() - began
    names = trial.names(off)
    saved = seconds[ALL_ON] / seconds[" + ".join(names) or ALL_ON]
    size = sum(samples_of(scene).values())
    whole = size * seconds[ALL_ON]
    result: dict[str, object] = {
        "number": number, "objective": objective, "tolerance": tolerance, "off": list(names),
        "effects": list(scene.effects_on()), "times": saved if off else 1.0, "size": size,
        "milliseconds": 1e3 * seconds[ALL_ON], "share": spent.samples / whole,
        "share_timing": timing / whole, "share_compiled": (spent.samples + spent.compiling + timing) / whole,
        "variants": [told(trial, found, one, seconds) for one in found.variants[1:]],
    }  # fmt: skip
    if off:
        result |= truth(trial, off, replicates)
    return result


def told(
    trial: Trial, found: Certificate, off: tuple[int, ...], seconds: dict[str, float]
) -> list[object]:
    """Of a variant: names, verdict, samples, times faster by processor time and by work, changes with limits."""
    book, names = found.book, " + ".join(trial.names(off))
    changes = [[one.value, one.limit] for one in book.changes(off)[:2]]
    faster = seconds[ALL_ON] / seconds[names], 1.0 / book.work(off)
    return [names, int(book.verdict(off)), book.all(off).objective.size, *faster, changes]


def truth(trial: Trial, off: tuple[int, ...], replicates: int) -> dict[str, object]:
    """Changes of mean and deviation at points that the certificate has not seen, with limits."""
    simulate, values = Simulated(), []
    for variant in ((), off):
        one = VariantRequest(variant, FRESH, FRESH + replicates)
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
        verdict = together([c.verdict(row["tolerance"]) for c in changes])
        surely, beyond = surely + (verdict is Verdict.HOLDS), beyond + (verdict is Verdict.FAILS)
    times = np.array([row["times"] for row in rows])
    some = times[[bool(row["off"]) for row in rows]]
    print(f"scenes {len(rows)}; of {len(some)} something was left out")
    print(
        f"within the tolerance: {within} ({within / len(rows):.1%}), surely {surely}, surely beyond {beyond}"
    )
    print(
        f"times faster: quartiles {', '.join(f'{q:.2f}' for q in np.quantile(times, (0.25, 0.5, 0.75)))} of all, "
        f"{np.median(some):.2f} in the middle where something went; "
        f"at most {times.max():.3g}"
    )
    for key, what in (
        ("share", "simulations"),
        ("share_timing", "timing"),
        ("share_compiled", "all, with compiling"),
    ):
        share = np.array([row[key] for row in rows])
        print(
            f"cost over the study's, {what}: in the middle {np.median(share):.2%}, at most {share.max():.2%}, "
            f"up to 5 %: {np.mean(share <= 0.05):.0%}"
        )
    for name in OBJECTIVES:
        own = [row["times"] for row in rows if row["objective"] == name]
        if own:
            print(f"  {name}: {len(own)}, median {np.median(own):.2f} times faster")


def going_on(
    output: Path, numbers: range, judge: Callable[[int], dict], told: Sequence[str]
) -> list[dict]:
    """A row of each scene, from a file with a line of JSON each or judged now and added to it; what is `told` is printed."""
    output.parent.mkdir(parents=True, exist_ok=True)
    output.touch()
    rows = [json.loads(line) for line in output.read_text().splitlines()]
    done = {row["number"] for row in rows}
    for number in numbers:
        if number in done:
            continue
        try:
            row = judge(number)
        except InputError as error:
            print(f"scene {number}: {error}", flush=True)
            continue
        rows.append(row)
        with output.open("a") as file:
            file.write(json.dumps(row) + "\n")
        print(*(row[name] for name in told if name in row), flush=True)
    return rows


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
    rows = going_on(
        options.output,
        range(options.first, options.first + options.scenes),
        lambda number: judged(number, options.replicates, options.linkages),
        ("number", "objective", "tolerance", "off", "times", "mean", "deviation"),
    )
    summary(rows)


if __name__ == "__main__":
    main()

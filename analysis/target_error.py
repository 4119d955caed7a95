"""Random scenes, three target errors each: is what is called met met, do limits hold a mean that was bought apart from them?

python analysis/target_error.py --scenes 200      (two hours on one core: most of it for the means to compare with)
python analysis/target_error.py --first 40 --scenes 10 -o results/some.jsonl
python analysis/target_error.py --linkages --scenes 60      (four-bars and six-bars)

Results are kept scene by scene, a line of JSON each; the same command goes on from there.
"""

import argparse
import json
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scenes import JOB

from hpcclear.base.errors import InputError
from hpcclear.base.outcome import Flag, Regime, Status
from hpcclear.dynamics.evaluation import evaluate_records
from hpcclear.dynamics.evaluation.steady.copies import perturbed, scales
from hpcclear.dynamics.evaluation.steady.judging import objective
from hpcclear.dynamics.layout.views import Start
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.problem import problem_of
from hpcclear.dynamics.setup.start import start_states
from hpcclear.dynamics.stepping.lanes import Lanes
from hpcclear.scene import Scene, load_scene
from hpcclear.scene.points import Points

TARGETS = (1e-2, 1e-3, 1e-4)
LINKAGES = {"four-bar": "crank_rocker", "six-bar": "press"}
KINDS = ("two clearances", "one clearance", "latched", "torque drive", "guide friction")
NOTHING = Points((), np.empty((1, 0)), ())


def random_scene(number: int) -> tuple[str, Scene]:
    """An engine, a pump or a press of ordinary size; its kind goes by its number."""
    rng = np.random.default_rng([2026, number])
    kind = KINDS[number % len(KINDS)]
    crank = rng.uniform(0.02, 0.12)
    rod = crank * rng.uniform(2.2, 4.5)
    crank_mass, rod_mass, slider_mass = (
        10.0 ** rng.uniform(-1.0, 0.8) * w for w in (1.0, 0.6, 0.6)
    )
    speed = 10.0 ** rng.uniform(np.log10(500.0), np.log10(6000.0)) * np.pi / 30.0
    changes: dict[str, object] = {
        "mechanism.crank.length": crank,
        "mechanism.crank.mass": crank_mass,
        "mechanism.crank.mass_center": crank * rng.uniform(0.0, 0.6),
        "mechanism.crank.inertia": crank_mass * crank**2 * rng.uniform(0.1, 0.6),
        "mechanism.rod.length": rod,
        "mechanism.rod.mass": rod_mass,
        "mechanism.rod.mass_center": rod * rng.uniform(0.2, 0.6),
        "mechanism.rod.inertia": rod_mass * rod**2 * rng.uniform(0.05, 0.2),
        "mechanism.slider.mass": slider_mass,
        "drive": {"kind": "constant-speed", "speed": speed},
        "effects.gravity": 9.81,
        "effects.contact": {"law": "hunt-crossley", "damping": 10.0 ** rng.uniform(-1.3, 0.7)},
        "effects.friction": {
            "law": "coulomb",
            "coefficient": float(rng.choice([0.005, 0.02, 0.1])),
            "ramp_speed": 0.01,
        },
    }
    modulus = 10.0 ** rng.uniform(8.5, 11.0)
    for joint in ("crank_rod", "rod_slider"):
        changes[f"joints.{joint}.clearance"] = 10.0 ** rng.uniform(-5.0, -3.1)
        changes[f"joints.{joint}.bearing_radius"] = rng.uniform(0.008, 0.03)
        changes[f"joints.{joint}.bearing.youngs_modulus"] = modulus
    if kind == "one clearance":
        changes = {k: v for k, v in changes.items() if not k.startswith("joints.rod_slider")}
        changes["joints.rod_slider"] = {"kind": "ideal"}
    if kind == "latched":
        law = str(rng.choice(["lankarani-nikravesh", "flores"]))
        changes["effects.contact"] = {"law": law, "restitution": rng.uniform(0.3, 0.9)}
    if kind == "guide friction":
        changes["effects.guide_friction"] = {
            "coefficient": rng.uniform(0.02, 0.15),
            "ramp_speed": 0.01,
        }
    if kind == "torque drive":
        torque = slider_mass * (crank * speed) ** 2 * rng.uniform(-0.002, 0.01)
        changes["drive"] = {"kind": "torque", "torque": torque, "initial_speed": speed}
        changes["mechanism.crank.inertia"] = crank_mass * crank**2 * rng.uniform(2.0, 8.0)
    return kind, load_scene(JOB.parent / "hunt_crossley.toml").with_(changes)


def random_linkage(number: int) -> tuple[str, Scene]:
    """A four-bar or a six-bar of ordinary size that closes, with play in two joints."""
    kind = tuple(LINKAGES)[number % len(LINKAGES)]
    scene = load_scene(JOB.parent / "linkages" / f"{LINKAGES[kind]}.toml").with_({"study": None})
    for attempt in range(100):
        rng = np.random.default_rng([2027, number, attempt])
        try:
            made = scene.with_(linkage_changes(scene, rng))
            start_states(made, parameters(made))
        except InputError:
            continue  # does not close, or does not turn round
        return kind, made
    raise InputError("scene", number, "no linkage found that closes", "widen what is drawn")


def linkage_changes(scene: Scene, rng: np.random.Generator) -> dict[str, object]:
    """Lengths 10 % about those of the scene, masses and inertias up to threefold, play, speed, contact and friction."""
    tables = scene.linkage
    changes: dict[str, object] = {
        "numerics.target_error": None,
        "numerics.max_steps": 10**9,
        "effects.contact": {"law": "hunt-crossley", "damping": 10.0 ** rng.uniform(-1.3, 0.7)},
        "effects.friction": {
            "law": "coulomb",
            "coefficient": float(rng.choice([0.005, 0.02, 0.1])),
            "ramp_speed": 0.01,
        },
        "mechanism.drives.motor.speed": 10.0 ** rng.uniform(np.log10(200.0), np.log10(2000.0)) * np.pi / 30.0,
    }  # fmt: skip
    for body in tables.bodies:
        path = f"mechanism.bodies.{body.name}"
        if body.length is not None:
            changes[f"{path}.length"] = body.length * rng.uniform(0.9, 1.1)
        weight = 10.0 ** rng.uniform(-0.5, 0.5)
        changes[f"{path}.mass"] = body.mass * weight
        if body.inertia:
            changes[f"{path}.inertia"] = body.inertia * weight
    for joint in scene.clearance_joints():
        changes[f"{scene.joint_key(joint)}.clearance"] = 10.0 ** rng.uniform(-5.0, -3.5)
    return changes


def truth(scene: Scene, rtol: float) -> tuple[float, float, int]:
    """Mean of f after a long spin-up, its relative standard error, copies it is made of.

    Eight copies over twice 64 revolutions where these all agree to 1e-6, else 64 copies over 300.
    """
    torque = scene.drive is not None and scene.drive.kind == "torque"
    spin_up = 1000 if torque else 200
    first, start = _long(scene, rtol, 8, spin_up, 64)
    second, _ = _long(scene, rtol, 8, 0, 64, start)
    f = np.concatenate([first, second])
    if len(f) == 16 and np.ptp(f) < 1e-6 * f.mean():
        return float(second.mean()), float(np.ptp(f) / f.mean()), 8
    first, start = _long(scene, rtol, 64, spin_up // 2 if spin_up < 1000 else 1000, 150)
    second, _ = _long(scene, rtol, 64, 0, 150, start)
    if len(first) < 3 or len(second) < len(first):
        return np.nan, np.nan, len(second)
    f = 0.5 * (first + second)
    moved = float((second - first).mean())
    doubt = float((second - first).std(ddof=1)) / len(f) ** 0.5
    if abs(moved) > max(4.0 * doubt, 1e-5 * f.mean()):
        return np.nan, np.nan, len(f)  # still on its way: nobody knows
    return float(f.mean()), float(f.std(ddof=1) / len(f) ** 0.5 / f.mean()), len(f)


def _long(
    scene: Scene,
    rtol: float,
    copies: int,
    spin_up: int,
    revolutions: int,
    start: Start | None = None,
) -> tuple[np.ndarray, Start]:
    """f of the copies that ended, over so many revolutions, and where they are then."""
    par = parameters(scene)
    if start is None:
        start = perturbed(
            start_states(scene, par), scales(scene, par[0]), range(1000, 1000 + copies)
        )
    numerics = {
        "rtol": rtol,
        "atol": None,
        "transient_revolutions": spin_up,
        "averaged_revolutions": revolutions,
    }
    problem = problem_of(scene.with_({f"numerics.{k}": v for k, v in numerics.items()}))
    outcome = Lanes(problem, 16).run(np.repeat(par, len(start), axis=0), start)
    outcome = outcome[outcome.status == Status.OK]
    return objective(outcome.mean_gap), outcome.end()


def measured(
    number: int,
    rtol: float,
    known: dict[str, Any] | None,
    drawn: Callable[[int], tuple[str, Scene]] = random_scene,
) -> dict[str, Any]:
    """What three targets come to on one scene; its truth is taken from earlier results, if there are any."""
    try:
        kind, scene = drawn(number)
    except InputError as error:
        return {"scene": number, "refused": str(error)}
    began = time.process_time()
    if known is None or "truth" not in known:
        mean, error, ended = truth(scene, rtol)
    else:
        mean, error, ended = (known[f"truth{what}"] for what in ("", "_error", "_copies"))
    found: dict[str, Any] = {
        "scene": number, "kind": kind, "truth": mean, "truth_error": error, "truth_copies": ended,
        "truth_seconds": time.process_time() - began, "targets": [],
    }  # fmt: skip
    for target in TARGETS:
        began = time.process_time()
        record = evaluate_records(scene.with_({"numerics.target_error": target}), NOTHING)[0]
        found["targets"].append({
            "target": target, "verdict": judged(record, mean, error, rtol),
            "regime": Regime(int(record["regime"])).name.lower(),
            "off": float(record["objective"]) / mean - 1.0,
            "limit": float(record["objective_limit"]) / float(record["objective"]),
            "revolutions": int(np.nan_to_num(record["steady_revolutions"])),
            "seconds": time.process_time() - began,
        })  # fmt: skip
    return found


def told(found: dict[str, Any]) -> str:
    """A scene, a line for each target."""
    if "refused" in found:
        return f"{found['scene']:4} refused: {found['refused']}"
    return "\n".join(
        f"{found['scene']:4} {found['kind']:15} {row['target']:.0e} {row['regime']:9} {row['verdict']:20} "
        f"off {row['off']:+.1e} limit {row['limit']:.1e} truth +- {found['truth_error']:.0e} "
        f"({found['truth_copies']}) {row['revolutions']:6} revolutions {row['seconds']:7.2f} s"
        for row in found["targets"]
    )


def read(path: Path | None) -> dict[int, dict[str, Any]]:
    """Results by scene."""
    lines = [] if path is None else path.read_text().splitlines()
    return {found["scene"]: found for found in map(json.loads, lines)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=200)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument(
        "--rtol", type=float, default=1e-7, help="tolerance of the means to compare with"
    )
    parser.add_argument(
        "--truth", type=Path, help="earlier results whose means to compare with are taken"
    )
    parser.add_argument("--linkages", action="store_true", help="four-bars and six-bars")
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()
    drawn = random_linkage if options.linkages else random_scene
    name = "target_error_linkages" if options.linkages else "target_error"
    options.output = options.output or Path(f"results/{name}.jsonl")
    options.output.parent.mkdir(exist_ok=True)
    options.output.touch()
    known, earlier = read(options.output), read(options.truth)
    scenes = []
    for number in range(options.first, options.first + options.scenes):
        if number not in known:
            known[number] = measured(number, options.rtol, earlier.get(number), drawn)
            with options.output.open("a") as file:
                file.write(json.dumps(known[number]) + "\n")
        scenes.append(known[number])
        print(told(known[number]), flush=True)
    rows = [
        row | {"truth_error": found["truth_error"], "kind": found["kind"]}
        for found in scenes
        for row in found.get("targets", [])
    ]
    summary(rows, "all")
    for kind in LINKAGES if options.linkages else KINDS:
        summary([row for row in rows if row["kind"] == kind], kind)
    for regime in sorted({row["regime"] for row in rows}):
        summary([row for row in rows if row["regime"] == regime], regime)


def summary(rows: list[dict[str, Any]], what: str) -> None:
    """Verdicts counted, and the share of stated limits that hold."""
    counts = Counter(row["verdict"] for row in rows)
    held = counts["met, held"] + counts["missed, held"]
    stated = held + counts["met, not held"] + counts["missed, not held"]
    said = ", ".join(f"{count} {verdict}" for verdict, count in counts.most_common())
    print(
        f"{what}: {len(rows)} answers: {said}; limits hold in {held} of {stated}: {held / max(stated, 1):.3f}"
    )
    met = [row for row in rows if row["verdict"].startswith("met, ")]
    kept = [
        row for row in met if abs(row["off"]) <= np.hypot(row["target"], 2.0 * row["truth_error"])
    ]
    print(
        f"    called met and within the target: {len(kept)} of {len(met)}: {len(kept) / max(len(met), 1):.3f}"
    )


def judged(record: np.void, mean: float, error: float, rtol: float) -> str:
    """Met or missed, and whether stated limits hold the truth: what is compared is known no better itself.

    Limits of a difference of two independent means: their own two, in quadrature; and ten tolerances of the truth.
    """
    if record["status"] != Status.OK:
        return "failed"
    missed = bool(record["flags"] & Flag.TARGET_MISSED)
    if not np.isfinite(record["objective_limit"]):
        return "no limits" if missed else "met without limits"
    if not np.isfinite(mean):
        return "no truth"
    allowed = np.hypot(record["objective_limit"], 2.0 * error * mean) + 10.0 * rtol * mean
    held = abs(record["objective"] - mean) <= allowed
    return f"{'missed' if missed else 'met'}, {'held' if held else 'not held'}"


if __name__ == "__main__":
    main()

"""Random scenes, three target errors each: is what is called met met, do limits hold a mean bought at a hundred times the cost?

python analysis/target_error.py --scenes 200      (hours on one core: most of it for the means to compare with)
python analysis/target_error.py --first 40 --scenes 10
"""

import argparse
import time
from collections import Counter

import numpy as np
from scenes import JOB

from hpcclear.base.errors import InputError
from hpcclear.base.outcome import Flag, Regime, Status
from hpcclear.dynamics.evaluation import evaluate_records
from hpcclear.dynamics.lanes import Lanes
from hpcclear.dynamics.parameters import parameters
from hpcclear.dynamics.problem import problem_of
from hpcclear.dynamics.revolutions import objective
from hpcclear.dynamics.start import start_states
from hpcclear.dynamics.steady.copies import kicked, scales
from hpcclear.scene import Scene, load_scene
from hpcclear.scene.points import Points

TARGETS = (1e-2, 1e-3, 1e-4)
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


def truth(scene: Scene, rtol: float) -> tuple[float, float, int]:
    """Mean of f over 64 copies of 300 revolutions after a spin-up, its relative standard error, copies that ended."""
    par = parameters(scene)
    start = kicked(start_states(scene, par), scales(scene), range(1000, 1064))
    spin_up = 1000 if scene.drive.kind == "torque" else 100
    numerics = {
        "rtol": rtol,
        "atol": None,
        "transient_revolutions": spin_up,
        "averaged_revolutions": 300,
    }
    problem = problem_of(scene.with_({f"numerics.{k}": v for k, v in numerics.items()}))
    outcome = Lanes(problem, 16).run(np.repeat(par, 64, axis=0), start)
    gaps = outcome.mean_gap[outcome.status == Status.OK]
    if len(gaps) < 3:
        return np.nan, np.nan, len(gaps)
    mean = float(objective(gaps.mean(axis=0)))
    return mean, float(objective(gaps).std(ddof=1) / len(gaps) ** 0.5 / mean), len(gaps)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=200)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument(
        "--rtol", type=float, default=1e-7, help="tolerance of the means to compare with"
    )
    options = parser.parse_args()
    counts: Counter[str] = Counter()
    for number in range(options.first, options.first + options.scenes):
        try:
            kind, scene = random_scene(number)
        except InputError as error:
            print(f"{number:4} refused: {error}")
            continue
        mean, error, ended = truth(scene, options.rtol)
        for target in TARGETS:
            began = time.perf_counter()
            record = evaluate_records(scene.with_({"numerics.target_error": target}), NOTHING)[0]
            seconds = time.perf_counter() - began
            verdict = judged(record, mean, error, options.rtol)
            counts[verdict] += 1
            off = float(record["objective"]) / mean - 1.0
            limit = float(record["objective_limit"]) / float(record["objective"])
            regime = Regime(int(record["regime"])).name.lower()
            spent = int(np.nan_to_num(record["steady_revolutions"]))
            print(
                f"{number:4} {kind:15} {target:.0e} {regime:9} {verdict:20} off {off:+.1e} limit {limit:.1e} "
                f"truth +- {error:.0e} ({ended}) {spent:6} revolutions {seconds:7.2f} s",
                flush=True,
            )
    stated = (
        counts["met, held"]
        + counts["met, not held"]
        + counts["missed, held"]
        + counts["missed, not held"]
    )
    held = counts["met, held"] + counts["missed, held"]
    print(dict(counts))
    print(f"limits hold the truth in {held} of {stated}: {held / max(stated, 1):.3f}")


def judged(record: np.void, mean: float, error: float, rtol: float) -> str:
    """Met or missed, and whether stated limits hold the truth (two standard errors and ten tolerances of its own)."""
    if record["status"] != Status.OK:
        return "failed"
    missed = bool(record["flags"] & Flag.TARGET_MISSED)
    if not np.isfinite(record["objective_limit"]):
        return "no limits" if missed else "met without limits"
    if not np.isfinite(mean):
        return "no truth"
    allowed = record["objective_limit"] + (2.0 * error + 10.0 * rtol) * mean
    held = abs(record["objective"] - mean) <= allowed
    return f"{'missed' if missed else 'met'}, {'held' if held else 'not held'}"


if __name__ == "__main__":
    main()

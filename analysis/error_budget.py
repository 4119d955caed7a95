"""Random small studies of which an accuracy is asked: is it reached, and at how much more than the cheapest split costs?

python analysis/error_budget.py --studies 40      (half an hour on one core: nearly all of it to compare with)

Each study has a slider-crank of its own, one or two joints with play, and asks 0.8 to 4 % of mean and deviation. The truth of
its alpha and beta is 16 384 simulations by fresh scramblings at a tolerance of 1e-8. The cheapest split is found
with hindsight: of all tolerances and powers of two of simulations, each design its own, the least that keeps both
moments of both within what was asked in 95 % of all scramblings. Costs are evaluations of the equations of motion: of
these two designs alone, and of the whole study, to which the pilot counts on our side only. Results are kept study by
study, a line of JSON each; the same command goes on from there.
"""

import argparse
import json
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from scenes import JOB
from scipy.special import ndtr

from hpcclear.base.arrays import Array
from hpcclear.base.outcome import Status
from hpcclear.ensemble.simulate import sample_points
from hpcclear.ranks.boundary import alone
from hpcclear.results import dataset
from hpcclear.scene import Scene, load_scene
from hpcclear.scene.points import Points
from hpcclear.scene.sampling import monte_carlo
from hpcclear.statistics.random.replicates import moments
from hpcclear.study import run_study, simulations

SCRAMBLINGS, LONGEST = 64, 256  # of the truth; a verified design has 16
RUNGS = tuple(10.0**-k for k in range(3, 8))
TRUTH = 1e-8
PAIRS = 64  # of each scrambling, that tell the bias of a rung
ENDS = ("alpha", "beta")


def scene_of(number: int) -> Scene:
    """The study of a number."""
    rng = np.random.default_rng([2029, number])
    low = 10.0 ** rng.uniform(-4.3, -3.3)
    clearance = [low, low * rng.uniform(1.5, 4.0)]
    both = rng.random() < 0.5
    changes: dict[str, Any] = {
        "drive.speed": float(rng.uniform(80.0, 630.0)),
        "effects.contact.restitution": float(rng.uniform(0.5, 0.95)),
        "effects.friction.coefficient": float(10.0 ** rng.uniform(-3.0, -1.0)),
        "numerics.transient_revolutions": int(rng.integers(1, 4)),
        "numerics.averaged_revolutions": int(rng.integers(1, 5)),
        "joints.crank_rod.clearance": low, "joints.rod_slider.clearance": low,
    }  # fmt: skip
    paths = ["joints.rod_slider.clearance"]
    if both:
        paths.append("joints.crank_rod.clearance")
    else:
        changes["joints.crank_rod"] = {"kind": "ideal"}
        del changes["joints.crank_rod.clearance"]
    variables: dict[str, Any] = {
        "m2": {"range": [0.105, 0.42]}, "m3": {"range": [0.07, 0.28]}, "u2": {"range": [0.02, 0.1]},
    }  # fmt: skip
    for name in rng.permutation(list(variables))[: int(rng.integers(0, 2))]:
        del variables[str(name)]
    variables["play"] = {"paths": paths, "range": clearance}
    random: dict[str, Any] = {"play": {"distribution": "uniform", "range": clearance}}
    for name, width in (("m2", 0.02), ("m3", 0.01), ("u2", 0.005)):
        if name in variables and rng.random() < 0.5:
            random[name] = {"distribution": "uniform", "half_width": width}
    changes["study"] = {
        "seed": number, "samples": 40, "test_samples": 10,
        "accuracy": float(10.0 ** rng.uniform(np.log10(0.008), np.log10(0.04))),
        "variables": variables, "random": random, "cases": {"play": list(random)},
        "sensitivity": {"groups": []},
        "surrogate": {"models": [], "r2": 0.5, "resamplings": 0, "cuts": 0, "restarts": 0},
        "swarm": {"particles": 20, "iterations": 15, "runs": 1, "archive": 20},
        "verification": {
            "designs": 2, "most_samples": 2048, "infill_rounds": 2, "infill_designs": 6, "response_windows": 2,
            "response_copies": 2, "response_revolutions": 1, "audit_samples": 0,
        },
    }  # fmt: skip
    return load_scene(JOB.with_name("quickstart.toml")).with_({"study": None}).with_(changes)


class Counted:
    """`sample_points`, which counts evaluations by stage and tolerance."""

    def __init__(self) -> None:
        self.evaluations: Counter[tuple[str, float]] = Counter()

    def __call__(self, *arguments: Any, **named: Any) -> np.ndarray:
        records = sample_points(*arguments, **named)
        stage = named["stage"].partition("-")[0].partition(":")[0]
        rtol = arguments[0].numerics.rtol
        self.evaluations[stage, rtol] += int(records["rhs_evaluations"].sum())
        return records


def judged(number: int) -> dict[str, Any]:
    """One study: what it came to, the truth, and the cheapest split."""
    scene, counted = scene_of(number), Counted()
    told: list[str] = []
    pilot = Counted()
    from hpcclear.study import budget

    simulations.sample_points, budget.sample_points = counted, pilot  # type: ignore[attr-defined]
    try:
        with tempfile.TemporaryDirectory() as place:
            run_study(scene, Path(place) / "it", alone(), progress_style="quiet", tell=told.append)
            verified = dataset.read(Path(place) / "it" / "verification.nc")
            split = dataset.read(Path(place) / "it" / "budget.nc")
    finally:
        simulations.sample_points = budget.sample_points = sample_points  # type: ignore[attr-defined]
    asked = scene.required_study.accuracy.mean
    rung = float(split["rtol"][int(np.flatnonzero(split["chosen"])[0])])
    names = [f"play {end}" for end in ENDS]
    found, prices, errors = [], [], []
    known: dict[tuple[float, ...], dict[str, Any]] = {}  # alpha may be beta
    for name in names:
        own = verified.sel(design=name)
        design = {n: float(own[n]) for n in scene.required_study.design_variables("play")}
        truth = known.setdefault(tuple(design.values()), {}) or true(scene, design, rung)
        known[tuple(design.values())] = truth
        found.append([abs(float(own[f"{m}_true"]) / truth["value"][k] - 1.0)
                      for k, m in enumerate(("mean", "deviation"))])  # fmt: skip
        errors.append([float(one) for one in truth["error"]])
        prices.append(truth)
    points = [int(n) for n in verified["samples"].sel(design=names)]
    each = {r: float(np.mean([one["evaluations"][r] for one in prices])) for r in (*RUNGS, rung)}
    best, needed = cheapest(prices, asked, each)
    times = each[rung] * sum(points) / (each[best] * sum(needed)) if needed else np.nan
    whole = sum(counted.evaluations.values()) + sum(pilot.evaluations.values())
    # what the cheapest split's study takes: verified designs save alike, what is at another tolerance scales with it; pairs,
    # pilot and what was verified at a looser tolerance before are not needed
    pairs = sum(n for (stage, _), n in counted.evaluations.items() if stage == "pairs")
    before = last = 0.0
    for (stage, rtol), n in counted.evaluations.items():
        at = min(RUNGS, key=lambda one: abs(np.log(one / rtol)))
        if stage == "verification":
            last += n if abs(np.log(rtol / rung)) < 0.1 else 0.0
        elif stage != "pairs":
            before += n * each[best] / each[at]
    return {
        "number": number, "asked": asked, "rtol": rung, "sure": split.attrs["sure"], "points": points,
        "errors": found, "truth_errors": errors, "cheapest_rtol": best, "cheapest_points": needed,
        "times": times, "times_whole": whole / (before + last / times),
        "pilot": (sum(pilot.evaluations.values()) + pairs) / whole,
        "predicted": float(split.attrs["study_evaluations"] / sum(counted.evaluations.values())),
        "within": [[float(verified[f"{m}_within"].sel(design=n)) for m in ("mean", "deviation")]
                   for n in names],
        "told": told, "evaluations": each,
        "spent": {f"{who}{stage} {rtol:.0e}": n for who, one in (("", counted), ("pilot ", pilot))
                  for (stage, rtol), n in one.evaluations.items()},
        "bias": {rtol: [one["bias"][rtol].tolist() for one in prices] for rtol in RUNGS},
    }  # fmt: skip


def true(scene: Scene, design: dict[str, float], rung: float) -> dict[str, Any]:
    """Moments of a design, their errors, biases of rungs, and errors of samples by the length of 16 scramblings."""
    case = scene.required_study.case("play")
    made = [
        monte_carlo(scene, LONGEST, random=case.random, design=design, purpose="truth", scrambling=k)
        for k in range(SCRAMBLINGS)
    ]  # fmt: skip
    values = np.stack([one.values for one in made])

    def at(rtol: float, length: int) -> tuple[Array, float]:
        points = Points(made[0].names, values[:, :length].reshape(-1, values.shape[2]), made[0].paths)  # fmt: skip
        one = scene.with_({"study.accuracy": None, "numerics.rtol": rtol})
        records = sample_points(one, points, alone(), stage="truth")
        f = np.where(records["status"] == Status.OK, records["objective"], np.nan)
        return f.reshape(SCRAMBLINGS, length), float(records["rhs_evaluations"].mean())

    best, _ = at(TRUTH, LONGEST)
    exact = moments(best)
    scale = np.array([one.value for one in exact])
    lengths = 2 ** np.arange(2, int(np.log2(LONGEST)) + 1)
    spread = []
    for length in lengths:
        shifts = np.array([one.shifts for one in moments(best[:, :length])])
        spread.append(np.nanstd(shifts, axis=1, ddof=1) / 4.0 / scale)  # 16 scramblings
    paired = np.array([one.value for one in moments(best[:, :PAIRS])])
    bias, evaluations = {}, {}
    for rtol in dict.fromkeys((*RUNGS, rung)):
        f, evaluations[rtol] = at(rtol, PAIRS)
        bias[rtol] = (np.array([one.value for one in moments(f)]) - paired) / scale
    return {
        "value": scale, "error": [one.error / one.value for one in exact], "bias": bias,
        "evaluations": evaluations, "points": lengths * 16, "spread": np.array(spread),
    }  # fmt: skip


def cheapest(designs: list[dict[str, Any]], asked: float, each: dict[float, float]) -> tuple[float, list[int]]:  # fmt: skip
    """Tolerance, and simulations of each design, that keep both moments within what is asked in 95 %, at least cost; none
    if no way does."""
    ways = []
    for rtol in RUNGS:
        needed: list[int] = []
        for one in designs:
            bias, spread = one["bias"][rtol], one["spread"]
            inside = ndtr((asked - bias) / spread) - ndtr((-asked - bias) / spread)
            good = (inside >= 0.95).all(axis=1)
            needed += [int(one["points"][good.argmax()])] if good.any() else []
        if len(needed) == len(designs):
            ways.append((each[rtol] * sum(needed), rtol, needed))
    _, rtol, needed = min(ways, default=(0.0, RUNGS[-1], []))
    return rtol, needed


def summary(rows: list[dict[str, Any]]) -> None:
    """Print how many reached what was asked, and at what cost."""
    shares = np.array([np.array(row["errors"]) / row["asked"] for row in rows])  # (n, 2, 2)
    said = np.array([np.array(row["errors"]) / row["within"] for row in rows])
    sure = np.array([row["sure"] == "yes" for row in rows])
    print(f"studies {len(rows)}, of which {sure.sum()} were promised")
    for name, few in (("all", np.full(len(rows), True)), ("promised", sure)):
        if few.any():
            print(
                f"{name}: within what was asked: {np.mean(shares[few] <= 1):.1%} of numbers, "
                f"{np.mean((shares[few] <= 1).all(axis=(1, 2))):.1%} of studies in all four; "
                f"within what was told: {np.mean(said[few] <= 1):.1%} of numbers"
            )
    for key, what in (("times", "verified designs"), ("times_whole", "whole study with its pilot")):
        times = np.array([row[key] for row in rows if row["cheapest_points"]])
        print(
            f"cost over the cheapest split, {what}, {len(times)} studies that have one: median {np.median(times):.2f}, "
            f"up to 2: {np.mean(times <= 2):.0%}, at most {times.max():.2f}"
        )
    pilot, predicted = (np.array([row[key] for row in rows]) for key in ("pilot", "predicted"))
    bias = [[np.abs(row["bias"][str(rtol)]) for row in rows] for rtol in RUNGS]
    bias = np.array(bias).reshape(len(RUNGS), -1)
    large = bias[:, bias[0] > np.median(bias[0])]  # others are chance
    left = np.median(large / large[0], axis=1)
    print(f"what tolerances from {RUNGS[0]} on leave of its bias, medians: {left.round(2)}")
    print(
        f"pilot and pairs: median {np.median(pilot):.1%} of the study; predicted over counted evaluations: "
        f"median {np.median(predicted):.2f}, within 20 %: {np.mean(abs(predicted - 1) <= 0.2):.0%}"
    )


def main() -> None:
    """Judge the studies that are not done yet, then sum up."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--studies", type=int, default=40)
    parser.add_argument("--first", type=int, default=0)
    default = JOB.parent.parent / "results" / "error_budget.jsonl"
    parser.add_argument("-o", "--output", type=Path, default=default)
    options = parser.parse_args()
    options.output.parent.mkdir(parents=True, exist_ok=True)
    known = options.output.read_text().splitlines() if options.output.exists() else []
    rows = [json.loads(line) for line in known]
    done = {row["number"] for row in rows}
    for number in range(options.first, options.first + options.studies):
        if number in done:
            continue
        row = judged(number)
        rows.append(json.loads(json.dumps(row)))  # as from the file
        with options.output.open("a") as file:
            file.write(json.dumps(row) + "\n")
        print(
            number, f"{row['asked']:.2%} rtol {row['rtol']:.0e} ({row['cheapest_rtol']:.0e})", row["points"],
            row["cheapest_points"], f"{row['times']:.2f}", f"{row['times_whole']:.2f} times",
            f"worst {np.max(row['errors']) / row['asked']:.2f} of it", row["sure"], flush=True,
        )  # fmt: skip
    summary(rows)


if __name__ == "__main__":
    main()

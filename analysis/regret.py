"""How far the recommended design of a study with a rough objective is from the best that many more simulations find.

    python analysis/regret.py OUT                      # ten studies, an hour on one core; writes analysis/results/regret.csv
    python analysis/regret.py OUT press my_study.toml  # some of them, or a scene with one case of one's own

The reference goes on from the recommended design: a search with up to `ROUNDS` times `BATCH` further designs, each of up to
`POINTS` simulations. A hundred times as many would take some hours.
What counts is what a study recommends by: the first objective, or mean + 2 standard deviations where both are minimised.

The best designs of the reference are compared by `CHOSEN` simulations each. The best of them and the recommended ones
are then judged by `JUDGED` simulations of another scatter, which no search and no choice has seen, or by up to `MOST` until the
standard errors of the differences are below `SURE`.
Regret is how far a recommended design is above the least of both, with the standard error of that difference. It
is never negative, so the less of two has some luck: a regret within its error is none.
Results are kept in OUT, so that the command goes on where it was stopped.
"""

import argparse
import csv
import json
import tomllib
from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from directly import run_of

from hpcclear.base.objectives import asked
from hpcclear.dynamics.evaluation import evaluate_records
from hpcclear.report.merit import SPAN, recommended
from hpcclear.results import dataset
from hpcclear.scene import Scene, load_scene
from hpcclear.scene.domain import box, to_physical
from hpcclear.scene.points import Points
from hpcclear.scene.stages import REPLICATES
from hpcclear.statistics.random.replicates import spread
from hpcclear.study import forecast, run_study, search, simulations, truth
from hpcclear.study.goals import excess
from hpcclear.study.optimisation import Choice

HERE = Path(__file__).parent
JOBS = HERE.parent / "jobs"
ROUNDS, BATCH, POINTS = 12, 8, 512
CHOSEN, JUDGED, MOST, BEST = 512, 4096, 16384, 6
SURE = 0.0025
RESULTS = HERE / "results" / "regret.csv"
FIELDS = (
    "study",
    "r2_of_f",
    "simulations",
    "forecast",
    "least",
    "regret",
    "error",
    "broken",
)

SMALL: dict[str, Any] = {
    "seed": 5,
    "samples": 150,
    "test_samples": 40,
    "accuracy": {"mean": 0.005, "deviation": 0.03, "quantile": 0.01},
    "sensitivity": {"groups": []},
    "surrogate": {"models": [], "restarts": 1},
    "swarm": {"particles": 50, "iterations": 50, "runs": 2},
    "verification": {"most_samples": 2048, "infill_rounds": 3, "infill_samples": 128},
}
QUICK = {"rtol": 1e-5, "transient_revolutions": 2, "averaged_revolutions": 2}
QUANTILE = {"statistic": "quantile", "level": 0.95}


def mass(path: str, low: float, high: float) -> dict[str, Any]:
    """A mass as a study variable."""
    return {"path": path, "range": [low, high]}


def uniform(low: str, high: str) -> dict[str, Any]:
    """A clearance wherever the design is."""
    return {"distribution": "uniform", "range": [low, high]}


STUDIES: dict[str, tuple[str, dict[str, Any]]] = {
    "press": (
        "linkages/press.toml",
        {
            "objective": "peak-contact-force",
            "variables": {
                "ram": mass("mechanism.bodies.ram.mass", 1.0, 2.0),
                "link": {"path": "mechanism.bodies.link.length", "range": ["145 mm", "160 mm"]},
                "C": {"range": ["0.03 mm", "0.2 mm"]},
            },
            "random": {
                "C": uniform("0.05 mm", "0.15 mm"),
                "ram": {"distribution": "uniform", "half_width": "20 g"},
            },
            "cases": {"made": {"random": ["C", "ram"], "objectives": [QUANTILE, {"formula": "ram"}]}},
        },
    ),
    "quick_return": (
        "linkages/quick_return.toml",
        {
            "objective": "peak-contact-force",
            "variables": {
                "crank": {"path": "mechanism.bodies.crank.length", "range": ["45 mm", "55 mm"]},
                "lever": mass("mechanism.bodies.lever.mass", 0.4, 0.8),
                "C": {"range": ["0.03 mm", "0.2 mm"]},
            },
            "random": {
                "C": uniform("0.05 mm", "0.15 mm"),
                "lever": {"distribution": "uniform", "half_width": "10 g"},
            },
            "cases": {"made": {"random": ["C", "lever"], "objectives": ["mean", "deviation"]}},
        },
    ),
    "four_stroke": (
        "linkages/four_stroke.toml",
        {
            "objective": "peak-crank-moment",
            "variables": {
                "rod": mass("mechanism.bodies.rod.mass", 0.35, 0.65),
                "piston": mass("mechanism.bodies.piston.mass", 0.3, 0.5),
                "C": {"range": ["10 um", "50 um"]},
            },
            "random": {
                "C": uniform("15 um", "45 um"),
                "piston": {"distribution": "uniform", "half_width": "8 g"},
            },
            "cases": {"made": {"random": ["C", "piston"], "objectives": [QUANTILE, {"formula": "0 - rod"}]}},
        },
    ),
    "v_twin": (
        "linkages/v_twin.toml",
        {
            "objective": "peak-contact-force",
            "variables": {
                "piston": {
                    "paths": ["mechanism.bodies.piston_left.mass", "mechanism.bodies.piston_right.mass"],
                    "range": [0.3, 0.5],
                },
                "rod": {
                    "paths": ["mechanism.bodies.rod_left.mass", "mechanism.bodies.rod_right.mass"],
                    "range": [0.2, 0.4],
                },
                "C": {"range": ["20 um", "80 um"]},
            },
            "random": {"C": uniform("25 um", "70 um")},
            "cases": {"made": {"random": ["C"], "objectives": [QUANTILE, "mean"]}},
        },
    ),
    "slider_crank": (
        "hunt_crossley.toml",
        {
            "objective": "peak-contact-force",
            "variables": {
                "m2": mass("mechanism.rod.mass", 0.12, 0.4),
                "m3": mass("mechanism.slider.mass", 0.08, 0.28),
                "u2": {"path": "mechanism.rod.mass_center", "range": ["10 mm", "110 mm"]},
                "C12": {"path": "joints.crank_rod.clearance", "range": ["0.1 mm", "0.6 mm"]},
                "C23": {"path": "joints.rod_slider.clearance", "range": ["0.1 mm", "0.6 mm"]},
            },
            "random": {
                "C12": uniform("0.15 mm", "0.5 mm"),
                "C23": uniform("0.15 mm", "0.5 mm"),
                "m3": {"distribution": "normal", "deviation": "2 g"},
            },
            "cases": {"made": {"random": ["C12", "C23", "m3"], "objectives": [QUANTILE, {"formula": "0 - m2 - m3"}]}},
        },
    ),
    "torque": (
        "hunt_crossley.toml",
        {
            "objective": "slider-acceleration-deviation",
            "variables": {
                "m2": mass("mechanism.rod.mass", 0.12, 0.4),
                "m3": mass("mechanism.slider.mass", 0.08, 0.28),
                "C": {"range": ["0.1 mm", "0.6 mm"]},
            },
            "random": {
                "C": uniform("0.15 mm", "0.5 mm"),
                "m3": {"distribution": "normal", "deviation": "2 g"},
            },
            "cases": {"made": {"random": ["C", "m3"], "objectives": ["mean", "deviation"]}},
        },
    ),
    "compressor": (
        "compressor.toml",
        {
            "objective": "peak-contact-force",
            "variables": {
                "piston": mass("mechanism.slider.mass", 0.15, 0.35),
                "rod": mass("mechanism.rod.mass", 0.08, 0.2),
                "big": {"path": "joints.crank_rod.clearance", "range": ["8 um", "40 um"]},
                "small": {"path": "joints.rod_slider.clearance", "range": ["2 um", "25 um"]},
            },
            "random": {"big": uniform("12 um", "35 um"), "small": uniform("4 um", "20 um")},
            "cases": {"made": {"random": ["big", "small"], "objectives": [QUANTILE, {"formula": "0 - piston - rod"}]}},
        },
    ),
    "moment": (
        "hunt_crossley.toml",
        {
            "objective": "peak-crank-moment",
            "variables": {
                "m2": mass("mechanism.rod.mass", 0.12, 0.4),
                "u2": {"path": "mechanism.rod.mass_center", "range": ["10 mm", "110 mm"]},
                "C": {"range": ["0.1 mm", "0.6 mm"]},
            },
            "random": {
                "C": uniform("0.15 mm", "0.5 mm"),
                "m2": {"distribution": "normal", "deviation": "2 g"},
            },
            "cases": {"made": {"random": ["C", "m2"], "objectives": [QUANTILE, {"formula": "0 - m2"}]}},
        },
    ),
    "one_joint": (
        "hunt_crossley.toml",
        {
            "objective": "peak-contact-force",
            "variables": {
                "m3": mass("mechanism.slider.mass", 0.08, 0.28),
                "u2": {"path": "mechanism.rod.mass_center", "range": ["10 mm", "110 mm"]},
                "C12": {"path": "joints.crank_rod.clearance", "range": ["0.1 mm", "0.6 mm"]},
            },
            "random": {
                "C12": uniform("0.15 mm", "0.5 mm"),
                "m3": {"distribution": "normal", "deviation": "2 g"},
            },
            "cases": {"made": {"random": ["C12", "m3"], "objectives": ["mean", "deviation"]}},
        },
    ),
    "crank_rocker": (
        "linkages/crank_rocker.toml",
        {
            "objective": "peak-contact-force",
            "variables": {
                "coupler": mass("mechanism.bodies.coupler.mass", 0.2, 0.4),
                "rocker": mass("mechanism.bodies.rocker.mass", 0.15, 0.35),
                "C": {"range": ["0.03 mm", "0.3 mm"]},
            },
            "random": {
                "C": uniform("0.05 mm", "0.25 mm"),
                "rocker": {"distribution": "uniform", "half_width": "5 g"},
            },
            "cases": {"made": {"random": ["C", "rocker"], "objectives": [QUANTILE, {"formula": "0 - coupler"}]}},
        },
    ),
}  # fmt: skip
"""Studies of our own mechanisms, small enough to be judged."""

KNOWN = {"compressor": [[0.15, 0.0904]]}
"""Best designs that searches of earlier versions found, where the reference may miss them: they are judged as well."""

DRIVES = {
    "torque": {
        "kind": "torque",
        "torque": "2 N m",
        "flywheel_inertia": 0.02,
        "initial_speed": "3000 rpm",
    }
}
"""Other drives than their scenes': speeds that drift with the tolerance."""


def scene_of(name: str) -> Scene:
    """A study by its name, or from a file."""
    if name not in STUDIES:
        return load_scene(name)
    job, study = STUDIES[name]
    table = tomllib.loads((JOBS / job).read_text())
    table["study"] = SMALL | study
    table["numerics"] = table["numerics"] | QUICK
    table["numerics"].pop("objective", None)  # the study has its own
    table["drive"] = DRIVES.get(name, table.get("drive"))
    table = {key: its for key, its in table.items() if its is not None}
    return load_scene(table)


def choice_at(scene: Scene, unit: list[float]) -> Choice:
    """The design of the first case at a place in its box, which is the unit cube."""
    case = scene.required_study.cases[0].name
    names = scene.required_study.design_variables(case)
    region = box(scene, names)
    row = to_physical(
        scene, names, (region.lower + np.array(unit) * (region.upper - region.lower))[None]
    )[0]
    return Choice("", case, dict(zip(names, row.tolist(), strict=True)))


def main() -> None:
    """Carry out, judge, print and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("studies", nargs="*", default=list(STUDIES))
    parser.add_argument("--seed", type=int, help="another seed than the study's")
    parser.add_argument("--rounds", type=int, default=ROUNDS, help="of the reference")
    parser.add_argument("--csv", type=Path, default=RESULTS)
    words = parser.parse_args()
    words.out.mkdir(exist_ok=True)
    rows: list[dict[str, Any]] = []
    print(*FIELDS)
    for name in words.studies:
        scene = scene_of(name)
        if words.seed is not None:
            scene = scene.with_({"study.seed": words.seed})
        label = Path(name).stem + ("" if words.seed is None else f"_{words.seed}")
        rows.append(measured(words.out / label, label, scene, words.rounds))
        print(*rows[-1].values(), flush=True)
        with words.csv.open("w", newline="") as file:
            table = csv.DictWriter(file, FIELDS)
            table.writeheader()
            table.writerows(rows)
    some = [row["regret"] for row in rows]
    print(f"regret {np.median(some):.2%} in the median, {max(some):.2%} at most")


def measured(place: Path, label: str, scene: Scene, rounds: int) -> dict[str, Any]:
    """Carry out a study; the regret of its recommended design, relative to the least, in a row of the table."""
    place.mkdir(exist_ok=True)
    directory, spent = carried_out(scene, place / "study")
    case = scene.required_study.cases[0].name
    names = scene.required_study.design_variables(case)
    table = dataset.read(directory / "verification.nc", "verification").to_xarray()
    best = table.sel(design=recommended(table))
    taken = [[float(best[name]) for name in names]]
    kept = place / "reference.npy"
    if not kept.exists():
        found = choices_of(scene, case, reference(scene, case, rounds, np.array(taken)))
        values, _, broken = merits(scene, found, told(scene, found, CHOSEN // REPLICATES, "chosen"))
        np.save(kept, list(found[int(np.where(broken, np.inf, values).argmin())].design.values()))
    rows = [*taken, np.load(kept), *KNOWN.get(label, [])]
    values, errors, broken, least = judged(scene, choices_of(scene, case, rows))
    models = dataset.read(directory / "kriging.nc", "kriging").to_xarray()
    said, _ = forecast.expected(scene, partial(evaluated, scene), 1e-3)
    regret = (values[0] - values[least]) / abs(values[least])
    cells = (
        label,
        round(float(models.r2[-1]), 3),
        spent,
        said,
        f"{values[least]:.6g}",
        round(regret, 6),
        round(float(errors[0]), 6),
        int(broken[0]),
    )
    return dict(zip(FIELDS, cells, strict=True))


def choices_of(scene: Scene, case: str, rows: Any) -> list[Choice]:
    """Designs of a case from their variables."""
    names = scene.required_study.design_variables(case)
    return [Choice("", case, dict(zip(names, map(float, row), strict=True))) for row in rows]


def judged(scene: Scene, choices: list[Choice]) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """What a study recommends designs by, relative standard errors of the differences from the least, whether designs break a
    constraint, and which is the least: by more and more simulations until that is known well enough."""
    run, length = run_of(scene), JUDGED // REPLICATES
    made = [truth.nothing(run)] * len(choices)
    while True:
        truth.lengthen(run, choices, made, range(len(made)), "judge", length)
        values, shifts, broken = merits(scene, choices, truth.results_of(run, choices, made))
        least = int(np.where(broken, np.inf, values).argmin())
        errors = spread(shifts - shifts[least]) / abs(values[least])
        length = made[0].shape[2]
        if errors.max() < SURE or 2 * length * REPLICATES > MOST:
            return values, errors, broken, least


def merits(
    scene: Scene, choices: list[Choice], found: dict[str, np.ndarray]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What a study recommends designs by, what replicates shift it, and whether designs break a constraint."""
    case = scene.required_study.case(choices[0].case)
    weights = np.array([1.0, SPAN] if case.plain else [1.0])
    values, shifts = (found[part][:, : len(weights)] for part in ("goal", "goal_shifts"))
    kept = found["goal"][:, len(case.goals) : len(case.goals) + len(case.kept)]
    broken = excess(case.kept, kept)
    return values @ weights, np.einsum("nkr,k->nr", shifts, weights), broken > 0.0


def carried_out(scene: Scene, place: Path) -> tuple[Path, int]:
    """Results of a study, and how much it simulated in all."""
    counted, kept = Counter[str](), place.with_suffix(".json")

    def counting(scene: Scene, points: Points, *words: Any, stage: str, **more: Any) -> Any:
        counted[stage.partition(":")[0].partition("-")[0]] += len(points)
        return sampled(scene, points, *words, stage=stage, **more)

    sampled = simulations.sample_points
    simulations.sample_points = counting
    try:
        directory = run_study(scene, place, progress_style="quiet")
    finally:
        simulations.sample_points = sampled
    if not kept.exists():
        kept.write_text(json.dumps(counted))
    return directory, sum(json.loads(kept.read_text()).values())


def evaluated(scene: Scene, points: Points) -> np.ndarray:
    """Records of a study's objective."""
    return asked(evaluate_records(scene, points), scene.objective)


def told(scene: Scene, choices: list[Choice], length: int, purpose: str) -> dict[str, np.ndarray]:
    """What designs come to by so many points of each scrambling."""
    run = run_of(scene)
    return truth.results_of(run, choices, truth.drawn(run, choices, purpose, length))


def reference(scene: Scene, case: str, rounds: int, start: np.ndarray) -> np.ndarray:
    """The best designs of a long search on scatter of its own, which begins with some designs, (k, d)."""
    more = {"infill_rounds": rounds, "infill_designs": BATCH, "infill_samples": POINTS}
    own = scene.with_({f"study.verification.{key}": value for key, value in more.items()})
    own = own.with_({"study.seed": scene.required_study.seed + 7000})
    run = run_of(own)
    found = search.searched(run, choices_of(own, case, start))[0]
    return np.array([list(one.design.values()) for one in found])


if __name__ == "__main__":
    main()

"""Speed of laws and objectives that a user brings, against the same built-in: pairs of ensembles on one core.

    python analysis/user_law_speed.py                           # some 4 minutes
    python analysis/user_law_speed.py --samples 64 --rounds 3   # shorter

Each pair simulates the same designs of the paper's Table 3 in turn, in changing order. It prints the processor time of the
user's over that of ours, median of the rounds and their quartiles, the share of packed arithmetic of the user's motion, and the
largest relative difference of the objectives: with the same formula it is rounding, grown by the motion where that is chaotic.
"""

import argparse
import shutil
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from assembly import executed_arithmetic, force_evaluation
from scenes import JOB, LAWS, ensemble

from hpcclear import load_scene
from hpcclear.base.objectives import Objective, asked
from hpcclear.dynamics.evaluation.evaluator import (
    DEFAULT_LANES,
    outcome_records,
    responses_reported,
)
from hpcclear.dynamics.stepping.lanes import Lanes
from hpcclear.scene import Scene
from hpcclear.scene.scene import record_of

SOURCE = """
import math
from hpcclear import ContactLaw, FrictionLaw, Objective, Parameter


def hunt_crossley(depth, rate, stiffness, damping):
    return stiffness * depth**1.5 * (1 + damping * rate)


def once(restitution):
    return {"a": 0.75 * (1 - restitution**2)}


def lankarani_nikravesh(depth, rate, impact_speed, stiffness, a):
    return stiffness * depth**1.5 * (1 + a * rate / impact_speed)


def coulomb(speed, coefficient, ramp_speed):
    return coefficient * max(min(speed / ramp_speed, 1.0), -1.0)


def force(normal_force):
    return normal_force


HuntCrossley = ContactLaw(
    words="Hunt and Crossley's", parameters=(Parameter("damping", "s/m", least=0),), force=hunt_crossley
)
LankaraniNikravesh = ContactLaw(
    words="Lankarani and Nikravesh's", parameters=(Parameter("restitution", least=0, most=1),), once=once,
    numbers={"a": ""}, force=lankarani_nikravesh,
)
Coulomb = FrictionLaw(
    words="Coulomb's", ratio=coulomb,
    parameters=(Parameter("coefficient", least=0), Parameter("ramp_speed", "m/s", above=0)),
)
MeanForce = Objective("mean contact force", "N", rate=force)
"""
OURS = ["hunt-crossley", "lankarani-nikravesh", "coulomb", "mean-contact-force"]
THEIRS = ["mine:HuntCrossley", "mine:LankaraniNikravesh", "mine:Coulomb", "mine:MeanForce"]


def scenes(folder: Path) -> dict[str, tuple[Scene, Scene]]:
    """Pairs of a scene with a law or an objective of ours, and of a user's."""
    shutil.copy(JOB, folder / "scene.toml")
    (folder / "mine.py").write_text(SOURCE, encoding="utf-8")

    def made(law: str, *words: str, mine: tuple[int, ...] = ()) -> Scene:
        entries = [*LAWS[law], *words]
        for k in mine:
            entries = [entry.replace(OURS[k], THEIRS[k]) for entry in entries]
        return load_scene(folder / "scene.toml", entries)

    objective = f"study.objective={OURS[3]}"
    return {
        "Hunt and Crossley": (made("frictionless"), made("frictionless", mine=(0,))),
        "Hunt and Crossley, Coulomb": (made("hunt-crossley"), made("hunt-crossley", mine=(0, 2))),
        "Lankarani and Nikravesh": (
            made("lankarani-nikravesh"), made("lankarani-nikravesh", mine=(1,)),
        ),
        "mean contact force": (
            made("lankarani-nikravesh", objective), made("lankarani-nikravesh", objective, mine=(3,)),
        ),
    }  # fmt: skip


def task(scene: Scene, samples: int) -> Callable[[], np.ndarray]:
    """Simulate the designs; their objectives, by the sample."""
    made = ensemble(scene, samples)
    objective: Objective = scene.objective

    def run() -> np.ndarray:
        outcome = Lanes(made.problem, DEFAULT_LANES).run(made.par, made.start)
        told = responses_reported(made.problem)
        records = outcome_records(
            np.arange(samples), outcome, made.par, record_of(scene), told, objective
        )
        return np.asarray(asked(records, objective)["objective"])

    return run


def main() -> None:
    """Measure all pairs, print a line each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=256, help="designs of an ensemble")
    parser.add_argument("--rounds", type=int, default=9, help="how often each pair is measured")
    parser.add_argument("--only", default="", help="pairs with this in their names")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        pairs = scenes(Path(place))
        for name, pair in pairs.items():
            if given.only not in name:
                continue
            tasks = [task(scene, given.samples) for scene in pair]
            found = [one() for one in tasks]  # compiles
            ratios = []
            for number in range(given.rounds):
                seconds = [0.0, 0.0]
                for k in (0, 1) if number % 2 else (1, 0):
                    started = time.process_time()
                    tasks[k]()
                    seconds[k] = time.process_time() - started
                ratios.append(seconds[1] / seconds[0])
            low, middle, high = np.quantile(ratios, [0.25, 0.5, 0.75])
            problem = ensemble(pair[1], 1).problem
            packed = executed_arithmetic(force_evaluation(problem, DEFAULT_LANES)).packed_share
            off = np.nanmax(np.abs(found[1] / found[0] - 1.0))
            print(
                f"{name:30} time {middle:.3f} ({low:.3f} to {high:.3f}) of ours, "
                f"{100 * packed:.1f} % packed, objectives within {off:.1e}",
                flush=True,
            )


if __name__ == "__main__":
    main()

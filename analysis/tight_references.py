"""What a tight reference costs: error against evaluations of the explicit pairs, on the five reference motions.

    python analysis/tight_references.py                                    # two pairs, 1e-8 to 1e-13; a minute
    python analysis/tight_references.py --methods prince-dormand,fehlberg --designs 4

Each motion of `tests/test_reference.py` in designs whose clearances differ a little: one design alone may hit its end by luck.
The error is that of the slider's position at the end, m, and of f, relative, as medians over the designs; the reference is
the 8th-order pair at 1e-14, and what Tsitouras' finds there is how well it is known. Evaluations are counted, no times: these
figures hold on any machine. The last table interpolates: evaluations for an error of f, over those of the first method.

Lobatto collocation of order 16, which the code had until commit 2e8158b, took 0.97 to 1.65 times the evaluations of the
8th-order pair for an error of f of 1e-10 to 1e-12; Tsitouras' pair takes 1.6 to 3.7 times as many.
"""

import argparse
import itertools
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.dynamics.evaluation.evaluator import DEFAULT_LANES
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.problem import problem_of
from hpcclear.dynamics.setup.start import start_states
from hpcclear.dynamics.stepping.lanes import Lanes
from hpcclear.scene import Scene, load_scene
from hpcclear.scene.points import Points

JOB = Path(__file__).parents[1] / "jobs" / "slider_crank.toml"
CLEARANCES = ("joints.crank_rod.clearance", "joints.rod_slider.clearance")
HUNT_CROSSLEY = {"law": "hunt-crossley", "damping": 0.5}
LATCHED = {"law": "lankarani-nikravesh", "restitution": 0.9}
MOTIONS = {
    "Hunt-Crossley 0.3 mm, 10": (HUNT_CROSSLEY, 0.3e-3, 10),
    "Hunt-Crossley 1 mm, 10": (HUNT_CROSSLEY, 1.0e-3, 10),
    "Lankarani-Nikravesh 0.05 mm, 10": (LATCHED, 0.05e-3, 10),
    "Lankarani-Nikravesh 0.3 mm, 1": (LATCHED, 0.3e-3, 1),
    "Lankarani-Nikravesh 1 mm, 1": (LATCHED, 1.0e-3, 1),
}
"""Contact law, clearance in m, revolutions."""

SLIDER = 3
SPREAD = 1e-3  # of the clearances of the designs
TIGHTEST = 1e-14
TOLERANCES = 10.0 ** -np.arange(8.0, 13.5, 1.0)
ERRORS = 10.0 ** -np.arange(8.0, 12.5, 1.0)  # of f


class Found(NamedTuple):
    """What a method makes of the designs of a motion."""

    slider: Array  # m (designs,)
    f: Array
    evaluations: float  # mean


def scene_of(motion: str, method: str, rtol: float) -> Scene:
    """One motion by one method."""
    contact, clearance, revolutions = MOTIONS[motion]
    return load_scene(JOB).with_(
        {
            "effects.contact": contact,
            **dict.fromkeys(CLEARANCES, clearance),
            "numerics.transient_revolutions": revolutions - 1,
            "numerics.averaged_revolutions": 1,
            "numerics.method": method,
            "numerics.rtol": rtol,
        }
    )


def found(motion: str, method: str, rtol: float, designs: int) -> Found:
    """Its designs at a tolerance."""
    scene = scene_of(motion, method, rtol)
    clearance = scene.number(CLEARANCES[0]) * (1.0 + SPREAD * np.linspace(-1.0, 1.0, designs))
    par = parameters(scene, Points(("c",), clearance[:, None], (CLEARANCES,)))
    outcome = Lanes(problem_of(scene), DEFAULT_LANES).run(par, start_states(scene, par))
    assert (outcome.status == 0).all()
    return Found(
        outcome.coordinates(SLIDER + 1)[:, SLIDER], outcome.objective, outcome.evaluations.mean()
    )


def errors(one: Found, exact: Found) -> tuple[float, float]:
    """Medians of the errors of slider position, m, and f, relative."""
    off = np.median(abs(one.slider - exact.slider))
    return float(off), float(np.median(abs(one.f / exact.f - 1.0)))


def work_for(error: float, ladder: list[tuple[float, float]]) -> float:
    """Evaluations for an error by the first two tolerances (error, evaluations) about it; NaN where there are none."""
    for (worse, few), (better, many) in itertools.pairwise(ladder):
        if worse >= error >= better:
            share = np.log(worse / error) / np.log(worse / better)
            return float(few * (many / few) ** share)
    return np.nan


def compare(motion: str, methods: list[str], designs: int) -> dict[str, list[float]]:
    """Print a motion's table; for each method the evaluations for each of `ERRORS`."""
    exact = found(motion, "prince-dormand", TIGHTEST, designs)
    known = errors(found(motion, "tsitouras", TIGHTEST, designs), exact)
    print(f"\n{motion} revolutions; known to {known[0]:.1e} m, f to {known[1]:.1e}")
    print(f"  {'method':15} {'rtol':>6} {'slider, m':>10} {'f':>9} {'evaluations':>12}")
    work = {}
    for method in methods:
        ladder = []
        for rtol in TOLERANCES:
            one = found(motion, method, rtol, designs)
            slider, f = errors(one, exact)
            ladder.append((f, one.evaluations))
            print(f"  {method:15} {rtol:6.0e} {slider:10.1e} {f:9.1e} {one.evaluations:12.0f}")
        work[method] = [work_for(error, ladder) for error in ERRORS]
    return work


def main() -> None:
    """Compare on every motion."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--methods", default="prince-dormand,tsitouras", help="of numerics.method")
    parser.add_argument("--designs", type=int, default=8, help="of each motion")
    words = parser.parse_args()
    methods = words.methods.split(",")
    all_work = {motion: compare(motion, methods, words.designs) for motion in MOTIONS}
    print(f"\nEvaluations for an error of f, over those of {methods[0]}")
    print("  " + " ".join(f"{error:8.0e}" for error in ERRORS))
    for motion, work in all_work.items():
        for method in methods:
            ratios = np.array(work[method]) / np.array(work[methods[0]])
            print("  " + " ".join(f"{one:8.2f}" for one in ratios), method, motion, sep="  ")


if __name__ == "__main__":
    main()

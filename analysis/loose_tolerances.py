"""What loose tolerances make of f, forces and accelerations, and what they cost: random scenes of effects_kept.py against 1e-8.

python analysis/loose_tolerances.py      (five minutes on one core)
python analysis/loose_tolerances.py --oil --first 120 --scenes 60

Two revolutions from the start, samples of each scene's study; scenes whose friction has a ramp and whose steps are all
explicit, or, with --oil, scenes with oil, which may take implicit ones. Printed for each tolerance: median evaluations,
over those at 1e-6; median error of f, of the largest mean and peak contact force, and of the standard deviation of the
slider's acceleration.
"""

import argparse
from collections.abc import Iterator

import numpy as np
from effects_kept import Simulated, scene_of

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.dynamics.setup.problem import implicit_method
from hpcclear.ensemble.certificate import VariantRequest
from hpcclear.ensemble.trial import Trial
from hpcclear.scene import Scene
from hpcclear.scene.points import Points

EXACT, USUAL = 1e-8, 1e-6
LOOSE = (1e-5, 1e-4, 1e-3)
RESPONSES = ("f", "mean force", "peak force", "acceleration")
OVER = {
    "study": None, "numerics.transient_revolutions": 0, "numerics.averaged_revolutions": 2,
    "numerics.responses": True, "numerics.atol": None,
}  # fmt: skip


def drawn(first: int, count: int, oil: bool) -> Iterator[tuple[int, Scene, Points]]:
    """Scenes of these numbers that are asked for, and the points at which they are simulated."""
    for number in range(first, first + count):
        try:
            scene = scene_of(number, False)[2]
            trial = Trial(scene)
            short = trial.variant(()).scene.with_(OVER)
            explicit = implicit_method(short) == "never"
        except InputError:
            continue  # an effect that this mechanism cannot have
        rubs = scene.effects.friction.law in ("coulomb", "ambrosio")
        if bool(scene.films()) if oil else explicit and rubs:
            yield number, short, trial.points(VariantRequest((), 0, 4))


def responses(scene: Scene, points: Points, rtol: float) -> tuple[float, float, Array]:
    """Median evaluations of a sample, share of samples that ended as they should, and the responses (4, samples)."""
    found = Simulated()(scene.with_({"numerics.rtol": rtol}), points)
    values = [
        found["objective"], np.fmax.reduce(found["mean_contact_force"], axis=1),
        np.fmax.reduce(found["peak_contact_force"], axis=1), found["slider_acceleration_deviation"],
    ]  # fmt: skip
    return (
        float(np.median(found["rhs_evaluations"])),
        float(np.mean(found["status"] == 0)),
        np.stack(values),
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--scenes", type=int, default=120, help="numbers that are looked at")
    parser.add_argument("--oil", action="store_true", help="scenes with oil")
    options = parser.parse_args()
    print(
        "scene, rtol, evaluations over those at 1e-6, samples that ended well, median errors of",
        *RESPONSES,
    )
    worst: dict[float, list[Array]] = {rtol: [] for rtol in LOOSE}
    for number, scene, points in drawn(options.first, options.scenes, options.oil):
        _, _, exact = responses(scene, points, EXACT)
        usual, _, _ = responses(scene, points, USUAL)
        for rtol in LOOSE:
            evaluations, ended, values = responses(scene, points, rtol)
            if not ended:
                print(f"{number:4} {rtol:.0e} no sample ended well", flush=True)
                continue
            errors = np.nanmedian(np.abs(values / exact - 1.0), axis=1)
            worst[rtol].append(np.array([evaluations / usual, *errors]))
            told = " ".join(f"{error:.0e}" for error in errors)
            print(
                f"{number:4} {rtol:.0e} {evaluations / usual:5.2f} {ended:4.0%} {told}", flush=True
            )
    for rtol, rows in worst.items():
        told = " ".join(f"{value:.1e}" for value in np.nanmedian(rows, axis=0))
        most = " ".join(f"{value:.1e}" for value in np.nanmax(rows, axis=0))
        print(f"{rtol:.0e}: medians {told}; at most {most}")


if __name__ == "__main__":
    main()

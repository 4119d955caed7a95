"""Chaotic scenes: what 1 % of f at 95 % costs, against the cheapest split of tolerance, copies and revolutions there is.

python analysis/chaos_cost.py                        (a quarter of an hour on one core)
python analysis/chaos_cost.py --scenes 5 8 14

Splits are searched by brute force, their errors measured over groups of copies. The cheapest with hindsight: whose error is
small enough, though nobody would know. The cheapest with limits: at least four copies, whose Student's limits come to 1 %.
With all known: revolutions that independent copies without spin-up take if their scatter is known, at the cheapest tolerance
that is off by no more than a quarter of the target or than chance makes. What is found here has to find scatter, tolerance
and spin-up besides. Processor time; a busy machine slows all.
"""

import argparse
import time
from typing import NamedTuple

import numpy as np
from scipy import stats
from target_error import random_scene

from hpcclear.accuracy.methods import one_turn
from hpcclear.base.outcome import Regime
from hpcclear.dynamics.evaluation import evaluate_records
from hpcclear.dynamics.evaluation.steady.copies import perturbed, scales
from hpcclear.dynamics.evaluation.steady.judging import objective
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.problem import problem_of
from hpcclear.dynamics.setup.start import start_states
from hpcclear.dynamics.stepping.lanes import Lanes
from hpcclear.scene import Scene
from hpcclear.scene.points import Points

SCENES = (5, 8, 11, 30, 55, 59, 69, 85, 104, 111)
"""The first in which 1 % takes more than the least that is ever simulated."""
TARGET = 1e-2
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6)
COPIES, SEGMENT = 64, 5
SETTLED = 12
"""Segments after which nothing settles."""
TOGETHER = 8
"""Designs in the lanes at once, as in a batch."""


class Split(NamedTuple):
    """A way to a mean, its price in seconds and its error, relative, root mean square."""

    seconds: float
    rtol: float
    copies: int
    spin_up: int
    revolutions: int
    error: float


def gaps_at(scene: Scene, rtol: float, segments: int) -> tuple[np.ndarray, float]:
    """Mean gaps (segments, copies, 2) of perturbed copies, and processor seconds of one revolution."""
    here = one_turn(scene, rtol, averaged_revolutions=SEGMENT)
    par = parameters(here)
    start = perturbed(start_states(here, par), scales(here, par[0]), range(5000, 5000 + COPIES))
    lanes, rows = Lanes(problem_of(here), 32), np.repeat(par, COPIES, axis=0)
    lanes.step(1)
    found = []
    began = time.process_time()
    for _ in range(segments):
        outcome = lanes.run(rows, start)
        found.append(outcome.mean_gap)
        start = outcome.end()
    return np.stack(found), (time.process_time() - began) / (segments * COPIES * SEGMENT)


def error_of(
    gaps: np.ndarray, copies: int, spin_up: int, length: int, truth: float
) -> tuple[float, float]:
    """Error over all groups of so many copies, from their starts on and from later ones; and Student's limits of these."""
    windows = (len(gaps) - spin_up) // length
    used = gaps[spin_up : spin_up + windows * length]
    parts = used.reshape(windows, length, COPIES // copies, copies, -1).mean(axis=(1, 3))
    error = float(np.sqrt(np.mean((objective(parts) / truth - 1.0) ** 2)))
    if copies < 4:
        return error, np.inf
    each = objective(used.reshape(windows, length, COPIES // copies, copies, -1).mean(axis=1))
    scatter = np.sqrt(np.mean(each.var(axis=-1, ddof=1)) / copies) / truth
    return error, float(stats.t.ppf(0.975, copies - 1) * scatter)


def cheapest(
    all_gaps: dict[float, tuple[np.ndarray, float]], truth: float, limits: bool
) -> Split | None:
    """The least price of an error of the target over 1.96; that states limits, too, if wished."""
    best = None
    for rtol, (gaps, price) in all_gaps.items():
        for copies in (1, 2, 4, 8, 16):
            for spin_up in range(0, 13, 2):
                for length in (1, 2, 4, 8, 16, 32, 48):
                    if spin_up + length > len(gaps):
                        continue
                    revolutions = SEGMENT * length * copies
                    seconds = price * (revolutions + SEGMENT * spin_up * copies)
                    if best is not None and seconds >= best.seconds:
                        continue
                    error, limit = error_of(gaps, copies, spin_up, length, truth)
                    if error <= TARGET / 1.96 and (limit <= TARGET or not limits):
                        best = Split(seconds, rtol, copies, SEGMENT * spin_up, revolutions, error)
    return best


def all_known(all_gaps: dict[float, tuple[np.ndarray, float]], truth: float) -> Split:
    """What is paid where scatter and tolerance are known and nothing has to settle; late revolutions tell them."""
    found = []
    for rtol, (gaps, price) in all_gaps.items():
        late = gaps[SETTLED:]
        each = objective(late.mean(axis=0))
        scatter = float(each.var(ddof=1)) * SEGMENT * len(late) / truth**2
        off = abs(float(objective(late.mean(axis=(0, 1)))) / truth - 1.0)
        doubt = float(each.std(ddof=1)) / np.sqrt(COPIES) / truth
        revolutions = int(np.ceil(scatter * (1.96 / TARGET) ** 2))
        if off <= max(0.25 * TARGET, 2.0 * doubt):
            found.append(
                Split(price * revolutions, rtol, revolutions, 0, revolutions, TARGET / 1.96)
            )
    return min(found)


def difference(loose: np.ndarray, strict: np.ndarray) -> tuple[float, float]:
    """Of the means at two tolerances, relative, and its standard error."""
    first, second = (objective(gaps[SETTLED:].mean(axis=0)) for gaps in (loose, strict))
    error = np.hypot(first.std(ddof=1), second.std(ddof=1)) / np.sqrt(COPIES)
    return float(first.mean() / second.mean() - 1.0), float(error / second.mean())


def ours(scene: Scene, number: int) -> tuple[np.ndarray, float]:
    """Records of designs that differ by 1e-9, and processor seconds of one."""
    mass = scene.number("mechanism.slider.mass") * (1.0 + 1e-9 * np.arange(number))
    points = Points(("m3",), mass[:, None], (("mechanism.slider.mass",),))
    began = time.process_time()
    records = evaluate_records(scene.with_({"numerics.target_error": TARGET}), points)
    return records, (time.process_time() - began) / number


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, nargs="*", default=SCENES)
    parser.add_argument("--segments", type=int, default=60)
    options = parser.parse_args()
    ratios: dict[str, list[tuple[float, float]]] = {
        "with all known": [],
        "with hindsight": [],
        "with limits": [],
    }
    for number in options.scenes:
        kind, scene = random_scene(number)
        ours(scene, 1)  # compiles
        found = {rtol: gaps_at(scene, rtol, options.segments) for rtol in TOLERANCES}
        late = found[1e-6][0][SETTLED:]
        truth = float(objective(late.mean(axis=(0, 1))))
        one, alone = ours(scene, 1)
        many, each = ours(scene, TOGETHER)
        off = float(np.sqrt(np.mean((many["objective"] / truth - 1.0) ** 2)))
        regime = Regime(int(one[0]["regime"])).name.lower()
        spent = float(many["steady_revolutions"].mean())
        print(
            f"{number:4} {kind:15} {regime:8} {alone:6.2f} s alone, {each:6.2f} s in a batch "
            f"({spent:.0f} revolutions, off {off:.1e})",
            flush=True,
        )
        shift, doubt = difference(found[1e-5][0], found[1e-6][0])
        print(f"     1e-5 and 1e-6 differ by {100.0 * shift:+.2f} +- {100.0 * doubt:.2f} %")
        for what, split in (
            ("with all known", all_known(found, truth)),
            ("with hindsight", cheapest(found, truth, limits=False)),
            ("with limits", cheapest(found, truth, limits=True)),
        ):
            if split is None:
                print(f"     {what}: no split that was tried reaches it")
                continue
            ratios[what].append((alone / split.seconds, each / split.seconds))
            print(
                f"     {what}: {split.seconds:.3f} s (rtol {split.rtol:.0e}, {split.copies} copies of {split.spin_up} + "
                f"{split.revolutions // split.copies} revolutions): {ratios[what][-1][0]:.1f} and "
                f"{ratios[what][-1][1]:.1f} times",
                flush=True,
            )
    for what, both in ratios.items():
        found_ratio = np.array(both)
        print(
            f"{what}: median {np.median(found_ratio, axis=0).round(1)}, "
            f"most {found_ratio.max(axis=0).round(1)} times (alone, in a batch)"
        )


if __name__ == "__main__":
    main()

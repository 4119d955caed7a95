"""The cheapest scene within a tolerance, with hindsight: about what certificates of effects could save.

python analysis/effects_hindsight.py --first 100 --scenes 60      (a minute or two each on one core)

The scenes are those of effects_kept.py. Every effect is left out singly at fresh points, far more than a certificate may
simulate; those whose changes of mean and deviation are within the tolerance, limits or no, are left out together, one after the
other, what saves most first, where all of them still are. The saving is that of the cheapest variant found to be within,
by processor time: found greedily and from estimates, so no strict bound. Also printed: the same where only the mean is asked
for. Kept line by line as in effects_kept.py.
"""

import argparse
from pathlib import Path

import numpy as np
from effects_kept import FRESH, Simulated, going_on, scene_of
from scenes import JOB

from hpcclear.ensemble.certificate import Variant, VariantRequest
from hpcclear.ensemble.trial import CONFIDENCE, Trial
from hpcclear.results.names import ALL_ON
from hpcclear.statistics.random.paired import deviation_change, mean_change


class Known:
    """Changes and seconds of variants of one scene, each simulated once."""

    def __init__(self, trial: Trial, replicates: int) -> None:
        self.trial, self.replicates, self.simulate = trial, replicates, Simulated()
        self.values = {(): self._values(())}
        self.seconds: dict[Variant, float] = {(): self.simulate.samples}

    def _values(self, off: Variant) -> np.ndarray:
        asked = VariantRequest(off, FRESH, FRESH + self.replicates)
        records = self.simulate(self.trial.simulated(off), self.trial.points(asked))
        if not off:
            self.trial.seen(asked, records)  # what dearer variants are cut off by
        values: np.ndarray = records["objective"].reshape(self.replicates, -1)
        return values

    def change(self, off: Variant, deviation: bool) -> float:
        """The larger of the changes that count; NaN where too many samples failed."""
        if off not in self.values:
            before = self.simulate.samples
            self.values[off] = self._values(off)
            self.seconds[off] = self.simulate.samples - before
        pair = self.values[()], self.values[off]
        changes = [mean_change(*pair, CONFIDENCE)]
        changes += [deviation_change(*pair, CONFIDENCE)] if deviation else []
        return float(np.max(np.abs([one.value for one in changes])))


def cheapest(known: Known, tolerance: float, deviation: bool) -> Variant:
    """The cheapest variant that is found within the tolerance; () if none is cheaper than the whole scene."""
    trial = known.trial
    singles = [(k,) for k in range(len(trial.switches)) if trial.possible((k,))]
    within = [one for one in singles if known.change(one, deviation) <= tolerance]
    within.sort(key=lambda one: known.seconds[one])
    good, together = list(within), ()
    for one in within:  # some exclude others, as an effect does what it has beyond a model
        off = tuple(sorted({*together, *one}))
        if trial.possible(off) and known.change(off, deviation) <= tolerance:
            together = off
            good.append(off)
    return min([(), *good], key=lambda one: known.seconds[one])


def judged(number: int, replicates: int) -> dict[str, object]:
    """One scene: what could go, and how much faster it were."""
    objective, tolerance, scene = scene_of(number, False)
    trial = Trial(scene)
    known = Known(trial, replicates)
    row: dict[str, object] = {"number": number, "objective": objective, "tolerance": tolerance}
    for name, deviation in (("times", True), ("times_mean", False)):
        off = cheapest(known, tolerance, deviation)
        seconds = trial.seconds([(), off]) if off else {}
        names = " + ".join(trial.names(off))
        row[name] = seconds[ALL_ON] / seconds[names] if off else 1.0
        row[f"off_{name}"] = names
    row["singly"] = {
        trial.names(off)[0]: [known.change(off, True), known.change(off, False), known.seconds[()] / known.seconds[off]]
        for off in known.values if len(off) == 1
    }  # fmt: skip
    return row


def summary(rows: list[dict]) -> None:
    """Print quartiles of what could be saved."""
    for name, what in (("times", "mean and deviation"), ("times_mean", "the mean alone")):
        times = np.array([row[name] for row in rows])
        quartiles = ", ".join(f"{q:.2f}" for q in np.quantile(times, (0.25, 0.5, 0.75)))
        print(
            f"{len(rows)} scenes, {what} within the tolerance: times faster {quartiles} (quartiles), "
            f"at most {times.max():.3g}; twice or more in {np.mean(times >= 2.0):.0%}, "
            f"nothing to gain (1.05) in {np.mean(times < 1.05):.0%}"
        )


def main() -> None:
    """Judge the scenes that are not done yet, then sum up."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--first", type=int, default=100)
    parser.add_argument("--scenes", type=int, default=60)
    parser.add_argument("--replicates", type=int, default=64, help="of fresh points")
    parser.add_argument(
        "-o", "--output", type=Path, default=JOB.parent.parent / "results" / "effects_hindsight.jsonl"
    )  # fmt: skip
    options = parser.parse_args()
    rows = going_on(
        options.output,
        range(options.first, options.first + options.scenes),
        lambda number: judged(number, options.replicates),
        ("number", "objective", "tolerance", "times", "off_times", "times_mean", "off_times_mean"),
    )
    summary(rows)


if __name__ == "__main__":
    main()

"""The sampler of `identify` against emcee: quantiles of the posteriors of made machines, and what they cost.

    pip install emcee
    python analysis/samplers.py [results/machines] [--machines 6]

Both get the same log-likelihood over the unit cube. The reference is the sampler of `identify` with 30 000 particles. Errors
are differences of the 2.5 %, 50 % and 97.5 % quantiles of each unknown from the reference, over the reference's half-width.
"""

import argparse
import logging
import time
from pathlib import Path

import emcee
import numpy as np
from identify_machines import ensemble_of, frequency_of, group_of, model_of, tables_of

from hpcclear.identify.features import Layout
from hpcclear.identify.judgement import PARTICLES, features_of, prepare
from hpcclear.identify.measured import read_measured
from hpcclear.identify.posterior import LEVELS, sequential
from hpcclear.identify.signals import Sensor
from hpcclear.identify.training import prepared_scene

WALKERS, STEPS, DROPPED = 32, 1500, 500
REFERENCE = 30_000
logging.getLogger("emcee.autocorr").setLevel(logging.ERROR)  # that chains are short is the point
SIGNAL, UNIT = "crank_moment", "N m"


class Counted:
    """A log-likelihood that counts its points."""

    def __init__(self, likelihood, summaries) -> None:
        self._likelihood, self._summaries, self.points = likelihood, summaries, 0

    def __call__(self, places: np.ndarray) -> np.ndarray:
        self.points += len(places)
        found = self._likelihood(np.clip(places, 0.0, 1.0), self._summaries)
        return np.where(((places < 0.0) | (places > 1.0)).any(axis=1), -np.inf, found)


def by_emcee(likelihood: Counted, dimensions: int, seed: int) -> tuple[np.ndarray, float]:
    """Samples (n, d), and the largest autocorrelation time in steps; started from the best of as many points as walkers."""
    rng = np.random.default_rng(seed)
    tried = rng.random((50 * WALKERS, dimensions))
    first = tried[np.argsort(likelihood(tried))[-WALKERS:]]
    sampler = emcee.EnsembleSampler(WALKERS, dimensions, likelihood, vectorize=True)
    sampler.random_state = np.random.RandomState(seed).get_state()
    sampler.run_mcmc(first, STEPS)
    memory = float(np.max(sampler.get_autocorr_time(discard=DROPPED, quiet=True)))
    return sampler.get_chain(discard=DROPPED, flat=True), memory


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)  # fmt: skip
    parser.add_argument("folder", type=Path, nargs="?", default=Path("results/machines"))
    parser.add_argument("--machines", type=int, default=6)
    parser.add_argument("--members", type=int, default=256)
    parser.add_argument("--mechanism", default="slider-crank")
    words = parser.parse_args()
    print(
        "| unknowns | machines | sampler | largest error | median error | points | processor time |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for count in (1, 2):
        report(words.folder, words.mechanism, count, words.machines, words.members)


def report(folder: Path, mechanism: str, count: int, machines: int, members: int) -> None:
    """Print the rows of one number of unknowns."""
    ensemble = ensemble_of(folder, mechanism, count, members)
    frequency = frequency_of(prepared_scene(model_of(mechanism, count)[0]))
    group = (mechanism, count, SIGNAL, 0.1)
    numbers = [k for k in range(200) if group_of(1, k) == group][:machines]
    read = [read_measured(one, SIGNAL, UNIT, frequency) for one in tables_of(folder, 1, numbers)]
    layout = Layout.of(read[0], Sensor())
    pairs = [features_of([one], [layout]) for one in read]
    made = prepare(
        ensemble, [layout], Sensor(), frequency, np.max([v for _, v in pairs], axis=0), 1, 8
    )
    size = made.model.places.shape[1]
    errors, costs, memory = {"sequential": [], "emcee": []}, {"sequential": [], "emcee": []}, []
    for values, _ in pairs:
        summaries = np.array([float(one(values[None])[0]) for one in made.summaries])
        ends = {}
        for name, particles in (("reference", REFERENCE), ("sequential", PARTICLES), ("emcee", 0)):
            likelihood = Counted(made.model.likelihoods[0], summaries)
            began = time.process_time()
            if particles:
                rng = np.random.default_rng(particles)
                found = sequential(likelihood, size, particles, rng)
            else:
                found, steps = by_emcee(likelihood, size, 1)
                memory.append(steps)
            ends[name] = np.quantile(found[:, :count], LEVELS, axis=0)
            if name != "reference":
                costs[name].append((likelihood.points, time.process_time() - began))
        half = 0.5 * (ends["reference"][2] - ends["reference"][0])
        for name, own in errors.items():
            own.append(np.abs(ends[name] - ends["reference"]) / half)
    for name, own in errors.items():
        points, seconds = np.mean(costs[name], axis=0)
        print(
            f"| {count} | {len(numbers)} | {name} | {np.max(own):.1%} | {np.median(own):.1%} | {points:.0f} "
            f"| {seconds:.1f} s |",
            flush=True,
        )
    print(f"largest autocorrelation time of emcee: {max(memory):.0f} steps", flush=True)


if __name__ == "__main__":
    main()

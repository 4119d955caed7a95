"""How much of a verified design's scatter is chaos: the same samples once more, with a relative perturbation of 1e-9.

Where motion is chaotic, or settles on an orbit that the smallest perturbation decides, a finite average of it is a random
number whatever the inputs. Its variance adds to theirs: pairs of samples that differ by `PERTURBATION` show how much."""

from collections.abc import Sequence

import numpy as np

from hpcclear.results import dataset
from hpcclear.scene.points import Points
from hpcclear.scene.study import Study
from hpcclear.study.optimisation import Choice
from hpcclear.study.run import Result, StudyRun
from hpcclear.study.truth import scattered

PAIRS = 32
"""Samples of a design that are simulated twice: the variance of pairs is known to a quarter of itself."""

PERTURBATION = 1e-9
"""Relative change of all variables of a sample."""

SAME = 1e-4
"""Relative difference of a pair that a regular motion stays below."""


def designs(study: Study) -> int:
    """Designs that it is measured of, at most."""
    return sum(len(case.goals) + 2 for case in study.cases)


def simulate(run: StudyRun, choices: Sequence[Choice]) -> Result:
    """Standard deviation of pairs, its share of the variance, share of chaotic samples: arrays over the designs, NaN where
    all failed. Raises InputError if all simulations fail."""
    batches = [scattered(run, one, PAIRS, "chaos", None) for one in choices]
    values = np.stack([batch.values for batch in batches])
    perturbed = values * (1.0 + PERTURBATION)
    pairs = np.stack([values, perturbed], axis=2)  # (designs, PAIRS, 2, variables)
    names, paths = batches[0].names, batches[0].paths
    points = Points(names, pairs.reshape(-1, len(names)), paths)
    f = run.simulations.objective(run.simulations.records(points, "chaos"))
    table = np.array([split(one) for one in f.reshape(len(choices), PAIRS, 2)])
    return {"deviation": table[:, 0], "share": table[:, 1], "chaotic": table[:, 2]}


def split(pairs: np.ndarray) -> tuple[float, float, float]:
    """Standard deviation within pairs, its share of the variance, share of pairs that differ, from values (n, 2), NaN where
    failed."""
    good = pairs[np.isfinite(pairs).all(axis=1)]
    if len(good) < 4:
        return np.nan, np.nan, np.nan
    apart = good[:, 1] - good[:, 0]
    within = float(np.mean(apart**2)) / 2.0
    total = float(np.var(good, axis=0, ddof=1).mean())
    share = min(within / total, 1.0) if total > 0.0 else 0.0
    chaotic = np.abs(apart) > SAME * np.abs(good).mean(axis=1)
    return within**0.5, share, float(chaotic.mean())


def write(run: StudyRun, choices: Sequence[Choice], found: Result) -> None:
    """Write chaos.nc of what `simulate` found."""
    coords = {"design": np.array([choice.name for choice in choices])}
    data = {f"chaos_{name}": found[name] for name in ("deviation", "share")}
    data |= {"chaotic": found["chaotic"], "pairs": np.full(len(choices), PAIRS)}
    run.write(dataset.dataset("chaos", coords, data, objective=run.scene.objective))

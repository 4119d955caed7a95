"""Limits for chaotic or sampled numbers: a test is red only where its own scatter makes the promise unlikely.

Another processor, library or seed gives other numbers of the same distribution. Each limit here is passed wrongly at
most once in `FALSE_RED` where the promise is just met; so a promise that is met with something to spare is as good
as never red, and one that is broken by more than the scatter is red.
"""

from collections.abc import Callable

import numpy as np
from scipy import stats

FALSE_RED = 1e-3
"""Largest probability of a red test on a promise that is just met."""

RESAMPLES = 10_000

TO_SPARE: list[float] = []
"""How far above or below its limit each number of the running test was; `repeat_statistical.py` collects it."""


def at_least(value: float, limit: float) -> None:
    """Assert ``value >= limit``."""
    TO_SPARE.append(float(value - limit))
    assert value >= limit, f"{value} is below {limit}"


def at_most(value: float, limit: float) -> None:
    """Assert ``value <= limit``."""
    TO_SPARE.append(float(limit - value))
    assert value <= limit, f"{value} is above {limit}"


def fewest(trials: int, share: float) -> int:
    """Fewest hits of `trials` that still agree with a true share of at least `share` (binomial)."""
    return int(stats.binom.ppf(FALSE_RED, trials, share))


def most(trials: int, share: float) -> int:
    """Most hits of `trials` that still agree with a true share of at most `share` (binomial)."""
    return int(stats.binom.isf(FALSE_RED, trials, share))


def bootstrap(statistic: Callable[..., np.ndarray], *columns: np.ndarray, side: str) -> float:
    """One-sided bootstrap limit of ``statistic(*columns, axis=-1)``, rows of the columns drawn together.

    Parameters
    ----------
    statistic : callable
        Takes arrays (r, n), one a column, and the keyword `axis`; returns (r,).
    *columns : ndarray, shape (n,)
        What was measured on the same n independent designs.
    side : {"lower", "upper"}
        The limit below or above which the true value lies with probability `FALSE_RED`.
    """
    rng = np.random.default_rng(0)
    size, values = len(columns[0]), []
    for _ in range(10):  # in parts, for the memory
        rows = rng.integers(0, size, (RESAMPLES // 10, size))
        values.append(statistic(*(np.asarray(column)[rows] for column in columns), axis=-1))
    level = {"lower": FALSE_RED, "upper": 1.0 - FALSE_RED}[side]
    return float(np.quantile(np.concatenate(values), level))


def ratio_of_medians(above: np.ndarray, below: np.ndarray, axis: int = -1) -> np.ndarray:
    """Median of `above` over median of `below`."""
    return np.median(above, axis=axis) / np.median(below, axis=axis)


def energy_closes(response, share: float) -> None:
    """Assert that a response's energy closes to a share of its work, or of its kinetic energy.

    At an instant amid an impact, between two steps, the series may be off by more: 9e-4 in one of ten runs of a linkage
    that closes to 1e-6 elsewhere.
    """
    work = float(np.abs(np.diff(response["driving_work"].to_numpy())).sum())
    left = np.abs(response["energy_residual"].to_numpy())
    left = left / max(work, float(response["kinetic_energy"].max()))
    assert np.quantile(left, 0.99) < share
    assert left.max() < 100.0 * share

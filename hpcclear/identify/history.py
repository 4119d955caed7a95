"""Clearance over several dates: rate of growth and time to a limit, with intervals."""

from datetime import date
from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array, Booleans
from hpcclear.base.errors import InputError

DAY = 86400.0


class History(NamedTuple):
    """Lower end of the 95 % interval, median and upper end (3, unknowns): rate, unit of the unknown per second, and time from
    the last date to the limit, s; infinite where it is not reached."""

    rate: Array
    time: Array


def seconds_of(dates: tuple[str, ...], count: int) -> Array:
    """Return the times (count,) of measurements, s after the first; NaN without dates.

    Raises InputError: a date is none, there are too few, or they do not rise.
    """
    if not dates:
        return np.full(count, np.nan)
    if len(dates) != count:
        reason = f"there are {count} signals and {len(dates)} dates"
        raise InputError("--date", ", ".join(dates), reason, "Give one date for each signal")
    try:
        days = np.array([float(date.fromisoformat(one).toordinal()) for one in dates])
    except ValueError:
        raise InputError("--date", ", ".join(dates), "is no date", "Write YYYY-MM-DD") from None
    if (np.diff(days) <= 0.0).any():
        listed = ", ".join(dates)
        raise InputError("--date", listed, "dates do not rise", "Sort the signals by date")
    return DAY * (days - days[0])


def history(
    times: Array, particles: Array, limit: float | None, rng: np.random.Generator, explained: Booleans,
) -> History | None:  # fmt: skip
    """Rate of growth, by least squares through posteriors (m, n, unknowns) at times (m,), s; None for fewer or unknown.

    They are paired by chance: what the dates have in common makes the interval wider than need be. `limit`: SI; without it
    times are NaN. `explained` (m,): records that count, since the posterior of a record that the model does not explain is not
    that of the machine.
    """
    last = times[-1]
    times, particles = times[explained], particles[explained]
    if len(times) < 2 or np.isnan(times).any():
        return None
    drawn = np.stack([rng.permuted(one, axis=0) for one in particles])
    spread = np.maximum(particles.var(axis=1), 1e-300)  # (m, unknowns)
    weight = 1.0 / spread
    total = weight.sum(axis=0)
    centre = (weight * times[:, None]).sum(axis=0) / total
    arm = weight * (times[:, None] - centre)
    rate = (arm[:, None] * drawn).sum(axis=0) / (arm * times[:, None]).sum(axis=0)
    level = (weight[:, None] * drawn).sum(axis=0) / total
    left = np.full_like(rate, np.nan)
    if limit is not None:
        now = level + rate * (last - centre)
        with np.errstate(divide="ignore", invalid="ignore"):
            left = np.where(now >= limit, 0.0, np.where(rate > 0.0, (limit - now) / rate, np.inf))
    levels = (0.025, 0.5, 0.975)
    # infinite ones are no numbers to average
    ends = np.quantile(left, levels, axis=0, method="higher")
    return History(np.quantile(rate, levels, axis=0), ends)

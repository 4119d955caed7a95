"""Settings of the swarm, and what is checked before it starts."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError


@dataclass(frozen=True)
class SwarmSettings:
    """The defaults are the one documented setting; raises `InputError` for senseless values."""

    particles: int = 100
    c1: float = 1.8  # pull to the particle's own best
    c2: float = 1.8  # pull to its leader
    inertia_first: float = 1.2  # w_max of eq. 23
    inertia_last: float = 0.1  # w_min of eq. 23
    speed_limit: float = 0.5  # of each variable's range, per iteration
    mutation_share: float = 0.2
    mutation_index: float = 20.0  # of the polynomial distribution; larger is nearer
    archive_capacity: int = 400
    tournament: int = 3

    def __post_init__(self) -> None:
        for key in ("particles", "archive_capacity", "tournament"):
            whole(f"swarm.{key}", getattr(self, key))
        for key in ("c1", "c2", "inertia_first", "inertia_last", "mutation_index"):
            within(f"swarm.{key}", getattr(self, key), np.inf)
        within("swarm.speed_limit", self.speed_limit, 1.0)
        within("swarm.mutation_share", self.mutation_share, 1.0)


def whole(key: str, value: object) -> None:
    """Raise `InputError` unless `value` is 1, 2, 3, …"""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 1:
        raise InputError(key, value, "not a positive whole number", "Use 1, 2, 3, …")


def within(key: str, value: float, most: float) -> None:
    """Raise `InputError` unless `value` is finite and lies in [0, most]."""
    if not (np.isfinite(value) and 0.0 <= value <= most):
        raise InputError(key, value, f"not between 0 and {most}", "See SwarmSettings.")


def checked_bounds(bounds: ArrayLike) -> tuple[Array, Array]:
    """Lower and upper bounds (d,) of `bounds` (d, 2); raises `InputError` unless they are finite and rise."""
    table = np.array(bounds, dtype=float)
    if table.ndim != 2 or table.shape[1] != 2 or len(table) == 0:
        raise InputError("bounds", table.shape, "wrong shape", "Give (lower, upper) per variable.")
    for row, (lower, upper) in enumerate(table):
        if not (np.isfinite(lower) and np.isfinite(upper) and lower < upper):
            reason = "lower bound not below the upper one, or not finite"
            remedy = "Give lower < upper, and leave out a variable that is fixed."
            raise InputError(f"bounds[{row}]", (float(lower), float(upper)), reason, remedy)
    return table[:, 0].copy(), table[:, 1].copy()

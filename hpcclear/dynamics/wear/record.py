"""What is known of a life: its states of wear, and how it ended."""

import math
from dataclasses import dataclass, field

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.outcome import Status


@dataclass(frozen=True)
class WearState:
    """What is known at a state of wear; `limit` is a 95 % half-width.

    `work`: done so far (joints,), J; `rate`: added in a revolution, J; `peak`: mean of the copies' peak forces of every
    joint of the scene, N; `drift`: difference beyond scatter between copies that waited longer and the others, of the
    rates and of f (joints + 1,), relative; `moments`: of what `Joints.counted` says of the work done, (joints, size), J, as of
    `Relief`; `share` and `share_limit`: of the moments in the rate.
    """

    cycle: float
    work: Array
    rate: Array
    rate_limit: Array
    objective: float
    objective_limit: float
    peak: Array
    drift: Array
    moments: Array
    share: Array
    share_limit: Array


@dataclass
class Life:
    """A life as far as it went: states at the ends of jumps, those half-way, and how it ended.

    `ended`: revolutions; the last jump may go beyond. `reason`: the limit that ended it, as of `curves.first_passed`, "" of
    none. `limit`: 95 % half-width (joints,) of the clearance at the end for what the intervals of the rates leave open, m;
    `error`: sum over jumps (joints,) of what two half jumps and one differ by, by the greater change of the rate in either
    half, m; `drift`: the largest of any rate or f at any state; `sharpest`: as of `Relief`, likewise.
    """

    nodes: list[WearState]
    halves: list[WearState] = field(default_factory=list)
    status: Status = Status.OK
    ended: float = math.nan
    reason: str = ""
    limit: Array = field(default_factory=lambda: np.zeros(0))
    error: Array = field(default_factory=lambda: np.zeros(0))
    certain: bool = True
    drift: float = 0.0
    sharpest: float = 0.0
    simulations: int = 0

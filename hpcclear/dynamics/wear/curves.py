"""What is known of a life: its states of wear, these as curves over revolutions, and when it is over."""

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.outcome import Status
from hpcclear.dynamics.wear.law import Joints
from hpcclear.dynamics.wear.relief import FLAT, LOOKED_AT, Relief

FINE = 1000  # parts of a jump in which the curves are straight where a limit is looked for

THROUGH = "worn_through"  # the limit that every life has: the clearance at which a bearing counts as worn through
DEEPEST = 0.25  # largest clearance around a joint, over the radius of its bearing when new, at which that is


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

    `ended`: revolutions; the last jump may go beyond. `reason`: the limit that ended it, as of `first_passed`, "" of
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


@dataclass(frozen=True)
class Curves:
    """Values at revolutions: (n, worn joints), (n,), and `peak` (n, joints); NaN beyond a life's end.

    `clearance` is the mean around a joint, `local` the largest; `waves` (n, worn joints, size) as of `Relief`, m.
    """

    bearing: Array
    journal: Array
    clearance: Array
    objective: Array
    peak: Array
    local: Array
    waves: Array


def curves(
    found: Life, joints: Joints, cycles: Array, relief: Relief = FLAT, angles: Array = LOOKED_AT
) -> Curves:
    """A life at revolutions (n,), NaN beyond its end.

    `angles`: where the largest clearance is looked for, rad.
    """
    made = _followed(found, joints, cycles, relief, angles)
    beyond = (cycles > found.ended) & (cycles > 0.0)
    for values in vars(made).values():
        values[beyond] = np.nan
    return made


def _followed(
    found: Life, joints: Joints, cycles: Array, relief: Relief, angles: Array = LOOKED_AT
) -> Curves:
    """The same to its last state: its work by cubics through the ends of jumps with their rates, the rest straight."""
    from scipy.interpolate import CubicHermiteSpline

    if not found.nodes:
        nothing = np.full((len(cycles), len(joints.clearance)), np.nan)
        waves = np.full((*nothing.shape, relief.size), np.nan)
        return Curves(nothing, nothing, nothing, nothing[:, 0], nothing[:, :0], nothing, waves)
    at = np.array([node.cycle for node in found.nodes])
    work = np.stack([node.work for node in found.nodes])
    if len(at) > 1:
        rates = np.stack([node.rate for node in found.nodes])
        smooth = CubicHermiteSpline(at, work, rates)(np.minimum(cycles, at[-1]))
        work = np.clip(smooth, work[0], work[-1])
    else:
        work = np.repeat(work, len(cycles), axis=0)
    states = sorted([*found.nodes, *found.halves], key=lambda node: node.cycle)
    places = [node.cycle for node in states]
    peaks = np.stack([node.peak for node in states])
    objective = np.interp(cycles, places, [node.objective for node in states])
    peak = np.stack([np.interp(cycles, places, column) for column in peaks.T], axis=-1)
    counted = joints.counted(work)
    waves = relief.waves(joints, _moments(found, joints, counted))
    clearance = joints.worn(work)[0]
    return Curves(
        joints.bearing * counted, joints.journal * counted, clearance, objective, peak,
        clearance + relief.deepest(waves, angles), waves,
    )  # fmt: skip


def _moments(found: Life, joints: Joints, counted: Array) -> Array:
    """Moments (n, joints, size), J, by counted work (n, joints): straight between the ends of jumps, as they were made."""
    at = joints.counted(np.stack([node.work for node in found.nodes]))
    every = np.stack([node.moments for node in found.nodes])
    made = np.empty((*counted.shape, every.shape[-1]))
    for joint, number in np.ndindex(*every.shape[1:]):
        made[:, joint, number] = np.interp(counted[:, joint], at[:, joint], every[:, joint, number])
    return made


def local_bounds(joints: Joints, limits: Mapping[str, float]) -> Array:
    """Largest clearance around each joint that ends a life, m, of the shape of `joints`."""
    return np.minimum(DEEPEST * joints.bearing_radius, limits.get("clearance", math.inf))


def first_passed(
    found: Life, joints: Joints, limits: Mapping[str, float], relief: Relief, since: int = 0
) -> tuple[float, str]:
    """Revolutions at which a life first passes a limit, and its name; infinite and "" where it passes none.

    `limits`: "clearance" (of the largest around any joint, m), "peak_contact_force" (N), "objective" (SI); each life has that
    of a bearing worn through besides, `THROUGH`. `since`: number of the first jump that is looked at.
    """
    at = [node.cycle for node in found.nodes]
    if not at:
        return math.inf, ""
    bounds = {**limits, THROUGH: 1.0}
    for ends in [(at[0], at[0])] if len(at) == 1 else itertools.pairwise(at[max(since, 0) :]):
        fine = np.linspace(*ends, FINE + 1)
        seen = _followed(found, joints, fine, relief)
        values = {
            "clearance": seen.local, "peak_contact_force": seen.peak, "objective": seen.objective[:, None],
            THROUGH: seen.local / (DEEPEST * joints.bearing_radius),
        }  # fmt: skip
        curves = [(name, column) for name in bounds for column in values[name].T]
        cycle, name = min((_crossing(fine, curve, bounds[name]), name) for name, curve in curves)
        if math.isfinite(cycle):
            return cycle, name
    return math.inf, ""


def lifetime(
    found: Life, joints: Joints, limits: Mapping[str, float], relief: Relief = FLAT
) -> float:
    """Revolutions until a limit is passed, as of `first_passed`.

    Infinite where none is passed by the end; NaN of a life that failed before it could show.
    """
    end, _ = first_passed(found, joints, limits, relief)
    if math.isfinite(end) or found.status.valid:
        return end
    return found.ended if found.status is Status.WORN_THROUGH else math.nan


def _crossing(at: Array, values: Array, limit: float) -> float:
    """Where values first pass a limit."""
    above = np.flatnonzero(values > limit)
    if not len(above):
        return math.inf
    k = int(above[0])
    if k == 0:
        return float(at[0])
    share = (limit - values[k - 1]) / (values[k] - values[k - 1])
    return float(at[k - 1] + share * (at[k] - at[k - 1]))

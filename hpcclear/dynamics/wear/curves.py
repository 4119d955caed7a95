"""A life's states as curves over revolutions, and when it is over."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.outcome import Status
from hpcclear.dynamics.wear.law import Joints
from hpcclear.dynamics.wear.life import Life
from hpcclear.dynamics.wear.relief import FLAT, LOOKED_AT, Relief

FINE = 4000
"""Revolutions at which a limit is looked for, between which the curves are straight."""


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
    """A life at revolutions (n,): its work by cubics through the ends of jumps with their rates, the rest straight.

    `angles`: where the largest clearance is looked for, rad.
    """
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
    beyond = (cycles > found.ended) & (cycles > 0.0)
    work[beyond] = np.nan
    states = sorted([*found.nodes, *found.halves], key=lambda node: node.cycle)
    places = [node.cycle for node in states]
    peaks = np.stack([node.peak for node in states])
    objective = np.interp(cycles, places, [node.objective for node in states])
    peak = np.stack([np.interp(cycles, places, column) for column in peaks.T], axis=-1)
    objective[beyond], peak[beyond] = np.nan, np.nan
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
    made[np.isnan(counted)] = np.nan
    return made


def lifetime(
    found: Life, joints: Joints, limits: Mapping[str, float], relief: Relief = FLAT
) -> float:
    """Revolutions until a limit is passed ("clearance", "peak_contact_force", "objective"), or the bearing is worn through.

    It is the largest clearance around a joint that passes its limit.
    Infinite where none is passed by the end; NaN of a life that failed before it could show.
    """
    fine = np.linspace(0.0, found.ended, FINE) if found.ended > 0.0 else np.zeros(1)
    seen = curves(found, joints, fine, relief)
    values = {
        "clearance": seen.local, "peak_contact_force": seen.peak, "objective": seen.objective[:, None],
    }  # fmt: skip
    ends = [
        _crossing(fine, column, limit)
        for name, limit in limits.items()
        for column in values[name].T
    ]
    end = min(ends, default=math.inf)
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

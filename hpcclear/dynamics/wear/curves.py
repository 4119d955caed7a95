"""A life's states as curves over revolutions, and when it is over."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.outcome import Status
from hpcclear.dynamics.wear.law import Joints
from hpcclear.dynamics.wear.life import Life

FINE = 4000
"""Revolutions at which a limit is looked for, between which the curves are straight."""


@dataclass(frozen=True)
class Curves:
    """Values at revolutions: (n, worn joints), (n,), and `peak` (n, joints); NaN beyond a life's end."""

    bearing: Array
    journal: Array
    clearance: Array
    objective: Array
    peak: Array


def curves(found: Life, joints: Joints, cycles: Array) -> Curves:
    """A life at revolutions (n,): its work by cubics through the ends of jumps with their rates, the rest straight."""
    from scipy.interpolate import CubicHermiteSpline

    if not found.nodes:
        nothing = np.full((len(cycles), len(joints.clearance)), np.nan)
        return Curves(nothing, nothing, nothing, nothing[:, 0], nothing[:, :0])
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
    return Curves(
        joints.bearing * counted, joints.journal * counted, joints.worn(work)[0], objective, peak
    )


def lifetime(found: Life, joints: Joints, limits: Mapping[str, float]) -> float:
    """Revolutions until a limit is passed ("clearance", "peak_contact_force", "objective"), or the bearing is worn through.

    Infinite where none is passed by the end; NaN of a life that failed before it could show.
    """
    fine = np.linspace(0.0, found.ended, FINE) if found.ended > 0.0 else np.zeros(1)
    seen = curves(found, joints, fine)
    values = {
        "clearance": seen.clearance, "peak_contact_force": seen.peak, "objective": seen.objective[:, None],
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

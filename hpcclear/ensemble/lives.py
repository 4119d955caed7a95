"""Service lives as a dataset: curves and their quantiles, profiles, survival, main causes, and warnings."""

import numpy as np

from hpcclear.base.arrays import Array, Integers
from hpcclear.base.outcome import Flag, Status
from hpcclear.dynamics.layout.views import Parameters
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.wear.curves import THROUGH, Curves, Life, curves, lifetime, local_bounds
from hpcclear.dynamics.wear.law import Joints
from hpcclear.dynamics.wear.relief import FLAT, Relief
from hpcclear.results import dataset
from hpcclear.results.content import Results
from hpcclear.scene import Scene
from hpcclear.scene.points import Points
from hpcclear.statistics.random.survival import quantiles, rank_correlation, share_interval

HOUR = 3600.0
"""s."""

LEVELS = np.array([0.05, 0.25, 0.5, 0.75, 0.95])
"""Quantiles that are reported."""


def ages_of(scene: Scene, lives: list[Life]) -> Array:
    """Revolutions (n,) of the curves: evenly to the end of the longest life, and where random inputs of the study are taken."""
    wear = scene.required_wear
    longest = max(one.ended for one in lives) or wear.cycles
    asked = [] if scene.study is None else [row.cycles for row in scene.study.worn]
    return np.union1d(np.linspace(0.0, longest, wear.points), np.array(asked, float))


def revolution_times(scene: Scene, inputs: Points) -> Array:
    """Duration (n,) of a revolution of each life, s, at the nominal speed: of a torque drive, the one its entries expect."""
    driven = [(path, k) for k, paths in enumerate(inputs.paths) for path in paths]
    names, columns = [path for path, _ in driven if ".wear." not in path], inputs.values.T
    values = np.array([columns[k] for path, k in driven if path in names])
    points = Points(tuple(names), values.reshape(-1, len(inputs)).T, tuple((n,) for n in names))
    return Parameters(parameters(scene, points)).period


def relief_of(scene: Scene) -> Relief:
    """What profiles of wear are made of."""
    return Relief(**scene.waves()) if scene.required_wear.waves else FLAT


def lives_dataset(
    scene: Scene,
    inputs: Points,
    joints: Joints,
    lives: list[Life],
    attributes: dict[str, str],
    even: list[Life] | None = None,
) -> Results:
    """Lives and their statistics as a dataset of kind ``wear``; `even`: the same worn evenly, where profiles were followed."""
    cycles, relief = ages_of(scene, [*lives, *(even or ())]), relief_of(scene)
    wear = scene.required_wear
    angles = np.linspace(0.0, 2.0 * np.pi, wear.bins, endpoint=False)
    limits = wear.limit.given()
    found = [curves(one, joints[k], cycles, relief, angles) for k, one in enumerate(lives)]
    last = [curves(one, joints[k], np.array([one.ended]), relief) for k, one in enumerate(lives)]
    ends = np.array([lifetime(one, joints[k], limits, relief) for k, one in enumerate(lives)])
    local, times = _stacked(found, "local"), revolution_times(scene, inputs)
    at_end = np.concatenate([one.local for one in last])
    # a crossing is interpolated between points of the curve, which lies below its chord where wear speeds up
    over = at_end >= (1.0 - 1e-6) * local_bounds(joints, limits)
    at_end[[not (one.reason or one.status.valid) for one in lives]] = np.nan
    values = _curves(found, len(cycles), len(scene.joint_labels))
    data: dict[str, np.ndarray] = {
        **values,
        **_of_lives(lives),
        "lifetime": ends,
        "lifetime_hours": ends * times / HOUR,
        "revolution_time": times,
        "end_clearance": at_end,
        "lifetime_hours_quantile": quantiles(ends * times / HOUR, LEVELS),
        **statistics(
            values, ends, lives, cycles, limits.get("clearance"), local,
            np.where(over, np.inf, at_end),
        ),
        "rank_correlation": _causes(inputs, joints, lives, last),
    }  # fmt: skip
    if even is not None:
        data |= {"local_clearance": local, "sharpest": np.array([one.sharpest for one in lives])}
        data |= _profiles(relief, found, angles) | _evenly(joints, even, cycles, limits)
    data |= dict(zip(inputs.names, inputs.values.T, strict=True))
    coords: dict[str, np.ndarray] = {
        "life": np.arange(len(lives)), "joint": np.array(scene.worn_joints(), dtype=str),
        "open_joint": np.array(scene.joint_labels, dtype=str), "cycle": cycles, "quantile": LEVELS,
        "random_input": np.array(inputs.names, dtype=str),
    } | ({} if even is None else {"angle": angles})  # fmt: skip
    bounds = {f"limit_{name}": value for name, value in limits.items()}
    attrs = {**attributes, "tolerance": wear.tolerance, **bounds}
    return dataset.dataset("wear", coords, data, attrs, inputs.units, scene.objective, inputs.words)


def _curves(found: list[Curves], ages: int, labels: int) -> dict[str, Array]:
    """What lives have at each age, (lives, ages, ...)."""
    unknown = np.full((ages, labels), np.nan)
    depths = {f"{name}_depth": _stacked(found, name) for name in ("bearing", "journal")}
    others = {name: _stacked(found, name) for name in ("clearance", "objective")}
    peaks = np.stack([one.peak if one.peak.shape[1] else unknown for one in found])
    return {**depths, **others, "peak_contact_force": peaks}


def _of_lives(lives: list[Life]) -> dict[str, Array]:
    """How each life went, and what it cost."""
    return {
        "clearance_limit": np.stack([one.limit for one in lives]),
        "clearance_error": np.stack([one.error for one in lives]),
        "drift": np.array([one.drift for one in lives]),
        "end_reason": np.array([_reason(one) for one in lives], dtype=str),
        "ended": np.array([one.ended for one in lives]),
        "jumps": np.array([max(len(one.nodes) - 1, 0) for one in lives]),
        "simulations": np.array([one.simulations for one in lives]),
        "ending": np.array([int(one.status) for one in lives], np.int8),
        "flags": np.array([int(Flag.TARGET_MISSED) * (not one.certain) for one in lives], np.int8),
    }


def _causes(inputs: Points, joints: Joints, lives: list[Life], last: list[Curves]) -> Array:
    """Rank correlation of each random input with the growth of each clearance a revolution, (inputs, joints)."""
    ended = np.array([one.ended if one.reason or one.status.valid else np.nan for one in lives])
    grown = np.concatenate([one.clearance for one in last]) - joints.clearance
    growth = grown / np.where(ended > 0.0, ended, np.nan)[:, None]
    found = [rank_correlation(column, one) for column in inputs.values.T for one in growth.T]
    return np.reshape(found, (-1, growth.shape[1]))


def _reason(one: Life) -> str:
    """What ended a life, as in the file."""
    if one.reason:
        return one.reason
    if one.status is Status.WORN_THROUGH:
        return THROUGH
    return "cycles" if one.status.valid else "failed"


def _profiles(relief: Relief, found: list[Curves], angles: Array) -> dict[str, Array]:
    """Quantiles over service lives of the depth of both surfaces by the angle, (quantile, cycle, joint, angle), m."""
    aside = relief.around(_stacked(found, "waves"), angles)
    return {
        f"{surface}_profile": quantiles(
            _stacked(found, surface)[..., None] + aside[..., k, :], LEVELS
        )
        for k, surface in enumerate(("bearing", "journal"))
    }


def _evenly(
    joints: Joints, lives: list[Life], cycles: Array, limits: dict[str, float]
) -> dict[str, Array]:
    """What lives come to when their surfaces wear evenly."""
    found = [curves(one, joints[k], cycles) for k, one in enumerate(lives)]
    ends = np.array([lifetime(one, joints[k], limits) for k, one in enumerate(lives)])
    return {
        "even_clearance": _stacked(found, "clearance"),
        "even_lifetime": ends,
        "even_lifetime_quantile": quantiles(ends, LEVELS),
        "even_simulations": np.array([one.simulations for one in lives]),
    }


def _stacked(found: list[Curves], name: str) -> Array:
    return np.stack([getattr(one, name) for one in found])


def statistics(
    values: dict[str, Array], ends: Array, lives: list[Life], cycles: Array, limit: float | None,
    local: Array, at_end: Array,
) -> dict[str, Array]:  # fmt: skip
    """Quantiles over lives, survival and exceedance with confidence intervals; lives that failed are left out.

    `values` by name as in the file, shape (lives, cycles, ...); `ends`, shape (lives,); `limit`, m, is what the
    largest clearance around a joint, `local` (lives, cycles, joints), exceeds.
    `at_end`: the largest clearance around each joint (lives, joints) when the life ended, infinite where that was beyond what
    ends a life.

    A life that is over, at a limit or worn through, counts from there on: with infinite f and mean clearance, above any
    quantile of those that go on.
    """
    over = np.array([bool(one.reason) for one in lives])
    ended = np.array([one.ended for one in lives])[:, None]
    gone = over[:, None] & (ended < cycles)
    clearance = np.where(gone[..., None], np.inf, values["clearance"])
    objective = np.where(gone, np.inf, values["objective"])
    known = ends[~np.isnan(ends)]
    dead = (known[:, None] <= cycles).sum(axis=0)
    share, lower, upper = _shares(dead, np.array(len(known)))
    made = {
        "clearance_quantile": quantiles(clearance, LEVELS),
        "objective_quantile": quantiles(objective, LEVELS),
        "lifetime_quantile": quantiles(ends, LEVELS),
        "survival": 1.0 - share,
        "survival_lower": 1.0 - upper,
        "survival_upper": 1.0 - lower,
    }
    if limit is not None:
        there = (over[:, None] & (ended <= cycles))[..., None]
        largest = np.where(there, at_end[:, None], local)
        found = _shares((largest > limit).sum(axis=0), (~np.isnan(largest)).sum(axis=0))
        names = ("exceedance", "exceedance_lower", "exceedance_upper")
        made |= zip(names, found, strict=True)
    return made


def _shares(count: Integers, total: Integers) -> tuple[Array, Array, Array]:
    """Shares of lives, NaN where there are none, and both ends of their 95 % confidence intervals."""
    lower, upper = share_interval(count, total)
    with np.errstate(invalid="ignore", divide="ignore"):
        return count / total, lower, upper

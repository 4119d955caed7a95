"""What lives come to, as a dataset: curves and their quantiles, profiles, survival, what decides, and what to mind."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr

from hpcclear.base.arrays import Array
from hpcclear.base.outcome import Flag, Status
from hpcclear.dynamics.wear.curves import Curves, curves, lifetime
from hpcclear.dynamics.wear.law import Joints
from hpcclear.dynamics.wear.life import Life
from hpcclear.dynamics.wear.relief import FLAT, Relief
from hpcclear.results import dataset
from hpcclear.scene import Scene
from hpcclear.scene.points import Points
from hpcclear.statistics.random.survival import quantiles, rank_correlation, share_limits

LEVELS = np.array([0.05, 0.25, 0.5, 0.75, 0.95])
"""Quantiles that are told."""


def ages_of(scene: Scene) -> Array:
    """Revolutions (n,) at which curves are told: evenly over a life, and where random inputs of the study are taken."""
    assert scene.wear is not None
    even = np.linspace(0.0, scene.wear.cycles, scene.wear.points)
    asked = [] if scene.study is None else [row.cycles for row in scene.study.worn]
    return np.union1d(even, np.array(asked, float))


def relief_of(scene: Scene) -> Relief:
    """What profiles of wear are made of."""
    assert scene.wear is not None
    return Relief(**scene.waves()) if scene.wear.waves else FLAT


def lives_dataset(
    scene: Scene,
    inputs: Points | None,
    joints: Joints,
    lives: list[Life],
    attributes: dict[str, str],
    even: list[Life] | None = None,
) -> xr.Dataset:
    """Lives and their statistics as a dataset of kind ``wear``; `even`: the same worn evenly, where profiles were followed."""
    assert scene.wear is not None
    cycles, relief = ages_of(scene), relief_of(scene)
    angles = np.linspace(0.0, 2.0 * np.pi, scene.wear.bins, endpoint=False)
    found = [curves(one, joints[k], cycles, relief, angles) for k, one in enumerate(lives)]
    labels = len(scene.joint_labels)
    values = {
        "clearance": _stacked(found, "clearance"),
        "bearing_depth": _stacked(found, "bearing"),
        "journal_depth": _stacked(found, "journal"),
        "objective": _stacked(found, "objective"),
        "peak_contact_force": np.stack(
            [
                one.peak if one.peak.shape[1] else np.full((len(cycles), labels), np.nan)
                for one in found
            ]
        ),
    }
    limits = scene.wear.limit.given()
    ends = np.array([lifetime(one, joints[k], limits, relief) for k, one in enumerate(lives)])
    local = _stacked(found, "local")
    data: dict[str, Any] = {
        **values,
        "clearance_limit": np.stack([one.limit for one in lives]),
        "clearance_error": np.stack([one.error for one in lives]),
        "drift": np.array([one.drift for one in lives]),
        "lifetime": ends,
        "ended": np.array([one.ended for one in lives]),
        "jumps": np.array([max(len(one.nodes) - 1, 0) for one in lives]),
        "simulations": np.array([one.simulations for one in lives]),
        "ending": np.array([int(one.status) for one in lives], np.int8),
        "flags": np.array(
            [0 if one.certain else int(Flag.TARGET_MISSED) for one in lives], np.int8
        ),
        **statistics(values, ends, lives, cycles, limits.get("clearance"), local),
    }
    if even is not None:
        data |= {"local_clearance": local, "sharpest": np.array([one.sharpest for one in lives])}
        data |= _profiles(relief, found, angles) | _evenly(joints, even, cycles, limits)
    names = () if inputs is None else inputs.names
    growth = values["clearance"][:, -1] - values["clearance"][:, 0]
    data["rank_correlation"] = np.array(
        [[rank_correlation(inputs.column(name), one) for one in growth.T] for name in names]
        if inputs is not None
        else np.empty((0, growth.shape[1]))
    )
    if inputs is not None:
        data |= {name: inputs.column(name) for name in names}
    coords: dict[str, Any] = {
        "life": np.arange(len(lives)), "joint": np.array(scene.worn_joints(), dtype=str),
        "open_joint": np.array(scene.joint_labels, dtype=str), "cycle": cycles, "quantile": LEVELS,
        "random_input": np.array(names, dtype=str),
    }  # fmt: skip
    if even is not None:
        coords["angle"] = angles
    units = {} if inputs is None else dict(zip(names, inputs.units, strict=True))
    words = None if inputs is None else inputs.words
    told = {
        **attributes,
        "tolerance": scene.wear.tolerance,
        **{f"limit_{name}": value for name, value in limits.items()},
    }
    return dataset.dataset("wear", coords, data, told, units, scene.objective, words)


def _profiles(relief: Relief, found: list[Curves], angles: Array) -> dict[str, Array]:
    """Quantiles over lives of the depth of both surfaces by the angle, (quantile, cycle, joint, angle), m."""
    aside = relief.around(_stacked(found, "waves"), angles)
    mean = {"bearing_profile": "bearing", "journal_profile": "journal"}
    return {
        name: quantiles(_stacked(found, surface)[..., None] + aside[..., k, :], LEVELS)
        for k, (name, surface) in enumerate(mean.items())
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


def doubts(content: xr.Dataset) -> list[str]:
    """What to mind of lives in a file, a sentence each: rates that scatter too much, motion that had not settled."""
    texts = []
    unsure = int((content["flags"] == Flag.TARGET_MISSED).sum())
    if unsure:
        texts.append(
            f"in {unsure} lives wear rate or f scatters more than wear.tolerance; see clearance_limit"
        )
    drift = content["drift"].to_numpy()
    moving = int((drift > content.attrs["tolerance"]).sum())
    if moving:
        text = f"in {moving} lives wear rate or f still moves with a longer transient, by {drift.max():.1%} at most"
        texts.append(f"{text}; raise numerics.transient_revolutions")
    if "sharpest" in content:
        narrow = int((content["sharpest"] > 1.0).sum())
        if narrow:
            texts.append(
                f"in {narrow} lives a groove is worn narrower than the journal, which would touch both of its edges; "
                "lower wear.harmonics"
            )
    return texts


def _stacked(found: list[Curves], name: str) -> Array:
    return np.stack([getattr(one, name) for one in found])


def statistics(
    values: dict[str, Array], ends: Array, lives: list[Life], cycles: Array, limit: float | None,
    local: Array | None = None,
) -> dict[str, Array]:  # fmt: skip
    """Quantiles over lives, survival and exceedance with limits; lives that failed are left out.

    `values` by name as in the file, shape (lives, cycles, ...); `ends`, shape (lives,); `limit`, m, is what the
    largest clearance around a joint, `local`, exceeds; the mean where that is not given.

    A life whose bearing is worn through counts, with a clearance above any limit from there on.
    """
    through = np.array([one.status is Status.WORN_THROUGH for one in lives])
    beyond = np.array([one.ended for one in lives])[:, None] < cycles
    gone = through[:, None] & beyond
    clearance = np.where(gone[..., None], np.inf, values["clearance"])
    objective = np.where(gone, np.inf, values["objective"])
    known = ends[~np.isnan(ends)]
    over = (known[:, None] <= cycles).sum(axis=0)
    dead_lower, dead_upper = share_limits(over, len(known))
    share = over / len(known) if len(known) else np.full(len(cycles), np.nan)
    made = {
        "clearance_quantile": quantiles(clearance, LEVELS),
        "objective_quantile": quantiles(objective, LEVELS),
        "lifetime_quantile": quantiles(ends, LEVELS),
        "survival": 1.0 - share,
        "survival_lower": 1.0 - dead_upper,
        "survival_upper": 1.0 - dead_lower,
    }
    if limit is not None:
        largest = clearance if local is None else np.where(gone[..., None], np.inf, local)
        made |= dict(_exceeded(largest, limit))
    return made


def _exceeded(clearance: Array, limit: float) -> Iterator[tuple[str, Array]]:
    """Share of lives above a limit at each revolution and joint, and its 95 % limits."""
    total = (~np.isnan(clearance)).sum(axis=0)
    above = (clearance > limit).sum(axis=0)
    lower, upper = np.zeros(above.shape), np.ones(above.shape)
    for place in np.ndindex(*above.shape):
        low, high = share_limits(above[place], int(total[place]))
        lower[place], upper[place] = float(low), float(high)
    with np.errstate(invalid="ignore", divide="ignore"):
        yield "exceedance", above / total
    yield "exceedance_lower", lower
    yield "exceedance_upper", upper

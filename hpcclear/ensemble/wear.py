"""The `wear` command: lives of a mechanism whose joints wear, on all ranks.

Root follows the lives (`hpcclear.dynamics.wear.life`) side by side: what all of them ask for is a design like any other,
simulated on all ranks and kept in the checkpoint; who goes on after a kill asks for the same once more and finds it done.
"""

import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from hpcclear.base.arrays import Array, Records
from hpcclear.base.errors import InputError
from hpcclear.base.outcome import OUTCOME, Flag, Status
from hpcclear.dynamics.parameters import Numbers, wave_paths
from hpcclear.dynamics.wear.curves import Curves, curves, lifetime
from hpcclear.dynamics.wear.law import Joints, joints_of
from hpcclear.dynamics.wear.life import Asked, Asking, Life, Plan, Seen, life
from hpcclear.dynamics.wear.relief import FLAT, Relief
from hpcclear.ensemble.identity import run_key
from hpcclear.ensemble.session import DEFAULT_OPTIONS, Finished, Options, Place, Session
from hpcclear.ensemble.simulate import sample_points, saving
from hpcclear.ranks.team import Ranks
from hpcclear.results import dataset
from hpcclear.results.checkpoint import Checkpoint
from hpcclear.results.names import KINDS
from hpcclear.scene import Scene
from hpcclear.scene.points import Points
from hpcclear.scene.sampling import monte_carlo
from hpcclear.statistics.random.survival import quantiles, rank_correlation, share_limits

KICK = 1e-9
"""Relative difference of the clearances of two copies."""

LEVELS = np.array([0.05, 0.25, 0.5, 0.75, 0.95])
"""Quantiles that are told."""


def check_worn(scene: Scene) -> None:
    """Refuse a scene that has no lives to follow.

    Raises
    ------
    InputError
    """
    if scene.wear is None:
        raise InputError(
            "wear", None, "the scene does not say what lives to follow", "Add [wear], as in jobs/wear.toml"
        )  # fmt: skip
    if not scene.worn_joints():
        raise InputError(
            "joints", None, "no joint of the scene wears", "Give one a table wear, as in jobs/wear.toml"
        )  # fmt: skip
    alike = scene.study is None or not of_lives(scene).required_study.random
    if scene.wear.lives > 1 and alike:
        raise InputError(
            "wear.lives", scene.wear.lives, "without random inputs all lives are the same",
            "Add [study.random], or follow one life",
        )  # fmt: skip
    if scene.study is not None and scene.study.worn and scene.wear.lives == 1:
        raise InputError(
            "wear.lives",
            1,
            "one life has no distribution of clearances",
            "Follow more, such as 100",
        )
    for name in KINDS["wear"].data.keys() | KINDS["wear"].coords.keys():
        if scene.study is not None and name in [row.name for row in scene.study.random]:
            raise InputError(
                f"study.random.{name}", name, "is the name of a result", "Rename it, and give its path"
            )  # fmt: skip
    for entry, off in (("target_error", None), ("uncertainty", False)):
        if getattr(scene.numerics, entry) != off:
            raise InputError(
                f"numerics.{entry}", getattr(scene.numerics, entry),
                "lives have copies of their own for the limits of rate and f", "Remove it, and set wear.copies",
            )  # fmt: skip


def of_lives(scene: Scene) -> Scene:
    """The scene without inputs that its lives are to tell: their clearances are new ones, with what scatter these have."""
    if scene.study is None or not scene.study.worn:
        return scene
    changes: dict[str, Any] = {"study.cases": {}}
    for row in scene.study.worn:
        new = {"distribution": "uniform", "half_width": row.half_width, "paths": list(row.paths)}
        changes[f"study.random.{row.name}"] = new if row.half_width is not None else None
    return scene.with_(changes)


def ages_of(scene: Scene) -> Array:
    """Revolutions (n,) at which curves are told: evenly over a life, and where random inputs of the study are taken."""
    assert scene.wear is not None
    even = np.linspace(0.0, scene.wear.cycles, scene.wear.points)
    asked = [] if scene.study is None else [row.cycles for row in scene.study.worn]
    return np.union1d(even, np.array(asked, float))


def inputs_of(scene: Scene) -> Points | None:
    """Random inputs of every life, a row each; None of a single one, which is the scene as it stands."""
    assert scene.wear is not None
    if scene.wear.lives == 1:
        return None
    return monte_carlo(of_lives(scene), scene.wear.lives, design={}, purpose="wear")


class States:
    """States of wear as designs: random inputs that do not wear, then clearance and bearing radius of every worn joint, then,
    where profiles are followed, the waves around its surfaces."""

    def __init__(self, scene: Scene, inputs: Points | None, joints: Joints) -> None:
        own = [f"{scene.joint_key(name)}." for name in scene.worn_joints()]
        changing = [f"{key}{entry}" for key in own for entry in ("clearance", "bearing_radius")]
        self.relief = relief_of(scene)
        waves = [path for name in scene.worn_joints() for path in wave_paths(scene, name)]
        waves = waves if self.relief.size else []
        changing += waves
        driven = [path for paths in (() if inputs is None else inputs.paths) for path in paths]
        free = [path for path in driven if path not in changing and ".wear." not in path]
        get = Numbers(scene, inputs)
        fixed = [get(path) for path in free]
        self.names = (*free, *changing)
        self._new = (
            np.stack([get.known(path) for path in waves], -1) if waves else np.zeros((get.size, 0))
        )
        self._fixed = np.stack(fixed, axis=-1) if fixed else np.empty((get.size, 0))
        self._joints = joints

    def rows(self, number: int, asked: Asked) -> Array:
        """Designs of a life's copies, shape (copies, names)."""
        clearance, radius = self._joints[number].worn(asked.work)
        kicks = 1.0 + KICK * np.array(asked.copies)[:, None]
        state = np.stack(
            [clearance * kicks, np.broadcast_to(radius, kicks.shape[:1] + radius.shape)], -1
        )
        fixed = np.repeat(self._fixed[number][None], len(kicks), axis=0)
        parts = [fixed, state.reshape(len(kicks), -1)]
        if self.relief.size:
            worn = np.zeros(self._new.shape[1])
            if asked.moments is not None:
                worn = self.relief.waves(self._joints[number], asked.moments).ravel()
            parts.append(np.repeat((self._new[number] + worn)[None], len(kicks), axis=0))
        return np.concatenate(parts, axis=1)

    def points(self, rows: Array) -> Points:
        """Such designs, shape (n, names), as points."""
        return Points(self.names, rows, tuple((name,) for name in self.names))


def relief_of(scene: Scene) -> Relief:
    """What profiles of wear are made of."""
    assert scene.wear is not None
    return Relief(**scene.waves()) if scene.wear.waves else FLAT


def follow(
    scene: Scene,
    joints: Joints,
    states: States,
    ranks: Ranks,
    checkpoint: Checkpoint,
    first: int = 0,
) -> list[Life]:
    """All lives to their ends; raises as `sample_points`. `first`: number of the first simulation in the checkpoint."""
    assert scene.wear is not None
    plan = Plan(
        scene.wear.cycles, scene.wear.tolerance, float(_averaged(scene)), scene.wear.copies,
        scene.wear.most_copies,
    )  # fmt: skip
    relief = relief_of(scene)
    worn = [scene.joint_labels.index(name) for name in scene.worn_joints()]
    going: dict[int, tuple[Asking, Asked]] = {}
    ended: dict[int, Life] = {}
    for number in range(len(joints.clearance)):
        asking = life(joints[number], plan, relief)
        _go_on(number, asking, None, going, ended)
    while going:
        rows = [states.rows(number, asked) for number, (_, asked) in going.items()]
        design = np.concatenate(rows)
        late = np.concatenate([np.array(asked.copies) % 2 == 1 for _, asked in going.values()])
        records = np.empty(len(design), OUTCOME)
        for chosen, here in ((~late, scene), (late, waiting_longer(scene))):
            if chosen.any():
                points = states.points(design[chosen])
                records[chosen] = sample_points(
                    here, points, ranks, checkpoint, stage="wear", first=first
                )
                first += len(points)
        answers = np.split(records, np.cumsum([len(part) for part in rows])[:-1])
        waiting, going = going, {}
        for (number, (asking, _)), answer in zip(waiting.items(), answers, strict=True):
            _go_on(
                number, asking, _seen(answer, worn, len(scene.joint_labels), relief), going, ended
            )
    return [ended[number] for number in range(len(joints.clearance))]


def waiting_longer(scene: Scene) -> Scene:
    """The scene for copies that wait longer before they are measured, by a stretch as long as is averaged."""
    numerics = scene.numerics
    wait = numerics.transient_revolutions + int(_averaged(scene))
    return scene.with_({"numerics.transient_revolutions": wait})


def _averaged(scene: Scene) -> int:
    averaged: Any = scene.numerics.averaged_revolutions
    return 1 if averaged == "auto" else averaged


def _go_on(
    number: int,
    asking: Asking,
    seen: Seen | None,
    going: dict[int, tuple[Asking, Asked]],
    ended: dict[int, Life],
) -> None:
    """Send a life what it waited for; it asks for more or ends."""
    try:
        asked = next(asking) if seen is None else asking.send(seen)
        going[number] = asking, asked
    except StopIteration as end:
        ended[number] = end.value


def _seen(records: Records, worn: list[int], joints: int, relief: Relief) -> Seen:
    moments = None
    if relief.size:
        rows = [slice(k * relief.size, (k + 1) * relief.size) for k in worn]
        moments = np.stack([records["sliding_waves"][:, row] for row in rows], axis=1)
    return Seen(
        records["sliding_work"][:, worn], records["objective"],
        records["peak_contact_force"][:, :joints], records["status"], moments,
    )  # fmt: skip


def run_wear(
    scene: Scene,
    output: Path,
    ranks: Ranks,
    options: Options = DEFAULT_OPTIONS,
    timing: Path | None = None,
) -> Finished:
    """Follow the lives of a scene on all ranks and write them; on root.

    Parameters
    ----------
    scene : Scene
        With ``[wear]`` and a worn joint.
    output : Path
        NetCDF file of kind ``wear``.
    ranks : Ranks
    options : Options
    timing : Path, optional
        Where the times go, beside the output by default.

    Raises
    ------
    InputError, StorageError, Stopped, RankFailed
    """
    began = time.perf_counter()
    check_worn(scene)
    place = Place.of_file(output, options.fresh)
    place = place if timing is None else replace(place, timing=timing)
    inputs = inputs_of(scene)
    joints = joints_of(scene, inputs)
    states = States(scene, inputs, joints)
    with Session(place, run_key(scene, "wear"), ranks, options) as session:
        content = session.found("wear")
        if content is None:
            session.describe(scene)
            named = states.points(np.empty((0, len(states.names))))
            units = dict(zip(named.names, named.units, strict=True))
            checkpoint = session.opened(states.names, units)
            lives = follow(scene, joints, states, ranks, checkpoint)
            even = None
            if states.relief.size:  # the same lives, worn evenly, for comparison
                done = sum(one.simulations for one in lives)
                evenly = scene.with_({"wear.profile": "uniform"})
                even = follow(evenly, joints, states, ranks, checkpoint, done)
            with saving(checkpoint.flush):
                content = session.write(
                    lives_dataset(scene, inputs, joints, lives, session.attributes, even)
                )
        session.close()
    return session.finished(content, began)


# ---- what is written -------------------------------------------------------------------------------


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

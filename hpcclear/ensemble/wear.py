"""The `wear` command: service lives of a mechanism with wear, on all ranks.

Root follows the lives (`hpcclear.dynamics.wear.life`) in parallel: what all of them request is a design like any other,
simulated on all ranks and kept in the checkpoint; a resumed run requests the same again and finds it done.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hpcclear.base.arrays import Array, Records
from hpcclear.base.asking import all_answered
from hpcclear.base.errors import InputError
from hpcclear.dynamics.setup.parameters import wave_paths
from hpcclear.dynamics.wear.curves import DEEPEST, Life
from hpcclear.dynamics.wear.law import Joints, joints_of
from hpcclear.dynamics.wear.life import Asked, LifePlan, WearOutcome, life
from hpcclear.dynamics.wear.relief import Relief
from hpcclear.ensemble.identity import run_key
from hpcclear.ensemble.lives import lives_dataset, relief_of
from hpcclear.ensemble.session import Finished, Options, Session, sample_points, saving
from hpcclear.ranks.progress import LivesProgress
from hpcclear.ranks.team import Ranks
from hpcclear.ranks.terminal import Style
from hpcclear.results.checkpoint import Checkpoint
from hpcclear.results.content import Results
from hpcclear.results.names import KINDS
from hpcclear.results.places import Place
from hpcclear.scene import Scene
from hpcclear.scene.points import Numbers, Points
from hpcclear.scene.sampling import monte_carlo
from hpcclear.scene.scene import record_of

PERTURBATION = 1e-9
"""Relative difference of the clearances of two copies."""


def check_worn(scene: Scene) -> None:
    """Refuse a scene that has no lives to follow. Raises InputError."""
    wear = scene.required_wear
    if not scene.worn_joints():
        remedy = "Give one a table wear, as in jobs/wear.toml"
        raise InputError("joints", None, "no joint of the scene wears", remedy)
    alike = scene.study is None or not of_lives(scene).required_study.random
    if wear.lives > 1 and alike:
        reason = "without random inputs all service lives are the same"
        remedy = "Add [study.random], or simulate one service life"
        raise InputError("wear.lives", wear.lives, reason, remedy)
    if scene.study is not None and scene.study.worn and wear.lives == 1:
        reason = "one service life gives no distribution of clearances"
        raise InputError("wear.lives", 1, reason, "Simulate more, such as 100")
    named = [row.name for row in scene.study.random] if scene.study is not None else []
    for name in (KINDS["wear"].data.keys() | KINDS["wear"].coords.keys()) & {*named}:
        reason, remedy = "is the name of a result", "Rename it, and give its path"
        raise InputError(f"study.random.{name}", name, reason, remedy)
    _check_bounds(scene)
    if (error := scene.numerics.target_error) is not None:
        reason = "wear simulations have replicas of their own for the confidence intervals of wear rate and f"
        raise InputError("numerics.target_error", error, reason, "Remove it, and set wear.copies")


def _check_bounds(scene: Scene) -> None:
    """Refuse lives that are over when new, and a limit that no joint can reach."""
    deepest = {}
    for name in scene.worn_joints():
        key = f"{scene.joint_key(name)}.clearance"
        deepest[key] = DEEPEST * scene.number(f"{scene.joint_key(name)}.bearing_radius")
        if scene.number(key) >= deepest[key]:
            reason = f"a bearing counts as worn through from {DEEPEST:g} of its radius on"
            reason = f"{reason}, {scene.shown(key, deepest[key])}"
            raise InputError(key, scene.shown(key), reason, "Lower it")
    limit, most = scene.required_wear.limit.clearance, max(deepest.values())
    if limit is None:
        return
    least = joints_of(scene, inputs_of(scene)).clearance.max(axis=1).min()
    if limit > most:
        reason = f"wear is simulated up to a clearance of {DEEPEST:g} of the bearing radius, {scene.shown(key, most)}"
        raise InputError("wear.limit.clearance", scene.shown(key, limit), reason, "Lower it")
    if limit <= least:
        reason = f"every service life has a clearance of {scene.shown(key, least)} or more when new"
        raise InputError("wear.limit.clearance", scene.shown(key, limit), reason, "Raise it")


def of_lives(scene: Scene) -> Scene:
    """The scene without inputs that its lives are to give: their clearances are new ones, with what scatter these have."""
    if scene.study is None or not scene.study.worn:
        return scene
    changes: dict[str, object] = {"study.cases": {}}
    for row in scene.study.worn:
        new = {"distribution": "uniform", "half_width": row.half_width, "paths": list(row.paths)}
        changes[f"study.random.{row.name}"] = new if row.half_width is not None else None
    return scene.with_(changes)


def inputs_of(scene: Scene) -> Points:
    """Random inputs of every life, a row each; no columns for a single one, which is the scene as it stands."""
    lives = scene.required_wear.lives
    if lives == 1:
        return Points((), np.empty((1, 0)), ())
    return monte_carlo(of_lives(scene), lives, design={}, purpose="wear")


class States:
    """States of wear as designs: random inputs that do not wear, then clearance and bearing radius of every worn joint, then,
    where profiles are followed, the waves around its surfaces."""

    def __init__(self, scene: Scene, inputs: Points, joints: Joints) -> None:
        own = [f"{scene.joint_key(name)}." for name in scene.worn_joints()]
        changing = [f"{key}{entry}" for key in own for entry in ("clearance", "bearing_radius")]
        self.relief = relief_of(scene)
        waves = [path for name in scene.worn_joints() for path in wave_paths(scene, name)]
        waves = waves if self.relief.size else []
        changing += waves
        driven = [path for paths in inputs.paths for path in paths]
        free = [path for path in driven if path not in changing and ".wear." not in path]
        get = Numbers(scene, inputs)
        self.names = (*free, *changing)
        self._new = np.array([get.known(path) for path in waves]).reshape(-1, get.size).T
        self._fixed = np.array([get(path) for path in free]).reshape(-1, get.size).T
        self.joints = joints

    def rows(self, number: int, asked: Asked) -> Array:
        """Designs of a life's copies, shape (copies, names)."""
        clearance, radius = self.joints[number].worn(asked.work)
        factors = 1.0 + PERTURBATION * np.array(asked.copies)[:, None]
        state = np.stack([clearance * factors, np.repeat(radius[None], len(factors), axis=0)], -1)
        fixed = np.repeat(self._fixed[number][None], len(factors), axis=0)
        parts = [fixed, state.reshape(len(factors), -1)]
        if self.relief.size:
            worn = np.zeros(self._new.shape[1])
            if asked.moments is not None:
                worn = self.relief.waves(self.joints[number], asked.moments).ravel()
            parts.append(np.repeat((self._new[number] + worn)[None], len(factors), axis=0))
        return np.concatenate(parts, axis=1)

    def points(self, rows: Array) -> Points:
        """Such designs, shape (n, names), as points."""
        return Points(self.names, rows, tuple((name,) for name in self.names))


def follow(
    scene: Scene, states: States, ranks: Ranks, checkpoint: Checkpoint, style: Style = "quiet", first: int = 0
) -> list[Life]:  # fmt: skip
    """All lives to their ends; raises as `sample_points`. `first`: number of the first simulation in the checkpoint."""
    wear = scene.required_wear
    plan = LifePlan(
        wear.cycles, wear.tolerance, float(scene.numerics.averaged_revolutions), wear.copies,
        wear.most_copies, wear.limit.given(), wear.beyond_limit,
    )  # fmt: skip
    relief, joints = relief_of(scene), states.joints
    worn = [scene.joint_labels.index(name) for name in scene.worn_joints()]
    count = len(joints.clearance)
    with LivesProgress("wear", style, count) as progress:

        def answer(going: Mapping[int, Asked]) -> Iterator[WearOutcome]:
            nonlocal first
            progress.lives(count - len(going), [asked.done for asked in going.values()])
            answers = _simulated(scene, states, going, first, ranks, checkpoint, progress)
            first += sum(len(one) for one in answers)
            return (_seen(one, worn, len(scene.joint_labels), relief) for one in answers)

        found = all_answered([life(joints[k], plan, relief) for k in range(count)], answer)
        progress.lives(count, [])
    return found


def _simulated(
    scene: Scene, states: States, going: Mapping[int, Asked], first: int, *where: Any
) -> list[Records]:
    """Records of what each life requests, as one design; its first simulation has the number `first`. `where`: ranks,
    checkpoint and progress, as of `sample_points`."""
    rows = [states.rows(number, asked) for number, asked in going.items()]
    design = np.concatenate(rows)
    late = np.concatenate([np.array(asked.copies) % 2 == 1 for asked in going.values()])
    records = np.empty(len(design), record_of(scene))
    for chosen, here in ((~late, scene), (late, waiting_longer(scene))):
        if chosen.any():
            points = states.points(design[chosen])
            records[chosen] = sample_points(here, points, *where, stage="wear", first=first)
            first += len(points)
    return np.split(records, np.cumsum([len(part) for part in rows])[:-1])


def waiting_longer(scene: Scene) -> Scene:
    """The scene for copies that wait longer before they are measured, by an interval as long as is averaged."""
    numerics = scene.numerics
    wait = numerics.transient_revolutions + numerics.averaged_revolutions
    return scene.with_({"numerics.transient_revolutions": wait})


def _seen(records: Records, worn: list[int], joints: int, relief: Relief) -> WearOutcome:
    moments = None
    if relief.size:
        rows = [slice(k * relief.size, (k + 1) * relief.size) for k in worn]
        moments = np.stack([records["sliding_waves"][:, row] for row in rows], axis=1)
    return WearOutcome(
        records["sliding_work"][:, worn], records["objective"],
        records["peak_contact_force"][:, :joints], records["status"], moments,
    )  # fmt: skip


def run_wear(
    scene: Scene, output: Path, ranks: Ranks, options: Options = Options(), timing: Path | None = None
) -> Finished:  # fmt: skip
    """Simulate the service lives of a scene with a worn joint on all ranks and write them; on root.

    `timing`: where the times go, beside the output by default. Raises InputError, StorageError, Stopped, RankFailed.
    """
    check_worn(scene)
    place = Place.of_file(output, options.fresh)
    place = place if timing is None else replace(place, timing=timing)
    inputs = inputs_of(scene)
    joints = joints_of(scene, inputs)
    states = States(scene, inputs, joints)

    def make(session: Session) -> Results:
        units = states.points(np.empty((0, len(states.names)))).units
        checkpoint = session.opened(scene, units)
        where = states, ranks, checkpoint, options.style
        lives, even = follow(scene, *where), None
        if states.relief.size:  # the same lives, worn evenly, for comparison
            done = sum(one.simulations for one in lives)
            even = follow(scene.with_({"wear.profile": "uniform"}), *where, first=done)
        about = joints, lives, session.attributes, even
        with saving(checkpoint.flush):
            return session.write(lives_dataset(scene, inputs, *about))

    return Session(place, run_key(scene, "wear"), ranks, options).finished(make)

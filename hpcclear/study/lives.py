"""Random clearances of a study that come of wear: lives are followed first, and their clearances stand for the input."""

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.base.outcome import Status
from hpcclear.ensemble.session import Options, Session
from hpcclear.ensemble.wear import check_worn, run_wear
from hpcclear.scene import Scene
from hpcclear.scene.variables import RandomInput

NAME = "wear.nc"
"""Where lives are kept, in the directory of the study."""

LEAST = 8
"""Clearances that a distribution is made of, at least."""

MOST = 4096
"""Values of a distribution, at most."""

STATES = 8
"""States of wear that a life is simulated at, about: those of jobs/wear.toml took six to seven."""


def check(scene: Scene) -> None:
    """Refuse a study that takes clearances from lives that cannot be followed; raises InputError."""
    if scene.study is not None and scene.study.worn:
        check_worn(scene)


def files(scene: Scene) -> list[str]:
    """Names of the results of this stage."""
    return [NAME] if scene.required_study.worn else []


def simulations(scene: Scene) -> int:
    """How many there are, about: what is found on the way decides."""
    if scene.wear is None or not scene.required_study.worn:
        return 0
    return scene.wear.lives * scene.wear.copies * STATES


def known(scene: Scene, session: Session) -> Scene:
    """The scene with clearances of its lives in the place of inputs that wear; lives followed earlier are taken as they are.

    Raises
    ------
    InputError
        Too few lives reach the age asked for, or their clearances leave the variable's range.
    Stopped, StorageError, RankFailed
    """
    study = scene.required_study
    if not study.worn:
        return scene
    style = session.options.style
    lives = run_wear(
        scene, session.place.output / NAME, session.ranks, Options(style=style)
    ).content  # fmt: skip
    changes = {}
    for row in study.worn:
        joints = [path.split(".")[-2] for path in row.paths]
        clearance = lives["clearance"].sel(cycle=row.cycles, joint=joints).to_numpy()
        values = _values(scene, row, clearance, lives["ending"].to_numpy())
        left = int(np.isnan(clearance).any(axis=1).sum())
        if left:
            session.tell(
                f"{row.name}: {left} of {len(clearance)} lives failed or were over before {row.cycles:g} revolutions and "
                "are left out of its distribution; the others are the better ones."
            )  # fmt: skip
        entry = {"distribution": "samples", "values": values.tolist(), "paths": list(row.paths)}
        changes[f"study.random.{row.name}"] = entry
    return scene.with_(changes)


def _values(scene: Scene, row: RandomInput, clearance: Array, endings: Array) -> Array:
    """Clearances (n,) of lives (lives, joints) that got there; each joint that the input drives counts alike."""
    found = clearance[~np.isnan(clearance).any(axis=1)].ravel()
    key = f"study.random.{row.name}"
    if len(found) < LEAST:
        codes, counts = np.unique(endings[endings != Status.OK], return_counts=True)
        why = Status(int(codes[counts.argmax()])).message if len(codes) else "there are so few"
        raise InputError(
            f"{key}.cycles", row.cycles, f"{len(found)} clearances of lives are known there: {why}",
            f"Follow more lives, or ask for fewer cycles; {NAME} has what became of them",
        )  # fmt: skip
    lower, upper = scene.required_study.variable(row.name).bounds
    if found.min() < lower or found.max() > upper:
        raise InputError(
            f"study.variables.{row.name}.range", (lower, upper),
            f"lives have clearances from {found.min():.6g} to {found.max():.6g} m after {row.cycles:g} revolutions",
            "Widen it to hold them",
        )  # fmt: skip
    if len(found) > MOST:  # evenly by rank
        found = np.sort(found)[np.linspace(0, len(found) - 1, MOST).round().astype(int)]
    return np.sort(found)

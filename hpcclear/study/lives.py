"""Lives in a study whose clearances are random as wear leaves them.

Those of the scene are followed first, and their clearances stand for the input; at the end those of the baseline design and the
best designs, for what each comes to over service lives of its own.
"""

from collections.abc import Sequence

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.base.outcome import Status
from hpcclear.ensemble.session import Options
from hpcclear.ensemble.wear import check_worn, run_wear
from hpcclear.report.screens.lives import doubts
from hpcclear.results.content import Results
from hpcclear.scene import Scene
from hpcclear.scene.random_inputs import RandomInput
from hpcclear.statistics.random.replicates import moments, student
from hpcclear.study.goals import ends_in_all
from hpcclear.study.optimisation import Choice
from hpcclear.study.run import Result, StudyRun

NAME = "wear.nc"
"""Where lives are kept, in the directory of the study."""

FOLDER = "lives"
"""Where those of designs are kept, in there."""

AGES = 64
"""Ages of a service life for mean and standard deviation, evenly spaced up to the largest of an input, or to its end."""

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


def simulations(scene: Scene) -> int:
    """How many there are, about: what is found on the way decides."""
    if scene.wear is None or not scene.required_study.worn:
        return 0
    return scene.wear.lives * scene.wear.copies * STATES


def simulations_of_designs(scene: Scene) -> int:
    """How many follow the designs; the baseline design's lives are those of the scene."""
    return ends_in_all(scene.required_study) * simulations(scene)


def of_designs(run: StudyRun, scene: Scene, designs: Sequence[Choice]) -> Result:
    """What the baseline design and the ends of the front (alpha, beta) of each case come to over service lives of their
    own.

    `scene`: as it was written, with clearances that wear not known yet. Returns ``mean`` and ``deviation`` of f over
    service lives and ages, and their ``_reach`` (95 % half-width), (n,); NaN of other designs.
    """
    (run.directory / FOLDER).mkdir(exist_ok=True)
    cases = run.study.cases
    ends = [name for case in cases for name in (f"{case.name} original", *case.ends)]
    table = np.full((len(designs), 4), np.nan)
    for row, choice in zip(table, designs, strict=True):
        if choice.name in ends:
            row[:] = _over_life(run, scene, choice)
    return dict(zip(("mean", "mean_reach", "deviation", "deviation_reach"), table.T, strict=True))


def _over_life(run: StudyRun, scene: Scene, choice: Choice) -> tuple[float, ...]:
    """Mean and standard deviation with their half-widths of a design; each life is a replicate."""
    entries: dict[str, float] = {}
    for name, value in choice.design.items():
        entries |= run.study.variable(name).entries(value)
    own = scene.with_(entries)
    name = NAME if own == scene else f"{FOLDER}/{choice.name.replace(' ', '_')}.nc"
    found = _followed(run, own, name)
    oldest = max(row.cycles or 0.0 for row in scene.required_study.worn)
    parts, at = (np.arange(AGES) + 0.5) / AGES, found["cycle"].values
    values = np.full((found.sizes["life"], AGES), np.nan)
    for k in np.flatnonzero(found["end_reason"].values != "failed"):
        end, f = found["ended"][k], found["objective"][k]
        values[k] = np.interp(parts * min(oldest, end), at[at <= end], f[at <= end])
    estimates, level = list[float](), run.study.verification.confidence
    for one in moments(values):
        reach = one.error * student(level, one.freedom) if one.freedom > 0 else np.nan
        estimates += [one.value, reach]
    return tuple(estimates)


def _followed(run: StudyRun, scene: Scene, name: str) -> Results:
    """Service lives of a scene, kept in a file of the study's directory."""
    timing = run.directory / "timing.nc"  # the study's, which replaces it at the end
    options = Options(style=run.simulations.style)
    return run_wear(scene, run.directory / name, run.ranks, options, timing).content


def known(run: StudyRun) -> Scene:
    """A run's scene with clearances of its lives in place of inputs that wear; lives followed earlier are taken as they
    are.

    Raises InputError if too few lives reach the age requested, or their clearances leave the variable's range; Stopped,
    StorageError, RankFailed.
    """
    run.announce("wear")
    scene, lives = run.scene, _followed(run, run.scene, NAME)
    for text in doubts(lives):
        run.notify(f"Lives: {text}.")
    changes = {}
    for row in run.study.worn:
        joints = [path.split(".")[-2] for path in row.paths]
        clearance = lives["clearance"].sel(cycle=row.cycles, joint=joints).values
        values = _values(scene, row, clearance, lives["ending"].values)
        left = int(np.isnan(clearance).any(axis=1).sum())
        if left:
            run.notify(
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
        why = Status(int(codes[counts.argmax()])).message if len(codes) else "there are too few"
        reason = f"{len(found)} service lives have a clearance at that age: {why}"
        remedy = f"Simulate more service lives, request fewer cycles, or set wear.beyond_limit = true; see {NAME}"
        raise InputError(f"{key}.cycles", row.cycles, reason, remedy)
    lower, upper = scene.required_study.variable(row.name).bounds
    if found.min() < lower or found.max() > upper:
        have = f"service lives have clearances from {found.min():.6g} to {found.max():.6g} m"
        reason = f"{have} after {row.cycles:g} revolutions"
        key = f"study.variables.{row.name}.range"
        raise InputError(key, (lower, upper), reason, "Widen it to contain them")
    if len(found) > MOST:  # evenly by rank
        found = np.sort(found)[np.linspace(0, len(found) - 1, MOST).round().astype(int)]
    return np.sort(found)

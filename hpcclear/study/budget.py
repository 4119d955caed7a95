"""One accuracy for a whole study: a pilot measures what errors cost, and the cheapest way to share it out is taken.

Asked is how far mean and deviation of verified designs may be off, all errors together. Two make them up: the tolerance of the
integration moves each sample, and a number of samples is not all of them. The surrogate has no share, since every number
that is told of a verified design is simulated; it only says where to look, until rounds of further designs win less than
the accuracy. Cost is counted in evaluations of the equations of motion, never in seconds, so that the split is the same
whatever the machine was doing.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.outcome import Status
from hpcclear.ensemble.simulate import sample_points
from hpcclear.ranks.progress import Progress
from hpcclear.ranks.team import Ranks
from hpcclear.results import dataset
from hpcclear.scene import Scene
from hpcclear.scene.points import Points
from hpcclear.scene.stages import SCRAMBLINGS
from hpcclear.statistics.random.allocation import Evidence, Split, cheapest
from hpcclear.study import extent, truth
from hpcclear.study.pilot import LADDER, Pilot, Simulate
from hpcclear.study.run import Result, StudyRun

TIGHTEST = 1e-10
"""Where the ladder ends, if it has to go on."""

MOST_PAIRS = 64
"""Points of each scrambling that pairs are made of at most."""

PILOT = 0.25
"""Share of the study's cost that a pilot may come to by doubled pairs and tighter tolerances."""

LEAST = 128
"""Simulations of a verified design from which on its limits are believed."""

SEARCHED = 8
"""Verified designs get so many times the simulations of those that are searched: these meet the same scatter, and their
differences are known better than they are."""

MOMENTS = ("mean", "deviation")


@dataclass(frozen=True)
class Budget:
    """An accuracy shared out."""

    split: Split
    found: Evidence
    labels: list[str]
    """Of the pilot's designs."""
    pilot: float
    """Evaluations of the equations of motion that it took, and pairs on alpha and beta."""
    searched: int
    """Rung of the search; that of the split is verification's."""
    ends: Array = field(default_factory=lambda: np.full(2, np.nan))
    """Shape (2,): what the tolerance was found to take of alpha and beta, at worst; NaN before they are known."""

    @property
    def tolerance_share(self) -> Array:
        """What the tolerance may take of an accuracy, (2,): no more than looser ones of the pilot's designs, and of alpha and
        beta what it was found to."""
        shares = np.fmin.accumulate(self.found.tolerance_shares(True))
        return np.fmax(shares[min(self.split.rung, len(shares) - 1)], self.ends)


def settled(scene: Scene, split: Split) -> Scene:
    """The scene with what a split decides in the place of the accuracy."""
    study = scene.required_study
    assert study.accuracy is not None
    wanted = study.accuracy.model_dump(exclude_none=True)
    wanted |= dict(zip(MOMENTS, split.samples.tolist(), strict=True))
    most = study.verification.most_samples
    first = 2 ** int(np.log2(split.points / 2.0))
    searched = 2 ** int(np.log2(split.points / SEARCHED))
    return scene.with_(
        {
            "study.accuracy": None,
            "numerics.rtol": split.rtol,
            "study.verification.accuracy": wanted,
            "study.verification.least_samples": min(max(first, LEAST), truth.FIRST, most),
            "study.verification.infill_samples": min(max(searched, 4 * SCRAMBLINGS), most),
            "study.verification.contest": 1,  # the accuracy is what is bought
        }
    )


def searching(scene: Scene, made: Budget) -> Scene:
    """The same with the tolerance of the search."""
    rtol = float(made.found.rtol[made.searched])
    return settled(scene, made.split).with_({"numerics.rtol": rtol})


def asked(scene: Scene) -> Array:
    """Mean and deviation, relative, shape (2,)."""
    wanted = scene.required_study.accuracy
    assert wanted is not None
    return np.array([wanted.mean, wanted.deviation])


def priced(scene: Scene, found: Evidence, *, doubtful: bool = True) -> Split | None:
    """The cheapest split of the scene's accuracy by what is known so far."""
    price = partial(_evaluations, scene, found)
    return cheapest(found, asked(scene), price, _limits(scene), doubtful=doubtful)


def _evaluations(scene: Scene, found: Evidence, rung: int, points: float) -> float:
    """Of the equations of motion, in a study that verifies at a rung by so many simulations of a design."""
    way = Split(rung, float(found.rtol[rung]), np.zeros(2), asked(scene), points, 0.0, True)
    count = extent.samples_of(settled(scene, way), round(points))
    search = sum(n for stage, n in count.items() if stage not in extent.VERIFYING)
    searched = float(found.evaluations[search_rung(scene, found, rung)])
    return search * searched + (sum(count.values()) - search) * float(found.evaluations[rung])


def search_rung(scene: Scene, found: Evidence, rung: int) -> int:
    """Where designs are looked for: at the loosest tolerance whose bias, as far as it is known, is less than the accuracy. No
    number of the search is told, and what a tolerance takes of all designs alike changes none's place."""
    known = (found.bias[:rung] < asked(scene)).all(axis=1)
    return int(np.append(known, True).argmax())


def _limits(scene: Scene) -> tuple[int, int]:
    """Simulations of a verified design, at least and at most."""
    return LEAST, max(scene.required_study.verification.most_samples, LEAST)


def spread(scene: Scene, simulate: Simulate) -> Budget:
    """Measure until a split is sure, or a surer one would cost more than it saves.

    Parameters
    ----------
    scene : Scene
        With `study.accuracy`.
    simulate : callable

    Raises
    ------
    InputError
        All simulations of the pilot fail.
    """
    pilot = Pilot(scene, simulate)
    while True:
        found = pilot.evidence()
        if pilot.partial and not _enough(scene, found):
            pilot.fuller()
            continue
        split, known = decided(scene, found), priced(scene, found, doubtful=False)
        share = PILOT * split.evaluations - pilot.spent
        if known is None and _goes_on(pilot, share):
            pilot.tighter()
            continue
        saved = np.inf if known is None or not split.sure else split.evaluations - known.evaluations
        few = known is not None and pilot.length < MOST_PAIRS
        if few and pilot.price_of_doubling() <= min(saved / 2.0, share):
            pilot.longer()
            continue
        searched = search_rung(scene, found, split.rung)
        return Budget(split, found, pilot.labels, pilot.spent, searched)


def _enough(scene: Scene, found: Evidence) -> bool:
    """Whether a tolerance is surely good enough, and the next one, if it took nothing, would not be cheaper."""
    sure = priced(scene, found)
    if sure is None:
        return False
    points = found.points_for(asked(scene), *_limits(scene))
    return sure.evaluations <= _evaluations(scene, found, sure.rung + 1, points)


def _goes_on(pilot: Pilot, share: float) -> bool:
    """Whether a tighter tolerance is tried: one always, more as long as they take a small share of the study."""
    last = pilot.rungs[-1]
    return last == LADDER[-1] or (last > 1.001 * TIGHTEST and pilot.price_of_tightening() <= share)


def decided(scene: Scene, found: Evidence) -> Split:
    """The cheapest split that is sure; where chaos hides what tolerances do, that of the file or a tighter one if that is
    known to be needed; where none is good enough the tightest."""
    sure = priced(scene, found)
    if sure is not None:
        return sure
    known = priced(scene, found, doubtful=False)
    if known is None:
        return _at(scene, found, len(found.rtol) - 2)
    rung = int(np.abs(np.log(found.rtol[:-1] / scene.numerics.rtol)).argmin())
    return _at(scene, found, max(rung, known.rung))


def _at(scene: Scene, found: Evidence, rung: int) -> Split:
    """The split at a tolerance that is not sure to be good enough: samples for all that its known bias leaves."""
    share, wanted = found.tolerance_shares(False)[rung], asked(scene)
    room = np.nan_to_num(share) < wanted
    samples = np.sqrt(wanted**2 - np.where(room, share, 0.0) ** 2)
    points = found.points_for(samples, *_limits(scene))
    spent = _evaluations(scene, found, rung, points)
    return Split(rung, float(found.rtol[rung]), share, samples, points, spent, False)


# ---- as a stage of a study -------------------------------------------------------------------------


def share_out(run: StudyRun) -> Budget:
    """The stage: the pilot, each part of it kept by itself; budget.nc, and the split in words."""

    def simulate(label: str, scene: Scene, points: Points) -> tuple[Array, float]:
        kept = run.part(label, _simulated, scene, points)
        return kept["objective"], float(kept["evaluations"])

    run.announce("budget")
    with run.ranks.stage("budget"):
        made = spread(run.scene, simulate)
    for text in told(run.scene, made):
        run.tell(text)
    write(run, made, np.full(2, np.nan))
    return made


def _simulated(run: StudyRun, scene: Scene, points: Points) -> Result:
    values, evaluations = simulated(run.ranks, scene, points)
    return {"objective": values, "evaluations": np.asarray(evaluations)}


def simulated(
    ranks: Ranks, scene: Scene, points: Points, progress: Progress | None = None
) -> tuple[Array, float]:
    """Objectives of points on all ranks, (n,), NaN where failed, and evaluations of the equations of motion a simulation."""
    stage = "budget: simulations"
    records = sample_points(scene, points, ranks, progress=progress, stage=stage)
    values = np.where(records["status"] == Status.OK, records["objective"], np.nan)
    return values, float(records["rhs_evaluations"].mean())


def told(scene: Scene, made: Budget) -> list[str]:
    """The split in words, and what is not sure about it."""
    study, split = scene.required_study, made.split
    final = settled(scene, split).required_study
    count = extent.samples_of(settled(scene, split), round(split.points))
    level = f"{study.verification.confidence:.0%}"
    looser = f" (at {made.found.rtol[made.searched]:.0e})" if made.searched < split.rung else ""
    texts = [
        f"Accuracy asked at {level}: {_shares(asked(scene))}.",
        f"Split: rtol {split.rtol:.0e}, which takes {_shares(split.tolerance)}; samples {_shares(split.samples)}, "
        f"about {split.points:.0f} simulations of a verified design and {final.verification.infill_samples} of one that is "
        f"searched{looser}; the surrogate nothing, its {study.samples} points only say where to look.",
        f"That is {sum(count.values())} simulations, {split.evaluations:.2g} evaluations of the equations of motion; "
        f"the pilot took {made.pilot / (made.pilot + split.evaluations):.0%} of it.",
    ]
    if not split.sure:
        shares = made.found.tolerance_shares(True)[split.rung]
        texts.append(
            "The accuracy cannot be promised: what this tolerance takes is known to no better than "
            f"{_shares(shares)} - chaos hides it, or the accuracy is too small."
        )
    if split.points > 0.9 * study.verification.most_samples:
        texts.append(
            "study.verification.most_samples will end some designs before the accuracy is reached: raise it."
        )
    return texts


def _shares(values: Array) -> str:
    return f"{100 * values[0]:.2g} % of the mean and {100 * values[1]:.2g} % of the deviation"


def within(made: Budget, true: Result) -> Array:
    """What each verified design reached, (n, 2): half-widths of its limits with what the tolerance may add, relative."""
    return np.hypot(reach_of(true), made.tolerance_share)


def reach_of(true: Result) -> Array:
    """Relative half-widths of the limits of mean and deviation of verified designs, (n, 2)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.column_stack([true[f"{name}_reach"] / abs(true[name]) for name in MOMENTS])


def reached(run: StudyRun, scene: Scene, made: Budget, true: Result, names: Sequence[str]) -> None:
    """Tell what was reached of the accuracy in a scene, and write it; `true` and `names` are of the verified designs."""
    found, wanted = within(made, true), asked(scene)
    worst = np.nanmax(found, axis=0, initial=0.0)
    missed = [
        name for name, row in zip(names, found, strict=True) if not (row <= wanted * 1.0001).all()
    ]
    text = f"Reached at {run.study.verification.confidence:.0%}: {_shares(worst)}, at worst, of {_shares(wanted)}"
    if missed:
        text += f"; not by {len(missed)} of {len(names)} designs, {missed[0]} among them"
        if (made.ends > made.split.tolerance).any():
            text += ": the tolerance takes more of alpha or beta than of the pilot's designs"
        elif made.split.sure:
            text += ": study.verification.most_samples ended them"
    run.tell(f"{text}.")
    write(run, made, worst)


def write(run: StudyRun, made: Budget, worst: Array) -> None:
    """Write budget.nc: the split, what it stands on, and what was reached, (2,), NaN as long as it is not known."""
    found, split = made.found, made.split
    rungs = len(found.rtol)
    nothing = np.full((1, 2), np.nan)
    data = {
        "rtol": found.rtol,
        "evaluations": found.evaluations,
        "bias": np.concatenate([found.bias, nothing]),
        "bias_error": np.concatenate([found.doubt, nothing]),
        "chosen": (np.arange(rungs) == split.rung).astype(np.int8),
        "reach": found.reach,
        "power": found.power,
        "tolerance_share": split.tolerance,
        "sampling_share": split.samples,
        "reached": worst,
    }
    coords = {
        "rung": np.arange(rungs),
        "design": np.array(made.labels),
        "moment": np.array(MOMENTS),
    }
    content = dataset.dataset("budget", coords, data, objective=run.scene.objective)
    content.attrs |= {
        "confidence": found.confidence,
        "pairs": found.pairs,
        "points": found.points,
        "verified_points": split.points,
        "pilot_evaluations": made.pilot,
        "searched_rtol": found.rtol[made.searched],
        "study_evaluations": split.evaluations,
        "sure": "yes" if split.sure else "no",
    }
    run.write(content, "budget.nc")

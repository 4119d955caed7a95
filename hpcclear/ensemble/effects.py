"""The `effects` command: by how much each effect of a scene changes what its study requires, on all ranks.

Root follows the effect screening (`hpcclear.ensemble.certificate`); what it requests is a design like any other, the same
points for every variant, simulated on all ranks and kept in the checkpoint."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from hpcclear.base.arrays import Array, Records
from hpcclear.base.errors import InputError
from hpcclear.dynamics.evaluation import evaluator_of
from hpcclear.dynamics.setup.problem import coordinate_count
from hpcclear.ensemble.certificate import Certificate, Screening, VariantResult
from hpcclear.ensemble.identity import run_key
from hpcclear.ensemble.session import Finished, Options, Session, sample_points, saving
from hpcclear.ensemble.simulate import Payload
from hpcclear.ensemble.trial import Trial, Wanted
from hpcclear.ranks.team import Ranks
from hpcclear.ranks.terminal import announce
from hpcclear.results import dataset
from hpcclear.results.content import Results
from hpcclear.results.names import SECONDS_BY_ROUND, SECONDS_PER_SAMPLE
from hpcclear.results.places import Place
from hpcclear.scene import Scene
from hpcclear.scene.points import Points

SAMPLES = 4096
"""Samples of a variant at most, unless another number is requested."""

LEAST = 128
"""Samples of a variant at least: a first look."""


def compile_share(payloads: Sequence[Payload], ranks: Ranks) -> None:
    """Compile this rank's share of some variants; what one rank has compiled the others on its node load from disk."""
    for payload in payloads[ranks.rank :: ranks.size]:
        evaluator_of(payload.scene, payload.columns, payload.lanes).advance(0.0)


def run_effects(
    scene: Scene, output: Path, ranks: Ranks, options: Options, wanted: Wanted
) -> Finished:
    """Certify on all ranks which effects a scene can do without, and write it; on root.

    Raises InputError, StorageError, Stopped, RankFailed.
    """
    trial = Trial(scene)
    plan = trial.plan(wanted)
    place = Place.of_file(output, options.fresh)
    asked = {name: str(value) for name, value in wanted._asdict().items()}
    session = Session(place, {**run_key(scene, "effects"), **asked}, ranks, options)

    def times(content: Results) -> dict[str, str]:
        with ranks.stage("effects: cost"):
            variants = [tuple(np.flatnonzero(row).tolist()) for row in content["off"].values]
            return times_of(trial.seconds(variants))

    return session.finished(lambda here: _certified(trial, plan, here), times)


def _certified(trial: Trial, plan: Screening, session: Session) -> Results:
    checkpoint = session.opened(trial.scene, trial.drawn.points(0, 1).units)
    first = 0
    announce(f"compiling {len(trial.switches) + 1} variants", session.options.style)
    session.ranks.everywhere("compile", compile_share, trial.payloads())

    def simulate(variant: Scene, design: Points) -> Records:
        nonlocal first
        where = session.ranks, checkpoint
        records = sample_points(variant, design, *where, stage="effects", first=first)
        first += len(design)
        return records

    found = trial.certify(plan, simulate)
    with saving(checkpoint.flush):
        return session.write(effects_dataset(trial, found, session.attributes))


# ---- what is written -------------------------------------------------------------------------------


def times_of(seconds: Mapping[str, Sequence[float]]) -> dict[str, str]:
    """Attributes of the file of times, from what `Trial.seconds` measured: medians of the rounds, and all of them."""
    medians = {name: float(np.median(times)) for name, times in seconds.items()}
    return {SECONDS_PER_SAMPLE: json.dumps(medians), SECONDS_BY_ROUND: json.dumps(seconds)}


def effects_dataset(trial: Trial, found: Certificate, attributes: Mapping[str, str]) -> Results:
    """An effect screening as a dataset of kind ``effects``.

    Raises InputError: the objective is zero with all effects on, so that no change of it is relative to anything.
    """
    book, plan, variants = found.book, found.book.plan, found.variants
    _refuse_zero(trial.scene, book.all(()))
    changes = [book.changes(off) for off in variants]
    reduced = trial.variant(found.recommended).scene
    three = [one[:3] for one in changes]
    seen = [book.all(off) for off in variants]
    every = [one.objective for one in seen]
    findings = [[one.verdict(plan.tolerance) for one in own] for own in three]
    data: dict[str, Array] = {
        "off": np.array([[k in off for k in range(plan.effects)] for off in variants], np.int8),
        "change": np.array([[one.value for one in own] for own in three]),
        "limit": np.array([[one.limit for one in own] for own in three]),
        "finding": np.array(findings, np.int8),
        "decision": np.array([int(book.verdict(off)) for off in variants], np.int8),
        "point_change": np.array([one.point for one in changes]),
        "judged": plan.counted.astype(np.int8),
        "recommended": np.array([off == found.recommended for off in variants], np.int8),
        "work": np.array([book.work(off) for off in variants]),
        "evaluations": np.array([float(one.evaluations.mean()) for one in seen]),
        "coordinates": np.array([coordinate_count(trial.variant(off).scene) for off in variants]),
        "samples": np.array([f.size for f in every]),
        "failed": np.array([int(np.isnan(f).sum()) for f in every]),
        "objective": np.array([np.nanmean(f) if np.isfinite(f).any() else np.nan for f in every]),
    }
    coords = {
        "variant": np.arange(len(variants)),
        "effect": np.array([one.name for one in trial.switches], dtype=str),
        "response": np.array(["mean", "deviation", "peak force"]),
    }
    attrs = {**attributes, "tolerance": plan.tolerance, "confidence": plan.confidence}
    attrs |= {"reduced_scene": reduced.to_toml(), "kept": json.dumps(trial.kept)}
    return dataset.dataset("effects", coords, data, attrs, objective=trial.scene.objective)


def _refuse_zero(scene: Scene, whole: VariantResult) -> None:
    known = whole.objective[np.isfinite(whole.objective)]
    if known.size and not known.any():
        reason = "is zero in every variant"
        remedy = 'Choose another one, such as "peak-crank-moment"'
        raise InputError("study.objective", scene.objective.name, reason, remedy)
    if not known.size:
        reason = "every simulation of the complete scene failed"
        remedy = "Run hpcclear simulate to see the reason"
        raise InputError("effects", len(whole.objective), reason, remedy)

"""The `effects` command: by how much each effect of a scene changes what its study asks, on all ranks.

Root follows the certificate (`hpcclear.ensemble.certificate`); what it asks for is a design like any other, the same points
for every variant, simulated on all ranks and kept in the checkpoint.
"""

import json
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from hpcclear.base.arrays import Array, Records
from hpcclear.base.errors import InputError
from hpcclear.dynamics.evaluation import evaluator_of
from hpcclear.dynamics.problem import coordinate_count, problem_of
from hpcclear.ensemble.certificate import (
    Asked,
    Certificate,
    Changes,
    Plan,
    Seen,
    Variant,
    certificate,
    judged,
)
from hpcclear.ensemble.identity import run_key
from hpcclear.ensemble.session import DEFAULT_OPTIONS, Finished, Options, Place, Session
from hpcclear.ensemble.simulate import sample_points, saving
from hpcclear.ranks.team import Ranks
from hpcclear.results import dataset
from hpcclear.results.names import ALL_ON, SECONDS_PER_SAMPLE
from hpcclear.scene import Scene
from hpcclear.scene.points import Points
from hpcclear.scene.sampling import generator, monte_carlo
from hpcclear.scene.switches import Off, Switch, switches

CONFIDENCE = 0.99
"""Of each change's limits: several are looked at, and each more than once."""

SCATTER = 8
"""Points of a replicate about its design, where the study has random inputs."""

TOGETHER = 4
"""Points of a replicate where it has none."""

VICINITY = 0.01
"""Relative half-width of the clearances about a scene without a study, so that a chaotic motion shows as scatter."""

SAMPLES = 4096
"""Samples of a variant at most, unless another number is asked for."""

LEAST = 128
"""Samples of a variant at least: a first look."""

Simulate = Callable[[Scene, Points], Records]


class Drawn:
    """The points at which all variants are compared, replicate by replicate.

    With a study, designs all over its variables and, about each, its random inputs; without, clearances about the scene's.

    Attributes
    ----------
    size : int
        Points of a replicate.
    scattered : bool
        Whether they scatter about one design.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self.scattered = scene.study is not None and bool(scene.study.random)
        self.size = SCATTER if self.scattered else TOGETHER

    def points(self, first: int, last: int) -> Points:
        """Points of replicates `first` to `last`, replicate by replicate."""
        count = last - first
        if self._scene.study is None:
            return self._vicinity(first, count)
        designs = monte_carlo(
            self._scene, count * (1 if self.scattered else self.size), random=(),
            purpose="designs of effects", scrambling=0, first=first * (1 if self.scattered else self.size),
        )  # fmt: skip
        if not self.scattered:
            return designs
        parts = [
            monte_carlo(
                self._scene, self.size, purpose="effects", scrambling=first + k,
                design=dict(zip(designs.names, row.tolist(), strict=True)),
            )
            for k, row in enumerate(designs.values)
        ]  # fmt: skip
        return Points(parts[0].names, np.concatenate([one.values for one in parts]), parts[0].paths)

    def _vicinity(self, first: int, count: int) -> Points:
        scene = self._scene
        paths = [f"{scene.joint_key(name)}.clearance" for name in scene.clearance_joints()]
        own = np.array([scene.number(path) for path in paths])
        rows = [
            generator(0, "effects", str(first + k)).uniform(-1.0, 1.0, (self.size, len(paths)))
            for k in range(count)
        ]
        values = own * (1.0 + VICINITY * np.concatenate(rows))
        return Points(tuple(paths), values, tuple((path,) for path in paths))


class Trial:
    """A scene, the effects that it might do without, and how variants of it are simulated.

    Parameters
    ----------
    scene : Scene

    Attributes
    ----------
    switches : tuple of Switch
        Effects that are tried.
    kept : dict of str to str
        Effects that cannot be off by themselves, by name, and why.

    Raises
    ------
    InputError
        The scene has no effect that could be off.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.drawn = Drawn(scene)
        self.kept: dict[str, str] = {}
        self.switches: tuple[Switch, ...] = ()
        for one in switches(scene):
            try:
                problem_of(Off(scene, [one]).scene)
                self.switches += (one,)
            except InputError as error:
                self.kept[one.name] = error.reason
        if not self.switches:
            raise InputError(
                "effects", None, "the scene has no effect that could be left out",
                "See hpcclear check for what is on",
            )  # fmt: skip
        self._variants: dict[Variant, Off | None] = {}

    def names(self, off: Variant) -> tuple[str, ...]:
        """Names of the effects that are off."""
        return tuple(self.switches[k].name for k in off)

    def possible(self, off: Variant) -> bool:
        """Whether such effects can be off together."""
        if off not in self._variants:
            try:
                made = Off(self.scene, [self.switches[k] for k in off])
                problem_of(made.scene)
                self._variants[off] = made
            except InputError:
                self._variants[off] = None
        return self._variants[off] is not None

    def variant(self, off: Variant) -> Off:
        """The scene with them off."""
        if not self.possible(off):
            raise ValueError(f"{self.names(off)} cannot be off together")
        made = self._variants[off]
        assert made is not None
        return made

    def plan(self, tolerance: float, samples: int, forces: bool) -> Plan:
        """What is asked of the certificate."""
        most = max(samples // self.drawn.size, 4)
        return Plan(
            len(self.switches), tolerance, CONFIDENCE, 2 ** int(np.log2(most)), self.drawn.scattered,
            forces, self.possible, lambda off: 1.0 + coordinate_count(self.variant(off).scene),
        )  # fmt: skip

    def points(self, asked: Asked) -> Points:
        """Its points: the same columns for every variant, which drive what is there of it."""
        return self._seen_by(asked.off, self.drawn.points(asked.first, asked.last))

    def _seen_by(self, off: Variant, points: Points) -> Points:
        made = self.variant(off)
        return Points(points.names, points.values, tuple(made.paths(row) for row in points.paths))

    def seen(self, asked: Asked, records: Records) -> Seen:
        """What the certificate is told of records."""
        scene, labels = self.variant(asked.off).scene, self.scene.joint_labels
        force = np.full((len(records), len(labels)), np.nan)
        for name in scene.clearance_joints():
            place = scene.joint_labels.index(name)
            force[:, labels.index(name)] = records["peak_contact_force"][:, place]
        shape = (asked.last - asked.first, self.drawn.size)
        return Seen(
            records["objective"].reshape(shape), force.reshape(*shape, len(labels)),
            records["rhs_evaluations"].reshape(shape),
        )  # fmt: skip

    def certify(self, plan: Plan, simulate: Simulate) -> Certificate:
        """Follow the certificate to its end; raises what `simulate` does."""
        asking = certificate(plan)
        wanted = next(asking)
        while True:
            told = [
                self.seen(one, simulate(self.variant(one.off).scene, self.points(one)))
                for one in wanted
            ]
            try:
                wanted = asking.send(told)
            except StopIteration as end:
                found: Certificate = end.value
                return found

    def seconds(self, variants: Sequence[Variant], rounds: int = 3) -> dict[str, float]:
        """Processor time of a sample of each, by names, measured here in turn: the least of some rounds, s."""
        from hpcclear.dynamics.evaluator import DEFAULT_LANES

        replicates = max(2 * DEFAULT_LANES // self.drawn.size, 1)
        points = self.drawn.points(0, 2 ** int(np.log2(replicates)))
        least = dict.fromkeys(variants, np.inf)
        for _ in range(rounds):
            for off in variants:
                evaluator = evaluator_of(self.variant(off).scene, self._seen_by(off, points))
                evaluator.submit(np.arange(len(points)), points.values)
                began = time.process_time()
                while evaluator.pending:
                    evaluator.advance(0.2)
                spent = time.process_time() - began
                least[off] = min(least[off], spent / len(points))
            if sum(least.values()) * len(points) > 2.0:
                break  # long enough for noise not to count
        return {" + ".join(self.names(off)) or ALL_ON: float(value) for off, value in least.items()}


def run_effects(
    scene: Scene,
    output: Path,
    ranks: Ranks,
    options: Options = DEFAULT_OPTIONS,
    *,
    tolerance: float = 0.01,
    samples: int = SAMPLES,
    forces: bool = False,
) -> Finished:
    """Certify on all ranks which effects a scene can do without, and write it; on root.

    Parameters
    ----------
    scene : Scene
    output : Path
        NetCDF file of kind ``effects``.
    ranks : Ranks
    options : Options
    tolerance : float
        Relative change that is allowed.
    samples : int
        Of each variant at most.
    forces : bool
        Whether peak contact forces must stay within the tolerance as well.

    Raises
    ------
    InputError, StorageError, Stopped, RankFailed
    """
    began = time.perf_counter()
    check_tolerance(tolerance)
    place = Place.of_file(output, options.fresh)
    trial = Trial(scene)
    asked = {"tolerance": repr(tolerance), "samples": str(samples), "forces": str(forces)}
    with Session(place, {**run_key(scene, "effects"), **asked}, ranks, options) as session:
        content = session.found("effects")
        times: dict[str, str] | None = None
        if content is None:
            session.describe(scene)
            content = _certified(trial, trial.plan(tolerance, samples, forces), session)
            with ranks.stage("effects: cost"):
                variants = [tuple(np.flatnonzero(row).tolist()) for row in content["off"].values]
                times = {SECONDS_PER_SAMPLE: json.dumps(trial.seconds(variants))}
        session.close(times)
    return session.finished(content, began)


def check_tolerance(tolerance: float) -> None:
    """InputError unless it is one."""
    if not 0.0 < tolerance < 1.0:
        raise InputError(
            "--tolerance", tolerance, "is no relative change above 0 and below 1", "Write 1%, or 0.01"
        )  # fmt: skip


def _certified(trial: Trial, plan: Plan, session: Session) -> xr.Dataset:
    points = trial.drawn.points(0, 1)
    units = dict(zip(points.names, points.units, strict=True))
    checkpoint = session.opened(points.names, units)
    first = 0

    def simulate(variant: Scene, design: Points) -> Records:
        nonlocal first
        records = sample_points(
            variant, design, session.ranks, checkpoint, stage="effects", first=first
        )
        first += len(design)
        return records

    found = trial.certify(plan, simulate)
    with saving(checkpoint.flush):
        return session.write(effects_dataset(trial, found, session.attributes))


# ---- what is written -------------------------------------------------------------------------------

RESPONSES = ("mean", "deviation", "peak force")
"""Labels along the dimension ``response``."""


def effects_dataset(trial: Trial, found: Certificate, attributes: Mapping[str, str]) -> xr.Dataset:
    """A certificate as a dataset of kind ``effects``.

    Raises
    ------
    InputError
        The objective is nought with all effects on, so that no change of it is relative to anything.
    """
    book, plan, variants = found.book, found.book.plan, found.variants
    whole = book.all(())
    _refuse_nought(trial.scene, whole)
    changes = [book.changes(off) for off in variants]
    counted = np.array([True, plan.scattered, plan.forces])
    reduced = trial.variant(found.recommended).scene
    data: dict[str, Any] = {
        "off": np.array([[k in off for k in range(plan.effects)] for off in variants], np.int8),
        "change": np.array([[one.value for one in _three(c)] for c in changes]),
        "limit": np.array([[one.limit for one in _three(c)] for c in changes]),
        "told": np.array(
            [[int(judged([one], plan.tolerance)) for one in _three(c)] for c in changes], np.int8
        ),
        "decision": np.array([int(book.verdict(off)) for off in variants], np.int8),
        "point_change": np.array([c.point for c in changes]),
        "judged": counted.astype(np.int8),
        "recommended": np.array([off == found.recommended for off in variants], np.int8),
        "work": np.array([book.work(off) for off in variants]),
        "evaluations": np.array([float(book.all(off).evaluations.mean()) for off in variants]),
        "coordinates": np.array([coordinate_count(trial.variant(off).scene) for off in variants]),
        "samples": np.array([book.all(off).objective.size for off in variants]),
        "failed": np.array([int(np.isnan(book.all(off).objective).sum()) for off in variants]),
        "objective": np.array([_mean(book.all(off).objective) for off in variants]),
    }
    coords = {
        "variant": np.arange(len(variants)),
        "effect": np.array([one.name for one in trial.switches], dtype=str),
        "response": np.array(RESPONSES, dtype=str),
    }
    told = {
        **attributes,
        "tolerance": plan.tolerance,
        "confidence": plan.confidence,
        "reduced_scene": reduced.to_toml(),
        "kept": json.dumps(trial.kept),
    }
    return dataset.dataset("effects", coords, data, told, objective=trial.scene.objective)


def _three(changes: Changes) -> tuple[Any, Any, Any]:
    return changes.mean, changes.deviation, changes.force


def _mean(values: Array) -> float:
    return float(np.nanmean(values)) if np.isfinite(values).any() else np.nan


def _refuse_nought(scene: Scene, whole: Seen) -> None:
    known = whole.objective[np.isfinite(whole.objective)]
    if known.size and not known.any():
        raise InputError(
            "study.objective", scene.objective.name, "is nought whatever is off",
            'Choose another one, such as "peak-crank-moment"',
        )  # fmt: skip
    if not known.size:
        raise InputError(
            "effects", len(whole.objective), "every simulation of the whole scene failed",
            "See hpcclear simulate for why",
        )  # fmt: skip

"""Variants of a scene with effects off: the points they are compared at, how they are simulated, what a sample takes."""

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from itertools import combinations
from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Records
from hpcclear.base.asking import answered
from hpcclear.base.errors import InputError
from hpcclear.base.outcome import Flag
from hpcclear.dynamics.evaluation import evaluator_of
from hpcclear.dynamics.evaluation.evaluator import DEFAULT_LANES
from hpcclear.dynamics.setup.problem import coordinate_count, implicit_method, problem_of
from hpcclear.ensemble.certificate import (
    Certificate,
    Screening,
    Variant,
    VariantRequest,
    VariantResult,
    certificate,
)
from hpcclear.ensemble.simulate import Payload, payload_of
from hpcclear.results.names import ALL_ON
from hpcclear.scene import Scene
from hpcclear.scene.points import Points
from hpcclear.scene.sampling import monte_carlo
from hpcclear.scene.streams import generator
from hpcclear.scene.switches import Off, Switch, switches

CONFIDENCE = 0.99
"""Confidence level of each change: several are looked at, and each more than once."""

SCATTER = 8
"""Points of a replicate about its design, where the study has random inputs."""

TOGETHER = 4
"""Points of a replicate where it has none."""

VICINITY = 0.01
"""Relative half-width of the clearances about a scene without a study, so that a chaotic motion shows as scatter."""

DEARER = 5
"""Steps, or revolutions to a target error, that a variant may take, times the most that the whole scene took: what is so much
more expensive without an effect (contacts without damping bounce on) ends as failed, and the effect stays on."""

EVALUATIONS, IMPLICIT_EVALUATIONS = 6, 16
"""Of an explicit step, and of an implicit one on average."""

IMPLICIT = 2.5
"""Cost weight of an evaluation in implicit steps, eight samples per batch:
by processor times 3.6 for a film, 2.1 for bristles, 2.2 in the median of 28 variants of random scenes (0.5 to 8)."""

ROUNDS, LONG_ENOUGH = (4, 8), 2.0
"""Times that each variant's processor time is measured, at least and at most; and the time after which the least will do, s."""

Simulate = Callable[[Scene, Points], Records]


class Drawn:
    """The points at which all variants are compared, replicate by replicate of `size` points.

    With a study, designs all over its variables and, about each, its random inputs; without, clearances about the scene's.
    `scattered`: they scatter about one design.
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
        each, purpose = 1 if self.scattered else self.size, "designs of effects"
        draw = partial(monte_carlo, self._scene)
        designs = draw(count * each, random=(), purpose=purpose, replicate=0, first=first * each)
        if not self.scattered:
            return designs
        rows = (dict(zip(designs.names, row, strict=True)) for row in designs.values.tolist())
        about = partial(draw, self.size, purpose="effects")
        parts = [about(replicate=k, design=row) for k, row in enumerate(rows, first)]
        return Points(parts[0].names, np.concatenate([one.values for one in parts]), parts[0].paths)

    def _vicinity(self, first: int, count: int) -> Points:
        scene = self._scene
        paths = [f"{scene.joint_key(name)}.clearance" for name in scene.clearance_joints()]
        own = np.array([scene.number(path) for path in paths])
        streams = (generator(0, "effects", str(first + k)) for k in range(count))
        rows = [one.uniform(-1.0, 1.0, (self.size, len(paths))) for one in streams]
        values = own * (1.0 + VICINITY * np.concatenate(rows))
        return Points(tuple(paths), values, tuple((path,) for path in paths))


class Wanted(NamedTuple):
    """What an effect screening has to hold to."""

    tolerance: float
    """Relative change that is allowed."""
    samples: int
    """Of each variant at most."""
    budget: float = np.inf
    """Samples of the whole scene that all may come to, by their work."""
    forces: bool = False
    """Whether peak contact forces must stay within the tolerance as well."""


class Trial:
    """A scene, the effects that it might do without (`switches`), and how variants of it are simulated.

    `kept`: effects that cannot be off by themselves, by name, and why. Raises InputError: no effect could be off.
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
            reason = "the scene has no effect that could be disabled"
            raise InputError("effects", None, reason, "Run hpcclear check to see the effects")
        self._variants: dict[Variant, Off | None] = {}
        self._bare = scene.with_({"study": None})  # quick to change
        self._implicit: dict[Variant, bool] = {}
        self._evaluations = 0  # of the whole scene's dearest first point
        self._turns: dict[str, int] = {}

    def names(self, off: Variant) -> tuple[str, ...]:
        """Names of the effects that are off."""
        return tuple(self.switches[k].name for k in off)

    def possible(self, off: Variant) -> bool:
        """Whether such effects can be off together."""
        if off not in self._variants:
            self._variants[off], chosen = None, [self.switches[k] for k in off]
            twice = any(one.excludes(other) for one, other in combinations(chosen, 2))
            with suppress(InputError):
                if not twice:  # two models of one effect
                    made = Off(self.scene, chosen)
                    problem_of(made.scene)
                    self._variants[off] = made
        return self._variants[off] is not None

    def variant(self, off: Variant) -> Off:
        """The scene with them off."""
        made = self._variants[off] if self.possible(off) else None
        if made is None:
            raise ValueError(f"{self.names(off)} cannot be off together")
        return made

    def implicit(self, off: Variant) -> bool:
        """Whether a variant calls for implicit steps."""
        if off and not self.implicit(()):
            return False  # without an effect no motion gets stiff
        kept = tuple(k for k in off if self.switches[k].stiff)
        if kept not in self._implicit:
            try:
                made = Off(self._bare, [self.switches[k] for k in kept])
                self._implicit[kept] = implicit_method(made.scene) != "never"
            except InputError:
                self._implicit[kept] = True
        return self._implicit[kept]

    def plan(self, wanted: Wanted) -> Screening:
        """What is required of the effect screening. Raises InputError: the tolerance is none."""
        if not 0.0 < wanted.tolerance < 1.0:
            reason = "is not a relative change above 0 and below 1"
            raise InputError("--tolerance", wanted.tolerance, reason, "Write 1%, or 0.01")
        most = max(wanted.samples // self.drawn.size, 4)
        return Screening(
            len(self.switches), wanted.tolerance, CONFIDENCE, 2 ** int(np.log2(most)), self.drawn.scattered,
            wanted.forces, self.possible, self.implicit, wanted.budget / self.drawn.size,
        )  # fmt: skip

    def points(self, asked: VariantRequest) -> Points:
        """Its points: the same columns for every variant, which drive what is there of it."""
        return self._seen_by(asked.off, self.drawn.points(asked.first, asked.last))

    def _seen_by(self, off: Variant, points: Points) -> Points:
        made = self.variant(off)
        return Points(points.names, points.values, tuple(made.paths(row) for row in points.paths))

    def simulated(self, off: Variant) -> Scene:
        """What is simulated of a variant: its scene, with bounds on its cost once the whole scene's is known."""
        scene = self.variant(off).scene
        if not off or self._evaluations == 0:
            return scene
        each = IMPLICIT_EVALUATIONS if self.implicit(off) else EVALUATIONS
        steps = DEARER * self._evaluations // each + 1000
        most = min(steps, self.scene.numerics.max_steps)
        return scene.with_({"numerics.max_steps": most} | self._turns)

    def _limit(self, records: Records) -> None:
        """Bounds by what the whole scene took at its first points."""
        numerics = self.scene.numerics
        self._evaluations = int(records["rhs_evaluations"].max())
        if numerics.target_error is not None and self.scene.clearance_joints():
            turns = DEARER * int(np.nanmax(records["steady_revolutions"])) + 100
            limit = min(turns, numerics.target_revolutions)
            self._turns = {"numerics.target_revolutions": limit}

    def seen(self, asked: VariantRequest, records: Records) -> VariantResult:
        """What the effect screening uses of records."""
        if not asked.off and self._evaluations == 0:
            self._limit(records)
        scene, labels = self.variant(asked.off).scene, self.scene.joint_labels
        force = np.full((len(records), len(labels)), np.nan)
        for name in scene.contact_labels():
            place = scene.joint_labels.index(name)
            force[:, labels.index(name)] = records["peak_contact_force"][:, place]
        shape = (asked.last - asked.first, self.drawn.size)
        evaluations = records["rhs_evaluations"]
        weight = np.where(records["flags"] & int(Flag.STIFF), IMPLICIT, 1.0)
        work = evaluations * weight * (1.0 + coordinate_count(scene))
        return VariantResult(
            records["objective"].reshape(shape), force.reshape(*shape, len(labels)),
            evaluations.reshape(shape), work.reshape(shape),
        )  # fmt: skip

    def payloads(self) -> list[Payload]:
        """What ranks need to compile the whole scene and each effect's absence (`compile_share`)."""
        variants: list[Variant] = [(), *((k,) for k in range(len(self.switches)))]
        asked = [VariantRequest(off, 0, 1) for off in variants]
        return [payload_of(self.variant(one.off).scene, self.points(one)) for one in asked]

    def certify(self, plan: Screening, simulate: Simulate) -> Certificate:
        """Follow the effect screening to its end; raises what `simulate` does."""

        def seen(one: VariantRequest) -> VariantResult:
            return self.seen(one, simulate(self.simulated(one.off), self.points(one)))

        return answered(certificate(plan), lambda wanted: [*map(seen, wanted)])

    def seconds(self, variants: Sequence[Variant]) -> dict[str, list[float]]:
        """Processor time of a sample of each, by names, measured here in turn: one after the other in every round, s."""
        replicates = max(2 * DEFAULT_LANES // self.drawn.size, 1)
        points = self.drawn.points(0, 2 ** int(np.log2(replicates)))
        scenes = {off: (self.simulated(off), self._seen_by(off, points)) for off in variants}
        for scene, seen in scenes.values():
            evaluator_of(scene, seen).advance(0.0)  # compiles
        found: dict[Variant, list[float]] = {off: [] for off in variants}
        began = time.process_time()
        for number in range(ROUNDS[1]):
            way = 1 - 2 * (number % 2)  # there and back: a steady drift cancels
            for off in list(scenes)[::way]:
                evaluator = evaluator_of(*scenes[off])
                evaluator.submit(np.arange(len(points)), points.values)
                start = time.process_time()
                while evaluator.pending:
                    evaluator.advance(0.2)
                found[off].append((time.process_time() - start) / len(points))
            if number + 1 >= ROUNDS[0] and time.process_time() - began > LONG_ENOUGH:
                break
        return {" + ".join(self.names(off)) or ALL_ON: times for off, times in found.items()}

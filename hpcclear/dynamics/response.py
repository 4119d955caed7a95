"""One response: the sample of a scene, and the time series of its motion, forces and energies."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from hpcclear.base import host
from hpcclear.base.arrays import Array, Records
from hpcclear.base.errors import InputError
from hpcclear.base.objectives import Objective, asked
from hpcclear.base.outcome import STEADY, WIDEST, Status
from hpcclear.dynamics.evaluation import evaluate_records, evaluator
from hpcclear.dynamics.evaluation.recorded import steps
from hpcclear.dynamics.evaluation.recorded.impacts import measured_of
from hpcclear.dynamics.evaluation.recorded.sounding import Heard, instants_of
from hpcclear.dynamics.evaluation.steady.wording import recorded
from hpcclear.dynamics.planar import response as planar
from hpcclear.dynamics.planar.prescribed import prescribed_series
from hpcclear.dynamics.planar.problem import cautions_of, linkage_of, refused_of
from hpcclear.dynamics.planar.tables import curves_of, mechanism_of
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.problem import coordinate_count, effects_of, integrator_of, problem_of
from hpcclear.dynamics.setup.start import start_states
from hpcclear.dynamics.sizing import kept_revolutions
from hpcclear.dynamics.stepping import record as rec
from hpcclear.dynamics.stepping.prescribed import PrescribedSamples
from hpcclear.results import dataset
from hpcclear.results.content import Results
from hpcclear.results.provenance import program
from hpcclear.scene import Scene
from hpcclear.scene.planar import turns_of
from hpcclear.scene.scene import record_of

if TYPE_CHECKING:
    import xarray as xr

MOST = 0.5  # share of the machine's memory that the time series of a response may take


def simulate(
    scene: Scene, objective: Objective | None = None, copy: int = 0, *, checked: bool = True
) -> xr.Dataset:
    """Simulate one scene; time series of the motion, forces and energies.

    Parameters
    ----------
    scene : Scene
    objective : Objective, optional
        What ``objective`` is; by default that of the scene's study, f without one. Others than gaps and peak contact forces
        need ``numerics.responses`` where there is no study that requires them.
    copy : int
        Start a little beside the scene's start, in the direction of this number (`evaluation.steady.copies`); a
        motion without clearance has no copies.
    checked : bool
        Whether the objective gets a half-width (``objective_uncertainty``), by replicas beside it; never for a copy.

    Returns
    -------
    xarray.Dataset
        Kind ``response``: dimensions time and joint, SI units as attributes. Every step before a failure is kept;
        `status` says how the simulation ended. All scalars are those of the sample of the same design (`hpcclear.evaluate`),
        bit for bit; those of a copy belong to its series.

    Raises
    ------
    InputError
        If the scene requires what the kernel cannot do, or time series that do not fit into memory.
    """
    return simulated(scene, objective, copy, checked=checked).to_xarray()


def simulated(
    scene: Scene,
    objective: Objective | None = None,
    copy: int = 0,
    *,
    checked: bool = True,
    spectra: bool = True,
) -> Results:
    """Simulate a scene as `simulate` does; the content of its file, with order spectra of forces or without."""
    averaged = scene.numerics.target_error is not None and scene.clearance_joints()
    steady = evaluate_records(scene, steps.ITSELF) if averaged else None
    named, scene = scene, scene if steady is None else _shown(scene, steady)
    objective = named.objective if objective is None else objective
    if coordinate_count(scene) == 0:
        found = _prescribed(scene)
    else:
        replicated = checked and not copy and steady is None
        perturbations = evaluator.alone(scene.numerics.rtol) if replicated else ()
        recording = steps.Recording(scene, (copy,), perturbations, objective)
        collected = Collected(scene, recording.samples[0], spectra)
        for rows in recording.chunks():
            collected.take(rows)
        found = collected.finish(recording.record())
    return _response(named, scene, found, objective, steady)


def simulate_together(
    scenes: Sequence[Scene], copies: Sequence[int]
) -> Iterator[tuple[int, Results]]:
    """Simulate scenes that differ in numbers only in one batch; yield their places in the sequence and responses, in any order.

    Every response has the bytes of ``simulated(scene, copy=..., checked=False, spectra=False)``, with a number of `copies` for
    each. A scene whose kernel differs is simulated alone.
    """
    groups: dict[tuple[object, ...], list[int]] = {}
    kernels = {scene: kernel_of(scene) for scene in set(scenes)}
    for k, scene in enumerate(scenes):
        groups.setdefault(kernels[scene] or (k,), []).append(k)
    for numbers in groups.values():
        if len(numbers) == 1:
            (k,) = numbers
            yield k, simulated(scenes[k], copy=copies[k], checked=False, spectra=False)
            continue
        first, *others = (scenes[k] for k in numbers)
        recording = steps.Recording(first, [copies[k] for k in numbers], beside=others)
        own = zip(numbers, recording.samples, strict=True)
        collected = [Collected(scenes[k], one, spectra=False) for k, one in own]
        for rows in recording.chunks():
            for slot, one in enumerate(collected):
                one.take(rows[rows[:, rec.SLOT] == slot])
        for slot, k in enumerate(numbers):
            scene, record = scenes[k], recording.record()[slot : slot + 1]
            found, collected[slot] = collected[slot].finish(record), None  # type: ignore[call-overload]
            yield k, _response(scene, scene, found, scene.objective)


def kernel_of(scene: Scene) -> tuple[object, ...] | None:
    """Return what scenes of one batch have in common, or None if a scene has to be simulated alone."""
    steady = scene.numerics.target_error is not None and scene.clearance_joints()
    if steady or coordinate_count(scene) == 0 or refused_of(scene) is not None:
        return None
    problem = problem_of(scene)
    kinds = (problem.effects, effects_of(scene, recorded=True))
    motions = [(problem.linkage.module(effects).__name__, effects) for effects in kinds]
    settings = problem.settings().rows.tobytes()
    return (*motions, settings, problem.tables.tobytes(), problem.tableau.packed().tobytes())


Found = tuple[Array, dict[str, Array], Records]  # instants, time series and outcome record (1,)


def _response(
    named: Scene, scene: Scene, found: Found, objective: Objective, steady: Records | None = None
) -> Results:
    """The content of the file of a scene `named` by a user, whose series are those of `scene`."""
    times, data, record = found
    still = coordinate_count(scene) == 0
    if steady is not None:
        steady["status"] = max(steady["status"][0], record["status"][0])  # of the series as well
        record = steady
    half_width = record["objective_uncertainty"]  # of the objective already
    record = asked(record, objective)
    record["objective_uncertainty"] = half_width
    labels = scene.joint_labels
    names = [*_REPORTED, *(WIDEST if scene.effects.has_pressure and not still else ())]
    names += [] if steady is None else [*STEADY, "regime"]
    if steady is None and not still:  # what the sample measures as well has its bits
        names += [name for name in evaluator.impacts_reported(problem_of(scene)) if name in data]
    if scene.effects.slider_load is not None:
        curves = curves_of(scene)
        angle, constant = data["crank_angle"], scene.effects.slider_load
        data["slider_load"] = curves["load"].at(angle) if curves else np.full(len(angle), constant)
    reported = {name: record[name][0] for name in names}
    counted = {name: data.pop(name) for name in _COUNTED if name in data}
    return dataset.dataset(
        "response",
        {"time": times, "joint": labels, **_dimensions(scene), **counted},
        {**data, **reported},
        {**named.origin, **program(), **recorded(named, record), "integrator": integrator_of(scene)}
        | _kept(scene)
        | _reason(scene, data),
        objective=objective,
    )


_COUNTED = ("revolution", "order", "band")  # coordinates of measures of impact and noise


def _dimensions(scene: Scene) -> dict[str, tuple[str, ...]]:
    """Labels along what a linkage's series have besides time and joints."""
    found = planar.labels(scene, linkage_of(scene).mechanism)
    if scene.modes:
        found["mode"] = scene.mode_labels
    if scene.guides():
        found["guide"] = scene.guides()
    if not scene.modes:
        found["pin"] = planar.pins_of(linkage_of(scene).mechanism)
    return found


def _kept(scene: Scene) -> dict[str, str | int]:
    """Turns of the transient that are stored; of a scene that keeps the last revolutions alone, how many."""
    kept = kept_revolutions(scene)
    transient = max(kept - scene.numerics.averaged_revolutions, 0) * turns_of(scene.linkage)
    asked = {} if scene.output.keep_revolutions is None else {"keep_revolutions": kept}
    return {"transient_turns": transient, **asked}


def _reason(scene: Scene, data: dict[str, Array]) -> dict[str, str | int]:
    """Where a linkage that cannot turn locks, or what is to be known of one that turns and of its series, as an attribute."""
    refusal = refused_of(scene)
    if refusal is not None:
        return {"ended": refusal[1].reason}
    cautions = (*cautions_of(scene), *planar.wound_up(linkage_of(scene).mechanism, data))
    return {"cautions": "\n".join(cautions)} if cautions else {}


_REPORTED = (
    "objective", "objective_spread", "objective_uncertainty", "mean_gap", "peak_contact_force", "latched",
    "rhs_evaluations", "status", "flags",
)  # fmt: skip
"""What a response says about itself as a sample does."""

SPUN_UP, SHOWN = 20, 10
"""Revolutions before those that a response with a target error is averaged over, and of these, at most."""


def _shown(scene: Scene, steady: Records) -> Scene:
    """The scene of the one response that is written beside a steady mean: at its tolerance, spun up."""
    rtol = float(steady["steady_rtol"][0])
    changes = {
        "numerics.target_error": None,
        "numerics.rtol": rtol if np.isfinite(rtol) else scene.numerics.rtol,
        "numerics.atol": None,
        "numerics.transient_revolutions": SPUN_UP,
        "numerics.averaged_revolutions": SHOWN,
    }
    return scene.with_(changes)


def _prescribed(scene: Scene) -> Found:
    """Instants, time series and outcome record (1,) of a scene without clearance at prescribed speed."""
    problem = problem_of(scene)
    lanes = PrescribedSamples(problem)
    par = parameters(scene)
    lanes.queue(par, start_states(scene, par), np.zeros(1, np.int64))
    reported = evaluator.responses_reported(problem)
    record = evaluator.outcome_records(*lanes.collect(), record_of(scene), reported)
    times, data = prescribed_series(scene, problem.transient + problem.averaged)
    first = problem.transient + problem.averaged - kept_revolutions(scene)
    kept = times >= (first - 1e-9) * mechanism_of(scene.linkage).period.seconds
    kept[-1] = True  # of one that ends before
    return times[kept], {name: one[kept] for name, one in data.items()}, record


class Collected(Heard):
    """Time series of one sample of a recording, as its steps come, and `spectra` if wanted, or if the scene has bands. Raises
    InputError where they do not fit into memory."""

    def __init__(self, scene: Scene, sample: steps.Recorded, spectra: bool) -> None:
        count = scene.output.instants_per_revolution
        of_spectra = instants_of(scene, sample) if spectra or scene.bands() else 0
        super().__init__(scene, sample, count, of_spectra)
        self._parts: list[dict[str, Array]] = []
        self._kept, self._began = kept_revolutions(scene), 0.0
        self._revolutions: list[Array] = []

    def add(self, piece: steps.Piece) -> None:
        """Take a piece."""
        super().add(piece)
        count = self.scene.output.instants_per_revolution
        seen, first = steps.seen_between(self.sample, piece, works=True), self.scene.bristles
        seen = seen._replace(q=seen.q[:, first:], v=seen.v[:, first:])
        series = {"time": piece.times, **planar.series(self.scene, self.sample.par, seen)}
        if not self._parts:
            self._began = float(series["energy_residual"][0])
        # copies: a column that is a view would keep all that was observed
        self._parts.append({name: one.copy() for name, one in series.items()})
        self._revolutions.append(piece.steps.revolution[piece.k])
        latest = self._revolutions[-1].max(initial=0.0)
        while self._revolutions[0].max(initial=0.0) < latest - self._kept:
            del self._parts[0], self._revolutions[0]
        stored = sum(len(part["time"]) for part in self._parts)
        least = max(stored, count * self._kept)
        part = self._parts[0]
        size = sum(one.nbytes for one in part.values()) / max(len(part["time"]), 1)
        _refuse_what_does_not_fit(least * size, count)

    def finish(self, record: Records) -> Found:
        """Return what it comes to, with the outcome (1,)."""
        self.end()
        shown, parts = self._shown(record), self._parts
        data = {key: np.concatenate([one.pop(key) for one in parts])[shown] for key in [*parts[0]]}
        data["energy_residual"] -= self._began
        problem = self.sample.problem
        if Status(int(record["status"][0])).valid and problem.effects.joints:
            periods, integrals = self.turns.averaged(problem.transient)
            first = problem.transient + 1
            data["revolution"] = np.arange(float(first), first + len(periods))
            data |= measured_of(self.scene, problem, periods, integrals)
            when = self.turns.when[: len(self.scene.joint_labels)]
            kept = (when >= data["time"][0]) & (when <= data["time"][-1])
            angles = np.interp(when, data["time"], data["crank_angle"])
            data["peak_angle"] = np.where(kept, angles % (2.0 * np.pi), np.nan)
            data |= {} if self.spectra is None else self.spectra.measured()
            self.enter_levels(record)
        return data.pop("time"), data, record

    def _shown(self, record: Records) -> slice:
        """The instants of the revolutions to keep, of those that were simulated."""
        problem, revolution = self.sample.problem, np.concatenate(self._revolutions)
        ended = Status(int(record["status"][0])).valid
        end = problem.transient + problem.averaged if ended else revolution.max(initial=0.0) + 1
        count = self.scene.output.instants_per_revolution
        if ended and count:
            return slice(max(len(revolution) - count * self._kept - 1, 0), None)
        return slice(max(int(np.searchsorted(revolution, end - self._kept)) - 1, 0), None)


def _refuse_what_does_not_fit(size: float, count: int) -> None:
    """Raise InputError where time series of so many bytes would take more than `MOST` of the machine's memory."""
    memory = host.memory()
    if size > MOST * memory:
        raise InputError(
            "output.instants_per_revolution", count,
            f"makes time series of {size / 1e9:.3g} GB or more; this machine has {memory / 1e9:.3g} GB of memory",
            "Write fewer instants per revolution (0: every accepted step), or simulate fewer revolutions; "
            "hpcclear sample stores no time series",
        )  # fmt: skip

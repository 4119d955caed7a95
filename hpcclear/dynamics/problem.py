"""What is common to the samples of a scene: effects, coordinates, method, tolerances, tables."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.base.outcome import Status
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.explicit.tableau import TABLEAUS, TSITOURAS, Tableau
from hpcclear.dynamics.implicit.control import STEEP
from hpcclear.dynamics.laws.lanes import in_lanes
from hpcclear.dynamics.laws.objectives import rate_in_lanes
from hpcclear.dynamics.linkage.linkage import Linkage
from hpcclear.dynamics.linkage.mechanism import modes_of
from hpcclear.dynamics.linkage.parts import RunUp, TableDrive, TorqueDrive
from hpcclear.dynamics.linkage.rhs import compiled_text, motion_text
from hpcclear.dynamics.parameters import parameter_rows, parameters
from hpcclear.dynamics.planar import problem as planar
from hpcclear.dynamics.planar import swings
from hpcclear.dynamics.planar.tables import curves_of
from hpcclear.dynamics.stepping.settings import STRICT
from hpcclear.dynamics.views import Outcome, Parameters, Settings, Start
from hpcclear.scene import Scene

IMPLICIT_METHODS = {"switching": "stiff", "radau": "always"}
"""Methods that take implicit steps whatever the scene, and when."""

STIFF_RAMP = STEEP
"""Friction coefficient over ramp speed, s/m, from which "auto" compiles the implicit method: the steeper, the stiffer."""

STIFF_DAMPING = 10.0
"""Fixed damping factor in s/m, or coefficient of a law with restitution, from which it does."""

TORN = 0.25
"""Penetration over a bearing's radius from which on a result is none: contact laws are of small ones, the softest bearing
(0.5 GPa) of the paper comes to 0.035, and no material takes strains of this size."""

THROWN_BACK = 0.0873
"""How far (5 degrees) from its start a body that a torque drives may turn back, rad, in its first revolution from rest:
the first impacts in its joints throw it."""

IMPLICIT_USE = {"never": 0, "stiff": 1, "always": 2}
"""When lanes take implicit steps: never, where their motion is stiff, always."""


@dataclass(frozen=True)
class Problem:
    """Everything that is common to the samples of a run.

    Raises
    ------
    ValueError
        If coordinates or tolerances do not fit the kernel.
    """

    linkage: Linkage
    """Whose motion it is."""
    effects: at.Effects
    coordinates: int
    tableau: Tableau
    rtol: float
    atol: tuple[float, ...]
    """Absolute tolerances of coordinates, then velocities, SI (2 * coordinates)."""
    impact_floor: float
    """Least `latched` impact speed, m/s."""
    transient: int
    averaged: int
    max_steps: int
    implicit: str = "never"
    """When lanes take implicit steps, a key of `IMPLICIT_USE`."""
    cycle: float = at.TURN
    """By how much the angle of the driven body changes in a revolution, rad: negative clockwise, 0 of one that swings."""
    parameter_rows: int = at.OWN
    """Parameters of a sample."""
    curves: tuple[Array, ...] = ()
    """Cubic cells of its tables, 4 coefficients each."""
    chosen: tuple[int, ...] = ()
    """Places of the joints whose gaps count for f; none for all."""
    from_rest: bool = False
    """Whether the body that a torque drives may begin at rest."""

    def __post_init__(self) -> None:
        n = self.coordinates
        if not 0 <= n <= at.MAX_COORDINATES:
            raise ValueError(f"the kernel holds {at.MAX_COORDINATES} coordinates at most, not {n}")
        if len(self.atol) != 2 * n:
            raise ValueError(f"{n} coordinates have {2 * n} tolerances, not {len(self.atol)}")

    def settings(self) -> Settings:
        """The numbers that the stepper's control reads."""
        s = Settings(np.zeros(Settings.size))
        n = self.coordinates
        modes = modes_of(self.linkage.mechanism)
        length = min(self.atol[at.bristles_of(self.effects) + modes : n])
        s.rtol = self.rtol
        # An impact is located ten times better than positions are integrated, but not below round-off.
        s.gap_tolerance = max(0.1 * length, 4e-15)
        s.angle_tolerance = max(self.rtol * 1e-3, 1e-13)
        s.impact_floor = self.impact_floor
        s.transient, s.averaged, s.max_steps = self.transient, self.averaged, self.max_steps
        s.smallest_step = 1e-14
        s.exponent = 1.0 / (min(self.tableau.order, self.tableau.error_order) + 1)
        s.beta = 0.04
        s.implicit = IMPLICIT_USE[self.implicit]
        s.senses = 1.0 if self.implicit != "never" or self.rtol > STRICT else 0.0
        s.cycle, s.parameter_rows = self.cycle, self.parameter_rows
        s.at_rest = THROWN_BACK if self.from_rest else 0.0
        last = at.waves_of(self.effects)[-1:]
        s.profiled = last[0].rows().stop if last and self.effects.profile else 0
        s.chosen = 0.0 if self.chosen else 1.0
        s.chosen[list(self.chosen)] = 1.0
        s.atol_coordinates[:n], s.atol_velocities[:n] = self.atol[:n], self.atol[n:]
        return s

    def motion(self, effects: at.Effects, width: int) -> Any:
        """The compiled motion of so many lanes with these effects (`rhs.compiled_motion`)."""
        return compiled_text(self.motion_text(effects, width))

    def motion_text(self, effects: at.Effects, width: int) -> str:
        """The name of the text that it is compiled from."""
        return motion_text(self.linkage.module(effects), effects, width)

    def marked(self, outcome: Outcome, par: Array, start: Start) -> Outcome:
        """Outcomes (m) of samples (m, PARAMETERS), with the statuses that the kernel does not know: of those that failed at
        their starts (m), or were penetrated too deep."""
        p, failed = Parameters(par), start.failed
        outcome.status[failed != Status.OK] = failed[failed != Status.OK]
        torn = (outcome.deepest > TORN * p.bearing_radius).any(axis=-1)
        valid = np.isin(outcome.status, [status for status in Status if status.valid])
        outcome.status[valid & torn] = Status.TORN_THROUGH
        return outcome

    @property
    def tables(self) -> Array:
        """The tabulated curves as the kernel reads them, one behind the other, shape (curves * 4 * CELLS,)."""
        return np.concatenate([np.zeros(0), *self.curves])


def coordinate_count(scene: Scene) -> int:
    """Coordinates that are integrated; 0 where the drives prescribe everything."""
    if planar.is_prescribed(scene):
        return 0
    return scene.bristles + len(planar.linkage_of(scene).forest.coordinates)


def effects_of(
    scene: Scene, *, series: bool = False, energies: bool | None = None, impacts: bool | None = None
) -> at.Effects:
    """Which branches of the kernel are compiled for this scene."""
    e = scene.effects
    count = len(scene.contact_labels())
    main = planar.linkage_of(scene).mechanism.period
    judge = scene.objective
    waves = scene.waves()
    films = {scene.joint_labels.index(name): film.model for name, film in scene.films().items()}
    return at.Effects(
        joints=count,
        first=next(iter(scene.open_places), 0),
        swinging=_flag(not main.advance),
        contact=in_lanes(e.contact.declared) if e.contact is not None and count else None,
        friction=in_lanes(e.friction.declared) if e.friction.law != "none" and count else None,
        torque=_flag(isinstance(main, TorqueDrive)),
        baumgarte=_flag(scene.numerics.formulation == "baumgarte"),
        objective=rate_in_lanes(judge) if judge.whole or (judge.rate and count) else None,
        energies=_flag(scene.numerics.energy if energies is None else energies),
        series=_flag(series),
        responses=_flag(scene.responses_asked() or bool(impacts)),
        impacts=_flag(bool(count) and (scene.impacts_asked() if impacts is None else impacts)),
        wear=_flag(bool(scene.worn_joints())),
        waves=_flag(any(waves.values())),
        bearing_waves=waves["bearing"] or None,
        journal_waves=waves["journal"] or None,
        threshold=_flag(scene.has_thresholds),
        profile=_flag(bool(scene.wear is not None and scene.wear.waves and scene.worn_joints())),
        films=tuple(films.get(k) for k in range(at.MAX_JOINTS)) if films else None,
    )


def _flag(on: bool) -> int | None:
    return 1 if on else None


def tableau_of(scene: Scene) -> Tableau:
    """The embedded pair of ``numerics.method``: Tsitouras' unless another one is named."""
    return TABLEAUS.get(scene.numerics.method, TSITOURAS)


def implicit_method(scene: Scene) -> str:
    """When the kernel takes implicit steps: "never", "stiff" (where a lane's motion calls for it), "always".

    The automatic choice goes by the scene's numbers, so that a scene that is not stiff pays nothing for the other method.
    A response and an ensemble go by the same choice.
    """
    method = scene.numerics.method
    if method == "auto" and scene.modes:
        mechanism = planar.linkage_of(scene).mechanism
        if max(swings.swings(mechanism)) * float(planar.period_of(mechanism)) > swings.STIFF:
            return "always"  # there is no segment of the motion in which they are slow
    if method != "auto" or not scene.clearance_joints():
        return IMPLICIT_METHODS.get(method, "never")
    if scene.films() or scene.bristles:
        return "stiff"  # a film's damping grows beyond all bounds as it gets thin; bristles give way within a micrometre
    par = Parameters(parameters(scene)[0])
    there = list(at.places_of(effects_of(scene)))
    ramp = par.steepness * (scene.effects.friction.law != "none")
    stiff = (ramp >= STIFF_RAMP) | (par.damping >= STIFF_DAMPING)
    return "stiff" if stiff[there].any() else "never"


def _cells_of_curves(scene: Scene, linkage: Linkage) -> tuple[Array, ...]:
    """Cells of a linkage's curves, in the order of their rows."""
    driven = {
        f"{drive.name}.{part}": cells
        for drive in linkage.mechanism.drives
        if isinstance(drive, (TableDrive, RunUp))
        for part, cells in zip(drive.curves, drive.cells, strict=True)
    }
    tables, interpolation = curves_of(scene.linkage), scene.numerics.interpolation
    return tuple(
        driven[name] if name in driven else tables[name].cells(interpolation)
        for name in linkage.curve_rows
    )


def check_objective(scene: Scene) -> None:
    """InputError where the objective has a rate of the whole mechanism, and no motion is integrated that it could go with."""
    if scene.objective.whole and not coordinate_count(scene):
        raise InputError(
            scene.objective_key, scene.objective.name,
            "its rate is integrated along with the motion, and this motion is prescribed",
            'Give a joint kind = "clearance"',
        )  # fmt: skip


@lru_cache(maxsize=16)
def problem_of(scene: Scene, *, series: bool = False, energies: bool | None = None) -> Problem:
    """What is common to all samples of a scene."""
    e = scene.effects
    check_objective(scene)
    linkage = planar.linkage_of(scene)
    return Problem(
        linkage=linkage,
        effects=effects_of(scene, series=series, energies=energies),
        coordinates=coordinate_count(scene),
        tableau=tableau_of(scene),
        rtol=scene.numerics.rtol,
        atol=planar.absolute_tolerances(scene),
        impact_floor=1e-3 if e.contact is None else e.contact.minimum_impact_speed,
        transient=scene.numerics.transient_revolutions,
        averaged=scene.numerics.averaged_revolutions,
        max_steps=scene.numerics.max_steps,
        implicit=implicit_method(scene),
        cycle=linkage.mechanism.period.advance,
        parameter_rows=parameter_rows(scene),
        curves=_cells_of_curves(scene, linkage),
        chosen=scene.objective.joints,
        from_rest=getattr(linkage.mechanism.period, "expected_speed", None) is not None,
    )


def integrator_of(scene: Scene) -> str:
    """Name of the method that a scene's responses and samples are integrated by."""
    if coordinate_count(scene) == 0:
        return "closed form"
    name = tableau_of(scene).name
    return {"never": name, "stiff": f"{name} and radau", "always": "radau"}[implicit_method(scene)]

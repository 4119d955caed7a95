"""What is common to the samples of a scene: effects, coordinates, method, tolerances, tables."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, cast

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.outcome import Status
from hpcclear.dynamics import bending, bristles
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.curves import periodic_cells
from hpcclear.dynamics.explicit.tableau import TABLEAUS, TSITOURAS, Tableau
from hpcclear.dynamics.implicit.control import STEEP
from hpcclear.dynamics.laws.lanes import in_lanes
from hpcclear.dynamics.linkage.linkage import Linkage
from hpcclear.dynamics.linkage.mechanism import Mechanism, modes_of
from hpcclear.dynamics.linkage.parts import TableDrive, TorqueDrive
from hpcclear.dynamics.linkage.rhs import compiled_text, motion_text, written_by
from hpcclear.dynamics.linkage.table_drive import PARTS
from hpcclear.dynamics.parameters import parameter_rows, parameters, topology
from hpcclear.dynamics.planar import problem as planar
from hpcclear.dynamics.planar.tables import curves_of, slider_crank_mechanism
from hpcclear.dynamics.stepping.settings import STRICT
from hpcclear.dynamics.views import Outcome, Parameters, Settings, Start
from hpcclear.scene import Scene
from hpcclear.scene.driving import speed_entry
from hpcclear.scene.planar import main_drive

IMPLICIT_METHODS = {"switching": "stiff", "radau": "always"}
"""Methods that take implicit steps whatever the scene, and when."""

STIFF_RAMP = STEEP
"""Friction coefficient over ramp speed, s/m, from which "auto" compiles the implicit method: the steeper, the stiffer."""

STIFF_DAMPING = 10.0
"""Fixed damping factor in s/m, or coefficient of a law with restitution, from which it does."""

LEAST_RISE = {"torque": 5e-3, "speed": 1e-3}
"""Cosine of the rod's steepest angle below which a crank without play, driven by a torque or at a speed, is not simulated.

What it feels changes within so small a part of a turn that steps, or the instants that works are summed over, pass over it.
Under a torque the energy closes to 1e-4 with 6e-3 and to 0.15 with 2e-3; at a speed to 2e-9 with 2e-3 and to 5e-3 with 2e-4."""

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

    effects: at.Effects
    coordinates: int
    tableau: Tableau
    rtol: float
    atol: tuple[float, ...]
    """Absolute tolerances of coordinates, then velocities, SI (2 * coordinates)."""
    impact_floor: float
    """Least latched impact speed, m/s."""
    transient: int
    averaged: int
    max_steps: int
    torque_table: Array | None = None
    load_table: Array | None = None
    """torque_table and load_table: cubic cells of a periodic table, 4 coefficients a cell."""
    implicit: str = "never"
    """When lanes take implicit steps, a key of `IMPLICIT_USE`."""
    cycle: float = at.TURN
    """By how much the angle of the driven body changes in a revolution, rad: negative clockwise, 0 of one that swings."""
    parameter_rows: int = at.OWN
    """Parameters of a sample."""
    linkage: Linkage | None = None
    """Whose motion it is; without one, a slider-crank's by its effects."""
    curves: tuple[Array, ...] = ()
    """Cubic cells of a linkage's tables."""
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
        modes = self.effects.bending or 0
        if self.linkage is not None:
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
        """The compiled motion of so many lanes with these effects (`rhs.motion_of`)."""
        return compiled_text(self.motion_text(effects, width))

    def motion_text(self, effects: at.Effects, width: int) -> str:
        """The name of the text that it is compiled from."""
        module = written_by(effects) if self.linkage is None else self.linkage.module(effects)
        return motion_text(module, effects, width)

    def marked(self, outcome: Outcome, par: Array, start: Start) -> Outcome:
        """Outcomes (m) of samples (m, PARAMETERS), with the statuses that the kernel does not know: of those that failed at
        their starts (m), were torn through, or that a slider-crank without clearance hardly gets through."""
        p, failed = Parameters(par), start.failed
        outcome.status[failed != Status.OK] = failed[failed != Status.OK]
        torn = (outcome.deepest > TORN * p.bearing_radius).any(axis=-1)
        valid = np.isin(outcome.status, [status for status in Status if status.valid])
        outcome.status[valid & torn] = Status.TORN_THROUGH
        open_joints = any(flag is not None for flag in at.open_of(self.effects))
        if self.linkage is None and not open_joints:
            least = LEAST_RISE["speed" if self.effects.torque is None else "torque"]
            flat = 1.0 - (p.crank_length / p.rod_length) ** 2 < least**2
            outcome.status[(outcome.status == Status.OK) & flat] = Status.NEAR_SINGULAR
        return outcome

    @property
    def tables(self) -> Array:
        """The tabulated curves as the kernel reads them, one behind the other, shape (curves * 4 * CELLS,); one that is absent
        is never looked up."""
        curves = self.curves if self.linkage is not None else (self.torque_table, self.load_table)
        tables = np.zeros((len(curves), 4 * at.CELLS))
        for row, curve in zip(tables, curves, strict=True):
            if curve is not None:
                row[:] = curve
        return tables.ravel()


def coordinate_count(scene: Scene) -> int:
    """Coordinates that are integrated; 0 leaves closed-form kinematics."""
    if scene.is_planar:
        if planar.is_prescribed(scene):
            return 0
        return scene.bristles + len(planar.linkage_of(scene).forest.coordinates)
    if scene.numerics.formulation == "baumgarte":
        return 9  # three bodies in the plane
    first, second, free = topology(scene)
    closed = 2 if scene.modes else 0  # a rod that bends turns and lets the slider go by itself
    return scene.bristles + scene.modes + {0: closed, 1: 2, 2: 4}[first + second] + free


def effects_of(scene: Scene, *, series: bool = False, ledger: bool | None = None) -> at.Effects:
    """Which branches of the kernel are compiled for this scene."""
    e = scene.effects
    count = len(scene.clearance_joints())
    swings = False
    if scene.is_planar:
        first = second = False
        main = planar.linkage_of(scene).mechanism.period
        free = isinstance(main, TorqueDrive)
        swings = not main.advance
    else:
        first, second, free = topology(scene)
    torque_is_table = isinstance(getattr(scene.drive, "torque", None), tuple)
    load_is_table = isinstance(e.slider_load, tuple)
    waves = scene.waves()
    models = {film.model for film in scene.films().values()}
    return at.Effects(
        crank_rod=_flag(first),
        rod_slider=_flag(second),
        joints=count if scene.is_planar else None,
        swinging=_flag(swings),
        contact=in_lanes(e.contact.declared) if e.contact is not None and count else None,
        friction=in_lanes(e.friction.declared) if e.friction.law != "none" and count else None,
        bending=None if scene.is_planar else scene.modes or None,
        torque=_flag(free),
        torque_table=_flag(free and torque_is_table),
        torque_falls=_flag(free and getattr(scene.drive, "no_load_speed", None) is not None),
        gravity=_flag(e.gravity > 0.0),
        load=_flag(e.slider_load is not None and not load_is_table),
        load_table=_flag(load_is_table),
        guide=_flag(e.guide_friction is not None),
        baumgarte=_flag(scene.numerics.formulation == "baumgarte"),
        ledger=_flag(scene.numerics.energy if ledger is None else ledger),
        series=_flag(series),
        responses=_flag(scene.responses_asked()),
        wear=_flag(bool(scene.worn_joints())),
        waves=_flag(any(waves.values())),
        bearing_waves=waves["bearing"] or None,
        journal_waves=waves["journal"] or None,
        threshold=_flag(scene.has_thresholds),
        profile=_flag(bool(scene.wear is not None and scene.wear.waves and scene.worn_joints())),
        film=_flag(bool(models)),
        short_film=_flag("short" in models),
        long_film=_flag("long" in models),
        finite_film=_flag("finite" in models),
    )


def _flag(on: bool) -> int | None:
    return 1 if on else None


def tableau_of(scene: Scene) -> Tableau:
    """The embedded pair of ``numerics.method``: Tsitouras' unless another one is named."""
    return TABLEAUS.get(scene.numerics.method, TSITOURAS)


def absolute_tolerances(scene: Scene) -> tuple[float, ...]:
    """Absolute tolerances of coordinates, then velocities: a, 10 a/m, 1000 a/s, 50000 a/(m s) with a for lengths.

    With the default a = rtol times 1 mm they stand for 1 mm, 0.01 rad, 1 m/s and 50 rad/s. Where the crank pin moves
    slower than 25 m/s the velocities' are less in proportion: what is small is set by the mechanism's own speed.
    """
    if scene.is_planar:
        return planar.absolute_tolerances(scene)
    first, second, free = topology(scene)
    a = scene.numerics.absolute_tolerance
    if scene.numerics.formulation == "baumgarte":
        lengths, free = [True, True, True, True, False, True, True, False], True
    elif first and second:
        lengths = [True, True, False, True]
    elif first or second or scene.modes:
        lengths = [False, True]
    else:
        lengths = []
    lengths += [False] * free
    coordinates = [a if length else 10.0 * a for length in lengths]
    drive = scene.drive
    speed = getattr(drive, speed_entry(drive))
    rate = 1e3 * min(1.0, scene.slider_crank.crank.length * abs(speed) / 25.0)
    velocities = [rate * a if length else 50.0 * rate * a for length in lengths]
    own = bristles.tolerances(scene, at.TURN / abs(speed))
    bent = bending.tolerances(_bars_of(scene), a, rate * a) if scene.modes else ()
    return (*own[0], *bent, *coordinates, *own[1], *(rate * a for _ in bent), *velocities)


def implicit_method(scene: Scene) -> str:
    """When the kernel takes implicit steps: "never", "stiff" (where a lane's motion calls for it), "always".

    The automatic choice goes by the scene's numbers, so that a scene that is not stiff pays nothing for the other method.
    A response and an ensemble go by the same choice.
    """
    method = scene.numerics.method
    if method == "auto" and scene.modes:
        mechanism = _bars_of(scene)
        if max(bending.swings(mechanism)) * float(planar.period_of(mechanism)) > bending.STIFF:
            return "always"  # there is no stretch of the motion in which they are slow
    if method != "auto" or not scene.clearance_joints():
        return IMPLICIT_METHODS.get(method, "never")
    if scene.films() or scene.bristles:
        return "stiff"  # a film's damping grows beyond all bounds as it gets thin; bristles give way within a micrometre
    par = Parameters(parameters(scene)[0])
    is_open = np.array([flag is not None for flag in at.open_of(effects_of(scene))])
    ramp = par.steepness * (scene.effects.friction.law != "none")
    stiff = (ramp >= STIFF_RAMP) | (par.damping >= STIFF_DAMPING)
    return "stiff" if (stiff & is_open).any() else "never"


def _bars_of(scene: Scene) -> Mechanism:
    """The mechanism whose bars bend."""
    return planar.linkage_of(scene).mechanism if scene.is_planar else slider_crank_mechanism(scene)


def _cells_of_curves(
    linkage: Linkage, tables: dict[str, Any], cells: Callable[[Any], Array]
) -> tuple[Array, ...]:
    """Cells of a linkage's curves, in the order of their rows."""
    driven = {
        f"{drive.name}.{part}": cells
        for drive in linkage.mechanism.drives
        if isinstance(drive, TableDrive)
        for part, cells in zip(PARTS, drive.cells, strict=True)
    }
    return tuple(
        driven[name] if name in driven else cells(tables[name]) for name in linkage.curve_rows
    )


def problem_of(scene: Scene, *, series: bool = False, ledger: bool | None = None) -> Problem:
    """What is common to all samples of a scene."""
    e = scene.effects
    torque = getattr(scene.drive, "torque", None)
    drive: Any = main_drive(planar.tables_of(scene)) if scene.is_planar else scene.drive
    turns = getattr(drive, "turns", 1)
    linkage, curves = None, cast(tuple[Array, ...], ())
    if scene.is_planar:
        linkage = planar.linkage_of(scene)
    cells = partial(periodic_cells, turns=turns, interpolation=scene.numerics.interpolation)
    if linkage is not None:
        curves = _cells_of_curves(linkage, curves_of(planar.tables_of(scene)), cells)
    return Problem(
        effects=effects_of(scene, series=series, ledger=ledger),
        coordinates=coordinate_count(scene),
        tableau=tableau_of(scene),
        rtol=scene.numerics.rtol,
        atol=absolute_tolerances(scene),
        impact_floor=1e-3 if e.contact is None else e.contact.minimum_impact_speed,
        transient=scene.numerics.transient_revolutions,
        averaged=scene.numerics.averaged_revolutions,
        max_steps=scene.numerics.max_steps,
        torque_table=cells(torque) if isinstance(torque, tuple) else None,
        load_table=cells(e.slider_load) if isinstance(e.slider_load, tuple) else None,
        implicit=implicit_method(scene),
        cycle=at.TURN if linkage is None else linkage.mechanism.period.advance,
        parameter_rows=parameter_rows(scene),
        linkage=linkage,
        curves=curves,
        chosen=scene.objective.joints,
        from_rest=getattr(drive, "expected_speed", None) is not None,
    )


def integrator_of(scene: Scene) -> str:
    """Name of the method that a scene's responses and samples are integrated by."""
    if coordinate_count(scene) == 0:
        return "closed form"
    name = tableau_of(scene).name
    return {"never": name, "stiff": f"{name} and radau", "always": "radau"}[implicit_method(scene)]

"""The slider-crank as a linkage: its data by which effects are on, and where the layout keeps its parameters.

Its text keeps what holds parameters alone in place: the numbers are then those of the motions that were written by hand.
"""

from typing import Any

from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.bending import entries
from hpcclear.dynamics.linkage.generator import Motion, On, Rows, generate
from hpcclear.dynamics.linkage.mechanism import Mechanism
from hpcclear.dynamics.linkage.parts import (
    Bending,
    Body,
    Clearance,
    ConstantSpeed,
    Drive,
    Force,
    GuideFriction,
    Load,
    Revolute,
    Slide,
    TorqueDrive,
)

PARAMETERS = {
    "drive_speed": at.SPEED,
    "drive_torque": at.TORQUE,
    "drive_fall": at.TORQUE_FALL,
    "gravity": at.GRAVITY,
    "alpha2": at.BAUMGARTE_ALPHA2,
    "beta2": at.BAUMGARTE_BETA2,
    "load_force_x": at.LOAD,
    "guide_coefficient": at.GUIDE_COEFFICIENT,
    "guide_inverse_ramp": at.GUIDE_INVERSE_RAMP,
    "crank_a_b_x": at.CRANK_LENGTH,
    "crank_a_center_x": at.CRANK_NEAR,
    "crank_mass": at.CRANK_MASS,
    "crank_inertia": at.CRANK_OWN_INERTIA,
    "crank_moment_x": at.CRANK_MOMENT,
    "crank_pivot_inertia": at.CRANK_INERTIA,
    "rod_a_b_x": at.ROD_LENGTH,
    "rod_a_center_x": at.ROD_NEAR,
    "rod_center_b_x": at.ROD_FAR,
    "rod_mass": at.ROD_MASS,
    "rod_inverse_mass": at.INV_ROD_MASS,
    "rod_inertia": at.ROD_INERTIA,
    "rod_inverse_inertia": at.INV_ROD_INERTIA,
    "slider_mass": at.SLIDER_MASS,
    "slider_inverse_mass": at.INV_SLIDER_MASS,
    "slider_inertia": at.SLIDER_INERTIA,
}
"""Rows of the layout by the names of generated texts."""


def mechanism_of(effects: at.Effects) -> Mechanism:
    """The slider-crank with the loads and open joints of `effects`; its numbers are of no consequence."""
    points = {"a": (0.0, 0.0), "b": (2.0, 0.0)}
    bending = Bending(effects.bending, 1.0) if effects.bending else None
    bodies = (
        Body("crank", 1.0, 1.0, (1.0, 0.0), points),
        Body("rod", 1.0, 1.0, (1.0, 0.0), points, bending=bending),
        Body("slider", 1.0, 1.0, points={"pin": (0.0, 0.0)}),
    )
    drive: Drive = ConstantSpeed("drive", "crank", 1.0)
    if effects.torque:
        falls = 1.0 if effects.torque_falls else None
        table = bool(effects.torque_table)
        drive = TorqueDrive("drive", "crank", 1.0, 1.0, table=table, no_load_speed=falls)
    loads: tuple[Load, ...] = ()
    if effects.load or effects.load_table:
        loads = (Force("load", "slider.pin", (1.0, 0.0), table=bool(effects.load_table)),)
    friction = GuideFriction(1.0, 1.0) if effects.guide else None
    joints = (
        Revolute("crank_frame", "crank.a", "ground.o"),
        Slide("guide", "slider.pin", "ground.o", friction=friction),
        _pin("crank_rod", "crank.b", "rod.a", effects.crank_rod),
        _pin("rod_slider", "slider.pin", "rod.b", effects.rod_slider),
    )
    return Mechanism(bodies, joints, (drive,), loads=loads)


def _pin(name: str, journal: str, bearing: str, is_open: Any) -> Revolute:
    if is_open:
        return Clearance(name, journal, bearing, 1.0, 2.0, 1.0)
    return Revolute(name, journal, bearing)


def joints_of(effects: at.Effects) -> tuple[at.Joint, ...]:
    """Rows of the open joints."""
    pairs = ((effects.crank_rod, at.O12), (effects.rod_slider, at.O23))
    return tuple(joint for is_open, joint in pairs if is_open)


def motion_of(effects: at.Effects) -> Motion:
    """Its text, in the rows of the layout."""
    on = On(
        friction=bool(effects.friction or effects.film),
        gravity=bool(effects.gravity),
        ledger=bool(effects.ledger),
        series=bool(effects.series),
        responses=bool(effects.responses),
        follow="slider",
        objective="" if effects.objective is None else effects.objective.of,
        waves=bool(effects.waves),
    )
    known = {
        f"rod_bend_{entry}": row
        for row, entry in enumerate(entries(effects.bending or 0), at.BENDING)
    }
    parameters = PARAMETERS | known if effects.bending else PARAMETERS
    rows = Rows(parameters=parameters, free=at.OWN).behind(at.bristles_of(effects))
    return generate(mechanism_of(effects), on, rows, cartesian=bool(effects.baumgarte), hoist=False)

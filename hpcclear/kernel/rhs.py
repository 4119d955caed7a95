"""Accelerations of all lanes at one stage; only the effects that are on are compiled."""

from ..jit import lane_function
from . import layout as at
from .baumgarte import nine_coordinates
from .motion import both_ideal, crank_rod_open, rod_slider_open, two_open


@lane_function
def crank_motion(torque, work, par, last, i, W):
    """Crank angle and speed: a coordinate with a torque drive, else given by the time in this revolution."""
    if torque is not None:
        return work[(at.QS + last) * W + i], work[(at.VS + last) * W + i]
    else:
        speed = par[at.SPEED * W + i]
        return speed * work[at.STAGE_TIME * W + i], speed


@lane_function
def lane_motion(effects, crank_rod, rod_slider, torque, work, par, torque_table, load_table, i, W):
    """Accelerations and rates of lane i."""
    formulated(
        effects,
        effects.baumgarte,
        crank_rod,
        rod_slider,
        torque,
        work,
        par,
        torque_table,
        load_table,
        i,
        W,
    )


@lane_function
def formulated(
    effects, baumgarte, crank_rod, rod_slider, torque, work, par, torque_table, load_table, i, W
):
    """Dispatch on formulation and open joints; what is not called is not compiled."""
    if baumgarte is not None:
        nine_coordinates(effects, crank_rod, rod_slider, work, par, torque_table, load_table, i, W)
    elif crank_rod is not None:
        if rod_slider is not None:
            phi, omega = crank_motion(torque, work, par, 4, i, W)
            two_open(effects, work, par, torque_table, load_table, phi, omega, i, W)
        else:
            phi, omega = crank_motion(torque, work, par, 2, i, W)
            crank_rod_open(effects, work, par, torque_table, load_table, phi, omega, i, W)
    else:
        if rod_slider is not None:
            phi, omega = crank_motion(torque, work, par, 2, i, W)
            rod_slider_open(effects, work, par, torque_table, load_table, phi, omega, i, W)
        else:
            phi, omega = crank_motion(torque, work, par, 0, i, W)
            both_ideal(effects, work, par, torque_table, load_table, phi, omega, i, W)


@lane_function
def accelerations(effects, work, par, torque_table, load_table, W):
    """Accelerations and rates of W lanes at the stage held in `work`."""
    for i in range(W):
        lane_motion(
            effects,
            effects.crank_rod,
            effects.rod_slider,
            effects.torque,
            work,
            par,
            torque_table,
            load_table,
            i,
            W,
        )

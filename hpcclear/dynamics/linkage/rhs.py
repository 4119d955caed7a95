"""Accelerations of all lanes at one stage; only the effects that are on are compiled."""

from hpcclear.base.jit import lane_function
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.baumgarte import nine_coordinates
from hpcclear.dynamics.linkage.motion import (
    both_ideal,
    crank_rod_open,
    rod_slider_open,
    table_value,
    two_open,
)


@lane_function
def crank_coordinate(baumgarte, crank_rod, rod_slider):
    """Which coordinate is the crank angle, where it is one: the last of the formulation and the open joints."""
    if baumgarte is not None:
        return 8
    elif crank_rod is not None:
        return 2 if rod_slider is None else 4
    else:
        return 0 if rod_slider is None else 2


@lane_function
def crank_motion(torque, baumgarte, work, par, last, i, W):
    """Crank angle and speed: a coordinate with a torque drive or multipliers, else given by the time in this revolution."""
    if torque is not None or baumgarte is not None:
        return work[(at.QS + last) * W + i], work[(at.VS + last) * W + i]
    else:
        speed = par[at.SPEED * W + i]
        return speed * work[at.STAGE_TIME * W + i], speed


@lane_function
def look_up(effects, flag, row, work, par, table, last, W):
    """Value of a tabulated curve for every lane: apart from the motion, which a look-up would keep from being vectorised."""
    if flag is not None:
        for i in range(W):
            phi, _ = crank_motion(effects.torque, effects.baumgarte, work, par, last, i, W)
            work[row * W + i] = table_value(table, phi)


@lane_function
def lane_motion(effects, baumgarte, crank_rod, rod_slider, work, par, i, W):
    """Accelerations and rates of lane i, by formulation and open joints; what is not called is not compiled."""
    if baumgarte is not None:
        nine_coordinates(effects, crank_rod, rod_slider, work, par, i, W)
    else:
        last = crank_coordinate(baumgarte, crank_rod, rod_slider)
        phi, omega = crank_motion(effects.torque, baumgarte, work, par, last, i, W)
        if crank_rod is not None:
            if rod_slider is not None:
                two_open(effects, work, par, phi, omega, i, W)
            else:
                crank_rod_open(effects, work, par, phi, omega, i, W)
        else:
            if rod_slider is not None:
                rod_slider_open(effects, work, par, phi, omega, i, W)
            else:
                both_ideal(effects, work, par, phi, omega, i, W)


@lane_function
def accelerations(effects, work, par, torque_table, load_table, W):
    """Accelerations and rates of W lanes at the stage held in `work`."""
    crank_rod, rod_slider, baumgarte = effects.crank_rod, effects.rod_slider, effects.baumgarte
    last = crank_coordinate(baumgarte, crank_rod, rod_slider)
    look_up(effects, effects.torque_table, at.TORQUE_VALUE, work, par, torque_table, last, W)
    look_up(effects, effects.load_table, at.LOAD_VALUE, work, par, load_table, last, W)
    for i in range(W):
        lane_motion(effects, baumgarte, crank_rod, rod_slider, work, par, i, W)

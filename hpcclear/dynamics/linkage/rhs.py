"""Accelerations of all lanes at one stage: one compiled function for each set of effects, which steppers call by its address.

A stepper knows nothing of a motion but this address, so that one compiled stepper serves them all.
"""

import inspect
import sys
from functools import cache
from types import ModuleType
from typing import Any

from numba import carray, types

from hpcclear.base.bits import beyond, call_at
from hpcclear.base.cached import c_function
from hpcclear.base.jit import FASTMATH, interleaved, lane_function
from hpcclear.base.one_text import one_text, text_named
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage import slider_crank
from hpcclear.dynamics.linkage.baumgarte import nine_coordinates
from hpcclear.dynamics.linkage.compiled import module_with
from hpcclear.dynamics.linkage.motion import both_ideal, table_value

LONG = 200
"""Lines of a text from which half of its vectors stand side by side: of all of them there are more instructions than the
processor keeps decoded."""


@lane_function
def crank_coordinate(baumgarte):
    """Which coordinate is the crank angle, where it is one: the last of the formulation."""
    if baumgarte is not None:
        return 8
    else:
        return 0


@lane_function
def crank_motion(torque, baumgarte, work, par, last, i, W):
    """Crank angle and speed: a coordinate with a torque drive or multipliers, else given by the time in this revolution."""
    if torque is not None or baumgarte is not None:
        return work[(at.QS + last) * W + i], work[(at.VS + last) * W + i]
    else:
        speed = par[at.SPEED * W + i]
        return speed * work[at.STAGE_TIME * W + i], speed


@lane_function
def look_up(effects, flag, row, work, par, tables, first, last, W):
    """Value of a tabulated curve for every lane: apart from the motion, which a look-up would keep from being vectorised."""
    if flag is not None:
        for i in range(W):
            phi, _ = crank_motion(effects.torque, effects.baumgarte, work, par, last, i, W)
            work[row * W + i] = table_value(tables, first, at.CELLS, phi)


@lane_function
def lane_motion(effects, baumgarte, crank_rod, rod_slider, work, par, i, W):
    """Accelerations and rates of lane i, of the formulations that are written by hand."""
    if baumgarte is not None:
        nine_coordinates(effects, crank_rod, rod_slider, work, par, i, W)
    else:
        phi, omega = crank_motion(effects.torque, baumgarte, work, par, 0, i, W)
        both_ideal(effects, work, par, phi, omega, i, W)


@lane_function
def accelerations(effects, work, par, tables, W):
    """Accelerations and rates of W lanes at the stage held in `work`."""
    crank_rod, rod_slider, baumgarte = effects.crank_rod, effects.rod_slider, effects.baumgarte
    last = crank_coordinate(baumgarte)
    torque, load = effects.torque_table, effects.load_table
    look_up(effects, torque, at.TORQUE_VALUE, work, par, tables, at.TORQUE_TABLE, last, W)
    look_up(effects, load, at.LOAD_VALUE, work, par, tables, at.LOAD_TABLE, last, W)
    for i in range(W):
        lane_motion(effects, baumgarte, crank_rod, rod_slider, work, par, i, W)


@lane_function
def motion(effects, lanes, tables, W):
    """`accelerations` of the lanes at an address."""
    work = carray(lanes, at.BANK * W)
    par = beyond(work, at.WORK * W)
    accelerations(effects, work, par, carray(tables, at.TABLES), W)


_NUMBERS = types.CPointer(types.float64)
SIGNATURE = types.void(_NUMBERS, _NUMBERS)


@cache
def motion_of(effects: at.Effects, W: int) -> Any:
    """The compiled motion for W lanes; its ``address`` is what steppers take.

    A motion is a C function ``void motion(double *lanes, double *tables)``, whatever mechanism it describes and wherever
    its text comes from. Row k of lane i is ``lanes[k * W + i]``; the rows are those of `layout`, `work` first, parameters
    behind it from row ``layout.WORK`` on.

    - It reads coordinates and velocities of the stage (n rows each from QS and VS on), STAGE_TIME (s since the start of the
      revolution), of each joint with clearance its contact state (ACTIVE, INVERSE_IMPACT), and parameters.
    - It writes accelerations (n rows from ACC on) and, from RATE_NOW on, each joint's gap, normal force and rate of the gap,
      and of the other rates those that are asked for.
    - It may use TORQUE_VALUE and LOAD_VALUE. All other rows it leaves alone: no state of its own, nothing kept between calls.
    - `tables` holds the tabulated curves, ``layout.TABLES`` numbers.

    Every lane must get the same bits whatever W is and whatever the other lanes hold, lanes at rest among them, so it is
    compiled with `FASTMATH` and without branches on a lane's numbers.
    The object is kept for as long as the process lives: a stepper may hold its address.
    """
    return compiled_motion(written_by(effects), effects, W)


def compiled_motion(module: ModuleType, effects: at.Effects, W: int) -> Any:
    """The compiled ``motion`` of a module, as `motion_of` has it."""
    return compiled_text(motion_text(module, effects, W))


@cache  # a study asks for it with every lane's compilation, some hundred times
def motion_text(module: ModuleType, effects: at.Effects, W: int) -> str:
    """The name of the text that ``motion`` of a module is compiled from."""
    text = one_text(module.motion, f"motion_{W}", effects=effects, W=W)
    return str(text.__name__)


@cache
def compiled_text(name: str) -> Any:
    """The compiled motion of a text by its name, which another process can be told; its second word is the number of lanes."""
    text = getattr(text_named(name), name)
    lanes = int(name.split("_")[1])
    long = inspect.getsource(text).count("\n") > LONG
    with interleaved(lanes // 2 if long else lanes):
        return c_function(SIGNATURE, text, fastmath=FASTMATH)


@cache
def written_by(effects: at.Effects) -> ModuleType:
    """The module that holds `accelerations` and `motion` of a slider-crank with these effects.

    It is generated, but for multipliers, and for both joints ideal, which have a closed form: these stand here.
    """
    joints = slider_crank.joints_of(effects)
    if effects.baumgarte or not (joints or effects.bending):
        return sys.modules[__name__]
    return module_with(slider_crank.motion_of(effects), joints)


@lane_function
def run_motion(address, work, tables):
    """Accelerations and rates of all lanes at the stage held in `work`, by the motion at an address."""
    call_at(address, (work, tables))


@lane_function
def run_observed(observing, address, work, tables):
    """The same, after the motion at another address if that is not 0: what both write is this one's in the end.

    So a response has works and powers, and not a bit of its motion is other than its sample's. In one motion with both, a
    product that a force and a power share is rounded, where it stands in a fused multiply-add of the force alone.
    """
    if observing != 0:
        call_at(observing, (work, tables))
    call_at(address, (work, tables))

"""Accelerations of all lanes at one stage: one compiled function for each set of effects, which steppers call by its address.

A stepper knows nothing of a motion but this address, so that one compiled stepper serves them all.
"""

import inspect
from functools import cache
from types import ModuleType

from hpcclear.base.bits import call_at
from hpcclear.base.jit import FASTMATH, lane_function
from hpcclear.base.lowering.compiled import Compiled, interleaved
from hpcclear.base.lowering.values import DOUBLES
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.compiled import BANK

LONG = 200
"""Lines of a text from which half of its vectors stand batched: of all of them there are more instructions than the
processor keeps decoded."""


@cache  # a study requires it with every lane's compilation, some hundred times
def compiled_motion(module: ModuleType, effects: at.Effects, W: int) -> Compiled:
    """The compiled ``motion`` of a module for W lanes; its ``address`` is what steppers take.

    A motion is a C function ``void motion(double *lanes, double *tables)``, whatever mechanism it describes and wherever
    its text comes from. Row k of lane i is ``lanes[k * W + i]``; the rows are those of `layout`, `work` first, parameters
    behind it from row ``layout.WORK`` on.

    - It reads coordinates and velocities of the stage (n rows each from QS and VS on), STAGE_TIME (s since the start of the
      revolution), BEGAN (when that was, s), of each joint with clearance its contact state (ACTIVE, INVERSE_IMPACT), and
      parameters.
    - It writes accelerations (n rows from ACC on) and, from RATE_NOW on, each joint's gap, normal force and rate of the gap,
      and of the other rates those that are requested.
    - It may use CURVES. All other rows it leaves alone: no state of its own, nothing kept between calls.
    - `tables` holds the tabulated curves, ``layout.TABLES`` numbers.

    Every lane must get the same bits whatever W is and whatever the other lanes hold, lanes at rest among them, so it is
    compiled with `FASTMATH` and without branches on a lane's numbers.
    The object is kept for as long as the process lives: a stepper may hold its address.
    """
    long = inspect.getsource(module.lane.py_func).count("\n") > LONG
    with interleaved(W // 2 if long and W == BANK else W):
        return Compiled(module.motion, (DOUBLES, DOUBLES), FASTMATH, effects=effects, W=W)


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

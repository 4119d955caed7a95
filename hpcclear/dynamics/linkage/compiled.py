"""A generated source as a module: the motion of all lanes that `rhs.compiled_motion` compiles, called by its address."""

import hashlib
import inspect
from collections.abc import Callable, Iterable
from types import ModuleType

from hpcclear.base.generated import module_of
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout import curves
from hpcclear.dynamics.linkage.elements import functions
from hpcclear.dynamics.linkage.generator import LookUp, Motion

_HEAD = '''"""Written by hpcclear.dynamics.linkage.generator."""

import numpy as np

from hpcclear.base.bits import beyond, carray
from hpcclear.base.jit import apart, lane_function
from hpcclear.dynamics import layout as at
{contacts}from hpcclear.dynamics.linkage.elements import {elements}
from hpcclear.dynamics.physics.angles import sincos
from hpcclear.dynamics.physics.friction import saturated
'''

_FORCES = {
    "bearing": "from hpcclear.dynamics.contacts.bearing import joint_force\n",
    "wall": "from hpcclear.dynamics.contacts.wall import wall_force\n",
}

_MOTION = '''
lane_in_place = lane_function(lane.py_func)


@lane_function
def accelerations(effects, work, par, tables, W):
    """Accelerations and rates of W lanes."""
{looked_up}    for i in range(W):
        if W == {bank}:  # a loop over calls is so short that it would be unrolled before it could be vectorised
            lane_in_place(effects, JOINTS, work, par, i, W)
        else:
            lane(effects, JOINTS, work, par, i, W)


@lane_function
def motion(effects, lanes, tables, W):
    """`accelerations` of the lanes at an address."""
    work = carray(lanes, at.BANK * W)
    par = beyond(work, at.WORK * W)
    accelerations(effects, work, par, carray(tables, at.MAX_CURVES), W)
'''

BANK = 8  # lanes of an implicit step's motion


def _look_up(curve: int, one: LookUp) -> str:
    """Statements before a lane's text: of one tabulated curve, for all lanes."""
    head, before = curves.HEAD * curve, "".join(f"        {line}\n" for line in one.before)
    return f"""    repeats, intervals = tables[{head + curves.REPEATS}], tables[{head + curves.INTERVALS}]
    for i in range(W):
{before}        enter_table(work, {curve}, {one.place}, {one.rate}, repeats, intervals, i, W)
    look_up(work, tables, {curve}, W)
"""


def module_with(motion: Motion, places: Iterable[int]) -> ModuleType:
    """The module of a motion: ``accelerations`` of all lanes and ``motion``, which steppers call.

    `places`: of the joints with clearance, in the mechanism's order.
    """
    rows = motion.curves.items()
    looked_up = "".join(_look_up(row - at.CURVES, motion.look_ups[name]) for name, row in rows)
    kinds = {"bearing" if c.joint.round else "wall" for c in motion.forest.mechanism.contacts}
    called = [name for name in functions() if f" {name}(" in motion.source + looked_up]
    head = _HEAD.format(
        contacts="".join(_FORCES[one] for one in sorted(kinds)),
        elements=", ".join(called or ["look_up"]),
    )
    held = f"JOINTS = tuple(map(at.Joint, {tuple(places)}))"
    own = [f"@lane_function\n{_source(one, name)}\n\n" for name, one in motion.functions.items()]
    lane = f"@apart\n@lane_function\n{motion.source}"
    text = f"{''.join(own)}{lane}\n{_MOTION.format(looked_up=looked_up, bank=BANK)}"
    text = f"{head}\n{held}\n\n\n{text}"
    return module_of(f"linkage_{hashlib.sha256(text.encode()).hexdigest()[:12]}", text)


def _source(function: Callable[..., object], name: str) -> str:
    """The source of a function under another name."""
    source = inspect.getsource(function)
    return source.replace(f"def {function.__name__}(", f"def {name}(", 1)

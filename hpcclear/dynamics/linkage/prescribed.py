"""Linkages without clearance whose drives prescribe everything: the motion by Newton from the instant before, no integration.

Positions and velocities from the loops, accelerations, reactions and drive moments from the generated equations in Cartesian
coordinates (feedback off), all instants at once.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.assembly import Assembly, assemble, check_rank
from hpcclear.dynamics.linkage.generator import On, Rows, generate
from hpcclear.dynamics.linkage.loops import WORDS, Loops
from hpcclear.dynamics.linkage.mechanism import Mechanism, freedom
from hpcclear.dynamics.linkage.numbers import row_of, values
from hpcclear.dynamics.linkage.table_drive import words_of

FARTHEST = (
    0.05  # rad, or of the typical length: how far Newton may go from where the step was to end
)
MOST_HALVES = 24
_NEWTON = 12


@dataclass(frozen=True)
class Prescribed:
    """A motion that the drives prescribe, over instants (t,)."""

    assembly: Assembly
    times: Array
    """Shape (t,)."""
    q: Array
    v: Array
    a: Array
    """q, v and a, shape (t, n): mass centres and angles of all bodies, velocities and accelerations, SI; the order of
    ``assembly.loops.forest``."""
    holds: dict[str, Array]
    """By constraint: ``"NAME_x"`` and ``"NAME_y"`` are the force of a pin on its journal's body, ``"NAME_across"`` that of
    a guide across its line, ``"NAME_angle"`` the moment of a guide or of a drive; each (t,), N or N m."""
    power: Array
    loss: Array
    load_power: Array
    """power, loss and load_power, shape (t,): of all drives, of friction, of the loads, W."""
    margin: Array
    """Shape (t,): smallest singular value of the constraints, rows scaled to 1: 0 at a dead centre."""


def prescribed_motion(
    mechanism: Mechanism,
    times: Array,
    gravity: float = 0.0,
    curves: Mapping[str, Callable[[Array], Array]] | None = None,
) -> Prescribed:
    """Motion and reactions at instants (t,), s, which rise from 0; `curves`: tabulated loads by name, each as a function of the
    angle (t,) of the body that gives the period, rad.

    Raises
    ------
    InputError
        If a joint has clearance or the drives leave something free, and where the mechanism comes to a dead centre.
    """
    if mechanism.clearances or freedom(mechanism):
        raise InputError(
            "drives", freedom(mechanism), "something is left free: the drives do not prescribe the motion",
            "Prescribe the angle of one body a degree of freedom, and give no joint clearance",
        )  # fmt: skip
    assembly = assemble(mechanism)
    found, margin = passed_through(assembly, times)
    return _reactions(assembly, np.asarray(times), found, gravity, margin, curves or {})


def passed_through(assembly: Assembly, times: Array) -> tuple[Array, Array]:
    """Coordinates and velocities (t, 2, n) at instants (t,) that rise from 0, and how far from a dead centre each is (t,).

    Raises
    ------
    InputError
        Where the mechanism comes to a dead centre.
    """
    loops, q, here = assembly.loops, assembly.q, 0.0
    found = np.zeros((len(times), 2, loops.size))
    margin = np.zeros(len(times))
    everything = np.ones(len(loops.owners), bool)
    v = assembly.v
    for row, time in enumerate(times):
        if time > here:
            q, v = _passed(loops, q, v, here, time, MOST_HALVES)
            here = time
        margin[row] = check_rank(loops, loops.at(q, v, time).jacobian, everything, time)
        found[row] = q, v
    return found, margin


def _passed(
    loops: Loops, q: Array, v: Array, start: float, end: float, halves: int
) -> tuple[Array, Array]:
    """From one instant to the next, halved where Newton would have to go far, which might lead to another assembly."""
    guess = q + (end - start) * v
    new = guess.copy()
    for _ in range(_NEWTON):
        state = loops.at(new, v, end)
        change, *_ = np.linalg.lstsq(state.jacobian * loops.scales, -state.error, rcond=None)
        new = new + loops.scales * change
        if np.abs(change).max() < 1e-13:
            break
    far = np.abs((new - guess) / loops.scales).max()
    turned = np.abs((end - start) * v / loops.scales).max()
    if (
        np.isfinite(far)
        and far < FARTHEST
        and turned < 5 * FARTHEST
        and np.abs(change).max() < 1e-9
    ):
        state = loops.at(new, np.zeros(loops.size), end)
        rates, *_ = np.linalg.lstsq(state.jacobian * loops.scales, -state.rate, rcond=None)
        return new, rates * loops.scales
    if halves == 0:
        everything = np.ones(len(loops.owners), bool)
        check_rank(loops, state.jacobian, everything, end)
        worst = loops.owners[int(np.abs(state.error).argmax())]
        raise InputError(
            worst, end, "the mechanism cannot be moved on from here (s)",
            "Change a length so that the drives can turn through, or give a joint clearance",
        )  # fmt: skip
    middle = 0.5 * (start + end)
    q, v = _passed(loops, q, v, start, middle, halves - 1)
    return _passed(loops, q, v, middle, end, halves - 1)


def _reactions(
    assembly: Assembly,
    times: Array,
    found: Array,
    gravity: float,
    margin: Array,
    tabulated: Mapping[str, Callable[[Array], Array]],
) -> Prescribed:
    """Accelerations and reactions from the equations of motion, instants side by side as rows of arrays."""
    mechanism, n = assembly.loops.mechanism, assembly.loops.size
    holds = 3 * n + 1
    rates = holds + len(assembly.loops.owners)
    curves = {name: rates + at.RATES + 2 + k for k, name in enumerate(tabulated)}
    rows = Rows(
        0, n, 2 * n, rates, 3 * n, rates + at.RATES, rates + at.RATES + 1, holds, curves=curves
    )
    on = On(gravity=gravity != 0.0, ledger=True)
    text = generate(mechanism, on, rows, cartesian=True, hoist=False)
    names: dict[str, Any] = WORDS | words_of(mechanism)
    exec(text.source, names)
    work = np.zeros((rates + at.RATES + 2 + len(curves), len(times)))
    work[:n], work[n : 2 * n], work[3 * n] = found[:, 0].T, found[:, 1].T, times
    work[rates + at.RATES :] = 1.0
    turned = assembly.loops.forest.index("angle", mechanism.period.body)
    assert turned is not None  # every body turns by itself here
    for name, row in curves.items():
        work[row] = tabulated[name](work[turned])
    par = row_of(text, values(mechanism, cartesian=True, gravity=gravity))
    names["lane"](None, (), work, par, 0, 1)
    from_row = {name: work[holds + r] for r, name in enumerate(text.constraints)}
    return Prescribed(
        assembly, times, found[:, 0], found[:, 1], work[2 * n : 3 * n].T.copy(), from_row,
        work[rates + at.DRIVE_POWER], work[rates + at.DISSIPATION], work[rates + at.LOAD_POWER],
        margin,
    )  # fmt: skip

"""Signals of a response by their names: its series over time, and those that are derived from series here.

This is the one list for all commands that take a signal. What the mechanism has as a whole is called as its column
(``crank_moment``); what joints, bodies, points and guides have, by that and their label (``contact_force crank_rod``), which a
single one may lack.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError, nearest
from hpcclear.results.content import Results, Variable


@dataclass(frozen=True)
class DerivedSignal:
    """A signal that is made of a series of joints or points."""

    source: str
    """The series, a column of a response."""
    unit: str
    label: str
    made: Callable[[Array, Array], Array]
    """Of time, s, and the series of one place, both (t,): the signal (t,)."""
    counted: bool = False
    """Whether it is events, which are counted between two instants, rather than values at instants."""


def _second_derivative(time: Array, values: Array) -> Array:
    from scipy.interpolate import make_interp_spline  # takes time to load

    return make_interp_spline(time, values, k=5).derivative(2)(time)


def _beginnings(time: Array, depth: Array) -> Array:
    touching = depth > 0.0
    return np.concatenate([[0.0], touching[1:] & ~touching[:-1]])


DERIVED = {
    "acceleration_x": DerivedSignal("point_x", "m/s^2", "x acceleration", _second_derivative),
    "acceleration_y": DerivedSignal("point_y", "m/s^2", "y acceleration", _second_derivative),
    "impacts": DerivedSignal("penetration", "1", "impacts", _beginnings, counted=True),
}
"""DerivedSignal signals by name."""


@dataclass(frozen=True)
class Signal:
    """One signal of a response."""

    name: str
    label: str
    """Its words, for an axis: "contact force of crank_rod"."""
    unit: str
    """SI unit."""
    time: Array
    series: Array
    """Of the response (t,): the signal, or what it is made of."""
    derived: DerivedSignal | None = None

    @property
    def counted(self) -> bool:
        """Whether it is events."""
        return self.derived is not None and self.derived.counted

    @property
    def values(self) -> Array:
        """Values (t,), SI."""
        return self.series if self.derived is None else self.derived.made(self.time, self.series)


def is_counted(name: str) -> bool:
    """Return whether a signal of this name is events."""
    kind = DERIVED.get(name.partition(" ")[0])
    return kind is not None and kind.counted


def signals_in(response: Results) -> dict[str, Signal]:
    """Return every signal of a response (kind ``response``) by its name."""
    time = response["time"].to_numpy()
    found: dict[str, Signal] = {}

    def add(name: str, label: str, variable: Variable, derived: DerivedSignal | None) -> None:
        others = [dim for dim in variable.dims if dim != "time"]
        if "time" not in variable.dims or len(others) > 1:
            return
        unit = str(variable.attrs["units"]) if derived is None else derived.unit
        places = variable.labels[others[0]] if others else [""]
        columns = variable.values.reshape(len(time), len(places)).T
        for place, series in zip(places, columns, strict=True):
            key = f"{name} {place}" if others else name
            words = f"{label} of {place}" if others else label
            found[key] = Signal(key, words, unit, time, series, derived)
            if len(places) == 1:
                found[name] = found[key]

    for name, variable in response.data_vars.items():
        add(name, name.replace("_", " "), variable, None)
    for name, derived in DERIVED.items():
        if derived.source in response:
            add(name, derived.label, response[derived.source], derived)
    return found


def signal(response: Results, name: str, key: str) -> Signal:
    """Return a signal of a response; raises InputError with the option or entry `key` where this name is missing."""
    found = signals_in(response)
    if name not in found:
        alike = [one for one in found if one.startswith(f"{name} ")]
        remedy = f"Use one of: {', '.join(alike)}" if alike else nearest(name, list(found))
        raise InputError(key, name, "the response has no such signal", remedy)
    return found[name]

"""What a study may make small: each objective's name, unit and words, and what it is of a sample's record.

Ours and a user's are declared alike. The kernel averages gaps, so a record that leaves it holds f of eq. 13; `asked` replaces
it by the requested objective, on the rank that simulated it, and everybody after that reads ``objective``."""

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import cache, partial
from inspect import Parameter, Signature, signature
from typing import Literal

import numpy as np

from hpcclear.base.arrays import Array, Booleans, Records
from hpcclear.base.errors import InputError
from hpcclear.base.outcome import FIELDS, IMPACTS, RESPONSES, WIDEST

Function = Callable[..., Array | float]

_RECORDED = ("mean_gap", "peak_contact_force", *RESPONSES, *IMPACTS, *WIDEST)
RECORDED = {"objective": "m"} | {name: FIELDS[name].unit.removeprefix("1") for name in _RECORDED}
"""Fields of a sample's record that `Objective.value` may require, with units; ``objective`` is f of eq. 13."""

OF_JOINTS = {
    "gap": "m", "depth": "m", "gap_rate": "m/s", "normal_force": "N", "friction_force": "N", "sliding_speed": "m/s",
    "direction_x": "", "direction_y": "", "clearance": "m", "bearing_radius": "m", "journal_radius": "m",
}  # fmt: skip
"""What `Objective.rate` may require of each joint with clearance, with units: distance from the clearance circle, positive in
contact, and its rate; the same cut at 0; the forces of contact; the sliding speed; the normal from bearing to journal."""

OF_ALL = {
    "drive_cosine": "", "drive_sine": "", "drive_speed": "rad/s", "drive_torque": "N m", "acceleration_x": "m/s^2",
    "acceleration_y": "m/s^2",
}  # fmt: skip
"""What it may require of the mechanism: the angle from the x axis, speed and torque of the body that the drive turns, and the
acceleration of the followed body or point. Nothing of it jumps at the end of a revolution."""

MADE = ("mean", "revolution", "rms", "peak")
"""What may be made of a rate."""

RATE = "rate_of_objective"
"""Field of a record with what was made of the rate."""


@dataclass(frozen=True, eq=False)
class Objective:
    """What a study makes small: made of a sample's record, of a rate that the simulation integrates, or of both.

    Functions name what they need by their arguments, and get it in SI units.
    """

    words: str
    """What it is, for people: "mean contact force"."""
    unit: str = ""
    """SI, "" of a plain number: "N m"."""
    value: Function | None = None
    """Its value, of arguments in `RECORDED`, and ``rate``: what was made of `rate`. What joints have comes as an array over the
    joints with clearance. By default the rate, of the joint where it is largest."""
    rate: Function | None = None
    """Plain arithmetic of arguments in `OF_JOINTS` and `OF_ALL`, compiled into the simulation as laws are. One that requires
    nothing of joints is of the mechanism as a whole."""
    made: Literal["mean", "revolution", "rms", "peak"] = "mean"
    """What is made of the rate over the averaged revolutions: its mean in time, its integral over a revolution, its root mean
    square, or its largest value at the ends of the steps."""
    rate_unit: str | None = None
    """Unit of what is made of the rate; by default that of the objective."""
    source: str = ""
    """Where it was published."""
    name: str = ""
    joints: tuple[int, ...] = ()
    """Places in records of chosen joints; none for all that there are."""
    places: tuple[int, ...] = ()
    """Those of all joints with clearance."""
    band: float = 0.0
    """Middle of the third-octave band that it is a level of, Hz; 0 of what is none."""

    @property
    def asks(self) -> frozenset[str]:
        """All that its functions require."""
        return frozenset(name for one in (self.value, self.rate) if one for name in arguments(one))

    @property
    def whole(self) -> bool:
        """Whether the rate is of the mechanism as a whole."""
        return self.rate is not None and not OF_JOINTS.keys() & set(arguments(self.rate))

    @property
    def rate_of(self) -> str:
        """What the rate is of: "joints", or "whole" of the mechanism; "" without one."""
        return "" if self.rate is None else "whole" if self.whole else "joints"

    @property
    def of_joints(self) -> bool:
        """Whether it is made of what joints have."""
        recorded = set() if self.value is None else RECORDED.keys() & set(arguments(self.value))
        rubs = self.rate is not None and not self.whole
        return rubs or self.name == "mean-gap" or any(FIELDS[name].per for name in recorded)

    @property
    def unit_of_rate(self) -> str:
        """Unit of what is made of the rate."""
        return self.unit if self.rate_unit is None else self.rate_unit

    def made_of(self, mean: Array, peak: Array, period: Array) -> Array:
        """What is made of the rate, (m, joints): of its mean in time, of its square where that is what is made, its peak
        and the length of a revolution, (m, 1)."""
        if self.made == "revolution":
            return mean * period
        return {"mean": mean, "rms": np.sqrt(np.maximum(mean, 0.0)), "peak": peak}[self.made]

    def of(self, records: Records) -> Array:
        """Its value of records (n,), NaN where a part is or is missing. Raises InputError where `value` gives no number."""
        names = ("rate",) if self.value is None else arguments(self.value)
        found = np.full(len(records), np.nan)
        fields = {RATE if name == "rate" else name for name in names}
        if not fields <= {*(records.dtype.names or ())}:
            return found
        columns = [self._column(name, records) for name in names]
        for k, row in enumerate(zip(*columns, strict=True)):
            if not any(np.isnan(one).any() for one in row):
                found[k] = self._value_of(row)
        return found

    def _column(self, name: str, records: Records) -> Array:
        """What `value` gets by a name, (n,) or (n, joints)."""
        if name == "rate" and self.whole:
            return np.asarray(records[RATE][:, 0])
        found: Array = records[RATE if name == "rate" else name]
        if self.band:
            found = _in_band(found, records["band"] == self.band)
        places = self.joints or self.places
        return found[:, list(places)] if found.ndim > 1 and places else found

    def _value_of(self, row: tuple[Array, ...]) -> float:
        try:
            return float(np.max(row[0]) if self.value is None else self.value(*row))
        except Exception as error:
            reason = f"its value raised {type(error).__name__}: {error}"
            raise InputError("objective", self.name, reason, "Mend it") from error


def arguments(function: Function) -> tuple[str, ...]:
    """Names of what a function requires."""
    return tuple(signature(function).parameters)


def _taken(name: str) -> Function:
    """What takes a field of a record: at joints the largest, of energies the sum."""

    def value(found: Array) -> float:
        return float(np.sum(found) if FIELDS[name].unit == "J" else np.nanmax(found))

    value.__signature__ = Signature([Parameter(name, Parameter.POSITIONAL_OR_KEYWORD)])  # type: ignore[attr-defined]
    return value


_GAP = "mean gap between journal and bearing"
MEAN_GAP = Objective(_GAP, "m", _taken("objective"), name="mean-gap")
"""f of eq. 13, the mean distance from the clearance circle, of a scene without a study, and of a study that names no other."""

OURS = {MEAN_GAP.name: MEAN_GAP} | {
    name.replace("_", "-"): Objective(
        one.goal + (", of the joint where it is larger" if one.per and one.unit != "J" else ""),
        one.unit.removeprefix("1"), _taken(name), name=name.replace("_", "-"),
    )
    for name, one in FIELDS.items()
    if one.goal
}  # fmt: skip
"""Ours by their names: a field of a record with a `goal` each."""


def band_of(frequency: float) -> float:
    """Middle of the third-octave band of a frequency, Hz (IEC 61260-1:2014, base ten)."""
    return float(1000.0 * 10.0 ** (round(10.0 * np.log10(frequency / 1000.0)) / 10.0))


LOWEST, HIGHEST = 1.0, 1e5
"""Frequencies that levels may be of, Hz."""

LEVEL = re.compile(r"(frame|contact)-force-level-at-(\d+(?:\.\d+)?)-?(k?)Hz")
"""Names of objectives that are a third-octave level: "frame-force-level-at-1.25kHz"."""


def level_of(name: re.Match[str]) -> Objective:
    """The third-octave level of a force, dB re 1e-6 N, by a match of `LEVEL`; InputError where none has its frequency."""
    return _level(name[0], name[1], float(name[2]), name[3])


@cache
def _level(name: str, force: str, number: float, kilo: str) -> Objective:
    frequency = number * (1000.0 if kilo else 1.0)
    if not LOWEST <= frequency <= HIGHEST:
        reason = f"its frequency must be from {LOWEST:g} to {HIGHEST:g} Hz"
        raise InputError("objective", name, reason, "Write another frequency")
    made = partial(Objective, name=name, band=band_of(frequency))
    at = f"at {number:g} {kilo}Hz, dB re 1e-6 N"
    if force == "frame":
        words = f"third-octave level of the force on the frame {at}"
        return made(words, "", lambda frame_force_level: frame_force_level)
    words = f"third-octave level of the contact force {at}, of the joint where it is larger"
    return made(words, "", lambda contact_force_level: contact_force_level.max())


def _in_band(levels: Array, here: Booleans) -> Array:
    """Of levels (n, ..., bands) those of the band that is `here` (n, bands); NaN of records without it."""
    inner = tuple(range(1, levels.ndim - 1))
    place = np.expand_dims(here.argmax(axis=1), (*inner, levels.ndim - 1))
    found = np.take_along_axis(levels, place, axis=-1)[..., 0]
    found[~here.any(axis=1)] = np.nan
    return found


ENDS = ("alpha", "beta", "gamma", "delta", "epsilon")
"""What the designs are called that have the least of the first, the second ... that a case makes small. There are as many as a
case may name: hypervolumes are exact so far, and the designs that a study can afford are lost on a front of more."""

ORDINALS = ("first", "second", "third", "fourth", "fifth")
"""The same places, as variables of files are called by them."""


class Usual(IntEnum):
    """Statistics of f that are reported of every design, whatever its case makes small."""

    OTHER = 0
    MEAN = 1
    DEVIATION = 2
    PERCENTILE = 3


@cache
def bound(
    objective: Objective, name: str, places: tuple[int, ...], joints: tuple[int, ...], labels: tuple[str, ...]
) -> Objective:  # fmt: skip
    """An objective as a scene names it: of its joints with clearance, by their places in a record, or of chosen ones, by
    their places and labels."""
    words = objective.words
    if joints:
        words = words.partition(", of the joint")[0]
        larger = ", the larger" if len(joints) > 1 and words != objective.words else ""
        words += f", of {' and '.join(labels)}{larger}"
    return replace(objective, name=name, words=words, places=places, joints=joints)


_OF_THE_GAP = {name for name in FIELDS if name.startswith("objective_")}


def asked(records: Records, objective: Objective) -> Records:
    """Records (n,) as the kernel leaves them, with the requested objective as ``objective``.

    How far f scatters between revolutions and copies says nothing of another objective, so that is NaN then.
    """
    if objective.name == MEAN_GAP.name:  # of whichever joints, the kernel has it
        return records
    found = records.copy()
    found["objective"] = objective.of(records)
    for name in _OF_THE_GAP & {*(found.dtype.names or ())}:
        found[name] = np.nan
    return found

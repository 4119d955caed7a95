"""What a study may make small: each objective's name, unit and words, and what it is of a sample's record.

The kernel averages gaps, so a record that leaves it holds f of eq. 13; `asked` replaces it by the requested objective, on the
rank that simulated it, and everybody after that reads ``objective``."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array, Records
from hpcclear.base.outcome import OUTCOME


class Objective(NamedTuple):
    """One objective: `name` in a scene file, SI `unit`, `words` for people, and its value `of` records (n,).

    `joints`: places of those that count, which the field `by_joint` of a record goes by; none for all.
    """

    name: str
    unit: str
    words: str
    of: Callable[[Records], Array]
    by_joint: str | None = None
    joints: tuple[int, ...] = ()


def _largest(name: str, unit: str, words: str) -> Objective:
    """The largest over joints of what a record has of each under the same name."""
    field = _field_of(name)
    return Objective(name, unit, words, lambda records: records[field].max(axis=1), field)


def _plain(name: str, unit: str, words: str) -> Objective:
    """What a record has under the same name."""
    field = _field_of(name)
    return Objective(name, unit, words, lambda records: records[field])


def _field_of(name: str) -> str:
    return name.replace("-", "_")


# fmt: off
_ALL = (
    Objective("mean-gap", "m", "mean distance from the clearance circle", lambda records: records["objective"], "mean_gap"),
    _largest("mean-contact-force", "N", "mean contact force, of the joint where it is larger"),
    _largest("peak-contact-force", "N", "peak contact force, of the joint where it is larger"),
    _plain("peak-crank-moment", "N m", "peak torque of the drive on the crank"),
    _plain("slider-acceleration-deviation", "m/s^2", "standard deviation in time of the slider acceleration"),
    _plain("point-acceleration-deviation", "m/s^2",
        "root mean square about its mean of the acceleration of the followed point"),
    _plain("peak-point-acceleration", "m/s^2", "largest acceleration of the followed point"),
)
# fmt: on
OBJECTIVES = {one.name: one for one in _ALL}
"""Every objective by its name."""

ENDS = ("alpha", "beta", "gamma", "delta", "epsilon")
"""What the designs are called that have the least of the first, the second ... that a case makes small. There are as many as a
case may name: hypervolumes are exact so far, and the designs that a study can afford are lost on a front of more."""

ORDINALS = ("first", "second", "third", "fourth", "fifth")
"""The same places, as variables of files are called by them."""

MEAN_GAP = OBJECTIVES["mean-gap"]
"""f of eq. 13, what a scene without a study, and of a study that names no other."""


def of_joints(objective: Objective, places: Sequence[int], labels: Sequence[str]) -> Objective:
    """The same of chosen joints only, by their places in a record and by their labels."""
    field = objective.by_joint
    words = f"{objective.words.partition(', of the joint')[0]}, of {' and '.join(labels)}"
    if len(places) > 1 and objective.name != MEAN_GAP.name:
        words += ", the larger"

    def largest(records: Records) -> Array:
        found: Array = np.asarray(records[field], float)[:, list(places)]
        return np.asarray(found.max(axis=1))

    of = objective.of if objective.name == MEAN_GAP.name else largest
    return objective._replace(words=words, of=of, joints=tuple(places))


_OF_THE_GAP = tuple(name for name in OUTCOME.names or () if name.startswith("objective_"))


def asked(records: Records, objective: Objective) -> Records:
    """Records (n,) as the kernel leaves them, with the requested objective as ``objective``.

    How far f scatters between revolutions and copies says nothing of another objective, so that is NaN then.
    """
    if objective.name == MEAN_GAP.name:  # of whichever joints, the kernel has it
        return records
    found = records.copy()
    found["objective"] = objective.of(records)
    for name in _OF_THE_GAP:
        found[name] = np.nan
    return found

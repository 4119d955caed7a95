"""What a study may make small: each objective's name, unit and words, and what it is of a sample's record.

The kernel averages gaps, so a record that leaves it holds f of eq. 13; `asked` puts the objective that was asked for in its
place, on the rank that simulated it, and everybody after that reads ``objective``.
"""

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


_ALL = (
    Objective(
        "mean-gap",
        "m",
        "mean distance from the clearance circle",
        lambda r: r["objective"],
        "mean_gap",
    ),
    Objective(
        "mean-contact-force",
        "N",
        "mean contact force, of the joint where it is larger",
        lambda r: r["mean_contact_force"].max(axis=1),
        "mean_contact_force",
    ),
    Objective(
        "peak-contact-force",
        "N",
        "peak contact force, of the joint where it is larger",
        lambda r: r["peak_contact_force"].max(axis=1),
        "peak_contact_force",
    ),
    Objective(
        "peak-crank-moment",
        "N m",
        "peak moment of the drive on the crank",
        lambda r: r["peak_crank_moment"],
    ),
    Objective(
        "slider-acceleration-deviation",
        "m/s^2",
        "standard deviation in time of the slider acceleration",
        lambda r: r["slider_acceleration_deviation"],
    ),
    Objective(
        "point-acceleration-deviation",
        "m/s^2",
        "root mean square about its mean of the acceleration of the followed point",
        lambda r: r["point_acceleration_deviation"],
    ),
    Objective(
        "peak-point-acceleration",
        "m/s^2",
        "largest acceleration of the followed point",
        lambda r: r["peak_point_acceleration"],
    ),
)
OBJECTIVES = {one.name: one for one in _ALL}
"""Every objective by its name."""

ENDS = ("alpha", "beta", "gamma", "delta", "epsilon")
"""What the designs are called that have the least of the first, the second ... that a case makes small. There are as many as a
case may name: hypervolumes are exact so far, and the designs that a study can afford are lost on a front of more."""

ORDINALS = ("first", "second", "third", "fourth", "fifth")
"""The same places, as variables of files are called by them."""

MEAN_GAP = OBJECTIVES["mean-gap"]
"""f of eq. 13, what a scene without a study, and a study that names nothing else, asks for."""


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
    """Records (n,) as the kernel leaves them, with the objective that was asked for as ``objective``.

    How far f scatters between revolutions and copies says nothing of another objective, so that is NaN then.
    """
    if objective.name == MEAN_GAP.name:  # of whichever joints, the kernel has it
        return records
    found = records.copy()
    found["objective"] = objective.of(records)
    for name in _OF_THE_GAP:
        found[name] = np.nan
    return found

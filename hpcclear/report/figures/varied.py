"""In which entry the scenes of several responses differ, and the values that it has there."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.report.figures import labels, motion
from hpcclear.results.content import Results
from hpcclear.scene.loading import scene_of_text
from hpcclear.scene.paths import described, flatten, quantities
from hpcclear.scene.plugged import UntrustedSource

RPM = labels.Scale(30.0 / np.pi, "rpm")


class Varied(NamedTuple):
    """An entry that differs from response to response."""

    words: str
    scale: labels.Scale
    values: Array
    """SI, shape (responses,)."""


def varied(responses: Sequence[Results]) -> Varied:
    """Return the physical entry in which the scenes differ; the clearance as the motion shows it, where files do not say.

    Raises
    ------
    InputError
        They differ in several entries.
    """
    found = _differing(responses)
    if not found:
        reached = np.array([np.nanmax(motion.clearances(one)) for one in responses])
        return Varied("clearance $C$", labels.scale("m", reached), reached)
    values = np.array(next(iter(found.values())), float)
    if any(not np.array_equal(values, one) for one in found.values()):
        reason = "their scenes differ in several entries"
        raise InputError(
            "responses", ", ".join(found), reason, "Give responses in which one is varied"
        )
    unit, words = quantities()[next(iter(found))].unit, described(list(found))
    words = "clearance $C$" if words == "radial clearance" else labels.literal(words)
    return Varied(words, RPM if unit == "rad/s" else labels.scale(unit or "1", values), values)


def _differing(responses: Sequence[Results]) -> dict[str, list[float]]:
    """Values in each response of the physical entries that are not the same in all; none where a file carries no scene."""
    try:
        tables = [_entries(one) for one in responses]
    except UntrustedSource:  # it says how to allow what is needed
        raise
    except InputError:
        return {}
    shared = [path for path in tables[0] if all(path in one for one in tables)]
    columns = {path: [one[path] for one in tables] for path in shared}
    return {path: column for path, column in columns.items() if len(set(column)) > 1}


def _entries(response: Results) -> dict[str, Any]:
    """Numbers of the scene of a response, by their paths."""
    scene = scene_of_text(str(response.attrs.get("scene", "")), "responses")
    known = quantities()
    return {
        path: value
        for path, value in flatten(scene.resolved())
        if path in known and isinstance(value, int | float)
    }

"""The one table of what stands in every result file: kinds, names, dimensions, units, meanings."""

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from hpcclear.base.outcome import JUDGED, ON_REQUEST, Flag, Regime, Status
from hpcclear.results import columns
from hpcclear.results.content import Results
from hpcclear.results.identified import IDENTIFY
from hpcclear.results.rows import Column, Columns


class Kind(NamedTuple):
    """A file of the table."""

    title: str
    coords: dict[str, Column]
    data: dict[str, Column]
    required: frozenset[str]  # data variables; coordinates always are
    design_dims: tuple[str, ...] | None  # dimensions of its design variables; None: it has none
    limit_dims: tuple[str, ...] | None  # dimensions of their limits, NAME_lower and NAME_upper


DESIGN_VARIABLES = {
    "m1": ("kg", "mass of the crank"),
    "u1": ("m", "position of the mass centre of the crank, from its first joint"),
    "I1": ("kg m^2", "inertia of the crank about its mass centre"),
    "m2": ("kg", "mass of the rod"),
    "u2": ("m", "position of the mass centre of the rod, from its first joint"),
    "I2": ("kg m^2", "inertia of the rod about its mass centre"),
    "m3": ("kg", "mass of the slider"),
    "C": ("m", "radial clearance"),
    "I1_ratio": ("1", "inertia of the crank over that of a slender rod, m1 L1^2/12"),
    "I2_ratio": ("1", "inertia of the rod over that of a slender rod, m2 L2^2/12"),
}
"""Units and long names of the design variables of the paper (its Table 3)."""

SECONDS_PER_SAMPLE = "seconds_per_sample"
"""Attribute of the file of times: processor time of a sample by the names of the effects that are off, as JSON."""

SECONDS_BY_ROUND = "seconds_per_sample_by_round"
"""The same as lists, a number a round: those of a round were measured one after the other."""

ALL_ON = "all on"
"""Name of the whole scene there."""


def _meanings(*words: str) -> dict[str, object]:
    """Codes from 0 on, and what they mean."""
    values = np.arange(len(words), dtype=np.int8)
    return {"flag_values": values, "flag_meanings": " ".join(words)}


def _members(codes: type[IntEnum], entry: str = "flag_values") -> dict[str, object]:
    """Codes of an enumeration, and what they mean."""
    return {
        entry: np.array([int(code) for code in codes], np.int8),
        "flag_meanings": " ".join(code.name.lower() for code in codes),
    }


FURTHER: dict[str, dict[str, object]] = {
    "status": _members(Status),
    "ending": _members(Status),
    "outcome": _members(Status),
    "flags": _members(Flag, "flag_masks"),
    "regime": _members(Regime),
    "latched": _meanings("free", "latched"),
    "converged": _meanings("not_determined", "determined"),
    "selected": _meanings("left_out", "selected"),
    "used": _meanings("not_an_input", "input"),
    "surface_accepted": _meanings("refused", "accepted"),
    "accepted": _meanings("refused", "accepted"),
    "verified": _meanings("not_simulated", "simulated"),
    "off": _meanings("on", "off"),
    "finding": _meanings("within", "beyond", "undecided"),
    "decision": _meanings("within", "beyond", "undecided"),
    "judged": _meanings("reported", "judged"),
    "recommended": _meanings("not_recommended", "recommended"),
    "chosen": _meanings("not_chosen", "chosen"),
    "together": _meanings("independent", "correlated"),
    "without_bounds": _meanings("bounded", "within_three_standard_deviations"),
    "explained": _meanings("not_explained", "explained"),
    "dominated": _meanings("not_significantly", "dominated"),
}
"""CF attributes beyond units and long name: what the codes mean."""


def _kind(
    title: str,
    table: Columns,
    design_dims: tuple[str, ...] | None = None,
    *,
    limit_dims: tuple[str, ...] | None = None,
    whole: bool = False,
) -> Kind:
    """A kind of file; of a `whole` one only what is made on request may be missing."""
    coords = {name: row for name, row in table.items() if row.dims == (name,)}
    data = {name: row for name, row in table.items() if name not in coords}
    required = (
        set(data) - {*ON_REQUEST, *JUDGED, "label"}
        if whole
        else {n for n in data if data[n].required}
    )
    return Kind(title, coords, data, frozenset(required), design_dims, limit_dims)


KINDS = {
    "response": _kind("Response of a mechanism with clearance joints", columns.RESPONSE),
    "samples": _kind(
        "Samples of a mechanism with clearance joints", columns.SAMPLES, ("sample",), whole=True
    ),
    "bifurcation": _kind(
        "One value for each revolution, against an entry of the scene",
        columns.BIFURCATION,
        ("value",),
    ),
    "sensitivity": _kind("Sensitivity of the objective against clearance", columns.SENSITIVITY),
    "kriging": _kind(
        "Kriging models of the objective",
        columns.KRIGING,
        ("model", "point"),
        limit_dims=("model",),
    ),
    "front": _kind("Pareto fronts, by the surrogate", columns.FRONT, ("case", "run", "solution")),
    "verification": _kind(
        "Simulated designs with confidence intervals", columns.VERIFICATION, ("design",)
    ),
    "chaos": _kind("Sensitivity of the designs to initial conditions", columns.CHAOS),
    "contributions": _kind("Contributions to the scatter of designs", columns.CONTRIBUTIONS),
    "worst": _kind("Worst case of designs", columns.WORST),
    "claims": _kind("Claims of the paper, tested on these results", columns.CLAIMS),
    "readings": _kind("Designs of the paper under interpretations of its text", columns.READINGS),
    "statistics": _kind("Statistics of many samples", columns.STATISTICS),
    "wear": _kind("Service lives of a mechanism with wear", columns.WEAR, ("life",)),
    "effects": _kind("Effect screening: effects that can be neglected", columns.EFFECTS),
    "identify": _kind("Unknowns of a machine from measured signals", IDENTIFY),
    "timing": _kind("Run time of the ranks", columns.TIMING),
    "accuracy": _kind("Accuracy against run time", columns.ACCURACY),
}
"""Every result file by its kind."""


FURTHER_DIMS = {
    *("body", "point", "pin", "wave", "angle", "mode", "guide"),
    *("revolution", "order", "band", "record", "particle", "feature", "candidate", "revolutions"),
}
"""Coordinates that only some files have."""

ROLE = "design_variable"  # value of the attribute `role` of design variables

LIMIT = "design_limit"  # the same for their limits, NAME_lower and NAME_upper


def designs_in(samples: Results) -> dict[str, np.ndarray]:
    """The design variables in results, each of the shape of its dimensions, by their names or scene paths."""
    return {
        str(variable.attrs["scene_path"]): variable.to_numpy()
        for variable in samples.variables.values()
        if variable.attrs.get("role") == ROLE
    }

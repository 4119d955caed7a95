"""The one table of what stands in every result file: kinds, names, dimensions, units, meanings."""

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from hpcclear.base.outcome import JUDGED, ON_REQUEST, Flag, Regime, Status
from hpcclear.results import columns
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
    "told": _meanings("within", "beyond", "untold"),
    "decision": _meanings("within", "beyond", "untold"),
    "judged": _meanings("told", "judged"),
    "recommended": _meanings("not_recommended", "recommended"),
    "chosen": _meanings("not_chosen", "chosen"),
    "together": _meanings("independent", "correlated"),
    "dominated": _meanings("not_surely", "dominated"),
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
        set(data) - {*ON_REQUEST, *JUDGED} if whole else {n for n in data if data[n].required}
    )
    return Kind(title, coords, data, frozenset(required), design_dims, limit_dims)


KINDS = {
    "response": _kind("Response of a mechanism with clearance joints", columns.RESPONSE),
    "samples": _kind(
        "Samples of a mechanism with clearance joints", columns.SAMPLES, ("sample",), whole=True
    ),
    "sensitivity": _kind("Sensitivity of the objective against clearance", columns.SENSITIVITY),
    "kriging": _kind(
        "Kriging models of the objective",
        columns.KRIGING,
        ("model", "point"),
        limit_dims=("model",),
    ),
    "front": _kind("Fronts of mean and deviation", columns.FRONT, ("case", "run", "solution")),
    "verification": _kind("Designs simulated directly", columns.VERIFICATION, ("design",)),
    "chaos": _kind("How much of the scatter of designs is chaos", columns.CHAOS),
    "contributions": _kind("Which input makes the scatter of designs", columns.CONTRIBUTIONS),
    "claims": _kind("What the paper claims, tested on our data", columns.CLAIMS),
    "readings": _kind("The paper's designs under readings of its text", columns.READINGS),
    "statistics": _kind("Statistics of many samples, streamed", columns.STATISTICS),
    "wear": _kind("Lives of a mechanism whose joints wear", columns.WEAR, ("life",)),
    "effects": _kind("Which effects a scene can do without", columns.EFFECTS),
    "timing": _kind("Where the time went", columns.TIMING),
    "accuracy": _kind("What accuracy costs in time", columns.ACCURACY),
}
"""Every result file by its kind."""

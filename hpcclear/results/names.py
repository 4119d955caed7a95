"""Every kind of result file, and the names that several of them share."""

import pkgutil
from collections.abc import Mapping
from importlib import import_module

import numpy as np

from hpcclear.results import kinds
from hpcclear.results.content import Results
from hpcclear.results.rows import ResultKind

DESIGN_VARIABLES = {
    "m1": ("kg", "mass of the crank", "crank mass $m_1$"),
    "u1": ("m", "position of the mass centre of the crank, from its first joint", "crank centre $u_1$"),
    "I1": ("kg m^2", "inertia of the crank about its mass centre", "crank inertia $I_1$"),
    "m2": ("kg", "mass of the rod", "rod mass $m_2$"),
    "u2": ("m", "position of the mass centre of the rod, from its first joint", "rod centre $u_2$"),
    "I2": ("kg m^2", "inertia of the rod about its mass centre", "rod inertia $I_2$"),
    "m3": ("kg", "mass of the slider", "slider mass $m_3$"),
    "C": ("m", "radial clearance", "clearance $C$"),
    "I1_ratio": ("1", "inertia of the crank over that of a slender rod, m1 L1^2/12", ""),
    "I2_ratio": ("1", "inertia of the rod over that of a slender rod, m2 L2^2/12", ""),
}  # fmt: skip
"""Units, long names and labels of axes of the design variables of the paper (its Table 3)."""

SECONDS_PER_SAMPLE = "seconds_per_sample"
"""Attribute of the file of times: processor time of a sample by the names of the effects that are off, as JSON."""

SECONDS_BY_ROUND = "seconds_per_sample_by_round"
"""The same as lists, a number a round: those of a round were measured one after the other."""

ALL_ON = "all on"
"""Name of the whole scene there."""


_FOUND: dict[str, ResultKind] = {
    one.name: import_module(f"{kinds.__name__}.{one.name}").KIND
    for one in pkgutil.iter_modules(kinds.__path__)
}

KINDS: Mapping[str, ResultKind] = dict(sorted(_FOUND.items(), key=lambda one: one[1].order))
"""Every kind of result file by its name, in their order: those of the files of `hpcclear.results.kinds`."""

ROLE = "design_variable"  # value of the attribute `role` of design variables

LIMIT = "design_limit"  # the same for their limits, NAME_lower and NAME_upper


def designs_in(samples: Results) -> dict[str, np.ndarray]:
    """The design variables in results, each of the shape of its dimensions, by their names or scene paths."""
    designs = [one for one in samples.variables.values() if one.attrs.get("role") == ROLE]
    return {str(one.attrs["scene_path"]): one.values for one in designs}

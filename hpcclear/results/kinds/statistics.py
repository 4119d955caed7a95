"""Sums and histograms of samples that are not stored."""

from hpcclear.base.outcome import Flag, Status
from hpcclear.results.rows import count, flag, kind_of, statistics_of, text

KIND = kind_of(
    130, "Statistics of many samples", ("bin",),
    table={
        "joint": text(("joint",), "joint"),
        "bin": count(("bin",), "number of the bin; the first is below all edges, the last at or above them"),
        "edge": count(("edge",), "number of the edge between two bins"),
        "outcome": flag(("outcome",), "how a simulation ended", Status),
        "flags": flag(("flags",), "validity warning of a result", Flag),
        "samples_by_status": count(("outcome",), "number of samples with this outcome", required=True),
        "samples_by_flag": count(("flags",), "number of samples with this flag", required=True),
        **statistics_of("objective", (), "objective", "objective"),
        **statistics_of("objective_spread", (), "objective", "cycle-to-cycle standard deviation"),
        **statistics_of("mean_gap", ("joint",), "m", "mean gap"),
        **statistics_of("peak_contact_force", ("joint",), "N", "peak contact force"),
        **statistics_of("rhs_evaluations", (), "1", "number of force evaluations"),
    },
)

"""Sums and histograms of samples that are not stored."""

from hpcclear.base.outcome import Flag, Status
from hpcclear.results.rows import ResultKind, count, flag, number, text

KIND = ResultKind(
    130, "Statistics of many samples", ("bin",),
    table={
        "joint": text("joint", "joint"),
        "bin": count("bin", "number of the bin; the first is below all edges, the last at or above them"),
        "edge": count("edge", "number of the edge between two bins"),
        "outcome": flag("outcome", "how a simulation ended", Status),
        "flags": flag("flags", "validity warning of a result", Flag),
        "samples_by_status": count("outcome", "number of samples with this outcome", required=True),
        "samples_by_flag": count("flags", "number of samples with this flag", required=True),
        **{
            f"{name}_{end}": row
            for name, dims, units, words in (
                ("objective", "", "objective", "objective"),
                ("objective_spread", "", "objective", "cycle-to-cycle standard deviation"),
                ("mean_gap", "joint", "m", "mean gap"),
                ("peak_contact_force", "joint", "N", "peak contact force"),
                ("rhs_evaluations", "", "1", "number of force evaluations"),
            )
            for end, row in {
                "count": count(dims, f"number of finite values of the {words}", required=True),
                "mean": number(dims, units, f"mean of the {words}", required=True),
                "deviation": number(dims, units, f"sample standard deviation of the {words}", required=True),
                "minimum": number(dims, units, f"least {words}", required=True),
                "maximum": number(dims, units, f"greatest {words}", required=True),
                "histogram": count(f"{dims} bin", f"number of samples by {words}", required=True),
                "edges": number(f"{dims} edge", units, f"edges of the bins of the {words}", required=True),
            }.items()
        },
    },
)

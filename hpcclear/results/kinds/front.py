"""Pareto fronts of all runs of the optimiser."""

from hpcclear.base.objectives import ORDINALS
from hpcclear.results.rows import Columns, count, flag, kind_of, number, text

# fmt: off
COLUMNS: Columns = {
    "case": text(("case",), "case of the robust design"),
    "run": count(("run",), "number of the run of the optimiser"),
    "solution": count(("solution",), "number of the solution in its run"),
    "mean": number(("case", "run", "solution"), "objective",
        "mean of the objective, by the surrogate", required=True),
    "deviation": number(("case", "run", "solution"), "objective",
        "standard deviation of the objective, by the surrogate", required=True),
    "verified": flag(("case", "run", "solution"), "whether the solution was simulated", "not_simulated simulated"),
    "hypervolume": number(("case", "run"), "objective^2", "area that the front dominates"),
    "searched": text(("case",), "objectives of the case, if other than mean and standard deviation of f"),
    **{
        f"searched_{name}": number(("case", "run", "solution"), "", f"{name} of these objectives, by the surrogate")
        for name in ORDINALS
    },
}
# fmt: on

KIND = kind_of(
    60,
    "Pareto fronts, by the surrogate",
    COLUMNS,
    ("case", "run", "solution"),
    design_dims=("case", "run", "solution"),
    absent="nothing was optimised (`hpcclear run`)",
)

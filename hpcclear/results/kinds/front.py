"""Pareto fronts of all runs of the optimiser."""

from hpcclear.base.objectives import ORDINALS
from hpcclear.results.rows import ResultKind, count, flag, number, text

KIND = ResultKind(
    60, "Pareto fronts, by the surrogate", ("case", "run", "solution"),
    design_dims=("case", "run", "solution"), absent="nothing was optimised (`hpcclear run`)",
    table={
        "case": text("case", "case of the robust design"),
        "run": count("run", "number of the run of the optimiser"),
        "solution": count("solution", "number of the solution in its run"),
        "mean": number("case run solution", "objective", "mean of the objective, by the surrogate", required=True),
        "deviation": number("case run solution", "objective",
            "standard deviation of the objective, by the surrogate", required=True),
        "verified": flag("case run solution", "whether the solution was simulated", "not_simulated simulated"),
        "hypervolume": number("case run", "objective^2", "area that the front dominates"),
        **{
            f"searched_{name}{end}": row
            for name in ORDINALS
            for end, row in (
                ("", number("case run solution", "", f"{name} of these objectives, by the surrogate")),
                ("_goal", text("case", f"{name} of these objectives, in words; empty for none")),
                ("_unit", text("case", f"{name} of these objectives: unit, empty for none known")),
            )
        },
    },
)

"""Designs verified by simulation."""

from hpcclear.base.objectives import ORDINALS, Usual
from hpcclear.results.rows import ResultKind, count, estimate, flag, number, text, with_error

KIND = ResultKind(
    70, "Simulated designs with confidence intervals", ("design",),
    design_dims=("design",), optional=("rival", "constraint"), absent="no design was verified (`hpcclear run`)",
    table={
        "design": text("design", "name of the design"),
        "case": text("design", "case of the robust design", required=True),
        **estimate("mean", "design", "objective", "mean of the objective, by simulation", "_true", required=True),
        "mean_surrogate": number("design", "objective", "mean of the objective, by the surrogate"),
        "mean_error": number("design", "1", "error of the mean by the surrogate, relative to the simulated mean"),
        "mean_paper": number("design", "m", "mean as printed in the paper, its Table 4"),
        **estimate("deviation", "design", "objective", "standard deviation, by simulation", "_true", required=True),
        "deviation_surrogate": number("design", "objective", "standard deviation, by the surrogate"),
        "deviation_error": number("design", "1", "error of the standard deviation by the surrogate, relative"),
        "deviation_paper": number("design", "m", "standard deviation as printed in the paper, its Table 4"),
        **estimate("percentile", "design", "objective", "95th percentile of the objective, by simulation"),
        **estimate("life_mean", "design", "objective", "mean of the objective over service lives and ages"),
        **estimate("life_deviation", "design", "objective", "standard deviation over service lives and ages"),
        "rival": text("rival", "name of another design"),
        "equivalence": flag("design rival",
            "whether two designs of a case are statistically indistinguishable in mean and standard deviation",
            "different equivalent", required=True),
        "accuracy_missed": text("design", "quantities whose confidence interval is wider than study.accuracy requests"),
        "dominated": flag("design", "whether another design of its case is significantly better in mean and standard deviation",
            "not_significantly dominated"),
        "mean_within": number("design", "1",
            "relative half-width of the confidence interval of the mean, error of the tolerance included"),
        "deviation_within": number("design", "1", "the same of the standard deviation"),
        **with_error("mean_tolerance", "design", "1",
            "relative bias of the mean by the integration tolerance, from pairs at a tighter one; part of mean_within"),
        **with_error("deviation_tolerance", "design", "1",
            "relative bias of the standard deviation by the integration tolerance"),
        **{
            f"{place}_{end}": row
            for place in ORDINALS
            for end, row in {
                "goal": text("design", f"{place} objective of the case, in words"),
                "unit": text("design", f"{place} objective of the case: unit, empty for none"),
                "usual": flag("design", f"{place} objective of the case: whether it is reported of every design", Usual),
            }.items()
        },
        **{
            name: row for place in ORDINALS
            for name, row in estimate(place, "design", "", f"{place} objective of the case, by simulation", "_true").items()
        },
        "constraint": count("constraint", "number of the constraint in its case"),
        "constraint_goal": text("design constraint", "quantity of the constraint, in words; empty for none"),
        "constraint_unit": text("design constraint", "unit of that quantity, empty for none"),
        **estimate("constraint", "design constraint", "", "that quantity, by simulation", "_true"),
        "constraint_most": number("design constraint", "", "largest allowed value of that quantity"),
        "constraint_verdict": flag("design constraint",
            "whether the design satisfies the constraint, significantly over all designs and looks",
            "satisfied violated undecided absent"),
        "constraint_price": number("design constraint", "1",
            "simulations of the design that would decide; infinite if the integration tolerance leaves it open"),
        "constraint_excess": number("design", "1",
            "largest violation of a constraint, relative to the threshold, at most 0 without; plus "
            "the relative distance of f where all simulations exceed it"),
        "simulations": count("", "number of simulations of the study up to its decision", required=True),
        "samples": count("design", "number of simulations", required=True),
        "rare_samples": count("design", "number of additional simulations that decide rare failures"),
        "failed": count("design", "number of simulations that failed", required=True),
        "beyond_hertz": count("design",
            "number of simulations with indentation outside the range of Hertz contact", required=True),
        "random": text("design", "random inputs of its case", required=True),
        "on_bounds": text("design", "active bounds: design variables at an end of their range, and which end"),
    },
)

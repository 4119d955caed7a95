"""Designs verified by simulation."""

from hpcclear.base.objectives import ORDINALS
from hpcclear.results.rows import Columns, count, flag, goal, kind_of, number, text

# fmt: off
COLUMNS: Columns = {
    "design": text(("design",), "name of the design"),
    "case": text(("design",), "case of the robust design"),
    "mean_true": number(("design",), "objective", "mean of the objective, by simulation", required=True),
    "mean_lower": number(("design",), "objective", "lower end of the confidence interval of the mean"),
    "mean_upper": number(("design",), "objective", "upper end of the confidence interval of the mean"),
    "mean_surrogate": number(("design",), "objective", "mean of the objective, by the surrogate"),
    "mean_error": number(("design",), "1", "error of the mean by the surrogate, relative to the simulated mean"),
    "mean_paper": number(("design",), "m", "mean as printed in the paper, its Table 4"),
    "deviation_true": number(("design",), "objective", "standard deviation, by simulation", required=True),
    "deviation_lower": number(("design",), "objective", "lower end of the confidence interval of the standard deviation"),
    "deviation_upper": number(("design",), "objective", "upper end of the confidence interval of the standard deviation"),
    "deviation_surrogate": number(("design",), "objective", "standard deviation, by the surrogate"),
    "deviation_error": number(("design",), "1", "error of the standard deviation by the surrogate, relative"),
    "deviation_paper": number(("design",), "m", "standard deviation as printed in the paper, its Table 4"),
    "percentile": number(("design",), "objective", "95th percentile of the objective, by simulation"),
    "percentile_lower": number(("design",), "objective", "lower end of the confidence interval of the percentile"),
    "percentile_upper": number(("design",), "objective", "upper end of the confidence interval of the percentile"),
    "life_mean": number(("design",), "objective", "mean of the objective over service lives and ages"),
    "life_mean_lower": number(("design",), "objective", "lower end of its confidence interval"),
    "life_mean_upper": number(("design",), "objective", "upper end of its confidence interval"),
    "life_deviation": number(("design",), "objective", "standard deviation of the objective over service lives and ages"),
    "life_deviation_lower": number(("design",), "objective", "lower end of its confidence interval"),
    "life_deviation_upper": number(("design",), "objective", "upper end of its confidence interval"),
    "same_as": text(("design",), "earlier design that is statistically indistinguishable in mean and standard deviation"),
    "equivalent": text(("design",), "designs of its case, statistically indistinguishable in mean and standard deviation"),
    "accuracy_missed": text(("design",), "quantities whose confidence interval is wider than study.accuracy requests"),
    "dominated": flag(("design",),
        "whether another design of its case is significantly better in mean and standard deviation",
        "not_significantly dominated"),
    "mean_within": number(("design",), "1",
        "relative half-width of the confidence interval of the mean, error of the tolerance included"),
    "deviation_within": number(("design",), "1", "the same of the standard deviation"),
    "mean_tolerance": number(("design",), "1",
        "relative bias of the mean by the integration tolerance, from pairs at a tighter one; part of mean_within"),
    "mean_tolerance_error": number(("design",), "1", "its standard error; part of mean_within"),
    "deviation_tolerance": number(("design",), "1", "relative bias of the standard deviation by the integration tolerance"),
    "deviation_tolerance_error": number(("design",), "1", "its standard error"),
    **{name: row for place in ORDINALS for name, row in goal(place).items()},
    "constraints": text(("design",), "verdicts on the constraints of its case"),
    "constraint_excess": number(("design",), "1",
        "largest violation of a constraint, relative to the threshold, at most 0 without; plus "
        "the relative distance of f where all simulations exceed it"),
    "samples": count(("design",), "number of simulations"),
    "rare_samples": count(("design",), "number of additional simulations that decide rare failures"),
    "failed": count(("design",), "number of simulations that failed"),
    "beyond_hertz": count(("design",), "number of simulations with indentation outside the range of Hertz contact"),
    "random": text(("design",), "random inputs of its case"),
    "on_bounds": text(("design",), "active bounds: design variables at an end of their range, and which end"),
}
# fmt: on

KIND = kind_of(
    70,
    "Simulated designs with confidence intervals",
    COLUMNS,
    ("design",),
    design_dims=("design",),
    absent="no design was verified (`hpcclear run`)",
)

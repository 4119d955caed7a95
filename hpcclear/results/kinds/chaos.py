"""Scatter of designs by perturbations of their initial conditions."""

from hpcclear.results.rows import ResultKind, count, number, text

KIND = ResultKind(
    80, "Sensitivity of the designs to initial conditions", ("design",),
    table={
        "design": text("design", "name of the design"),
        "chaos_deviation": number("design", "objective",
            "standard deviation of the objective by perturbations of 1e-9 alone", required=True),
        "chaos_share": number("design", "1", "share of the chaotic scatter in the variance over random inputs", required=True),
        "chaotic": number("design", "1", "share of samples whose objective changes with such a perturbation", required=True),
        "pairs": count("design", "samples simulated twice", required=True),
    },
)

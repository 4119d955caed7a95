"""Designs of the paper under interpretations of its text."""

from hpcclear.results.rows import ResultKind, count, number, text, with_error

KIND = ResultKind(
    120, "Designs of the paper under interpretations of its text", ("reading", "design"),
    table={
        "reading": text("reading", "interpretation of the text of the paper"),
        "design": text("design", "design of the paper, its Table 4"),
        "case": text("design", "case of the robust design"),
        "objective_smallest": number("reading design", "m", "objective at the smallest clearance", required=True),
        **with_error("mean", "reading design", "m", "mean of the objective, by simulation", required=True),
        **with_error("deviation", "reading design", "m", "standard deviation of the objective", required=True),
        "failed": count("reading design", "number of simulations that failed"),
        "mean_paper": number("design", "m", "mean as printed"),
        "deviation_paper": number("design", "m", "standard deviation as printed"),
        "distance": number("reading", "1", "root mean square of ln(mean / printed mean)", required=True),
    },
)

"""Contributions of random inputs to the variance of designs."""

from hpcclear.results.rows import ResultKind, count, number, text, with_error

KIND = ResultKind(
    90, "Contributions to the scatter of designs", ("design", "input"),
    table={
        "design": text("design", "name of the design"),
        "input": text("input", "random input"),
        **with_error("contribution", "design input", "1",
            "share of the variance of the objective that an input causes, alone or together with correlated inputs",
            required=True),
        **with_error("halved", "design input", "1",
            "relative reduction of the standard deviation if the scatter of an input is halved", required=True),
        **with_error("halved_together", "design", "1",
            "relative reduction of the standard deviation if the scatter of the inputs to tighten first is halved at once"),
        "halving_cost": number("design input", "1", "additional cost of halving the scatter of an input"),
        "unexplained": number("design", "1", "share of the variance that no input or pair explains", required=True),
        "unexplained_error": number("design", "1", "standard error of it"),
        "group": count("design input", "number of the group of correlated inputs that share one contribution; 0 for none"),
    },
)

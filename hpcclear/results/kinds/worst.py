"""Largest objective within the bounds of the random inputs."""

from hpcclear.results.rows import ResultKind, count, flag, number, text

KIND = ResultKind(
    100, "Worst case of designs", ("design", "input"),
    table={
        "design": text("design", "name of the design"),
        "input": text("input", "random input"),
        "worst": number("design", "objective", "largest objective found within the bounds of the random inputs", required=True),
        "worst_corner": number("design", "objective", "the largest at a corner of these bounds", required=True),
        "searched_at": number("design input", "", "value of the random input there, in the unit beside it", required=True),
        "tried": count("design", "simulations of the search", required=True),
        "without_bounds": flag("input", "whether the input has no bounds and is taken within three standard deviations",
            "bounded within_three_standard_deviations"),
        "input_unit": text("input", "unit of the random input"),
    },
)

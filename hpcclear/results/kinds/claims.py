"""The claims of the paper."""

from hpcclear.results.rows import ResultKind, count, flag, text

KIND = ResultKind(
    110, "Claims of the paper, tested on these results", ("claim",),
    table={
        "claim": count("claim", "number of the claim"),
        "text": text("claim", "what is claimed", required=True),
        "verdict": flag("claim", "verdict on the claim", "holds does_not_hold undecided", required=True),
        "figure": text("claim", "number on which the verdict is based", required=True),
    },
)

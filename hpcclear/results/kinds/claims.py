"""The claims of the paper."""

from hpcclear.results.rows import Columns, count, kind_of, text

# fmt: off
COLUMNS: Columns = {
    "claim": count(("claim",), "number of the claim"),
    "text": text(("claim",), "what is claimed", required=True),
    "verdict": text(("claim",), "holds, does not hold, or is undecided", required=True),
    "figure": text(("claim",), "number on which the verdict is based", required=True),
}
# fmt: on

KIND = kind_of(110, "Claims of the paper, tested on these results", COLUMNS, ("claim",))

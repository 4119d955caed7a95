"""Tables of measured results in `analysis/results`, from which the site of the documentation fills its pages."""

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path

RESULTS = Path(__file__).parent / "results"


def record(name: str, rows: Iterable[Sequence[object]]) -> None:
    """Write a table; its first row is the heading."""
    with (RESULTS / f"{name}.csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)

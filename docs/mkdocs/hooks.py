"""What the site shows otherwise than the repository: tables of measured results, and fences without our marks."""

import csv
import re
from pathlib import Path
from typing import Any

NOT_RUN = re.compile(r"^(`{3,})(\w+) no-run: (.*)$", re.MULTILINE)
MARKED = re.compile(r"^(`{3,})(\w+) (?:slow\b|from ).*$", re.MULTILINE)

MEASURED = re.compile(r"^\[measured: (\w+)\]\((?:\.\./)+analysis/results/\1\.csv\)$", re.MULTILINE)
"""A line in place of a table: a link to what scripts measured, from which the site is filled."""

RESULTS = Path(__file__).parents[2] / "analysis" / "results"


def table(name: str) -> str:
    """A file of measured results as a table; its first row is the heading."""
    with (RESULTS / f"{name}.csv").open(newline="", encoding="utf-8") as file:
        heading, *rows = [[cell.replace("|", "\\|") for cell in row] for row in csv.reader(file)]
    lines = [heading, ["---"] * len(heading), *rows]
    return "\n".join(f"| {' | '.join(row)} |" for row in lines)


def on_page_markdown(markdown: str, **_: Any) -> str:
    """A page with the tables of its measured results, without our marks, the reason of what no test runs beside it."""
    text = MEASURED.sub(lambda match: table(match[1]), markdown)
    text = NOT_RUN.sub(r"*(not run by the tests: \3)*\n\n\1\2", text)
    return MARKED.sub(r"\1\2", text)

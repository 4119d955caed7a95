"""What the site shows otherwise than the repository: tables of measured results, fences without our marks, moved sections."""

import csv
import re
from pathlib import Path
from typing import Any

NOT_RUN = re.compile(r"^(`{3,})(\w+) no-run: (.*)$", re.MULTILINE)
MARKED = re.compile(r"^(`{3,})(\w+) (?:slow\b|from ).*$", re.MULTILINE)

MEASURED = re.compile(r"^\[measured: (\w+)\]\((?:\.\./)+analysis/results/\1\.csv\)$", re.MULTILINE)
"""A line in place of a table: a link to what scripts measured, from which the site is filled."""

MOVED = """<script>
function follow() {
  const place = document.getElementById(decodeURIComponent(location.hash.slice(1)));
  if (place && place.matches("a.moved")) location.replace(place.nextElementSibling.href);
}
addEventListener("hashchange", follow);
follow();
</script>"""
"""Leads from the former anchor of a section, which stands before a link, to its place."""

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


def on_page_content(html: str, **_: Any) -> str:
    """A page, with a script if sections of it have moved."""
    return html + MOVED if 'class="moved"' in html else html

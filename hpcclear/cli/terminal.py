"""How the commands print numbers and remarks: in 80 columns, colours only on a terminal."""

import sys
import textwrap
from collections.abc import Iterable

import click

from hpcclear.base.plain import plain
from hpcclear.cli.options import detailed, show
from hpcclear.ranks.terminal import WIDTH


def print_remark(label: str, text: str) -> None:
    """Print a text that begins with a label in colour."""
    whole = "\n".join(textwrap.wrap(fitting(plain(f"{label}: {text}")), WIDTH))
    click.echo(click.style(f"{label}:", fg="yellow") + whole.removeprefix(f"{label}:"))


def show_rows(title: str, found: Iterable[tuple[str, str]]) -> None:
    """Print what and its value in two columns, with ``--details`` under a title."""
    rows = list(found)
    if detailed():
        from hpcclear.cli.tables import console, table

        console().print(table(title, rows))
        return
    width = max([15, *(len(label) for label, _ in rows)])
    for label, text in rows:
        lines = textwrap.wrap(fitting(text), WIDTH - width - 2, break_on_hyphens=False)
        for k, line in enumerate(lines or [""]):
            show(f"{'' if k else label:{width}}  {line}")


def fitting(text: str) -> str:
    """A text as the terminal can show it: units in plain letters where it has no others."""
    if "utf" in (sys.stdout.encoding or "").lower():
        return text
    return text.replace("µ", "u").replace("²", "^2").replace("–", "-").replace("±", "+-")

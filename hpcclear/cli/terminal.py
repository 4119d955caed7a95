"""How the commands print: tables that fit 80 columns, plain when piped."""

import sys
from typing import Any

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from hpcclear.base.plain import plain
from hpcclear.report.figures import labels

WIDTH = 80


class _PlainConsole(Console):
    """Shows texts as they are: nothing in them is markup, and nothing commands the terminal."""

    def render_str(self, text: str, **options: Any) -> Text:
        """Make a text of a string, for lines, titles and cells alike."""
        return super().render_str(plain(text), **{**options, "markup": False, "emoji": False})


def console() -> Console:
    """Standard output; at most 80 columns, colours only on a terminal."""
    screen = Console(highlight=False, soft_wrap=False)
    width = min(WIDTH, screen.width) if screen.is_terminal else WIDTH
    return _PlainConsole(highlight=False, width=width)


def remark(label: str, text: str) -> Text:
    """A line that begins with a label in colour."""
    return Text.assemble((f"{label}:", "yellow"), f" {plain(text)}")


def table(title: str, rows: list[tuple[str, str]]) -> Table:
    """Two columns: what, and its value."""
    made = Table(
        title=title, title_justify="left", box=box.SIMPLE_HEAD, show_header=False, pad_edge=False
    )
    made.add_column(no_wrap=True)
    made.add_column(overflow="fold")
    for row in rows:
        made.add_row(*row)
    return made


def quantity(value: float, unit: str, digits: int = 4) -> str:
    """A number for people in a unit of a readable size, "nan" where there is none."""
    return fitting(labels.quantity(value, unit, digits)) if np.isfinite(value) else "nan"


def fitting(text: str) -> str:
    """A text as the terminal can show it: units in plain letters where it has no others."""
    if "utf" in (sys.stdout.encoding or "").lower():
        return text
    return text.replace("µ", "u").replace("²", "^2").replace("–", "-").replace("±", "+-")


def counted(ranks: int) -> str:
    """A number of ranks in words."""
    return f"{ranks} rank{'' if ranks == 1 else 's'}"

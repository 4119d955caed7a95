"""How the commands print numbers and remarks: in 80 columns, colours only on a terminal."""

import sys
import textwrap

import click
import numpy as np

from hpcclear.base.plain import plain
from hpcclear.report.figures import labels

WIDTH = 80


def print_remark(label: str, text: str) -> None:
    """Print a text that begins with a label in colour."""
    whole = "\n".join(textwrap.wrap(fitting(plain(f"{label}: {text}")), WIDTH))
    click.echo(click.style(f"{label}:", fg="yellow") + whole.removeprefix(f"{label}:"))


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

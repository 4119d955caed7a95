"""What commands print of results: the first screen of the page, in at most 24 lines of 80 columns; all of them on request."""

import contextlib
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.text import Text

from hpcclear.base.errors import InputError
from hpcclear.cli.options import detailed
from hpcclear.cli.tables import console, table
from hpcclear.cli.terminal import fitting
from hpcclear.ranks.terminal import WIDTH
from hpcclear.report.figures.labels import in_units_of
from hpcclear.report.html.content import Content
from hpcclear.report.html.markup import PageTable
from hpcclear.report.screen import Level, Screen
from hpcclear.report.screens import screen_of
from hpcclear.report.spread import Line
from hpcclear.results import dataset

if TYPE_CHECKING:
    from hpcclear.ensemble.session import Finished

LINES = 24
"""Lines of a terminal, all of a command's answer."""

_COLOURS = {Level.RED: "bold red", Level.AMBER: "yellow", Level.GREEN: "green"}


def describe(content: Content, *written: Path, asked: Sequence[Line] = ()) -> None:
    """Print the first screen of results, with ``--details`` all sections of the page, then the files that were written.

    `asked`: further lines that were requested.
    """
    out, details = console(), detailed()
    files = [f"written  {path}" for path in written if path.exists()]
    more = [line for one in asked for line in _labelled(one.label, one.text)]
    with in_units_of(content.attribute("scene")):
        if (first := screen_of(content)) is not None:
            for line in [*fitted(first, LINES - len(files) - len(more) - 1), *more]:
                out.print(line)
        if details:
            _print_sections(out, content)
    if not details and first is not None and files:
        files[-1] += ("    " if len(files[-1]) < 55 else "\n") + "(--details prints all)"
    for place in files:
        out.print(place, soft_wrap=True)


def _print_sections(out: Console, content: Content) -> None:
    from hpcclear.report.html.page import sections  # loads all that can be printed

    troubles: list[str] = []
    for part, parts in sections(content, troubles):
        out.print(Text(f"\n{part.title}", "bold"))
        for one in parts:
            _print(out, one)
    for text in troubles:
        out.print(text)


def describe_run(found: "Finished", kind: str, asked: Sequence[Line] = ()) -> None:
    """Print what a run on all ranks found, of this kind; `asked` as for `describe`."""
    own = {kind: found.content}
    with contextlib.suppress(InputError):  # it may be written over by another command
        own["timing"] = dataset.read(found.timing, "timing")
    describe(Content(found.output.parent, own), found.output, asked=asked)


def fitted(first: Screen, most: int) -> list[Text]:
    """Return a first screen in at most so many lines; rows of the table go first, then green lines, advice and amber lines."""
    first = first.shown()
    red, amber, _ = ([one.level for one in first.trust].count(level) for level in Level)
    left = {"rows": len(first.rows), "trust": len(first.trust), "steps": min(len(first.steps), 2)}
    order = (
        ("rows", 3), ("trust", max(red + amber, 1)), ("steps", 1), ("trust", max(red, 3)),
        ("steps", 0), ("rows", 1), ("trust", 1),
    )  # fmt: skip
    for part, least in order:
        while len(lines := list(_lines(first, **left))) > most and left[part] > least:
            left[part] -= 1
    return lines[:most]


def _lines(first: Screen, rows: int, trust: int, steps: int) -> Iterator[Text]:
    """The lines of a first screen with so many rows, lines on trust and steps."""
    for line in _wrapped(f"{first.title}: {first.headline}" if first.title else first.headline):
        yield Text(line, "bold")
    if first.doubt:
        yield from (Text(line, "bold red") for line in _wrapped(f"Indicative only: {first.doubt}"))
    yield from map(Text, _wrapped("; ".join(filter(None, first.about))))
    if tables := replace(first, rows=first.rows[:rows]).tables():
        yield Text("")
    for shown in tables:
        yield from _columns(shown)
    if rows < len(first.rows):
        yield Text(f"and {len(first.rows) - rows} more")
    yield Text("")
    for one in first.trust[:trust]:
        label = "trust" if one is first.trust[0] else ""
        lines = _wrapped(fitting(one.text), 14)
        level = f"{one.level.name.lower():6}", _COLOURS[one.level]
        yield Text.assemble(f"{label:6}", level, f"  {lines[0]}")
        yield from (Text(" " * 14 + line) for line in lines[1:])
    for label, text in (("scatter", first.causes), ("note", first.remark)):
        yield from _labelled(label, text)
    for k, text in enumerate(first.steps[:steps]):
        yield from _labelled("" if k else "next", text)


def _labelled(label: str, text: str) -> Iterator[Text]:
    first = f"{label:7} {fitting(text)}"  # a label may be longer
    yield from map(Text, textwrap.wrap(first, WIDTH, subsequent_indent=" " * 8) if text else [])


def _wrapped(text: str, margin: int = 0) -> list[str]:
    return textwrap.wrap(fitting(text), WIDTH - margin)


def _columns(rows: Sequence[Sequence[str]]) -> Iterator[Text]:
    """Rows in columns that fit the terminal; labels that are too long are cut, and lines that still are too long are folded."""
    filled = [[fitting(cell) for cell in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*filled, strict=True)]
    rest = sum(widths[1:]) + 2 * sum(width > 0 for width in widths[1:])
    widths[0] = min(widths[0], max(WIDTH - rest, 24))
    for row in filled:
        row[0] = textwrap.shorten(row[0], widths[0], placeholder="..")
        line = "  ".join(f"{c:{w}}" for c, w in zip(row, widths, strict=True) if w)
        if len(line := line.rstrip()) <= WIDTH:
            yield Text(line)
        else:
            yield from map(Text, textwrap.wrap(line, WIDTH, subsequent_indent="    "))


def _print(out: Console, part: object) -> None:
    """Print a part of a section of the page: a text, a table, text whose lines stay, or parts that are folded there."""
    if isinstance(part, str):
        out.print(fitting(part))
    elif isinstance(part, Mapping):
        for one in part.get("parts", ()):
            _print(out, one)
        if "text" in part:
            out.print(part["text"], soft_wrap=True)
    else:
        assert isinstance(part, PageTable)
        header, *rows = (
            [fitting(str(c["words"] if isinstance(c, Mapping) else c)) for c in row]
            for row in (part.header, *part.rows)
        )
        out.print(table(part.caption, rows, header))

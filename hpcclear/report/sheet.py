"""One sheet of A4 to be signed: the first screen of results, what they rest on and where they come from, as a PDF."""

import base64
import io
import re
from bisect import bisect
from collections.abc import Iterator, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from functools import lru_cache, partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hpcclear.report.figures import labels, style
from hpcclear.report.html import gallery
from hpcclear.report.html.content import Content, read
from hpcclear.report.html.guard import attempt
from hpcclear.report.screen import Level, Screen
from hpcclear.report.screens import screen_of
from hpcclear.results.content import Results

NAME = "sheet.pdf"

WIDTH, HEIGHT, MARGIN = 210.0, 297.0, 13.0
"""A4, mm."""
INNER = WIDTH - 2.0 * MARGIN
POINT = 25.4 / 72.0
"""mm."""
SIZES = (8.0, 7.5, 7.0, 6.5, 6.0)
"""Sizes of the text, pt: the largest that fits."""
TITLE, LEADING = 1.5, 1.3
"""Size of title and headline, and distance of lines, over the size of the text."""
FILLED = 0.99
"""Share of a column that a line fills at most: its words are measured one by one."""
GAP = 4.0
"""Between columns, mm."""
MOST, LONGEST = 110, 2000
"""Rows of a part, and letters of a text, beyond which no sheet has room."""
PICTURES, TALL, LOW = 2, 110.0, 38.0
"""Figures, and bounds of their height with the caption, mm."""
FLOOR = HEIGHT - MARGIN - 14.0
"""Where figures end, above the line for the signature, mm."""
_MARKS = {Level.RED: "■ red", Level.AMBER: "▲ amber", Level.GREEN: "● green"}
_COLOURS = {Level.RED: "#a33c00", Level.AMBER: "#8a5a00", Level.GREEN: "#00694a"}
_SOFT = "#57606a"
_HEAD = ("machine", "author", "revision", "date of the data")


class SheetContent(NamedTuple):
    """What stands on a sheet."""

    screen: Screen
    origin: tuple[tuple[str, str], ...]
    """Author, revision, machine, date of the data, hash of the inputs, software, processor: as far as they are known."""
    assumptions: tuple[str, ...]
    limits: tuple[str, ...]
    """What the numbers are valid for."""
    pictures: tuple[tuple[bytes, str], ...] = ()
    """PNG and caption of each figure."""

    @property
    def who(self) -> list[str]:
        """What a head says beside the title."""
        return [f"{label} {text}" for label, text in self.origin if label in _HEAD]


def write_sheet(
    *places: str | Path, output: str | Path | None = None, troubles: list[str] | None = None
) -> Path:
    """Write a sheet (sheet.pdf) from result files; equal files of one day give equal bytes.

    Arguments and errors as of `hpcclear.report.html.page.write_report`; the output ends in ``.pdf``, ``.svg`` or ``.png``.
    """
    style.matplotlib()
    content, troubles = read(*places), [] if troubles is None else troubles
    troubles += content.troubles
    sheet = sheet_of(content, attempt("The first screen", partial(screen_of, content), troubles))
    wanted = (*sheet.screen.figures, gallery.MECHANISM)
    drawn = gallery.figures(content, troubles, wanted, PICTURES)
    shown = (one for one in drawn if one["subject"] != "reproduce")  # run times
    made = tuple((base64.b64decode(one["png"]), one["caption"]) for one in shown)
    figure = draw(sheet._replace(pictures=made))
    return style.save(figure, content.directory / NAME if output is None else output)


def sheet_of(content: Content, screen: Screen | None) -> SheetContent:
    """Return what stands on the sheet of results, without its figures."""
    date, about = "", content.attribute
    if np.isfinite(content.dated):
        date = f"{datetime.fromtimestamp(content.dated, UTC):%Y-%m-%d}"
    origin = {
        "machine": about("about_machine"),
        "author": about("about_author"),
        "revision": about("about_revision"),
        "date of the data": date,
        "inputs": about("scene_hash") and f"SHA-256 {about('scene_hash')}",
        "software": "; ".join(filter(None, map(about, ("source", "versions")))),
        "processor": about("processor"),
    }
    first = screen or Screen("Not all results have a first screen")
    title = about("about_title") or f"Results in {content.directory.resolve().name}"
    return SheetContent(
        replace(first, title=title),
        tuple((label, text) for label, text in origin.items() if text),
        tuple(_assumptions(content)),
        (*(f"{text}." for text in first.limits), *_limits(content)),
    )


def _assumptions(content: Content) -> Iterator[str]:
    scene = content.scene
    if scene is None:
        yield "Not known: this version cannot read the scene of the files."
        return
    effects = "; ".join(scene.effects_on()) or "nothing else"
    yield f"Planar motion of rigid bodies, with {effects}. Other effects are neglected."
    random = (*scene.study.random, *scene.study.worn) if scene.study is not None else ()
    words = [
        f"{row.name} {row.shape_words}, after {row.cycles:g} revolutions"
        if row.cycles is not None
        else f"{row.name} {row.shape_words}, {labels.between(*row.span, '1' if row.relative else scene.unit(row.paths[0]))}"
        + ("" if row.absolute else f" {'of' if row.relative else 'about'} the design")
        for row in random
    ]
    if words:
        yield f"Random inputs: {'; '.join(words)}."


def _limits(content: Content) -> Iterator[str]:
    yield "No interval covers the difference between model and machine."
    if (scene := content.scene) is None:
        return
    verified = content.files.get("verification", Results({}))
    names, words = {one.name for one in labels.design_variables(verified)}, []
    for one in scene.study.variables if scene.study is not None else ():
        if one.name in names and not one.rows:
            end, unit = ("_ratio", "1") if one.ratio else ("", one.unit)
            words.append(f"{one.name}{end} {labels.between(*one.bounds, unit)}")
    if words:
        yield f"Designs were searched within {'; '.join(words)}."
    yield from scene.warnings


class _Cell(NamedTuple):
    """A text in a row."""

    text: str
    colour: str = "#1b1f23"
    bold: bool = False
    scale: float = 1.0
    """Of its size."""


Placed = list[tuple[float, float, float, str, _Cell]]
"""Lines of text: place from the upper left corner, mm, size, text and look."""


def _blocks(sheet: SheetContent) -> list[list[list[_Cell]]]:
    """The parts of the sheet in rows of cells; a row of one cell has the whole width."""
    first = sheet.screen
    head = [
        _Cell(first.title, bold=True, scale=TITLE), _Cell("; ".join(sheet.who), _SOFT),
        _Cell(first.headline, bold=True, scale=TITLE),
        _Cell(first.doubt and f"Indicative only: {first.doubt}.", _COLOURS[Level.RED], bold=True),
        _Cell("; ".join(filter(None, first.about)), _SOFT),
    ]  # fmt: skip
    tables = [[[*map(_Cell, row)] for row in rows] for rows in first.tables()]
    for rows in tables:
        rows[0] = [one._replace(colour=_SOFT) for one in rows[0]]
    marks = (_Cell(_MARKS[one.level], _COLOURS[one.level], bold=True) for one in first.trust)
    rest = [(label, text) for label, text in sheet.origin if label not in _HEAD]
    parts = {
        "What to trust": [[m, _Cell(one.text)] for m, one in zip(marks, first.trust, strict=True)],
        "Remarks": [[_Cell(text)] for text in (first.remark, first.causes) if text],
        "Assumptions": [[_Cell(text)] for text in sheet.assumptions],
        "Limits": [[_Cell(text)] for text in sheet.limits],
        "Origin": [[_Cell(label, _SOFT), _Cell(text)] for label, text in rest],
    }
    named = [[[_Cell(name, bold=True)], *rows] for name, rows in parts.items() if rows]
    return [[[cell] for cell in head if cell.text], *tables, *named]


def _placed(
    blocks: Sequence[list[list[_Cell]]], shown: Sequence[int], size: float
) -> tuple[Placed, float]:
    """So many rows of each block below each other, every text wrapped to its column; and where they end."""
    placed, y = Placed(), MARGIN
    for block, most in zip(blocks, shown, strict=True):
        rows, left = block[:most], len(block) - most
        rows += [[_Cell(f"and {left} more, on the page of these results", _SOFT)]] if left else []
        wide = [row for row in rows if len(row) > 1]
        lengths = [[_length(one) * size * POINT / FILLED for one in row] for row in wide]
        natural = [max(column) for column in zip(*lengths, strict=True)]
        columns = _fitted(natural, INNER - GAP * (len(natural) - 1))
        for row in rows:
            x, top = MARGIN, y
            for cell, width in zip(row, columns if len(row) > 1 else [INNER], strict=True):
                step = LEADING * cell.scale * size * POINT
                lines, own = _wrapped(cell, width, size), cell.scale * size
                placed += [(x, top + k * step, own, line, cell) for k, line in enumerate(lines)]
                y, x = max(y, top + len(lines) * step), x + width + GAP
        y += 0.5 * size * POINT
    return placed, y


def _fitting(sheet: SheetContent) -> tuple[Placed, float]:
    """All text in its place, as large as it may be; where even the smallest is too much, the longest parts are cut."""
    blocks, room = _blocks(sheet), FLOOR - (LOW if sheet.pictures else 0.0)
    shown = [min(len(block), MOST) for block in blocks]
    for size in SIZES:
        placed, y = _placed(blocks, shown, size)
        if y <= room:
            return placed, y
    while y > room and max(shown[1:]) > 1:
        shown[1 + int(np.argmax(shown[1:]))] -= 1
        placed, y = _placed(blocks, shown, SIZES[-1])
    return placed, y


def _fitted(widths: Sequence[float], room: float) -> list[float]:
    """Widths, the widest narrowed alike until all fit."""
    left, rest = room, len(widths)
    for width in sorted(widths):
        if width * rest > left:
            return [min(one, left / rest) for one in widths]
        left, rest = left - width, rest - 1
    return list(widths)


@lru_cache(maxsize=4096)
def _width(text: str, bold: bool) -> float:
    """Width over size of a text in one line."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    look = FontProperties(family="DejaVu Sans", weight="bold" if bold else "normal", size=100)
    return float(text_to_path.get_text_width_height_descent(text, look, False)[0]) / 100


@lru_cache(maxsize=1024)
def _words(text: str) -> list[str]:
    """Words of a text in letters that the font has; a non-breaking space divides none."""
    from matplotlib.font_manager import findfont, get_font

    font = get_font(findfont("DejaVu Sans"))
    words = re.split(r"[ \t\n]+", text[:LONGEST].strip())
    return ["".join(c if font.get_char_index(ord(c)) else "?" for c in word) for word in words]


def _length(cell: _Cell) -> float:
    """Width over size of a cell's text in one line."""
    return _width(" ".join(_words(cell.text)), cell.bold) * cell.scale


def _wrapped(cell: _Cell, width: float, size: float) -> list[str]:
    """Lines no wider than `width`; a word that is wider is broken."""
    room = FILLED * width / (cell.scale * size * POINT)
    lines, line, free = list[str](), "", room
    for word in _words(cell.text):
        need = _width(f" {word}", cell.bold) if line else _width(word, cell.bold)
        if need <= free:
            line, free = f"{line} {word}" if line else word, free - need
            continue
        lines += [line] if line else []
        while len(word) > 1 and _width(word, cell.bold) > room:
            ends = [word[:n] for n in range(1, len(word))]
            cut = max(bisect(ends, room, key=partial(_width, bold=cell.bold)), 1)
            lines, word = [*lines, word[:cut]], word[cut:]
        line, free = word, room - _width(word, cell.bold)
    return [*lines, line]


def draw(sheet: SheetContent) -> "style.Figure":
    """Return the sheet as a figure of the size of A4."""
    from matplotlib.figure import Figure
    from matplotlib.image import imread
    from matplotlib.lines import Line2D

    placed, top = _fitting(sheet)
    figure = Figure(figsize=(WIDTH / 25.4, HEIGHT / 25.4), dpi=300)
    width, step = (INNER - GAP) / PICTURES, LEADING * SIZES[-1] * POINT
    for k, (png, caption) in enumerate(sheet.pictures):
        lines, x = _wrapped(_Cell(caption), width, SIZES[-1]), MARGIN + k * (width + GAP)
        image = imread(io.BytesIO(png))
        room = min(TALL, FLOOR - top) - 1.0 - len(lines) * step
        scale = min(width / image.shape[1], room / image.shape[0])
        wide, high = scale * image.shape[1], scale * image.shape[0]
        box = x / WIDTH, 1.0 - (top + high) / HEIGHT, wide / WIDTH, high / HEIGHT
        axes = figure.add_axes(box)
        axes.imshow(image, aspect="auto", interpolation="none")
        axes.set_axis_off()
        y, soft = top + high + 1.0, _Cell("", _SOFT)
        placed += [(x, y + step * n, SIZES[-1], line, soft) for n, line in enumerate(lines)]
    for k, word in enumerate(("Name", "Date", "Signature")):
        x = MARGIN + k * (INNER + GAP) / 3.0
        ends, height = [x / WIDTH, (x + (INNER - 2.0 * GAP) / 3.0) / WIDTH], MARGIN + 3.5
        figure.add_artist(Line2D(ends, [height / HEIGHT] * 2, color=_SOFT, linewidth=0.6))
        placed.append((x, HEIGHT - height + 0.5, SIZES[-1], word, _Cell("", _SOFT)))
    for x, y, size, text, cell in placed:
        figure.text(
            x / WIDTH, 1.0 - y / HEIGHT, text, va="top", fontsize=size, color=cell.colour, fontfamily="DejaVu Sans",
            fontweight="bold" if cell.bold else "normal", parse_math=False,
        )  # fmt: skip
    return figure

"""What users read is in plain words, the field's terms, in short sentences: pages, help, messages, docstrings, attributes.

Code, inline code, text in quotation marks and quoted answers of a study are left out: they stay as the program prints them.
"""

import ast
import functools
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest
from doc_pages import ROOT, tokens

from hpcclear.base.objectives import ORDINALS
from hpcclear.cli import cli
from hpcclear.results.names import KINDS

FILES = (
    "README.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    *sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / "docs").rglob("*.md")),
)
"""Every page."""

INSTEAD = {
    r"tells?|told|telling": "report, state, print; statistically indistinguishable",
    r"plays?": "clearance",
    r"limits": "confidence interval, bounds, threshold",
    r"(?<!standard )(?<!std\. )(?<!limit )(?<!fundamental )deviations?(?! A to H)": "standard deviation, difference",
    r"kick(s|ed|ing)?|a hair": "perturbation, perturbed run",
    r"true (mean|dynamics|deviation|values?)|directly simulated": "simulated, by simulation",
    r"scramblings?": "randomised-QMC replicate",
    r"asked|asks?": "required, requested, target",
    r"(?<!service )(?<!wear )lives(?= of)": "service lives",
    r"latched": "uses the last impact velocity",
    r"abreast|side by side|(in )?lockstep": "batched, SIMD lanes",
    r"torn|folds? flat": "change point, dead centre, singular configuration",
    r"ledgers?|books": "energy balance, accumulated work",
    r"desks?|crews?|naps?": "worker, node group, back-off",
    r"rungs?": "tolerance level",
    r"certificates?": "effect screening",
    r"goals?": "objective, constraint",
    r"(the )?original('s)?": "baseline design",
    r"mind|note well": "warning",
    r"nought|none of": "zero, no",
    r"moments? of the drive|crank moment": "torque",
    r"rooms?|houses?|floors?|doors?": "package, layer, lower bound, public API",
    r"stretch(es)?": "interval, window",
    r"creeping|short of breath|root deaf|loneliest": "no personification",
    r"dear(er|est)?|surely": "expensive, significantly",
    r"carr(y|ies) (a|the) (whole )?study|at hand": "run a study, available",
    r"what matters": "sensitivity",
}
"""Words that must not stand in prose, as expressions of whole words, and what to write instead."""

ALLOWED = (
    "room within the allowed values",  # space
    "limits of size",  # of a fit
    "[study.certificate]",  # an entry
    "or cannot be told (undecided)",  # a word of the file
    "The play of a joint",  # for those who search for it
)
"""Phrases in which such a word has its everyday meaning."""

LONGEST = 30
"""Words of a sentence must be fewer."""


class Passage(NamedTuple):
    """A paragraph, item, heading or cell without its code."""

    line: int
    cell: bool
    text: str


def passages(name: str) -> Iterator[Passage]:
    """Prose of a page; tables without headings quote what a study answers and are left out."""
    found = tokens(ROOT / name)
    line, quoted = 0, False
    for number, token in enumerate(found):
        line = token.map[0] + 1 if token.map else line
        if token.type == "table_open":
            row = [one.content for one in found[number : number + 12] if one.type == "inline"]
            quoted = row[0] == ""
        elif token.type == "table_close":
            quoted = False
        elif token.type == "inline" and not quoted:
            parts = (_plain(child) for child in token.children or ())
            cell = found[number - 1].type in ("td_open", "th_open")
            yield Passage(line, cell, " ".join("".join(parts).split()))


def _plain(token) -> str:
    """Text of a token; a code stands as one letter, for it counts as one word."""
    kinds = {"text": token.content, "image": token.content, "code_inline": "x", "softbreak": " "}
    return kinds.get(token.type, "")


def without_quotations(text: str) -> str:
    """Text without what stands in quotation marks and without allowed phrases."""
    for phrase in ALLOWED:
        text = re.sub(re.escape(phrase), "", text, flags=re.I)
    return re.sub(r'"[^"]*"', '""', text)


ANY = re.compile("|".join(f"(?:{words})" for words in INSTEAD), re.I)


def private_words(text: str) -> Iterator[tuple[str, str]]:
    """Words of a text that are not the field's, with what to write instead."""
    for words, instead in INSTEAD.items() if ANY.search(text) else ():
        for match in re.finditer(
            rf"(?<![\w-])(?:{words})(?![\w-])", without_quotations(text), re.I
        ):
            yield match[0], instead


def sentences(text: str) -> list[str]:
    """Sentences of a paragraph; what introduces a list is one of its own."""
    return re.split(r"(?<=[.!?])\s+(?=\W*[A-Z0-9x])", text)


@pytest.mark.parametrize("name", FILES)
def test_a_page_has_the_fields_words(name):
    found = [
        f"{name}:{passage.line}: {word!r}; write: {instead}"
        for passage in passages(name)
        for word, instead in private_words(passage.text)
    ]
    assert not found, "\n".join(found)


@pytest.mark.parametrize("name", FILES)
def test_sentences_of_a_page_are_short(name):
    found = [
        f"{name}:{passage.line}: {len(sentence.split())} words: {sentence}"
        for passage in passages(name)
        if name == "README.md" or not passage.cell
        for sentence in sentences(passage.text)
        if len(sentence.split()) >= LONGEST
    ]
    assert not found, "\n".join(found)


NUMBER = re.compile(r"[+-]?\d[\d ., ]*(e[+-]?\d+)?( (to|and) [+-]?[\d.]+(e[+-]?\d+)?)?")

UNITS = re.compile(
    r"\((m|s|ms|h|N|mm|kg|Pa|deg)\b|\bdB\b|, s;|seconds|dimensionless|\bunit\b|relative|ratio|divided by|times|"
    r"count|lines|number|errors?\b|share|exit code|efficiency|speed-up|impacts|intervals|instructions|version|Python|factor",
    re.I,
)
"""What states the unit of a column of numbers, or that they have none."""


def tables(name: str) -> Iterator[tuple[int, str, list[list[str]]]]:
    """Tables of a page: line, the text before it, and rows of cells, the headings first."""
    before, rows = "", []
    for number, token in enumerate(found := tokens(ROOT / name)):
        if token.type == "table_open":
            line, rows = token.map[0] + 1, []
        elif token.type == "tr_open":
            rows.append([])
        elif token.type == "inline" and found[number - 1].type in ("td_open", "th_open"):
            rows[-1].append(token.content)
        elif token.type == "inline":
            before = token.content
        elif token.type == "table_close":
            yield line, before, rows


@pytest.mark.parametrize("name", FILES)
def test_numbers_in_tables_have_a_unit(name):
    """In the cell, in the heading of the column or the row, or in the text before the table."""
    found = [
        f"{name}:{line}: {row[k]!r} of {row[0]!r} in {heading!r}"
        for line, before, (head, *rows) in tables(name)
        for k, heading in enumerate(head[1:], 1)
        for row in rows
        if k < len(row) and NUMBER.fullmatch(row[k]) and head[0] != "entry"
        if not UNITS.search(f"{heading}; {row[0]}; {before}")
    ]
    assert not found, "\n".join(found)


def help_passages() -> Iterator[tuple[str, str]]:
    """Prose of the help of every command, with the command's name; examples and metavariables are left out."""
    for name, command in [("hpcclear", cli), *cli.every().items()]:
        texts = (command.help or "").split("\n\n")
        yield from ((name, " ".join(text.split())) for text in texts if "xample:" not in text)
        yield from ((name, command.short_help or ""),)
        for option in command.params:
            yield name, getattr(option, "help", None) or ""


def test_help_of_commands_has_the_fields_words_and_short_sentences():
    found = []
    for name, text in help_passages():
        found += [f"{name}: {word!r}; write: {instead}" for word, instead in private_words(text)]
        found += [f"{name}: {one}" for one in sentences(text) if len(one.split()) >= LONGEST]
    assert not found, "\n".join(found)


PACKAGE = ROOT / "hpcclear"

STORED = (
    "cannot be told", "deviation of f", "mean, deviation", "mean deviation", "deviation half_width", "deviation = ",
    "mean and deviation", "crank moment", "{} original",
)  # fmt: skip
"""Words of files, of parameters and of the paper, which stand in the source as they are."""

METHODS = (
    "let ask() return",
    "ask() and tell",
    "failed in ask",
    "failed in tell",
    "as ask() returned",
    "notify instead of tell",
)
"""The methods of a search as a plug-in, and former names."""

NO_PROSE = ("base/width.py", "dynamics/linkage/compiled.py")
"""Modules whose long strings are source text."""

DOCSTRINGS = (
    "accuracy", "base", "cli", "dynamics", "ensemble", "identify", "plugins", "ranks", "report", "results", "scene",
    "statistics", "study",
)  # fmt: skip
"""Packages, all of them."""


@functools.cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def _docstrings(path: Path) -> list[ast.Constant]:
    """Strings that stand alone: docstrings of modules, classes, functions and attributes."""
    return [
        node.value
        for node in ast.walk(tree(path))
        if isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    ]


def messages() -> Iterator[tuple[str, str]]:
    """Every text with a space in the package that is no docstring, with its place: errors, warnings, output, attributes.

    A value that is put into a text stands as ``{}``.
    """
    for path in sorted(PACKAGE.rglob("*.py")):
        if path.relative_to(PACKAGE).as_posix() in NO_PROSE:
            continue
        skipped = {id(one) for one in _docstrings(path)}
        for node in ast.walk(tree(path)):
            if isinstance(node, ast.JoinedStr):
                skipped |= {id(inner) for inner in ast.walk(node) if inner is not node}
        for node in ast.walk(tree(path)):
            if id(node) not in skipped and " " in (text := _text(node)).strip():
                yield f"{path.relative_to(ROOT)}:{node.lineno}", text


def _text(node: ast.AST) -> str:
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        parts = (one.value if isinstance(one, ast.Constant) else "{}" for one in node.values)
        return "".join(parts)
    return ""


def test_messages_have_the_fields_words_and_short_sentences():
    found, count = [], 0
    for place, text in messages():
        count += 1
        text = re.sub("`[^`]*`", "x", text)
        for known in (*STORED, *METHODS):
            text = re.sub(re.escape(known), "x", text, flags=re.IGNORECASE)
        found += [f"{place}: {word!r} in {text!r}" for word, _ in private_words(text)]
        if "\n" not in text:  # a source or a file
            long = [one for one in sentences(text) if len(one.split()) >= LONGEST]
            found += [f"{place}: long: {one}" for one in long]
    assert count > 2000
    assert not found, "\n".join(found)


def prose(docstring: str) -> Iterator[str]:
    """Paragraphs of a docstring without code, rulers of sections, and names of parameters with their types."""
    for paragraph in re.split(r"\n\s*\n", docstring):
        lines = [
            line for line in paragraph.splitlines() if not re.match(r"\s*([\w, *]+ : |-+$)", line)
        ]
        text = " ".join(" ".join(lines).split())
        yield re.sub(r"``[^`]*``|`[^`]*`", "x", text)


@pytest.mark.parametrize("package", DOCSTRINGS)
def test_docstrings_have_the_fields_words(package):
    found, count = [], 0
    for path in sorted((PACKAGE / package).rglob("*.py")):
        for one in _docstrings(path):
            for text in prose(one.value):
                count += 1
                found += [
                    f"{path.relative_to(ROOT)}:{one.lineno}: {word!r} in {text!r}"
                    for word, _ in private_words(text)
                ]
    assert count > 10
    assert not found, "\n".join(found)


def test_attributes_of_file_variables_have_the_fields_words_and_axes_their_units():
    found = []
    for kind, table in KINDS.items():
        for name, row in {**table.coords, **table.data}.items():
            text = re.sub("cannot be told", "x", row.long_name)
            found += [f"{kind}.{name}: {word!r}" for word, _ in private_words(text)]
            if row.dtype == "f8":
                assert (
                    row.units
                    or name.split("_")[0] in ORDINALS
                    or name.startswith("searched_")
                    or row.long_name.endswith("in the unit beside it")
                ), name
    assert not found, "\n".join(found)


def test_every_axis_of_a_figure_has_a_unit():
    """A label in the source of the figures ends with a unit in brackets, "(–)" for none, unless it is put together."""
    found = []
    for path in sorted((PACKAGE / "report" / "figures").glob("*.py")):
        for node in ast.walk(tree(path)):
            name = (
                node.func.attr
                if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)
                else ""
            )
            if name in ("set_xlabel", "set_ylabel", "supylabel") and isinstance(
                node.args[0], ast.Constant
            ):
                label = node.args[0].value
                if label and not re.search(r"\([^()]+\)$", label):
                    found.append(f"{path.name}:{node.lineno}: {label!r}")
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("The play is told with its limits.", ["told", "play", "limits"]),
        ('The standard deviation (printed as "deviation") is displayed.', []),
        ("Mean and deviation of kicked copies", ["deviation", "kicked"]),
    ],
)
def test_private_words_are_found(text, expected):
    assert [word for word, _ in private_words(text)] == expected

"""What users read is in plain words: the field's terms, and short sentences.

Code, inline code, text in quotation marks and quoted answers of a study are left out: they stay as the program prints them.
"""

import re
from collections.abc import Iterator
from typing import NamedTuple

import pytest
from doc_pages import ROOT, tokens

from hpcclear.cli import cli

FILES = (
    "README.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "docs/adding-an-effect.md",
    "docs/architecture.md",
    "docs/extending.md",
    "docs/glossary.md",
    "docs/index.md",
    "docs/performance.md",
    "docs/questions.md",
    "docs/reading-the-accuracy-figure.md",
    "docs/tutorial.md",
    "docs/validation.md",
    "docs/how-to/accuracy.md",
    "docs/how-to/archive.md",
    "docs/how-to/chaos.md",
    "docs/how-to/cluster.md",
    "docs/how-to/contact-law.md",
    "docs/how-to/designs.md",
    "docs/how-to/distribution.md",
    "docs/how-to/editor-and-shell.md",
    "docs/how-to/effects.md",
    "docs/how-to/elastic-rod.md",
    "docs/how-to/gallery.md",
    "docs/how-to/linkage.md",
    "docs/how-to/mechanism.md",
    "docs/how-to/objective.md",
    "docs/how-to/oil-film.md",
    "docs/how-to/resume.md",
    "docs/how-to/speeds.md",
    "docs/how-to/stick-slip.md",
    "docs/how-to/surrogates.md",
    "docs/how-to/take-results-away.md",
    "docs/how-to/wear.md",
    "docs/how-to/xarray.md",
)
"""Pages that have been rewritten. Add a page here once it has been."""

INSTEAD = {
    r"tells?|told|telling": "report, state, print; statistically indistinguishable",
    r"plays?": "clearance",
    r"limits": "confidence interval, bounds, threshold",
    r"(?<!standard )(?<!std\. )deviations?": "standard deviation, difference",
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
        text = text.replace(phrase, "")
    return re.sub(r'"[^"]*"', '""', text)


def private_words(text: str) -> Iterator[tuple[str, str]]:
    """Words of a text that are not the field's, with what to write instead."""
    for words, instead in INSTEAD.items():
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


def help_passages() -> Iterator[tuple[str, str]]:
    """Prose of the help of every command, with the command's name; examples and metavariables are left out."""
    for name, command in [("hpcclear", cli), *cli.commands.items()]:
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

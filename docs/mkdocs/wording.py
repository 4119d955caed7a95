"""Print words that are not the field's, long sentences, and numbers without a unit: a warning of tests/run.sh, no test.

    python docs/mkdocs/wording.py           # pages, help, messages, docstrings, attributes of files; exit code 1 if any
    python docs/mkdocs/wording.py README.md # these pages alone

Code, inline code, text in quotation marks and quoted answers of a study are left out: they stay as the program prints them.
"""

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from markdown_it import MarkdownIt

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "hpcclear"

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
"""Words that do not stand in prose, as expressions of whole words, and what to write instead."""
ANY = re.compile("|".join(f"(?:{words})" for words in INSTEAD), re.I)

ALLOWED = (
    "room within the allowed values", "limits of size", "[study.certificate]", "or cannot be told (undecided)",
    "The play of a joint", "cannot be told", "deviation of f", "mean, deviation", "mean deviation",
    "deviation half_width", "deviation = ", "mean and deviation", "crank moment", "{} original",
    "let ask() return", "ask() and tell", "failed in ask", "failed in tell", "as ask() returned", "notify instead of tell",
)  # fmt: skip
"""Phrases with such a word in its everyday meaning, and words of files, of the paper and of plug-ins."""

LONGEST = 30
"""Words of a sentence are fewer."""

NUMBER = re.compile(r"[+-]?\d[\d ., ]*(e[+-]?\d+)?( (to|and) [+-]?[\d.]+(e[+-]?\d+)?)?")
UNITS = re.compile(
    r"\((m|s|ms|h|N|mm|kg|Pa|deg)\b|\bdB\b|, s;|seconds|dimensionless|\bunit\b|relative|ratio|divided by|times|"
    r"count|lines|number|errors?\b|share|exit code|efficiency|speed-up|impacts|intervals|instructions|version|Python|factor",
    re.I,
)
"""What states the unit of a column of numbers, or that they have none."""


def faults(place: str, text: str, long: bool = True) -> Iterator[str]:
    """Words of a text that are not the field's, and its long sentences."""
    for phrase in ALLOWED:
        text = re.sub(re.escape(phrase), "x", text, flags=re.I)
    text = re.sub(r'"[^"]*"', '""', text)
    for words, instead in INSTEAD.items() if ANY.search(text) else ():
        for match in re.finditer(rf"(?<![\w-])(?:{words})(?![\w-])", text, re.I):
            yield f"{place}: {match[0]!r}; write: {instead}"
    for sentence in re.split(r"(?<=[.!?])\s+(?=\W*[A-Z0-9x])", text) if long else ():
        if len(sentence.split()) >= LONGEST:
            yield f"{place}: {len(sentence.split())} words: {sentence}"


def plain(token: Any) -> str:
    """Text of a token; a code stands as one letter, for it counts as one word."""
    kinds = {"text": token.content, "image": token.content, "code_inline": "x", "softbreak": " "}
    return kinds.get(token.type, "")


def page(path: Path) -> Iterator[str]:
    """Faults of a page; tables without headings quote what a study answers, their words are left out."""
    tokens = MarkdownIt("commonmark").enable("table").parse(path.read_text(encoding="utf-8"))
    name, line, before, rows = str(path.relative_to(ROOT)), 0, "", None
    for number, token in enumerate(tokens):
        line = token.map[0] + 1 if token.map else line
        if token.type == "table_open":
            rows = []
        elif token.type == "tr_open":
            rows.append([])
        elif token.type == "table_close":
            yield from (f"{name}:{line}: {fault}" for fault in without_unit(before, rows))
            rows = None
        elif token.type == "inline":
            cell = tokens[number - 1].type in ("td_open", "th_open")
            if cell:
                rows[-1].append(token.content)
            else:
                before = token.content
            if rows is None or rows[0][0]:
                text = " ".join("".join(map(plain, token.children or ())).split())
                yield from faults(f"{name}:{line}", text, name == "README.md" or not cell)


def without_unit(before: str, rows: list[list[str]]) -> Iterator[str]:
    """Numbers of a table whose unit stands neither in the heading, the row nor the text before the table."""
    head = rows[0]
    for row in rows[1:] if head[0] != "entry" else ():
        for heading, cell in zip(head[1:], row[1:], strict=False):
            if NUMBER.fullmatch(cell) and not UNITS.search(f"{heading}; {row[0]}; {before}"):
                yield f"{cell!r} of {row[0]!r} in {heading!r} has no unit"


def source(path: Path) -> Iterator[str]:
    """Faults of a module: its docstrings, and every other text with a space, in which a value stands as ``{}``."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    alone = {
        id(node.value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    }
    inside = {
        id(inner)
        for node in ast.walk(tree)
        if isinstance(node, ast.JoinedStr)
        for inner in ast.walk(node)
        if inner is not node
    }
    for node in ast.walk(tree):
        if id(node) in inside:
            continue
        place, text = f"{path.relative_to(ROOT)}:{getattr(node, 'lineno', 0)}", ""
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            text = node.value
        elif isinstance(node, ast.JoinedStr):
            text = "".join(p.value if isinstance(p, ast.Constant) else "{}" for p in node.values)
        if id(node) in alone:
            for paragraph in re.split(r"\n\s*\n", text):
                lines = [
                    one
                    for one in paragraph.splitlines()
                    if not re.match(r"\s*([\w, *]+ : |-+$)", one)
                ]
                prose = re.sub(r"``[^`]*``|`[^`]*`", "x", " ".join(" ".join(lines).split()))
                yield from faults(place, prose, long=False)
        elif " " in text.strip():
            yield from faults(place, re.sub("`[^`]*`", "x", text), long="\n" not in text)


def commands() -> Iterator[str]:
    """Faults of the help of every command, which its docstrings hold in part only."""
    from hpcclear.cli import cli

    for name, command in [("hpcclear", cli), *cli.commands.items()]:
        texts = [text for text in (command.help or "").split("\n\n") if "xample:" not in text]
        texts += [getattr(option, "help", None) or "" for option in command.params]
        for text in texts:
            yield from faults(f"hpcclear {name} --help", " ".join(text.split()))


def main() -> int:
    """Print all faults; 1 if there is any."""
    pages = [Path(word).resolve() for word in sys.argv[1:]]
    found: list[str] = []
    if not pages:
        pages = [ROOT / f"{name}.md" for name in ("README", "CHANGELOG", "CONTRIBUTING")]
        pages += sorted((ROOT / "docs").rglob("*.md"))
        modules = [
            path
            for path in sorted(PACKAGE.rglob("*.py"))
            if path.name not in ("width.py", "compiled.py")
        ]  # those hold source text
        found += [fault for path in modules for fault in source(path)]
        found += commands()
    found = [fault for path in pages for fault in page(path)] + found
    print("\n".join(dict.fromkeys(found)))
    return bool(found)


if __name__ == "__main__":
    sys.exit(main())

"""One HTML file about a directory of results: works offline, loads nothing from the network, prints and tabs well."""

import base64
import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from hpcclear.base.errors import InputError
from hpcclear.report.answer import answer
from hpcclear.report.figures.labels import in_units_of
from hpcclear.report.html import gallery, picture
from hpcclear.report.html.content import Content, read
from hpcclear.report.html.guard import attempt
from hpcclear.report.html.markup import PageTable, asset, render
from hpcclear.report.merit import role
from hpcclear.report.parts import SectionOf, declared
from hpcclear.report.screen import WORRIES, Screen, upper
from hpcclear.report.screens import screen_of
from hpcclear.report.sheet import sheet_of
from hpcclear.results import files
from hpcclear.results.names import KINDS

NAME = "report.html"
_MARK = b'<meta name="generator" content="hpcclear">'  # also stands in the template

SUBJECTS = {
    "lives": ("Service lives", "lives, clearances, causes"),
    "identify": ("Identified machine", "unknowns, growth, what to measure"),
    "designs": ("All designs", "simulated with intervals, fronts"),
    "bearings": ("Bearings", "forces, contact, impacts, noise"),
    "sensitivities": ("Sensitivities and surrogates", "contributions, Sobol indices, slopes, fits"),
    "effects": ("Effects", "change and run time of each"),
    "accuracy": ("Accuracy and run time", "sources of error, cheapest settings"),
    "quality": ("Accuracy and data quality", "statistics, chaos, failures, warnings"),
    "paper": ("Comparison with the paper", "claims, Table 4, readings"),
    "reproduce": ("How to reproduce", "scene, versions, processor, run time, what is missing"),
}
"""Subjects of the page in their order: title, and what is inside."""


class Subject(NamedTuple):
    """A folded part of the page."""

    name: str
    title: str
    hint: str
    sections: list[tuple[str, str, Sequence[object]]]
    """Name, title and parts of each section."""
    figures: list[dict[str, str]]


def write_report(
    *places: str | Path, output: str | Path | None = None, troubles: list[str] | None = None
) -> Path:
    """Write a page from the result files in a directory, or from chosen ones; what is missing in a directory is said on the
    page.

    `places`: a directory with any of the files of `run`, `sample`, `accuracy` and `simulate`, or files of theirs; `output`: the
    page, by default report.html in the directory, or in that of the first file; `troubles`: a list that takes a sentence on
    each file or part that was left out. Returns the page. Raises InputError: no such directory, no result in it, a chosen file
    that is none, matplotlib missing, or no permission to write. Raises StorageError: the disk is full or fails.
    """
    content, troubles = read(*places), [] if troubles is None else troubles
    path = content.directory / NAME if output is None else Path(output)
    if path.suffix.lower() not in (".html", ".htm"):
        raise InputError("output", str(path), "a page is html", "End the name in .html")
    with in_units_of(content.attribute("scene")):
        files.write_bytes(path, _page(content, troubles).encode(), _MARK)
    return path


def _page(content: Content, troubles: list[str]) -> str:
    """The whole document."""
    troubles += content.troubles
    # as text, also where it is none in this system's encoding
    place = content.directory.resolve().name.encode("utf-8", "replace").decode()

    def drawn_by_script() -> dict[str, Any]:
        made = picture.picture(content)
        json.dumps(made, allow_nan=False)  # whether JSON can say it: it knows no NaN
        return made

    shown = attempt("What the page's script draws", drawn_by_script, troubles)
    opened = attempt("The first screen", partial(screen_of, content), troubles)
    first = opened or Screen(f"Results in {place}")
    wide = {*first.figures} & {*gallery.WIDE}
    drawn = gallery.figures(content, troubles, wide=wide)
    still = next((one for one in drawn if one["name"] == gallery.MECHANISM), None)
    points = bool(shown and shown["front"]["points"])
    beside = [name for name in first.figures if name != "front" or not points]
    folded = [one for one in drawn if one is not still]
    subjects = _subjects(content, folded, beside, troubles)
    return render(
        "page.html",
        title=first.title or f"Report on {place}",
        sheet=sheet_of(content, first),
        policy=_policy(),
        style=asset("page.css"),
        script=asset("page.js"),
        picture=shown or {"front": {"points": []}, "responses": {}, "motions": {}},
        source=content.attribute("source") or "hpcclear",
        screen=first.shown(),
        further=first.trust[WORRIES:],
        spans=any(row.span for row in first.rows),
        still=still,
        motions=bool(shown and shown["motions"]),
        points=points,
        anchors=[one.name for one in subjects],
        beside=[one for one in drawn if one["name"] in first.figures],
        wide=wide,
        subjects=subjects,
    )


def _policy() -> str:
    """Only this page's own script runs, and nothing is loaded: text from a scene cannot do anything."""
    digest = base64.b64encode(hashlib.sha256(asset("page.js").encode()).digest()).decode()
    allowed = f"img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{digest}'"
    return f"default-src 'none'; {allowed}; base-uri 'none'; form-action 'none'"


def sections(content: Content, troubles: list[str]) -> Iterator[tuple[SectionOf, Sequence[object]]]:
    """Yield each section that results have, and its parts; one that cannot be made or shown is named in `troubles`."""
    for part in declared(SectionOf):

        def made(part: SectionOf = part) -> Sequence[object]:
            parts = part.parts(content)
            if parts:
                render("parts.html", parts=parts)  # whether it can be shown
            return parts

        if parts := attempt(f"“{part.title}”", made, troubles):
            yield part, parts


def _subjects(
    content: Content, drawn: list[dict[str, str]], beside: Sequence[str], troubles: list[str]
) -> list[Subject]:
    """The folded parts of the page, those with nothing inside left out."""
    found: dict[str, list[tuple[str, str, Sequence[object]]]] = {name: [] for name in SUBJECTS}
    # each of several samples has sections of its own
    plain = replace(content, files={}) if content.samples else content
    for part, parts in sections(plain, troubles):
        found[part.subject].append((part.name, part.title, parts))
    for k, (name, one) in enumerate(content.each_of_samples(), 1):
        for part, parts in sections(one, troubles):
            if part.each:
                title = f"{name}: {part.title[0].lower()}{part.title[1:]}"
                found[part.subject].append((f"{part.name}-{k}", title, parts))
    if absent := _missing(content, troubles):
        found["reproduce"].append(("missing", "Results not available", absent))
    made = []
    for name, (title, hint) in SUBJECTS.items():
        figures = [one for one in drawn if one["subject"] == name and one["name"] not in beside]
        if found[name] or figures:
            made.append(Subject(name, title, hint, found[name], figures))
    return made


def _missing(content: Content, troubles: list[str]) -> list[str]:
    kinds = set(content.files) - {"timing"}
    alone = len(kinds) == 1 and all(kind not in KINDS or KINDS[kind].alone for kind in kinds)
    if not content.whole or not kinds or alone:
        return troubles  # a directory of that command lacks nothing
    absent = {n: one.absent for n, one in KINDS.items() if one.absent and n not in content.files}
    words = [f"{name}.nc: {text}" for name, text in absent.items()]
    if not content.responses:
        why = "no response was stored, so there is no animation (`hpcclear simulate` or `run`)"
        words.append(f"responses/: {why}")
    return [*troubles, *words]


def _further(content: Content) -> list[object] | None:
    """What else is known of the recommended design of a study, in lines."""
    rows = [[one.label, one.text] for one in answer(content.files)]
    if not rows:
        return None
    title = f"{upper(role(content.files['verification']))} design"
    return [PageTable(["subject", "result"], rows, title)]


PARTS = (SectionOf(10, "designs", "answer", "Criterion, constraints, confidence", _further),)

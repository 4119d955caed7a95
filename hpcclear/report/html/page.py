"""One HTML file about a directory of results: works offline, loads nothing from the network, prints and tabs well."""

import base64
import functools
import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from importlib import resources
from pathlib import Path

from hpcclear.report.answer import answer
from hpcclear.report.html import picture, sections
from hpcclear.report.html.content import Content, read
from hpcclear.report.html.guard import attempt
from hpcclear.report.html.markup import Section, render
from hpcclear.report.parts import SectionOf, declared
from hpcclear.results import files
from hpcclear.results.names import KINDS

NAME = "report.html"
_MARK = b'<meta name="generator" content="hpcclear">'  # also stands in the template


def write_report(*places: str | Path, output: str | Path | None = None) -> Path:
    """Write a page from the result files in a directory, or from chosen ones.

    Parameters
    ----------
    *places : path
        A directory with any of the files of `run`, `sample`, `accuracy` and `simulate`, or files of theirs. What is missing
        in a directory is said on the page.
    output : path, optional
        Of the page; report.html in the directory, or in that of the first file, by default.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    InputError
        No such directory, no result in it, a chosen file that is none, matplotlib missing, or no permission to write.
    StorageError
        The disk is full or fails.
    """
    content = read(*places)
    path = content.directory / NAME if output is None else Path(output)
    files.write_bytes(path, _page(content).encode(), _MARK)
    return path


def _page(content: Content) -> str:
    """The whole document."""
    troubles = list(content.troubles)
    nothing = Content(content.directory, {}, {})
    shown = attempt("What the page's script draws", lambda: _picture(content), troubles)
    return render(
        "page.html",
        title=f"Report on {_readable(content.directory.resolve().name)}",
        policy=_policy(),
        style=_asset("page.css"),
        script=_asset("page.js"),
        picture=picture.picture(nothing) if shown is None else shown,
        source=content.attribute("source") or "hpcclear",
        sections=[
            section for section in _sections(content, troubles) if section.content is not None
        ],
    )


def _readable(name: str) -> str:
    """A file name as text, also one that is no text in this system's encoding."""
    return name.encode("utf-8", "replace").decode()


def _picture(content: Content) -> dict[str, object]:
    """What the script draws, if JSON can say it: it knows no NaN."""
    made = picture.picture(content)
    json.dumps(made, allow_nan=False)
    return made


def _asset(name: str) -> str:
    return resources.files(__package__).joinpath(name).read_text(encoding="utf-8")


def _policy() -> str:
    """Only this page's own script runs, and nothing is loaded: text from a scene cannot do anything."""
    digest = base64.b64encode(hashlib.sha256(_asset("page.js").encode()).digest()).decode()
    rules = (
        "default-src 'none'",
        "img-src data:",
        "style-src 'unsafe-inline'",
        f"script-src 'sha256-{digest}'",
        "base-uri 'none'",
        "form-action 'none'",
    )
    return "; ".join(rules)


def _sections(
    content: Content, troubles: list[str], wanted: Sequence[str] | None = None
) -> Iterator[Section]:
    """All sections in the page's order, or those wanted, those with nothing to show among them.

    One that cannot be made or filled into its template is left out, and said in `troubles` and on the page.
    """
    if content.samples:
        yield from _several(content, troubles)
        content = replace(content, files={})
    for part in declared(SectionOf):
        if wanted is not None and part.name not in wanted:
            continue
        if content.samples and (part.of_samples or not content.responses):
            continue
        section = functools.partial(_section, part, content, troubles)
        made = section() if part.piecewise else attempt(f"“{part.title}”", section, troubles)
        if made is not None:
            yield made
    yield Section("missing", "Results not available", "list.html", _missing(content, troubles))


MOST_DRAWN = 4
"""Files of samples whose own figures stand on a page: each takes a second and up to 1 MB."""


def _several(content: Content, troubles: list[str]) -> Iterator[Section]:
    """The comparison of several samples, then the sections of each, which name its file."""
    comparison = SectionOf(0, "comparison", "Comparison", "parts.html", sections.compared)
    yield _section(comparison, content, troubles)
    drawn = len(content.samples) <= MOST_DRAWN
    if not drawn:
        yield Section("figures", "Figures of single files", "parts.html", _on_demand(content))
    each = [
        one.name for one in declared(SectionOf) if one.each and (drawn or one.name != "figures")
    ]
    for k, (name, one) in enumerate(content.each_of_samples(), 1):
        for section in _sections(one, troubles, each):
            if section.name in each:
                heading = f"{name}: {section.title[0].lower()}{section.title[1:]}"
                yield replace(section, name=f"{section.name}-{k}", title=heading)


def _on_demand(content: Content) -> list[object]:
    """How the figures of one of many files are drawn."""
    first = Path(next(iter(content.samples)))
    name = first if first.parent != Path() else content.directory / first
    return [
        f"The figures of single files are drawn for up to {MOST_DRAWN} files; here are {len(content.samples)}. "
        f"To draw those of one file: hpcclear plot {name}.nc -o figures. "
        f"To write a page of its own with them: hpcclear report {name}.nc -o {name}.html."
    ]


def _section(part: SectionOf, content: Content, troubles: list[str]) -> Section:
    """A section whose content its template can show, which is tried."""
    made = part.content(content, troubles)
    section = Section(part.name, part.title, part.template, made, part.folded)
    if section.content is not None:
        render(part.template, content=section.content)
    return section


def _missing(content: Content, troubles: list[str]) -> list[str] | None:
    if not content.whole or not set(content.files) - {"timing"}:
        return troubles or None
    kinds = set(content.files) - {"timing"}
    if len(kinds) == 1 and all(kind not in KINDS or KINDS[kind].alone for kind in kinds):
        return troubles or None  # a directory of that command lacks nothing
    words = [
        f"{name}.nc: {kind.absent}"
        for name, kind in KINDS.items()
        if kind.absent and content.get(name) is None
    ]
    if not content.responses:
        words.append(
            "responses/: no response was stored, so there is no animation (`hpcclear simulate` or `run`)"
        )
    return [*troubles, *words] or None


PARTS = (
    SectionOf(10, "answer", "Result", "answer.html", lambda one: answer(one.files, "") or None),
)

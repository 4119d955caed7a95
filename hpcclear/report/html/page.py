"""One HTML file about a directory of results: works offline, loads nothing from the network, prints and tabs well."""

import base64
import functools
import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from importlib import resources
from pathlib import Path

from hpcclear.report.answer import answer
from hpcclear.report.html import costs, designs, gallery, loads, origin, picture, sections
from hpcclear.report.html.content import Content, read
from hpcclear.report.html.guard import attempt
from hpcclear.report.html.markup import Section, render
from hpcclear.results import files

NAME = "report.html"
_MARK = b'<meta name="generator" content="hpcclear">'  # also stands in the template

_MISSING = {
    "samples": "samples.nc: no design was sampled (`hpcclear sample` or `run`)",
    "sensitivity": "sensitivity.nc: no sensitivities (`hpcclear run` of a study with `study.sensitivity.groups`)",
    "kriging": "kriging.nc: no surrogate (`hpcclear run`)",
    "front": "front.nc: nothing was optimised (`hpcclear run`)",
    "verification": "verification.nc: no design was verified (`hpcclear run`)",
    "accuracy": "accuracy.nc: the cost of accuracy was not measured (`hpcclear accuracy`)",
    "timing": "timing.nc: the time of the ranks is not known",
}


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
    drawn = functools.partial(gallery.figures, troubles=troubles)
    makers: tuple[tuple[str, str, str, Callable[[Content], object]], ...] = (
        ("answer", "Result", "answer.html", lambda one: answer(one.files, "") or None),
        ("identify", "Identified machine", "parts.html", sections.identified_machine),
        ("designs", "Optimised designs", "designs.html", designs.designs),
        ("pareto", "Pareto front", "pareto.html", lambda one: picture.front(one)["points"] or None),
        ("statistics", "Statistics of the samples", "parts.html", sections.statistics),
        ("loads", "Loads of the bearings", "parts.html", loads.loads),
        ("summary", "Summary", "summary.html", sections.summary),
        ("motion", "Animation", "motion.html", lambda one: one.responses or None),
        ("accuracy", "Accuracy and run time", "parts.html", costs.accuracy),
        ("figures", "Figures", "figures.html", drawn),
        ("trust", "Data quality", "parts.html", sections.trust),
        ("effects", "Effects and settings", "parts.html", origin.effects),
        ("reproduce", "How to reproduce", "parts.html", origin.reproduce),
        ("paper", "Comparison with the paper", "parts.html", _paper),
        ("time", "Run time of the ranks", "parts.html", origin.timing),
    )
    for name, title, template, make in makers:
        if wanted is not None and name not in wanted:
            continue
        if content.samples and (name in _OF_SAMPLES or not content.responses):
            continue
        # figures are limited one by one
        section = functools.partial(_section, name, title, template, make, content)
        made = section() if name == "figures" else attempt(f"“{title}”", section, troubles)
        if made is not None:
            yield made
    yield Section("missing", "Results not available", "list.html", _missing(content, troubles))


MOST_DRAWN = 4
"""Files of samples whose own figures stand on a page: each takes a second and up to 1 MB."""
_OF_SAMPLES = ("statistics", "summary", "trust")
"""Sections on samples alone."""
_EACH = (*_OF_SAMPLES, "figures", "effects", "reproduce")
"""Sections that each of several samples has by itself."""


def _several(content: Content, troubles: list[str]) -> Iterator[Section]:
    """The comparison of several samples, then the sections of each, which name its file."""
    yield _section("comparison", "Comparison", "parts.html", sections.compared, content)
    drawn = len(content.samples) <= MOST_DRAWN
    if not drawn:
        yield Section("figures", "Figures of single files", "parts.html", _on_demand(content))
    each = [name for name in _EACH if drawn or name != "figures"]
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


_FOLDED = ("paper", "time")
"""Sections that few readers need."""


def _paper(content: Content) -> list[object] | None:
    """The paper's claims, its designs and how its text can be read; None for a study of another scene."""
    parts = [sections.claims(content), designs.of_a_paper(content), sections.readings(content)]
    return [one for part in parts for one in part or ()] or None


def _section(
    name: str, title: str, template: str, make: Callable[[Content], object], content: Content
) -> Section:
    """A section whose content its template can show, which is tried."""
    section = Section(name, title, template, make(content), name in _FOLDED)
    if section.content is not None:
        render(template, content=section.content)
    return section


def _missing(content: Content, troubles: list[str]) -> list[str] | None:
    if not content.whole or not set(content.files) - {"timing"}:
        return troubles or None
    for kind in ("accuracy", "wear", "effects", "map", "bifurcation", "identify"):
        if set(content.files) <= {kind, "timing"} and kind in content.files:
            return troubles or None  # a directory of that command lacks nothing
    words = [text for kind, text in _MISSING.items() if content.get(kind) is None]
    if not content.responses:
        words.append(
            "responses/: no response was stored, so there is no animation (`hpcclear simulate` or `run`)"
        )
    return [*troubles, *words] or None

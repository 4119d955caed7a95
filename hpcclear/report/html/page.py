"""One HTML file about a directory of results: works offline, asks nothing of the network, prints and tabs well."""

import base64
import hashlib
from collections.abc import Iterator
from importlib import resources
from pathlib import Path

from hpcclear.report.answer import answer
from hpcclear.report.html import costs, gallery, origin, picture, sections
from hpcclear.report.html.content import Content, read
from hpcclear.report.html.markup import Section, render
from hpcclear.results import files

NAME = "report.html"

_MISSING = {
    "samples": "samples.nc: no design was sampled (`hpcclear sample` or `run`)",
    "sensitivity": "sensitivity.nc: no sensitivities (`hpcclear run`)",
    "kriging": "kriging.nc: no surrogate (`hpcclear run`)",
    "front": "front.nc: nothing was optimised (`hpcclear run`)",
    "verification": "verification.nc: no design was verified (`hpcclear run`)",
    "accuracy": "accuracy.nc: what accuracy costs was not measured (`hpcclear accuracy`)",
    "timing": "timing.nc: how the ranks spent their time is not known",
}


def write_report(directory: str | Path) -> Path:
    """Write DIRECTORY/report.html from the result files in the directory.

    Parameters
    ----------
    directory : path
        Holds any of the files of `run`, `sample`, `accuracy` and `simulate`; what is missing is said on the page.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    InputError
        No such directory, no result in it, matplotlib missing, or no permission to write.
    StorageError
        The disk is full or fails.
    """
    content = read(directory)
    path = Path(directory) / NAME
    files.write_bytes(path, _page(content).encode())
    return path


def _page(content: Content) -> str:
    """The whole document."""
    return render(
        "page.html",
        title=f"Report on {content.directory.resolve().name}",
        policy=_policy(),
        style=_asset("page.css"),
        script=_asset("page.js"),
        picture=picture.picture(content),
        source=content.attribute("source") or "hpcclear",
        sections=[section for section in _sections(content) if section.content is not None],
    )


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


def _sections(content: Content) -> Iterator[Section]:
    """All sections in the page's order, those with nothing to show among them."""
    beside = " beside the paper's" if content.is_compared else ""
    lines = answer(content.files, "")
    yield Section("answer", "The answer", "answer.html", lines or None)
    yield Section("summary", "Summary", "summary.html", sections.summary(content))
    yield Section(
        "designs", f"Optimised designs{beside}", "designs.html", sections.designs(content)
    )
    front = picture.front(content)["points"] or None
    yield Section("pareto", "Pareto front", "pareto.html", front)
    yield Section("claims", "Claims of the paper", "parts.html", sections.claims(content))
    yield Section("readings", "How the paper can be read", "parts.html", sections.readings(content))
    yield Section("motion", "The mechanism in motion", "motion.html", content.responses or None)
    yield Section("accuracy", "What accuracy cost", "parts.html", costs.accuracy(content))
    yield Section("figures", "Figures", "figures.html", gallery.figures(content))
    yield Section("trust", "Which samples to trust", "parts.html", sections.trust(content))
    yield Section("time", "How the ranks spent their time", "parts.html", origin.timing(content))
    yield Section("effects", "Effects and settings", "parts.html", origin.effects(content))
    yield Section("reproduce", "How to reproduce", "parts.html", origin.reproduce(content))
    yield Section("missing", "What is not here", "list.html", _missing(content))


def _missing(content: Content) -> list[str] | None:
    if set(content.files) <= {"accuracy", "timing"} and "accuracy" in content.files:
        return list(content.troubles) or None  # a directory of `accuracy` lacks nothing
    words = [text for kind, text in _MISSING.items() if content.get(kind) is None]
    if not content.responses:
        words.append(
            "responses/: no response was stored, so there is no animation (`hpcclear simulate` or `run`)"
        )
    return [*content.troubles, *words] or None

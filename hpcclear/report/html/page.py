"""One HTML file about a directory of results: works offline, asks nothing of the network, prints and tabs well."""

import base64
import hashlib
from collections.abc import Iterator
from importlib import resources
from pathlib import Path

from hpcclear.report.html import costs, gallery, origin, picture, sections
from hpcclear.report.html.content import Content, read
from hpcclear.report.html.markup import Html, data, join, tag
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


def _page(content: Content) -> Html:
    """The whole document."""
    parts = [(name, title, body) for name, title, body in _sections(content) if body is not None]
    links = [tag("li", tag("a", title, href=f"#{name}")) for name, title, _ in parts]
    title = f"Report on {content.directory.resolve().name}"
    body = tag(
        "body",
        tag("a", "Skip to the results", class_="skip", href="#main"),
        tag("header", tag("h1", title), tag("nav", tag("ul", *links), aria_label="Sections")),
        tag("main", *(_section(*part) for part in parts), id="main"),
        tag(
            "footer",
            tag("p", f"Written by {content.attribute('source') or 'hpcclear'}.", class_="soft"),
        ),
        data(picture.picture(content), "content"),
        Html(f"<script>{_asset('page.js')}</script>"),
    )
    head = tag(
        "head",
        tag("meta", charset="utf-8"),
        tag("meta", name="viewport", content="width=device-width, initial-scale=1"),
        tag("meta", http_equiv="Content-Security-Policy", content=_policy()),
        tag("title", title),
        Html(f"<style>{_asset('page.css')}</style>"),
    )
    return Html("<!doctype html>\n" + tag("html", head, body, lang="en") + "\n")


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


def _section(name: str, title: str, body: Html) -> Html:
    return tag(
        "section",
        tag("h2", title, id=f"{name}-title"),
        body,
        id=name,
        aria_labelledby=f"{name}-title",
    )


def _sections(content: Content) -> Iterator[tuple[str, str, Html | None]]:
    """Names, titles and bodies in the page's order; None for what cannot be shown."""
    yield "summary", "Summary", sections.summary(content)
    beside = " beside the paper's" if content.is_compared else ""
    yield "designs", f"Optimised designs{beside}", sections.designs(content)
    yield "pareto", "Pareto front", _front(content)
    yield "claims", "Claims of the paper", sections.claims(content)
    yield "readings", "How the paper can be read", sections.readings(content)
    yield "motion", "The mechanism in motion", _motion(content)
    yield "accuracy", "What accuracy cost", costs.accuracy(content)
    yield "figures", "Figures", gallery.figures(content)
    yield "trust", "Which samples to trust", sections.trust(content)
    yield "time", "How the ranks spent their time", origin.timing(content)
    yield "effects", "Effects and settings", origin.effects(content)
    yield "reproduce", "How to reproduce", origin.reproduce(content)
    yield "missing", "What is not here", _missing(content)


def _front(content: Content) -> Html | None:
    if not picture.front(content)["points"]:
        return None
    words = (
        "Each mark is a design; large ones were simulated directly. Hover to see a design, click to see its verified "
        "statistics and responses. By keyboard: Tab to the front, ← → from design to design, ↑ ↓ between simulated "
        "ones, Enter to show."
    )
    panel = tag("div", class_="panel", id="front-panel", aria_live="polite")
    views = (tag("option", "the front", value="near"), tag("option", "all designs", value="all"))
    view = tag("label", "Show", tag("select", *views, id="front-view"))
    left = tag(
        "div",
        tag("div", view, class_="controls"),
        tag("div", id="front"),
        tag("p", id="front-legend", class_="legend"),
    )
    both = tag("div", left, panel, class_="split")
    return join([tag("p", words), _noscript("front"), both, tag("div", id="front-responses")])


def _motion(content: Content) -> Html | None:
    if not content.responses:
        return None
    choice = tag("label", "Design", tag("select", id="motion-name"))
    gain = tag(
        "label",
        "Clearance drawn larger",
        tag("input", type="range", id="motion-gain", min="1", value="20"),
    )
    at = tag("label", "Instant", tag("input", type="range", id="motion-at", min="0", value="0"))
    pace = [
        tag("option", word, value=v)
        for word, v in (("1 revolution in 8 s", 0.125), ("in 3 s", 0.33), ("in 1 s", 1))
    ]
    speed = tag("label", "Pace", tag("select", *pace, id="motion-speed"))
    button = tag("button", "Play", id="motion-play", type="button")
    words = (
        "The last two revolutions. Orange: the contact forces on the rod's bearings. The circles are the clearance "
        "circles; a journal outside its circle has pressed itself into the bearing, which is drawn larger as well."
    )
    return join(
        [
            tag("p", words),
            _noscript("motion"),
            tag("div", id="mechanism"),
            tag("p", id="motion-text", class_="soft"),
            tag("div", button, choice, speed, gain, at, class_="controls"),
        ]
    )


def _noscript(what: str) -> Html:
    return tag(
        "noscript",
        tag(
            "p",
            f"The interactive {what} needs JavaScript; tables and figures say the same.",
            class_="note",
        ),
    )


def _missing(content: Content) -> Html | None:
    words = [text for kind, text in _MISSING.items() if content.get(kind) is None]
    if not content.responses:
        words.append(
            "responses/: no response was stored, so there is no animation (`hpcclear simulate` or `run`)"
        )
    items = [tag("li", word) for word in (*content.troubles, *words)]
    return tag("ul", *items) if items else None

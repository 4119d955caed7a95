"""The first screen of each kind of result: a module a group of kinds, loaded where a directory has one of them."""

from dataclasses import replace
from importlib import import_module

from hpcclear.report.html.content import Content
from hpcclear.report.screen import Screen, red, trusted

_MAKERS = {
    "verification": "study.screen",
    "wear": "lives.screen",
    "identify": "findings.machine",
    "accuracy": "findings.accuracy",
    "effects": "findings.effects",
    "map": "batches.map_of_motion",
    "bifurcation": "batches.bifurcation",
    "samples": "batches.samples",
    "statistics": "batches.statistics",
    "response": "response.screen",
}
"""Module and function that make the screen of a kind, from its file and all results; the first that makes one counts."""


def screen_of(content: Content) -> Screen | None:
    """Return the first screen of results; None of those that have none."""
    response = content.response
    files = content.files if response is None else {**content.files, "response": response}
    for kind, place in _MAKERS.items():
        module, _, name = place.partition(".")
        made: Screen | None = None
        if kind in files:
            made = getattr(import_module(f"{__name__}.{module}"), name)(files[kind], content)
        if made is not None:
            first = replace(made, title=content.attribute("about_title"))
            if not content.troubles:
                return first
            lost = red(f"Not all files are here: {content.troubles[0]}", "reproduce")
            return replace(first, trust=trusted([*first.trust, lost]))
    return None

"""The first screen of each kind of result: a module a group of kinds, loaded where a directory has one of them."""

from dataclasses import replace
from importlib import import_module

from hpcclear.report.html.content import Content
from hpcclear.report.screen import Level, Screen, Trust, trusted

_OF = {
    "study": {"verification"},
    "lives": {"wear"},
    "findings": {"identify", "effects", "accuracy"},
    "batches": {"map", "bifurcation", "samples", "statistics"},
    "response": {"response"},
}
"""Modules, the first that makes a screen first, and the kinds of their files."""


def screen_of(content: Content) -> Screen | None:
    """Return the first screen of results; None of those that have none."""
    kinds = {*content.files, *(["response"] if content.responses else [])}
    modules = [import_module(f"{__name__}.{name}") for name, own in _OF.items() if own & kinds]
    made = (make(content) for module in modules for make in module.SCREENS)
    first: Screen | None = next((one for one in made if one is not None), None)
    if first is None:
        return None
    first = replace(first, title=content.attribute("about_title"))
    if not content.troubles:
        return first
    lost = Trust(Level.RED, f"Not all files are here: {content.troubles[0]}", "reproduce")
    return replace(first, trust=trusted([*first.trust, lost]))

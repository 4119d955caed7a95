"""Modules of generated source, which tracebacks and `inspect` show as if they stood in files."""

import linecache
from functools import cache
from types import ModuleType
from typing import Any


def run_text(text: str, place: str, names: dict[str, Any]) -> None:
    """Run a text with these names, which it adds its own to; its lines are found by `place`."""
    linecache.cache[place] = len(text), None, text.splitlines(keepends=True), place
    exec(compile(text, place, "exec"), names)


@cache
def module_of(name: str, text: str) -> ModuleType:
    """The module of a source, by a name that no other source has."""
    module = ModuleType(name)
    run_text(text, f"<{name}>", vars(module))
    return module

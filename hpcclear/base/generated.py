"""Modules of generated source, which tracebacks and `inspect` show as if they stood in files."""

import linecache
from functools import cache
from types import ModuleType


@cache
def module_of(name: str, text: str) -> ModuleType:
    """The module of a source, by a name that no other source has."""
    module, place = ModuleType(name), f"<{name}>"
    linecache.cache[place] = len(text), None, text.splitlines(keepends=True), place
    exec(compile(text, place, "exec"), vars(module))
    return module

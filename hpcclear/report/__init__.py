"""Figures, each a function of a dataset, and the HTML page.

Every function of `hpcclear.report.figures` whose name ends in ``_figure`` is an attribute of this package, `save` and
`printing` too. They are loaded when one is first used: a command that prints a few numbers of a response needs none. Figures
need matplotlib (the extra ``analysis``), which is imported when the first one is drawn.
"""

import pkgutil
from functools import cache
from importlib import import_module
from typing import Any

from hpcclear.report import figures


@cache
def _public() -> dict[str, Any]:
    found = pkgutil.iter_modules(figures.__path__, f"{figures.__name__}.")
    modules = [vars(import_module(one.name)) for one in found]
    return {name: one for own in modules for name, one in own.items() if _is_public(name)}


def _is_public(name: str) -> bool:
    return name in ("save", "printing") or name.endswith("_figure")


def __getattr__(name: str) -> Any:
    if _is_public(name) and name in _public():
        return _public()[name]
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*globals(), *_public()]

"""Laws, one file each: normal forces, friction, oil films.

A law never sees a row: it declares its parameters, gets numbers, returns numbers. A file here holds ``LAW`` (in ``geometry``
``GEOMETRY``), and its name with hyphens is the law's: adding a law is adding a file.
"""

import dataclasses
import importlib
import pkgutil
from functools import cache
from typing import Any

FOLDERS = {"contact": "normal", "friction": "friction", "film": "film", "geometry": "geometry"}


@cache
def laws(kind: str) -> dict[str, Any]:
    """The laws of a kind, "contact", "friction" or "film", or the geometries of contact ("geometry"), by name."""
    found = {}
    for name in names(kind):
        held = importlib.import_module(f"{__name__}.{FOLDERS[kind]}.{name.replace('-', '_')}")
        law = held.GEOMETRY if kind == "geometry" else held.LAW
        found[name] = dataclasses.replace(law, name=name)
    return found


def names(kind: str) -> tuple[str, ...]:
    """Their names; without loading them."""
    package = importlib.import_module(f"{__name__}.{FOLDERS[kind]}")
    return tuple(one.name.replace("_", "-") for one in pkgutil.iter_modules(package.__path__))

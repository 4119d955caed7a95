"""Laws: normal forces, friction, oil films.

A law never sees a row: it declares its parameters, gets numbers, returns numbers. A file here holds ``LAW`` (in ``geometry``
``GEOMETRY``), and its name with hyphens is the law's: adding a law is adding a file. A family of laws stands in one file, as
``LAWS`` by their names.
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
    package = importlib.import_module(f"{__name__}.{FOLDERS[kind]}")
    found = dict[str, Any]()
    for one in pkgutil.iter_modules(package.__path__):
        held = vars(importlib.import_module(f"{package.__name__}.{one.name}"))
        own = held.get("LAW") or held.get("GEOMETRY")
        found |= held.get("LAWS") or {one.name.replace("_", "-"): own}
    return {name: dataclasses.replace(law, name=name) for name, law in sorted(found.items())}

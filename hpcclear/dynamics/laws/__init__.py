"""Laws, one file each: normal forces and friction.

A law never sees a row: it declares its parameters, gets numbers, returns numbers. A file here holds ``LAW`` (in ``geometry``
``GEOMETRY``), and its name with hyphens is the law's: adding a law is adding a file.
"""

import dataclasses
import importlib
import pkgutil
from functools import cache
from typing import Any

FOLDERS = {"contact": "normal", "friction": "friction", "geometry": "geometry"}


@cache
def laws(kind: str) -> dict[str, Any]:
    """The laws of a kind, "contact" or "friction", or the geometries of contact ("geometry"), by name."""
    package = importlib.import_module(f"{__name__}.{FOLDERS[kind]}")
    found = {}
    for module in pkgutil.iter_modules(package.__path__):
        name = module.name.replace("_", "-")
        held = importlib.import_module(f"{package.__name__}.{module.name}")
        law = held.GEOMETRY if kind == "geometry" else held.LAW
        found[name] = dataclasses.replace(law, name=name)
    return found

"""Laws, one file each: normal forces and friction.

A law never sees a row: it declares its parameters, gets numbers, returns numbers. A file here holds ``LAW``, and its name with
hyphens is the law's: adding a law is adding a file.
"""

import dataclasses
import importlib
import pkgutil
from functools import cache

from hpcclear.dynamics.laws.declared import Law

FOLDERS = {"contact": "normal", "friction": "friction"}


@cache
def laws(kind: str) -> dict[str, Law]:
    """The laws of a kind, "contact" or "friction", by name."""
    package = importlib.import_module(f"{__name__}.{FOLDERS[kind]}")
    found = {}
    for module in pkgutil.iter_modules(package.__path__):
        name = module.name.replace("_", "-")
        law = importlib.import_module(f"{package.__name__}.{module.name}").LAW
        found[name] = dataclasses.replace(law, name=name)
    return found

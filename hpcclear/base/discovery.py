"""Kinds that are one file each: their classes, found in the modules of a package."""

import pkgutil
from collections.abc import Iterable
from importlib import import_module
from typing import Any, TypeVar, get_args

Kind = TypeVar("Kind")


def kinds_in(package: str, path: Iterable[str], base: type[Kind]) -> dict[str, type[Kind]]:
    """Subclasses of a class that modules of a package define and that have a `kind` and a `name`, by their kinds."""
    found: dict[str, Any] = {}
    for module in pkgutil.iter_modules(path):
        name = f"{package}.{module.name}"
        for one in vars(import_module(name)).values():
            if isinstance(one, type) and issubclass(one, base) and one.__module__ == name:
                fields = one.model_fields  # type: ignore[attr-defined]
                if {"kind", "name"} <= fields.keys():
                    found[get_args(fields["kind"].annotation)[0]] = one
    return found

"""Kinds that are one file each: their classes, found in the modules of a package."""

import pkgutil
from collections.abc import Iterable
from importlib import import_module
from typing import Any, TypeVar, get_args

Kind = TypeVar("Kind")


def kinds_in(package: str, path: Iterable[str], base: type[Kind]) -> dict[str, type[Kind]]:
    """Subclasses of a class that modules of a package define and that have a `kind` and a `name`, by their kinds."""
    modules = [import_module(f"{package}.{one.name}") for one in pkgutil.iter_modules(path)]
    found: list[Any] = [
        one
        for module in modules
        for one in vars(module).values()
        if isinstance(one, type) and issubclass(one, base) and one.__module__ == module.__name__
    ]
    named = (one for one in found if {"kind", "name"} <= one.model_fields.keys())
    return {get_args(one.model_fields["kind"].annotation)[0]: one for one in named}

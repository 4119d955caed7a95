"""Loads that act on a linkage, one file a kind: its numbers, and the terms that it adds to the motion's text.

A new one is a file here, which `KINDS` finds, and its table in `hpcclear.scene.loads`.
"""

import pkgutil
from importlib import import_module

from hpcclear.dynamics.linkage.parts import Acting


def _found() -> dict[str, type[Acting]]:
    modules = [import_module(f"{__name__}.{one.name}") for one in pkgutil.iter_modules(__path__)]
    loads = (one for module in modules for one in vars(module).values() if isinstance(one, type))
    return {one.kind: one for one in loads if issubclass(one, Acting) and one is not Acting}


KINDS: dict[str, type[Acting]] = _found()
"""By the kind that the scene names."""

"""Loads that act on a linkage, one file a kind: its entries in a scene, its numbers, the terms that it adds to the motion.

A new load is a file here, which `KINDS` finds; no other file changes. `declared` has what they share.
"""

import pkgutil
from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any, Union, get_args

from pydantic import Field

from hpcclear.scene.loads.declared import Load


def _found() -> dict[str, type[Load]]:
    modules = [import_module(f"{__name__}.{one.name}") for one in pkgutil.iter_modules(__path__)]
    tables = (one for module in modules for one in vars(module).values() if isinstance(one, type))
    loads = (one for one in tables if issubclass(one, Load) and "kind" in one.model_fields)
    return {get_args(one.model_fields["kind"].annotation)[0]: one for one in loads}


KINDS: dict[str, type[Load]] = _found()
"""Tables of loads by their kinds."""
if TYPE_CHECKING:
    AnyLoad = Any
else:
    AnyLoad = Annotated[Union[tuple(KINDS.values())], Field(discriminator="kind")]  # noqa: UP007

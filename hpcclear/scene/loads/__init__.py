"""Loads that act on a linkage, one file a kind: its entries in a scene, its numbers, the terms that it adds to the motion.

A new load is a file here, which `KINDS` finds; no other file changes. `declared` has what they share.
"""

from typing import TYPE_CHECKING, Annotated, Any, Union

from pydantic import Field

from hpcclear.base.discovery import kinds_in
from hpcclear.scene.loads.declared import Load

KINDS: dict[str, type[Load]] = kinds_in(__name__, __path__, Load)
"""Tables of loads by their kinds."""
if TYPE_CHECKING:
    AnyLoad = Any
else:
    AnyLoad = Annotated[Union[tuple(KINDS.values())], Field(discriminator="kind")]  # noqa: UP007

"""Scenes: the TOML file that says what is simulated, validated and frozen."""

from typing import TYPE_CHECKING

from hpcclear.scene.describing import differences
from hpcclear.scene.scene import Scene, load_scene

if TYPE_CHECKING:
    from hpcclear.scene.schema import scene_schema

__all__ = ["Scene", "differences", "load_scene", "scene_schema"]


def __getattr__(name: str) -> object:
    if name != "scene_schema":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    # with the readers of files, whose entries it has
    from hpcclear.scene.schema import scene_schema

    return scene_schema

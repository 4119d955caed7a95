"""Scenes: the TOML file that says what is simulated, validated and frozen."""

from hpcclear.scene.describing import differences
from hpcclear.scene.loading import load_scene
from hpcclear.scene.scene import Scene
from hpcclear.scene.schema import scene_schema

__all__ = ["Scene", "differences", "load_scene", "scene_schema"]

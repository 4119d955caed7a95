"""Scenes: the TOML file that says what is simulated, validated and frozen."""

from hpcclear.scene.loading import load_scene
from hpcclear.scene.scene import Scene

__all__ = ["Scene", "load_scene"]

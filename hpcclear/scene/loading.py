"""Scenes that result files carry."""

from hpcclear.base.errors import InputError
from hpcclear.scene.paths import files_named
from hpcclear.scene.plugged import check_trust
from hpcclear.scene.scene import Scene, load_scene
from hpcclear.scene.syntax import parse


def scene_of_text(text: str, name: str) -> Scene:
    """Return the scene of a text that a result file carries.

    No file is opened, whatever the text names: it may be somebody else's. Python text in it is run in a `trusting` block
    only. Raises InputError as `load_scene`, or if values are in a file, or nobody has said that Python text in it may be run.
    """
    content = parse(text, name)
    for key in files_named(content):
        reason = "its scene names a file of values that the result does not contain"
        raise InputError(key, name, reason, "Create the result again with this version")
    check_trust(content, name)
    return load_scene(content, trust=True)

"""Scenes of planar linkages from their tables."""

from hpcclear.scene import Scene, load_scene


def planar_scene(bodies, joints, drives, *, ground=None, loads=None, **tables) -> Scene:
    """`ground`: its points by their names; `tables`: those of the scene besides its mechanism."""
    mechanism = {"kind": "planar", "bodies": bodies, "joints": joints, "drives": drives}
    if ground is not None:
        mechanism["ground"] = {"points": ground}
    mechanism["loads"] = loads or {}
    return load_scene({"format_version": 2, "mechanism": mechanism, **tables})

"""Scenes of planar linkages from their tables."""

from hpcclear.scene import Scene, load_scene
from hpcclear.scene.tables import plain

KEPT = ("effects", "numerics", "output")
"""Tables that are the same whatever the mechanism is written as."""


def planar_scene(bodies, joints, drives, *, ground=None, loads=None, **tables) -> Scene:
    """`ground`: its points by their names; `tables`: those of the scene besides its mechanism."""
    mechanism = {"kind": "planar", "bodies": bodies, "joints": joints, "drives": drives}
    if ground is not None:
        mechanism["ground"] = {"points": ground}
    mechanism["loads"] = loads or {}
    return load_scene({"format_version": 2, "mechanism": mechanism, **tables})


def without_play(linkage: Scene) -> Scene:
    """A linkage with ideal pins in the places of those with clearance, without friction."""
    pins = {
        f"mechanism.joints.{one.name}": {"kind": "revolute", "journal": one.journal, "bearing": one.bearing}
        for one in linkage.mechanism.joints if one.name in linkage.clearance_joints()
    }  # fmt: skip
    return linkage.with_(
        {**pins, "effects.contact": None, "effects.friction": "none", "study": None}
    )


def written_out(scene: Scene) -> Scene:
    """A slider-crank with clearance in both joints by its bodies and joints."""
    bars = scene.slider_crank
    joints = {
        "main": {"kind": "revolute", "journal": "crank.a", "bearing": "ground.o"},
        "guide": {"kind": "slide", "point": "slider.pin", "line": "ground.o"},
    }
    ends = {"crank_rod": ("crank.b", "rod.a"), "rod_slider": ("slider.pin", "rod.b")}
    for name, (journal, bearing) in ends.items():
        table = plain(getattr(scene.joints, name))
        table["materials"] = {part: table.pop(part) for part in ("bearing", "journal")}
        joints[name] = table | {"journal": journal, "bearing": bearing}
    bodies = {
        "crank": plain(bars.crank),
        "rod": plain(bars.rod),
        "slider": {"mass": bars.slider.mass, "points": {"pin": [0.0, 0.0]}},
    }
    kept = {name: table for name, table in scene.resolved().items() if name in KEPT}
    return planar_scene(bodies, joints, {"motor": plain(scene.drive) | {"body": "crank"}}, **kept)

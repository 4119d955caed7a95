"""Effects that a scene could do without: what each is, and the scene with some of them off."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from hpcclear.base.errors import InputError
from hpcclear.scene.driving import PlanarTorque, speed_entry
from hpcclear.scene.mechanism import TorqueDrive
from hpcclear.scene.paths import replace
from hpcclear.scene.planar import Planar, PlanarClearance, PlanarSlide
from hpcclear.scene.scene import Scene
from hpcclear.scene.tables import plain
from hpcclear.scene.validation import validated


@dataclass(frozen=True)
class Switch:
    """An effect that is on and may be switched off."""

    name: str
    """What it is, in words."""
    changes: Mapping[str, Any]
    """What switches it off: entries to replace; None removes one."""
    moved: Mapping[str, str] = field(default_factory=dict)
    """Numbers that stand elsewhere with the effect off."""
    joint: str | None = None
    """The joint whose play it is."""

    def path(self, path: str) -> str | None:
        """Where a number of the scene stands with the effect off; None if nowhere."""
        gone = any(path == key or path.startswith(f"{key}.") for key in self.changes)
        return self.moved.get(path) if gone else path


def switches(scene: Scene) -> tuple[Switch, ...]:
    """All effects of a scene that may be switched off, joints first.

    Play in a joint that ``numerics.objective_joints`` names is none of them: the study asks about it.
    """
    return (
        *_plays(scene), *_films(scene), *_laws(scene), *_bendings(scene), *_outside(scene), *_drives(scene)
    )  # fmt: skip


def _plays(scene: Scene) -> Iterator[Switch]:
    for label in scene.clearance_joints():
        if label in scene.numerics.objective_joints:
            continue
        joint = scene.clearance_joint(label)
        if isinstance(joint, PlanarClearance):
            ideal = {"kind": "revolute", "journal": joint.journal, "bearing": joint.bearing}
        else:
            ideal = {"kind": "ideal"}
        yield Switch(f"play in {label}", {scene.joint_key(label): ideal}, joint=label)


def _films(scene: Scene) -> Iterator[Switch]:
    for label in scene.films():
        yield Switch(f"oil film in {label}", {f"{scene.joint_key(label)}.film": None})


def _bendings(scene: Scene) -> Iterator[Switch]:
    for key in scene.bending():
        yield Switch(f"bending of {key.rpartition('.')[2]}", {f"{key}.bending": None})


def _laws(scene: Scene) -> Iterator[Switch]:
    """What the contact law does beside its elastic force."""
    effects = scene.effects
    if not scene.clearance_joints():
        return
    if effects.friction.law != "none":
        yield Switch("friction in joints", {"effects.friction": {"law": "none"}})
    law = effects.contact
    if law is not None and (law.damping or (law.restitution is not None and law.restitution < 1)):
        floor = "effects.contact.minimum_impact_speed"
        elastic = {"law": "hertz", "minimum_impact_speed": law.minimum_impact_speed}
        yield Switch("contact damping", {"effects.contact": elastic}, {floor: floor})


def _outside(scene: Scene) -> Iterator[Switch]:
    effects, mechanism = scene.effects, scene.mechanism
    if effects.gravity > 0.0:
        yield Switch("gravity", {"effects.gravity": 0.0})
    if effects.slider_load is not None:
        yield Switch("slider load", {"effects.slider_load": None})
    if effects.guide_friction is not None:
        yield Switch("guide friction", {"effects.guide_friction": None})
    if isinstance(mechanism, Planar):
        for joint in mechanism.joints:
            if isinstance(joint, PlanarSlide) and joint.friction is not None:
                key = f"mechanism.joints.{joint.name}.friction"
                yield Switch(f"guide friction in {joint.name}", {key: None})
        for load in mechanism.loads:
            yield Switch(f"{load.kind} {load.name}", {f"mechanism.loads.{load.name}": None})


def _drives(scene: Scene) -> Iterator[Switch]:
    """A free crank, in whose place one turns at the speed that is expected of it, or that it starts with."""
    if isinstance(scene.mechanism, Planar):
        drives = [one for one in scene.mechanism.drives if isinstance(one, PlanarTorque)]
        tables: list[tuple[str, str, PlanarTorque | TorqueDrive]] = [
            (f" of {one.name}", f"mechanism.drives.{one.name}", one) for one in drives
        ]
    else:
        tables = [("", "drive", scene.drive)] if isinstance(scene.drive, TorqueDrive) else []
    for whose, key, drive in tables:
        kept = {name: plain(drive).get(name) for name in ("body", "period", "turns")}
        table = {name: value for name, value in kept.items() if value is not None}
        entry = speed_entry(drive)
        table |= {"kind": "constant-speed", "speed": getattr(drive, entry)}
        moved = {f"{key}.{entry}": f"{key}.speed"}
        yield Switch(f"speed fluctuation{whose}", {key: table}, moved)


class Off:
    """A scene with some of its effects off, and where the numbers of the whole one stand in it.

    Parameters
    ----------
    scene : Scene
    off : sequence of Switch

    Attributes
    ----------
    scene : Scene
        Its study varies what is left; a design variable that drives nothing any more is gone.

    Raises
    ------
    InputError
        Without them the scene is none, or its study has nothing left to vary or to optimise.
    """

    def __init__(self, scene: Scene, off: Sequence[Switch]) -> None:
        self._off = list(off)
        plays = {one.joint for one in off if one.joint is not None}
        if plays and plays == set(scene.clearance_joints()):
            self._off.append(Switch("", {"effects.friction": {"law": "none"}}))  # acts in play only
        self.scene = self._made(scene)

    def paths(self, paths: Sequence[str]) -> tuple[str, ...]:
        """Scene entries that are left of those that a column drives."""
        found: list[str] = []
        for path in paths:
            place: str | None = path
            for one in self._off:
                place = None if place is None else one.path(place)
            if place is not None:
                found.append(place)
        return tuple(found)

    def _made(self, scene: Scene) -> Scene:
        content = scene.resolved()
        for one in self._off:
            for path, value in one.changes.items():
                content = replace(content, path, value)
        if scene.study is not None:
            content["study"] = self._study(scene, content["study"])
        made = validated(Scene, content)
        made._text = scene.text
        return made

    def _study(self, scene: Scene, content: Mapping[str, Any]) -> dict[str, Any]:
        """The study's table without the paths that are gone, nor names that drive nothing."""
        study = scene.required_study
        left: dict[str, dict[str, Any]] = {}
        for table, rows in (("variables", study.variables), ("random", study.random)):
            left[table] = {}
            for row in rows:
                paths = self.paths(row.paths)
                own = content[table][row.name]
                if paths:
                    same = paths == row.paths
                    left[table][row.name] = own if same else {**own, "paths": list(paths)}
        cases = {
            case.name: {
                **content["cases"][case.name],
                "random": [name for name in case.random if name in left["random"]],
            }
            for case in study.cases
        }
        cases = {name: case for name, case in cases.items() if case["random"]}
        if not left["variables"] or (study.cases and not cases):
            raise InputError(
                "study", None, "nothing would be left to vary", "Keep the effect that it varies"
            )
        kept = {key: value for key, value in content.items() if key != "correlation"}
        return {
            **kept,
            **left,
            **_correlated(content.get("correlation"), left["random"]),
            **({"cases": cases} if study.cases else {}),
            "sensitivity": _named(content["sensitivity"], left["variables"]),
            "surrogate": _named(content["surrogate"], left["variables"]),
        }


def _correlated(table: Mapping[str, Any] | None, names: Mapping[str, Any]) -> dict[str, Any]:
    """The study's correlation among the random inputs that are left, if it has one."""
    rows = [] if table is None else [k for k, name in enumerate(table["inputs"]) if name in names]
    if table is None or len(rows) < 2:
        return {}
    return {
        "correlation": {
            **table,
            "inputs": [table["inputs"][k] for k in rows],
            "matrix": [[table["matrix"][k][j] for j in rows] for k in rows],
        }
    }


def _named(table: Mapping[str, Any], names: Mapping[str, Any]) -> dict[str, Any]:
    """A table of a stage without the names of variables that are gone."""
    found = dict(table)
    for key in ("groups", "models"):
        if found.get(key) is not None:
            lists = [[name for name in row if name in names] for row in found[key]]
            found[key] = [row for row in lists if row]
    if found.get("optimisation") is not None:
        found["optimisation"] = [name for name in found["optimisation"] if name in names]
    if found.get("parameter") not in (None, *names):
        found = {key: value for key, value in found.items() if key not in ("parameter", "groups")}
    return found

"""Effects that a scene could do without: what each is, and the scene with some of them off.

An effect that has a cheaper model is there more than once: as a whole, and as what its model has beyond the cheaper one.
"""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.base.pieces import periodic
from hpcclear.scene.curves import Curve
from hpcclear.scene.driving import CrankTorque, speed_entry
from hpcclear.scene.fields import Content
from hpcclear.scene.loads.declared import SizedLoad
from hpcclear.scene.paths import replace
from hpcclear.scene.planar import Planar, turns_of
from hpcclear.scene.scene import Scene, scene_of

GENTLE_RAMP = 50.0
"""Friction coefficient over ramp speed, s/m, that a steeper ramp is widened to: half of what calls for implicit steps."""

FEW_MODES = (2, 1)
"""Modes that a bar which bends in more of them is tried with."""


@dataclass(frozen=True)
class Switch:
    """An effect that is on and may be switched off."""

    name: str
    """What goes with it, in words."""
    changes: Mapping[str, object]
    """What switches it off: entries to replace; None removes one."""
    moved: Mapping[str, str] = field(default_factory=dict)
    """Numbers that stand elsewhere with the effect off."""
    joint: str | None = None
    """The joint whose clearance it is."""

    def path(self, path: str) -> str | None:
        """Where a number of the scene stands with the effect off; None if nowhere."""
        return self.moved.get(path) if any(_holds(key, path) for key in self.changes) else path

    @property
    def stiff(self) -> bool:
        """Whether a motion may be stiff for it: it is of a joint, of friction or contact there, or of a bar that bends."""
        parts = ("joints.", "mechanism.joints.", "effects.friction", "effects.contact")
        return any(key.startswith(parts) or ".bending" in key for key in self.changes)

    def excludes(self, other: "Switch") -> bool:
        """Whether both change the same entries, as two models of one effect do, or clearance and film of a joint."""
        pairs = itertools.product(self.changes, other.changes)
        return any(_holds(key, own) or _holds(own, key) for key, own in pairs)


def _holds(key: str, path: str) -> bool:
    """Whether an entry is, or is in, what stands at a key."""
    return path == key or path.startswith(f"{key}.")


def switches(scene: Scene) -> tuple[Switch, ...]:
    """All effects that may be switched off, joints first; not the clearances of ``numerics.objective_joints``."""
    return (
        *_clearances(scene), *_films(scene), *_surfaces(scene), *_frictions(scene), *_contacts(scene),
        *_bendings(scene), *_outside(scene), *_drives(scene),
    )  # fmt: skip


def _clearances(scene: Scene) -> Iterator[Switch]:
    for label in scene.clearance_joints():
        if any(label == one.partition(".")[0] for one in scene.numerics.objective_joints):
            continue
        joint = scene.clearance_joint(label)
        ideal = joint.ideal()
        if ideal is None:
            continue
        own = (name for name in type(ideal).model_fields if name in ideal.model_fields_set)
        entries: Content | None = {name: getattr(ideal, name) for name in own if name != "name"}
        if scene.template is not None:
            entries = {"kind": "ideal"} if joint.round else None
        yield Switch(f"clearance in {label}", {scene.joint_key(label): entries}, joint=label)


def _films(scene: Scene) -> Iterator[Switch]:
    for label, film in scene.films().items():
        key = f"{scene.joint_key(label)}.film"
        yield Switch(f"oil film in {label}", {key: None})
        slender = 0.5 * film.length / scene.pin(label).bearing_radius
        for words, model in () if film.law.simpler is None else film.law.simpler(slender):
            yield Switch(f"{words} in {label}", {f"{key}.model": model})


def _surfaces(scene: Scene) -> Iterator[Switch]:
    """Shapes that are not round; and wear, which changes no motion and still costs, unless lives are followed."""
    for label in scene.clearance_joints():
        joint, key = scene.clearance_joint(label), scene.joint_key(label)
        if joint.out_of_round is not None:
            yield Switch(f"waves around {label}", {f"{key}.out_of_round": None})
        if joint.wear is not None and scene.wear is None:
            yield Switch(f"wear of {label}", {f"{key}.wear": None})


def _bendings(scene: Scene) -> Iterator[Switch]:
    for key, table in scene.bending().items():
        name = key.rpartition(".")[2]
        yield Switch(f"bending of {name}", {f"{key}.bending": None})
        for modes in FEW_MODES:
            if modes < table.modes:
                few = "one mode" if modes == 1 else f"{modes} modes"
                yield Switch(f"bending of {name} beyond {few}", {f"{key}.bending.modes": modes})


def _frictions(scene: Scene) -> Iterator[Switch]:
    """Friction in joints, and what a law has beyond Coulomb's with a ramp that explicit steps follow."""
    law, key = scene.effects.friction, "effects.friction"
    if not scene.clearance_joints() or law.law == "none":
        return
    yield Switch("friction in joints", {key: {"law": "none"}})
    if law.declared.simpler is None:
        return
    for words, table in law.declared.simpler(law.values(), lambda c: c / GENTLE_RAMP):
        if "law" not in table:
            yield Switch(words, {f"{key}.{name}": value for name, value in table.items()})
            continue
        kept = {name for name in table if law.value(name) == table[name]}
        yield Switch(words, {key: table}, {f"{key}.{name}": f"{key}.{name}" for name in kept})


def _contacts(scene: Scene) -> Iterator[Switch]:
    """What the contact law does beside its elastic force."""
    table = scene.effects.contact if scene.clearance_joints() else None
    if table is None or not table.declared.without_loss:
        return
    law = table.declared
    if law.lossless is None or not law.lossless(table.values()):
        kept: Content = {"minimum_impact_speed": table.minimum_impact_speed}
        elastic: Content = {"law": law.without_loss}
        if law.geometry is not None:
            kept |= {one.name: table.value(one.name) for one in law.geometry.parameters}
            elastic |= {"geometry": table.geometry, "curve": table.curve}
        moved = {path: path for path in (f"effects.contact.{name}" for name in kept)}
        yield Switch("contact damping", {"effects.contact": elastic | kept}, moved)


def _outside(scene: Scene) -> Iterator[Switch]:
    effects, mechanism = scene.effects, scene.mechanism
    if effects.gravity > 0.0:
        yield Switch("gravity", {"effects.gravity": 0.0})
    if effects.slider_load is not None:
        yield Switch("slider load", {"effects.slider_load": None})
        yield from _mean(scene, "slider load", "effects.slider_load", effects.slider_load, 0)
    for key, (words, _) in scene.joint_frictions().items():
        yield Switch(words, {key: None})
    for key, words in scene.joint_effects().items():
        yield Switch(words, {key: None})
    if isinstance(mechanism, Planar):
        for load in mechanism.loads:
            key = f"mechanism.loads.{load.name}"
            yield Switch(f"{load.kind} {load.name}", {key: None})
            if isinstance(load, SizedLoad):
                entry, turns = load.size_entry, 1 if load.angle_of else 0
                yield from _mean(scene, load.name, f"{key}.{entry}", getattr(load, entry), turns)


def _mean(scene: Scene, name: str, key: str, curve: Curve | None, turns: int) -> Iterator[Switch]:
    """Replace a load that is tabulated over some turns, 0 for those of the scene, by the mean of the curve that acts."""
    if isinstance(curve, tuple):
        length = 2.0 * np.pi * (turns or turns_of(scene.linkage))
        mean = periodic(curve, length, scene.numerics.interpolation).mean()
        yield Switch(f"variation of {name}", {key: mean})


def _drives(scene: Scene) -> Iterator[Switch]:
    """A free crank, in whose place one turns at the speed that is expected of it, or that it starts with."""
    for drive in scene.linkage.drives:
        if not isinstance(drive, CrankTorque):
            continue
        key = scene.path_in_scene(f"mechanism.drives.{drive.name}")
        whose = "" if key == "drive" else f" of {drive.name}"
        names = ("turns",) if key == "drive" else ("body", "period", "turns")
        entry = speed_entry(drive)
        table = {name: getattr(drive, name) for name in names}
        table |= {"kind": "constant-speed", "speed": getattr(drive, entry)}
        yield Switch(f"speed fluctuation{whose}", {key: table}, {f"{key}.{entry}": f"{key}.speed"})
        if drive.torque is not None:
            yield from _mean(scene, f"torque{whose}", f"{key}.torque", drive.torque, 0)


class Off:
    """A scene with some of its effects off, and where the numbers of the whole one stand in it.

    The study of `scene` varies what is left; a design variable that drives nothing any more is gone.
    Raises InputError: without them the scene is none, or its study has nothing left to vary or to optimise.
    """

    def __init__(self, scene: Scene, off: Sequence[Switch]) -> None:
        self._off = list(off)
        joints = {one.joint for one in off if one.joint is not None}
        if joints and joints == set(scene.clearance_joints()):  # where alone friction acts
            self._off.append(Switch("", {"effects.friction": {"law": "none"}}))
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
        return scene_of(content, scene)

    def _study(self, scene: Scene, content: Content) -> Content:
        """The study's table without the paths that are gone, nor names that drive nothing."""
        study = scene.required_study
        left: dict[str, Content] = {}
        for table, rows in (("variables", study.variables), ("random", study.random)):
            left[table] = {}
            for row in rows:
                paths = self.paths(row.paths)
                own = content[table][row.name]
                if paths:
                    same = paths == row.paths
                    left[table][row.name] = own if same else {**own, "paths": list(paths)}
        cases: Content = {}
        for case in study.cases:
            if random := [name for name in case.random if name in left["random"]]:
                cases[case.name] = {**content["cases"][case.name], "random": random}
        if not left["variables"] or (study.cases and not cases):
            raise InputError("study", None, "no variable is left", "Keep the effect that it varies")
        kept = {key: value for key, value in content.items() if key != "correlation"} | left
        for stage in ("sensitivity", "surrogate"):
            kept[stage] = _named(content[stage], left["variables"])
        if study.cases:
            kept["cases"] = cases
        whole = content.get("correlation") or {"inputs": []}
        places = [k for k, name in enumerate(whole["inputs"]) if name in left["random"]]
        if len(places) > 1:
            inputs = [whole["inputs"][k] for k in places]
            matrix = [[whole["matrix"][k][j] for j in places] for k in places]
            kept["correlation"] = {**whole, "inputs": inputs, "matrix": matrix}
        return kept


def _named(table: Content, names: Content) -> Content:
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

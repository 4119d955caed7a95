"""What a scene file says, table by table: the numbers, and what follows from them alone."""

import hashlib
import json
from collections.abc import Iterable
from functools import cached_property
from typing import Annotated, Any, ClassVar, Literal, cast

from pydantic import Field, PrivateAttr

from hpcclear.base.errors import InputError
from hpcclear.base.objectives import MEAN_GAP, Objective, band_of, bound
from hpcclear.base.outcome import IMPACTS, LEVELS, RESPONSES
from hpcclear.base.units import is_written_in
from hpcclear.base.written import Reading, Texts, reading, shown, text_of
from hpcclear.plugins import OBJECTIVES
from hpcclear.scene import slider_crank
from hpcclear.scene.about import About, inputs_of
from hpcclear.scene.choices import input_entry
from hpcclear.scene.contacts.declared import AlongLine, Get, Shape
from hpcclear.scene.contacts.pin_in_bearing import PlanarClearance
from hpcclear.scene.effects import EffectTables
from hpcclear.scene.fields import Content, NamedRows, Table, nearest
from hpcclear.scene.loads.declared import loads_of
from hpcclear.scene.named import SHORT_NAMES
from hpcclear.scene.numerics import Numerics, Output
from hpcclear.scene.paths import PHYSICAL, flatten, of_kinds, quantities
from hpcclear.scene.planar import BarBending, Planar, is_loose
from hpcclear.scene.plugged import Plugins
from hpcclear.scene.slider_crank import CrankJoints, Drive, SliderCrank
from hpcclear.scene.study import Study
from hpcclear.scene.surfaces import Film, Lives


class SceneTables(Table):
    """The tables of a scene file, each valid by itself; SI numbers, frozen."""

    format_version: Literal[1, 2] = 1
    """Version of the format; 2 is read as 1."""
    about: About | None = None
    mechanism: Annotated[SliderCrank | Planar, Field(discriminator="kind")]
    """A slider-crank, or any planar linkage."""
    # A planar linkage has its drives and joints among its own tables; of a slider-crank neither is None.
    drive: Drive = cast(Any, None)
    """Drive of a slider-crank, required there. A linkage has `mechanism.drives` instead."""
    joints: CrankJoints = cast(Any, None)
    """Joints of a slider-crank, required there. A linkage has `mechanism.joints` instead. The joint of crank and frame
    is always ideal."""
    effects: EffectTables = EffectTables()
    numerics: Numerics = Numerics()
    output: Output = Output()
    study: Study | None = None
    wear: Lives | None = None
    plugins: Plugins | None = None

    elsewhere: ClassVar = {
        key: (f"belongs to [{part}]", f"Write {part}.{key}")
        for part, table in (("numerics", Numerics), ("effects", EffectTables), ("study", Study))
        for key in table.model_fields
    }

    _readings: tuple[Reading, ...] = PrivateAttr(())
    _texts: Texts = PrivateAttr(default_factory=dict)

    @property
    def required_study(self) -> Study:
        """The study of a scene that needs one; raises InputError if it has none."""
        if self.study is None:
            remedy = "Add [study] and [study.variables], as in jobs/quickstart.toml"
            more = "hpcclear sample also takes designs from a table (--points)"
            raise InputError("study", None, "the scene has no study", f"{remedy}; {more}")
        return self.study

    @property
    def required_wear(self) -> Lives:
        """The wear of a scene that needs it; raises InputError if it has none."""
        if self.wear is None:
            remedy = "Add [wear], as in jobs/wear.toml"
            raise InputError("wear", None, "the scene has no [wear] table", remedy)
        return self.wear

    @property
    def objective(self) -> Objective:
        """What each sample is judged by: the study's objective, f where there is no study."""
        named = self.numerics.objective if self.study is None else self.study.objective
        return self.objective_named(named or MEAN_GAP.name)

    @property
    def objective_key(self) -> str:
        """The entry that names it."""
        return "numerics.objective" if self.study is None else "study.objective"

    def objective_named(self, name: str) -> Objective:
        """An objective, of the joints that count here."""
        chosen = self.numerics.objective_joints
        joints = tuple(map(self.joint_labels.index, self._contacts_in(chosen)))
        known = OBJECTIVES.get(name, self.plugin_texts)
        return bound(known, name, self.open_places, joints, chosen)

    def responses_asked(self) -> bool:
        """Whether each sample records more than gaps and peak forces: requested, or required by the study."""
        return self.numerics.responses or self._asks_any(RESPONSES) or self.impacts_asked()

    def impacts_asked(self) -> bool:
        """Whether each sample records measures of impact and noise: ``numerics.impacts``, or what the study requires of it."""
        return self.numerics.impacts or self._asks_any((*IMPACTS, *LEVELS)) or bool(self.bands())

    def bands(self) -> tuple[float, ...]:
        """Middles of the third-octave bands whose levels each sample records, Hz: requested, or required by the study."""
        asked = {band_of(one) for one in self.numerics.levels}
        return tuple(sorted(asked | {one.band for one in self._objectives().values()} - {0.0}))

    def _asks_any(self, fields: Iterable[str]) -> bool:
        """Whether an objective or response of the study needs one of some fields of a record."""
        return any(not one.asks.isdisjoint(fields) for one in self._objectives().values())

    def _objectives(self) -> dict[str, Objective]:
        """The objective, and the further responses of the study, by the entries that name them."""
        named = {self.objective_key: self.objective}
        for case in () if self.study is None else self.study.cases:
            goals = {place: goal.of for place, goal in case.rows.items() if goal.of is not None}
            key = f"study.cases.{case.name}"
            named |= {f"{key}.{at}.of": self.objective_named(of) for at, of in goals.items()}
        return named

    def worn_joints(self) -> tuple[str, ...]:
        """Labels of the joints that wear, in the order of `clearance_joints`."""
        return tuple(name for name, joint in self._loose.items() if joint.wear is not None)

    def films(self) -> dict[str, Film]:
        """Oil films by the labels of their joints."""
        return {name: one.film for name, one in self._loose.items() if one.film is not None}

    @property
    def plugin_texts(self) -> dict[str, str]:
        """Source texts of the Python files that this scene names, by module."""
        return {} if self.plugins is None else {row.name: row.source for row in self.plugins.files}

    @property
    def bristles(self) -> int:
        """Contacts whose friction has bristles, each with a coordinate of its own before those of the mechanism; a bristle's
        deflection is the velocity of its coordinate, so that steppers need no other kind of state."""
        return len(self.contact_labels()) if self.effects.friction.declared.bristled else 0

    def bending(self) -> dict[str, BarBending]:
        """How bodies bend, by the dotted paths of the bodies that do."""
        own = {one.name: one.bending for one in self.linkage.bodies if one.bending is not None}
        return {self.path_in_scene(f"mechanism.bodies.{n}"): table for n, table in own.items()}

    @property
    def modes(self) -> int:
        """Modes of bending of all bodies, each a coordinate."""
        return sum(table.modes for table in self.bending().values())

    @property
    def mode_labels(self) -> tuple[str, ...]:
        """Labels along the dimension ``mode``: "rod.1" and so on, in the order of the coordinates."""
        bars = {key.rpartition(".")[2]: table.modes for key, table in self.bending().items()}
        return tuple(f"{bar}.{k}" for bar, modes in bars.items() for k in range(1, modes + 1))

    @property
    def has_thresholds(self) -> bool:
        """Whether some joint wears from a pressure on only."""
        return any(getattr(one.wear, "threshold", None) is not None for one in self._loose.values())

    def waves(self) -> dict[str, int]:
        """How many waves bearings and journals have around them at most: in the scene, or as wear makes them."""
        found = {}
        for surface in ("bearing", "journal"):
            shapes = [getattr(one.out_of_round, surface, None) for one in self._loose.values()]
            worn = any(getattr(one.wear, surface, None) for one in self._loose.values())
            by_wear = self.wear.waves if self.wear is not None and worn else 0
            found[surface] = max([by_wear, *(one.given() for one in shapes if one is not None)])
        return found

    @property
    def template(self) -> Any:
        """The module of the template that writes this scene's linkage, `slider_crank`; None where the scene has its tables."""
        return None if isinstance(self.mechanism, Planar) else slider_crank

    @cached_property
    def linkage(self) -> Planar:
        """The mechanism by bodies, joints, drives and loads, as the scene has it or its template writes it."""
        if isinstance(self.mechanism, Planar):
            return self.mechanism
        return slider_crank.linkage_of(self.mechanism, self.drive, self.joints, self.effects)

    @cached_property
    def _loose(self) -> dict[str, Any]:
        """Tables of the joints with clearance by their names."""
        return {joint.name: joint for joint in self.linkage.joints if is_loose(joint)}

    def path_in_linkage(self, path: str) -> str:
        """The entry of `linkage`, below ``mechanism``, that an entry of the scene stands for; itself if it stands for none."""
        return path if self.template is None else str(self.template.path_in_linkage(path))

    def path_in_scene(self, path: str) -> str:
        """The entry of the scene that stands for an entry of `linkage`, below ``mechanism``."""
        return path if self.template is None else str(self.template.path_in_scene(path))

    def clearance_joints(self) -> tuple[str, ...]:
        """Names of the joints with clearance, O12 before O23; those of a linkage in file order."""
        return tuple(self._loose)

    def contact_labels(self) -> tuple[str, ...]:
        """Labels of the contacts in them: the name of a pin, "NAME.front_left" and so on of a guide's corners or a
        slot's walls."""
        return self._contacts_in(self.clearance_joints())

    def _contacts_in(self, joints: tuple[str, ...]) -> tuple[str, ...]:
        """Labels of the contacts of joints; labels of contacts stay as they are."""
        found: list[str] = []
        for name in joints:
            corners = () if "." in name else self.clearance_joint(name).corners
            found += [f"{name}.{word}" for word in corners] or [name]
        return tuple(found)

    def pins(self) -> tuple[str, ...]:
        """Names of the joints with clearance that are pins in bearings."""
        return tuple(name for name, joint in self._loose.items() if joint.round)

    def guides(self) -> tuple[str, ...]:
        """Names of the guides and slots with clearance."""
        return tuple(name for name, joint in self._loose.items() if isinstance(joint, AlongLine))

    @property
    def joint_labels(self) -> tuple[str, ...]:
        """Labels along the dimension ``joint`` of this scene's datasets: the contacts; of a slider-crank without a guide among
        them both joints, whether open or not."""
        template = self.template
        return self.contact_labels() if template is None or self.guides() else (*template.JOINTS,)

    @property
    def open_places(self) -> tuple[int, ...]:
        """Where contacts stand among `joint_labels`, one behind the other."""
        return tuple(map(self.joint_labels.index, self.contact_labels()))

    def joint_key(self, label: str) -> str:
        """Dotted path of the table of a joint, or of a contact's joint."""
        return self.path_in_scene(f"mechanism.joints.{label.partition('.')[0]}")

    def joint_frictions(self) -> dict[str, tuple[str, float]]:
        """Words and coefficient of friction in joints without clearance, by the dotted paths of its tables."""
        found = {}
        for one in self.linkage.joints:
            if (rubs := getattr(one, "friction", None)) is not None:
                kind = "guide" if one.kind == "slide" else "pin"
                key = self.path_in_scene(f"mechanism.joints.{one.name}.friction")
                where = "" if key == "effects.guide_friction" else f" in {one.name}"
                found[key] = f"{kind} friction{where}", rubs.coefficient
        return found

    def joint_effects(self) -> dict[str, str]:
        """Words of effects that joints have as tables of their own, by the dotted paths of these."""
        found = {}
        for one in loads_of(self.linkage.joints):
            name, words = one.joint.name, one.effect.words
            found[f"{self.joint_key(name)}.{one.entry}"] = f"{words} in {name}"
        return found

    def pin(self, name: str) -> PlanarClearance:
        """The table of a pin in a bearing."""
        found = self.clearance_joint(name)
        assert isinstance(found, PlanarClearance)
        return found

    def clearance_joint(self, label: str) -> Any:
        """The table of a joint with clearance, or of a contact's joint."""
        return self._loose[label.partition(".")[0]]

    def shape(self, label: str, get: Get) -> Shape:
        """Numbers of a contact's shape; `get`: those of an entry of the scene, by its path."""
        key, joint = self.joint_key(label), self.clearance_joint(label)
        return cast(Shape, joint.shape(lambda name: get(f"{key}.{name}")))

    @property
    def slider_crank(self) -> SliderCrank:
        """The tables of a scene that has a slider-crank."""
        assert isinstance(self.mechanism, SliderCrank)
        return self.mechanism

    @cached_property
    def hash(self) -> str:
        """SHA-256 of the inputs: spelling, comments and units of the file do not matter, nor does [about]."""
        # The order of keys stays as it is: tables have the model's order, and the order of
        # study variables is the order of the columns of their design, so it has to count.
        content = json.dumps(inputs_of(self.resolved()), ensure_ascii=True, allow_nan=False)
        return hashlib.sha256(content.encode()).hexdigest()

    def resolved(self) -> Content:
        """The whole content as plain nested dicts, lists, numbers (SI) and strings, defaults filled in."""
        content: Content = plain(self)
        # A name's own paths are left out, so that C follows when a joint is made ideal.
        open_paths = [f"{self.joint_key(name)}.clearance" for name in self.clearance_joints()]
        for table in ("variables", "random"):
            for name, row in content.get("study", {}).get(table, {}).items():
                paths = SHORT_NAMES.get(name, ())
                own = [p for p in paths if p in open_paths or not p.startswith("joints.")]
                if row["paths"] == own:
                    del row["paths"]
        return content

    def numeric_paths(self) -> tuple[str, ...]:
        """Dotted paths of every physical number of this scene: what a study may vary."""
        return tuple(self._numbers)

    def number(self, path: str) -> float:
        """The physical number at a dotted path, SI; raises InputError if the scene has no number there."""
        if path not in self._numbers:
            short = [one for one, paths in SHORT_NAMES.items() if self._numbers.keys() & {*paths}]
            remedy = nearest(path, (*self.numeric_paths(), *short))
            raise InputError("path", path, "is not a number of this scene", remedy)
        return self._numbers[path]

    def baseline(self, name: str) -> float:
        """Where the scene itself is in the column of a study variable: its number, SI, or the row of its table.

        Raises InputError: the scene's own numbers are not among its rows.
        """
        study = self.required_study
        variable = study.variable(name)
        if variable.paths:
            return self.number(variable.paths[0])
        values = {path: self.number(path) for path in study.own_entries(variable)}
        for path in variable.input_paths:
            of, entry = input_entry(path)
            value: Any = study.random_input(of)
            for part in entry.split("."):
                value = None if value is None else getattr(value, part)
            values[path] = value
        if not variable.rows:
            found = next(iter(values.values()))
            return 1.0 if found is None else float(found)  # of a bore or pin without entries
        for k, row in enumerate(variable.rows):
            if all(_alike(row.entries[path], value) for path, value in values.items()):
                return float(k)
        listed = ", ".join(f"{path} = {value}" for path, value in values.items())
        reason = "the value of the scene is not among its rows"
        remedy = "Write the values of one row into the scene: that is the baseline design"
        raise InputError(f"study.variables.{name}", listed, reason, remedy)

    def unit(self, path: str) -> str:
        """The SI unit of the physical number at a dotted path, "" for none; errors as `number`."""
        self.number(path)
        own = self.effects.law_unit(path)
        if own is not None:
            return own
        loads = {one.name: {"kind": one.kind} for one in getattr(self.mechanism, "loads", ())}
        with of_kinds({"mechanism": {"loads": loads}}):
            return quantities()[path].unit

    def shown(self, path: str, value: float | None = None) -> str:
        """The number at a dotted path as it was written, or another value of it (SI) in its unit; errors as `number`."""
        own, unit = self.number(path), self.unit(path)
        with reading(self._texts):
            return shown(own if value is None else value, unit, is_written_in(text_of(own, unit)))

    def in_unit(self, value: float, unit: str) -> str:
        """A number in SI as the scene has it written, or in the unit of such numbers there."""
        with reading(self._texts):
            return shown(value, unit)

    @property
    def written(self) -> Texts:
        """What was written for its numbers, by their values and units in SI."""
        return self._texts

    @cached_property
    def _numbers(self) -> dict[str, float]:
        tables = {name: plain(getattr(self, name)) or {} for name in PHYSICAL}
        known = quantities()
        return {p: one for p, one in flatten(tables) if p in known and isinstance(one, float)}


def _alike(one: object, other: object) -> bool:
    """Whether two entries are the same, numbers to their last digits."""
    if isinstance(one, float) and isinstance(other, float):
        return abs(one - other) <= 1e-9 * max(abs(one), abs(other))
    return bool(one == other)


def plain(value: object) -> Any:
    """Models as dicts without unset entries, tuples as lists, named rows as a table by name."""
    if isinstance(value, tuple):
        return [plain(item) for item in value]
    if not isinstance(value, Table):
        return value
    content = {}
    for name, field in type(value).model_fields.items():
        entry = plain(getattr(value, name))
        if any(isinstance(part, NamedRows) for part in field.metadata):
            entry = {row.pop("name"): row for row in entry}
        if entry is not None:
            content[name] = entry
    own = {name: plain(entry) for name, entry in (value.__pydantic_extra__ or {}).items()}
    return {"law": content["law"], **own, **content} if own else content

"""The scene: one validated, frozen description of what is simulated."""

import hashlib
import json
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

from pydantic import PrivateAttr, ValidationError, field_validator, model_validator

from hpcclear.base.errors import InputError
from hpcclear.base.outcome import RESPONSES
from hpcclear.scene import describing, domain
from hpcclear.scene.effects import Effects
from hpcclear.scene.fields import NamedRows, Table, nearest, problem
from hpcclear.scene.mechanism import ClearanceJoint, Drive, Joints, Mechanism
from hpcclear.scene.numerics import Numerics, Output
from hpcclear.scene.paths import PHYSICAL, flatten, quantities, replace
from hpcclear.scene.study import Study
from hpcclear.scene.toml import to_toml
from hpcclear.scene.variables import PAPER_PATHS


class Scene(Table):
    """A scene file, validated: SI numbers, frozen, equal when its content is equal.

    Make one with `load_scene`; change one with `with_`, which validates anew.
    """

    format_version: Literal[1] = 1
    mechanism: Mechanism
    drive: Drive
    joints: Joints
    effects: Effects = Effects()
    numerics: Numerics = Numerics()
    output: Output = Output()
    study: Study | None = None

    elsewhere: ClassVar = {
        key: (f"belongs to [{part}]", f"Write {part}.{key}")
        for part, table in (("numerics", Numerics), ("effects", Effects), ("study", Study))
        for key in table.model_fields
    }

    _text: str = PrivateAttr("")
    _known_numbers: dict[str, float] | None = PrivateAttr(None)

    @field_validator("format_version", mode="before")
    @classmethod
    def _version_is_a_number(cls, value: Any) -> Any:
        if isinstance(value, bool):  # equal to 1 in Python
            raise problem("true or false is no version", "Write format_version = 1")
        return value

    @model_validator(mode="before")
    @classmethod
    def _clearance_of_open_joints(cls, data: Any) -> Any:
        """Without a path of its own, C drives the clearances there are."""
        try:
            ideal = [
                name
                for name in ("crank_rod", "rod_slider")
                if data["joints"][name]["kind"] == "ideal"
            ]
            tables = {
                key: data["study"][key] for key in ("variables", "random") if key in data["study"]
            }
        except (KeyError, TypeError):
            return data  # the models below say what is wrong with it
        if len(ideal) != 1:
            return data
        paths = [path for path in PAPER_PATHS["C"] if f".{ideal[0]}." not in path]
        for key, table in tables.items():
            row = table.get("C") if isinstance(table, Mapping) else None
            if isinstance(row, Mapping) and "path" not in row and "paths" not in row:
                data = replace(data, f"study.{key}.C", {**row, "paths": paths})
        return data

    @model_validator(mode="after")
    def _effects_fit_joints(self) -> "Scene":
        clearance = self.clearance_joints()
        if clearance and self.effects.contact is None:
            raise problem(
                "a clearance joint needs a contact law",
                'Add contact = { law = "lankarani-nikravesh", restitution = 0.9 }, '
                "or make both joints ideal",
                key="effects.contact",
                value=None,
            )
        if not clearance and self.effects.friction.law != "none":
            raise problem(
                "friction acts in joints with clearance, and both joints are ideal",
                'Set effects.friction.law = "none", or give a joint kind = "clearance"',
                key="effects.friction.law",
                value=self.effects.friction.law,
            )
        return self

    @model_validator(mode="after")
    def _study_fits_mechanism(self) -> "Scene":
        if self.study is None:
            return self
        numbers = self._numbers()
        for table, rows in (("variables", self.study.variables), ("random", self.study.random)):
            for row in rows:
                for path in row.paths:
                    if path not in numbers:
                        raise problem(
                            f"drives {path}, and this scene has no number there",
                            "Give that entry a value first, or remove the variable",
                            key=f"study.{table}.{row.name}",
                        )
        self._check_corners()
        try:
            domain.box(self, widen=tuple(row.name for row in self.study.random))
        except InputError as error:
            raise problem(error.reason, error.remedy, error.key, error.value) from None
        return self

    def _check_corners(self) -> None:
        """Each bound of each variable, widened by its random half-width, must still make a
        mechanism."""
        assert self.study is not None
        content = {name: _plain(getattr(self, name)) for name in (*PHYSICAL, "numerics")}
        reach = {row.name: 0.0 if row.absolute else row.reach for row in self.study.random}
        spans = {
            variable.name: ("variables", variable.paths, variable.range)
            for variable in self.study.variables
            if variable.range is not None
        }
        for row in self.study.random:
            if row.name not in self.study.names:
                centre = self.number(row.paths[0]) if row.centre is None else row.centre
                reach[row.name] = row.reach
                spans[row.name] = ("random", row.paths, (centre, centre))
        for name, (table, paths, (lower, upper)) in spans.items():
            corners = [(table, lower), (table, upper)]
            if width := reach.get(name, 0.0):
                corners += [("random", lower - width), ("random", upper + width)]
            for key, value in corners:
                corner: Mapping[str, Any] = content
                for path in paths:
                    corner = replace(corner, path, value)
                try:
                    Scene.model_validate(corner)
                except ValidationError as error:
                    context = error.errors(include_url=False)[0].get("ctx", {})
                    reason = context.get("reason", "it is not valid")
                    raise problem(
                        f"reaches {name} = {value:g}, which makes no mechanism: {reason}",
                        "Narrow it",
                        key=f"study.{key}.{name}",
                    ) from None

    def responses_asked(self) -> bool:
        """Whether each sample records more than gaps and peak forces: ``numerics.responses``, or the study's objective."""
        asked = {name.replace("_", "-") for name in RESPONSES}
        by_study = self.study is not None and self.study.objective in asked
        return self.numerics.responses or by_study

    def clearance_joints(self) -> tuple[str, ...]:
        """Labels of the joints with clearance, O12 before O23."""
        return tuple(
            name
            for name in ("crank_rod", "rod_slider")
            if isinstance(getattr(self.joints, name), ClearanceJoint)
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is allowed and still deserves a look, a sentence each."""
        return tuple(describing.warnings(self))

    def effects_on(self) -> tuple[str, ...]:
        """What is on, in words, one entry an effect."""
        return tuple(describing.effects_on(self))

    @property
    def text(self) -> str:
        """The TOML text this scene came from, after a comment line for each change made to it."""
        return self._text

    @property
    def hash(self) -> str:
        """SHA-256 of the resolved content: spelling, comments and units of the file do not
        matter."""
        # The order of keys stays as it is: tables have the model's order, and the order of study
        # variables is the order of the columns of their design, so it has to count.
        content = json.dumps(self.resolved(), ensure_ascii=True, allow_nan=False)
        return hashlib.sha256(content.encode()).hexdigest()

    def resolved(self) -> dict[str, Any]:
        """The whole content as plain nested dicts, lists, numbers (SI) and strings, defaults filled
        in."""
        content: dict[str, Any] = _plain(self)
        # A name's own paths are left out, so that C follows when a joint is made ideal.
        open_paths = [f"joints.{name}.clearance" for name in self.clearance_joints()]
        for table in ("variables", "random"):
            for name, row in content.get("study", {}).get(table, {}).items():
                paths = PAPER_PATHS.get(name, ())
                own = [p for p in paths if p in open_paths or not p.startswith("joints.")]
                if row["paths"] == own:
                    del row["paths"]
        return content

    def to_toml(self) -> str:
        """TOML text of the resolved content; loading it gives an equal scene."""
        return to_toml(self.resolved())

    def with_(self, changes: Mapping[str, Any] | None = None, /, **more: Any) -> "Scene":
        """A new, validated scene with some entries replaced.

        Parameters
        ----------
        changes, more : mapping of dotted path to value
            ``with_({"joints.crank_rod.clearance": 1e-3})``; values may be strings with a unit,
            tables replace what stood there, None removes an entry.

        Raises
        ------
        InputError
            As `load_scene`.
        """
        from hpcclear.scene.loading import changed  # loading builds on this module

        return changed(self, {**(changes or {}), **more})

    def numeric_paths(self) -> tuple[str, ...]:
        """Dotted paths of every physical number of this scene: what a study may vary."""
        return tuple(self._numbers())

    def number(self, path: str) -> float:
        """The physical number at a dotted path, SI.

        Raises
        ------
        InputError
            If the scene has no number there.
        """
        numbers = self._numbers()
        if path not in numbers:
            raise InputError(
                "path", path, "is not a number of this scene", nearest(path, tuple(numbers))
            )
        return numbers[path]

    def unit(self, path: str) -> str:
        """The SI unit of the physical number at a dotted path, "" for none; errors as `number`."""
        self.number(path)
        return quantities()[path].unit

    def _numbers(self) -> Mapping[str, float]:
        if self._known_numbers is None:  # a scene never changes, and a swarm asks often
            tables = {name: _plain(getattr(self, name)) for name in PHYSICAL}
            known = quantities()
            self._known_numbers = {
                path: value
                for path, value in flatten(tables)
                if path in known and isinstance(value, float)
            }
        return self._known_numbers

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Scene) and self.resolved() == other.resolved()

    def __hash__(self) -> int:
        return hash(self.hash)


def _plain(value: Any) -> Any:
    """Models as dicts without unset entries, tuples as lists, named rows as a table by name."""
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    if not isinstance(value, Table):
        return value
    content = {}
    for name, field in type(value).model_fields.items():
        entry = _plain(getattr(value, name))
        if any(isinstance(part, NamedRows) for part in field.metadata):
            entry = {row.pop("name"): row for row in entry}
        if entry is not None:
            content[name] = entry
    return content

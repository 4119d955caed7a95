"""The scene: one validated, frozen description of what is simulated."""

import hashlib
import json
from collections.abc import Mapping
from typing import Any, Literal

from pydantic import PrivateAttr, model_validator

from hpcclear.errors import InputError
from hpcclear.scene.fields import Table, nearest, problem
from hpcclear.scene.models import (
    ClearanceJoint,
    Drive,
    Effects,
    Joints,
    Mechanism,
    Numerics,
    Output,
)
from hpcclear.scene.paths import PHYSICAL, flatten, quantities
from hpcclear.scene.writing import to_toml

FORMAT_VERSION = 1


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

    _text: str = PrivateAttr("")

    @model_validator(mode="after")
    def _effects_fit_joints(self) -> "Scene":
        clearance = self.clearance_joints()
        if clearance and self.effects.contact is None:
            raise problem(
                "a clearance joint needs a contact law",
                'Add [effects.contact] with law = "lankarani-nikravesh" and restitution = 0.9, or make both joints ideal',
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

    def clearance_joints(self) -> tuple[str, ...]:
        """Labels of the joints with clearance, O12 before O23."""
        return tuple(
            name
            for name in ("crank_rod", "rod_slider")
            if isinstance(getattr(self.joints, name), ClearanceJoint)
        )

    @property
    def text(self) -> str:
        """The TOML text this scene came from, overrides added as comments."""
        return self._text

    @property
    def hash(self) -> str:
        """SHA-256 of the resolved content: spelling, comments and units of the file do not matter."""
        # The order of keys stays as it is: tables have the model's order, and the order of study variables is the
        # order of the columns of their design, so it has to count.
        content = json.dumps(self.resolved(), ensure_ascii=True, allow_nan=False)
        return hashlib.sha256(content.encode()).hexdigest()

    def resolved(self) -> dict[str, Any]:
        """The whole content as plain nested dicts, lists, numbers (SI) and strings, defaults filled in."""
        return _plain(self)

    def to_toml(self) -> str:
        """TOML text of the resolved content; loading it gives an equal scene."""
        return to_toml(self.resolved())

    def with_(self, changes: Mapping[str, Any] | None = None, /, **more: Any) -> "Scene":
        """A new, validated scene with some entries replaced.

        Parameters
        ----------
        changes, more : mapping of dotted path to value
            ``with_({"joints.crank_rod.clearance": 1e-3})``; values may be strings with a unit, tables replace what stood
            there, None removes an entry.

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

    def _numbers(self) -> dict[str, float]:
        tables = {name: _plain(getattr(self, name)) for name in PHYSICAL}
        known = quantities()
        return {
            path: value
            for path, value in flatten(tables)
            if path in known and isinstance(value, float)
        }

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Scene) and self.resolved() == other.resolved()

    def __hash__(self) -> int:
        return hash(self.hash)


def _plain(value: Any) -> Any:
    """Models as dicts without unset entries, tuples as lists, named rows as a table by name."""
    if isinstance(value, Table):
        entries = {name: _plain(getattr(value, name)) for name in type(value).model_fields}
        return {name: entry for name, entry in entries.items() if entry is not None}
    if isinstance(value, tuple):
        rows = [_plain(item) for item in value]
        if rows and all(isinstance(row, dict) for row in rows):
            return {row.pop("name"): row for row in rows}
        return rows
    return value

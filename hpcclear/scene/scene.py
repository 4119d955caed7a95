"""The scene: one validated, frozen description of what is simulated."""

import contextlib
import json
from collections.abc import Mapping

import numpy as np
import tomli_w
from pydantic import PrivateAttr

from hpcclear.base import markup
from hpcclear.base.errors import InputError, unboxed
from hpcclear.base.outcome import record_type
from hpcclear.base.units import is_written_in, to_si
from hpcclear.base.written import Reading, Texts, reading, shown, text_of, unit_for
from hpcclear.scene import describing
from hpcclear.scene.consistency import ConsistentTables
from hpcclear.scene.fields import Content
from hpcclear.scene.fitted import entry_replaced
from hpcclear.scene.paths import curve_at, flatten, replace
from hpcclear.scene.validation import dotted, scene_of


class Scene(ConsistentTables):
    """A validated scene file with SI numbers. It is immutable; scenes with equal inputs are equal. `load_scene` reads
    one, and `with_` returns a changed copy, validated again.
    """

    _text: str = PrivateAttr("")

    def __reduce__(self) -> tuple[object, ...]:
        """As its content: laws are functions, which are found again where they are needed."""
        return _unpickled, (self.resolved(), self._text, self._readings, self._texts)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is allowed and still deserves a look, a sentence each."""
        return tuple(describing.warnings(self))

    @property
    def readings(self) -> tuple[Reading, ...]:
        """Fits, files, and texts whose unit left open what is meant, and as what each was read."""
        return self._readings

    @property
    def references(self) -> str:
        """Title of the published work the mechanism is taken from, "" for one of its user's own."""
        return describing.cited_by(self)

    @property
    def origin(self) -> dict[str, str]:
        """What files say of it in their attributes: its text and hash, what it was taken from, and what it is about."""
        words = {} if self.about is None else self.about.model_dump(exclude_none=True)
        about = {f"about_{name}": str(text) for name, text in words.items()}
        cited = {"references": self.references} if self.references else {}
        read = {"readings": json.dumps(self._readings)} if self._readings else {}
        return {**cited, **read, "scene": self.text, "scene_hash": self.hash, **about}

    def effects_on(self) -> tuple[str, ...]:
        """What is on, in words, one entry an effect."""
        return tuple(describing.effects_on(self))

    def __repr__(self) -> str:
        """What is simulated, in a line: "Scene(slider-crank, 2 joints with clearance, study of 8 variables, 3f2a...)"."""
        parts: list[str] = [self.mechanism.kind]
        if count := len(self.clearance_joints()):
            parts.append(f"{count} joint{'s' * (count > 1)} with clearance")
        if self.study is not None:
            parts.append(f"study of {', '.join(self.study.names[:8]) or 'random inputs'}")
        return f"Scene({'; '.join(parts)}; hash {self.hash[:16]})"

    __str__ = __repr__

    def _repr_html_(self) -> str:
        """What a notebook shows: mechanism, effects, study and hash."""
        rows: list[tuple[str, str]] = [("mechanism", self.mechanism.kind)]
        rows += [("effect", text) for text in self.effects_on()]
        if self.study is not None:
            rows.append(("study variables", ", ".join(self.study.names)))
        rows += [("warning", text) for text in self.warnings]
        return markup.table("Scene", [*rows, ("scene hash", self.hash[:16])])

    @property
    def text(self) -> str:
        """The TOML text this scene came from, or that says it where entries were replaced, or that came as a mapping."""
        if not self._text:
            self._text = self.to_toml()
        return self._text

    def to_toml(self) -> str:
        """TOML text of the resolved content, quantities as they were written; loading it gives an equal scene."""
        content = self.resolved()
        for path, value in flatten(content):
            pairs = curve_at(path)
            units = self._unit_of(path) if pairs is None else (pairs.x, pairs.unit)
            if units:
                content = replace(content, path, self._as_written(value, units))
        with contextlib.suppress(InputError):
            if scene_of(Scene, content) == self:
                return tomli_w.dumps(content, multiline_strings=True)
        return tomli_w.dumps(self.resolved(), multiline_strings=True)

    def _unit_of(self, path: str) -> str:
        """The SI unit of an entry of the resolved content, "" for one without or of which it is not known."""
        if path in self._numbers:
            return self.unit(path)
        top, table, name, *_ = (*path.split("."), "", "")
        rows = () if self.study is None or top != "study" else getattr(self.study, table, ())
        if table not in ("variables", "random"):
            return ""
        return next((self.unit(one.paths[0]) for one in rows if one.name == name and one.paths), "")

    def _as_written(self, value: object, unit: str | tuple[str, str]) -> object:
        """A number (SI) as a text of the unit that was written, where that reads the same; lists and pairs likewise."""
        if isinstance(value, list):
            pair = isinstance(unit, tuple) and value and isinstance(value[0], float)
            units = unit if pair else [unit] * len(value)
            return [self._as_written(one, its) for one, its in zip(value, units, strict=True)]
        unit = unit if isinstance(unit, str) else unit[1]
        if not isinstance(value, float):
            return value
        with reading(self._texts):
            text = text_of(value, unit) or (unit_for(unit) != unit and shown(value, unit))
        same = text and is_written_in(text) and to_si(text, unit, decided=True) == value
        return text if same else value

    def with_(self, changes: Mapping[str, object] | None = None, /, **more: object) -> "Scene":
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
        content = self.resolved()
        altered = {path: unboxed(one) for path, one in {**(changes or {}), **more}.items()}
        for path, value in altered.items():
            if not dotted(path):
                raise InputError("path", path, "is no dotted path", "Write mechanism.rod.mass, say")
            content = entry_replaced(content, path, value)
        result = scene_of(Scene, content, self)
        known = {one.entry for one in result._readings}
        tables = tuple(path.rpartition(".")[0] + "." for path in altered)
        result._readings += tuple(  # that what stands beside a change does not alter; files are not opened again
            one for one in self._readings
            if one.entry not in known and not f"{one.entry}.".startswith(tables)
        )  # fmt: skip
        return result

    def __eq__(self, other: object) -> bool:
        return self is other or (isinstance(other, Scene) and self.hash == other.hash)

    def __hash__(self) -> int:
        return hash(self.hash)


def _unpickled(content: Content, text: str, readings: tuple[Reading, ...], texts: Texts) -> Scene:
    scene = scene_of(Scene, content)
    scene._text, scene._readings, scene._texts = text, readings, texts
    return scene


def record_of(scene: Scene, mapped: bool = False) -> np.dtype:
    """Type of the record of a sample of a scene: its contacts and bands, and fields of what it requests.

    `mapped`: the motion of each sample is judged, as in a map; by default only with a target error.
    """
    judged = mapped or (scene.numerics.target_error is not None and scene.clearance_joints())
    asked = {
        "response": scene.responses_asked(),
        "impact": scene.impacts_asked(),
        "level": scene.bands(),
        "pressure": scene.effects.has_pressure,
        "rate": scene.objective.rate is not None,
        "wear": scene.worn_joints(),
        "energy": scene.numerics.energy,
        "steady": judged,
        "map": mapped,
    }
    names = [name for name, there in asked.items() if there]
    return record_type(len(scene.joint_labels), len(scene.bands()), names)

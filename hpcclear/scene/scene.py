"""The scene: one validated, frozen description of what is simulated."""

from collections.abc import Iterator, Mapping
from typing import Any, Self

import tomli_w
from pydantic import PrivateAttr, ValidationError, model_validator

from hpcclear.base import markup
from hpcclear.base.errors import InputError, unboxed
from hpcclear.plugins.sources import using
from hpcclear.scene import citation, describing, domain
from hpcclear.scene.choices import input_entry
from hpcclear.scene.consistency import ConsistentTables
from hpcclear.scene.fields import invalid, nearest
from hpcclear.scene.fitted import entry_replaced
from hpcclear.scene.former import renewed
from hpcclear.scene.paths import PHYSICAL, flatten, replace
from hpcclear.scene.plugged import texts_of
from hpcclear.scene.tables import plain
from hpcclear.scene.units import noting
from hpcclear.scene.validation import check_path, validated
from hpcclear.scene.variables import Variable


class Scene(ConsistentTables):
    """A validated scene file with SI numbers. It is immutable; scenes with equal content are equal. `load_scene` reads
    one, and `with_` returns a changed copy, validated again.
    """

    _text: str = PrivateAttr("")
    _readings: tuple[str, ...] = PrivateAttr(())

    def __reduce__(self) -> tuple[Any, ...]:
        """As its content: laws are functions, which are found again where they are needed."""
        return _unpickled, (self.resolved(), self._text, self._readings)

    @model_validator(mode="after")
    def _study_fits_mechanism(self) -> Self:
        if self.study is None:
            return self
        self._check_worn_inputs()
        numbers = self._numbers()
        for table, rows in (("variables", self.study.variables), ("random", self.study.random)):
            for row in rows:
                of_rows = row.entry_paths if isinstance(row, Variable) else ()
                for path in (*row.paths, *of_rows):
                    if path not in numbers:
                        raise invalid(
                            f"drives {path}, and this scene has no number there",
                            "Give that entry a value first, or remove the variable",
                            key=f"study.{table}.{row.name}",
                        )
        self._check_corners()
        for variable in self.study.variables:
            if variable.rows:
                try:
                    self.baseline(variable.name)
                except InputError as error:
                    raise invalid(error.reason, error.remedy, error.key, error.value) from None
        try:
            domain.box(self, widen=tuple(row.name for row in self.study.random))
        except InputError as error:
            raise invalid(error.reason, error.remedy, error.key, error.value) from None
        return self

    def _check_worn_inputs(self) -> None:
        """Inputs that are clearances of worn joints need lives that are followed so far."""
        assert self.study is not None
        clearances = [f"{self.joint_key(name)}.clearance" for name in self.worn_joints()]
        for row in self.study.worn:
            key = f"study.random.{row.name}"
            if self.wear is None:
                raise invalid(
                    "the scene has no [wear] table",
                    "Add [wear], as in jobs/worn_study.toml", key, "wear",
                )  # fmt: skip
            for path in row.paths:
                if path not in clearances:
                    raise invalid(
                        f"{path} is no clearance of a joint that wears",
                        nearest(path, clearances) if clearances else "Give joints a table wear",
                        key, "wear",
                    )  # fmt: skip
            assert row.cycles is not None  # by validation
            if row.cycles > self.wear.cycles:
                raise invalid(
                    f"lives are followed for {self.wear.cycles:g} revolutions only",
                    "Raise wear.cycles, or lower it", f"{key}.cycles", row.cycles,
                )  # fmt: skip

    def _check_corners(self) -> None:
        """Each bound of each variable, widened by what is random about it, must still make a
        mechanism."""
        assert self.study is not None
        names = (*PHYSICAL, "numerics", "plugins")
        content = {name: plain(table) for name in names if (table := getattr(self, name))}
        reach = {row.name: self.study.reach(row) for row in self.study.random if not row.absolute}
        spans = {
            variable.name: ("variables", variable.paths, variable.bounds)
            for variable in self.study.variables
            if variable.paths and variable.ratio is None
        }
        for row in self.study.random:
            if row.name not in self.study.names:
                centre = 0.0 if row.absolute else self.number(row.paths[0])
                reach[row.name] = self.study.reach(row)
                spans[row.name] = ("random", row.paths, (centre, centre))
        for name, (table, paths, (lower, upper)) in spans.items():
            corners = [(table, lower), (table, upper)] if table == "variables" else []
            if name in reach:
                low, high = reach[name]
                corners += [("random", lower + low), ("random", upper + high)]
            for key, value in corners:
                entries = dict.fromkeys(paths, value)
                _check_corner(content, entries, f"study.{key}.{name}", f"{name} = {value:g}")
        for variable in self.study.variables:
            for option in variable.rows:
                entries = {path: float(option.entries[path]) for path in variable.entry_paths}
                key = f"study.variables.{variable.name}"
                _check_corner(content, entries, key, f"{variable.name} = {option.name!r}")

    def baseline(self, name: str) -> float:
        """Where the scene itself is in the column of a study variable: its number, SI, or the row of its table.

        Raises
        ------
        InputError
            The scene's own numbers are not among its rows.
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
        raise InputError(
            f"study.variables.{name}", listed, "the value of the scene is not among its rows",
            "Write the values of one row into the scene: that is the baseline design",
        )  # fmt: skip

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is allowed and still deserves a look, a sentence each."""
        return tuple(describing.warnings(self))

    @property
    def readings(self) -> tuple[str, ...]:
        """Texts whose unit left open what is meant, entries of an earlier version, and how each was read, a sentence each."""
        return self._readings

    @property
    def references(self) -> str:
        """Title of the published work the mechanism is taken from, "" for one of its user's own."""
        return citation.cited_by(self)

    def effects_on(self) -> tuple[str, ...]:
        """What is on, in words, one entry an effect."""
        return tuple(describing.effects_on(self))

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
        """The TOML text this scene came from, after a comment line for each change made to it."""
        return self._text

    def to_toml(self) -> str:
        """TOML text of the resolved content; loading it gives an equal scene."""
        return tomli_w.dumps(self.resolved(), multiline_strings=True)

    def with_(self, changes: Mapping[str, Any] | None = None, /, **more: object) -> "Scene":
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
        altered = unboxed({**(changes or {}), **more})
        for path, value in altered.items():
            check_path(path)
            content = entry_replaced(content, path, value)
        result = scene_of(content)
        notes = "".join(f"# changed: {path} = {value!r}\n" for path, value in altered.items())
        result._text = notes + self.text
        return result

    def __eq__(self, other: object) -> bool:
        return self is other or (isinstance(other, Scene) and self.hash == other.hash)

    def __hash__(self) -> int:
        return hash(self.hash)


def _unpickled(content: Mapping[str, object], text: str, readings: tuple[str, ...]) -> Scene:
    """A scene from what `Scene.__reduce__` gives."""
    scene = scene_of(content)
    scene._text, scene._readings = text, readings
    return scene


def scene_of(content: Mapping[str, object]) -> Scene:
    """The scene of a file's tables, with the readings of its units; errors as `load_scene`.

    Source text that it carries is run: `load_scene` sees to it that it may be.
    """
    content, former = renewed(content)
    read: dict[str, str] = {}
    with noting(read.__setitem__), using(texts_of(content)) as packages:
        scene = validated(Scene, content)
        rows = {name: {"version": version} for name, version in sorted(packages.items())}
        if rows != content.get("plugins", {}).get("packages", {}):
            scene = validated(Scene, replace(content, "plugins.packages", rows))
    scene._readings = (*former, *(_placed(content, read) if read else ()))
    return scene


def _placed(content: Mapping[str, object], read: Mapping[str, str]) -> Iterator[str]:
    """A sentence for each text that was read as `read` says, with the first entry that has it."""
    left = dict(read)
    for key, entry in flatten(content):
        level = [entry]
        while level and isinstance(level[0], list):
            level = [one for inner in level if isinstance(inner, list) for one in inner]
        for text in level:
            if isinstance(text, str) and text.strip() in left:
                yield f"{key}: {text.strip()!r} is read as {left.pop(text.strip())}"


def _check_corner(
    content: Mapping[str, object], entries: Mapping[str, float], key: str, words: str
) -> None:
    """An error for validators unless the scene is one with other entries."""
    corner = content
    for path, value in entries.items():
        corner = replace(corner, path, value)
    try:
        Scene.model_validate(corner)
    except ValidationError as error:
        context = error.errors(include_url=False)[0].get("ctx", {})
        reason = context.get("reason", "it is not valid")
        raise invalid(
            f"reaches {words}, which makes no mechanism: {reason}", "Narrow it", key=key
        ) from None


def _alike(one: object, other: object) -> bool:
    """Whether two entries are the same, numbers to their last digits."""
    if isinstance(one, float) and isinstance(other, float):
        return abs(one - other) <= 1e-9 * max(abs(one), abs(other))
    return bool(one == other)

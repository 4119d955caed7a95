"""The scene: a TOML file, or a mapping, read, validated and frozen; and the study checked against its mechanism."""

import contextlib
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
import tomli_w
from pydantic import PrivateAttr, ValidationError

from hpcclear.base import markup
from hpcclear.base.errors import InputError, unboxed
from hpcclear.base.outcome import record_type
from hpcclear.base.plain import counted, plain as printable
from hpcclear.base.units import is_written_in, noting
from hpcclear.base.written import Reading, Texts, reading
from hpcclear.plugins.sources import using
from hpcclear.scene import describing, domain
from hpcclear.scene.consistency import ConsistentTables
from hpcclear.scene.faults import explained
from hpcclear.scene.fields import Content, Tables, invalid, nearest
from hpcclear.scene.fitted import entry_replaced
from hpcclear.scene.paths import PHYSICAL, files_named, flatten, of_kinds, replace
from hpcclear.scene.plugged import check_trust, texts_of, with_texts
from hpcclear.scene.study import Study, with_open_parameter
from hpcclear.scene.syntax import dotted, file_text, overriding, parse
from hpcclear.scene.tables import SceneTables, plain
from hpcclear.scene.variables import StudyVariable


def load_scene(
    source: str | Path | Mapping[str, object], overrides: Sequence[str] = (), *, trust: bool = False
) -> "Scene":
    """Read and validate a scene.

    Parameters
    ----------
    source : path or mapping
        A TOML file, or its parsed content.
    overrides : str or sequence of str
        ``"key.path=value"`` entries that replace what the file says; the value is read as TOML if
        it can be, else as a string, so ``joints.crank_rod.clearance=0.5 mm`` needs no quotes.
    trust : bool
        Whether Python text that the content itself carries may be run, as results carry that of plug-ins. Files beside the
        scene file that it names are run without it.

    Raises
    ------
    InputError
        If the file cannot be read or the content makes no mechanism; it names key, value, reason
        and remedy.
    """
    if isinstance(source, Mapping):
        text, content = None, dict(source)
    else:
        text = file_text(Path(source), "scene file", "Give the path of a TOML scene file")
        content = parse(text, str(source))
    overrides = [overrides] if isinstance(overrides, str) else overrides
    for key, value in overriding(overrides):
        content = entry_replaced(content, key, value)
    folder = Path() if isinstance(source, Mapping) else Path(source).parent
    named, read_as = files_named(content), list[Reading]()
    if named:
        from hpcclear.scene.file_curves import with_values  # with the readers of all kinds of files

        filled, read_as = with_values(content, folder)
        content = dict(filled)
    own_plugins = "plugins" in content
    if not trust:
        check_trust(content, "mapping" if text is None else str(source))
    if text is not None and not own_plugins:
        content = with_texts(content, lambda module: _beside(folder, module))
    scene = scene_of(content)
    scene._readings = (*scene.readings, *read_as)
    # results carry what was set, and the values of files: whoever has one needs nothing else
    notes = [*(f"set: {one}" for one in overrides), *map(str, read_as)]
    head = "".join(f"# {printable(' '.join(note.split()))}\n" for note in notes)
    plugins = {} if scene.plugins is None else {"plugins": plain(scene.plugins)}
    if text is None:
        scene._text = head and head + scene.to_toml()
    elif head or own_plugins:
        scene._text = head + tomli_w.dumps({**content, **plugins}, multiline_strings=True)
    else:
        below = tomli_w.dumps(plugins, multiline_strings=True)
        scene._text = f"{text}\n\n{below}" if plugins else text
    return scene


def _beside(folder: Path, module: str) -> str | None:
    """The text of a Python file beside the scene file, None where there is none."""
    path = folder / f"{module}.py"
    if not path.exists():
        return None
    return file_text(path, "Python file", "Give a plug-in in Python").replace("\r\n", "\n")


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
            parts.append(f"{counted(count, 'joint')} with clearance")
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
        content = describing.as_written(self)
        with contextlib.suppress(InputError):
            if scene_of(content) == self:
                return tomli_w.dumps(content, multiline_strings=True)
        return tomli_w.dumps(self.resolved(), multiline_strings=True)

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
        content = with_open_parameter(self.resolved())
        altered = {path: unboxed(one) for path, one in {**(changes or {}), **more}.items()}
        for path, value in altered.items():
            if not dotted(path):
                raise InputError("path", path, "is no dotted path", "Write mechanism.rod.mass, say")
            content = entry_replaced(content, path, value)
        result = scene_of(content, self)
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


def scene_of(content: Content, before: Scene | None = None) -> Scene:
    """The scene of a file's tables, with the readings of its units; raises InputError as `load_scene`.

    `before`: the scene that was changed, whose numbers stay as they were written.

    Source text that it carries is run: `load_scene` sees to it that it may be.
    """
    read: dict[str, str] = {}
    texts = {} if before is None else dict(before.written)
    with (
        noting(read.__setitem__),
        of_kinds(content),
        using(texts_of(content)) as packages,
        explained(content),
    ):
        with reading(texts):
            scene = Scene.model_validate(content)
        rows = {name: {"version": version} for name, version in sorted(packages.items())}
        if rows != content.get("plugins", {}).get("packages", {}):
            scene = Scene.model_validate(replace(content, "plugins.packages", rows))
        own = set[object](before.written) if before else set(_numbers_in(content))
        kept = [
            k for k, text in texts.items() if is_written_in(text) or (k if before else k[0]) in own
        ]
        scene._texts = {key: texts[key] for key in kept}
        if scene.study is not None:
            with reading(dict(scene.written)):
                _check_study(scene, scene.study)
    scene._readings = tuple(_placed(content, read)) if read else ()
    return scene


def _numbers_in(content: object) -> Iterator[float]:
    """Every plain number of nested tables and lists."""
    if isinstance(content, (Mapping, list, tuple)):
        for one in content.values() if isinstance(content, Mapping) else content:
            yield from _numbers_in(one)
    elif isinstance(content, (int, float)):
        yield content


def _placed(content: Tables, read: Mapping[str, str]) -> Iterator[Reading]:
    """Each text that was read as `read` says, with the first entry that has it."""
    left = dict(read)
    for key, entry in flatten(content):
        level = [entry]
        while level and isinstance(level[0], list):
            level = [one for inner in level if isinstance(inner, list) for one in inner]
        for text in level:
            if isinstance(text, str) and text.strip() in left:
                yield Reading(key, text.strip(), left.pop(text.strip()))


def _check_study(scene: SceneTables, study: Study) -> None:
    """Raise InputError, or an error for validators, unless the study fits the mechanism."""
    _check_worn_inputs(scene, study)
    numbers = set(scene.numeric_paths())
    for table, rows in (("variables", study.variables), ("random", study.random)):
        for row in rows:
            of_rows = row.entry_paths if isinstance(row, StudyVariable) else ()
            for path in (*row.paths, *of_rows):
                if path not in numbers:
                    reason = f"drives {path}, and this scene has no number there"
                    remedy = "Give that entry a value first, or remove the variable"
                    raise invalid(reason, remedy, f"study.{table}.{row.name}")
    _check_corners(scene, study)
    for variable in study.variables:
        if variable.rows:
            scene.baseline(variable.name)
    domain.box(scene, widen=tuple(row.name for row in study.random))
    domain.check_formulas(scene)


def _check_worn_inputs(scene: SceneTables, study: Study) -> None:
    """Inputs that are clearances of worn joints need lives that are followed so far."""
    clearances = [f"{scene.joint_key(name)}.clearance" for name in scene.worn_joints()]
    for row in study.worn:
        key = f"study.random.{row.name}"
        if scene.wear is None:
            raise invalid("[wear] is missing", "Add [wear] as in jobs/worn_study.toml", key, "wear")
        for path in row.paths:
            if path not in clearances:
                remedy = nearest(path, clearances) if clearances else "Give joints a table wear"
                raise invalid(f"{path} is no clearance of a joint that wears", remedy, key, "wear")
        assert row.cycles is not None  # by validation
        if row.cycles > scene.wear.cycles:
            reason = f"lives are followed for {scene.wear.cycles:g} revolutions only"
            raise invalid(reason, "Raise wear.cycles, or lower it", f"{key}.cycles", row.cycles)


Corner = tuple[str, dict[str, float], str]  # key of what reaches it, entries, these in words


def _check_corners(scene: SceneTables, study: Study) -> None:
    """Each bound of each variable, widened by what is random about it, must still make a mechanism."""
    names = (*PHYSICAL, "numerics", "plugins")
    content = {name: plain(table) for name in names if (table := getattr(scene, name))}
    reach = {row.name: study.reach(row) for row in study.random if not row.absolute}
    moved = [one for one in study.variables if one.paths and one.ratio is None]
    spans = {one.name: ("variables", one.paths, one.bounds) for one in moved}
    for row in study.random:
        if row.name not in study.names:
            centre = 0.0 if row.absolute else scene.number(row.paths[0])
            reach[row.name] = study.reach(row)
            spans[row.name] = ("random", row.paths, (centre, centre))
    corners = list[Corner]()
    for name, (table, paths, (lower, upper)) in spans.items():
        ends = [(table, lower), (table, upper)] if table == "variables" else []
        if name in reach:
            low, high = reach[name]
            ends += [("random", lower + low), ("random", upper + high)]
        for key, value in ends:
            words = f"{name} = {scene.shown(paths[0], value)}"
            corners.append((f"study.{key}.{name}", dict.fromkeys(paths, value), words))
    for variable in study.variables:
        for option in variable.rows:
            entries = {path: float(option.entries[path]) for path in variable.entry_paths}
            words = f"{variable.name} = {option.name!r}"
            corners.append((f"study.variables.{variable.name}", entries, words))
    for corner in (*corners, *_compared(scene, study, corners)):
        _check_corner(scene, content, *corner)


def _compared(scene: SceneTables, study: Study, corners: Sequence[Corner]) -> Iterator[Corner]:
    """The scene and the corners of its variables with the clearance of the compared responses."""
    key, own = "study.verification.response_clearance", study.verification.response_clearance
    paths = [f"{scene.joint_key(name)}.clearance" for name in scene.clearance_joints()]
    if own is not None and paths:
        entries, words = dict.fromkeys(paths, own), scene.shown(paths[0], own)
        yield key, entries, words
        for of, its, at in corners:
            if of.startswith("study.variables."):
                yield key, its | entries, f"{words} with {at}"


def _check_corner(
    scene: SceneTables, content: Tables, key: str, entries: Mapping[str, float], words: str
) -> None:
    """An error for validators unless the scene is one with other entries."""
    for path, value in entries.items():
        content = replace(content, path, value)
    try:
        type(scene).model_validate(content)
    except ValidationError as error:
        said = error.errors(include_url=False)[0].get("ctx", {}).get("error")
        reason = getattr(said, "reason", "it is not valid")
        reason = f"reaches {words}, which makes no mechanism: {reason}"
        raise invalid(reason, "Change it" if "verification" in key else "Narrow it", key) from None


def _unpickled(content: Content, text: str, readings: tuple[Reading, ...], texts: Texts) -> Scene:
    scene = scene_of(content)
    scene._text, scene._readings, scene._texts = text, readings, texts
    return scene


def record_of(scene: Scene, mapped: bool = False) -> np.dtype:
    """Type of the record of a sample; `mapped`: its motion is judged, as in a map, by default only with a target error."""
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

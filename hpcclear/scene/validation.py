"""Tables against a model, a study against its mechanism, and what is wrong as an error that a user can mend."""

import re
from collections.abc import Iterator, Mapping
from typing import Any, TypeVar

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from hpcclear.base.errors import InputError
from hpcclear.base.units import factor, is_written_in, noting
from hpcclear.base.written import Reading, reading
from hpcclear.plugins.sources import using
from hpcclear.scene import domain
from hpcclear.scene.fields import LARGEST, Content, Table, Tables, hint, invalid, nearest
from hpcclear.scene.loads import KINDS as LOADS
from hpcclear.scene.paths import PHYSICAL, flatten, of_kinds, quantities, replace
from hpcclear.scene.planar import JOINTS
from hpcclear.scene.plugged import texts_of
from hpcclear.scene.study import Study
from hpcclear.scene.tables import SceneTables, plain
from hpcclear.scene.variables import StudyVariable

Valid = TypeVar("Valid", bound=Table)
Whole = TypeVar("Whole", bound=SceneTables)
Location = tuple[int | str, ...]

DEEPEST = 16  # levels of tables and arrays; a scene needs six
_TAGGED = (("mechanism",), ("drive",), ("joints", "crank_rod"), ("joints", "rod_slider"))
_TAGGED_ROWS = ("joints", "drives", "loads")  # of a planar linkage
_KINDS = {
    "mechanism": '"slider-crank" or "planar"',
    "drive": '"constant-speed" or "torque"',
    "joints.crank_rod": '"clearance" or "ideal"',
    "joints.rod_slider": '"clearance" or "ideal"',
    "joints": " or ".join(f'"{kind}"' for kind in JOINTS),
    "drives": '"constant-speed", "harmonic" or "torque"',
    "loads": " or ".join(f'"{kind}"' for kind in LOADS),
}
_USUAL = {"m": "mm", "rad": "deg", "rad/s": "rpm", "Pa": "GPa", "Pa*s": "mPa*s", "kg": "g"}
"""Units that drawings and data sheets have, by those of SI: a plain number that is refused is likely one of these."""
_KEY = re.compile(r"[A-Za-z0-9_-]+(?:\.[A-Za-z0-9_-]+)*")


def dotted(path: object) -> bool:
    """Whether this is a dotted path, no deeper than a scene may be."""
    return isinstance(path, str) and _KEY.fullmatch(path) is not None and path.count(".") < DEEPEST


def validated(model: type[Valid], content: Tables) -> Valid:
    """Tables as a model of its kind.

    Raises InputError if it is not valid: the first thing to mend, with key, value, reason and remedy.
    """
    _check_depth(content)
    try:
        return model.model_validate(content)
    except ValidationError as error:
        # The first error in file order is the one to mend first; the others often follow from it.
        details = error.errors(include_url=False)
        raise _translated(details[0], content, more=len(details) - 1) from None


def scene_of(kind: type[Whole], content: Content, before: SceneTables | None = None) -> Whole:
    """The scene of a file's tables, with the readings of its units; errors as `validated`.

    `before`: the scene that was changed, whose numbers stay as they were written.

    Source text that it carries is run: `hpcclear.scene.load_scene` sees to it that it may be.
    """
    read: dict[str, str] = {}
    texts = {} if before is None else dict(before.written)
    with noting(read.__setitem__), of_kinds(content), using(texts_of(content)) as packages:
        with reading(texts):
            scene = validated(kind, content)
        rows = {name: {"version": version} for name, version in sorted(packages.items())}
        if rows != content.get("plugins", {}).get("packages", {}):
            scene = validated(kind, replace(content, "plugins.packages", rows))
        own = set[object](before.written) if before else set(_numbers_in(content))
        kept = [
            k for k, text in texts.items() if is_written_in(text) or (k if before else k[0]) in own
        ]
        scene._texts = {key: texts[key] for key in kept}
        if scene.study is not None:
            try:
                with reading(dict(scene.written)):
                    _check_study(scene, scene.study)
            except InputError as error:
                raise _told(error, (), content) from None
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
    for name, (table, paths, (lower, upper)) in spans.items():
        corners = [(table, lower), (table, upper)] if table == "variables" else []
        if name in reach:
            low, high = reach[name]
            corners += [("random", lower + low), ("random", upper + high)]
        for key, value in corners:
            entries, words = dict.fromkeys(paths, value), scene.shown(paths[0], value)
            _check_corner(scene, content, entries, f"study.{key}.{name}", f"{name} = {words}")
    for variable in study.variables:
        for option in variable.rows:
            entries = {path: float(option.entries[path]) for path in variable.entry_paths}
            key = f"study.variables.{variable.name}"
            _check_corner(scene, content, entries, key, f"{variable.name} = {option.name!r}")


def _check_corner(
    scene: SceneTables, content: Tables, entries: Mapping[str, float], key: str, words: str
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
        raise invalid(reason, "Narrow it", key) from None


def _check_depth(content: Tables) -> None:
    level: list[Any] = [content]
    for _ in range(DEEPEST):
        below = (list(one.values()) if isinstance(one, Mapping) else one for one in level)
        level = [one for row in below for one in row if isinstance(one, (Mapping, list, tuple))]
        if not level:
            return
    raise InputError("scene", "...", "is nested too deeply", f"Nest {DEEPEST} levels at most")


def _translated(error: ErrorDetails, content: Tables, more: int) -> InputError:
    location = _untagged(error["loc"], error["type"])
    said = error.get("ctx", {}).get("error")
    if isinstance(said, InputError):
        return _told(said, location, content, more)
    names, found = _follow(location, content)
    if error["type"].startswith("union_tag"):
        names, found = (*names, "kind"), found.get("kind")
    reason, remedy = _explained(error, found, ".".join(names))
    return _wrong(".".join(names), found, reason, remedy, more)


def _told(said: InputError, location: Location, content: object, more: int = 0) -> InputError:
    """An error of `invalid` with the whole key of its entry, and what stands there."""
    names, found = _follow(location, content)
    if said.key:
        below, found = _follow(tuple(said.key.split(".")), found)
        names += below
    if said.value is not ... and (found is None or isinstance(found, (Mapping, list))):
        found = said.value
    return _wrong(".".join(names), found, said.reason, said.remedy, more)


def _wrong(key: str, found: object, reason: str, remedy: str, more: int) -> InputError:
    usual = _USUAL.get(_unit(key)) if re.search("smaller|below|at most|fit into", reason) else None
    if usual and isinstance(found, (int, float)) and 0 < found < LARGEST:
        size = found / float(factor(usual, _unit(key)))
        meant = f'if {usual} are meant, write "{found:g} {usual}"'
        remedy += f". {found:g} is {size:.6g} {usual}; {meant}"
    if more:
        remedy = f"{remedy} ({more} more after this)"
    return InputError(key or "scene", found, reason, remedy)


def _unit(path: str) -> str:
    found = quantities().get(path)
    return found.unit if found else ""


def _untagged(location: Location, kind: str) -> Location:
    """A location without the tag that pydantic adds below a table whose kind decides its fields."""
    if location[:2] == ("mechanism", "planar"):
        return "mechanism", *_untagged(location[2:], kind)
    in_rows = len(location) > 2 and location[0] in _TAGGED_ROWS and isinstance(location[1], int)
    if in_rows and not kind.startswith("union_tag"):
        return location[:2] + location[3:]
    for prefix in () if kind.startswith("union_tag") else _TAGGED:
        if location[: len(prefix)] == prefix:
            return prefix + location[len(prefix) + 1 :]
    return location


def _follow(location: Location, content: object) -> tuple[tuple[str, ...], Any]:
    """The keys along a location, and what stands there in the raw content (None if nothing does)."""
    names: list[str] = []
    for step in location:
        if isinstance(content, Mapping):
            # Named rows are validated as a list; their position leads back to the name.
            key = list(content)[step] if isinstance(step, int) and step not in content else step
            content = content.get(key)
            names.append(str(key))
        else:
            place = int(step) if str(step).isdecimal() else -1
            listed = isinstance(content, (list, tuple)) and 0 <= place < len(content)
            content = content[place] if listed else None  # type: ignore[index]
            names.append(str(step))
    return tuple(names), content


def _explained(error: ErrorDetails, found: object, path: str) -> tuple[str, str]:
    """Reason and remedy for the errors that pydantic finds by itself."""
    context = error.get("ctx", {})
    match error["type"]:
        case "missing" if not isinstance(error["loc"][-1], int):
            quantity = quantities().get(path)
            unit = f" in {quantity.unit}" if quantity and quantity.unit else ""
            return "is missing", f"Add it, a number{unit}" if quantity else "Add it"
        case "literal_error" | "union_tag_invalid":
            expected = str(context.get("expected") or context.get("expected_tags"))
            words = re.findall(r"'([^']*)'", expected)
            remedy = f"Write {expected}"
            if isinstance(found, str):
                remedy = hint(found) + nearest(found, words)
            return "is not one of the known values", remedy
        case "union_tag_not_found":
            table = path.removesuffix(".kind").removeprefix("mechanism.")
            kinds = _KINDS.get(table) or _KINDS[table.partition(".")[0]]
            return "is missing", f"Add kind = {kinds}"
        case "bool_type":
            return "true or false is expected here", "Write true or false"
        case "string_type":
            return "a string is expected here", "Write text in quotes"
        case "missing" | "too_short" | "too_long" | "tuple_type":
            return "a list of the right length is expected here", "Write it as [first, second]"
        case _:
            message = error["msg"][:1].lower() + error["msg"][1:]
            return message, "See the scene reference in the documentation"

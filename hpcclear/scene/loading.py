"""From a TOML file, or a mapping, to a `Scene`: reading, overrides, and errors a user can mend."""

import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from hpcclear.base.errors import InputError
from hpcclear.scene.fields import nearest
from hpcclear.scene.paths import quantities, replace
from hpcclear.scene.scene import Scene

LARGEST_FILE = 1_000_000  # bytes; the paper's own study needs three thousand
DEEPEST = 16  # levels of tables and arrays; a scene needs six
_TAGGED = (("drive",), ("joints", "crank_rod"), ("joints", "rod_slider"))
_KINDS = {"drive": '"constant-speed" or "torque"', "joints": '"clearance" or "ideal"'}
_KEY = re.compile(r"[A-Za-z0-9_-]+(?:\.[A-Za-z0-9_-]+)*")
# tomllib takes quadratic time over one key with very many dots, so such a key is refused before it
# is parsed.
_DOTTED = re.compile(
    r"""(?<![A-Za-z0-9_-])(?:(?:[A-Za-z0-9_-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){17}"""
)


def load_scene(source: str | Path | Mapping[str, Any], overrides: Sequence[str] = ()) -> Scene:
    """Read and validate a scene.

    Parameters
    ----------
    source : path or mapping
        A TOML file, or its parsed content.
    overrides : sequence of str
        ``"key.path=value"`` entries that replace what the file says; the value is read as TOML if
        it can be, else as a string, so ``joints.crank_rod.clearance=0.5 mm`` needs no quotes.

    Raises
    ------
    InputError
        If the file cannot be read or the content makes no mechanism; it names key, value, reason
        and remedy.
    """
    if isinstance(source, Mapping):
        text, content = None, dict(source)
    else:
        text = _read(Path(source))
        content = _parse(text, str(source))
    for override in overrides:
        content = replace(content, *_override(override))
    scene = _validated(content)
    notes = "".join(f"# set: {override}\n" for override in overrides)
    scene._text = notes + (scene.to_toml() if text is None else text)
    return scene


def changed(scene: Scene, changes: Mapping[str, Any]) -> Scene:
    """A scene with the entries at dotted paths replaced (None removes); InputError as `Scene.with_`."""
    content = scene.resolved()
    for path, value in changes.items():
        if not isinstance(path, str) or not _KEY.fullmatch(path) or path.count(".") >= DEEPEST:
            raise InputError("path", path, "is not a dotted path", "Write, say, mechanism.rod.mass")
        content = replace(content, path, value)
    result = _validated(content)
    notes = "".join(f"# changed: {path} = {value!r}\n" for path, value in changes.items())
    result._text = notes + scene.text
    return result


def _read(path: Path) -> str:
    name = str(path)
    remedy = "Give the path of a TOML scene file"
    try:
        if not path.is_file():
            reason = "is not a regular file" if path.exists() else "there is no such file"
            raise InputError("scene file", name, reason, remedy)
        with path.open("rb") as stream:
            data = stream.read(LARGEST_FILE + 1)
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError("scene file", name, f"cannot be read ({error})", remedy) from None
    if len(data) > LARGEST_FILE:
        raise InputError(
            "scene file",
            name,
            f"is larger than {LARGEST_FILE} bytes",
            "A scene needs a few thousand",
        )
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(
            "scene file", name, f"is not UTF-8 text (byte {error.start})", "Save it as UTF-8"
        ) from None


def _parse(text: str, name: str) -> dict[str, Any]:
    remedy = "Mend the TOML syntax there"
    if _DOTTED.search(text):
        raise InputError(
            "scene file", name, "a key has too many dots", f"Nest at most {DEEPEST} tables"
        )
    try:
        return tomllib.loads(text.replace("\r\n", "\n"))
    except RecursionError:
        raise InputError(
            "scene file", name, "is nested too deeply", f"Nest at most {DEEPEST} levels"
        ) from None
    except ValueError as error:
        raise InputError("scene file", name, f"is not valid TOML: {error}", remedy) from None


def _override(text: str) -> tuple[str, Any]:
    key, equals, value = (part.strip() for part in text.partition("="))
    if not equals or not _KEY.fullmatch(key) or key.count(".") >= DEEPEST:
        raise InputError(
            "--set",
            text,
            "is not of the form key.path=value",
            "Write, say, --set numerics.rtol=1e-8",
        )
    try:
        parsed = tomllib.loads(f"value = {value}")
    except (ValueError, RecursionError):
        parsed = {}
    # A value with a line break could smuggle in a second key; then it is just a string.
    return key, parsed["value"] if parsed.keys() == {"value"} else value


def _validated(content: Mapping[str, Any]) -> Scene:
    _check_depth(content)
    try:
        return Scene.model_validate(content)
    except ValidationError as error:
        # The first error in file order is the one to mend first; the others often follow from it.
        details = error.errors(include_url=False)
        raise _translated(details[0], content, more=len(details) - 1) from None


def _check_depth(content: Mapping[str, Any]) -> None:
    level: list[Any] = [content]
    for _ in range(DEEPEST):
        level = [
            inner
            for outer in level
            for inner in (outer.values() if isinstance(outer, Mapping) else outer)
            if isinstance(inner, (Mapping, list, tuple))
        ]
        if not level:
            return
    raise InputError(
        "scene",
        "...",
        "is nested too deeply",
        f"Nest at most {DEEPEST} levels of tables and arrays",
    )


def _translated(error: ErrorDetails, content: Mapping[str, Any], more: int) -> InputError:
    """A pydantic error as an InputError."""
    context = error.get("ctx", {})
    location = _untagged(error["loc"], error["type"])
    names, found = _follow(location, content)
    if error["type"] == "scene":
        reason, remedy = context["reason"], context["remedy"]
        if context["key"]:
            parts = tuple(context["key"].split("."))
            below, found = _follow(parts, found)
            names += below
        if context["value"] is not ...:
            found = context["value"]
    else:
        if error["type"].startswith("union_tag"):
            names, found = (*names, "kind"), found.get("kind")
        reason, remedy = _explained(error, found, ".".join(names))
    if more:
        remedy = f"{remedy} ({more} more after this)"
    return InputError(".".join(names) or "scene", found, reason, remedy)


def _untagged(location: tuple[int | str, ...], kind: str) -> tuple[int | str, ...]:
    """A location without the tag that pydantic adds below a table whose kind decides its fields."""
    for prefix in _TAGGED:
        if (
            location[: len(prefix)] == prefix
            and len(location) > len(prefix)
            and not kind.startswith("union_tag")
        ):
            return prefix + location[len(prefix) + 1 :]
    return location


def _follow(location: tuple[int | str, ...], content: Any) -> tuple[tuple[str, ...], Any]:
    """The keys along a location, and what stands there in the raw content (None if nothing
    does)."""
    names: list[str] = []
    for step in location:
        if isinstance(content, Mapping):
            # Named rows are validated as a list; their position leads back to the name.
            key = list(content)[step] if isinstance(step, int) and step not in content else step
            content = content.get(key)
            names.append(str(key))
        else:
            fits = (
                isinstance(content, (list, tuple)) and isinstance(step, int) and step < len(content)
            )
            content = content[step] if fits else None  # type: ignore[index]
            names.append(str(step))
    return tuple(names), content


def _explained(error: ErrorDetails, found: Any, path: str) -> tuple[str, str]:
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
            return "is not one of the known values", nearest(found, words) if isinstance(
                found, str
            ) else (f"Write {expected}")
        case "union_tag_not_found":
            return "is missing", f"Add kind = {_KINDS[path.partition('.')[0]]}"
        case "bool_type":
            return "true or false is expected here", "Write true or false"
        case "string_type":
            return "a string is expected here", "Write text in quotes"
        case "missing" | "too_short" | "too_long" | "tuple_type":
            return "a list of the right length is expected here", "Write it as [first, second]"
        case _:
            return error["msg"][:1].lower() + error["msg"][
                1:
            ], "See the scene reference in the documentation"

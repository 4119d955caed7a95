"""SceneTables against a model, and what is wrong with it as an error that a user can mend."""

import re
from collections.abc import Mapping
from typing import Any, TypeVar

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from hpcclear.base.errors import InputError
from hpcclear.scene.fields import Table, nearest
from hpcclear.scene.paths import quantities
from hpcclear.scene.wanted import hint

Valid = TypeVar("Valid", bound=Table)

DEEPEST = 16  # levels of tables and arrays; a scene needs six
_TAGGED = (("mechanism",), ("drive",), ("joints", "crank_rod"), ("joints", "rod_slider"))
_TAGGED_ROWS = ("joints", "drives", "loads")  # of a planar linkage
_KINDS = {
    "mechanism": '"slider-crank" or "planar"',
    "drive": '"constant-speed" or "torque"',
    "joints.crank_rod": '"clearance" or "ideal"',
    "joints.rod_slider": '"clearance" or "ideal"',
    "joints": '"revolute", "clearance", "slide", "slot" or "fixed"',
    "drives": '"constant-speed", "harmonic" or "torque"',
    "loads": '"force", "torque" or "spring"',
}
_KEY = re.compile(r"[A-Za-z0-9_-]+(?:\.[A-Za-z0-9_-]+)*")


def dotted(path: object) -> bool:
    """Whether this is a dotted path, no deeper than a scene may be."""
    return isinstance(path, str) and _KEY.fullmatch(path) is not None and path.count(".") < DEEPEST


def check_path(path: object) -> None:
    """InputError unless this is a dotted path."""
    if not dotted(path):
        raise InputError("path", path, "is not a dotted path", "Write, say, mechanism.rod.mass")


def validated(model: type[Valid], content: Mapping[str, object]) -> Valid:
    """SceneTables as a model of its kind.

    Raises
    ------
    InputError
        If it is not valid: the first thing to mend, with key, value, reason and remedy.
    """
    _check_depth(content)
    try:
        return model.model_validate(content)
    except ValidationError as error:
        # The first error in file order is the one to mend first; the others often follow from it.
        details = error.errors(include_url=False)
        raise _translated(details[0], content, more=len(details) - 1) from None


def _check_depth(content: Mapping[str, object]) -> None:
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


def _translated(error: ErrorDetails, content: Mapping[str, object], more: int) -> InputError:
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
    if location[:2] == ("mechanism", "planar"):
        return "mechanism", *_untagged(location[2:], kind)
    in_rows = len(location) > 2 and location[0] in _TAGGED_ROWS and isinstance(location[1], int)
    if in_rows and not kind.startswith("union_tag"):
        return location[:2] + location[3:]
    for prefix in _TAGGED:
        if (
            location[: len(prefix)] == prefix
            and len(location) > len(prefix)
            and not kind.startswith("union_tag")
        ):
            return prefix + location[len(prefix) + 1 :]
    return location


def _follow(location: tuple[int | str, ...], content: object) -> tuple[tuple[str, ...], Any]:
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
            table = path.removesuffix(".kind")
            table = table.removeprefix("mechanism.")
            kinds = _KINDS.get(table) or _KINDS[table.partition(".")[0]]
            return "is missing", f"Add kind = {kinds}"
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

"""What is wrong with a scene, as an error that a user can mend: key, value, reason and remedy."""

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from hpcclear.base.errors import InputError
from hpcclear.base.units import factor
from hpcclear.scene.fields import LARGEST, Tables, hint, nearest
from hpcclear.scene.loads import KINDS as LOADS
from hpcclear.scene.paths import quantities
from hpcclear.scene.planar import JOINTS
from hpcclear.scene.syntax import DEEPEST

Location = tuple[int | str, ...]

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


@contextmanager
def explained(content: Tables) -> Iterator[None]:
    """Where tables are made a model: an error of that, or of `invalid`, as the first thing to mend. Raises InputError."""
    _check_depth(content)
    try:
        yield
    except ValidationError as error:
        # The first error in file order is the one to mend first; the others often follow from it.
        details = error.errors(include_url=False)
        raise _translated(details[0], content, more=len(details) - 1) from None
    except InputError as error:
        raise _told(error, (), content) from None


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
        quoted = isinstance(found, Mapping) and said.key in found
        below, found = _follow((said.key,) if quoted else tuple(said.key.split(".")), found)
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
        if isinstance(content, (str, int, float)):  # what stands for a whole table, as "cost"
            break
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
        case "model_attributes_type":
            return "a table is expected here", "Write it as [table] or { key = value }"
        case "bool_type":
            return "true or false is expected here", "Write true or false"
        case "string_type":
            return "a string is expected here", "Write text in quotes"
        case "missing" | "too_short" | "too_long" | "tuple_type":
            return "a list of the right length is expected here", "Write it as [first, second]"
        case _:
            message = error["msg"][:1].lower() + error["msg"][1:]
            return message, "See the scene reference in the documentation"

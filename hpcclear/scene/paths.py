"""Dotted paths: which entries of a scene are physical numbers, in which unit, and how to read or replace one."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import lru_cache
from typing import Any, get_args

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from hpcclear.base.errors import InputError, at
from hpcclear.base.holding import holding
from hpcclear.scene.curves import MOST_ROWS, Pairs
from hpcclear.scene.effects import EffectTables
from hpcclear.scene.fields import Content, NamedRows, Quantity, Tables, table_at
from hpcclear.scene.laws import ENTRIES, law_entries
from hpcclear.scene.planar import Planar
from hpcclear.scene.slider_crank import CrankJoints, Drive, SliderCrank

PHYSICAL = {
    "mechanism": SliderCrank, "drive": Drive, "joints": CrankJoints, "effects": EffectTables,
}  # fmt: skip
"""The tables whose numbers describe the mechanism and what acts on it."""


def _parts(annotation: object) -> Iterator[Any]:
    """An annotation and everything inside it: metadata, members of unions."""
    yield annotation
    for part in get_args(annotation):
        if not isinstance(part, (str, int, float)):
            yield from _parts(part)


def _quantity(field: FieldInfo) -> Quantity | None:
    """The quantity a field holds when it holds a single number."""
    if str(field.annotation).startswith("tuple"):
        return None
    for part in (*field.metadata, *_parts(field.annotation)):
        if isinstance(part, Quantity):
            return part
        if isinstance(part, Pairs) and part.constant and part.x == "rad":
            return Quantity(part.unit)
    return None


_kinds: ContextVar[Mapping[str, str]] = ContextVar("kinds", default={})  # noqa: B039 - nobody writes into it
_SEEN: dict[str, str] = {}
"""Kinds of rows that this process has read, by their paths: those of the scene read last."""


@contextmanager
def of_kinds(content: Tables) -> Iterator[None]:
    """Within it, `quantities` knows the kinds of the loads of a scene's content, on which units of their entries depend."""
    rows = table_at(content, "mechanism.loads").items()
    kinds = {name: str(row.get("kind")) for name, row in rows if isinstance(row, Mapping)}
    found = {f"mechanism.loads.{name}": kind for name, kind in kinds.items()}
    _SEEN.update(found)
    with holding(_kinds, found):
        yield


def _entries(annotation: object, prefix: str) -> Iterator[tuple[str, FieldInfo, tuple[str, ...]]]:
    """Paths and declarations of entries that are no tables, and the kinds of table that have them."""
    for model in _parts(annotation):
        if not (isinstance(model, type) and issubclass(model, BaseModel)):
            continue
        kind = model.model_fields.get("kind")
        kinds = () if kind is None else tuple(map(str, get_args(kind.annotation)))
        for name, field in model.model_fields.items():
            path = f"{prefix}.{name}"
            named = any(isinstance(part, NamedRows) for part in field.metadata)
            inner = f"{path}.*" if named else path
            yield from [*_entries(field.annotation, inner)] or [(path, field, kinds)]


def _all_entries() -> Iterator[tuple[str, FieldInfo, tuple[str, ...]]]:
    for top, model in (*PHYSICAL.items(), ("mechanism", Planar)):
        yield from _entries(model, top)


@lru_cache(maxsize=1)
def curves() -> Mapping[str, Pairs]:
    """Tables of pairs that may come from a file, by path, such as "mechanism.drives.*.torque"."""
    return {
        path: part
        for path, field, _ in _all_entries()
        for part in (*field.metadata, *_parts(field.annotation))
        if isinstance(part, Pairs) and part.most > MOST_ROWS
    }


def curve_at(path: str) -> Pairs | None:
    """The table of pairs at a path of a scene; None where there is none."""
    return curves().get(_general(path))


def _general(path: object) -> str:
    """A path with a star for the name of each row of a linkage."""
    parts: list[str] = []
    for part in str(path).split("."):
        parts.append("*" if parts and parts[-1] in _NAMED else part)
    return ".".join(parts)


class Quantities(Mapping[str, Quantity]):
    """By path; the rows of a linkage have names of their own, so theirs are kept by "mechanism.bodies.*.mass"."""

    def __init__(self, own: Mapping[str, Mapping[str, Quantity]]) -> None:
        self._own = own  # by path and kind of the row, "" for any other

    def _of(self, path: object) -> Quantity | None:
        kinds = self._own.get(str(path)) or self._own.get(_general(path))
        row = str(path).rpartition(".")[0]
        kind = _kinds.get().get(row) or _SEEN.get(row, "")
        return None if kinds is None else kinds.get(kind, kinds[""])

    def __contains__(self, path: object) -> bool:
        return path in ENTRIES or self._of(path) is not None

    def __getitem__(self, path: str) -> Quantity:
        """Return the quantity; raises InputError where laws that were read have it in several units."""
        found, ours = dict(ENTRIES.get(path, {})), self._of(path)
        if ours is not None:
            found[ours.unit] = ours
        if not found:
            raise KeyError(path)
        if len(found) > 1:
            listed = " and ".join(unit or "no unit" for unit in sorted(found))
            reason = f"laws that were read here have a parameter of this name in {listed}, so its unit is not known"
            raise InputError(path, path, reason, "Give one of the parameters another name")
        return next(iter(found.values()))

    def __iter__(self) -> Iterator[str]:
        return iter(self._own)

    def __len__(self) -> int:
        return len(self._own)


_NAMED = ("bodies", "joints", "drives", "loads", "points")


@lru_cache(maxsize=1)
def quantities() -> Mapping[str, Quantity]:
    """Every path of a physical number that some scene may have, with its unit and bounds."""
    found = dict[str, dict[str, Quantity]]()
    for path, field, kinds in _all_entries():
        if (quantity := _quantity(field)) is not None:
            found.setdefault(path, {}).update(dict.fromkeys((*kinds, ""), quantity))
    for kind in ("contact", "friction"):
        found |= {path: {"": quantity} for path, quantity in law_entries(kind)}
    return Quantities(found)


_WORDS = {
    "mass_center": "position of the mass centre of the {0}, from its first joint",
    "inertia": "inertia of the {0} about its mass centre",
    "inertia_ratio": "inertia of the {0} over that of a slender bar",
    "clearance": "radial clearance of the joint {0}",
}


def described(paths: Sequence[str]) -> str:
    """What entries are, in words: "mass of the rod"; of several that are alike, what they have in common."""
    found = []
    for path in paths:
        *_, owner, leaf = path.split(".")
        found.append(_WORDS.get(leaf, leaf.replace("_", " ") + " of the {0}").format(owner))
    alike = {text.split(" of the joint ")[0] for text in found}
    return alike.pop() if len(paths) > 1 and len(alike) == 1 else " and ".join(found)


def _elements(listed: list[object], path: str, value: object) -> Tables:
    head, key = path.split(".")[:2]
    names = "xy" if key in ("x", "y") and len(listed) == 2 else map(str, range(len(listed)))
    rows = dict(zip(names, listed, strict=True))
    if key.isdigit() and key not in rows:
        remedy = f"Use 0 to {len(listed) - 1}, or write the whole list in [ ]"
        raise InputError(path, value, f"{head} is a list and has no {key}", remedy)
    return rows if key in rows else {}


def replace(content: Tables, path: str, value: object) -> Content:
    """A copy of nested tables with the entry at `path` replaced, or removed when `value` is None.

    Elements of a list count from 0, as messages name them; x and y are those of a pair. What is neither table nor list on
    the way is replaced by a table; the model then says what is wrong. Raises InputError if a list has no such element.
    """
    head, _, rest = path.partition(".")
    copy = dict(content)
    if rest:
        inner = copy.get(head)
        listed = _elements(inner, path, value) if isinstance(inner, list) else {}
        rows = inner if isinstance(inner, Mapping) else listed
        with at(head):
            made = replace(rows, rest, value)
        copy[head] = list(made.values()) if listed else made
    elif value is None:
        copy.pop(head, None)
    else:
        copy[head] = value
    return copy


def flatten(content: Tables, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted keys and values of nested tables, in order."""
    for key, value in content.items():
        path = f"{prefix}{key}"
        if isinstance(value, Mapping):
            yield from flatten(value, f"{path}.")
        else:
            yield path, value


def files_named(content: Tables, prefix: str = "") -> dict[str, Tables]:
    """Return the tables of a parsed scene that name a file, by their dotted keys."""
    found: dict[str, Tables] = {}
    for key, entry in content.items():
        if isinstance(entry, Mapping) and not prefix.startswith("plugins."):
            path = f"{prefix}{key}"
            found |= {path: entry} if "file" in entry else files_named(entry, f"{path}.")
    return found

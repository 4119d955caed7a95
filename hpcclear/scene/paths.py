"""Dotted paths: which entries of a scene are physical numbers, in which unit, and how to read or
replace one."""

from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any, get_args

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from hpcclear.base.errors import InputError
from hpcclear.scene.effects import Effects
from hpcclear.scene.fields import CurveOf, NamedRows, Quantity
from hpcclear.scene.laws import ENTRIES, law_entries
from hpcclear.scene.mechanism import Drive, Joints, Mechanism
from hpcclear.scene.planar import Planar

PHYSICAL = {"mechanism": Mechanism, "drive": Drive, "joints": Joints, "effects": Effects}
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
        if isinstance(part, CurveOf):
            return Quantity(part.unit)
    return None


def _named(field: FieldInfo) -> bool:
    return any(isinstance(part, NamedRows) for part in field.metadata)


def _entries(annotation: object, prefix: str) -> Iterator[tuple[str, Quantity]]:
    for model in _parts(annotation):
        if not (isinstance(model, type) and issubclass(model, BaseModel)):
            continue
        for name, field in model.model_fields.items():
            path, quantity = f"{prefix}.{name}", _quantity(field)
            if quantity is not None:
                yield path, quantity
            else:
                yield from _entries(field.annotation, f"{path}.*" if _named(field) else path)


class Quantities(dict[str, Quantity]):
    """By path; the rows of a linkage have names of their own, so theirs are kept by "mechanism.bodies.*.mass"."""

    def _general(self, path: object) -> str:
        parts: list[str] = []
        for part in str(path).split("."):
            parts.append("*" if parts and parts[-1] in _NAMED else part)
        return ".".join(parts)

    def __contains__(self, path: object) -> bool:
        general = self._general(path)
        return any(path in known for known in (dict.keys(self), ENTRIES)) or general in dict.keys(
            self
        )

    def __getitem__(self, path: str) -> Quantity:
        """Return the quantity; raises InputError where laws that were read have it in several units."""
        found = dict(ENTRIES.get(path, {}))
        if not found:
            return super().__getitem__(path)
        if dict.__contains__(self, path):
            ours = dict.__getitem__(self, path)
            found[ours.unit] = ours
        if len(found) > 1:
            listed = " and ".join(unit or "no unit" for unit in sorted(found))
            reason = f"laws that were read here have a parameter of this name in {listed}, so its unit is not known"
            raise InputError(path, path, reason, "Give one of the parameters another name")
        return next(iter(found.values()))

    def __missing__(self, path: str) -> Quantity:
        general = self._general(path)
        if general == path:
            raise KeyError(path)
        return dict.__getitem__(self, general)

    def get(self, path: str, default: object = None) -> Any:
        """The quantity at a path, or `default`."""
        return self[path] if path in self else default  # noqa: SIM401 - get() is this


_NAMED = ("bodies", "joints", "drives", "loads", "points")


@lru_cache(maxsize=1)
def quantities() -> Mapping[str, Quantity]:
    """Every path of a physical number that some scene may have, with its unit and bounds."""
    tables = [*PHYSICAL.items(), ("mechanism", Planar)]
    found = Quantities(
        (path, quantity) for top, model in tables for path, quantity in _entries(model, top)
    )
    for kind in ("contact", "friction"):
        found |= dict(law_entries(kind))
    return found


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


def replace(content: Mapping[str, object], path: str, value: object) -> dict[str, Any]:
    """A copy of nested tables with the entry at `path` replaced, or removed when `value` is None.

    What is not a table on the way to it is replaced by one; the model then says what is wrong with
    that.
    """
    head, _, rest = path.partition(".")
    copy = dict(content)
    if rest:
        inner = copy.get(head)
        copy[head] = replace(inner if isinstance(inner, Mapping) else {}, rest, value)
    elif value is None:
        copy.pop(head, None)
    else:
        copy[head] = value
    return copy


def flatten(content: Mapping[str, object], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted keys and values of nested tables, in order."""
    for key, value in content.items():
        path = f"{prefix}{key}"
        if isinstance(value, Mapping):
            yield from flatten(value, f"{path}.")
        else:
            yield path, value

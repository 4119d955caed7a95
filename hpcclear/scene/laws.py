"""Tables of the scene that name a law: what entries they have, the law says."""

import dataclasses
import itertools
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any, ClassVar

from pydantic import ConfigDict, PrivateAttr, model_validator
from pydantic.json_schema import JsonSchemaValue

from hpcclear.base.errors import at
from hpcclear.base.pieces import Rows
from hpcclear.laws import laws, names
from hpcclear.laws.declared import ContactLaw, Described, FrictionLaw, Geometry, Law, Parameter
from hpcclear.plugins import CONTACT_LAWS, FRICTION_LAWS
from hpcclear.scene.curves import Pairs
from hpcclear.scene.fields import Converted, Quantity, Table, checked_table, hint, invalid, nearest
from hpcclear.scene.plugged import as_invalid

SPHERE = "sphere"
"""The geometry of contact that laws of this package have by themselves."""

REGISTRIES = {"contact": (CONTACT_LAWS, ContactLaw), "friction": (FRICTION_LAWS, FrictionLaw)}
"""Where laws of users are found, by kind, and what they are."""

PATTERN = r"^(expression|[A-Za-z_]\w*:[A-Za-z_]\w*)$"
"""Laws that are not ours."""

ENTRIES: dict[str, dict[str, Quantity]] = {}
"""Quantities of entries of users' laws that this process has read, by path and unit."""


@dataclasses.dataclass(frozen=True)
class LawName(Converted):
    """An entry that names one of our laws of a kind."""

    kind: str

    def convert(self, value: object) -> str:
        """The name, known to be there; an error for validators where it is none."""
        if value not in (known := names(self.kind)):
            raise invalid("is not one of the known values", nearest(str(value), known))
        return str(value)

    def json_schema(self) -> JsonSchemaValue:
        """One of their names."""
        return {"type": "string", "enum": [*names(self.kind)]}


@cache
def _on(law: ContactLaw, geometry: Geometry) -> ContactLaw:
    return law.on(geometry)


def on_geometry(law: ContactLaw, name: str, rows: Rows | None = None) -> ContactLaw:
    """A law on the elastic part of a geometry of that name, made of `rows` if it has a table; an error for validators where
    there is none."""
    found = laws("geometry")
    if name not in found:
        known = (SPHERE, *found)
        raise invalid("is not one of the known values", nearest(name, known), "geometry", name)
    if law.factor is None:
        remedy = 'Remove geometry, or use a law with damping only, such as "hunt-crossley"'
        raise invalid(f"{law.name!r} has an elastic force of its own", remedy, "geometry", name)
    shape = found[name]
    if (shape.of_rows is None) != (rows is None):
        raise invalid(
            f"the geometry {name!r} has no table" if rows else "the table of depths and forces is missing",
            "Remove it" if rows else 'Add curve = [["1 um", "100 N"], ["2 um", "250 N"], ...]',
            "curve", rows,
        )  # fmt: skip
    return _on(law, shape if rows is None else shape.of_rows(rows))


def _with_entries(kind: str) -> Iterator[Described]:
    """All of this package that has entries in a law's table: laws, and for contact the geometries."""
    yield from laws(kind).values()
    if kind == "contact":
        yield from laws("geometry").values()


def known_laws(kind: str) -> dict[str, Law]:
    """Our laws and those of installed packages, by name; geometries and films are ours alone."""
    if kind in ("geometry", "film"):
        return dict(laws(kind))
    return {**laws(kind), **{name: _of_user(kind, name) for name in REGISTRIES[kind][0].names()}}


@cache
def _named(law: Law, name: str) -> Law:
    return dataclasses.replace(law, name=name)


def _of_user(kind: str, name: str) -> Law:
    """A law from elsewhere with the name that the scene has for it; an error for validators where there is none."""
    registry, made = REGISTRIES[kind]
    with as_invalid("law"):
        found = registry.get(name)
    if not isinstance(found, made):
        remedy = f"Make it a hpcclear.{made.__name__}, see docs/extending.md"
        raise invalid(f"is no {kind} law", remedy, "law")
    return _named(found, name)


def quantity_of(p: Parameter) -> Quantity:
    """Of a law's parameter."""
    return Quantity(p.unit, above=p.above, below=p.below, least=p.least, most=p.most)


def law_entries(kind: str) -> Iterator[tuple[str, Quantity]]:
    """Paths and quantities of the numbers that laws of this package have."""
    for law in _with_entries(kind):
        for parameter in law.parameters:
            if parameter.count == 1:
                yield f"effects.{kind}.{parameter.name}", quantity_of(parameter)


class LawTable(Table):
    """A table with a law and its parameters."""

    model_config = ConfigDict(frozen=True, extra="allow", allow_inf_nan=False, defer_build=True)

    kind: ClassVar[str] = ""
    formula: ClassVar[str] = ""
    """The entry of a law that is an expression."""
    law: str
    _law: Law | None = PrivateAttr(None)

    @model_validator(mode="before")
    @classmethod
    def _known_keys(cls, given: object) -> object:
        """The entries of the law, converted; overrides what a table without a law does."""
        if isinstance(given, Table):
            return given
        data = checked_table(given)
        default = cls.model_fields["law"].default
        name = data.get("law", default if isinstance(default, str) else None)
        if not isinstance(name, str):
            cls._refuse_unknown(data, None)
            return data
        law = cls.find(name, data)
        cls._refuse_unknown(data, law)
        own = {key: value for key, value in data.items() if key in cls.model_fields}
        return own | cls._converted(data, law)

    @classmethod
    def find(cls, name: str, data: Mapping[str, object]) -> Law:
        """The law of a name, with what the table says besides; an error for validators where there is none."""
        shape = data.get("geometry")
        if isinstance(shape, str) and shape != SPHERE:
            law = cls.find(name, {**data, "geometry": None})
            assert isinstance(law, ContactLaw)  # no other table has this entry
            return on_geometry(law, shape, _curve(data))
        known = laws(cls.kind)
        odd = [key for key in (cls.formula, "units") if name != "expression" and data.get(key)]
        if odd:
            remedy = 'Remove it, or write law = "expression"'
            raise invalid('belongs to law = "expression"', remedy, odd[0])
        if name in known:
            return known[name]  # type: ignore[no-any-return]
        if name == "expression":
            return cls._of_formula(data)
        if ":" not in name and name not in REGISTRIES[cls.kind][0].names():
            raise invalid("is not one of the known values", nearest(name, tuple(known)), "law")
        law = _of_user(cls.kind, name)
        from hpcclear.laws.checks import check_parameters  # slow to load: for laws of users alone

        with at("law"):
            check_parameters(law)
        return law

    @classmethod
    def _of_formula(cls, data: Mapping[str, object]) -> Law:
        from hpcclear.laws.checks import check_parameters
        from hpcclear.laws.formula import law_of

        entry = cls.formula
        text, units = data.get(entry), data.get("units") or {}
        if not isinstance(text, str):
            raise invalid("'expression' needs a formula", f'Add {entry} = "..."', entry, text)
        if not (isinstance(units, Mapping) and {*map(type, units.values())} <= {str}):
            raise invalid("a table of units is expected here", 'Write, say, { b = "s/m" }', "units")
        with at(entry):
            law = law_of(cls.kind, text, tuple(units.items()))
        with at("units"):
            check_parameters(law)
        return law

    @classmethod
    def _refuse_unknown(cls, data: Mapping[str, object], law: Law | None) -> None:
        others = {p.name: p for one in _with_entries(cls.kind) for p in one.parameters}
        entries = {} if law is None else {p.name: p for p in law.parameters}
        for key in data:
            if key in cls.model_fields or key in entries or (law is None and key in others):
                continue
            if law is not None and law.name == "none" and key in others:
                off = f'{cls.kind} = "none" (--set effects.{cls.kind}=none)'
                reason = 'the law "none" has no parameters, and one says that friction is meant'
                raise invalid(reason, f'Write {off}, or set law = "coulomb"', "law", "none")
            if law is not None and key in law.elsewhere:
                reason, remedy = law.elsewhere[key]
                raise invalid(reason, remedy, key)
            if key in others:
                whose = "" if law is None else f"the law {law.name!r} has no {others[key].title}"
                raise invalid(whose, f"Remove it, or set effects.{cls.kind} as a whole table", key)
            reason = "is not a known key"
            raise invalid(reason, hint(key) + nearest(key, (*cls.model_fields, *entries)), key)

    @classmethod
    def _converted(cls, data: Mapping[str, object], law: Law) -> dict[str, object]:
        """Values of the law's parameters, defaults filled in."""
        found = dict[str, object]()
        theirs = law.name not in laws(cls.kind)
        for parameter in law.parameters:
            if parameter.name in cls.model_fields:
                reason = f"{law.name} has a parameter {parameter.name!r}, which is an entry of every law's table"
                raise invalid(reason, "Give the parameter another name", "law", law.name)
            value = data.get(parameter.name, parameter.default)
            if value is None:
                example = parameter.example or f"a number in {parameter.unit or 1}"
                what = f"two {parameter.name}" if parameter.count == 2 else f"a {parameter.title}"
                remedy = f"Add {parameter.name} = {example} or so"
                raise invalid(f"the law {law.name!r} needs {what}", remedy, parameter.name)
            found[parameter.name] = _value(parameter, value)
            if theirs and parameter.count == 1:
                quantity = quantity_of(parameter)
                units = ENTRIES.setdefault(f"effects.{cls.kind}.{parameter.name}", {})
                units[quantity.unit] = quantity
        wrong = None if law.check is None else law.check(found)
        if wrong is not None:
            raise invalid(*wrong)
        if theirs:
            from hpcclear.laws.checks import check

            with at("law"):
                check(law, tuple(found.items()))
        return found

    def _check(self) -> None:
        given = {name: getattr(self, name) for name in type(self).model_fields}
        self._law = type(self).find(self.law, given)

    def values(self) -> dict[str, Any]:
        """Values of the law's parameters by name, SI."""
        return dict(self.__pydantic_extra__ or {})

    def value(self, name: str) -> Any:
        """Return the value of one parameter; None if the law does not have it."""
        return self.values().get(name)

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: Any, handler: Any) -> JsonSchemaValue:
        """With the entries of all laws of this package."""
        made = handler.resolve_ref_schema(handler(schema))
        every = {one.name: one for one in _with_entries(cls.kind)}
        for law in every.values():
            for p in law.parameters:
                made["properties"].setdefault(p.name, _schema(p, every))
        words = made["properties"]["law"].get("description")
        made["properties"]["law"] = {
            "anyOf": [{"enum": [*laws(cls.kind)]}, {"type": "string", "pattern": PATTERN}],
            **({} if words is None else {"description": words}),
        }
        made["additionalProperties"] = True  # of users' laws
        return made


def _curve(data: Mapping[str, object]) -> Rows | None:
    """Rows of the entry ``curve``, both columns rising from 0, or None; an error for validators."""
    if data.get("curve") is None:
        return None
    with at("curve", data["curve"]):
        rows: Rows = Pairs("m", "N", ("depth", "force")).convert(data["curve"])
    rising = all(second[1] > first[1] for first, second in itertools.pairwise(rows))
    if min(rows[0]) < 0.0 or (rows[0][0] == 0.0) != (rows[0][1] == 0.0) or not rising:
        remedy = "Sort the rows; leave [0, 0] out"
        raise invalid("depths and forces must rise from 0", remedy, "curve", data["curve"])
    return rows


def _schema(parameter: Parameter, every: Mapping[str, Described]) -> JsonSchemaValue:
    entry = quantity_of(parameter).json_schema()
    own = parameter.name
    whose = [name for name, one in every.items() if own in [p.name for p in one.parameters]]
    if parameter.count > 1:
        many = parameter.count
        entry = {"type": "array", "items": entry, "minItems": many, "maxItems": many}
    default = "" if parameter.default is None else f"; default {parameter.default}"
    words = f"{parameter.words}, {parameter.unit or 'a number'} ({', '.join(whose)}{default})"
    return {**entry, "description": words}


def _value(parameter: Parameter, value: object) -> float | tuple[float, ...]:
    """A parameter's value in SI; an error for validators names its entry."""
    quantity = quantity_of(parameter)
    with at(parameter.name, value):
        if parameter.count == 1:
            return quantity.convert(value)
        if not isinstance(value, list | tuple) or len(value) != parameter.count:
            raise invalid("a list of two numbers is expected here", "Write it as [first, second]")
        return tuple(map(quantity.convert, value))

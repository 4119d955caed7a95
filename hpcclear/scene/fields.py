"""The building blocks of scene models: strict frozen tables, quantities with a unit and bounds, counts, places, named rows."""

import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from numbers import Integral
from typing import Annotated, Any, ClassVar, Self

from pydantic import BaseModel, ConfigDict, WithJsonSchema, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from hpcclear.base.errors import InputError, at, nearest as nearest
from hpcclear.base.units import factor, is_written_in, keep, shows_point, to_si

HERE = {
    ("torsionspring", "torsionalspring", "rotaryspring", "rotationalspring"):
        'A torsion spring is a load of kind "torsion-spring", with a body, stiffness and angle.',
    ("offset", "eccentricslider"):
        'Write offset in [mechanism] of a slider-crank; in a linkage the guide has line = "ground.NAME".',
    ("diametral", "diametric", "bearingdiameter", "journaldiameter", "borediameter", "pindiameter"):
        "Write diametral_clearance for the difference of both diameters, or half of it as clearance; halve the bore, too.",
    ("journalradius", "pinradius", "shaftradius"):
        "The radius of the journal is bearing_radius minus clearance: give these two.",
    ("tolerance", "capability"):
        'Tolerances of bore and pin are a random input, distribution = "fit"; those of the integrator numerics.rtol, atol.',
    ("gaspressure", "gasforce", "cylinder", "piston", "pressure", "indicated"):
        'A gas force is effects.slider_load, or the size of a force: { file = "p.csv", bore = "42 mm", ambient = "1 bar" }.',
    ("clockwise", "reverse", "rotationdirection", "senseofrotation"):
        "Angles and speeds count counter-clockwise: a drive turns clockwise with a negative speed.",
    ("backlash", "play", "slop", "looseness", "gap"):
        'The play of a joint is its radial clearance: kind = "clearance", clearance = "0.1 mm".',
    ("stroke",): "The stroke of a slider-crank is twice crank.length.",
    ("rpm", "revolutionsperminute"): 'Write the speed with its unit: speed = "600 rpm".',
    ("damper", "dashpot"): 'A damper is a load of kind "spring" with stiffness = 0 and a damping.',
    ("motor",): 'A motor is a drive of kind "torque", whose torque falls to 0 at no_load_speed.',
    ("flywheel",): 'A flywheel is flywheel_inertia of a drive of kind "torque".',
    ("camprofile", "cam"): 'The motion that a cam gives is a drive of kind "table".',
    ("gear",): "There are no gears: two drives of given speeds turn two bodies.",
    ("lubric", "oil"): "Oil is the table film of a joint with clearance.",
    ("weight",): "Write mass, in kg.",
    ("percentile",): 'A percentile is a quantile: statistic = "quantile", level = 0.9.',
    ("elasticmodulus", "emodulus", "modulus"):
        "Write bearing and journal = { youngs_modulus = ..., poisson_ratio = ... } of a joint.",
}  # fmt: skip
"""By what a word contains, without signs and in small letters."""


def hint(word: object) -> str:
    """A sentence that says how it is done here, and a space behind it; "" for a word that is not known."""
    plain = re.sub(r"[^a-z]", "", str(word).lower())
    for words, sentence in HERE.items():
        if any(one in plain if len(one) > 4 else one == plain for one in words):
            return f"{sentence} "
    return ""


Content = dict[str, Any]
"""Tables as a file has them: numbers, texts, lists and tables by their names; whatever stands there until it is valid."""
Entries = Mapping[str, Any]
"""The same, not to be changed."""
Tables = Mapping[str, object]
"""The same, to be read."""

LARGEST_COUNT = 2**53  # whole numbers beyond it are not exact as floats, and none of them is meant
LARGEST, SMALLEST = 1e30, 1e-30  # products of a few such numbers neither overflow nor vanish
LONGEST_CURVE = 100_000


def invalid(reason: str, remedy: str, key: str = "", value: object = ...) -> InputError:
    """An error for validators: `key` is relative to the table that is validated; `...`: what stands there."""
    return InputError(key, value, reason, remedy)


def check_known(name: str, known: Collection[str], reason: str, key: str = "") -> None:
    """An error for validators unless a name is one of those that are known; it proposes the nearest."""
    if name not in known:
        raise invalid(f"{name!r} {reason}", nearest(name, tuple(known)), key)


def table_at(content: object, path: str) -> Tables:
    """The table at a dotted path of tables that are not validated yet; empty where none is."""
    for key in path.split("."):
        content = content.get(key) if isinstance(content, Mapping) else None
    return content if isinstance(content, Mapping) else {}


def checked_table(data: object) -> Mapping[str, object]:
    """A table whose keys are strings; an error for validators where it is none."""
    if not isinstance(data, Mapping):
        raise invalid("a table is expected here", "Write it as [table] or { key = value }")
    for key in data:
        if not isinstance(key, str):
            raise invalid("keys are strings", "Write the key as text", key=repr(key))
    return data


class Table(BaseModel):
    """A table of the scene file: frozen, and closed against unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)

    elsewhere: ClassVar[Mapping[str, tuple[str, str]]] = {}
    """Keys that a user might expect here and that belong to another kind: reason and remedy."""

    @classmethod
    def _of_file(cls, row: Entries) -> Entries:
        """Entries of this class, of a table as a file has it; an error for validators where it makes none."""
        return row

    @model_validator(mode="before")
    @classmethod
    def _known_keys(cls, data: object) -> object:
        if isinstance(data, Table):
            return data
        data = checked_table(cls._of_file(data) if isinstance(data, Mapping) else data)
        known = tuple(cls.model_fields)
        for key in data:
            if key not in known:
                unknown = "is not a known key", hint(key) + nearest(key, known)
                reason, remedy = cls.elsewhere.get(key, unknown)
                raise invalid(reason, remedy, key=key)
        return data

    @model_validator(mode="after")
    def _fits(self) -> Self:
        self.check()
        return self

    def check(self) -> None:
        """An error for validators where entries contradict each other.

        Each class may have a `_check`. All are called, the most general first: a kind adds to what is checked, and cannot
        replace it.
        """
        for kind in reversed(type(self).__mro__):
            if "_check" in kind.__dict__:
                try:
                    kind.__dict__["_check"](self)
                except InputError as error:
                    error.value = self._held(error.key) if error.value is ... else error.value
                    raise

    def check_one_of(self, remedy: str, *keys: str) -> None:
        """An error for validators unless exactly one of some entries is given."""
        given = [key for key in keys if getattr(self, key) is not None]
        if len(given) != 1:
            raise invalid("is given twice or not at all", remedy, (given or keys)[0])

    def _held(self, key: str) -> object:
        """A number or text at a dotted key, which may be a default that no file has; `...` for anything else."""
        found: Any = self
        for part in key.split("."):
            if not (isinstance(found, Table) and part in type(found).model_fields):
                return ...
            found = getattr(found, part)
        return ... if isinstance(found, (Table, tuple)) else found


class Converted:
    """What an entry is made into: an annotation whose `convert` is pydantic's validator."""

    def convert(self, value: object) -> object:
        """The value as the scene holds it; an error for validators where it is none."""
        raise NotImplementedError

    def json_schema(self) -> JsonSchemaValue:
        """What a file may have there."""
        raise NotImplementedError

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.convert)

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> JsonSchemaValue:
        return self.json_schema()


@dataclass(frozen=True)
class Quantity(Converted):
    """A finite float in an SI unit, given as a number or as a string with a unit; open or closed
    bounds, `nonzero` for numbers of either sign."""

    unit: str = ""
    above: float | None = None
    below: float | None = None
    least: float | None = None
    most: float | None = None
    why: str = ""
    nonzero: bool = False

    def convert(self, value: object, key: str = "", decided: bool = False) -> float:
        """The value in SI; an error for validators, with the key of the value; `decided` as of `to_si`."""
        number = self.number(value, key, decided)
        if not self.holds(number):
            why = f": {self.why}" if self.why else ""
            unit = is_written_in(value) if isinstance(value, str) else self.unit
            limits = self.bounds(unit)
            raise invalid(f"must be {limits}{why}", f"Write a number {limits}", key)
        return number

    def range(self, value: object, key: str) -> tuple[float, float]:
        """A pair in rising order; errors as `convert`."""
        if not isinstance(value, (list, tuple)) or len(value) != 2:
            raise invalid("two bounds are expected here", "Write [lower, upper]", key)
        lower, upper = self._together(value, key)
        if not lower < upper:
            reason = "the bounds are equal" if lower == upper else "the bounds are crossed"
            raise invalid(reason, "Write a smaller bound, then a larger one", key)
        if self.nonzero and lower < 0.0 < upper:
            raise invalid("0 is between the bounds", "Keep to one sign: nothing moves at 0", key)
        return lower, upper

    def several(self, value: object, key: str, least: int, most: int) -> tuple[float, ...]:
        """Numbers, at least and at most so many; errors as `convert`."""
        if not isinstance(value, (list, tuple)) or not least <= len(value) <= most:
            count = f"{least}" if least == most else f"from {least} to {most}"
            raise invalid(f"{count} numbers are expected here", "Write [first, second]", key)
        return self._together(value, key)

    def _together(self, values: Sequence[object], key: str) -> tuple[float, ...]:
        """Numbers of one list: a point before decimals of one shows what those of the others are."""
        decided = any(map(shows_point, values))
        return tuple(self.convert(one, key, decided) for one in values)

    def number(self, value: object, key: str = "", decided: bool = False) -> float:
        """The value in SI, finite, bounds not looked at; errors as `convert`."""
        if isinstance(value, str):
            with at(key):
                value = to_si(value, self.unit, decided)
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise invalid("a number is expected here", self._remedy(), key)
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        keep(number, self.unit, str(value))
        if not math.isfinite(number):
            raise invalid("the number must be finite", self._remedy(), key)
        if abs(number) > LARGEST or 0 < abs(number) < SMALLEST:
            raise invalid("the number is outside the physical range", self._remedy(), key)
        return number

    def holds(self, value: Any) -> Any:
        """Whether a float is finite and within the bounds; elementwise for an array."""
        lower = -math.inf if self.above is None else self.above
        upper = math.inf if self.below is None else self.below
        least = -LARGEST if self.least is None else self.least
        most = LARGEST if self.most is None else self.most
        within = (value > lower) & (value < upper) & (value >= least) & (value <= most)
        return within & (value != 0.0) if self.nonzero else within

    def bounds(self, unit: str | None = None) -> str:
        """The bounds in words, in a unit, by default that of the entry; empty where there are none."""
        unit = self.unit if unit is None else unit
        times = float(factor(unit, self.unit)) if unit != self.unit else 1.0
        limits = {"above": self.above, "at least": self.least, "below": self.below}
        limits["at most"] = self.most
        parts = [f"{word} {one / times:.6g}" for word, one in limits.items() if one is not None]
        parts += ["other than 0"] * self.nonzero
        return " and ".join(parts) + (f" {unit}" if unit and parts else "")

    def _remedy(self) -> str:
        limits = self.bounds()
        unit = f" in {self.unit}" if self.unit and not limits else ""
        return f"Write a number{unit}{' ' if limits else ''}{limits}"

    def json_schema(self) -> JsonSchemaValue:
        """A number within the bounds, or a text with a unit."""
        words = ("exclusiveMinimum", "exclusiveMaximum", "minimum", "maximum")
        bounds = zip(words, (self.above, self.below, self.least, self.most), strict=True)
        number: JsonSchemaValue = {"type": "number"}
        number |= {word: one for word, one in bounds if one is not None}
        if self.nonzero:
            number["not"] = {"const": 0}
        if not self.unit:
            share = {"type": "string", "pattern": r"%\s*$", "description": "a number with %"}
            return {"anyOf": [number, share]}
        text = {"type": "string", "description": f"a number with a unit of {self.unit}"}
        return {"anyOf": [number, text], "description": f"in {self.unit}, or a string with a unit"}


@dataclass(frozen=True)
class Count(Converted):
    """A whole number within closed bounds."""

    least: int = 0
    most: int = LARGEST_COUNT

    def convert(self, value: object) -> int:
        """The value; an error for validators where it is none."""
        remedy = f"Write a whole number from {self.least} to {self.most}"
        if isinstance(value, bool) or not isinstance(value, Integral | float) or value % 1:
            raise invalid("a whole number is expected here", remedy)  # NaN and inf are none
        if not self.least <= (count := int(value)) <= self.most:
            raise invalid(f"must be from {self.least} to {self.most}", remedy)
        return count

    def json_schema(self) -> JsonSchemaValue:
        """A whole number within the bounds."""
        return {"type": "integer", "minimum": self.least, "maximum": self.most}


OF_FILE = {"type": "object", "title": "FileCurve"}
"""JSON schema of a curve from a file; the schema of a scene puts that of its table in its place."""


@dataclass(frozen=True)
class NamedRows:
    """A table of named rows, kept in file order as a tuple, because a dict would not be frozen."""

    pairs: bool = False
    """Whether a row may be ``[x, y]``."""

    def rows(self, value: object) -> object:
        """``{name: {...}}`` as ``[{"name": name, ...}]``."""
        if isinstance(value, tuple):
            return value
        form = "[x, y]" if self.pairs else "{ key = value }"
        if not isinstance(value, Mapping):
            raise invalid("a table is expected here", f"Write it as [table] or {{ NAME = {form} }}")
        made = []
        for name, row in value.items():
            if self.pairs and isinstance(row, (list, tuple)) and len(row) == 2:
                row = {"x": row[0], "y": row[1]}
            if not isinstance(row, Mapping):
                what = "a pair" if self.pairs else "a table"
                raise invalid(f"{what} is expected here", f"Write it as {form}", str(name))
            if "name" in row:
                raise invalid("the name is the key of this table", "Remove it", f"{name}.name")
            made.append({"name": name, **row})
        return made

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        return core_schema.no_info_before_validator_function(self.rows, handler(source))

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> JsonSchemaValue:
        return {"type": "object", "additionalProperties": handler(schema)["items"]}


NUMBER: JsonSchemaValue = {"anyOf": [{"type": "number"}, {"type": "string"}]}
_LIST = {"type": "array", "items": NUMBER, "minItems": 2}
Number = Annotated[float | None, WithJsonSchema(NUMBER)]
"""A number that its table converts to SI, because its unit depends on other entries."""
Bounds = Annotated[tuple[float, float] | None, WithJsonSchema({**_LIST, "maxItems": 2})]
"""Such a pair."""
Numbers = Annotated[tuple[float, ...] | None, WithJsonSchema({**_LIST, "maxItems": LONGEST_CURVE})]
"""Several such numbers."""
Length = Annotated[float, Quantity("m")]
PositiveLength = Annotated[float, Quantity("m", above=0)]
Mass = Annotated[float, Quantity("kg", above=0)]
Inertia = Annotated[float, Quantity("kg*m**2", above=0)]
Speed = Annotated[float, Quantity("m/s", above=0)]
Angle = Annotated[float, Quantity("rad")]


class PairTable(Table):
    """Two components along x and y; ``[x, y]`` in the file is the same."""

    @model_validator(mode="before")
    @classmethod
    def _from_pair(cls, data: object) -> object:
        if not isinstance(data, (list, tuple)):
            return data
        if len(data) != 2:
            raise invalid("a pair [x, y] is expected here", "Write [x, y]")
        return {"x": data[0], "y": data[1]}


class Position(PairTable):
    """A place or an offset; ``[x, y]`` is the same."""

    x: Length
    """x coordinate, m."""
    y: Length
    """y coordinate, m."""


class NamedPlace(Position):
    """A point of a body, in its own axes; ``[x, y]`` is the same."""

    name: str


NamedPlaces = Annotated[tuple[NamedPlace, ...], NamedRows(pairs=True)]
NOWHERE = Position(x=0.0, y=0.0)

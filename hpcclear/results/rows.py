"""What a kind of result file declares, a row of its table, and rows that several of them share.

``objective`` in the place of a unit, and ``objective^2``, stand for the unit of the study's objective, ``rate`` for that of
what is made of its rate (`FileVariable.of`).
Units are written so that UDUNITS (CF), pint and cf-xarray all read them ("kg m^2", not "kg m2").
"""

from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import NamedTuple

import numpy as np

from hpcclear.base.objectives import MEAN_GAP, Objective
from hpcclear.base.outcome import FIELDS, JUDGED, ON_REQUEST, Flag, Regime, Status

Dims = tuple[str, ...]


class FlagCodes(NamedTuple):
    """What the codes of a flag mean, in the attributes of CF."""

    values: tuple[int, ...]
    words: tuple[str, ...]
    are_masks: bool = False
    """Whether they are bits of one number."""

    @classmethod
    def of(cls, codes: type[IntEnum] | str) -> "FlagCodes":
        """Those of an enumeration, or of words from 0 on, separated by blanks."""
        if isinstance(codes, str):
            return cls(tuple(range(len(codes.split()))), tuple(codes.split()))
        members = list(codes)
        words = tuple(one.name.lower() for one in members)
        return cls(tuple(map(int, members)), words, codes is Flag)

    @property
    def attributes(self) -> dict[str, object]:
        """As attributes of a variable."""
        entry = "flag_masks" if self.are_masks else "flag_values"
        return {entry: np.array(self.values, np.int8), "flag_meanings": " ".join(self.words)}


class FileVariable(NamedTuple):
    """A row of the table: what one variable of a file is."""

    dims: Dims
    units: str  # "" for text and flags, which have none; see `of`
    long_name: str
    dtype: str  # "f8", "i8", "i1" or "text"
    required: bool = False
    codes: FlagCodes | None = None  # of a flag

    def unit(self, objective: str, rate: str = "that of the rate") -> str:
        """The unit in a study whose objective has the unit `objective`, and what is made of its rate the unit `rate`."""
        if self.units == "objective^2":
            return f"{objective}^2" if objective.isalpha() else f"({objective})^2"
        return {"objective": objective, "rate": rate}.get(self.units, self.units)

    def of(self, objective: Objective) -> "FileVariable":
        """The row in a file of results for that objective: its unit, and its words in place of the mean gap's."""
        words = self.long_name.replace(MEAN_GAP.words, objective.words)
        unit = self.unit(objective.unit or "1", objective.unit_of_rate or "1")
        return self._replace(units=unit, long_name=words)


FileVariables = dict[str, FileVariable]


@dataclass(frozen=True)
class ResultKind:
    """A kind of result file.

    Its figures, its section of the page and its sentences are declared in one file of `hpcclear.report` (see
    `hpcclear.report.parts`); all else that programs know of it stands here.
    """

    order: int
    """Place among the kinds, on the reference page and on that of a study."""
    title: str
    rows: Dims
    """Dimensions along which the rows of an exported table go."""
    table: FileVariables
    """All variables; coordinates are named as their only dimension."""
    design_dims: Dims | None = None
    """Dimensions of its design variables; None: it has none."""
    limit_dims: Dims | None = None
    """Dimensions of their bounds, NAME_lower and NAME_upper."""
    optional: Dims = ()
    """Coordinates that only some files have."""
    whole: bool = False
    """Whether only what is made on request may be missing; else all that is not `FileVariable.required`."""
    absent: str = ""
    """What the page of a study says where there is no such file; "" for nothing."""
    alone: bool = False
    """Whether a command of its own writes it, into a directory that needs nothing else."""

    @cached_property
    def coords(self) -> FileVariables:
        """Coordinates of the table."""
        return {name: row for name, row in self.table.items() if row.dims == (name,)}

    @cached_property
    def data(self) -> FileVariables:
        """Data variables of the table."""
        return {name: row for name, row in self.table.items() if name not in self.coords}

    @cached_property
    def required(self) -> set[str]:
        """Data variables that every file has."""
        if self.whole:
            return self.data.keys() - {*ON_REQUEST, *JUDGED, "label"}
        return {name for name, row in self.data.items() if row.required}


def number(dims: str, units: str, long_name: str, *, required: bool = False) -> FileVariable:
    """A number of double precision; `dims`: its dimensions, separated by blanks, as of all rows below."""
    return FileVariable(tuple(dims.split()), units, long_name, "f8", required)


def count(dims: str, long_name: str, *, required: bool = False) -> FileVariable:
    """A whole number."""
    return FileVariable(tuple(dims.split()), "1", long_name, "i8", required)


def flag(
    dims: str, long_name: str, codes: type[IntEnum] | str, *, required: bool = False
) -> FileVariable:
    """A small code, whose meanings (`FlagCodes.of`) are attributes."""
    return FileVariable(tuple(dims.split()), "", long_name, "i1", required, FlagCodes.of(codes))


def text(dims: str, long_name: str, *, required: bool = False) -> FileVariable:
    """Words."""
    return FileVariable(tuple(dims.split()), "", long_name, "text", required)


_CODES = {one.__name__.lower(): FlagCodes.of(one) for one in (Regime, Status)}
_CODES |= {"flags": FlagCodes.of(Flag), "latched": FlagCodes.of("free latched")}
"""Of the codes in a record."""


def outcome(*per_sample: str) -> FileVariables:
    """What one simulation comes to, in a file with these dimensions."""
    return {
        name: FileVariable(
            (*per_sample, *one.per.split()), one.unit, one.words, one.kind, one.required, _CODES.get(name)
        )
        for name, one in FIELDS.items()
        if name not in ("sample", "band") and (per_sample or not {"wave", "band"} & {*one.per.split()})
    }  # fmt: skip


def estimate(
    name: str, dims: str, units: str, words: str, true: str = "", level: str = "", *, required: bool = False
) -> FileVariables:  # fmt: skip
    """A number, called NAME and `true`, and the ends of its confidence interval of some `level`, NAME_lower and NAME_upper."""
    found = {f"{name}{true}": number(dims, units, words, required=required)}
    for end in ("lower", "upper"):
        of_end = f"{words}: {end} end of its {level}confidence interval"
        found[f"{name}_{end}"] = number(dims, units, of_end)
    return found


def with_error(
    name: str, dims: str, units: str, words: str, *, required: bool = False
) -> FileVariables:
    """A number, `required` or not, and its standard error as NAME_error."""
    error = number(dims, units, f"standard error of {name}")
    return {name: number(dims, units, words, required=required), f"{name}_error": error}

"""What a kind of result file declares, a row of its table, and rows that several of them share.

``objective`` in the place of a unit, and ``objective^2``, stand for the unit of the study's objective, ``rate`` for that of
what is made of its rate (`Column.of`).
Units are written so that UDUNITS (CF), pint and cf-xarray all read them ("kg m^2", not "kg m2").
"""

from collections.abc import Collection
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from hpcclear.base.objectives import MEAN_GAP, Objective, Usual
from hpcclear.base.outcome import FIELDS, IMPACTS, JUDGED, ON_REQUEST, Flag, Regime, Status

Dims = tuple[str, ...]


class Codes(NamedTuple):
    """What the codes of a flag mean, in the attributes of CF."""

    values: tuple[int, ...]
    words: tuple[str, ...]
    are_masks: bool = False
    """Whether they are bits of one number."""

    @classmethod
    def of(cls, codes: type[IntEnum] | str) -> "Codes":
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


class Column(NamedTuple):
    """A row of the table: what one variable of a file is."""

    dims: Dims
    units: str  # "" for text and flags, which have none; see `of`
    long_name: str
    dtype: str  # "f8", "i8", "i1" or "text"
    required: bool = False
    codes: Codes | None = None  # of a flag
    label: str = ""  # short words, where the name is none; see `in_words`

    def in_words(self, name: str) -> str:
        """What a variable of this name is called on an axis, without its unit: "contact force"."""
        return self.label or name.replace("_", " ")

    def unit(self, objective: str, rate: str = "that of the rate") -> str:
        """The unit in a study whose objective has the unit `objective`, and what is made of its rate the unit `rate`."""
        if self.units == "objective^2":
            return f"{objective}^2" if objective.isalpha() else f"({objective})^2"
        return {"objective": objective, "rate": rate}.get(self.units, self.units)

    def of(self, objective: Objective) -> "Column":
        """The row in a file of results for that objective: its unit, and its words in place of the mean gap's."""
        words = self.long_name.replace(MEAN_GAP.words, objective.words)
        unit = self.unit(objective.unit or "1", objective.unit_of_rate or "1")
        return self._replace(units=unit, long_name=words)


Columns = dict[str, Column]


class Kind(NamedTuple):
    """A kind of result file.

    Its figures, its section of the page and its sentences are declared in one file of `hpcclear.report` (see
    `hpcclear.report.parts`); all else that programs know of it stands here.
    """

    order: int
    """Place among the kinds, on the reference page and on that of a study."""
    title: str
    coords: Columns
    data: Columns
    required: frozenset[str]
    """Data variables that every file has."""
    optional: frozenset[str]
    """Coordinates that only some files have."""
    rows: Dims
    """Dimensions along which the rows of an exported table go."""
    design_dims: Dims | None
    """Dimensions of its design variables; None: it has none."""
    limit_dims: Dims | None
    """Dimensions of their bounds, NAME_lower and NAME_upper."""
    absent: str
    """What the page of a study says where there is no such file; "" for nothing."""
    alone: bool
    """Whether a command of its own writes it, into a directory that needs nothing else."""


def kind_of(
    order: int,
    title: str,
    rows: Dims,
    *,
    table: Columns,
    design_dims: Dims | None = None,
    limit_dims: Dims | None = None,
    optional: Collection[str] = (),
    whole: bool = False,
    absent: str = "",
    alone: bool = False,
) -> Kind:
    """Declare a kind by its table, whose coordinates are rows named as their only dimension; see `Kind`.

    Of a `whole` one only what is made on request may be missing.
    """
    coords = {name: row for name, row in table.items() if row.dims == (name,)}
    data = {name: row for name, row in table.items() if name not in coords}
    least = (
        set(data) - {*ON_REQUEST, *JUDGED, "label"}
        if whole
        else {name for name, row in data.items() if row.required}
    )
    return Kind(
        order, title, coords, data, frozenset(least), frozenset(optional), rows, design_dims, limit_dims, absent, alone
    )  # fmt: skip


def number(
    dims: Dims, units: str, long_name: str, label: str = "", *, required: bool = False
) -> Column:
    """A number of double precision."""
    return Column(dims, units, long_name, "f8", required, label=label)


def count(dims: Dims, long_name: str, *, required: bool = False) -> Column:
    """A whole number."""
    return Column(dims, "1", long_name, "i8", required)


def flag(
    dims: Dims, long_name: str, codes: type[IntEnum] | str, *, required: bool = False
) -> Column:
    """A small code, whose meanings (`Codes.of`) are attributes."""
    return Column(dims, "", long_name, "i1", required, Codes.of(codes))


def text(dims: Dims, long_name: str, *, required: bool = False) -> Column:
    """Words."""
    return Column(dims, "", long_name, "text", required)


_CODES = {
    "latched": Codes((0, 1), ("free", "latched")),
    "regime": Codes.of(Regime),
    "status": Codes.of(Status),
    "flags": Codes.of(Flag),
}
"""Of the codes in a record."""


def outcome(*per_sample: str) -> Columns:
    """What one simulation comes to, in a file with these dimensions."""
    return {
        name: Column(
            (*per_sample, *one.per.split()), one.unit, one.words, one.kind, one.required, _CODES.get(name)
        )
        for name, one in FIELDS.items()
        if name not in ("sample", "band") and (per_sample or not {"wave", "band"} & {*one.per.split()})
    }  # fmt: skip


def by_revolution() -> Columns:
    """Measures of impact and noise of each averaged revolution."""
    found = {}
    means = outcome()
    for name in IMPACTS:
        row = means[name]
        dims = ("revolution", *row.dims)
        found[f"{name}_by_revolution"] = number(dims, row.units, f"{row.long_name}: of each")
    return found


def spectrum(name: str, words: str, *dims: str) -> Columns:
    """Orders and third-octave levels of a force."""
    found = {
        f"{name}_orders": number(
            ("order", *dims), "N", f"root mean square of the order in the {words}"
        )
    }
    level = f"third-octave level of the {words}, dB re 1e-6 N; NaN of a band without an order"
    for end, which in (("", ""), ("_lower", ": lower end"), ("_upper", ": upper end")):
        interval = f"{which} of its 95 % confidence interval" if which else ""
        found[f"{name}_level{end}"] = number(("band", *dims), "1", level + interval)
    return found


def fit(*dims: str) -> Columns:
    """How well a model does."""
    return {
        "r2": number(dims, "1", "1 - SSE/SST on test points", required=True),
        "rmae": number(
            dims,
            "1",
            "largest test error / standard deviation of test values",
            required=True,
        ),
        "r2_explained": number(dims, "1", "explained variance ratio, eq. 26 as printed"),
        "rmae_mean": number(
            dims,
            "1",
            "largest test error / mean of test values, eq. 27 as printed",
        ),
        "rmse": number(dims, "objective", "root mean square error on test points"),
        "points": count(dims, "number of points fitted"),
    }


def statistics_of(name: str, dims: Dims, units: str, words: str) -> Columns:
    """Statistics of one result."""
    return {
        f"{name}_count": count(dims, f"number of finite values of the {words}", required=True),
        f"{name}_mean": number(dims, units, f"mean of the {words}", required=True),
        f"{name}_deviation": number(
            dims, units, f"sample standard deviation of the {words}", required=True
        ),
        f"{name}_minimum": number(dims, units, f"least {words}", required=True),
        f"{name}_maximum": number(dims, units, f"greatest {words}", required=True),
        f"{name}_histogram": count((*dims, "bin"), f"number of samples by {words}", required=True),
        f"{name}_edges": number(
            (*dims, "edge"), units, f"edges of the bins of the {words}", required=True
        ),
    }


def goal(name: str) -> Columns:
    """Objectives of a case, other than mean and standard deviation; each design has those of its case."""
    of = f"{name} objective of the case"
    return {
        f"{name}_goal": text(("design",), f"{of}, in words"),
        f"{name}_unit": text(("design",), f"{of}: unit, empty for none"),
        f"{name}_usual": flag(("design",), f"{of}: whether it is reported of every design", Usual),
        f"{name}_true": number(("design",), "", f"{of}, by simulation"),
        f"{name}_lower": number(("design",), "", f"{of}: lower end of its confidence interval"),
        f"{name}_upper": number(("design",), "", f"{of}: upper end of its confidence interval"),
    }

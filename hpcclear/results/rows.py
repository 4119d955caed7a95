"""What a row of the tables of result files is, and rows that several of them share.

``objective`` in the place of a unit, and ``objective^2``, stand for the unit of the study's objective, ``rate`` for that of
what is made of its rate (`Column.of`).
Units are written so that UDUNITS (CF), pint and cf-xarray all read them ("kg m^2", not "kg m2").
"""

from typing import NamedTuple

from hpcclear.base.objectives import MEAN_GAP, Objective
from hpcclear.base.outcome import FIELDS, IMPACTS

Dims = tuple[str, ...]


class Column(NamedTuple):
    """A row of the table: what one variable of a file is."""

    dims: Dims
    units: str  # "" for text and flags, which have none; see `of`
    long_name: str
    dtype: str  # "f8", "i8", "i1" or "text"
    required: bool = False
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


def number(
    dims: Dims, units: str, long_name: str, label: str = "", *, required: bool = False
) -> Column:
    """A number of double precision."""
    return Column(dims, units, long_name, "f8", required, label)


def count(dims: Dims, long_name: str, *, required: bool = False) -> Column:
    """A whole number."""
    return Column(dims, "1", long_name, "i8", required)


def flag(dims: Dims, long_name: str, *, required: bool = False) -> Column:
    """A small code, whose meanings are attributes."""
    return Column(dims, "", long_name, "i1", required)


def text(dims: Dims, long_name: str, *, required: bool = False) -> Column:
    """Words."""
    return Column(dims, "", long_name, "text", required)


def outcome(*per_sample: str) -> Columns:
    """What one simulation comes to, in a file with these dimensions."""
    return {
        name: Column((*per_sample, *one.per.split()), one.unit, one.words, one.kind, one.required)
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
        f"{name}_true": number(("design",), "", f"{of}, by simulation"),
        f"{name}_lower": number(("design",), "", f"{of}: lower end of its confidence interval"),
        f"{name}_upper": number(("design",), "", f"{of}: upper end of its confidence interval"),
    }

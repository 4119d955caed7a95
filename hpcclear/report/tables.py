"""Results as one table: a row a design or an instant, joints as columns, quantities with their units as headings.

This is what leaves the program for spreadsheets, MATLAB and pandas; `hpcclear.report.export` writes it.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.base.units import factor, fits, is_written_in
from hpcclear.base.written import reading, text_of, unit_for
from hpcclear.report.figures import labels
from hpcclear.report.html.content import scene_of
from hpcclear.results.content import Results, Variable
from hpcclear.results.names import KINDS

if TYPE_CHECKING:
    import xarray as xr
    from pandas import DataFrame

MOST_COLUMNS = 128
"""Columns that one variable may fill: profiles around a bearing have thousands, and stay in the result file."""

SI = "SI"
"""Word for the units of the result file, in place of those of the scene."""


def to_table(content: xr.Dataset | Results, units: Sequence[str] = ()) -> DataFrame:
    """Return a result as a table.

    Parameters
    ----------
    content : xarray.Dataset
        Of any kind that hpcclear writes: a response has a row for each stored instant, samples and maps a row for each design,
        a verification a row for each verified design.
    units : sequence of str
        Units of all quantities that they fit, such as ``("mm", "kN", "deg", "rpm")``. A quantity for which none is given has
        the unit that the scene file uses most for its kind, else its SI unit. ``"SI"`` alone: SI units everywhere.

    Returns
    -------
    pandas.DataFrame
        Headings are names with their units, ``peak_contact_force crank_rod [N]``; labels of joints, bodies and points
        follow the name. Codes are words (``status``). Failed numbers are NaN. ``attrs`` holds single values of the result by
        the same kind of heading, ``units`` and ``long_names`` by heading, ``left_out`` (variables with too many
        columns), ``scene`` and ``scene_hash``.

    Raises
    ------
    InputError
        The dataset is no result, or one of `units` is no unit of any quantity in it.
    """
    import pandas as pd  # comes with xarray

    content = Results.of(content)
    kind = str(content.attrs.get("hpcclear_kind"))
    if kind not in KINDS:
        reason = "the dataset is no result of hpcclear"
        raise InputError("kind", kind, reason, "Give a dataset that hpcclear wrote or returned")
    rows = KINDS[kind].rows
    made = _Table(content, rows, Units(content, units))
    for variable in dict.fromkeys([*rows, *map(str, content.variables)]):
        made.add(variable)
    table = pd.DataFrame(made.columns)
    if len(made.rows) > 1:  # places of a grid that nothing fills
        numbers = [h for h, one in made.columns.items() if one.dtype.kind == "f"]
        known = [heading for heading in numbers if heading not in made.keys]
        table = table[table[known].notna().any(axis=1)].reset_index(drop=True) if known else table
    origin = {key: str(content.attrs.get(key, "")) for key in ("title", "scene", "scene_hash")}
    table.attrs = {
        **made.single, "units": made.units, "long_names": made.words,
        "left_out": made.left_out, "kind": kind, **origin,
    }  # fmt: skip
    return table


class _Table:
    """A table in the making."""

    def __init__(self, content: Results, rows: tuple[str, ...], units: Units) -> None:
        self.content, self.rows, self._units = content, rows, units
        self.shape = tuple(content.sizes[dim] for dim in rows)
        self.columns: dict[str, np.ndarray] = {}
        self.keys: set[str] = set()
        self.single: dict[str, object] = {}
        self.units: dict[str, str] = {}
        self.words: dict[str, str] = {}
        self.left_out: list[str] = []

    def add(self, name: str) -> None:
        """Add a variable: as columns, as single values, or to what is left out."""
        variable = self.content[name]
        if (name in self.content.sizes and name not in self.rows) or "rival" in variable.dims:
            return  # labels of columns; rows against rows, which a text has as well
        variable = _lower_edges(variable, self.content, self.rows)
        dims = variable.dims
        across = [dim for dim in dims if dim not in self.rows]
        alone = not set(dims) & set(self.rows)
        sizes = [variable.shape[dims.index(dim)] for dim in across]
        count = int(np.prod(sizes, initial=1))
        if count > MOST_COLUMNS or (alone and not set(across) <= {"joint"}):
            self.left_out.append(name)
            return
        values, unit = self._units.shown(variable)
        order = [*(d for d in self.rows if d in dims), *across]
        ordered = Variable(tuple(order), values.transpose([dims.index(dim) for dim in order]))
        for place in product(*map(range, sizes)):
            label = " ".join(_label(self.content, d, k) for d, k in zip(across, place, strict=True))
            heading = " ".join(part for part in (name, label, unit and f"[{unit}]") if part)
            one = ordered.isel(dict(zip(across, place, strict=True)))
            self.units[heading] = unit
            self.words[heading] = str(variable.attrs.get("long_name", name))
            if alone:
                self.single[heading] = one.item()
                continue
            # of every row, repeated along dimensions that the variable lacks
            sizes = [self.content.sizes[d] if d in one.dims else 1 for d in self.rows]
            self.columns[heading] = np.broadcast_to(one.values.reshape(sizes), self.shape).ravel()
            self.keys |= {heading} if name in self.rows else set()


def _lower_edges(variable: Variable, content: Results, rows: tuple[str, ...]) -> Variable:
    """A variable; edges between bins as the lower edge of each bin, -inf of the first."""
    if "edge" in variable.dims and rows == ("bin",):
        edges = variable.dims.index("edge")
        whole = np.insert(variable.values, 0, -np.inf, axis=edges)
        if whole.shape[edges] == content.sizes["bin"]:
            dims = tuple("bin" if dim == "edge" else dim for dim in variable.dims)
            variable = Variable(dims, whole, variable.attrs, variable.name)
    return variable


def _label(content: Results, dim: str, place: int) -> str:
    """What a place along a dimension is called in a heading."""
    if dim not in content:
        return str(place)
    value = content[dim].values[place]
    return f"{value:g}" if isinstance(value, np.floating) else str(value)


class Units:
    """Units in which quantities are shown."""

    def __init__(self, content: Results, asked: Sequence[str]) -> None:
        self._si = list(asked) == [SI]
        self._asked = [] if self._si else list(asked)
        self._scene = None if self._si else scene_of(content)
        known = {str(v.attrs.get("units", "")) for v in content.variables.values()} - {"", "1"}
        fitting = {unit: [one for one in known if fits(unit, one)] for unit in self._asked}
        for unit, own in fitting.items():
            if not own:
                listed = ", ".join(sorted(map(labels.plain, known)))
                reason = "it fits no quantity of this result"
                raise InputError("--unit", unit, reason, f"Units of its quantities: {listed}")
            if len(same := [one for one in fitting if fitting[one] == own]) > 1:
                reason = "these are units of the same quantities"
                raise InputError("--unit", ", ".join(same), reason, "Keep one of them")

    def shown(self, variable: Variable) -> tuple[np.ndarray, str]:
        """Values and their unit; codes as words, without one."""
        values, unit = variable.values, str(variable.attrs.get("units", ""))
        if "flag_meanings" in variable.attrs:
            return _words(variable), ""
        if rows := labels.options(variable):
            return np.array(rows, object)[values.astype(int)], ""
        if unit in ("", "1") or values.dtype.kind != "f":
            return values, ""
        if chosen := self.chosen(unit, self._own(variable)):
            return values / float(factor(chosen, unit)), chosen
        return values, labels.plain(unit)

    def chosen(self, unit: str, own: Sequence[str] = ()) -> str:
        """The unit that shows quantities of a unit of SI, before which come those of a variable's own entry; "" for SI."""
        with reading({} if self._scene is None else self._scene.written):
            usual = unit_for(unit)
        every = (*self._asked, *own, *([usual] if usual != unit else []))
        return next((u for u in every if fits(u, unit)), "")

    def _own(self, variable: Variable) -> list[str]:
        """Units of the scene's own entry of a design variable, and of its range."""
        path, unit = (str(variable.attrs.get(name, "")) for name in ("scene_path", "units"))
        if self._scene is None or not path:
            return []
        study = self._scene.study
        rows = [] if study is None else [one for one in study.variables if one.name == path]
        ends = [self._scene.number(path)] if path in self._scene.numeric_paths() else []
        ends += [end for one in rows for end in one.range or ()]
        with reading(self._scene.written):
            return [own for end in ends if (own := is_written_in(text_of(end, unit)))]


def _words(variable: Variable) -> np.ndarray:
    """Codes (any shape) as the words of their meanings; several flags of one value are joined by a plus sign."""
    meanings = str(variable.attrs["flag_meanings"]).split()
    codes = variable.values
    single = "flag_values" in variable.attrs
    numbers = np.atleast_1d(variable.attrs["flag_values" if single else "flag_masks"])
    words: Mapping[int, str] = dict(zip(map(int, numbers), meanings, strict=True))

    def said(code: int) -> str:
        if single:
            return words.get(code, str(code))
        return "+".join(word for mask, word in words.items() if code & mask)

    text = {int(code): said(int(code)) for code in np.unique(codes)}
    return np.array([text[int(code)] for code in codes.ravel()], dtype=object).reshape(codes.shape)


def identifier(heading: str) -> str:
    """A heading as a name of MATLAB: letters, digits and underscores, at most 63; its unit is left out."""
    return re.sub(r"\W+", "_", heading.partition(" [")[0]).strip("_")[:63]

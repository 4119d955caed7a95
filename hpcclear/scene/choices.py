"""Variables that take some values only: numbers of a list or a grid, rows of a catalogue, fits by ISO 286.

The column of a catalogue or of fits holds the number of a row, from 0 on; what the row stands for is put in its place where
designs are simulated (`expanded`).
"""

from collections.abc import Mapping, Sequence
from typing import Annotated

import numpy as np
from pydantic import model_validator

from hpcclear.base.errors import at, nearest
from hpcclear.scene.fields import Quantity, Table, invalid
from hpcclear.scene.iso286 import fit_of
from hpcclear.scene.paths import quantities

MOST = 1000
"""Values of a variable at most."""

OF_RANDOM = "random."
"""What entries of random inputs begin with, as paths of variables."""

OF_INPUT = {
    "half_width": True, "deviation": True, "mean": True, "scale": True, "location": True, "shape": False, "fit": False,
    "bore.cp": False, "bore.cpk": False, "pin.cp": False, "pin.cpk": False,
}  # fmt: skip
"""Entries of random inputs that a variable may drive, and whether they have the unit of the input."""


class Row(Table):
    """A row of a catalogue: the values of all entries if it is chosen."""

    name: str
    cost: Annotated[float, Quantity("")] | None = None
    """Cost of this row, in one unit for all costs of the study."""
    entries: dict[str, float | str]
    """Values by path: numbers of the scene, SI, and entries of random inputs."""

    @model_validator(mode="before")
    @classmethod
    def _gathered(cls, data: object) -> object:
        """Paths beside the name, as a file has them, as `entries` in SI."""
        if not isinstance(data, Mapping) or "entries" in data:
            return data
        kept = {key: data[key] for key in ("name", "cost") if key in data}
        rest = {key: value for key, value in data.items() if key not in kept}
        entries = dict(_flat(rest))
        for path, value in entries.items():
            if path.startswith(OF_RANDOM):
                input_entry(path)
                continue
            if path not in quantities():
                remedy = nearest(path, tuple(quantities()))
                raise invalid("is not a physical number of a scene", remedy, path, value)
            with at(path, value):
                entries[path] = quantities()[path].convert(value)
        if not entries:
            raise invalid("has no entry", 'Write "joints.crank_rod.clearance" = "20 um", say')
        return {**kept, "entries": entries}


def _flat(table: Mapping[str, object], prefix: str = "") -> list[tuple[str, object]]:
    """Dotted keys, whether the file has them quoted or as nested tables."""
    found = []
    for key, value in table.items():
        path = f"{prefix}{key}"
        found += _flat(value, f"{path}.") if isinstance(value, Mapping) else [(path, value)]
    return found


def input_entry(path: str) -> tuple[str, str]:
    """Name and entry of the random input of a path such as "random.C12.half_width"; an error for validators if it is none."""
    _, _, rest = path.partition(".")
    name, _, entry = rest.partition(".")
    if entry not in OF_INPUT:
        raise invalid(
            f"{path!r} is no entry of a random input that a variable may drive",
            nearest(entry, tuple(OF_INPUT)),
            "path",
        )
    return name, entry


def rows_of_fits(fits: Sequence[str], follows: Sequence[str]) -> tuple[Row, ...]:
    """Fits as rows: clearance and bearing radius of the joints that have them, and what random inputs follow them."""
    rows = []
    for text in fits:
        fit, entries = fit_of(text), dict[str, float | str]()
        for path in follows:
            owner = path.removesuffix(".fit")
            if path.startswith(OF_RANDOM):
                entries[path] = text
            else:
                entries[f"{owner}.clearance"] = fit.clearance
                entries[f"{owner}.bearing_radius"] = fit.bearing_radius
        rows.append(Row(name=text, entries=entries))
    return tuple(rows)


def checked_names(names: Sequence[str], key: str) -> None:
    """An error for validators unless there are two or more, all different."""
    if not 2 <= len(names) <= MOST:
        raise invalid(f"from 2 to {MOST} of them are expected here", "Write a list", key)
    twice = next((name for name in names if list(names).count(name) > 1), None)
    if twice is not None:
        raise invalid(f"{twice!r} stands there twice", "Remove one", key)


def grid(lower: float, upper: float, step: float) -> tuple[float, ...]:
    """Values from `lower` on by `step`, up to `upper`; an error for validators if there are too few or too many."""
    count = int(np.floor((upper - lower) / step * (1 + 1e-12) + 1e-9)) + 1 if step > 0.0 else 0
    if not 2 <= count <= MOST:
        raise invalid(
            f"gives {count} values where from 2 to {MOST} are expected", "Correct it", "step"
        )
    return tuple(lower + step * k for k in range(count))

"""Measured samples of random inputs, read from CSV files where a scene is loaded."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hpcclear.base.errors import InputError
from hpcclear.scene.fields import nearest
from hpcclear.scene.table import csv_lines
from hpcclear.scene.units import UnitError, decimal

_HEADER = re.compile(r"([^\[\]]{0,200}?)\s*(?:\[\s*([^\[\]]{0,40}?)\s*\])?")


def with_values(content: Mapping[str, Any], folder: Path) -> Mapping[str, Any]:
    """The content of a scene with the values of files in place of `file` and `column` of its random inputs.

    Parameters
    ----------
    content : mapping
        Parsed, not validated.
    folder : path
        What names of files are relative to.

    Raises
    ------
    InputError
        If a file cannot be read, has no such column or a cell in it is no number.
    """
    named = files_named(content)
    if not named:
        return content
    study = content["study"]
    read = {key.rpartition(".")[2]: _with_values(row, key, folder) for key, row in named.items()}
    return {**content, "study": {**study, "random": {**study["random"], **read}}}


def files_named(content: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    """Return the tables of a parsed scene that name a file of values, by their dotted keys."""
    study = content.get("study")
    rows = study.get("random") if isinstance(study, Mapping) else None
    if not isinstance(rows, Mapping):
        return {}
    return {
        f"study.random.{name}": row
        for name, row in rows.items()
        if isinstance(row, Mapping) and "file" in row
    }


def _with_values(row: Mapping[str, Any], key: str, folder: Path) -> dict[str, Any]:
    file, column = row["file"], row.get("column")
    if not isinstance(file, str) or not file:
        raise InputError(
            f"{key}.file", file, "the name of a CSV file is expected here", "Write it in quotes"
        )
    if "values" in row:
        raise InputError(f"{key}.file", file, "values are given too", "Keep one of them")
    if column is not None and not isinstance(column, str):
        raise InputError(
            f"{key}.column", column, "the name of a column is expected here", "Write it in quotes"
        )
    kept = {name: entry for name, entry in row.items() if name not in ("file", "column")}
    return {**kept, "values": _column(folder / file, column, key)}


def _column(path: Path, column: str | None, key: str) -> list[float | str]:
    """The cells of a column: numbers, or text with the unit of its header."""
    (_, header), *rows = csv_lines(path, f"{key}.file")
    if column is None and len(header) > 1:
        remedy = f"Name one as column = {header[0]!r}: it has {', '.join(header[:20])}"
        raise InputError(f"{key}.column", None, f"{path} has {len(header)} columns", remedy)
    names = [_parsed(cell)[0] for cell in header]
    wanted = header[0] if column is None else column
    place = next((k for k, cell in enumerate(header) if wanted in (cell, names[k])), None)
    if place is None:
        remedy = nearest(wanted, tuple(names))
        raise InputError(f"{key}.column", wanted, f"is no column of {path}", remedy)
    unit = _parsed(header[place])[1]
    values: list[float | str] = []
    for line, cells in rows:
        where = f"{path}, line {line}, column {names[place]}"
        if len(cells) != len(header):
            reason = f"has {len(cells)} cells instead of {len(header)}"
            raise InputError(where, ",".join(cells)[:200], reason, "Give each column a value")
        try:
            value = decimal(cells[place])
        except UnitError as error:
            raise InputError(where, cells[place], error.reason, error.remedy) from None
        values.append(f"{cells[place]} {unit}" if unit else value)
    return values


def _parsed(cell: str) -> tuple[str, str]:
    """Name and unit of a header such as ``C [mm]``."""
    found = _HEADER.fullmatch(cell)
    return (cell, "") if found is None else (found.group(1), found.group(2) or "")

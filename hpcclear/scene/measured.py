"""What a scene takes from tables beside its file: measured samples of random inputs, curves, motions of drives."""

import hashlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from hpcclear.base.errors import InputError
from hpcclear.base.plain import plain
from hpcclear.scene.file_curves import FileCurve, against_time, pairs_of
from hpcclear.scene.loads import SIZED
from hpcclear.scene.paths import replace
from hpcclear.scene.sheets import place_of, read
from hpcclear.scene.validation import validated

CURVES = {
    "effects.slider_load": "N",
    "drive.torque": "N*m",
    "mechanism.drives.*.torque": "N*m",
    **{f"mechanism.loads.*.{one.size_entry}": one.unit for one in SIZED},
}
"""Entries that may be a curve against the crank angle, and their units."""
BY_TIME = {
    "mechanism.drives.*.angle": "rad",
    "mechanism.drives.*.speed_by_time": "rad/s",
    **{f"mechanism.loads.*.{one.size_entry}_by_time": one.unit for one in SIZED},
}
"""Entries that are tables against the time."""


def with_values(
    content: Mapping[str, object], folder: Path
) -> tuple[Mapping[str, object], list[str]]:
    """The content of a scene with what files hold in the place of their names, and a sentence for each.

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
    read_as = []
    for key, row in files_named(content).items():
        file = row["file"]
        if not isinstance(file, str) or not file:
            raise InputError(
                f"{key}.file", file, "the name of a table is expected here", "Write it in quotes"
            )
        made: object
        if key.startswith("study.random."):
            made, shown = _with_values(row, key, folder)
        else:
            made, shown = _curve(content, row, key, folder)
        content = replace(content, key, made)
        digest = hashlib.sha256(place_of(folder / file)[0].read_bytes()).hexdigest()
        text = f"{key}: {file!r} is read as {shown}, SHA-256 {digest[:16]}"
        read_as.append(plain(" ".join(text.split())))
    return content, read_as


def files_named(content: Mapping[str, object], prefix: str = "") -> dict[str, Mapping[str, object]]:
    """Return the tables of a parsed scene that name a file, by their dotted keys."""
    return dict(_named(content, prefix))


def _named(content: Mapping[str, object], prefix: str) -> Iterator[tuple[str, Mapping[str, Any]]]:
    for key, entry in content.items():
        if isinstance(entry, Mapping) and not prefix.startswith("plugins."):
            if "file" in entry:
                yield f"{prefix}{key}", entry
            else:
                yield from _named(entry, f"{prefix}{key}.")


def _with_values(row: Mapping[str, Any], key: str, folder: Path) -> tuple[dict[str, Any], str]:
    file, column = row["file"], row.get("column")
    if "values" in row:
        raise InputError(f"{key}.file", file, "values are given too", "Keep one of them")
    if column is not None and not isinstance(column, str):
        raise InputError(
            f"{key}.column", column, "the name of a column is expected here", "Write it in quotes"
        )
    kept = {name: entry for name, entry in row.items() if name not in ("file", "column")}
    values, shown = _column(folder / file, column, key)
    return {**kept, "values": values}, shown


def _column(path: Path, column: str | None, key: str) -> tuple[list[float | str], str]:
    """The cells of a column: numbers, or text with the unit of its header."""
    sheet = read(path, f"{key}.file")
    of_numbers = sheet.of_numbers or sheet.columns
    if column is None and len(of_numbers) > 1:
        remedy = (
            f"Name one as column = {sheet.columns[0].name!r}: it has {', '.join(sheet.names[:20])}"
        )
        raise InputError(f"{key}.column", None, f"{path} has {len(of_numbers)} columns", remedy)
    chosen = of_numbers[0] if column is None else sheet.column(column, f"{key}.column")
    values = sheet.entries(chosen)
    return values, f"{sheet.found}, {len(values)} values of {chosen.heading}"


def _curve(
    content: Mapping[str, object], row: Mapping[str, object], key: str, folder: Path
) -> tuple[list[list[float]], str]:
    parts = key.split(".")
    general = ".".join((*parts[:2], "*", *parts[3:])) if parts[0] == "mechanism" else key
    if general not in CURVES and general not in BY_TIME:
        raise InputError(
            f"{key}.file", row["file"], "no file is read here",
            f"Files stand in study.random.NAME, {', '.join((*CURVES, *BY_TIME)).replace('*', 'NAME')}",
        )  # fmt: skip
    try:
        curve = validated(FileCurve, row)
    except InputError as error:
        raise InputError(f"{key}.{error.key}", error.value, error.reason, error.remedy) from None
    if general in BY_TIME:
        return against_time(curve, folder, BY_TIME[general], key)
    return pairs_of(curve, folder, CURVES[general], key, _turns(content))


def _turns(content: Mapping[str, object]) -> int:
    """Turns of a revolution, as the drives of a parsed scene say; whatever else stands there."""
    mechanism = content.get("mechanism")
    drives = mechanism.get("drives") if isinstance(mechanism, Mapping) else None
    rows = [content.get("drive"), *(drives.values() if isinstance(drives, Mapping) else ())]
    turns = [row.get("turns", 1) for row in rows if isinstance(row, Mapping)]
    return max((one for one in turns if type(one) is int), default=1)

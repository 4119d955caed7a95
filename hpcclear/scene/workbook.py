"""Cells of an Excel workbook (.xlsx) as text, read with openpyxl; what only Excel can know is refused with its cell."""

import datetime
import io
from pathlib import Path
from typing import Any

from hpcclear.base.errors import InputError
from hpcclear.base.extras import installing

LARGEST = 20_000_000
"""Bytes of a workbook, which is packed."""
MOST_CELLS = 2_000_000


def cells_of(path: Path, data: bytes, what: str, sheet: str | None) -> list[tuple[int, list[str]]]:
    """Numbers and cells of the rows of a sheet that are not empty.

    Raises
    ------
    InputError
        If openpyxl is not installed, several sheets hold something and none is named, or a cell is a date, a formula without a
        stored value, or merged with others.
    """
    try:
        import openpyxl
    except ImportError:
        raise InputError(
            what, str(path), "reading an Excel workbook takes the package openpyxl",
            f"{installing('tables')}, or save it as CSV",
        ) from None  # fmt: skip
    if len(data) > LARGEST:
        raise InputError(what, str(path), f"is larger than {LARGEST} bytes", "Save it as CSV")
    try:
        values, formulas = (
            openpyxl.load_workbook(io.BytesIO(data), data_only=stored) for stored in (True, False)
        )
    except Exception as error:
        reason = f"is no Excel workbook that can be read ({type(error).__name__}: {error})"
        raise InputError(what, str(path), reason[:300], "Save it anew as .xlsx or CSV") from error
    page = values[_chosen(path, what, values, sheet)]
    if page.max_row * page.max_column > MOST_CELLS:
        raise InputError(what, str(path), f"has more than {MOST_CELLS} cells", "Save it as CSV")
    for merged in page.merged_cells.ranges:
        if merged.min_col < merged.max_col and not _is_title(page, merged.min_row):
            raise InputError(
                f"{path}, cells {merged.coord}", page.cell(merged.min_row, merged.min_col).value,
                "the cells are merged, so it is open which column they head",
                "Split them, and give each column a heading of its own",
            )  # fmt: skip
    rows = []
    for row in page.iter_rows():
        cells = [_text(path, one, formulas[page.title][one.coordinate]) for one in row]
        if any(cells):
            rows.append((row[0].row, cells))
    return rows


def _is_title(page: Any, row: int) -> bool:
    """Whether one cell alone is filled in a row, as a title above the table is."""
    return sum(one.value is not None for one in page[row]) == 1


def _chosen(path: Path, what: str, book: Any, sheet: str | None) -> str:
    names = [
        page.title for page in book.worksheets if page.max_row > 1 or page["A1"].value is not None
    ]
    if sheet is not None:
        if sheet not in names:
            raise InputError(
                what,
                str(path),
                f"has no sheet {sheet!r} with cells",
                f"Use one of: {', '.join(names)}",
            )
        return sheet
    if len(names) != 1:
        reason = f"has {len(names)} sheets that hold something" + (
            f": {', '.join(names)}" if names else ""
        )
        raise InputError(
            what,
            str(path),
            reason,
            f'Name one as in "{path.name}#{names[0]}"' if names else "Fill one",
        )
    return str(names[0])


def _text(path: Path, cell: Any, formula: Any) -> str:
    value, where = cell.value, f"{path}, cell {cell.coordinate}"
    if value is None and formula.data_type == "f":
        raise InputError(
            where, str(formula.value)[:80], "is a formula without a stored value",
            "Open and save the file in a spreadsheet program, or write the number",
        )  # fmt: skip
    if isinstance(value, datetime.date | datetime.time | datetime.timedelta):
        raise InputError(
            where, str(value), "is a date: spreadsheet programs make dates of numbers such as 1.3",
            "Format the cell as a number and write it again",
        )  # fmt: skip
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        if "%" in (cell.number_format or ""):
            return f"{100 * value!r} %"
        return repr(value)
    return str(value).strip()[:200]

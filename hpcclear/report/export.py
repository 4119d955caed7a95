"""Tables of results as files of other programs: CSV, Excel, MATLAB, Parquet. Equal results give equal bytes."""

import datetime
import io
import json
import math
import re
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.base.extras import installing
from hpcclear.base.units import factor
from hpcclear.report import spread
from hpcclear.report.tables import Units, identifier, to_table
from hpcclear.results import dataset, files
from hpcclear.results.content import Results

if TYPE_CHECKING:
    from pandas import DataFrame

MOST_ROWS = 2**20 - 1
"""Rows of an Excel sheet below its heading."""
BOOK_MARK = b"<dc:creator>hpcclear</dc:creator>"
"""Mark of our Excel files, at the end; earlier versions wrote it near the beginning."""
LONGEST_CELL = 32_000
"""Letters of a cell of an Excel file."""
_CONTROL = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff\ud800-\udfff]")


def export(path: str | Path, output: str | Path, units: Sequence[str] = ()) -> "DataFrame":
    """Write a result file as a table: a row a design or an instant, in the format that the name of `output` ends in (``.csv``,
    ``.xlsx``, ``.mat`` or ``.parquet``). A file there is replaced if hpcclear wrote it.

    `units`: as of `to_table`. Returns what was written, as `to_table` makes it. Raises InputError if the result cannot be read,
    the format is not known or needs a package that is not installed, or another file is in the way; StorageError if the disk is
    full or fails.
    """
    place = Path(output)
    check_format(place)
    table = to_table(dataset.read(path), units)
    files.write_bytes(place, *FORMATS[place.suffix.lower()](table))
    return table


def read_samples(paths: Sequence[str | Path]) -> dict[str, Results]:
    """Return the samples of several files by their names, without run times. Raises InputError if a file holds no samples."""
    found: dict[str, Results] = {}
    for path in map(Path, paths):
        if path.name.endswith(".timing.nc"):
            continue
        content = dataset.read(path)
        if (kind := content.attrs["hpcclear_kind"]) != "samples":
            reason = f"statistics need samples, and it holds a {kind}"
            remedy = "Make samples with hpcclear sample SCENE.toml -o samples.nc"
            raise InputError("--statistics", str(path), reason, remedy)
        name = path.stem if path.stem not in found else str(path)
        found[name] = content.assign_attrs(path=str(path))
    return found


def statistics(
    every: Mapping[str, Results], output: str | Path, lines: spread.Lines, units: Sequence[str] = ()
) -> "DataFrame":
    """Write the statistics of several samples (of `read_samples`): a row for each, and for each file columns of value and
    interval, as numbers.

    `output`: as of `export`; `lines`: as `hpcclear.report.spread.side_by_side` of these; `units`: as of `to_table`. Raises
    InputError as `export`.
    """
    from pandas import DataFrame

    check_format(Path(output))
    table = DataFrame(_columns(lines, Units(next(iter(every.values())), units)))
    about = [(f"file {name}", one.attrs["path"]) for name, one in every.items()]
    for name, own in lines.items():
        unknown = [(what, line) for what, line in own.items() if not line.estimate.known]
        about += [(f"{what} {name}", line.text) for what, line in unknown]
    scenes = [
        f"# {name}: scene {one.attrs.get('scene_hash', '')}\n{one.attrs.get('scene', '')}"
        for name, one in every.items()
    ]
    table.attrs = {
        "units": {}, "long_names": {}, "title": "Statistics of samples", "about": about,
        "scene": "\n".join(scenes), "scene_hash": "",
    }  # fmt: skip
    files.write_bytes(Path(output), *FORMATS[Path(output).suffix.lower()](table))
    return table


def _columns(lines: spread.Lines, units: Units) -> dict[str, list[object]]:
    """Label and unit, then value and interval of each samples; lines without numbers are left out."""
    stated = [(label, line.estimate) for own in lines.values() for label, line in own.items()]
    rows = {(label, one.unit): units.chosen(one.unit) for label, one in stated if one.known}
    shown = [unit or si for (_, si), unit in rows.items()]
    columns: dict[str, list[object]] = {"statistic": [label for label, _ in rows], "unit": [*shown]}
    for name, own in lines.items():
        for end in spread.StatedValue._fields[:3]:
            cells = columns[f"{name} {end}"] = []
            for (label, si), unit in rows.items():
                found = own.get(label, spread.Line("", "")).estimate
                number = getattr(found, end) if found.unit == si else math.nan
                cells.append(number / float(factor(unit, si)) if unit else number)
    return columns


def check_format(output: Path) -> None:
    """Raise InputError unless a name ends as that of a format."""
    if output.suffix.lower() not in FORMATS:
        reason = "a table is written as csv, xlsx, mat or parquet"
        raise InputError("output", str(output), reason, f"End the name in {' or '.join(FORMATS)}")


Written = tuple[bytes, bytes]
"""Bytes of a file, and a part of them near one of its ends by which it is known as ours."""


_FORMULA = re.compile(r"^(?=\s*[=+\-@＝＋－＠]|[\t\n])|(?<=[;\t\n])(?=[=+\-@＝＋－＠])")
"""Where a spreadsheet would begin to read a formula: at the start of a cell, or where its own separator makes one."""


def as_text(cell: object) -> object:
    """A cell that no spreadsheet reads as a formula: text that begins like one is marked by an apostrophe; numbers stay."""
    if not isinstance(cell, str):
        return cell
    try:
        float(cell)
    except ValueError:
        return _FORMULA.sub("'", cell.replace("\r\n", "\n").replace("\r", "\n"))
    return cell


def _csv(table: "DataFrame") -> Written:
    texts = {h: table[h].map(as_text) for h in table if table[h].dtype.kind not in "biuf"}
    safe = table.assign(**texts).rename(columns=as_text)
    text = safe.to_csv(index=False, lineterminator="\n").encode()
    return text, text[: min(text.find(b"\n"), 1000)]  # its own headings


def _parquet(table: "DataFrame") -> Written:
    try:
        import pyarrow
        import pyarrow.parquet
    except ModuleNotFoundError:
        reason = "parquet files need the package pyarrow, which is not installed"
        remedy = f"{installing('tables')}; csv, xlsx and mat need nothing"
        raise InputError("output", "parquet", reason, remedy) from None
    made = pyarrow.Table.from_pandas(table, preserve_index=False)
    about = {key: json.dumps(value) for key, value in table.attrs.items()}
    buffer = io.BytesIO()
    with pyarrow.parquet.ParquetWriter(buffer, made.schema, store_schema=False) as writer:
        writer.write_table(made)
        writer.add_key_value_metadata({**about, "generator": "written by hpcclear"})
    return buffer.getvalue(), b"written by hpcclear"


def _mat(table: "DataFrame") -> Written:
    """Columns as variables, and structures `units` and `long_names` by the same names."""
    from scipy.io import savemat

    names: dict[str, str] = {}
    for heading in (*table.columns, *(key for key in table.attrs if key in table.attrs["units"])):
        name, k = identifier(str(heading)), 2
        while name in names.values():
            name, k = f"{identifier(str(heading))[:59]}_{k}", k + 1
        names[str(heading)] = name
    content: dict[str, object] = {names[str(h)]: _column(table[h].values) for h in table.columns}
    content |= {names[h]: table.attrs[h] for h in names if h in table.attrs}
    for key in ("units", "long_names"):
        content[key] = {names[h]: text for h, text in table.attrs[key].items() if h in names}
    content |= {f"about_{key}": table.attrs[key] for key in ("title", "scene", "scene_hash")}
    buffer = io.BytesIO()
    savemat(buffer, content, long_field_names=True, oned_as="column")
    head = b"MATLAB 5.0 MAT-file, written by hpcclear"  # in place of one with the time of day
    return head.ljust(116) + buffer.getvalue()[116:], head


def _column(values: np.ndarray) -> np.ndarray:
    """Numbers as they are, text as a column of cells."""
    return values if values.dtype.kind in "fi" else values.astype(object).reshape(-1, 1)


def _xlsx(table: "DataFrame") -> Written:
    """Three sheets: the data; quantities with their units and meanings; what the result is."""
    if len(table) > MOST_ROWS:
        reason = f"an Excel sheet has at most {MOST_ROWS} rows, the result has {len(table)}"
        raise InputError("output", len(table), reason, "Export it as csv or parquet")
    attributes = table.attrs
    units, words = attributes["units"], attributes["long_names"]
    data = zip(*(table[heading].tolist() for heading in table.columns), strict=True)
    single = [(key, attributes[key]) for key in attributes if key in units]
    about = [(key, attributes[key]) for key in ("title", "scene_hash") if attributes[key]]
    sheets = {
        "data": [tuple(table.columns), *data],
        "quantities": [("heading", "unit", "meaning"), *((h, units[h], words[h]) for h in units)],
        "about": [
            ("what", "value"), *single, *about, *attributes.get("about", ()),
            *(("scene", line) for line in attributes["scene"].splitlines()),
        ],
    }  # fmt: skip
    known = {name: rows for name, rows in sheets.items() if name == "data" or len(rows) > 1}
    return _book(known), BOOK_MARK


class _Exact(float):
    """A number that is written with all its digits, where XlsxWriter cuts it at 16."""

    def __format__(self, _: str) -> str:
        return repr(float(self))


def _book(sheets: Mapping[str, Iterable[Sequence[object]]]) -> bytes:
    """An Excel file of sheets by name: numbers, empty where they are not finite, and text that is never a formula."""
    from xlsxwriter import Workbook

    buffer = io.BytesIO()
    with Workbook(buffer, {"constant_memory": True}) as book:
        book.set_properties({"author": "hpcclear", "created": datetime.datetime(2000, 1, 1)})
        for name, rows in sheets.items():
            sheet = book.add_worksheet(name)
            sheet.freeze_panes(1, 0)
            cells = ((at, k, one) for at, row in enumerate(rows) for k, one in enumerate(row))
            for at, column, value in cells:
                if not isinstance(value, int | float):
                    sheet.write_string(at, column, _CONTROL.sub(" ", str(value))[:LONGEST_CELL])
                elif math.isfinite(value):
                    exact = _Exact(value) if isinstance(value, float) else value
                    sheet.write_number(at, column, exact)
    with zipfile.ZipFile(buffer, "a") as archive:
        archive.comment = BOOK_MARK
    return buffer.getvalue()


FORMATS = {".csv": _csv, ".xlsx": _xlsx, ".mat": _mat, ".parquet": _parquet}
"""What makes a file of each ending."""

"""Processor time and peak memory of reading tables: a million rows of text, and workbooks that stand for more than they hold.

`python analysis/measure_tables.py` prints a row for each; each is read in a process of its own.
"""

import io
import resource
import subprocess
import sys
import tempfile
import time
import zipfile
from pathlib import Path

from openpyxl import Workbook

from hpcclear.base.errors import InputError
from hpcclear.scene.sheets import read

ROWS = 1_000_000


def base() -> bytes:
    """A workbook of one number."""
    made = Workbook()
    made.active.append(["time [s]", "force [N]"])
    made.active.append([0.0, 1.0])
    stream = io.BytesIO()
    made.save(stream)
    return stream.getvalue()


def changed(part: str, old: str, new: str) -> bytes:
    """That workbook with one text of a part replaced."""
    stream = io.BytesIO()
    with (
        zipfile.ZipFile(io.BytesIO(base())) as source,
        zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as target,
    ):
        for name in source.namelist():
            text = source.read(name).decode()
            target.writestr(name, text.replace(old, new, 1) if name == part else text)
    return stream.getvalue()


SHEET = "xl/worksheets/sheet1.xml"
END = "</sheetData>"


def _rows() -> str:
    return "".join(
        f"<row><c><v>{k}.5</v></c><c><v>{k}</v></c><c><v>1</v></c></row>" for k in range(ROWS)
    )


def _text() -> bytes:
    return b"time [s],a [N],b [m]\n" + b"".join(b"%d.5,%d.25,%d\n" % (k, k, k) for k in range(ROWS))


WHOLE = 'ref="A1:XFD1048576"'
ADDED = {
    "merged over the sheet": lambda: f"{END}<mergeCells><mergeCell {WHOLE}/></mergeCells>",
    "hyperlink over the sheet": lambda: f"{END}<hyperlinks><hyperlink {WHOLE}/></hyperlinks>",
    "a far cell": lambda: f'<row r="1048576"><c r="XFD1048576"><v>1</v></c></row>{END}',
    "1e7 empty rows": lambda: "<row/>" * 10_000_000 + END,
    "1e6 rows of 3 cells": lambda: _rows() + END,
}
"""What stands in a sheet behind its cells."""


def made(words: str) -> bytes:
    """The file of these words."""
    return changed(SHEET, END, ADDED[words]()) if words in ADDED else _text()


def measure(path: str) -> None:
    """Read one file and print what it cost."""
    before = time.process_time()
    try:
        outcome = f"read, {len(read(Path(path)).lines)} rows"
    except InputError as error:
        outcome = f"refused: {error.reason[:60]}"
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
    sys.stdout.write(f"{time.process_time() - before:.2f} s | {peak} MB | {outcome}")


def main() -> None:
    """Print the table."""
    sys.stdout.write(
        "| file | size | processor time | peak memory | outcome |\n| --- | --- | --- | --- | --- |\n"
    )
    with tempfile.TemporaryDirectory() as folder:
        for words in ("text, 1e6 rows of 3 cells", *ADDED):
            path = Path(folder) / "table"
            path.write_bytes(made(words))
            done = subprocess.run(
                [sys.executable, __file__, str(path)], capture_output=True, text=True, check=True
            )
            sys.stdout.write(f"| {words} | {path.stat().st_size / 1e3:.0f} kB | {done.stdout} |\n")


if __name__ == "__main__":
    measure(sys.argv[1]) if len(sys.argv) > 1 else main()

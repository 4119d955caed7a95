"""Cells of an Excel workbook (.xlsx, .xlsm) as text.

The XML of a sheet is read as a stream. Bytes, rows, columns and cells are counted and refused before anything is kept: other
readers keep a cell for each place of a range, and every text. What only Excel can know is refused with its cell.
"""

import datetime
import io
import posixpath
import re
import zipfile
import zlib
from collections import deque
from collections.abc import Callable, Iterator
from functools import lru_cache
from pathlib import Path, PurePosixPath
from typing import NoReturn
from xml.parsers import expat

from hpcclear.base.errors import InputError
from hpcclear.base.remarks import remark
from hpcclear.scene import clock, delimited
from hpcclear.scene.delimited import LARGEST_FILE, LONGEST_CELL, Rows, Stored

LARGEST = LARGEST_FILE // 4
"""Bytes of a workbook, which is packed."""
UNPACKED = LARGEST_FILE
"""Bytes of what is read of it, unpacked."""
MOST_CELLS = delimited.MOST_CELLS // 2
"""Each takes three times as long as one of text."""
MOST_ROWS, MOST_COLUMNS = 2**20, 2**14
"""Of a sheet, as Excel has them."""
MOST_PARTS, MOST_SHEETS = 10_000, 1000

_UNREADABLE = (
    zipfile.BadZipFile, zlib.error, expat.ExpatError, EOFError, LookupError, NotImplementedError, RuntimeError, ValueError,
    OSError,
)  # fmt: skip
"""What damaged archives and XML raise."""


def cells_of(path: Path, data: bytes, what: str, sheet: str | None) -> Rows:
    """Numbers and cells of the rows of a sheet that are not empty.

    Raises InputError if the file is too large or damaged, several sheets hold something and none is named, or a cell is a
    formula without a stored value, or merged with others.
    """
    if len(data) > LARGEST:
        raise InputError(what, str(path), f"is larger than {LARGEST} bytes", "Save it as CSV")
    try:
        book = _Book(path, data, what)
        page = _Page(book, book.chosen(sheet))
    except _UNREADABLE as error:
        if isinstance(error, InputError):
            raise
        reason = f"is no Excel workbook that can be read ({type(error).__name__}: {error})"
        raise InputError(what, str(path), reason[:300], "Save it anew as .xlsx or CSV") from error
    page.refuse_merged()
    if hidden := page.hidden():
        remark(f"Note: {hidden} of {path} are hidden, and are read like the others")
    return [(row, cells) for row, cells in page.rows.items() if any(cells)]


class _Book:
    """The parts of a workbook: shared `texts`, `left` bytes that may still be unpacked, `epoch` (the day 0), and `formats`,
    what the numbers of each style are: "" for plain ones, "percent", "date", "time", "elapsed", " mm".
    """

    def __init__(self, path: Path, data: bytes, what: str) -> None:
        self.path, self.what, self.left = path, what, UNPACKED
        if data.count(b"PK\x01\x02") > MOST_PARTS:
            self.refuse(f"has more than {MOST_PARTS} parts")
        self.archive = zipfile.ZipFile(io.BytesIO(data))
        books = [target for _, kind, target in self._relations("") if kind == "officeDocument"]
        root = (*books, "xl/workbook.xml")[0]
        relations = self._relations(root)
        ids = {id_: target for id_, _, target in relations}
        sheets, since_1904 = list[tuple[str, str]](), False
        for tag, attributes in self._started(root):
            if tag == "sheet":
                own = (v for k, v in attributes.items() if k.endswith("id") and k != "sheetId")
                sheets.append((attributes.get("name", ""), ids.get(next(own, ""), "")))
            elif tag == "workbookPr":
                since_1904 = attributes.get("date1904") in ("1", "true")
        if len(sheets) > MOST_SHEETS:
            self.refuse(f"has more than {MOST_SHEETS} sheets")
        known = {target for _, kind, target in relations if kind == "worksheet"}
        self.sheets = {name: part for name, part in sheets if part in known}
        self.epoch = datetime.datetime(*(1904, 1, 1) if since_1904 else (1899, 12, 30))
        self.texts, self.formats = list[str](), list[str]()
        others = {kind: target for _, kind, target in reversed(relations)}  # the first of each
        if "sharedStrings" in others:
            self._read_texts(others["sharedStrings"])
        if "styles" in others:
            self._read_formats(others["styles"])

    def refuse(self, reason: str) -> NoReturn:
        raise InputError(self.what, str(self.path), reason, "Save the table alone, as CSV")

    def chunks(self, name: str) -> Iterator[bytes]:
        """Bytes of a part, counted before they are unpacked."""
        info = self.archive.getinfo(name)
        if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise NotImplementedError("compression of another kind")
        if info.file_size > self.left:
            self.refuse(f"has more than {UNPACKED} bytes when unpacked")
        with self.archive.open(info) as stream:
            while data := stream.read(1 << 16):
                self.left -= len(data)
                yield data

    def parse(
        self, name: str, start: Callable[[str, dict[str, str]], object], end: Callable[[str], object] | None = None,
        text: Callable[[str], object] | None = None,
    ) -> Iterator[bytes]:  # fmt: skip
        """Read the XML of a part, a piece of it after the other, each yielded when it was read; tags come as written.
        Declarations of entities, which may expand, are refused."""

        def declared(*_: object) -> None:
            raise ValueError("declares a document type")

        parser = expat.ParserCreate()
        parser.buffer_text = True
        parser.StartElementHandler = start
        parser.EndElementHandler = end
        parser.CharacterDataHandler = text
        parser.StartDoctypeDeclHandler = declared
        for data in self.chunks(name):
            parser.Parse(data)
            yield data
        parser.Parse(b"", True)  # which may read what was kept back
        yield b""

    def _started(self, name: str) -> Iterator[tuple[str, dict[str, str]]]:
        """Tags without prefixes, and attributes, of the elements of a part in the order in which they begin."""
        found = list[tuple[str, dict[str, str]]]()
        for _ in self.parse(name, lambda tag, attributes: found.append((_local(tag), attributes))):
            yield from found
            found.clear()

    def _relations(self, part: str) -> list[tuple[str, str, str]]:
        """Id, last word of the kind and target of the relationships of a part; "" for the workbook itself."""
        place = PurePosixPath(part)
        name = str(place.parent / "_rels" / f"{place.name}.rels") if part else "_rels/.rels"
        found = list[tuple[str, str, str]]()
        for tag, attributes in self._started(name) if name in self.archive.NameToInfo else ():
            if tag == "Relationship":
                target = posixpath.join("/", place.parent, attributes.get("Target", ""))
                whole = posixpath.normpath(target)[1:]
                if whole in self.archive.NameToInfo:
                    kind = attributes.get("Type", "").rpartition("/")[2]
                    found.append((attributes.get("Id", ""), kind, whole))
        return found

    def _read_texts(self, part: str) -> None:
        """Shared texts, of which no more is kept than of a cell."""
        text = _Text()

        def start(tag: str, _: object) -> None:
            if len(self.texts) >= MOST_CELLS:
                self.refuse(f"has more than {MOST_CELLS} texts")
            text.start(_local(tag))

        def end(tag: str) -> None:
            if text.end(_local(tag)) == "si":
                self.texts.append(text.take())

        for _ in self.parse(part, start, end, text.parts.append):
            pass

    def _read_formats(self, part: str) -> None:
        own, within = dict[str, str](), ""
        for tag, attributes in self._started(part):
            if tag == "numFmt":
                code = attributes.get("formatCode", "")
                own[attributes.get("numFmtId", "")] = code[:LONGEST_CELL]
            elif tag in ("cellXfs", "cellStyleXfs"):
                within = tag
            elif tag == "xf" and within == "cellXfs" and len(self.formats) < MOST_CELLS:
                self.formats.append(clock.kind_of_format(attributes.get("numFmtId", "0"), own))

    def chosen(self, sheet: str | None) -> str:
        """The part of the sheet that is named, or of the only one that holds something."""
        if sheet in self.sheets:
            return self.sheets[sheet]
        filled = [name for name, part in self.sheets.items() if self._is_filled(part)]
        place = str(self.path)
        if sheet is not None:
            reason = f"has no sheet {sheet!r} with cells"
            raise InputError(self.what, place, reason, f"Use one of: {', '.join(filled)}"[:1000])
        if len(filled) != 1:
            listed = f": {', '.join(filled)}"[:1000] if filled else ""
            remedy = f'Name one as in "{self.path.name}#{filled[0]}"' if filled else "Fill one"
            reason = f"has {len(filled)} sheets that hold something{listed}"
            raise InputError(self.what, place, reason, remedy)
        return self.sheets[filled[0]]

    def _is_filled(self, part: str) -> bool:
        """Whether some cell of a sheet holds something; no more is read."""
        rows = 0
        for tag, _ in self._started(part):
            if tag in ("v", "t", "f"):
                return True
            rows += tag == "row"
            if rows > MOST_ROWS:
                self.refuse(f"has more than {MOST_ROWS} rows")
        return False


def _local(tag: str) -> str:
    """A tag without the prefix of its namespace."""
    return tag.rpartition(":")[2] if ":" in tag else tag


@lru_cache(2**14)
def place(reference: str) -> tuple[int, int]:
    """Row and column, from 1 on, of a reference such as C5."""
    found = re.fullmatch(r"\$?([A-Z]{1,3})\$?([0-9]{1,7})", reference)
    if found is None:
        raise ValueError(f"{reference[:20]!r} is no cell")
    column = 0
    for letter in found[1]:
        column = 26 * column + ord(letter) - 64
    return int(found[2]), column


def letters(column: int) -> str:
    """Name of a column by its number: C of 3."""
    made = ""
    while column:
        column, rest = divmod(column - 1, 26)
        made = chr(65 + rest) + made
    return made


class _Text:
    """Text of <t> elements, without readings in another script; no more of it than a cell may have.

    `parts`: pieces of the element that is read; the first go where there are very many.
    """

    def __init__(self) -> None:
        self.parts = deque[str](maxlen=64)
        self.made, self.aside = "", False

    def start(self, tag: str) -> None:
        self.parts.clear()
        self.aside |= tag == "rPh"

    def end(self, tag: str) -> str:
        if tag == "t" and not self.aside and len(self.made) <= LONGEST_CELL:
            self.made += "".join(self.parts)[: LONGEST_CELL + 1]
        self.aside &= tag != "rPh"
        return tag

    def take(self) -> str:
        made, self.made = self.made.strip()[:LONGEST_CELL], ""
        return made


class _Page:
    """The cells of the `rows` of a sheet by their number; `merged`: ranges over several columns, and their first rows."""

    def __init__(self, book: _Book, part: str) -> None:
        self.book = book
        self.rows: dict[int, list[str]] = {}
        self.merged = list[tuple[str, int]]()
        self._hidden_rows, self._hidden_columns = list[int](), list[int]()
        self.row = self.column = self.elements = self.kept = 0
        self.kind = self.style = ""
        self.value: str | None = None
        self.formula: str | None = None
        self.text = _Text()
        self.parts = self.text.parts
        for _ in book.parse(part, self._start, self._end, self.parts.append):
            pass

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        if ":" in tag:
            tag = _local(tag)
        if tag == "c":
            name = attributes.get("r", "").rstrip("0123456789")
            self.column = place(f"{name}1")[1] if name else self.column + 1
            self.elements += 1
            if self.column > MOST_COLUMNS or self.elements > 2 * MOST_CELLS:
                self.book.refuse(f"has more than {MOST_CELLS} cells or {MOST_COLUMNS} columns")
            self.kind, self.style = attributes.get("t", "n"), attributes.get("s", "0")
            self.value = self.formula = None
        elif tag == "row":
            last, number = self.row, attributes.get("r")
            self.row, self.column = int(number) if number else last + 1, 0
            if not last < self.row <= MOST_ROWS:
                self.book.refuse(f"has more than {MOST_ROWS} rows, or rows in disorder")
            if attributes.get("hidden") in ("1", "true"):
                self._hidden_rows.append(self.row)
        elif tag == "col" and attributes.get("hidden") in ("1", "true"):
            last = min(int(attributes["max"]), MOST_COLUMNS)
            self._hidden_columns += range(int(attributes["min"]), last + 1)
        elif tag == "mergeCell":
            self._merge(attributes.get("ref", ""))
        else:
            self.text.start(tag)

    def _end(self, tag: str) -> None:
        if ":" in tag:
            tag = _local(tag)
        if tag == "v":
            self.value = "".join(self.parts)
        elif tag == "c":
            if self.value is not None or self.formula is not None:
                self._keep()
        elif tag == "f":
            self.formula = "".join(self.parts)
        elif tag == "is":
            self.value = self.text.take()
        else:
            self.text.end(tag)

    def _keep(self) -> None:
        """Put a cell into its row, if it holds something."""
        text = self._plain()
        if not text:
            return
        row = self.rows.setdefault(self.row, [])
        missing = self.column - len(row)
        self.kept += missing
        if self.kept > MOST_CELLS:
            self.book.refuse(f"has more than {MOST_CELLS} cells")
        if missing <= 0:
            raise ValueError(f"row {self.row} has cells in disorder")
        row += [*[""] * (missing - 1), text]

    def _plain(self) -> str:
        raw, formats = (self.value or "").strip(), self.book.formats
        if self.formula is not None and not raw and (self.value is None or self.kind != "str"):
            raise InputError(
                f"{self.book.path}, cell {letters(self.column)}{self.row}", f"={self.formula}"[:80],
                "is a formula without a stored value",
                "Open and save the file in a spreadsheet program, or write the number",
            )  # fmt: skip
        if self.kind == "s":
            return self.book.texts[abs(int(raw))] if raw else ""
        if self.kind == "b":
            return "true" if raw == "1" else "false"
        if self.kind != "n" or not raw:
            return raw[:LONGEST_CELL]
        style = formats[abs(int(self.style))] if formats else ""
        if not style or style[0] == " ":  # a unit
            return Stored((raw if len(raw) < 16 else repr(float(raw))) + style)
        number = float(raw)
        if style == "percent":
            return Stored(f"{100 * number!r} %")
        return clock.moment_of(number, style, self.book.epoch)

    def _merge(self, reference: str) -> None:
        first, _, last = reference.partition(":")
        (row, begin), (_, end) = place(first), place(last or first)
        if begin < end:
            if len(self.merged) >= MOST_CELLS // 10:
                self.book.refuse("has too many merged cells")
            self.merged.append((reference, row))

    def hidden(self) -> str:
        """Rows and columns with cells that are not shown, in words; "" for none."""
        width = max(map(len, self.rows.values()), default=0)
        rows = [str(row) for row in self._hidden_rows if row in self.rows]
        columns = [letters(one) for one in self._hidden_columns if one <= width]
        found = []
        for kind, names in (("rows", rows), ("columns", columns)):
            more = ", ..." if len(names) > 8 else ""
            found += [f"{kind} {', '.join(names[:8])}{more}"] if names else []
        return " and ".join(found)

    def refuse_merged(self) -> None:
        """InputError where a row with several filled cells has merged ones; a title may be merged."""
        for reference, row in self.merged:
            cells = self.rows.get(row, [])
            if sum(map(bool, cells)) > 1:
                raise InputError(
                    f"{self.book.path}, cells {reference}", next(filter(None, cells)),
                    "the cells are merged, so it is open which column they head",
                    "Split them, and give each column a heading of its own",
                )  # fmt: skip

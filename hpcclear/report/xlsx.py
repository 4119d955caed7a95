"""Excel files (Office Open XML, ECMA-376) of plain tables: numbers with all their digits, text never as formulas.

Written here because a table takes three kinds of elements, equal content has to give equal bytes, and the usual packages cut
numbers at 16 digits.
"""

import io
import math
import re
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from typing import Any
from xml.sax.saxutils import escape, quoteattr

MARK = b"<dc:creator>hpcclear</dc:creator>"
"""Mark of our files, near their beginning."""

LONGEST = 32_000  # letters of a cell

_HEAD = '<?xml version="1.0" encoding="UTF-8" standalone="yes"?>\n'
_MAIN = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
_OFFICE = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
_PACKAGE = "http://schemas.openxmlformats.org/package/2006"
_SHEETS = "application/vnd.openxmlformats-officedocument.spreadsheetml"

_CORE = (
    f'{_HEAD}<cp:coreProperties xmlns:cp="{_PACKAGE}/metadata/core-properties" '
    f'xmlns:dc="http://purl.org/dc/elements/1.1/">{MARK.decode()}</cp:coreProperties>'
)
_PANE = (
    '<sheetViews><sheetView workbookViewId="0"><pane ySplit="1" topLeftCell="A2" activePane="bottomLeft" '
    'state="frozen"/></sheetView></sheetViews><sheetFormatPr defaultRowHeight="15"/>'
)
_CONTROL = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff\ud800-\udfff]")


def book(sheets: Mapping[str, Iterable[Sequence[Any]]]) -> bytes:
    """Return an Excel file with these sheets, by name: rows of numbers and text, the first row as headings.

    Numbers that are not finite are empty cells, for Excel has none.
    """
    names = list(sheets)
    numbered = list(enumerate(names, 1))
    types = "".join(
        f'<Override PartName="/{part}" ContentType="{kind}+xml"/>'
        for part, kind in (
            ("xl/workbook.xml", f"{_SHEETS}.sheet.main"),
            ("docProps/core.xml", "application/vnd.openxmlformats-package.core-properties"),
            *((f"xl/worksheets/sheet{k}.xml", f"{_SHEETS}.worksheet") for k, _ in numbered),
        )
    )
    usual = (
        '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
        '<Default Extension="xml" ContentType="application/xml"/>'
    )
    listed = "".join(
        f'<sheet name={quoteattr(name)} sheetId="{k}" r:id="r{k}"/>' for k, name in numbered
    )
    core = f"{_PACKAGE}/relationships/metadata/core-properties"
    parts = {
        "docProps/core.xml": _CORE,
        "[Content_Types].xml": f'{_HEAD}<Types xmlns="{_PACKAGE}/content-types">{usual}{types}</Types>',
        "_rels/.rels": _links({"xl/workbook.xml": f"{_OFFICE}/officeDocument", "docProps/core.xml": core}),
        "xl/workbook.xml": f'{_HEAD}<workbook xmlns="{_MAIN}" xmlns:r="{_OFFICE}"><sheets>{listed}</sheets></workbook>',
        "xl/_rels/workbook.xml.rels": _links(
            {f"worksheets/sheet{k}.xml": f"{_OFFICE}/worksheet" for k, _ in numbered}
        ),
    }  # fmt: skip
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, text in parts.items():
            _add(archive, name, text, stored=name == "docProps/core.xml")
        for k, name in numbered:
            _add(archive, f"xl/worksheets/sheet{k}.xml", _sheet(sheets[name]))
    return buffer.getvalue()


def _links(targets: Mapping[str, str]) -> str:
    """A part that says which others belong together."""
    rows = "".join(
        f'<Relationship Id="r{k}" Type="{kind}" Target="{target}"/>'
        for k, (target, kind) in enumerate(targets.items(), 1)
    )
    return f'{_HEAD}<Relationships xmlns="{_PACKAGE}/relationships">{rows}</Relationships>'


def _add(archive: zipfile.ZipFile, name: str, text: str, stored: bool = False) -> None:
    about = zipfile.ZipInfo(name)  # of 1980, whatever the time is
    about.compress_type = zipfile.ZIP_STORED if stored else zipfile.ZIP_DEFLATED
    archive.writestr(about, text.encode())


def _sheet(rows: Iterable[Sequence[object]]) -> str:
    lines = "".join(f"<row>{''.join(map(_cell, row))}</row>" for row in rows)
    return f'{_HEAD}<worksheet xmlns="{_MAIN}">{_PANE}<sheetData>{lines}</sheetData></worksheet>'


def _cell(value: object) -> str:
    if isinstance(value, int | float):
        return f"<c><v>{value!r}</v></c>" if math.isfinite(value) else "<c/>"
    text = escape(_CONTROL.sub(" ", str(value))[:LONGEST])
    return f'<c t="inlineStr"><is><t xml:space="preserve">{text}</t></is></c>' if text else "<c/>"

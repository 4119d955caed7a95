"""Workbooks cost what they hold: small files that stand for large ones are read or refused within bounded memory."""

import io
import tracemalloc
import zipfile

import pytest

from hpcclear.base.errors import InputError
from hpcclear.base.units import factor
from hpcclear.scene import workbook
from hpcclear.scene.sheets import read

MAIN = 'xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"'
OFFICE = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
PACKAGE = 'xmlns="http://schemas.openxmlformats.org/package/2006/relationships"'
CELLS = (
    '<row r="1"><c r="A1" t="inlineStr"><is><t>time [s]</t></is></c><c r="B1" t="inlineStr"><is><t>a</t></is></c></row>'
    '<row r="2"><c r="A2"><v>0</v></c><c r="B2"><v>0.3</v></c></row>'
)


def book(cells=CELLS, after="", texts=None, sheets=1, styles="", prefix=""):
    """A workbook of these rows, with elements after them; `prefix` before each tag of the sheet."""
    made = io.BytesIO()
    parts = {
        "_rels/.rels": f'<Relationships {PACKAGE}>'
        f'<Relationship Id="r" Type="{OFFICE}/officeDocument" Target="xl/workbook.xml"/></Relationships>',
        "xl/workbook.xml": f'<workbook {MAIN} xmlns:r="{OFFICE}"><sheets>'
        + "".join(f'<sheet name="s{k}" sheetId="{k}" r:id="r{k}"/>' for k in range(sheets)) + "</sheets></workbook>",
        "xl/_rels/workbook.xml.rels": f"<Relationships {PACKAGE}>"
        + "".join(f'<Relationship Id="r{k}" Type="{OFFICE}/worksheet" Target="s{k}.xml"/>' for k in range(sheets))
        + f'<Relationship Id="t" Type="{OFFICE}/sharedStrings" Target="/xl/t.xml"/>'
        f'<Relationship Id="f" Type="{OFFICE}/styles" Target="f.xml"/></Relationships>',
        "xl/f.xml": f"<styleSheet {MAIN}>{styles}</styleSheet>",
    }  # fmt: skip
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in parts.items():
            archive.writestr(name, text)
        for k in range(sheets):
            text = f"<worksheet {MAIN}><sheetData>{cells}</sheetData>{after}</worksheet>"
            if prefix:
                text = (
                    text.replace("</", f"</{prefix}:")
                    .replace("<", f"<{prefix}:")
                    .replace(f"<{prefix}:/", "</")
                )
                text = text.replace("xmlns=", f"xmlns:{prefix}=")
            archive.writestr(f"xl/s{k}.xml", text)
        if texts is not None:
            archive.writestr("xl/t.xml", f"<sst {MAIN}>{texts}</sst>")
    return made.getvalue()


def merged(reference):
    return f'<mergeCells count="1"><mergeCell ref="{reference}"/></mergeCells>'


FAR = CELLS + '<row r="90000"><c r="XFD90000"><v>1</v></c></row>'
HOSTILE = {
    "merged over the sheet": (lambda: book(after=merged("A1:XFD1048576")), "merged"),
    "merged down the sheet": (lambda: book(after=merged("A1:A1048576")), None),
    "hyperlink": (
        lambda: book(
            after='<hyperlinks><hyperlink ref="A1:XFD1048576" location="x"/></hyperlinks>'
        ),
        None,
    ),
    "far cell": (lambda: book(FAR), "instead of 2"),
    "far cells": (
        lambda: book(
            "".join(f'<row r="{k}"><c r="XFD{k}"><v>1</v></c></row>' for k in range(1, 200))
        ),
        "has more than",
    ),
    "column too far": (lambda: book('<row><c r="ZZZ1"><v>1</v></c></row>'), "columns"),
    "row too far": (lambda: book('<row r="2000000"><c><v>1</v></c></row>'), "rows"),
    "rows in disorder": (
        lambda: book('<row r="3"><c><v>1</v></c></row><row r="2"><c><v>1</v></c></row>'),
        "disorder",
    ),
    "cells in disorder": (
        lambda: book('<row><c r="B1"><v>1</v></c><c r="A1"><v>1</v></c></row>'),
        "disorder",
    ),
    "empty rows": (lambda: book("<row/>" * 110_000), "rows"),
    "empty cells": (lambda: book("<row>" + "<c/>" * 20_000 + "<c><v>1</v></c></row>"), "columns"),
    "cells of one row": (lambda: book("<row>" + "<c><v>1</v></c>" * 20_000 + "</row>"), "columns"),
    "shared text": (
        lambda: book(
            '<row><c t="s"><v>0</v></c></row>', texts=f"<si><t>{'a' * 40_000_000}</t></si>"
        ),
        "unpacked",
    ),
    "long shared text": (
        lambda: book(CELLS.replace("0.3", "1"), texts=f"<si><t>{'a' * 20_000_000}</t></si>"),
        None,
    ),
    "no shared text": (
        lambda: book('<row><c t="s"><v>7</v></c></row>', texts=""),
        "no Excel workbook",
    ),
    "long cell": (
        lambda: book(f'<row><c t="str"><v>{"a" * 20_000_000}</v></c></row>'),
        "contains no points",
    ),
    "many sheets": (lambda: book(sheets=2000), "sheets"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_small_file_costs_little(name, tmp_path, monkeypatch):
    monkeypatch.setattr(workbook, "MOST_CELLS", 200_000)
    monkeypatch.setattr(workbook, "MOST_ROWS", 100_000)
    monkeypatch.setattr(workbook, "UNPACKED", 30_000_000)
    make, refused = HOSTILE[name]
    data = make()
    assert len(data) < 1_000_000
    (tmp_path / "b.xlsx").write_bytes(data)
    tracemalloc.start()
    try:
        if refused is None:
            assert read(tmp_path / "b.xlsx").columns[0].name == "time"
        else:
            with pytest.raises(InputError, match=refused):
                read(tmp_path / "b.xlsx")
        assert tracemalloc.get_traced_memory()[1] < 30e6
    finally:
        tracemalloc.stop()


def test_declared_entities_are_refused(tmp_path):
    made = io.BytesIO(book())
    with zipfile.ZipFile(made) as old, zipfile.ZipFile(tmp_path / "b.xlsx", "w") as new:
        for name in old.namelist():
            text = old.read(name).decode()
            new.writestr(
                name, f'<!DOCTYPE a [<!ENTITY b "c">]>{text}' if name == "xl/s0.xml" else text
            )
    with pytest.raises(InputError, match="declares a document type"):
        read(tmp_path / "b.xlsx")


STYLES = (
    '<numFmts><numFmt numFmtId="164" formatCode="yyyy\\-mm\\-dd hh:mm:ss.000"/><numFmt numFmtId="165" formatCode="[h]:mm:ss"/>'
    '<numFmt numFmtId="166" formatCode="0.0&quot; hours&quot;"/></numFmts><cellXfs>'
    + "".join(f'<xf numFmtId="{k}"/>' for k in (0, 10, 14, 21, 164, 165, 166)) + "</cellXfs>"
)  # fmt: skip


@pytest.mark.parametrize("prefix", ["", "x"])
def test_cells_are_text_numbers_and_dates(prefix, tmp_path):
    rows = [("a", "inlineStr", "0"), ("0.1", "n", "1"), ("46082", "n", "2"), ("0.5021412037037037", "n", "3"),
            ("46082.502141205", "n", "4"), ("1.25", "n", "5"), ("1.25", "n", "6"), ("1", "b", "0"), ("#DIV/0!", "e", "0"),
            ("0.30000000000000004", "n", "0"), ("0", "s", "0")]  # fmt: skip
    cells = "".join(
        f'<c t="{kind}" s="{style}"><is><t>{text}</t><rPh><t>reading</t></rPh></is></c>' if kind == "inlineStr" else
        f'<c t="{kind}" s="{style}"><v>{text}</v></c>' for text, kind, style in rows
    )  # fmt: skip
    texts = "<si><r><t>two </t></r><r><t>runs</t></r></si>"
    data = book(f"<row>{cells}</row>", texts=texts, styles=STYLES, prefix=prefix)
    (number, found), *_ = workbook.cells_of(tmp_path / "b.xlsx", data, "table", None)
    assert number == 1
    assert found == [
        "a", "10.0 %", "2026-03-01", "12:03:05", "2026-03-01 12:03:05.000112", "30:00:00", "1.25 hours", "true", "#DIV/0!",
        "0.30000000000000004", "two runs",
    ]  # fmt: skip


def test_what_is_written_by_another_program_is_read(tmp_path):
    from openpyxl import Workbook

    made = Workbook()
    for row in ([None, "x [mm]"], [], [1.5, 2, "text"], [True, -1e-7, "=1+1"]):
        made.active.append(row)
    made.active["C4"] = 7
    made.create_sheet("empty")
    stream = io.BytesIO()
    made.save(stream)
    rows = workbook.cells_of(tmp_path / "b.xlsx", stream.getvalue(), "table", None)
    assert rows == [(1, ["", "x [mm]"]), (3, ["1.5", "2", "text"]), (4, ["true", "-1e-07", "7"])]


FORMATS = {
    '0.00" mm"': "mm", '0.000\\ "µm"': "µm", "0.0\\m\\m": "mm", '#,##0.00_ "cm";[Red]-0.00" cm"': "cm", '0.00 "in"': "in",
    "0.00": "", '0.00" pieces"': "", '"about "0.00': "", "#,##0.00": "", "0.00E+00": "",
}  # fmt: skip


@pytest.mark.parametrize("heading", ["C", "C [mm]"])
def test_a_number_shown_with_a_unit_has_this_unit(heading, tmp_path):
    """A cell that shows "0.30 mm" holds 0.3: it was 0.3 m. Beside the same unit in the heading it says nothing more."""
    from openpyxl import Workbook

    for code, unit in FORMATS.items():
        made = Workbook()
        for row in ([heading], [1.125], [2.5]):
            made.active.append(row)
        for row in (2, 3):
            made.active.cell(row, 1).number_format = code
        made.save(tmp_path / "b.xlsx")
        sheet = read(tmp_path / "b.xlsx")
        (column,) = sheet.columns
        if column.unit and unit not in ("", column.unit):
            with pytest.raises(InputError, match="line 2, column C"):
                sheet.si(column, "m", "key")
        else:
            size = float(factor(unit or column.unit or "m", "m"))
            assert sheet.si(column, "m", "key") == pytest.approx([1.125 * size, 2.5 * size]), code


@pytest.mark.parametrize(
    ("texts", "expected"),
    [
        (["5.000", "6.000"], None), (["5,000", "6,000"], None), (["5.000,5", "6,5"], [5000.5, 6.5]),
        (["0,25", "1,125"], [0.25, 1.125]),
        (["0.25", "1.125"], [0.25, 1.125]), (["0.25", "1,5"], None),
    ],
)  # fmt: skip
def test_numbers_of_a_workbook_say_nothing_of_the_signs_in_its_texts(texts, expected, tmp_path):
    """Numbers have a point in the file, whatever the country; what was typed as text may have either sign."""
    from openpyxl import Workbook

    made = Workbook()
    for row in (["a", "b"], [1.125, texts[0]], [0.5, texts[1]]):
        made.active.append(row)
    made.save(tmp_path / "b.xlsx")

    def values():
        sheet = read(tmp_path / "b.xlsx")
        return [sheet.si(one, "", "key") for one in sheet.columns]

    if expected is None:
        with pytest.raises(InputError, match=r"thousands|decimal points"):
            values()
    else:
        first, second = values()
        assert list(first) == [1.125, 0.5]
        assert list(second) == expected


def test_hidden_rows_and_columns_are_read_and_named(tmp_path, capsys):
    hidden = CELLS.replace('<row r="2">', '<row r="2" hidden="1">')
    columns = '<cols><col min="2" max="16384" hidden="1"/></cols>'
    place = tmp_path / "hidden.xlsx"
    place.write_bytes(book(hidden, columns))
    assert read(place, "file").columns[1].name == "a"
    note = f"Note: rows 2 and columns B of {place} are hidden, and are read like the others"
    assert note in capsys.readouterr().err

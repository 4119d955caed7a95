"""Files as people have them, made by a program: what each has to give, or why it is refused."""

import io
import math
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.scene import load_scene
from hpcclear.scene.points import read_points

JOBS = Path(__file__).parents[1] / "jobs"
DESIGNS = [["210", "0.3", "5000"], ["180", "0.25", "4000"]]
IN_SI = np.array([[0.21, 3e-4, 5000 * math.pi / 30], [0.18, 2.5e-4, 4000 * math.pi / 30]])
HEAD = ["m2 [g]", "C [mm]", "drive.speed [rpm]"]
BORE, AMBIENT = 0.042, 1e5


class Kind(NamedTuple):
    """A file, and what it has to give: numbers in SI, or words of the message that refuses it."""

    words: str
    name: str
    data: bytes
    role: str
    expected: object


def text(rows, separator=",", comma=False, end="\n", encoding="utf-8"):
    """Rows of cells as bytes of a file."""
    lines = [
        separator.join(
            cell.replace(".", ",") if comma and cell[:1].isdigit() else cell for cell in row
        )
        for row in rows
    ]
    return (end.join(lines) + end).encode(encoding)


def book(rows, change=None, more=()):
    """An Excel workbook with these rows of values; `change` gets its sheet,
    `more` are names of further sheets with a value."""
    import openpyxl

    made = openpyxl.Workbook()
    for row in rows:
        made.active.append(row)
    if change is not None:
        change(made.active)
    for name in more:
        made.create_sheet(name)["A1"] = 1
    stream = io.BytesIO()
    made.save(stream)
    return stream.getvalue()


NUMBERS = [[210, 0.3, 5000], [180, 0.25, 4000]]


def indicated(angle):
    """A pressure in bar of a four-stroke engine against the crank angle in degrees, 0 at the end of compression."""
    phase = (np.asarray(angle) + 360.0) % 720.0 - 360.0
    return (
        1.0 + 40.0 * np.exp(-(((phase - 12.0) / 35.0) ** 2)) + 0.1 * np.cos(np.radians(phase / 2))
    )


def compressed(angle):
    """A pressure in bar over one turn."""
    return 4.5 + 3.5 * np.cos(np.radians(np.asarray(angle) - 20.0))


def curve(angles, law, head=("angle [deg]", "pressure [bar]"), **options):
    rows = [[f"{a:.10g}", f"{p:.10f}"] for a, p in zip(angles, law(angles), strict=True)]
    return text([list(head), *rows], **options)


def _merged(sheet):
    sheet.insert_rows(1)
    sheet["A1"], sheet["B1"] = "rod", "joints and drive"
    sheet.merge_cells("B1:C1")


def _title(sheet):
    sheet.insert_rows(1, 2)
    sheet["A1"] = "Measured by hand"
    sheet.merge_cells("A1:C1")


def _formula(sheet):
    sheet["B3"] = "=0.5/2"


def _computed(data: bytes) -> bytes:
    """The workbook as a spreadsheet program saves it: with the value of its formula."""
    made = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as old, zipfile.ZipFile(made, "w") as new:
        for name in old.namelist():
            part = (
                old.read(name).replace(b"<v></v>", b"<v>0.25</v>").replace(b"<v/>", b"<v>0.25</v>")
            )
            new.writestr(name, part.replace(b"<v />", b"<v>0.25</v>"))
    return made.getvalue()


def _gaps(sheet):
    sheet.insert_rows(3, 2)
    sheet.insert_cols(1)
    sheet["H9"] = " "


def _dates(sheet):
    import datetime

    sheet["B3"] = datetime.date(2026, 3, 1)


def _share(sheet):
    sheet["D1"] = "effects.guide_friction.coefficient"
    for cell, value in (("D2", 0.05), ("D3", 0.07)):
        sheet[cell] = value
        sheet[cell].number_format = "0.0%"


def kinds() -> list[Kind]:
    """All of them; workbooks where openpyxl is there."""
    one, two = np.arange(0.0, 360.0, 5.0), np.arange(-360.0, 360.0)
    found = [
        # designs
        ("plain CSV", "a.csv", text([HEAD, *DESIGNS]), IN_SI),
        ("semicolons and decimal commas, byte order mark", "b.csv", text([HEAD, *DESIGNS], ";", True, encoding="utf-8-sig"),
        IN_SI),
        ("Windows-1252 with a micro sign", "c.csv", text([["m2 [g]", "C [µm]", HEAD[2]], ["210", "300", "5000"], ["180",
        "250", "4000"]],
                                                         encoding="cp1252"), IN_SI),
        ("UTF-16, tabs, from Excel's Unicode text", "d.txt", text([HEAD, *DESIGNS], "\t", end="\r\n", encoding="utf-16"),
        IN_SI),
        ("UTF-16 without a byte order mark", "e.txt", text([HEAD, *DESIGNS], "\t", encoding="utf-16-le"), IN_SI),
        ("line ends of old Macs", "f.csv", text([HEAD, *DESIGNS], end="\r"), IN_SI),
        ("tabs and decimal commas", "g.txt", text([HEAD, *DESIGNS], "\t", True), IN_SI),
        ("quoted cells with decimal commas between commas", "h.csv",
         b'"m2 [g]","C [mm]","drive.speed [rpm]"\n"210","0,3","5000"\n"180","0,25","4000"\n', IN_SI),
        ("a column of names", "i.csv", text([["design", *HEAD], ["A-17", *DESIGNS[0]], ["B-02", *DESIGNS[1]]]), IN_SI),
        ("row numbers", "j.csv", text([["No.", *HEAD], ["1", *DESIGNS[0]], ["2", *DESIGNS[1]]], ";"), IN_SI),
        ("units in a second row", "k.csv", text([["m2", "C", "drive.speed"], ["g", "mm", "1/min"], *DESIGNS], ";", True),
        IN_SI),
        ("units in headings and in a second row", "k2.csv", text([HEAD, ["g", "mm", "rpm"], *DESIGNS], ";"), IN_SI),
        ("units in a second row, in brackets, beside names", "l.csv",
         text([["part", "m2", "C", "drive.speed"], ["-", "[g]", "[mm]", "[rpm]"], ["A", *DESIGNS[0]], ["B", *DESIGNS[1]]]),
         IN_SI),
        ("units behind a slash", "m.csv", text([["m2 / g", "C/mm", "drive.speed/min⁻¹"], *DESIGNS], ";"), IN_SI),
        ("units in round brackets", "n.csv", text([["m2 (g)", "C (mm)", "drive.speed (rpm)"], *DESIGNS]), IN_SI),
        ("units in the cells", "o.csv", text([["m2", "C", "drive.speed"], ["210 g", "0.3 mm", "5000 rpm"], ["180 g",
        "250 µm", "4000 1/min"]]),
         IN_SI),
        ("a title, empty rows, comments, separators at line ends", "p.csv",
         b"Series 7;;;;\n;;;;\nm2 [g];C [mm];drive.speed [rpm];;\n210;0,3;5000;;\n;;;;\n# repeated\n180;0,25;4000;;\n\n",
         IN_SI),
        ("Excel's line that names the separator", "q.csv", b"sep=;\n" + text([HEAD, *DESIGNS], ";", True), IN_SI),
        ("columns set with spaces", "r.txt",
        b"m2 [g]   C [mm]   drive.speed [rpm]\n210      0.3      5000\n180      0.25     4000\n", IN_SI),
        ("NumPy's heading behind a #", "s.csv",
        b"# m2 [g],C [mm],drive.speed [rpm]\n2.10e+02,3.0e-01,5.0e+03\n1.80e+02,2.5e-01,4.0e+03\n",
         IN_SI),
        ("minus signs of word processors, D of Fortran", "t.csv",
         "m2 [g],C [mm],drive.speed [rpm]\n2.1D+02,3.0D\u221201,5000\n180,0.25,4.0D3\n".encode(), IN_SI),
        ("thousands with apostrophes", "u.csv", text([HEAD, ["210", "0.3", "5'000.0"], ["180", "0.25", "4'000.0"]], ";"),
        IN_SI),
        ("decimal commas between commas", "v.csv", text([HEAD, *DESIGNS], ",", True).replace(b"210", b"210,0"),
        "save it with semicolons"),
        ("decimal points and commas", "w.csv", text([HEAD, ["210", "0.3", "5000"], ["180", "0,25", "4000"]], ";"),
        "decimal points ('0.3'"),
        ("thousands that may be decimals", "x.csv", text([HEAD, ["210", "0.3", '"5,000"'], ["180", "0.25", '"4,000"']]),
        "may be 5.000 or 5000"),
        ("thousands with points", "x2.csv", text([HEAD, ["210", "300", "5.000"], ["180", "250", "4.000"]], ";"),
        "which may be a decimal"),
        ("a table on its side", "x3.csv", text([["m2 [g]", "210", "180"], ["C [mm]", "0.3", "0.25"], ["drive.speed [rpm]",
        "5000", "4000"]]),
         "headings stand in the first column"),
        ("a block of remarks above", "x4.csv", text([["Operator", "Smith"], ["Rig", "B"], HEAD, *DESIGNS], ";", True), IN_SI),
        ("headings over two lines", "x5.csv", b'"m2\n[g]","C\n[mm]","drive.speed\n[rpm]"\n210,0.3,5000\n180,0.25,4000\n',
        IN_SI),
        ("an OpenDocument spreadsheet", "x6.ods",
        b"PK\x03\x04" + bytes(26) + b"mimetypeapplication/vnd.oasis.opendocument.spreadsheet",
         "OpenDocument"),
        ("no headings", "y.csv", text(DESIGNS), "no heading stands above"),
        ("an empty cell", "z.csv", text([HEAD, ["210", "", "5000"]], ";"), "the cell is empty"),
        ("an error of the spreadsheet", "A.csv", text([HEAD, ["210", "#DIV/0!", "5000"]], ";"),
        "an error of the spreadsheet"),
        ("an old Excel file", "B.xls", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600), "old Excel file"),
        ("a page of HTML that is called .xls", "C.xls", b"<html><table><tr><td>m2</td></tr></table></html>",
        "page of markup"),
        ("a heading that is none of the scene", "D.csv", text([["m2 [g]", "clearence [mm]"], ["210", "0.3"]]),
        "neither a variable"),
        ("two units of a column", "F.csv", text([["m2 [g]", "C [mm]"], ["kg", "mm"], ["0.21", "0.3"]]), "the unit below"),
        ("words for an entry of the scene", "E.csv", text([["effects.friction.law", "m2 [g]"], ["coulomb", "210"]]),
         "neither a variable"),
    ]  # fmt: skip
    designs = [
        Kind(words, name, data, "designs", expected) for words, name, data, expected in found
    ]
    curves = [
        ("one turn", "a", curve(one, compressed), compressed),
        ("one turn, its end repeated", "b", curve(np.append(one, 360.0), compressed), compressed),
        ("one turn from -180", "c", curve(one - 180.0, compressed), compressed),
        ("one turn from 180 over 359 to 179", "d", curve(np.roll(one, 36), compressed), compressed),
        ("in falling order", "e", curve(one[::-1], compressed), compressed),
        ("semicolons, decimal commas, German headings", "f",
         curve(one, compressed, ("Kurbelwinkel [°KW]", "Zylinderdruck [bar]"), separator=";", comma=True, encoding="cp1252"),
         compressed),
        ("no headings", "g", curve(one, compressed).split(b"\n", 1)[1], compressed),
        ("two turns in a scene of one", "h", curve(two, indicated), "has two turns"),
        ("half a turn", "i", curve(one[:37], compressed), "leaves out 180 to 360 deg"),
        ("half a turn in three rows", "i3", curve(one[:37:18], compressed), "leaves out 180 to 360 deg"),
        ("pressures below 0", "u", curve(one, lambda a: -compressed(a)), "no absolute pressure is below 0"),
        ("ends that do not meet", "j", curve(np.append(one, 360.0), lambda a: np.asarray(a) / 90.0), "at the same angle"),
        ("four turns", "k", curve(np.arange(0.0, 1440.0), indicated), "more than two turns"),
        ("angles twice", "l", curve(np.repeat(one, 2), compressed), "do not rise"),
        ("gauge pressures", "o", curve(one, lambda a: compressed(a) - 1.0, ("angle [deg]", "p [barg]")), compressed),
        ("absolute pressures by name", "p", curve(one, compressed, ("angle [deg]", "p [bar abs]")), compressed),
        ("in radians and kPa", "q",
         text([["phi [rad]", "p [kPa]"], *([f"{math.radians(a):.15g}", f"{100 * compressed(a):.10f}"] for a in one)]),
         compressed),
        ("no unit", "m", curve(one, compressed, ("angle", "pressure")), "nothing says the unit"),
        ("two columns of pressures", "n",
         text([["angle [deg]", "p1 [bar]", "p2 [bar]"], *([f"{a:g}", "1", "2"] for a in one)]), "p1 [bar], p2 [bar]"),
    ]  # fmt: skip
    found = [
        Kind(words, f"curve_{name}.csv", data, "curve", expected)
        for words, name, data, expected in curves
    ]
    return [*designs, *found, *_workbooks()]


def _workbooks() -> list[Kind]:
    rows = [HEAD, *NUMBERS]
    books = [
        ("Excel workbook", book(rows), IN_SI),
        ("Excel workbook with a title over merged cells", book(rows, _title), IN_SI),
        (
            "Excel workbook with percentages",
            book(rows, _share),
            np.column_stack([IN_SI, [0.05, 0.07]]),
        ),
        (
            "Excel workbook of texts with decimal commas",
            book([HEAD, ["210", "0,3", "5000"], ["180", "0,25", "4000"]]),
            IN_SI,
        ),
        ("Excel workbook with merged headings", book(rows, _merged), "cells B1:C1"),
        (
            "Excel workbook with a formula that no program has computed",
            book(rows, _formula),
            "cell B3",
        ),
        (
            "Excel workbook with a formula and its stored value",
            _computed(book(rows, _formula)),
            IN_SI,
        ),
        ("Excel workbook with empty rows and columns", book(rows, _gaps), IN_SI),
        ("Excel workbook in which a number became a date", book(rows, _dates), "is a date"),
        ("Excel workbook with two sheets", book(rows, more=("Notes",)), "2 sheets"),
        ("Excel workbook, damaged", book(rows)[:900], "no Excel workbook that can be read"),
    ]
    return [
        Kind(words, f"book_{k}.xlsx", data, "designs", expected)
        for k, (words, data, expected) in enumerate(books)
    ]


def scene():
    """A slider-crank whose numbers the designs change."""
    return load_scene(JOBS / "slider_crank.toml", ["effects.guide_friction={coefficient=0.1}"])


def read_kind(kind: Kind, folder: Path):
    """Numbers that a file gives: designs (n, d), or force against angle (n, 2); raises InputError."""
    path = folder / kind.name
    path.write_bytes(kind.data)
    if kind.role == "designs":
        return read_points(path, scene()).values
    row = {"file": str(path), "bore": BORE, "ambient": 0.0 if b"barg" in kind.data else AMBIENT}
    if not any(word in kind.data for word in (b"angle", b"winkel", b"phi")):
        row |= {"angle": "deg", "pressure": "bar"}
    content = scene().resolved()
    content["effects"]["slider_load"] = row
    return np.array(load_scene(content).effects.slider_load)


def expected_of(kind: Kind, found) -> np.ndarray:
    """What a file has to give, by the law that it was made of."""
    if not isinstance(kind.expected, Callable):
        return kind.expected
    pressures = 1e5 * kind.expected(np.degrees(found[:, 0]))
    return np.column_stack([found[:, 0], -math.pi / 4 * BORE**2 * (pressures - AMBIENT)])


def outcome(kind: Kind, folder: Path) -> tuple[bool, str]:
    """Whether a file is read rightly, or refused with the cause; and what happened in words."""
    try:
        found = read_kind(kind, folder)
    except InputError as error:
        words = f"{error.reason}. {error.remedy}"
        shown = f"refused: {words}".replace(str(folder), "").replace("|", "/")
        return isinstance(kind.expected, str) and kind.expected in str(error), shown
    right = not isinstance(kind.expected, str) and np.allclose(
        found, expected_of(kind, found), rtol=1e-9, atol=1e-6 * (kind.role != "designs")
    )
    return right, f"read, {len(found)} rows"

"""One reader of tables: the same numbers in any spelling, for designs, samples, curves, signals and points."""

import datetime
import itertools

import numpy as np
import pytest
from kinds_of_tables import JOBS, book, text

from hpcclear.base.errors import InputError
from hpcclear.base.units import to_si
from hpcclear.scene import load_scene
from hpcclear.scene.importers import drawing_of
from hpcclear.scene.points import read_points
from hpcclear.scene.sheets import read, read_series

NUMBERS = ["0.3", "0.34", "0.7", "0.9", "0.45"]
SECONDS = ["0.0", "0.1", "0.2", "0.3", "0.4"]
HEADINGS = {
    "brackets": ("{} [{}]", None, False), "round brackets": ("{} ({})", None, False), "a slash": ("{} / {}", None, False),
    "in words": ("{} in {}", None, False), "a second row": ("{}", "{}", False), "brackets below": ("{}", "[{}]", False),
    "the cells": ("{}", None, True), "a slash without spaces": ("{}/{}", None, False),
}  # fmt: skip
"""Heading with name and unit, unit below, and whether cells have units."""
FILES = {
    "commas": text,
    "semicolons": lambda rows: text(rows, ";"),
    "decimal commas": lambda rows: text(rows, ";", comma=True),
    "tabs, UTF-16": lambda rows: text(rows, "\t", encoding="utf-16"),
    "workbook": book,
    "workbook, decimal commas": lambda rows: book(
        [[cell.replace(".", ",") if cell[:1].isdigit() else cell for cell in row] for row in rows]
    ),
}


def table(folder, spelling, file, *columns):
    """A file of columns, each a name, a unit and its cells."""
    heading, below, within = HEADINGS[spelling]
    rows = [
        [heading.format(name, unit) if unit and not within else name for name, unit, _ in columns]
    ]
    if below:
        rows[0] = [name for name, _, _ in columns]
        rows.append([below.format(unit) if unit else "" for _, unit, _ in columns])
    for cells in zip(*(one[2] for one in columns), strict=True):
        units = [one[1] if within else "" for one in columns]
        rows.append([f"{cell} {unit}".strip() for cell, unit in zip(cells, units, strict=True)])
    path = folder / ("t.xlsx" if file.startswith("workbook") else "t.csv")
    path.write_bytes(FILES[file](rows))
    return path


def designs(folder, *how):
    path = table(folder, *how, ("C", "mm", NUMBERS))
    return read_points(path, load_scene(JOBS / "slider_crank.toml")).values[:, 0]


def samples(folder, *how):
    path = table(folder, *how, ("C", "mm", NUMBERS))
    row = f"{{ distribution = 'samples', file = '{path}' }}"
    made = load_scene(JOBS / "robust_slider_crank.toml", [f"study.random.C={row}"])
    found = made.study.random_input("C").values  # rising
    return np.array(found)[np.argsort(np.argsort([float(one) for one in NUMBERS]))]


def points(folder, *how):
    middle = [f"{k}.5" for k in range(5)]
    path = table(folder, *how, ("name", "", [*"ABCDE"]), ("x", "mm", NUMBERS), ("y", "mm", middle))
    return np.array([one.x for one in drawing_of(path).points])


def signals(folder, *how):
    sheet = read_series(table(folder, *how, ("time", "s", SECONDS), ("gauge", "mm", NUMBERS)))
    assert sheet.si(sheet.axes["time"], "s", "").tolist() == [float(one) for one in SECONDS]
    return sheet.si(*sheet.signals, "m", "")


def curve(folder, *how):
    made = loaded(table(folder, *how, ("time", "s", SECONDS), ("push", "mN", NUMBERS)))
    assert made[:, 0].tolist() == [float(one) for one in SECONDS]
    return made[:, 1]


def loaded(path):
    """A load that a file has against the time, (n, 2)."""
    load = f"{{ kind = 'force', place = 'coupler.B', direction = 0.0, size_by_time = {{ file = '{path}' }} }}"
    scene = load_scene(JOBS / "linkages/crank_rocker.toml", [f"mechanism.loads.push={load}"])
    return np.array(next(one for one in scene.mechanism.loads if one.name == "push").size_by_time)


USES = (designs, samples, points, signals, curve)


@pytest.mark.parametrize("use", USES, ids=lambda use: use.__name__)
@pytest.mark.parametrize(("spelling", "file"), [*itertools.product(HEADINGS, FILES)])
def test_each_use_reads_each_spelling_alike(use, spelling, file, tmp_path):
    expected = [to_si(f"{number} mm", "m") for number in NUMBERS]
    rounded = 1e-12 if use is points else 0.0
    np.testing.assert_allclose(use(tmp_path, spelling, file), expected, rtol=0.0, atol=rounded)


@pytest.mark.parametrize("use", USES, ids=lambda use: use.__name__)
def test_each_use_refuses_a_cell_alike(use, tmp_path, monkeypatch):
    monkeypatch.setitem(globals(), "NUMBERS", [*NUMBERS[:3], "n/a", "0.45"])
    with pytest.raises(InputError, match="the cell is empty: it is not a finite decimal number"):
        use(tmp_path, "a slash", "semicolons")


def test_a_number_of_a_table_is_not_doubted_in_an_entry(tmp_path):
    (tmp_path / "t.csv").write_text("wear [µm],run m/s\n1.234,1\n12.5,2\n")
    sheet = read(tmp_path / "t.csv")
    assert sheet.names == ("wear", "run m/s")  # no run m in s
    texts = sheet.entries(sheet.columns[0])
    assert [to_si(one, "m") for one in texts] == [1.234e-6, 12.5e-6]


CLOCKS = ("%H:%M:%S.%f", "%Y-%m-%d %H:%M:%S.%f", "%d.%m.%Y %H:%M:%S.%f")


@pytest.mark.parametrize(
    ("pattern", "file"), [*itertools.product(CLOCKS, ("semicolons", "workbook"))]
)
@pytest.mark.parametrize("heading", ["time", "logged at", "Zeit"])
def test_clock_times_are_read_alike(pattern, file, heading, tmp_path):
    start = datetime.datetime(2026, 3, 28, 23, 59, 59, 800_000)
    moments = [start + datetime.timedelta(seconds=float(one)) for one in SECONDS]
    cells = [one.strftime(pattern) for one in moments]
    path = table(tmp_path, "a slash", file, ("push", "mN", NUMBERS), (heading, "", cells))
    sheet = read_series(path)
    for seconds in (sheet.si(sheet.axes["time"], "s", ""), loaded(path)[:, 0]):
        np.testing.assert_allclose(seconds, [float(one) for one in SECONDS], atol=1e-9)
    assert [one.name for one in sheet.signals] == ["push"]

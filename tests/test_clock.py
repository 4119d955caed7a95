"""Clock times and dates of measured tables are seconds since the first row; what has two readings is refused with both."""

import datetime
import io

import numpy as np
import pytest

from hpcclear.base.errors import InputError
from hpcclear.identify.measured import read_measured
from hpcclear.scene import load_scene
from hpcclear.scene.clock import is_clock, seconds
from hpcclear.scene.points import read_points
from hpcclear.scene.sheets import read_series

START = datetime.datetime(2026, 3, 14, 23, 59, 58, 250_000)
STEPS = [0.0, 0.5, 1.25, 2.0, 3.5, 61.0]
FORMATS = {
    "%H:%M:%S.%f": True, "%H:%M:%S,%f": True, "%I:%M:%S.%f %p": True, "%M:%S.%f": True, "%Y-%m-%d %H:%M:%S.%f": True,
    "%Y-%m-%dT%H:%M:%S.%fZ": True, "%Y-%m-%dT%H:%M:%S.%f+01:00": True, "%Y%m%dT%H%M%S.%f": True, "%Y/%m/%d %H:%M:%S.%f": True,
    "%d.%m.%Y %H:%M:%S,%f": True, "%d.%m.%y %H:%M:%S.%f": True, "%d/%m/%Y %H:%M:%S.%f": True, "%m/%d/%Y %I:%M:%S.%f %p": True,
    "%d-%b-%Y %H:%M:%S.%f": True, "%b %d, %Y %H:%M:%S.%f": True, "%d. %B %Y %H:%M:%S.%f": True, "%Y-%m-%d %H:%M:%S": False,
}  # fmt: skip
"""Formats, and whether they have the fractions of seconds."""


def cells(format_, start=START, steps=STEPS):
    return [(start + datetime.timedelta(seconds=one)).strftime(format_) for one in steps]


def place(row):
    return f"line {row}"


@pytest.mark.parametrize("format_", FORMATS)
def test_seconds_since_the_first_row_over_midnight(format_):
    made = cells(format_)
    assert all(map(is_clock, made))
    expected = STEPS if FORMATS[format_] else np.floor(0.25 + np.array(STEPS))
    np.testing.assert_allclose(seconds(made, place), expected, atol=1e-9)


def test_offsets_and_fractions_count():
    zones = ["2026-03-29T01:59:59+01:00", "2026-03-29T03:00:00+02:00", "2026-03-29T01:00:01.5Z"]
    np.testing.assert_allclose(seconds(zones, place), [0.0, 1.0, 2.5])
    np.testing.assert_allclose(
        seconds(["2026-03-01 00:00:00", "2026-03-02"], place), [0.0, 86_400.0]
    )
    np.testing.assert_allclose(seconds(["99:59:59", "100:00:01"], place), [0.0, 2.0])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("03/04/2026 12:03:05", ("2026-04-03", "2026-03-04")),
        ("03-04-2026", ("2026-04-03", "2026-03-04")),
        ("03/04/05 12:03:05", ("2005-04-03", "2005-03-04", "2003-04-05")),
        ("12:03", ("12 h 3 min", "12 min 3 s")),
        ("30/31/2026", ("is no date",)),
        ("2026-02-30 12:00:00", ("is no date",)),
        ("25:61:61", ("is no time of day",)),
        ("13:00:00 PM", ("is no time of day",)),
    ],
)
def test_what_has_two_readings_or_none_is_refused_with_them(text, words):
    with pytest.raises(InputError) as error:
        seconds([text, text], place)
    assert all(word in str(error.value) for word in words)


def test_one_row_settles_the_order_of_day_and_month():
    assert seconds(["03/04/2026", "13/04/2026"], place) == [0.0, 10 * 86_400.0]
    assert seconds(["03/04/2026", "03/14/2026"], place) == [0.0, 10 * 86_400.0]
    with pytest.raises(InputError, match="is no date"):
        seconds(["13/04/2026", "04/13/2026"], place)
    with pytest.raises(InputError, match="of another kind than those above it"):
        seconds(["12:03:05", "2026-03-01 12:03:06"], place)


@pytest.mark.parametrize(
    "text", ["", "1.2", "12", "a:b", "1,234.5", "-3:4", "5000 rpm", "1e-3", "A12", "2026"]
)
def test_numbers_and_names_are_no_clock_times(text):
    assert not is_clock(text)


def test_a_date_and_the_time_beside_it_are_one_clock(tmp_path):
    path, rows = tmp_path / "m.csv", zip(cells("%d.%m.%Y"), cells("%H:%M:%S.%f"), strict=True)
    rows = [f"{day};{clock};{k}.5" for k, (day, clock) in enumerate(rows)]
    path.write_text("\n".join(["Date;Time;force [N]", *rows]) + "\n")
    table = read_series(path)
    (axis,), (force,) = table.axes, table.signals
    assert (axis, force.name) == ("time", "force")
    np.testing.assert_allclose(table.si(table.axes[axis], "s", ""), STEPS, atol=1e-9)


def test_dates_of_a_workbook_and_a_signal_of_a_sensor(tmp_path):
    from openpyxl import Workbook

    made, frequency = Workbook(), 2.0
    made.active.append(["logged at", "torque"])
    for k in range(400):
        at = START + datetime.timedelta(seconds=0.02 * k)
        made.active.append([at, float(np.sin(2 * np.pi * frequency * 0.02 * k))])
        made.active.cell(k + 2, 1).number_format = "yyyy-mm-dd hh:mm:ss.000"
    stream = io.BytesIO()
    made.save(stream)
    (tmp_path / "m.xlsx").write_bytes(stream.getvalue())
    found = read_measured(tmp_path / "m.xlsx", "torque", "N*m", frequency)
    assert found.frequency == pytest.approx(frequency, rel=1e-3)
    assert abs(found.spectrum.mean[1]) == pytest.approx(1.0, rel=0.05)


def test_dates_name_designs_and_are_no_numbers(tmp_path):
    scene = load_scene("jobs/slider_crank.toml")
    (tmp_path / "d.csv").write_text("built on,C [mm]\n2026-03-01,0.3\n2026-03-02,0.4\n")
    points = read_points(tmp_path / "d.csv", scene)
    assert points.labels == ("2026-03-01", "2026-03-02")
    (tmp_path / "d.csv").write_text("C [mm],m2 [g]\n2026-03-01,210\n2026-03-02,220\n")
    with pytest.raises(InputError, match="is a date or time"):
        read_points(tmp_path / "d.csv", scene)

"""Every number on the page of a report comes from its files: found there, and another where the files hold another."""

import re
import shutil
import sys
from pathlib import Path

import numpy as np
import opened
import pytest
import report_data as data
from own_engine import engine
from page_numbers import NUMBER, check, foreign, held, leading, shown, summed, told

from hpcclear.cli.printing import describe_study
from hpcclear.ranks.boundary import alone
from hpcclear.report.figures import labels
from hpcclear.report.html import gallery
from hpcclear.study import run_study

sys.path.insert(0, str(Path(__file__).parent / "mpi_programs"))
import formula


@pytest.fixture(autouse=True)
def without_figures(monkeypatch) -> None:
    """Pictures, whose numbers are drawn, take most of the time."""
    monkeypatch.setattr(gallery, "figures", lambda content, troubles: None)


@pytest.fixture(scope="module")
def study(tmp_path_factory) -> Path:
    """An engine's, its dynamics a formula."""
    place = tmp_path_factory.mktemp("study") / "out"
    with pytest.MonkeyPatch.context() as patch:
        formula.replace_dynamics(patch.setattr)
        patch.setattr(sys, "argv", ["hpcclear", "run", "own.toml"])
        run_study(engine(), place, alone(), progress_style="quiet")
    shutil.rmtree(place / "responses")  # those of the formula lack what is drawn
    return place


@pytest.fixture(params=["made up", "accuracy", "engine"])
def place(request, tmp_path: Path) -> Path:
    """A directory of results."""
    if request.param == "engine":
        return shutil.copytree(request.getfixturevalue("study"), tmp_path / "out")
    if request.param == "accuracy":
        opened.write(data.accuracy(), tmp_path / "accuracy.nc")
        return tmp_path
    return data.write_study(tmp_path)


def test_every_number_is_found_in_a_file(place: Path) -> None:
    check(place)


def test_a_number_of_no_file_is_noticed(tmp_path: Path) -> None:
    known = leading([0.02621, 1.5])
    assert foreign(told("0.2621 mm, 26.215 µm, 150 and 1.51e+03, 2 of 12"), known) == [
        "26.215",
        "1.51e+03",
    ]


def test_every_number_is_another_where_the_files_hold_others(place: Path) -> None:
    """All that has one of these units differs on the page; ratios, counts and words stay."""
    factors = {"m": 1.21, "s": 1.13, "kg": 1.37, "kg m^2": 1.43, "N": 1.31}
    before, free = shown(place), []
    for path in place.rglob("*.nc"):
        content = opened.read(path)
        for variable in content.data_vars.values():
            if (unit := str(variable.attrs.get("units"))) in factors:
                variable *= factors[unit]
        path.unlink()
        opened.write(content, path)
        free += summed(content)
        measured = [name for name, v in content.items() if v.attrs.get("units") in factors]
        free += held(content.drop_vars(measured))
    old, new = (NUMBER.findall(text) for text in (before, shown(place)))
    kept = [f"{one[0]}e{one[1] or 0}" for one, other in zip(old, new, strict=True) if one == other]
    assert foreign(told(" ".join(kept)), leading(free)) == []


def test_the_answer_in_the_terminal_tells_what_files_hold(study: Path, capsys) -> None:
    describe_study(study)
    printed = " ".join(capsys.readouterr().out.split())
    found = opened.read(study / "verification.nc")
    known = {
        labels.quantity(float(value), str(variable.attrs["units"]), digits)
        for digits in range(4, 8)
        for variable in found.data_vars.values()
        if variable.attrs.get("units", "1") != "1"
        for value in np.ravel(variable)
    }
    quantities = re.findall(r"(?<![\d.])[\d.]+ (?:mm|µm|nm|kg|g)\b", printed)
    assert len(quantities) > 8
    assert set(quantities) <= known

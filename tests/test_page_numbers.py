"""Every number on the page of a report comes from its files: found there, and another where the files hold another.

Only numbers of three digits and more: shorter ones are found in any file.
"""

import re
import shutil
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
import pytest
import report_data as data
import xarray as xr
from own_engine import engine
from test_report import Tree

from hpcclear.base.arrays import Array
from hpcclear.cli.printing import describe_study
from hpcclear.ranks.boundary import alone
from hpcclear.report.figures import labels
from hpcclear.report.html import gallery
from hpcclear.report.html.page import write_report
from hpcclear.results import dataset
from hpcclear.study import run_study

sys.path.insert(0, str(Path(__file__).parent / "mpi_programs"))
import formula

NUMBER = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?)(?:e([-+]?\d+))?(?![\w.]*\d)")
TELLING = 3
LISTED = ("samples", "kriging", "front", "response")
"""Kinds whose numbers are drawn, or told in sum: in so many any number would be found."""


class Cells(Tree):
    """Its texts apart, cells and tiles too."""

    def handle_data(self, text: str) -> None:
        super().handle_data(f" {text} ")


Told = tuple[str, float, float]


def told(text: str) -> Iterator[Told]:
    """Numbers of a text that tell something, and from where to where what they stand for lies, as 1 to 10."""
    for match in NUMBER.finditer(text):
        digits = match[1].replace(".", "").lstrip("0")
        if len(digits) >= TELLING:
            unit = 10.0 ** (1 - len(digits))
            value = int(digits) * unit
            yield match[0], value - 0.501 * unit, value + 0.501 * unit


def held(content: xr.Dataset) -> Iterator[float]:
    """All that a file says as a number or in words; of long lists only how long they are."""
    texts = [str(text) for text in content.attrs.values()]
    yield from map(float, content.sizes.values())
    for variable in content.variables.values():
        texts += [str(text) for text in variable.attrs.values()]
        if variable.dtype.kind not in "fiu":
            texts += [str(text) for text in np.ravel(variable.to_numpy())]
        elif content.attrs["hpcclear_kind"] not in LISTED:
            yield from np.ravel(variable.to_numpy()).astype(float)
    for text in texts:
        yield from (0.5 * (low + high) for _, low, high in told(text))


def summed(content: xr.Dataset) -> Iterator[float]:
    """What the page works out of a file: each line is a number that a reader can work out again."""
    kind = content.attrs["hpcclear_kind"]
    if kind == "samples":
        for name in ("objective", "rhs_evaluations"):
            yield from (float(content[name].min()), float(content[name].max()))
        yield float(content["rhs_evaluations"].sum())
    if kind == "verification":
        for name in ("mean", "deviation"):  # half as wide as limits, and against the original
            yield from np.ravel(0.5 * (content[f"{name}_upper"] - content[f"{name}_lower"]))
            true = content[f"{name}_true"].to_numpy()
            yield from np.ravel(true[:, None] / true[None, :] - 1.0)
    if kind == "timing":
        parts = [content[name] for name in ("busy", "idle", "compile", "write")]
        for part in (*parts, *([content["samples"]] if "samples" in content else [])):
            yield from np.ravel(part.sum("stage"))
        yield from np.ravel(sum(part.sum("stage") for part in parts))
        if "samples" in content:
            simulated = content["samples"] > 0
            yield float(content["samples"].sum() / content["busy"].where(simulated).sum())
    if kind == "accuracy":
        yield from np.ravel(content["averaged"] * content["turn_seconds"])
        yield from np.ravel(content["training"] * content["sample_seconds"])


def contents(place: Path) -> list[xr.Dataset]:
    return [dataset.read(path) for path in sorted(place.rglob("*.nc"))]


def shown(place: Path) -> str:
    return Cells(write_report(place).read_text(encoding="utf-8")).text


def leading(values: Iterable[float]) -> Array:
    """Values as 1 to 10, in order."""
    sizes = np.abs(np.fromiter(values, float))
    return np.sort(10.0 ** (np.log10(sizes[np.isfinite(sizes) & (sizes > 0.0)]) % 1.0))


def foreign(numbers: Iterable[Told], known: Array) -> list[str]:
    """Numbers that are none of the known ones."""
    return [
        text
        for text, low, high in numbers
        if np.searchsorted(known, low) == np.searchsorted(known, high, side="right")
    ]


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
        dataset.write(data.accuracy(), tmp_path / "accuracy.nc")
        return tmp_path
    return data.write_study(tmp_path)


def test_every_number_is_found_in_a_file(place: Path) -> None:
    numbers = list(told(shown(place)))
    assert len(numbers) > 10
    known = leading(x for one in contents(place) for x in (*held(one), *summed(one)))
    assert foreign(numbers, known) == []


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
        content = dataset.read(path)
        for variable in content.data_vars.values():
            if (unit := str(variable.attrs.get("units"))) in factors:
                variable *= factors[unit]
        path.unlink()
        dataset.write(content, path)
        free += summed(content)
        measured = [name for name, v in content.items() if v.attrs.get("units") in factors]
        free += held(content.drop_vars(measured))
    old, new = (NUMBER.findall(text) for text in (before, shown(place)))
    kept = [f"{one[0]}e{one[1] or 0}" for one, other in zip(old, new, strict=True) if one == other]
    assert foreign(told(" ".join(kept)), leading(free)) == []


def test_the_answer_in_the_terminal_tells_what_files_hold(study: Path, capsys) -> None:
    describe_study(study)
    printed = " ".join(capsys.readouterr().out.split())
    found = dataset.read(study / "verification.nc")
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

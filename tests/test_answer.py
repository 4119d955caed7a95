"""The answer of a study: what it says, and that every number of it stands in a file; no story but the study's own."""

import re
import shutil
import sys
from pathlib import Path

import formula
import numpy as np
import pytest
import report_data as data
import xarray as xr
from own_engine import engine

from hpcclear.base.objectives import OURS
from hpcclear.base.outcome import WIDEST
from hpcclear.base.verdict import Verdict
from hpcclear.cli.printing import LINES, describe, fitted
from hpcclear.cli.tables import console, table
from hpcclear.ranks.boundary import alone
from hpcclear.report import alike
from hpcclear.report.answer import answer
from hpcclear.report.html.content import Content, read
from hpcclear.report.html.page import write_report
from hpcclear.report.screen import Level, Screen, Trust, change
from hpcclear.report.screens import screen_of
from hpcclear.report.spread import Line
from hpcclear.results import dataset
from hpcclear.study import run_study

NAMES = ("robust original", "robust alpha", "robust beta", "robust front 1", "calm alpha")


def verified(mean, deviation, half=1e-6, **more):
    """Designs of `NAMES` with these true moments (m) and limits half as wide as given."""
    mean, deviation = np.array(mean), np.array(deviation)
    coords, columns = data.simulated([*NAMES], 100)
    columns |= {
        "m2": np.linspace(0.1, 0.5, 5),
        "case": np.array(["robust"] * 4 + ["calm"]),
        "random": np.array(["C m2"] * 4 + ["C"]),
        "on_bounds": np.array(["", "m2 lower", "", "", ""]),
        "beyond_hertz": np.array([0, 30, 0, 0, 0]),
        "mean_true": mean,
        "mean_lower": mean - half,
        "mean_upper": mean + half,
        "deviation_true": deviation,
        "deviation_lower": deviation - half,
        "deviation_upper": deviation + half,
    }
    return dataset.dataset("verification", coords, columns | more).to_xarray()


MEAN = [4e-4, 2e-4, 3e-4, 2.015e-4, 1e-4]
DEVIATION = [6e-5, 4e-5, 2e-5, 4.1e-5, 1e-5]


@pytest.mark.parametrize("unknown", ["mean_true", "deviation_true"])
def test_where_no_design_is_known_none_is_recommended(unknown):
    """Of a single simulation that did not fail there is a mean and no deviation."""
    found = verified(MEAN, DEVIATION)
    found[unknown][:] = np.nan
    assert told(found) == {}
    assert screen_of(Content(Path("x"), {"verification": found})) is None


def told(content) -> dict[str, str]:
    return {line.label: line.text for line in answer({"verification": content})}


def test_the_design_to_take_is_the_one_that_nearly_all_machines_stay_lowest_with():
    """Of the case in which most is random: least mean + 2 deviations, 280 um against 340, 283.5 and 520."""
    lines = told(verified(MEAN, DEVIATION))
    assert "4 simulated designs" in lines["criterion"]
    assert "100 simulations" in lines["confidence"]
    advised = " ".join(opened(verified(MEAN, DEVIATION)).steps)
    assert "wider ranges" in advised
    assert "stiffer bearings" in advised


def test_the_same_design_under_other_names_is_no_choice():
    """Beta's variables are alpha's: no cost can decide between them."""
    twice = {"m2": np.array([0.1, 0.2, 0.2, 0.3, 0.4]), "equivalence": np.zeros((5, 5), np.int8)}
    twice["equivalence"][[1, 2], [2, 1]] = 1
    own = verified([4e-4, 2e-4, 2e-4, 3e-4, 1e-4], [6e-5, 4e-5, 4e-5, 5e-5, 1e-5], **twice)
    assert "equivalent" not in opened(own).remark
    assert "as wide" not in " ".join(opened(own).steps)
    twice["equivalence"][[1, 2, 3, 3], [3, 3, 1, 2]] = 1
    near = verified([4e-4, 2e-4, 2e-4, 2.001e-4, 1e-4], [6e-5, 4e-5, 4e-5, 4e-5, 1e-5], **twice)
    assert "2 equivalent designs" in opened(near).remark


@pytest.mark.parametrize(
    ("total", "error", "words"),
    [
        ((0.59, 2e-4, 0.4), 1e-4, "m2 59.0 ± 0.1 %, m3 40.0 ± 0.1 %, C below 0.5 %"),
        ((2e-4, 2e-4, 1.0), 1e-4, "m3 100.0 ± 0.1 %, m2, C below 0.5 %"),
        ((0.59, 2e-4, 0.4), 0.01, "m2 59 ± 2 %, m3 40 ± 2 %, C below 2.0 %"),
        ((0.59, np.nan, 0.4), 0.01, None),
    ],
)
def test_total_indices_are_printed_and_small_ones_without_a_number(total, error, words):
    """Where the interval is wide none is called small."""
    found = xr.Dataset(
        {
            "sobol_total": ("parameter", list(total)),
            "sobol_total_error": ("parameter", [error] * 3),
        },
        {"parameter": ["m2", "C", "m3"]},
    )
    files = {"verification": verified(MEAN, DEVIATION), "sensitivity": found}
    lines = {line.label: line.text for line in answer(files)}
    assert lines.get("interactions", "").partition("%): ")[2] == (words or "")


def opened(content, **more):
    """The first screen of designs."""
    return screen_of(Content(Path("out"), {"verification": content, **more}))


def test_the_first_screen_has_the_design_beside_todays_with_changes_and_intervals():
    first = opened(verified(MEAN, DEVIATION, percentile=2.0 * np.array(MEAN)))
    gains = "50 % lower mean gap, 33 % lower standard deviation"
    assert first.headline == f"Recommended design: {gains}"
    mean, deviation, percentile = first.tiles
    assert mean[1:] == ("0.2 mm", "0.4 mm", "\u221250 %", "± 0.5 %", True)
    assert deviation[1:] == ("40 µm", "60 µm", "\u221233 %", "± 2.5 %", True)
    assert (percentile.value, percentile.before) == ("0.4 mm", "0.8 mm")
    assert percentile.within == "interval not known"
    (row,) = first.rows
    assert (row.label, row.cells) == ("m2, mass of the rod", ("0.1 kg", "0.2 kg"))
    assert first.trust[0].level is Level.AMBER  # 30 of 100 simulations beyond the range
    assert not first.doubt


@pytest.mark.parametrize(("share", "moved"), [(0.0, "\u221220 %"), (0.6, "")])
def test_peaks_of_chaotic_runs_are_not_compared(share, moved):
    """Each is one run: where a perturbation of its start changes it, a difference may be chance."""
    forces = {"original": [800.0, 1000.0], "robust alpha": [800.0, 700.0]}
    runs = {k: xr.Dataset({"peak_contact_force": ("joint", v)}) for k, v in forces.items()}
    names = {"design": ["robust original", "robust alpha"]}
    shares = dict.fromkeys(("chaotic", "chaos_share", "chaos_deviation"), ("design", [share, 0.0]))
    chaos = xr.Dataset(shares, names)
    files = {"verification": verified(MEAN, DEVIATION), "chaos": chaos}
    tile = screen_of(Content(Path("out"), files, runs)).tiles[-1]
    assert (tile.label, tile.value, tile.before) == ("peak force", "0.8 kN", "1 kN")
    assert (tile.change, "chaotic" in tile.within) == (moved, bool(share))


def test_red_comes_first_and_the_headline_is_in_doubt():
    first = opened(verified(MEAN, DEVIATION, beyond_hertz=np.array([0, 60, 0, 0, 0])))
    assert first.trust[0].level is Level.RED
    assert "60 %" in first.trust[0].text
    assert "outside its range" in first.doubt
    first = opened(verified(MEAN, DEVIATION, accuracy_missed=np.array(["", "mean", "", "", ""])))
    assert [one.level for one in first.trust].count(Level.RED) == 1
    assert "accuracy" in first.doubt


@pytest.mark.parametrize("half", [1e-7, 1e-5, 3e-5, 2e-4])
def test_a_change_within_its_interval_is_none(half):
    """Independent intervals: half-widths over their values, squares added, of a change by a half."""
    first = opened(verified(MEAN, DEVIATION, half))
    reach = 0.5 * np.hypot(half / 2e-4, half / 4e-4)
    assert (first.tiles[0].change == "no significant change") == (reach >= 0.5)
    assert ("50 %" in first.headline) == (reach < 0.5)


def test_the_terminal_has_24_lines_of_80_columns(capsys):
    many = {name: np.linspace(0.1, 0.5, 5) for name in ("m1", "u1", "I1", "u2", "I2", "m3", "C")}
    content = verified(MEAN, DEVIATION, beyond_hertz=np.full(5, 90), **many)
    describe(Content(Path("out"), {"verification": content, "sensitivity": data.sensitivity()}))
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) <= LINES
    assert max(map(len, lines)) <= 80
    assert "red" in " ".join(lines)
    worries = tuple(Trust(Level.AMBER, f"worry {k}") for k in range(5))
    few = fitted(Screen("What it is", trust=worries, steps=("most", "less")), 6)
    assert [str(line).split()[-1] for line in few[-2:]] == ["2", "most"]
    heads = next(line for line in lines if "today" in line).split("  ")
    shown = [one.strip() for one in heads if one]
    assert shown[-2:] == ["change", "95 %, note"]  # a note may be long


def test_a_change_has_the_sign_and_the_size_that_its_values_have():
    known, zero, none = (1.0, 0.99, 1.01), (0.0, 0.0, 0.014), (np.nan, np.nan)
    assert change((0.996, 0.9959, 0.9961), (1.0, 0.9999, 1.0001)) == ("−0.4 %", True)
    assert change((-0.05, *none), (-0.14, *none)) == ("+64 %", False)  # of a formula such as -m3
    assert change((0.14, *none), (0.14, *none)) == ("no significant change", None)
    assert change(zero, (0.002, 0.0, 0.01)) == ("no significant change", None)
    assert change(zero, known) == ("−100 %", True)


def test_a_label_of_any_length_stands_apart_from_its_text(capsys):
    lines = [Line(label, "37.5 % of the samples") for label in ("f > 3 N", "f > 8 km/s²")]
    describe(Content(Path("out"), {"verification": verified(MEAN, DEVIATION)}), asked=lines)
    assert capsys.readouterr().out.count(" 37.5 %") == 2


def test_a_table_that_is_too_wide_for_its_words_is_turned(capsys):
    console().print(table("", [["1 ± 2", *["b" * 20] * 3]] * 2, ["half-width", *"xyz"]))
    out = capsys.readouterr().out
    assert "half-width   1 ± 2                  1 ± 2" in out
    assert out.count("b" * 20) == 6


def test_an_original_that_is_best_is_kept():
    first = opened(verified([1e-4, *MEAN[1:]], [1e-6, *DEVIATION[1:]]))
    assert first.headline.startswith("Keep today's design")
    assert not any(tile.before for tile in first.tiles)


def test_designs_that_a_publication_prints_or_that_failed_are_not_taken():
    printed = np.array([np.nan, 1e-4, np.nan, np.nan, np.nan])
    content = verified(MEAN, DEVIATION, mean_paper=printed, deviation_paper=printed)
    assert told(content)["criterion"].startswith("robust front 1: ")
    gone = [np.nan if k == 1 else x for k, x in enumerate(MEAN)]
    assert told(verified(gone, DEVIATION))["criterion"].startswith("robust front 1: ")
    assert told(verified([np.nan] * 5, DEVIATION)) == {}
    assert opened(verified([np.nan] * 5, DEVIATION)) is None


SCENES = {
    "engine": (),
    "torque": (
        'drive={ kind = "torque", torque = 4.0, flywheel_inertia = 0.05, initial_speed = "3000 rpm" }',
    ),
    "one joint": ("joints.rod_slider.kind=ideal",),
    "damped": ('effects.contact={ law = "hunt-crossley", damping = 0.5 }',),
    "heavy": ("effects.gravity=9.81", "effects.slider_load=none"),
}
STORY = re.compile(
    r"paper|claim|table 4|printed|readings|varying joint clearance|\beq\. \d|\bfig\. \d",
    re.IGNORECASE,
)
SHORT = {("engine", "mean-gap"), ("torque", "peak-contact-force"), ("heavy", "peak-crank-moment")}
SHORT |= {("one joint", "slider-acceleration-deviation"), ("damped", "mean-contact-force")}


@pytest.mark.parametrize(
    ("scene", "objective"),
    [
        pytest.param(s, o, marks=[] if (s, o) in SHORT else [pytest.mark.full], id=f"{s} {o}")
        for s in SCENES
        for o in OURS
        if o.replace("-", "_") not in WIDEST  # their geometry of contact has no pressure
    ],
)
@pytest.mark.shortened(1)
def test_a_study_of_ones_own_tells_its_own_story(
    tmp_path, monkeypatch, capsys, details, scene, objective
):
    """No word of the paper's in page and terminal; f by its own name, variables by theirs."""
    formula.replace_dynamics(monkeypatch.setattr)
    monkeypatch.setattr(formula, "FIELD", objective.replace("-", "_"))
    if objective == "mean-gap":
        monkeypatch.setattr(formula, "FIELD", "")
    monkeypatch.setattr(sys, "argv", ["hpcclear", "run", "own.toml"])
    place = tmp_path / "out"
    own = engine(*SCENES[scene], f"study.objective={objective}", "study.sensitivity.levels=2")
    run_study(own, place, alone(), progress_style="quiet")
    describe(read(place), place / "verification.nc")
    printed = capsys.readouterr().out
    assert {path.name for path in place.glob("*.nc")} >= {"front.nc", "verification.nc"}
    shutil.rmtree(place / "responses")  # those of the formula lack what figures draw
    page = write_report(place).read_text(encoding="utf-8")
    page = re.sub(r'(?s)src="data:[^"]*"|<style>.*?</style>|<script>.*?</script>', "", page)
    for told in (page.replace(str(tmp_path), ""), printed):
        assert STORY.findall(told) == []
        if objective != "mean-gap":
            assert "distance from the clearance" not in told
    assert all(len(line) <= 80 for line in printed.replace(str(tmp_path), ".").splitlines())
    words = OURS[objective].words
    assert words in page
    assert words in " ".join(printed.split())
    for name in ("piston", "shank", "m1"):
        assert name in page
        assert name in printed


@pytest.mark.parametrize("seed", range(12))
def test_equivalent_designs_satisfy_the_constraints_and_name_each_other(seed):
    """Random chains of designs: the words of two designs agree, and none that violates a constraint is offered."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 7))
    names = [f"c design{k}" for k in range(count)]
    one = rng.random((count, count)) < 0.5
    one = np.triu(one, 1) | np.triu(one, 1).T
    verdicts = [Verdict(k) for k in rng.choice([0, 0, 1, 2], count)]
    columns = data.constrained(verdicts)
    content = xr.Dataset(
        {
            "equivalence": (("design", "rival"), one.astype(np.int8)),
            **{name: (("design", "constraint"), values) for name, values in columns.items()},
            "m": ("design", np.arange(count) + 1.0, {"units": "kg", "design_variable": 1}),
        },
        {"design": names, "rival": names},
    )  # fmt: skip
    offered = {name: alike.others(content, content.sel(design=name)) for name in names}
    for k, name in enumerate(names):
        for j, other in enumerate(names):
            both = verdicts[j] == verdicts[k] == Verdict.HOLDS
            assert (other in offered[name]) == (both and j != k and bool(one[j, k]))
            assert (other in offered[name]) == (name in offered[other])

"""Statistics of samples: limits that hold as often as they say, and nothing stated that samples do not determine."""

import re

import numpy as np
import opened
import pytest
import report_data as data

from hpcclear.base.errors import InputError
from hpcclear.base.objectives import MEAN_GAP, OURS
from hpcclear.report import spread
from hpcclear.report.html.page import write_report
from hpcclear.statistics.random.survival import fewest, order_interval


def drawn(count=60, failed=0, method="monte-carlo", **more):
    return data.samples(count, failed or 1).assign_attrs(sampling=method, **more)


def texts(lines):
    return {line.label: line.text for line in lines}


def text(lines, label):
    return texts(lines)[label]


@pytest.mark.parametrize("level", [0.05, 0.5, 0.95, 0.99])
def test_limits_of_a_quantile_hold_and_end_where_the_values_do(level):
    count = fewest(level)
    values = np.arange(count, dtype=float)
    assert np.isfinite(order_interval(values, level)).all()
    assert not np.isfinite(order_interval(values[1:], level)).all()
    rng = np.random.default_rng(1)
    ranked = rng.random((2000, count + 40))  # of a uniform distribution the quantile is its level
    ends = np.array([order_interval(row, level) for row in ranked])
    held = (ends[:, 0] <= level) & (level <= ends[:, 1])
    assert held.mean() > 0.95 - 3 * np.sqrt(0.05 * 0.95 / 2000)


def test_limits_of_a_quantile_hold_wherever_unknown_values_lie():
    values = np.random.default_rng(2).random(500)
    low, high = order_interval(values, 0.5, unknown=20)
    for elsewhere in (-1.0, 2.0):
        own = order_interval(np.append(values, np.full(20, elsewhere)), 0.5)
        assert low <= own[0] < own[1] <= high
    assert np.isnan(order_interval(np.array([]), 0.5)).all()


def test_quantiles_are_stated_only_where_the_samples_reach_them():
    few, many = (spread.statistics(drawn(count)) for count in (60, 500))
    line = next(one for one in few if one.label == "median of f")
    ends = re.fullmatch(r"[\d.]{5} mm \(([\d.]{5}) to ([\d.]{5}) mm\)", line.text).groups()
    outwards = 1e3 * np.array(line.estimate[1:3]) - np.array(ends, float)
    assert 0.0 <= outwards[0] < 1e-3 >= -outwards[1] >= 0.0
    for name, count in (("P95 of f", 72), ("P99 of f", 368)):
        assert text(few, name) == f"not stated: it needs {count} samples"
    assert "to" in text(many, "P99 of f")
    failing = spread.statistics(drawn(500, 60))  # these might all be above
    assert text(failing, "P95 of f") == "not stated: too many samples failed"
    assert text(failing, "failed").startswith("60 of 500")


def test_moments_are_those_of_the_samples():
    samples = drawn(500)
    f = samples["objective"].to_numpy()
    mean = re.fullmatch(r"([\d.]+) ± ([\d.]+) mm", text(spread.statistics(samples), "mean of f"))
    np.testing.assert_allclose(float(mean[1]), 1e3 * np.nanmean(f), rtol=1e-2)
    expected = 1.965 * np.nanstd(f) / np.sqrt(499)
    assert expected <= 1e-3 * float(mean[2]) < 1.2 * expected  # rounded up


def test_designs_that_somebody_chose_have_no_intervals():
    lines = spread.statistics(data.samples())
    assert text(lines, "intervals") == spread.CHOSEN
    assert not any(mark in line.text for line in lines for mark in ("±", " to "))
    assert "P95 of f" not in texts(lines)
    assert spread.statistics(data.samples(4, 3)) == []
    assert text(spread.statistics(drawn(method="lhs")), "intervals") == spread.USUALLY_WIDER


def test_a_share_beyond_a_threshold_counts_failures_for_and_against():
    samples = drawn(100, 10)
    units = spread.units_of(MEAN_GAP)
    all_above = spread.beyond(units, "peak_contact_force=1 kN")
    none_above = spread.beyond(units, "peak_contact_force crank_rod=1 MN", ["crank_rod"])
    lines = texts(spread.statistics(samples, [all_above, none_above]))
    least = float(re.search(r"\(([\d.]+) %", lines["peak contact force in any joint > 1 kN"])[1])
    most = float(re.search(r"to ([\d.]+) %", lines["peak contact force crank_rod > 1 MN"])[1])
    assert least < 90.0
    assert most > 10.0
    lines = spread.statistics(samples, [spread.Beyond("mean_contact_force", 1.0)])
    assert "not recorded" in text(lines, "mean_contact_force")


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("0.3 mm", ("objective", 3e-4)),
        ("peak_contact_force=3kN", ("peak_contact_force", 3000.0)),
        ("peak_contact_force crank_rod = 3 kN", ("peak_contact_force", 3000.0, "crank_rod")),
        ("impacts=4", ("impacts", 4.0)),
    ],
)
def test_a_threshold_is_read_in_the_unit_of_its_result(words, expected):
    found = spread.beyond(spread.units_of(MEAN_GAP), words, ["crank_rod"])
    assert found == spread.Beyond(*expected)


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ("3 kN", "a quantity in m"),
        ("nan", "not a number"),
        ("3e-4", "no unit.*fits m"),
        ("peak_contact_force=2.5", "no unit.*2.5 kN"),
        ("peak_contact_force crank=2.5 kN", "no joint 'crank'.*crank_rod"),
        ("rhs_evaluations crank_rod=3", "samples have no result|no joint"),
        ("peak_force=3", "no result 'peak_force'.*Did you mean 'peak_"),
        ("status=1", "no result 'status'"),
    ],
)
def test_a_threshold_that_is_none_is_refused(words, reason):
    with pytest.raises(InputError, match=reason):
        spread.beyond(spread.units_of(MEAN_GAP), words, ["crank_rod", "rod_slider"])
    assert spread.beyond(spread.units_of(OURS["peak-contact-force"]), "3 kN").value == 3000.0


def test_a_page_of_several_samples_compares_them_and_has_sections_for_each(tmp_path):
    for name, failed in (("H7g6", 5), ("H7f7", 1)):
        opened.write(drawn(100, failed), tmp_path / f"{name}.nc")
    opened.write(data.timing(), tmp_path / "H7g6.timing.nc")
    chosen = [tmp_path / f"{name}.nc" for name in ("H7f7", "H7g6")]
    for page in (write_report(tmp_path), write_report(*chosen, output=tmp_path / "chosen.html")):
        text = page.read_text()
        heads = re.findall(r"<h3 [^>]*>([^<]*)</h3>", text)
        assert heads[:2] == ["Comparison", "H7f7: statistics of the samples"]
        assert "H7g6: statistics of the samples" in heads
        assert "Statistics of the samples" not in heads
        assert "was left out" not in text
        assert "2 files of samples, beside each other" in text
        table = re.search(r'id="quality-compared".*?</tbody>', text, re.S)[0]
        assert table.index("H7f7") < table.index("H7g6")
        assert table.index("1 of 100") < table.index("5 of 100")
        ids = re.findall(r'id="([^"]*)"', text)
        assert len(ids) == len(set(ids))
        assert len([one for one in ids if one.startswith("figure-")]) >= 2
    assert text.count("The command that made these results") == 0  # run times were not chosen

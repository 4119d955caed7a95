"""Streamed statistics: against plain numpy, in any order of arrival, over stops and numbers of ranks."""

import re
from pathlib import Path

import numpy as np
import opened
import pytest
from commands import finish, start
from streaming_run import make_made_up, scene_of

from hpcclear.base.errors import InputError
from hpcclear.base.outcome import OUTCOME, Flag, Status
from hpcclear.ensemble import identity
from hpcclear.ensemble.session import Options
from hpcclear.ensemble.statistics import run_statistics, statistics_dataset
from hpcclear.ranks.boundary import alone
from hpcclear.report.html.content import Content
from hpcclear.report.screens import screen_of
from hpcclear.results import provenance
from hpcclear.scene.sampling import monte_carlo
from hpcclear.statistics.streams import Accumulator, Summary, columns, rows_of

PROGRAM = Path(__file__).parent / "mpi_programs" / "streaming_run.py"


QUIET = Options(style="quiet")


@pytest.fixture(autouse=True)
def _made_up(monkeypatch):
    """No kernel: what ranks simulate follows from index and point alone."""
    monkeypatch.setattr("hpcclear.ensemble.statistics.make_evaluator", make_made_up)


def outcomes(samples: int, seed: int = 3) -> np.ndarray:
    """Records with everything that happens: failures, NaN, flags, a far outlier."""
    rng = np.random.default_rng(seed)
    records = np.zeros(samples, OUTCOME)
    records["sample"] = np.arange(samples)
    records["objective"] = 3e-4 + 1e-6 * rng.standard_normal(samples)
    records["objective"][samples // 2] = 1.0
    records["objective_spread"] = np.where(rng.random(samples) < 0.1, np.nan, rng.random(samples))
    records["mean_gap"][:, :2] = rng.random((samples, 2)) * [1e-4, 1e-3]
    records["mean_gap"][:, 1] = np.nan  # an ideal joint
    records["peak_contact_force"][:, :2] = rng.gamma(2.0, 1e3, (samples, 2))
    records["rhs_evaluations"] = rng.integers(10**4, 10**6, samples)
    records["status"] = np.where(rng.random(samples) < 0.05, Status.STEP_CAP, Status.OK)
    records["flags"] = rng.integers(0, 4, samples)
    for name in ("objective", "objective_spread", "mean_gap", "peak_contact_force"):
        records[name][records["status"] != 0] = np.nan
    return records


def fill(sums: Accumulator, records: np.ndarray, seed: int) -> Accumulator:
    """Feed records in random order, in pieces of random length."""
    rng = np.random.default_rng(seed)
    shuffled = records[rng.permutation(records.size)]
    cuts = np.sort(rng.integers(0, records.size, 40))
    for piece in np.split(shuffled, cuts):
        sums.add(piece)
    return sums


def same(first: Summary, second: Summary) -> bool:
    """Equal in every bit."""
    return all(one.tobytes() == other.tobytes() for one, other in zip(first, second, strict=True))


def test_statistics_equal_numpy_on_all_samples():
    records = outcomes(5000)
    sums = fill(Accumulator(5000, block=256, bins=20), records, 1)
    found = sums.result()
    assert sums.remaining(1).size == 0
    for row, values in enumerate(columns(records)):
        known = values[np.isfinite(values)]
        assert found.number[row] == known.size
        assert found.histogram[row].sum() == known.size
        if known.size == 0:
            assert rows_of(2)[row] == ("mean_gap", 1)
            assert np.isnan(found.deviation[row])
            continue
        np.testing.assert_allclose(found.mean[row], np.mean(known), rtol=1e-13)
        np.testing.assert_allclose(found.deviation[row], np.std(known, ddof=1), rtol=1e-11)
        assert (found.minimum[row], found.maximum[row]) == (known.min(), known.max())
        inner, _ = np.histogram(known, sums.edges[row])
        at_last_edge = np.count_nonzero(known == sums.edges[row][-1])
        np.testing.assert_array_equal(found.histogram[row][1:-2], inner[:-1])
        assert found.histogram[row][-2] == inner[-1] - at_last_edge
    np.testing.assert_array_equal(
        found.status, np.bincount(records["status"], minlength=len(Status))
    )
    assert found.flags[0] == np.count_nonzero(records["flags"] & Flag.LATCHED)


def test_order_of_arrival_and_stops_change_no_bit():
    records = outcomes(3000)
    one, other = (fill(Accumulator(3000, block=128), records, seed).result() for seed in (1, 2))
    assert same(one, other)
    rng, sums = np.random.default_rng(3), Accumulator(3000, block=128)
    while (left := sums.remaining(4)).size:
        before = sums.taken
        sums.add(records[rng.permutation(left)[:200]])
        after = Accumulator(3000, block=128)
        after.restore(sums.state())
        assert after.taken == sums.taken == before + min(200, left.size)
        sums = after
    assert same(one, sums.result())
    changed = records.copy()
    changed["objective"][np.flatnonzero(records["status"] == 0)[0]] *= 1.0 + 1e-10
    assert not same(one, fill(Accumulator(3000, block=128), changed, 1).result())


def test_deviation_survives_a_large_mean():
    # A sum of squares minus a squared sum loses all digits here.
    records = outcomes(4096)
    records["status"] = Status.OK
    noise = np.random.default_rng(1).standard_normal(4096)
    records["objective"] = 1e8 + noise
    found = fill(Accumulator(4096, block=128), records, 1).result()
    np.testing.assert_allclose(found.deviation[0], np.std(records["objective"], ddof=1), rtol=1e-9)


def test_all_samples_failed_leaves_nan_not_zero():
    records = outcomes(300)
    records["status"] = Status.NOT_FINITE
    sums = fill(Accumulator(300, block=128), records, 1)
    content = statistics_dataset(sums)
    assert np.isnan(content["objective_mean"])
    assert np.isnan(content["objective_minimum"])
    failed = content["samples_by_status"].sel(outcome=int(Status.NOT_FINITE))
    assert int(failed) == np.sum(content["samples_by_status"]) == 300


def test_the_screen_says_what_the_deviation_is_known_to_and_what_flags_say():
    """Half-widths hold what 200 samples of many such sets come to; three quarters have a flag."""
    rng, hold = np.random.default_rng(4), 0
    for _ in range(100):
        records = outcomes(200)
        records["status"], records["flags"] = Status.OK, np.where(np.arange(200) < 150, 2, 0)
        records["objective"] = 3e-4 + 1e-5 * rng.standard_normal(200)
        found = statistics_dataset(fill(Accumulator(200, block=128), records, 1))
        first = screen_of(Content(Path("x"), {"statistics": found}))
        value, half = re.search(r"deviation ([\d.]+) ± ([\d.]+) µm", first.headline).groups()
        hold += abs(float(value) - 10.0) <= float(half)
    assert 85 <= hold <= 99
    assert first.doubt == "the contact model is outside its range"
    assert any("75 % of the samples: contact model outside" in one.text for one in first.trust)


def test_dataset_round_trip_and_raw_samples(tmp_path):
    ranks = alone()
    scene = scene_of(9000)
    output, raw = tmp_path / "statistics.nc", tmp_path / "raw"
    content = run_statistics(scene, output, ranks, raw=raw, options=QUIET).content.to_xarray()
    assert opened.read(output, "statistics").identical(content)
    kept = [opened.read(path, "samples") for path in sorted(raw.glob("samples-*.nc"))]
    objective = np.concatenate([part["objective"].values for part in kept])
    assert objective.size == 9000
    points = monte_carlo(scene).values
    expected = points[:, 0] + 10.0 * points[:, -1]
    np.testing.assert_array_equal(objective[np.isfinite(objective)], expected[points[:, 0] <= 0.4])
    np.testing.assert_allclose(content["objective_mean"], np.nanmean(objective), rtol=1e-13)
    again = run_statistics(scene, output, ranks, options=QUIET)  # done already: only read
    assert again.content.to_xarray().identical(content)
    with pytest.raises(InputError, match="another run"):
        run_statistics(scene, output, ranks, samples=8000, options=QUIET)


@pytest.mark.parametrize("name", ["versions", "processor"])
def test_statistics_go_on_only_with_the_same_versions_and_processor(tmp_path, monkeypatch, name):
    scene, output = scene_of(5000), tmp_path / "statistics.nc"
    run_statistics(scene, output, alone(), options=QUIET)
    program = provenance.program()  # what differs is shown, though it comes last in a long text
    monkeypatch.setattr(identity, "program", lambda: program | {name: f"{program[name]}, numba 0"})
    with pytest.raises(InputError, match=rf"another run \({name}: \S.* there, .*, numba 0 now"):
        run_statistics(scene, output, alone(), options=QUIET)


def test_latin_hypercubes_are_refused(tmp_path):
    scene = scene_of(100)
    hypercube = type(scene).model_validate(
        {**scene.resolved(), "study": {**scene.resolved()["study"], "method": "lhs"}}
    )
    with pytest.raises(InputError, match=r"study\.method"):
        run_statistics(hypercube, tmp_path / "out.nc", alone())


def launch(ranks: int, *arguments: object, **settings: str) -> tuple[int, str]:
    """Exit code and output of the streaming program on so many ranks."""
    return finish(start([*map(str, arguments)], ranks, (str(PROGRAM),), **settings), 120.0)


@pytest.mark.mpi
def test_bytes_do_not_depend_on_ranks_or_stops(tmp_path):
    files = [tmp_path / name for name in ("one.nc", "three.nc", "stopped.nc")]
    assert launch(0, files[0], 60000)[0] == 0
    assert launch(3, files[1], 60000)[0] == 0
    assert launch(2, files[2], 60000, 0.3)[0] == 3
    assert not files[2].exists()
    assert launch(0, files[2], 60000)[0] == 0
    assert files[0].read_bytes() == files[1].read_bytes() == files[2].read_bytes()
    left = {path.name for path in tmp_path.iterdir() if path.suffix != ".lock"}
    assert left == {path.name for one in files for path in (one, one.with_suffix(".timing.nc"))}


@pytest.mark.mpi
def test_an_error_of_a_rank_is_told_once_and_loses_nothing(tmp_path):
    place = tmp_path / "out.nc"
    code, told = launch(4, place, 60_000, FAILS="1")
    assert code == 1
    assert told.count("Traceback") == 1
    assert "on rank 1 of 4" in told
    assert launch(0, place, 60_000)[0] == 0
    assert launch(0, tmp_path / "whole.nc", 60_000)[0] == 0
    assert place.read_bytes() == (tmp_path / "whole.nc").read_bytes()


def test_samples_that_were_not_kept_are_not_promised(tmp_path):
    scene, output, raw = scene_of(9000), tmp_path / "out.nc", tmp_path / "raw"
    run_statistics(scene, output, alone(), options=QUIET)
    with pytest.raises(InputError, match="were not kept"):
        run_statistics(scene, output, alone(), raw=raw, options=QUIET)
    run_statistics(scene, tmp_path / "other.nc", alone(), raw=raw, options=QUIET)
    run_statistics(scene, output, alone(), raw=raw, options=QUIET)  # all there
    (raw / "samples-00000001.nc").unlink()  # as after a stop that left some
    with pytest.raises(InputError, match="were not kept"):
        run_statistics(scene, output, alone(), raw=raw, options=QUIET)


def peak(output: Path, samples: int) -> float:
    """Greatest memory of root in MB."""
    code, told = launch(0, output, samples)
    assert code == 0, told
    return float(told.split()[-1])


def test_memory_does_not_grow_with_the_samples(tmp_path):
    growth = peak(tmp_path / "many.nc", 200_000) - peak(tmp_path / "few.nc", 10_000)
    assert growth < 50.0

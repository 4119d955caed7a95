"""Expected improvement: closed forms against draws, noisy functions, constraints, catalogues, and when a study uses it."""

from types import SimpleNamespace

import moocore
import numpy as np
import opened
import pytest
from formula_study import contents, formula, on_two_ranks, scene_of

from hpcclear.ranks.boundary import alone
from hpcclear.scene.domain import box
from hpcclear.statistics.search import improvement
from hpcclear.statistics.search.improvement import Known, Space
from hpcclear.study import by_statistics, extent, tried

BOUNDS = np.array([[0.0, 1.0], [-2.0, 2.0]])


def test_gain_is_the_mean_of_what_draws_win():
    rng = np.random.default_rng(1)
    mean, deviation = rng.normal(size=6), np.array([0.0, 0.1, 0.5, 1.0, 2.0, 0.0])
    draws = mean + deviation * rng.standard_normal((400_000, 6))
    won = np.maximum(0.3 - draws, 0.0).mean(axis=0)
    np.testing.assert_allclose(improvement.gain(0.3, mean, deviation), won, atol=5e-3)


def test_volume_is_the_mean_of_the_area_that_draws_add():
    rng = np.random.default_rng(2)
    front = np.array([[0.0, 1.0], [0.3, 0.4], [1.0, 0.0], [0.8, 0.8]])
    mean = np.array([[0.2, 0.3], [0.9, 0.9], [-0.2, 0.5]])
    deviation = np.array([[0.1, 0.2], [0.3, 0.3], [0.0, 0.1]])
    found = improvement.volume(front, mean, deviation)
    reference = np.full(2, 1.1)
    before = moocore.hypervolume(front, reference)
    for k in range(3):
        draws = mean[k] + deviation[k] * rng.standard_normal((3000, 2))
        areas = [moocore.hypervolume(np.vstack([front, one]), reference) - before for one in draws]
        assert found[k] == pytest.approx(np.mean(areas), abs=4 * np.std(areas) / 3000**0.5 + 1e-9)


def bowl(x):
    """Least at (0.3, 0.5), 0; the other objective is the first variable."""
    return (x[:, 0] - 0.3) ** 2 + 0.1 * (x[:, 1] - 0.5) ** 2


def searched(space, rounds, rng, error=0.01, excess=None, count=4):
    designs = space.snap(BOUNDS[:, 0] + rng.random((10, 2)) * (BOUNDS[:, 1] - BOUNDS[:, 0]))

    def values(x):
        return np.column_stack([bowl(x) + error * rng.standard_normal(len(x)), x[:, 0]])

    table = values(designs)
    for _ in range(rounds):
        errors = np.tile([error, 0.0], (len(designs), 1))
        known = Known(designs, table, errors, None if excess is None else excess(designs))
        more = improvement.proposals(known, space, count, rng)
        designs, table = np.vstack([designs, more]), np.vstack([table, values(more)])
    errors = np.tile([error, 0.0], (len(designs), 1))
    return Known(designs, table, errors, None if excess is None else excess(designs))


def space_of(snap=lambda x: x):
    return Space(BOUNDS, np.eye(2), np.eye(2)[0], (None, lambda x: x[:, 0]), snap)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_least_of_a_noisy_function_is_found_below_its_noise(seed):
    """34 values with errors of 0.01: a believed end is within 0.004 of the least, and the other end is exact."""
    rng = np.random.default_rng(seed)
    known = searched(space_of(), 6, rng)
    assert ((known.designs >= BOUNDS[:, 0]) & (known.designs <= BOUNDS[:, 1])).all()
    ends = improvement.finalists(known, space_of(), 8, rng)
    assert len(ends) <= 8
    assert bowl(ends).min() < 0.004
    assert ends[:, 0].min() < 1e-3


def steps(x):
    """Flat, but for a slope to the left and a narrow valley far from it."""
    far = (x[:, 0] - 0.8) ** 2 + (x[:, 1] / 4.0 - 0.2) ** 2
    return 0.1 * x[:, 0] - 0.5 * np.exp(-far / 0.02)


def test_what_the_first_designs_missed_is_found():
    """Twelve designs show a slope. Where it is lowest a model that is sure of it would place all others."""
    missed, space = 0, Space(BOUNDS, np.eye(1), np.ones(1), (None,))
    for seed in range(6):
        rng = np.random.default_rng([9, seed])
        designs = BOUNDS[:, 0] + rng.random((12, 2)) * (BOUNDS[:, 1] - BOUNDS[:, 0])
        designs = designs[steps(designs) > 0.0]
        noise = 0.01 * rng.standard_normal((60, 1))
        for _ in range(14):
            values = steps(designs)[:, None] + noise[: len(designs)]
            known = Known(designs, values, np.full(values.shape, 0.01))
            designs = np.vstack([designs, improvement.proposals(known, space, 3, rng)])
        missed += bool(steps(designs).min() > -0.3)
    assert missed == 0


def test_what_may_be_won_shrinks_with_what_is_known():
    rng = np.random.default_rng(10)
    few, many = (searched(space_of(), rounds, rng) for rounds in (0, 8))
    (first, _), (last, least) = (improvement.hopes(one, space_of(), rng) for one in (few, many))
    assert first.shape == (2,)
    assert last[1] <= 1e-9  # its least is known and taken
    assert 0.0 <= last[0] < 0.5 * first[0]
    assert abs(least[0]) < 0.01


def test_designs_that_only_may_be_the_best_are_verified_too():
    """Beside the best one of those evaluated and of all two others, apart from these and in doubt."""
    rng = np.random.default_rng(12)
    designs = BOUNDS[:, 0] + rng.random((30, 2)) * (BOUNDS[:, 1] - BOUNDS[:, 0])
    values = bowl(designs)[:, None] + 0.05 * rng.standard_normal((30, 1))
    known = Known(designs, values, np.full((30, 1), 0.05))
    space = Space(BOUNDS, np.eye(1), np.ones(1), (None,))
    ends = improvement.finalists(known, space, 6, rng)
    fresh = [one for one in ends if not (one == designs).all(axis=1).any()]
    assert len(fresh) == 3
    assert bowl(np.array(fresh)).max() < np.median(bowl(designs))


def test_constraints_are_kept():
    rng = np.random.default_rng(5)
    known = searched(space_of(), 5, rng, excess=lambda x: 0.6 - x[:, 0])
    ends = improvement.finalists(known, space_of(), 8, rng)
    assert (ends[:, 0] > 0.55).all()
    assert ends[:, 0].min() < 0.66


def test_only_designs_of_a_catalogue_are_asked_for():
    def snap(x):
        return np.column_stack([np.round(x[:, 0] * 10.0) / 10.0, x[:, 1]])

    known = searched(space_of(snap), 4, np.random.default_rng(6))
    np.testing.assert_allclose(known.designs[:, 0] * 10.0, np.round(known.designs[:, 0] * 10.0))


# -- a study ----------------------------------------------------------------------------------------

STUDY = """
[variables]
m3 = { range = [0.07, 0.28] }
[cases.robust]
random = ["C"]
objectives = [{ statistic = "quantile", level = 0.9 }, { formula = "0 - m2 - m3" }]
[surrogate]
of = "statistics"
[verification]
designs = 4
infill_rounds = 1
infill_designs = 6
infill_samples = 64
most_samples = 512
"""


def study():
    return scene_of(STUDY)


@pytest.fixture(scope="module")
def done(carried_out):
    return carried_out(study())


def test_statistics_are_searched_by_name_or_where_f_is_rough():
    asked = study().required_study
    assert by_statistics.applies(asked, 1.0)
    for of, r2, expected in (("f", 0.1, False), (None, 0.5, True), (None, 0.95, False), (None, np.nan, True)):  # fmt: skip
        scene = study().with_({"study.surrogate.of": of})
        assert by_statistics.applies(scene.required_study, r2) is expected


def test_a_search_by_statistics_says_what_another_design_may_win():
    """Few designs with large errors leave much to be won; those of a known function, its least among them, nothing."""
    scene = study()
    run = SimpleNamespace(scene=scene, study=scene.required_study)
    run.rng = lambda *words: np.random.default_rng(13)
    region = tried.bounds(run, ("m2", "m3"))
    hoped = "another design is expected to lower the least 90th percentile by"
    for count, error, text in ((24, 0.3, hoped), (120, 1e-6, "")):
        unit = np.random.default_rng(14).random((count, 2))
        unit[:4] = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]]
        where = region[:, 0] + unit * np.ptp(region, axis=1)
        noise = error * np.random.default_rng(15).standard_normal(count)
        values = np.column_stack([1.0 + unit[:, 0] + noise, -where.sum(axis=1)])
        one = tried.Tried(
            ("m2", "m3"), where, values, np.full(count, -np.inf), np.full((count, 2), error)
        )
        assert by_statistics.left(run, "robust", [one]).startswith(text)
        assert bool(by_statistics.left(run, "robust", [one])) is bool(text)


def test_a_search_by_statistics_ends_at_the_front(done):
    """f rises with both masses: the front ends at their bounds; the swarm's own designs are not verified."""
    found = opened.read(done / "verification.nc", "verification")
    alpha, beta = (found.sel(design=f"robust {end}") for end in ("alpha", "beta"))
    region = box(study(), ("m2", "m3"))
    np.testing.assert_allclose([float(beta[n]) for n in ("m2", "m3")], region.upper, rtol=1e-3)
    assert float(alpha["first_true"]) == float(found["first_true"].min())
    assert not any("averaged" in name for name in found["design"].to_numpy())
    counted = extent.samples_of(study())
    samples = opened.read(done / "samples.nc", "samples")
    assert samples.sizes["sample"] < sum(counted.values())


@pytest.mark.nightly
def test_a_search_by_statistics_that_is_stopped_ends_with_the_same_bytes(done, tmp_path, monkeypatch):  # fmt: skip
    formula.replace_dynamics(monkeypatch.setattr)
    assert formula.run_in_pieces(study(), str(tmp_path / "out"), alone()) > 4
    assert contents(tmp_path / "out") == contents(done)


@pytest.mark.full
@pytest.mark.mpi
def test_a_search_by_statistics_has_the_same_bytes_on_two_ranks(done, tmp_path):
    """``python -m pytest tests/test_improvement.py -m full``"""
    assert contents(on_two_ranks(study(), tmp_path)) == contents(done)

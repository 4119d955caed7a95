"""Expected improvement: closed forms against draws, noisy functions, constraints, catalogues, and when a study uses it."""

from dataclasses import replace
from types import SimpleNamespace

import moocore
import numpy as np
import opened
import pytest
from commands import contents
from formula_study import formula, on_ranks, scene_of

from hpcclear.ranks.boundary import alone
from hpcclear.scene.domain import box
from hpcclear.statistics.random.replicates import quantile
from hpcclear.statistics.search import improvement
from hpcclear.statistics.search.beliefs import Beliefs, Known, Space
from hpcclear.study import stages, truth
from hpcclear.study.case_search import CaseSearch
from hpcclear.study.guesses import Guesses
from hpcclear.study.optimisation import Choice
from hpcclear.study.simulated import BETTER, Simulated

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


def known_of(designs, values, error, excess=None):
    """Designs with objectives of known errors; `excess` of a constraint that is known exactly."""
    none = np.empty((len(designs), 0))
    broken = none if excess is None else excess(designs)[:, None]
    errors = np.tile([error, 1e-9][: values.shape[1]], (len(designs), 1))
    shifts = np.zeros((values.shape[1], len(designs), 1))
    return Known(designs, values, errors, broken, np.full(broken.shape, 1e-3), shifts)


def space_of(snap=lambda x: x, constraints=0):
    return Space(BOUNDS, np.eye(2), (None, lambda x: x[:, 0]), np.zeros(constraints), snap)


def searched(space, rounds, rng, error=0.01, excess=None):
    """What is believed after so many rounds of four designs, by turns of the least of both objectives and of the area."""
    designs = space.snap(BOUNDS[:, 0] + rng.random((10, 2)) * (BOUNDS[:, 1] - BOUNDS[:, 0]))

    def values(x):
        return np.column_stack([bowl(x) + error * rng.standard_normal(len(x)), x[:, 0]])

    table = values(designs)
    for _ in range(rounds):
        beliefs = Beliefs(known_of(designs, table, error, excess), space, rng)
        more = []
        for direction in (*space.directions, None, space.directions[0]):
            point, worth = improvement.proposed(beliefs, direction)
            if worth > 0.0:
                beliefs.take(point)
                more.append(point)
        designs = np.vstack([designs, *more])
        table = np.vstack([table, values(designs[len(table) :])])
    return Beliefs(known_of(designs, table, error, excess), space, rng)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_least_of_a_noisy_function_is_found_below_its_noise(seed):
    """34 values with errors of 0.01: the believed end is within 0.004 of the least, and the other end is exact."""
    found = searched(space_of(), 6, np.random.default_rng(seed))
    designs = found.known.designs
    assert ((designs >= BOUNDS[:, 0]) & (designs <= BOUNDS[:, 1])).all()
    assert bowl(designs[[found.believed[:, 0].argmin()]])[0] < 0.004
    assert bowl(improvement.expected(found, np.eye(2)[0])[None])[0] < 0.004
    assert designs[:, 0].min() < 1e-3


def steps(x):
    """Flat, but for a slope to the left and a narrow valley far from it."""
    far = (x[:, 0] - 0.8) ** 2 + (x[:, 1] / 4.0 - 0.2) ** 2
    return 0.1 * x[:, 0] - 0.5 * np.exp(-far / 0.02)


def test_what_the_first_designs_missed_is_found():
    """Twelve designs show a slope. Where it is lowest a model that is sure of it would place all others."""
    missed = 0
    space = Space(BOUNDS, np.eye(1), (None,), np.empty(0))
    for seed in range(6):
        rng = np.random.default_rng([9, seed])
        designs = BOUNDS[:, 0] + rng.random((12, 2)) * (BOUNDS[:, 1] - BOUNDS[:, 0])
        designs = designs[steps(designs) > 0.0]
        noise = 0.01 * rng.standard_normal((80, 1))
        for turn in range(48):
            values = steps(designs)[:, None] + noise[: len(designs)]
            beliefs = Beliefs(known_of(designs, values, 0.01), space, rng)
            far = turn % improvement.EXPLORED == 0
            point, _ = improvement.farthest(beliefs) if far else improvement.proposed(beliefs, np.ones(1))  # fmt: skip
            designs = np.vstack([designs, point])
        missed += bool(steps(designs).min() > -0.3)
    assert missed == 0


def steps_apart(point, others):
    """Least distance of a design from others, over the ranges."""
    return (abs(others - point) / np.ptp(BOUNDS, axis=1)).max(axis=1).min()


SHAPES = {
    "parabola": lambda x: 1e3 * bowl(x), "constant": lambda x: 0.0 * x[:, 0] + 7.0,
    "offset": lambda x: 1e6 + x[:, 0], "steep": lambda x: np.exp(8.0 * x[:, 0]),
    "step": lambda x: np.where(x[:, 0] > 0.5, 1e5, 1.0),
}  # fmt: skip


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize(("error", "count"), [(0.0, 150), (1e-6, 150), (1.0, 150), (0.0, 12)])
def test_draws_are_had_of_any_values(monkeypatch, shape, error, count):
    """Known exactly and in number, designs have variances of round-off; draws of them have their size and no other."""
    rng = np.random.default_rng(3)
    designs = BOUNDS[:, 0] + rng.random((count, 2)) * (BOUNDS[:, 1] - BOUNDS[:, 0])
    known = known_of(designs, SHAPES[shape](designs)[:, None], error)
    beliefs = Beliefs(known, Space(BOUNDS, np.eye(1), (None,), np.empty(0)), rng)
    points, loss = improvement.drawn(beliefs, np.ones(1), 3)
    assert len(points) == 3
    largest = beliefs.variances(np.vstack([designs, points])).max() ** 0.5
    assert 0.0 <= loss < 10.0 * (largest + beliefs.models[0].rest.scale)
    for row, point in enumerate(points):
        others = np.vstack([designs, np.delete(points, row, axis=0)])
        assert steps_apart(point, others) > improvement.NEAR
    monkeypatch.setattr(improvement, "MOST", 1)
    lone, _ = improvement.drawn(beliefs, np.ones(1), 3)
    assert (beliefs.means(lone) <= beliefs.believed.min()).all()


@pytest.mark.parametrize("level", [0.0, 1.0, 2868.776])
def test_a_trend_that_is_flat_but_for_round_off_is_none(level):
    """A surrogate of rough values is a constant: a slope of its last bits left no digit of the values."""
    rng = np.random.default_rng(7)
    designs = BOUNDS[:, 0] + rng.random((30, 2)) * (BOUNDS[:, 1] - BOUNDS[:, 0])
    values = 3000.0 + 1000.0 * designs[:, :1]

    def flat(points):
        return level * (1.0 + 2e-16 * np.round(np.sin(1e3 * points[:, 1])))

    space = Space(BOUNDS, np.eye(1), (None,), np.empty(0), trends=(flat,))
    beliefs = Beliefs(known_of(designs, values, 10.0), space, rng)
    np.testing.assert_allclose(beliefs.believed, values, atol=60.0)


def test_more_simulations_are_worth_most_where_they_may_change_the_choice():
    """Of three designs with large errors two compete; what is known exactly, or is out of question, is worth nothing; nor is
    what all designs have in common, of which a further one tells no more."""
    rng, space = np.random.default_rng(4), Space(BOUNDS, np.eye(1), (None,), np.empty(0))
    designs = np.vstack([np.linspace(0.0, 1.0, 8), np.linspace(-2.0, 2.0, 8)]).T
    values = np.array([1.0, 1.02, 3.0, 3.1, 3.2, 3.1, 3.0, 2.9])[:, None]
    known = known_of(designs, values, 0.3)
    shared = replace(known, shifts=np.tile([1.0, -1.0, 1.0, -1.0], (1, 8, 1)))
    each = [Beliefs(one, space, rng) for one in (known, known_of(designs, values, 1e-9), shared)]
    worth, exact, common = (improvement.replications(one, np.ones(1)) for one in each)
    assert (worth >= 0.0).all()
    assert set(np.argsort(worth)[-2:].tolist()) == {0, 1}
    assert exact.max() < 0.01 * worth.max()
    assert common.max() < 0.5 * worth.max()
    straight, own = replace(shared, values=designs[:, :1]), rng.standard_normal((1, 8, 4))
    same, apart = (
        Beliefs(replace(straight, shifts=one), space, rng) for one in (shared.shifts, own)
    )
    assert same.noise < 0.5 * apart.noise


def test_what_flatters_a_region_is_not_believed_of_it():
    """Designs of one half share an error, which twelve replicates show: no step of f is seen in it."""
    rng = np.random.default_rng(9)
    designs = BOUNDS[:, 0] + rng.random((40, 2)) * (BOUNDS[:, 1] - BOUNDS[:, 0])
    truth, left = 0.1 * designs[:, :1], designs[:, :1] < 0.5
    known = known_of(designs, truth - 0.3 * left, 0.01)
    shift, errors = rng.standard_normal(12), np.where(left, 0.3, 0.01)
    shared = replace(known, errors=errors, shifts=(errors * shift / np.linalg.norm(shift))[None])
    space = Space(BOUNDS, np.eye(1), (None,), np.empty(0))
    for one, off in ((known, 0.3), (shared, 0.0)):
        steps = Beliefs(one, space, rng).believed - truth
        assert abs(steps[~left].mean() - steps[left].mean() - off) < 0.05


def test_a_design_is_simulated_again_where_a_new_one_would_share_its_error():
    """Of two groups far apart one has an error in common: a new design within it would say no more, one between them would."""
    rng, none = np.random.default_rng(11), np.empty((16, 0))
    designs = np.vstack([rng.random((8, 2)) * 0.1, 0.9 + rng.random((8, 2)) * 0.1])
    left = np.arange(16)[:, None] < 8
    errors, shift = np.where(left, 0.3, 1e-6), rng.standard_normal(12)
    known = Known(designs, 1.0 * left, errors, none, none, (errors * shift)[None])
    beliefs = Beliefs(known, Space(BOUNDS, np.eye(1), (None,), np.empty(0)), rng)
    case = SimpleNamespace(_space=beliefs.space, _longer=lambda row: True)
    assert CaseSearch._alike(case, beliefs, designs[0] + 0.02, np.ones(1)) in range(8)
    assert CaseSearch._alike(case, beliefs, np.array([0.5, -1.5]), np.ones(1)) is None


def test_constraints_are_kept():
    found = searched(space_of(constraints=1), 5, np.random.default_rng(5), excess=lambda x: 0.6 - x[:, 0])  # fmt: skip
    best = improvement.expected(found, np.eye(2)[0])
    assert 0.58 < best[0] < 0.66
    assert (found.known.designs[found.allowed][:, 0] > 0.55).all()
    safer = improvement.expected(found, np.eye(2)[0], np.array([0.2]))
    assert safer[0] > best[0] + 0.1


def test_where_nothing_keeps_the_constraints_designs_go_towards_them():
    rng = np.random.default_rng(5)
    designs = BOUNDS[:, 0] + rng.random((20, 2)) * (BOUNDS[:, 1] - BOUNDS[:, 0])
    values = np.column_stack([bowl(designs), designs[:, 0]])
    known = known_of(designs, values, 0.01, lambda x: 5.0 + x[:, 1])
    beliefs = Beliefs(known, space_of(constraints=1), rng)
    assert not beliefs.allowed.any()
    point, worth = improvement.proposed(beliefs, np.eye(2)[0])
    assert worth > 0.0
    assert point[1] < designs[:, 1].min()


def test_only_designs_of_a_catalogue_are_asked_for():
    space = space_of(lambda x: np.column_stack([np.round(10.0 * x[:, 0]) / 10.0, x[:, 1]]))
    designs = searched(space, 4, np.random.default_rng(6)).known.designs
    np.testing.assert_allclose(designs[:, 0] * 10.0, np.round(designs[:, 0] * 10.0))


STUDY = """
[variables]
m3 = { range = [0.07, 0.28] }
[cases.robust]
random = ["C"]
objectives = [{ statistic = "quantile", level = 0.9 }, { formula = "0 - m2 - m3" }]
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


def test_a_search_ends_at_the_front(done):
    """f rises with both masses: the front ends at their bounds; designs of the swarm have no names of their own."""
    found = opened.read(done / "verification.nc", "verification")
    alpha, beta = (found.sel(design=f"robust {end}") for end in ("alpha", "beta"))
    region = box(study(), ("m2", "m3"))
    np.testing.assert_allclose([float(beta[n]) for n in ("m2", "m3")], region.upper, rtol=1e-3)
    assert float(alpha["first_true"]) <= 1.005 * float(found["first_true"].min())  # or lighter
    assert not any("averaged" in name for name in found["design"].to_numpy())
    samples = opened.read(done / "samples.nc", "samples").sizes["sample"]
    assert samples < sum(stages.samples_of(study()).values())


def simulated(f, length, guesses=()):
    """Two designs, the second with f half a unit higher and few points."""
    run = SimpleNamespace(study=study().required_study)
    choice = Choice("", "robust", {"m2": 0.2, "m3": 0.1})
    one = Simulated(run, run.study.cases[0], guesses, [choice] * 2)
    one.made = [np.stack([f, 0.0 * f]), np.stack([f + 0.5, 0.0 * f])[..., :length]]
    return one


def test_scatter_that_the_surrogate_explains_needs_no_simulations():
    """f is the surrogate's and a constant: few points tell what all would, with the errors of the surrogate's own points."""
    f = np.random.default_rng(8).normal(1.0, 0.1, (16, 256))
    guesses = SimpleNamespace(of=lambda choice, length: np.stack([f, 0.0 * f]), length=256)
    (few, errors), (all_, _) = simulated(f, 2, guesses).of(1, 2)[0], simulated(f, 256).of(1, 256)[0]
    np.testing.assert_allclose(few, all_, rtol=1e-9)
    assert errors[0] < 0.2 * simulated(f, 2).of(1, 2)[0][1, 0]


def points_of(run, choice, *levels):
    """Points of a search by replicate, (16, n, inputs), in steps from one length to the next."""
    made = [truth.scattered(run, choice, size, "search", first).values for first, size in levels]
    return np.concatenate([one.reshape(16, -1, one.shape[1]) for one in made], axis=1)


def test_replicates_of_a_search_are_parts_of_two_long_sequences():
    """Also as they grow, and where the surrogate averages them."""
    filled = lambda names, values, checked: SimpleNamespace(names=names, values=values)  # noqa: E731
    run = SimpleNamespace(
        study=study().required_study, scene=study(), simulations=SimpleNamespace(filled=filled)
    )
    choice = Choice("", "robust", {"m2": 0.2, "m3": 0.1})
    steps = [(0, 2), (2, 2), (4, 4)]
    for count, those in ((2, steps[:1]), (8, steps)):
        clearances = points_of(run, choice, *those)[..., -1].reshape(2, -1)
        strata = np.sort((clearances - 3e-4) / 7e-4 * 8 * count).astype(int)
        np.testing.assert_array_equal(strata, [range(8 * count)] * 2)
    at = run.study.models[-1].index("C")
    model = SimpleNamespace(lower=-np.inf, upper=np.inf, predict=lambda places: places[:, at])
    found = Guesses(run, run.study.cases[0], [model], 8).of(choice, 8)
    own = points_of(run, choice, *steps)[..., -1]
    assert np.corrcoef(found[0].ravel(), own.ravel())[0, 1] > 0.999999


def test_errors_are_of_sequences_and_not_of_their_parts():
    """Parts differ by where they lie, of which nothing is left in the whole; of noise nothing is averaged out."""
    places = np.tile((np.arange(128) + 0.5) / 128, 2).reshape(16, 16)
    noise = np.random.default_rng(5).random((40, 16, 16))

    def left(f):
        return simulated(f, 16).of(0, 16)[0][1, 0] / quantile(f, 0.9, 0.95).error

    assert left(places) == pytest.approx(BETTER)
    assert 0.6 < np.mean([left(f) for f in noise]) < 0.9  # of two that never say more than 1


def test_first_points_that_designs_were_chosen_for_say_nothing_of_the_bias():
    f = np.random.default_rng(3).lognormal(0.0, 1.0, (16, 1024))  # few say too much
    plain, chosen = (simulated(one, 2) for one in (f, np.where(np.arange(1024) < 2, 0.5 * f, f)))
    moved = [one.known()[1, 0, 0] - one.of(1, 2)[0][0, 0] for one in (plain, chosen)]
    assert moved[1] < 0.0
    assert moved[0] == pytest.approx(moved[1])


@pytest.mark.nightly
def test_a_search_that_is_stopped_ends_with_the_same_bytes(done, tmp_path, monkeypatch):  # fmt: skip
    formula.replace_dynamics(monkeypatch.setattr)
    assert formula.run_in_pieces(study(), str(tmp_path / "out"), alone()) > 4
    assert contents(tmp_path / "out") == contents(done)


@pytest.mark.full
@pytest.mark.mpi
def test_a_search_has_the_same_bytes_on_two_ranks(done, tmp_path):
    """``python -m pytest tests/test_improvement.py -m full``"""
    assert contents(on_ranks(study(), tmp_path)) == contents(done)

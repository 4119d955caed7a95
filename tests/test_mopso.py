"""The swarm against known fronts, brute force and its own promises."""

import itertools

import moocore
import numpy as np
import pytest
from margins import at_least, at_most

from hpcclear.statistics.search.asking import SwarmSettings
from hpcclear.statistics.search.mopso import ParticleSwarm, minimise
from hpcclear.statistics.search.pareto import Archive, best_subset, cut, hypervolume, relative_gain


def zdt1(x):
    g = 1 + 9 * x[:, 1:].mean(axis=1)
    return np.stack([x[:, 0], g * (1 - np.sqrt(x[:, 0] / g))], axis=1)


def zdt2(x):
    g = 1 + 9 * x[:, 1:].mean(axis=1)
    return np.stack([x[:, 0], g * (1 - (x[:, 0] / g) ** 2)], axis=1)


def zdt3(x):
    g = 1 + 9 * x[:, 1:].mean(axis=1)
    r = x[:, 0] / g
    return np.stack([x[:, 0], g * (1 - np.sqrt(r) - r * np.sin(10 * np.pi * x[:, 0]))], axis=1)


def dtlz2(x):
    g = 1 + ((x[:, 2:] - 0.5) ** 2).sum(axis=1)
    a, b = x[:, 0] * np.pi / 2, x[:, 1] * np.pi / 2
    return np.stack([g * np.cos(a) * np.cos(b), g * np.cos(a) * np.sin(b), g * np.sin(a)], axis=1)


def unit(dimensions):
    return [(0.0, 1.0)] * dimensions


def brute_force_front(values):
    return np.array(
        [not any((b <= a).all() and (b < a).any() for b in values) for a in values], dtype=bool
    )


def tell(swarm, values, violations=None):
    values = np.asarray(values, float)
    values = values[:, None] if values.ndim == 1 else values
    broken = np.zeros(len(values)) if violations is None else np.asarray(violations)
    swarm.tell(swarm.ask(), values, broken)


def run(function, dimensions, seed, iterations, **options):
    rng = np.random.default_rng(seed)
    return minimise(function, unit(dimensions), iterations=iterations, rng=rng, **options)


PROBLEMS = {
    "zdt1": (zdt1, 30, 0.8700),
    "zdt2": (zdt2, 30, 0.5379),
    "zdt3": (zdt3, 30, 1.3265),
    "dtlz2": (dtlz2, 12, 0.7290),
}


@pytest.mark.full
@pytest.mark.parametrize("name", PROBLEMS)
def test_full_budget_hypervolume(name):
    function, dimensions, least = PROBLEMS[name]
    reached = []
    for seed in range(1, 6):
        front = run(function, dimensions, seed, 250)
        assert len(front.points) == 100
        reached.append(moocore.hypervolume(front.values, 1.1))
    assert np.median(reached) >= least
    assert min(reached) >= 0.99 * least  # no seed collapsed


@pytest.mark.parametrize(
    ("name", "least"), [("zdt1", 0.868), ("zdt2", 0.534), ("zdt3", 1.320), ("dtlz2", 0.725)]
)
def test_reduced_budget_hypervolume(name, least, shift):
    """One front of zdt2 in eighty has a gap, and 2 % less; two of three have not."""
    function, dimensions, _ = PROBLEMS[name]
    fronts = [run(function, dimensions, seed + shift, 100) for seed in (0, 1, 2)]
    reached = [moocore.hypervolume(front.values, 1.1) for front in fronts]
    at_least(np.median(reached), least)
    at_least(min(reached), 0.95 * least)


def test_front_is_the_closed_form(shift):
    front = run(zdt1, 30, 3 + shift, 100)
    f1 = np.linspace(0, 1, 500)
    known = np.stack([f1, 1 - np.sqrt(f1)], axis=1)
    at_most(moocore.igd_plus(front.values, known), 4e-3)
    assert np.allclose(zdt1(front.points), front.values, rtol=0, atol=1e-14)


def test_velocity_follows_equations_22_and_23():
    # one objective, so P_g is known: the archive's only point. With three variables the two pulls
    # span a plane, and the change of velocity stays in it only if r1 and r2 are scalars
    settings = SwarmSettings(mutation_share=0.0, particles=20)
    target = np.array([0.3, 0.6, 0.8])
    swarm = ParticleSwarm(unit(3), 5, np.random.default_rng(0), settings=settings)
    for _ in range(3):
        before, speed, iteration = swarm.ask(), swarm._velocities.copy(), swarm.iteration
        tell(swarm, ((before - target) ** 2).sum(axis=1))
        leader = swarm._archive.positions[0]
        weight = 1.2 - (iteration + 1) * 1.1 / 5
        inside = np.all((swarm._positions > 0) & (swarm._positions < 1), axis=1)
        free = inside & np.all(np.abs(swarm._velocities) < 0.5, axis=1)
        assert free.sum() >= 5
        for i in np.flatnonzero(free):
            rest = swarm._velocities[i] - weight * speed[i]
            pulls = np.stack([swarm._personal_positions[i] - before[i], leader - before[i]], axis=1)
            shares, *_ = np.linalg.lstsq(pulls, rest, rcond=1e-10)
            assert np.allclose(pulls @ shares, rest, atol=1e-12)
            assert np.all(shares >= -1e-9)
            assert np.all(shares <= 1.8 + 1e-9)


@pytest.mark.parametrize("function", [zdt3, dtlz2])
def test_archive_never_holds_dominated_points_and_keeps_its_size(function):
    settings = SwarmSettings(archive_capacity=60)
    swarm = ParticleSwarm(unit(8), 40, np.random.default_rng(1), settings=settings)
    best = np.full(3, np.inf)
    while swarm.iteration < swarm.iterations:
        values = function(swarm.ask())
        tell(swarm, values)
        archive = swarm._archive.values
        assert brute_force_front(archive).all()
        assert len(archive) <= 60
        best = np.minimum(best[: values.shape[1]], values.min(axis=0))
        assert np.array_equal(archive.min(axis=0), best)  # alpha and beta are never lost


def test_full_archive_drops_the_most_crowded():
    first = np.array([0.0, 0.3, 0.31, 0.6, 1.0])
    archive = Archive(4, np.empty((0, 1)), np.empty((0, 0)))
    archive.add(first[:, None], np.stack([first, 1000 * (1 - first)], axis=1))
    assert archive.positions[:, 0].tolist() == [0.0, 0.3, 0.6, 1.0]  # 0.31 is nearer to 0.6
    assert np.allclose(archive.loneliness(), np.sqrt(2) * np.array([0.3, 0.3, 0.3, 0.4]))


@pytest.mark.parametrize("objectives", [2, 3])
def test_cut_drops_the_least_hypervolume_contribution(objectives):
    values = np.abs(np.random.default_rng(7).normal(size=(25, objectives))) + 1e-3
    values /= np.linalg.norm(values, axis=1)[:, None]
    low, extent = values.min(axis=0), np.ptp(values, axis=0)
    scaled = (values - low) / extent
    kept = list(range(25))
    while len(kept) > 8:
        whole = hypervolume(scaled[kept], np.full(objectives, 1.1))
        loss = [
            np.inf
            if i in values.argmin(axis=0)
            else whole - hypervolume(scaled[[j for j in kept if j != i]], np.full(objectives, 1.1))
            for i in kept
        ]
        kept.pop(int(np.argmin(loss)))
    assert cut(values, 8).tolist() == kept


@pytest.mark.parametrize("size", [2, 3, 5, 11])
def test_best_subset_is_the_best_of_all_subsets(size):
    first = np.sort(np.random.default_rng(8).random(11))
    values = np.stack([first, 40.0 * (1.0 - first**3)], axis=1)[::-1].copy()
    reference = np.array([1.1, 44.0])
    ends = {int(row) for row in values.argmin(axis=0)}
    sets = [rows for rows in itertools.combinations(range(11), size) if ends <= set(rows)]
    reached = [hypervolume(values[list(rows)], reference) for rows in sets]
    assert best_subset(values, size).tolist() == list(sets[int(np.argmax(reached))])


def test_hypervolume_of_known_sets():
    assert hypervolume(np.array([[0.25, 0.5]]), np.ones(2)) == pytest.approx(0.375, abs=1e-15)
    six = np.full((1, 6), 0.5)
    assert hypervolume(six, np.ones(6)) == pytest.approx(0.5**6, rel=1e-3)
    assert hypervolume(np.empty((0, 2)), np.ones(2)) == 0.0
    assert np.isnan(relative_gain(np.empty((0, 2)), np.ones((1, 2))))
    # one objective, small numbers: half the value left to win is half of what counts
    assert relative_gain(np.array([[2.05e-4]]), np.array([[2e-4]])) == pytest.approx(0.025 / 1.1)


def osy(x):
    """Osyczka and Kundu's problem: six constraints, a front of five pieces on their borders."""
    a, b, c, d, e, f = x.T
    first = -(25 * (a - 2) ** 2 + (b - 2) ** 2 + (c - 1) ** 2 + (d - 4) ** 2 + (e - 1) ** 2)
    kept = [
        a + b - 2,
        6 - a - b,
        2 - b + a,
        2 - a + 3 * b,
        4 - (c - 3) ** 2 - d,
        (e - 3) ** 2 + f - 4,
    ]
    violations = np.maximum(-np.stack(kept, axis=1) / [2, 6, 2, 2, 4, 4], 0.0)
    return np.stack([first, (x**2).sum(axis=1)], axis=1), violations


def test_no_piece_of_the_front_of_osy_is_lost(shift):
    """16 770 for the reference (0, 80) is the whole front; two thirds of it is what one of five pieces alone comes to.

    With steps along the front half of all searches reach 0.998 of it, one in a hundred or two 0.985; without them 0.991
    and 0.962.
    """
    bounds = [[0, 10], [0, 10], [1, 5], [0, 6], [1, 5], [0, 10]]
    reached = []
    for seed in (0, 3, 5, 7, 10):
        front = minimise(osy, bounds, iterations=250, rng=np.random.default_rng(seed + shift))
        reached.append(hypervolume(front.values, np.array([0.0, 80.0])) / 16770)
        values, violations = osy(front.points)
        assert (violations == 0.0).all()
        np.testing.assert_array_equal(values, front.values)
    at_least(min(reached), 0.95)
    at_least(np.median(reached), 0.9955)


def tnk(x):
    """Tanaka's problem: the objectives are the variables, and the front is a border of the feasible region in pieces."""
    first, second = x.T
    ring = first**2 + second**2 - 1 - 0.1 * np.cos(16 * np.arctan2(first, second))
    disc = 0.5 - (first - 0.5) ** 2 - (second - 0.5) ** 2
    return x, np.maximum(-np.stack([ring, disc], axis=1), 0.0)


def test_front_on_a_curved_border_of_the_feasible_region(shift):
    """Of the closed form's hypervolume half of all searches reach 0.9932, with crossover alone 0.9902."""
    angle = np.linspace(0.0, np.pi / 2, 20_001)
    radius = np.sqrt(1 + 0.1 * np.cos(16 * angle))
    border = np.stack([radius * np.sin(angle), radius * np.cos(angle)], axis=1)
    known = border[tnk(border)[1][:, 1] == 0.0]
    worst = np.full(2, 1.1)
    whole = hypervolume(known, worst)
    reached = []
    for seed in range(9):
        rng = np.random.default_rng(seed + shift)
        front = minimise(tnk, [[1e-12, np.pi]] * 2, iterations=250, rng=rng)
        assert (tnk(front.points)[1] == 0.0).all()
        reached.append(hypervolume(front.values, worst) / whole)
    at_least(np.median(reached), 0.9918)


def test_violations_lead_to_the_feasible_region_when_none_is_known(shift):
    def far_corner(x):  # feasible where all ten are at most 0.02: a share of 1e-17 of the box
        return x[:, :2], x - 0.02

    front = run(far_corner, 10, 1 + shift, 100)
    assert len(front.points) >= 1
    assert front.points.max() <= 0.02


def mw1(x):
    """Ma and Wang's first problem: feasible where 14 variables are near values of their own, flat elsewhere."""
    well = x[:, 1:] ** 13 - 0.5 - np.arange(1, 15) / 30
    g = 1 + (1 - np.exp(-10 * well**2)).sum(axis=1)
    values = np.stack([x[:, 0], g - 0.85 * x[:, 0]], axis=1)
    wave = np.sin(2 * np.pi * np.sqrt(2) * (values[:, 1] - values[:, 0])) ** 8
    return values, values.sum(axis=1) - 1 - 0.5 * wave


def test_a_first_feasible_point_is_put_together_of_coordinates(shift):
    """Half of all searches need 37 iterations, with children along a front that is not there yet 100."""
    needed = []
    for seed in range(11):
        swarm = ParticleSwarm(unit(15), 250, np.random.default_rng(seed + shift))
        while not len(swarm._archive) and swarm.iteration < swarm.iterations:
            values, broken = mw1(swarm.ask())
            tell(swarm, values, np.maximum(broken, 0.0))
        needed.append(swarm.iteration)
    at_most(np.median(needed), 70)


def test_no_feasible_point_is_said_and_not_invented():
    asked = []

    def broken(x):
        asked.append(len(x))
        return zdt1(x), np.full(len(x), 0.25)

    front = run(broken, 5, 1, 10)
    assert front.points.shape == (0, 5)
    assert len(front.values) == 0
    assert sum(asked) == 1000


def test_bounds_hold_for_every_point_asked():
    bounds = np.array([(-1e-4, 3e-4), (1e6, 1e6 + 1), (-5.0, 0.1), (0.1, 0.3)])
    swarm = ParticleSwarm(bounds, 60, np.random.default_rng(3))
    met = np.zeros((4, 2), bool)
    while swarm.iteration < swarm.iterations:
        points = swarm.ask()
        assert np.all((points >= bounds[:, 0]) & (points <= bounds[:, 1]))
        met |= np.stack([(points == side).any(axis=0) for side in bounds.T], axis=1)
        scaled = (points - bounds[:, 0]) / np.ptp(bounds, axis=1)
        tell(swarm, np.stack([scaled.sum(axis=1), -scaled[:, 0] + scaled[:, 1]], axis=1))
    assert met[:, 0].all()  # optima on a bound are reached exactly


def test_same_seed_same_bits_and_other_seed_other_bits():
    for seed in (0, 11):
        first, second = run(zdt3, 6, seed, 20), run(zdt3, 6, seed, 20)
        assert first.points.tobytes() == second.points.tobytes()
        assert first.values.tobytes() == second.values.tobytes()
    assert run(zdt3, 6, 0, 20).points.tobytes() != run(zdt3, 6, 11, 20).points.tobytes()


def test_failed_points_never_enter_the_archive(shift):
    front = run(lambda x: np.where(x[:, :1] > 0.5, np.nan, zdt1(x)), 5, 1 + shift, 60)
    assert np.isfinite(front.values).all()
    assert front.points[:, 0].max() <= 0.5
    f1 = np.linspace(0, 0.5, 300)
    at_most(moocore.igd_plus(front.values, np.stack([f1, 1 - np.sqrt(f1)], axis=1)), 3e-3)


def test_infinite_values_and_nan_violations_are_infeasible():
    values = np.array([[1.0, 1.0], [-np.inf, 0.0], [0.5, np.inf], [0.0, 0.0]])
    front = minimise(
        lambda points: (values, [0.0, 0.0, 0.0, np.nan]), unit(2), iterations=1,
        rng=np.random.default_rng(0), settings=SwarmSettings(particles=4),
    )  # fmt: skip
    assert front.values.tolist() == [[1.0, 1.0]]


def test_failed_points_still_lead_by_their_violation():
    """A model may leave the objectives of an infeasible point NaN and give the violation alone."""

    def function(x):
        broken = np.maximum(x.max(axis=1) - 0.05, 0.0)
        return np.where(broken[:, None] > 0, np.nan, x[:, :2]), broken

    assert len(run(function, 8, 0, 60).points) >= 1


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_one_objective(seed):
    def rosenbrock(x):
        return (100 * (x[:, 1:] - x[:, :-1] ** 2) ** 2 + (1 - x[:, :-1]) ** 2).sum(axis=1)

    rng = np.random.default_rng(seed)
    front = minimise(rosenbrock, [(-2, 2)] * 2, iterations=150, rng=rng)
    assert front.points.shape == (1, 2)
    assert np.allclose(front.points, 1.0, atol=1e-2)

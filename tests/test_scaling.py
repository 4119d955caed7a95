"""The scaling model against what can be worked out by hand."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "analysis"))

from scaling_model import (
    LANES,
    NODE,
    POLICIES,
    Costs,
    _Root,
    _run,
    _Team,
    equal_shares,
    simulate,
    simulate_shared,
    simulate_sums,
)

PACKAGE = POLICIES["package"]
SPREAD = np.random.default_rng(1).lognormal(0.0, 0.5, 2000)  # about tenfold between 1 % and 99 %
FREE = Costs(SPREAD * 2e-3 / SPREAD.mean(), 0.0, 0.0, 0.0, 0.0, 0.0)


def test_every_sample_is_handed_out_and_taken_in_once():
    team = _Team(FREE, 7, LANES, 3)
    root = _Root(FREE._replace(message=1e-5), team, 12345, PACKAGE)
    _run(root)
    assert root.left == 0
    assert sum(team.given) == 12345
    assert all(
        0 <= done <= given + 1e-6 for done, given in zip(team.reported, team.given, strict=True)
    )


def test_one_rank_loses_only_its_emptying_lanes():
    found = simulate(FREE, 1, PACKAGE, work=20.0)
    drain = 0.5 * LANES * FREE.mean
    assert found.efficiency == pytest.approx(20.0 / (20.0 + drain), rel=2e-3)
    assert found.requests == 0


def test_free_messages_leave_every_policy_of_blocks_busy():
    for name in ("package", "half seconds", "guided"):
        assert simulate(FREE, 100, POLICIES[name]).efficiency > 0.97


def test_equal_shares_wait_for_the_slowest_rank():
    # with 400 ranks some are a quarter slower: everybody waits for them
    found = simulate(FREE, 400, equal_shares)
    assert 0.7 < found.efficiency < 0.85


@pytest.mark.parametrize("cost", ["record", "handed"])
def test_a_saturated_root_decides_how_long_it_takes(cost):
    # root can take in one sample in 20 us, a hundred ranks make one in 20 us: four hundred wait for it
    slow = FREE._replace(**{cost: 2e-5})
    found = simulate(slow, 400, PACKAGE, work=30.0)
    serving = 400 * 30.0 / FREE.mean * 2e-5
    assert found.makespan == pytest.approx(serving, rel=0.03)
    assert found.root_load > 0.98


def test_root_load_is_what_its_messages_take():
    slow = FREE._replace(message=5e-5)
    found = simulate(slow, 500, PACKAGE)
    assert found.efficiency > 0.95
    # a second message from each rank closes the run
    expected = (found.requests + 500) * 5e-5 / found.makespan
    assert found.root_load == pytest.approx(expected, rel=1e-6)


def test_sums_spare_root_the_records():
    slow = FREE._replace(record=2e-6, partial=3e-5, message=3e-5)
    flat, sums = simulate(slow, 1500, PACKAGE), simulate_sums(slow, 1500, PACKAGE)
    assert flat.root_load > 0.9
    assert sums.root_load < 0.2
    assert sums.efficiency > 0.95


@pytest.mark.parametrize("keeps", [False, True])
def test_leaders_spare_root_the_ranks(keeps):
    # what root does for a part takes a hundredth of what a rank works for: a hundred ranks, or a hundred nodes
    costs = FREE._replace(message=2e-5, partial=2e-2, record=1e-6, handed=1e-6, written=1e-6)
    alone = simulate_sums(costs, 1000, PACKAGE, work=20.0)
    shared = simulate_shared(costs, 1000, PACKAGE, work=20.0, keeps=keeps)
    assert alone.efficiency < 0.3
    assert shared.efficiency > 0.85
    assert shared.root_load < 0.7


def test_a_leader_that_writes_slowly_holds_up_its_node():
    # sixty-four ranks make a sample in 31 us, their leader writes one in 62
    costs = FREE._replace(written=2.0 * FREE.mean / NODE)
    found = simulate_shared(costs, 1000, PACKAGE, work=20.0, keeps=True)
    assert found.efficiency == pytest.approx(0.5, abs=0.06)
    assert simulate_shared(costs, 1000, PACKAGE, work=20.0).efficiency > 0.9


def test_ranks_that_make_a_block_in_time_write_it_and_hold_nobody_up():
    costs = FREE._replace(samples=FREE.samples / 8.0)
    slow = costs._replace(written=2.0 * costs.mean / NODE)  # as above; of a rank's own time 3 %
    found = simulate_shared(slow, 1000, PACKAGE, work=60.0, keeps=True)
    free = simulate_shared(costs, 1000, PACKAGE, work=60.0, keeps=True)
    assert free.efficiency > 0.93
    assert found.efficiency == pytest.approx(free.efficiency / (1.0 + 2.0 / NODE), rel=0.01)


def test_equal_seeds_give_equal_runs():
    first, again, other = (simulate(FREE, 50, PACKAGE, seed=seed) for seed in (1, 1, 2))
    assert first == again
    assert first.makespan != other.makespan

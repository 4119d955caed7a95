"""Kills of commands of every kind at any moment: the same command goes on, to the same bytes (`kills`)."""

import random
from collections import Counter

import commands
import pytest
from kills import trial, undisturbed

pytestmark = pytest.mark.mpi
ROUNDS = {
    "sample": 2, "sample press": 1, "run": 1, "map --bifurcation": 2, "map": 2, "wear": 2,
    "wear --set angular": 1, "effects": 2, "identify": 2, "accuracy": 2, "accuracy --plan": 2, "init --import": 2, "export": 2,
}  # fmt: skip
"""Times that a command is killed twice and then ends."""


@pytest.mark.parametrize(
    ("name", "rounds", "kills"),
    [("map", 1, 1)]
    + [pytest.param(*row, 2, marks=pytest.mark.nightly) for row in ROUNDS.items()]
    + [pytest.param(name, 13, 4, marks=pytest.mark.full) for name in ("sample", "run")],
)
@pytest.mark.timeout(3600)
def test_a_command_that_was_killed_goes_on_to_the_same_bytes(tmp_path, name, rounds, kills):
    (tmp_path / "undisturbed").mkdir()
    whole, dice = undisturbed(name, tmp_path / "undisturbed"), random.Random(name)
    states, losses = Counter(), []
    for turn in range(rounds):
        found, lost = trial(whole, tmp_path / str(turn), kills, dice)
        states, losses = states + found, losses + lost
    commands.remove_orphans()
    print(
        f"{name}: {dict(states)}; {whole.work:.1f} s undisturbed; each kill cost "
        f"{max((loss.samples for loss in losses), default=0)} samples at most"
    )

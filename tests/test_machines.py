"""Machines with plain bearings: numbers by hand, within the range of line contact when new, and their page."""

import machines
import pytest

from hpcclear import simulate
from hpcclear.base.outcome import Flag, Status


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(one, marks=[] if one == "engine" else pytest.mark.full)
        for one in machines.MACHINES
    ],
)
def test_numbers_by_hand_are_those_of_the_simulation(name):
    scene = machines.scene_of(name)
    found = simulate(scene)
    assert int(found["status"]) == Status.OK
    assert not int(found["flags"]) & Flag.BEYOND_HERTZ
    checks = list(machines.MACHINES[name].by_hand(scene, found))
    assert checks
    for one in checks:
        assert one.simulated == pytest.approx(one.by_hand, rel=one.within), one.words

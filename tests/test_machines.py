"""Machines with plain bearings: numbers by hand, within the range of line contact when new, and their page."""

import re
import sys
from pathlib import Path

import pytest

from hpcclear import simulate
from hpcclear.base.outcome import Flag, Status

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "analysis"))
import machines  # noqa: E402


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


def test_the_page_has_every_machine_with_its_picture():
    """Generated tables are there, with numbers; contacts are lines."""
    page = machines.PAGE.read_text(encoding="utf-8")
    for name, machine in machines.MACHINES.items():
        assert machines.scene_of(name).effects.contact.geometry == "line"
        assert f"jobs/{machine.file}.toml" in page
        assert (machines.PICTURES / f"{name}.png").exists()
        between = re.search(rf"<!-- {name}: begin -->\n(.*)<!-- {name}: end -->", page, re.DOTALL)
        assert between is not None
        assert between[1].count("\n|") >= 5

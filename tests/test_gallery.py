"""The linkages of the gallery: every effect on each of them, pairwise."""

from pathlib import Path

import machines
import pytest
from margins import energy_closes
from pairwise import CONTACTS, FRICTIONS, pairwise_table

from hpcclear import Scene, load_scene, simulate
from hpcclear.base.outcome import Flag, Status

LINKAGES = Path(__file__).parents[1] / "jobs" / "linkages"
NAMES = sorted(path.stem for path in LINKAGES.glob("*.toml"))
SHORT = {"numerics.transient_revolutions": 0, "numerics.averaged_revolutions": 1}
FACTORS = {
    "linkage": NAMES,
    "contact": list(CONTACTS),
    "friction": list(FRICTIONS),
    "gravity": [0.0, 9.81],
    "formulation": ["minimal", "baumgarte"],
    "method": ["dormand-prince", "switching"],
    "responses": [True, False],
}


TABLE = pairwise_table(FACTORS, lambda row: True)


def scene_of(name: str, **changes) -> Scene:
    """A linkage of the gallery without its study, over one revolution from the start."""
    scene = load_scene(LINKAGES / f"{name}.toml").with_({"study": None})
    return scene.with_({**SHORT, **changes})


@pytest.mark.parametrize(
    "row",
    [
        pytest.param(
            row,
            id="-".join(str(level) for level in row.values()),
            marks=[] if k % 3 == 0 else pytest.mark.full,
        )
        for k, row in enumerate(TABLE)
    ],
)
@pytest.mark.shortened(3)
def test_every_pair_of_effects_runs(row):
    """The energy closes as it does for the slider-crank."""
    scene = scene_of(
        row["linkage"],
        **{
            "effects.contact": CONTACTS[row["contact"]],
            "effects.friction": FRICTIONS[row["friction"]],
            "effects.gravity": row["gravity"],
            "numerics.formulation": row["formulation"],
            "numerics.method": row["method"],
            "numerics.responses": row["responses"],
            "numerics.rtol": 1e-7,
        },
    )
    response = simulate(scene)
    assert int(response["status"]) == Status.OK
    energy_closes(response, 1e-4)
    assert (response["mean_gap"].to_numpy() > 0.0).all()


# -- machines with plain bearings ----------------------------------------------------------------------


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

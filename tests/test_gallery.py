"""The linkages of the gallery: every effect on each of them, pairwise; on-at-zero equals off."""

from pathlib import Path

import numpy as np
import pytest
from margins import energy_closes
from pairwise import CONTACTS, FRICTIONS, pairwise_table

from hpcclear import Scene, load_scene, simulate
from hpcclear.base.outcome import Status

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


def anything(row: dict) -> bool:
    return True


TABLE = pairwise_table(FACTORS, anything)


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


ZEROS = {
    "damping": (
        {"effects.contact": {"law": "hunt-crossley", "damping": 0.0}},
        {"effects.contact": {"law": "hertz"}},
    ),
    "friction": (
        {"effects.friction": {"law": "coulomb", "coefficient": 0.0}},
        {"effects.friction": {"law": "none"}},
    ),
}


@pytest.mark.parametrize("zero", list(ZEROS))
@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[] if n == "v_twin" else pytest.mark.full) for n in NAMES]
)
@pytest.mark.shortened(1)
def test_an_effect_at_zero_changes_nothing(name, zero):
    """Poses to 1e-8 over a twentieth of a revolution: after that contact has multiplied the rounding too often."""
    on, off = (
        simulate(scene_of(name, **{"numerics.rtol": 1e-10, "numerics.method": "dormand-prince", **more}))
        for more in ZEROS[zero]
    )  # fmt: skip
    early = slice(0, len(on["time"]) // 20)
    np.testing.assert_array_equal(on["time"][early], off["time"][early])
    for quantity in ("body_x", "body_y", "body_angle"):
        a, b = on[quantity][early].to_numpy(), off[quantity][early].to_numpy()
        assert (np.abs(a - b) <= 1e-8 * np.abs(b).max()).all()

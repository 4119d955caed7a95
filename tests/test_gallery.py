"""The linkages of the gallery: every effect on each of them, pairwise; on-at-zero equals off; a run that was killed goes on."""

import time
from pathlib import Path

import numpy as np
import pytest
from commands import finish, kill, overrides, ranks_of, result_files, run, start
from margins import energy_closes
from pairwise import CONTACTS, FRICTIONS, pairwise_table

from hpcclear import Scene, load_scene, simulate
from hpcclear.base.outcome import Status
from hpcclear.results.places import parts_of

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


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[] if n == "press" else pytest.mark.full) for n in NAMES]
)
@pytest.mark.nightly
def test_samples_that_were_killed_go_on_to_the_same_bytes(name, tmp_path):
    """Root, or the other rank, is killed after the first save."""
    sets = overrides(*(f"{key}={value}" for key, value in SHORT.items()), "study.samples=40")
    undisturbed = tmp_path / "undisturbed.nc"
    code, output = run(["sample", str(LINKAGES / f"{name}.toml"), "-o", str(undisturbed), *sets], 2)
    assert code == 0, output
    for rank in (0, 1):
        out = tmp_path / f"killed{rank}.nc"
        words = ["sample", str(LINKAGES / f"{name}.toml"), "-o", str(out), *sets]
        job = start([*words, "--checkpoint-interval", "0.05"], 2)
        while job.poll() is None and not result_files(parts_of(out)):
            time.sleep(0.02)
        processes = ranks_of(job)
        if rank in processes:
            kill(processes[rank])
        finish(job)
        code, output = run(words, 2)
        assert code == 0, output
        assert out.read_bytes() == undisturbed.read_bytes()

"""The public names: light to import, and what they return."""

import numpy as np
import pytest
from light import loaded_by

import hpcclear
from hpcclear.base.errors import InputError

SCENE = "jobs/slider_crank.toml"
SHORT = ["numerics.transient_revolutions=0", "numerics.averaged_revolutions=1"]


def test_import_alone_loads_nothing_heavy():
    heavy = {"numba", "mpi4py", "sklearn", "matplotlib", "scipy", "xarray"}
    assert not loaded_by("import hpcclear", heavy)
    assert loaded_by("import scipy", heavy) == {"scipy"}


def test_every_public_name_is_there():
    for name in hpcclear.__all__:
        assert getattr(hpcclear, name) is not None
    with pytest.raises(AttributeError):
        hpcclear.no_such_name  # noqa: B018


def test_evaluate_takes_paper_names_and_paths():
    scene = hpcclear.load_scene(SCENE, SHORT)
    result = hpcclear.evaluate(scene, {"C": [3e-4, 5e-4], "drive.speed": 500.0})
    assert result.sizes["sample"] == 2
    assert (result["status"] == 0).all()
    assert result["objective"][1] > result["objective"][0] > 0.0
    np.testing.assert_array_equal(result["drive_speed"], 500.0)


def test_evaluate_refuses_what_makes_no_mechanism():
    scene = hpcclear.load_scene(SCENE, SHORT)
    with pytest.raises(InputError, match=r"sample 1.*clearance as large"):
        hpcclear.evaluate(scene, {"C": [3e-4, 0.05]})
    with pytest.raises(InputError, match="nothing"):
        hpcclear.evaluate(scene, {})
    with pytest.raises(InputError, match="not a number of this scene"):
        hpcclear.evaluate(scene, {"drive.spead": 1.0})


def test_response_is_the_ensemble_s_sample():
    scene = hpcclear.load_scene(SCENE, [*SHORT, "numerics.method=tsitouras"])
    response = hpcclear.simulate(scene)
    sample = hpcclear.evaluate(scene, {"m1": 0.3})
    assert response["status"] == 0
    # The same arithmetic in one lane or in many; the ledger of the response takes no part in step control.
    assert abs(response["objective"] / sample["objective"][0] - 1.0) < 1e-9
    assert abs(response["slider_position"][0] - 0.17) < 1e-15
    assert response["time"][-1] == pytest.approx(0.012, rel=1e-14)
    assert np.isfinite(response["energy_residual"]).all()


def test_by_itself_a_response_takes_collocation_and_agrees_within_the_sample_s_limit():
    scene = hpcclear.load_scene(SCENE, [*SHORT, "numerics.uncertainty=true"])
    response = hpcclear.simulate(scene)
    sample = hpcclear.evaluate(scene, {"m1": 0.3})
    assert response.attrs["integrator"] == "lobatto"
    off = abs(response["objective"] - sample["objective"][0])
    assert 0.0 < off < sample["objective_uncertainty"][0] < 1e-3 * response["objective"]

"""The public names: light to import, and what they return."""

import numpy as np
import pytest
from light import loaded_by

import hpcclear
import hpcclear.plugins
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


@pytest.mark.parametrize(
    ("column", "reason"),
    [
        (["140 g"], "'140 g'"),
        ([0.1, 0.2, 0.3], "mismatch"),
        (np.ma.array([0.1, 0.2], mask=[0, 1]), "finite"),
        ([True, False], "truth values"),
        ([0.1 + 1j, 0.2], "complex"),
    ],
)
def test_columns_that_are_no_designs_are_refused(column, reason):
    """Texts, columns of several lengths, and masked values, which arrays keep apart from the numbers."""
    scene = hpcclear.load_scene(SCENE, SHORT[1])
    assert scene.numerics.averaged_revolutions == 1  # one override needs no list
    with pytest.raises(InputError, match=reason):
        hpcclear.evaluate(scene, {"C": [1e-4, 2e-4], "m3": column})


def test_evaluate_refuses_what_makes_no_mechanism():
    scene = hpcclear.load_scene(SCENE, SHORT)
    with pytest.raises(InputError, match=r"sample 1.*clearance as large"):
        hpcclear.evaluate(scene, {"C": [3e-4, 0.05]})
    with pytest.raises(InputError, match="no entry is varied"):
        hpcclear.evaluate(scene, {})
    with pytest.raises(InputError, match="not a number of this scene"):
        hpcclear.evaluate(scene, {"drive.spead": 1.0})
    with pytest.raises(InputError, match="Did you mean 'C'"):
        hpcclear.evaluate(scene, {"c": [3e-4]})
    with pytest.raises(InputError, match=r"'C, C12': two columns drive joints\.crank_rod"):
        hpcclear.evaluate(scene, {"C": [3e-4], "C12": [5e-4]})
    pins = (f"joints.{name}.kind=ideal" for name in ("crank_rod", "rod_slider"))
    ideal = hpcclear.load_scene(SCENE, [*pins, "effects.friction=none"])
    with pytest.raises(InputError, match=r"'C'.*not a number of this scene"):
        hpcclear.evaluate(ideal, {"C": [3e-4, 5e-4]})  # it would change nothing


def test_commands_are_functions_that_return_datasets(tmp_path):
    scene = hpcclear.load_scene("jobs/hunt_crossley.toml", SHORT)
    cells = hpcclear.map(scene, "C=0.2mm:0.4mm:2", output=tmp_path / "map.nc", progress="quiet")
    assert cells["lyapunov_exponent"].dims == ("C",)
    np.testing.assert_allclose(cells["C"], [2e-4, 4e-4])
    assert (tmp_path / "map.nc").exists()
    seen = hpcclear.bifurcation(
        scene, "C=0.2mm:0.4mm:2", observe="max crank_moment", transient=0, revolutions=2, progress="quiet"
    )  # fmt: skip
    assert seen["observed"].shape == (2, 2)
    assert seen["observed"].attrs["units"] == "N m"
    with pytest.raises(InputError, match="wear"):
        hpcclear.wear(scene)
    with pytest.raises(InputError, match="has no study"):
        hpcclear.plan(scene)


def test_a_study_may_be_called_and_refuses_alike_on_one_process_and_on_several(tmp_path):
    scene = hpcclear.load_scene(SCENE)
    for study in (hpcclear.study, hpcclear.run_study):
        with pytest.raises(InputError, match="study"):
            study(scene, tmp_path / "a")
    with pytest.raises(InputError, match="study"):
        hpcclear.run_study(scene, tmp_path / "b", ranks=2)

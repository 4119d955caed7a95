"""Signals: one list for `identify`, `compare` and `bifurcation`."""

from pathlib import Path

import numpy as np
import pytest

import hpcclear
from hpcclear.base.errors import InputError
from hpcclear.dynamics.response import simulated
from hpcclear.ensemble.bifurcation import Observation
from hpcclear.identify.made import write_made
from hpcclear.identify.measured import read_measured
from hpcclear.identify.signals import INSTANTS, ORDERS, PARTS, spectra
from hpcclear.report.compare import compare
from hpcclear.results.signals import DERIVED, signal, signals_in

ROOT = Path(__file__).parent.parent
REVOLUTIONS = 4


@pytest.fixture(scope="module")
def scene():
    """A linkage of joints with clearance, bodies and points."""
    return hpcclear.load_scene(ROOT / "jobs" / "linkages" / "crank_rocker.toml").with_(
        {
            "study": None,
            "numerics.transient_revolutions": 1,
            "numerics.averaged_revolutions": REVOLUTIONS + 1,
            "output.instants_per_revolution": INSTANTS,
        }
    )


@pytest.fixture(scope="module")
def response(scene):
    return simulated(scene, checked=False)


@pytest.fixture(scope="module")
def table(scene, response, tmp_path_factory):
    """All signals as they would be measured."""
    path = tmp_path_factory.mktemp("signals") / "measured.csv"
    write_made(
        scene, path, list(signals_in(response)), noise=0.0, revolutions=REVOLUTIONS,
        samples=INSTANTS, response=response.to_xarray(),
    )  # fmt: skip
    return path


def test_all_that_a_mechanism_has_are_signals(response):
    found = signals_in(response)
    for name, variable in response.data_vars.items():
        if variable.dims == ("time",):
            assert np.shares_memory(found[name].values, variable.values)
        elif variable.dims[:1] == ("time",):
            assert sum(one.startswith(f"{name} ") for one in found) == variable.shape[1]
    for name in DERIVED:
        assert any(one.startswith(f"{name} ") for one in found)
    # a single place has two names
    assert len({one.label for one in found.values()}) >= len(found) - 2


@pytest.mark.nightly  # compared below, and one identified in test_identify
def test_each_signal_can_be_identified_from(scene, response, table):
    names = list(signals_in(response))
    found = spectra(scene, response, names)
    assert found.shape == (len(names), PARTS, ORDERS + 1)
    assert np.isfinite(found).all()
    for k, name in enumerate(names):
        one = signal(response, name, "--signal")
        measured = read_measured(table, name, one.unit, 15.0, 1)
        size = np.abs(found[k, 0] + 1j * found[k, 1]).max()
        np.testing.assert_allclose(measured.spectrum.mean[0].real, found[k, 0, 0], atol=0.05 * size)


def test_each_signal_can_be_compared(response, table):
    found = compare(response.to_xarray(), table)
    assert [one.name for one in found.quantities] == list(signals_in(response))
    for one in found.quantities:
        size = np.abs(one.measured).max()
        if np.ptp(one.measured) > 1e-6 * size and "constraint" not in one.name:
            assert one.norms["correlation"] > 0.9, one.name


def test_each_signal_can_be_observed(scene, response):
    for name, one in signals_in(response).items():
        seen = Observation(name, 0.0, 1, REVOLUTIONS)
        assert seen.described(response).unit == one.unit
        assert one.label in seen.described(response).words
        assert np.isfinite(seen(scene, response)).all(), name
    impacts = Observation("impacts o2", 0.0, 1, REVOLUTIONS)(scene, response)
    shown = signal(response, "impacts o2", "--observe").values
    assert 0.0 < impacts.sum() <= shown.sum()


def test_a_name_that_is_none_is_refused_with_those_like_it(response):
    with pytest.raises(InputError, match="contact_force o2"):
        signal(response, "contact_force", "--signal")
    with pytest.raises(InputError, match="no such signal"):
        signal(response, "acceleration_x nowhere", "--signal")

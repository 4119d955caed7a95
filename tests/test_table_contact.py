"""A table of force against depth as a geometry of contact, and Adams' IMPACT as a law: against their formulae and a power."""

import numpy as np
import pytest
from refusals import refused
from running import scene_with
from scipy.interpolate import PchipInterpolator

from hpcclear import simulate
from hpcclear.laws import laws, numbers
from hpcclear.laws.geometry.table import EXAMPLE, of_rows

K, EXPONENT = 5e9, 1.5
POWER = {"force_at": K * 1e-6**EXPONENT, "depth_at": 1e-6, "exponent": EXPONENT}
ROWS = [[d, K * d**EXPONENT] for d in np.linspace(0.0, 2e-4, 16)[1:].tolist()]


def with_contact(**contact):
    return scene_with({"effects.contact": contact, "effects.friction": {"law": "none"}})


def test_a_table_is_its_rows_and_stores_its_integral():
    shape, units = of_rows(EXAMPLE), {"depth_scale": 1.0, "force_scale": 1.0}
    depths = np.array([0.0, *(row[0] for row in EXAMPLE)])
    forces = np.array([0.0, *(row[1] for row in EXAMPLE)])
    at = np.linspace(0.0, depths[-1], 400)
    found = numbers.evaluate(shape.elastic, {"depth": at, **units})
    np.testing.assert_allclose(found, PchipInterpolator(depths, forces)(at), rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(
        numbers.evaluate(shape.elastic, {"depth": depths, **units}), forces, atol=1e-9
    )
    behind = np.array([5e-6, 6e-6, 7e-6])
    steps = np.diff(numbers.evaluate(shape.elastic, {"depth": behind, **units}))
    assert steps[0] > 0.0
    assert steps[0] == pytest.approx(steps[1], rel=1e-12)
    nodes, weights = np.polynomial.legendre.leggauss(4)
    for low, high in ((1e-6, 2e-6), (2e-6, 4e-6), (4e-6, 9e-6)):
        inside = low + (high - low) * (1 + nodes) / 2
        work = (
            (high - low) / 2 * weights @ numbers.evaluate(shape.elastic, {"depth": inside, **units})
        )
        stored = numbers.evaluate(shape.energy, {"depth": np.array([low, high]), **units})
        assert stored[1] - stored[0] == pytest.approx(work, rel=1e-12)


def test_a_table_of_a_power_moves_as_the_power():
    table = simulate(with_contact(law="hunt-crossley", damping=0.5, geometry="table", curve=ROWS))
    power = simulate(with_contact(law="hunt-crossley", damping=0.5, geometry="power", **POWER))
    peaks = [one["peak_contact_force"].to_numpy() for one in (table, power)]
    np.testing.assert_allclose(*peaks, rtol=1e-3)
    given = float(np.abs(table["driving_work"]).max())
    assert float(np.abs(table["energy_residual"]).max()) < 1e-5 * given


def test_impact_is_adams_function():
    law = laws("contact")["impact"]
    given = {**POWER, "greatest_damping": 300.0, "full_depth": 2e-6}
    depth, rate = np.array([0.0, 0.5e-6, 2e-6, 7e-6]), 0.3
    u = np.minimum(depth / 2e-6, 1.0)
    expected = K * depth**EXPONENT + 300.0 * rate * (3 * u**2 - 2 * u**3)
    found = numbers.force_of(law, {**given, "depth": depth, "rate": rate * np.ones(4)})
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    done = simulate(with_contact(law="impact", **given))
    given_work = float(np.abs(done["driving_work"]).max())
    assert float(np.abs(done["energy_residual"]).max()) < 1e-5 * given_work


@pytest.mark.parametrize(
    ("contact", "key"),
    [
        ({"geometry": "table"}, "curve"),
        ({"geometry": "line", "curve": ROWS}, "curve"),
        ({"curve": ROWS}, "curve"),
        ({"geometry": "table", "curve": ROWS[:1]}, "curve"),
        ({"geometry": "table", "curve": [["2 um", "5 N"], ["1 um", "9 N"]]}, "curve"),
        ({"geometry": "table", "curve": [["1 um", "9 N"], ["2 um", "5 N"]]}, "curve"),
        ({"geometry": "table", "curve": [["1 um", "9 kg"], ["2 um", "5 N"]]}, "curve"),
    ],
)
def test_tables_at_fault_are_named(contact, key):
    with refused(f"effects.contact.{key}"):
        with_contact(law="hunt-crossley", damping=0.5, **contact)

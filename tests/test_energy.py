"""Every run closes its energy balance: what is stored, less what was put in and taken out, stays what it was."""

import numpy as np
import pytest
from running import BOUNDS, HUNT_CROSSLEY, LATCHED, SCENE

from hpcclear.dynamics.response import simulate
from hpcclear.scene import Scene, load_scene

CLIPPED = {"law": "hunt-crossley", "damping": 50.0}
STEPS = {"output.instants_per_revolution": 0}


def paper_case(contact: dict, rtol: float, transient: int = 5, averaged: int = 5) -> Scene:
    """The paper's mechanism, with friction, at every accepted step."""
    return load_scene(SCENE).with_(
        STEPS
        | {
            "effects.contact": contact,
            "effects.friction": {"law": "coulomb", "coefficient": 0.1, "ramp_speed": 0.01},
            "numerics.rtol": rtol,
            "numerics.transient_revolutions": transient,
            "numerics.averaged_revolutions": averaged,
        }
    )


def residual(response) -> float:
    """Largest residual over max(kinetic energy, integral of |driving power|)."""
    # the sum of all ups and downs between steps is at most the integral of the absolute value
    driven = np.abs(np.diff(response.driving_work)).sum()
    size = max(float(response.kinetic_energy.max()), driven)
    return float(np.abs(response.energy_residual).max()) / size


@pytest.mark.parametrize("rtol", BOUNDS)
@pytest.mark.parametrize(
    "contact", [LATCHED, CLIPPED, HUNT_CROSSLEY], ids=["latched", "clipped", "mild"]
)
@pytest.mark.shortened(4)
def test_energy_balance_closes(contact: dict, rtol: float):
    response = simulate(paper_case(contact, rtol))
    assert response.status == 0
    assert residual(response) < BOUNDS[rtol]
    # a balance of zeros would close, too: damping and friction take out far more than the residual
    assert float(response.dissipated_energy[-1]) > 1e4 * BOUNDS[rtol]
    assert (np.diff(response.dissipated_energy) > -1e-9).all()


def test_works_agree_with_the_recorded_forces():
    """Driving work from the crank's moment, dissipation from nothing but the balance of a coarse quadrature."""
    # the pair, for its many short steps
    scene = paper_case(HUNT_CROSSLEY, 1e-10, 0, 1).with_({"numerics.method": "dormand-prince"})
    response = simulate(scene)
    time = response.time.to_numpy()
    power = response.crank_moment.to_numpy() * np.gradient(response.crank_angle.to_numpy(), time)
    work = np.sum(0.5 * (power[1:] + power[:-1]) * np.diff(time))
    assert work == pytest.approx(float(response.driving_work[-1]), rel=1e-4)
    elastic = response.elastic_energy.to_numpy()
    assert elastic.min() >= 0.0
    assert elastic.max() > 1.0


@pytest.mark.full
def test_energy_balance_closes_after_ten_thousand_revolutions():
    """In pieces of 500 revolutions, as a record of all steps would not fit."""
    from hard_case_runs import hard_cases

    scene = paper_case(LATCHED, 1e-8, 5, 9995)
    assert hard_cases.run(scene).residual < 1e-5

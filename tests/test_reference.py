"""The kernel beside published numbers and closed forms, and what must not change a single bit."""

import math
from pathlib import Path

import numpy as np
import pytest
from running import HUNT_CROSSLEY, LATCHED, integrate

from hpcclear.dynamics.evaluation import evaluate_records
from hpcclear.dynamics.evaluation.evaluator import DEFAULT_LANES
from hpcclear.dynamics.layout.views import Outcome
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.problem import problem_of
from hpcclear.dynamics.setup.start import start_states
from hpcclear.dynamics.stepping.lanes import Lanes
from hpcclear.scene import Scene, load_scene
from hpcclear.scene.points import Points

SCENE = Path(__file__).parent.parent / "jobs" / "slider_crank.toml"
CLEARANCES = ("joints.crank_rod.clearance", "joints.rod_slider.clearance")

# Two independent prototypes and Exudyn: law, clearance m, revolutions, slider m and m/s at their end, objective m of
# the last one.
REFERENCES = [
    (HUNT_CROSSLEY, 0.3e-3, 10, 0.171152630440, 0.325910264, 0.287715562e-3),
    (HUNT_CROSSLEY, 1.0e-3, 10, 0.172902835885, -0.089948987, 0.445161663e-3),
    (LATCHED, 0.05e-3, 10, 0.170421656626, 0.293957319, 0.153838695e-3),
    (LATCHED, 0.3e-3, 1, 0.170909697445, 0.553755970, 0.28753013e-3),
    (LATCHED, 1.0e-3, 1, 0.171719167301, 5.286279221, 0.48971977e-3),
]


def paper_case(
    contact: dict, clearance: float, transient: int, averaged: int, rtol: float
) -> Scene:
    """The paper's mechanism with one law and one clearance in both joints."""
    return load_scene(SCENE).with_(
        {"effects.contact": contact}
        | dict.fromkeys(CLEARANCES, clearance)
        | {
            "numerics.transient_revolutions": transient,
            "numerics.averaged_revolutions": averaged,
            "numerics.rtol": rtol,
        }
    )


def points_of(scene: Scene, table: dict[str, np.ndarray]) -> Points:
    """Designs from columns by scene path."""
    names = tuple(f"x{k}" for k in range(len(table)))
    return Points(names, np.column_stack(list(table.values())), tuple((path,) for path in table))


def bits(records: np.ndarray) -> list[bytes]:
    """Every number of each record but its index, as bytes: NaN equals NaN, and 0 is not -0."""
    copy = records.copy()
    copy["sample"] = 0
    return [row.tobytes() for row in copy]


@pytest.mark.parametrize(("contact", "clearance", "revolutions", "x", "v", "f"), REFERENCES)
def test_reference_row(
    contact: dict, clearance: float, revolutions: int, x: float, v: float, f: float
):
    scene = paper_case(contact, clearance, revolutions - 1, 1, rtol=1e-11)
    steps, outcome, _ = integrate(scene)
    assert outcome["status"][0] == 0
    assert steps.time[-1] == pytest.approx(revolutions * 60.0 / 5000.0, rel=1e-14)
    assert steps.q[-1, 3] == pytest.approx(x, abs=1e-10 if contact is HUNT_CROSSLEY else 1e-9)
    assert steps.v[-1, 3] == pytest.approx(v, abs=1e-5)
    assert outcome["objective"][0] == pytest.approx(f, rel=1e-6)


def test_lanes_agree_with_the_reference_and_with_one_another():
    """All lanes at once, more samples than lanes: the two rows of one revolution, over and over."""
    scene = paper_case(LATCHED, 0.3e-3, 0, 1, rtol=1e-11)
    rows = [row for row in REFERENCES if row[2] == 1]
    which = np.arange(2 * DEFAULT_LANES + 3) % len(rows)
    clearance = np.array([row[1] for row in rows])[which]
    records = evaluate_records(scene, points_of(scene, dict.fromkeys(CLEARANCES, clearance)))
    expected = np.array([row[5] for row in rows])[which]
    np.testing.assert_allclose(records["objective"], expected, rtol=1e-6)
    assert len(set(bits(records))) == len(rows)


def test_crank_data_do_not_move_the_objective_by_one_bit():
    scene = paper_case(LATCHED, 0.3e-3, 1, 1, rtol=1e-6)
    rng = np.random.default_rng(0)
    n = 40
    table = {
        "mechanism.crank.mass": rng.uniform(0.15, 0.6, n),
        "mechanism.crank.inertia": rng.uniform(3e-5, 5e-4, n),
    }
    assert len(set(bits(evaluate_records(scene, points_of(scene, table))))) == 1
    other = evaluate_records(
        scene, points_of(scene, {"mechanism.rod.mass": 0.21 + 1e-3 * np.arange(3)})
    )
    assert len(set(other["objective"])) == 3  # the check above can fail


def test_the_mass_centre_of_the_crank_moves_the_objective_by_rounding_only():
    """The pin's place is written from the mass centre, which costs a last bit of its radius."""
    scene = paper_case(LATCHED, 0.3e-3, 0, 1, rtol=1e-11)
    places = {"mechanism.crank.mass_center": np.linspace(0.0, 0.05, 8)}
    found = evaluate_records(scene, points_of(scene, places))["objective"]
    np.testing.assert_allclose(found, found[0], rtol=1e-8)


def random_designs(scene: Scene, count: int) -> Points:
    rng = np.random.default_rng(1)
    table = dict.fromkeys(CLEARANCES, rng.uniform(0.3e-3, 1e-3, count))
    table["mechanism.rod.mass"] = rng.uniform(0.105, 0.42, count)
    table["mechanism.slider.mass"] = rng.uniform(0.07, 0.28, count)
    return points_of(scene, table)


def test_order_of_samples_does_not_change_one_bit():
    scene = paper_case(LATCHED, 0.3e-3, 0, 2, rtol=1e-6)
    points = random_designs(scene, 2 * DEFAULT_LANES + 5)
    forward = bits(evaluate_records(scene, points))
    order = np.random.default_rng(2).permutation(len(points))
    shuffled = bits(evaluate_records(scene, points.take(order)))
    assert [forward[k] for k in order] == shuffled
    alone = bits(evaluate_records(scene, points.take([7])))
    assert alone == [forward[7]]


@pytest.mark.parametrize("budgets", [(1,), (7, 64, 1, 3)])
def test_interruptions_do_not_change_one_bit(budgets: tuple[int, ...]):
    scene = paper_case(LATCHED, 0.3e-3, 0, 1, rtol=1e-6)
    points = random_designs(scene, DEFAULT_LANES + 9)
    par = parameters(scene, points)

    def outcomes(budgets: tuple[int, ...]) -> np.ndarray:
        lanes = Lanes(problem_of(scene), DEFAULT_LANES)
        lanes.queue(par, start_states(scene, par), np.arange(len(points)))
        out = np.empty((len(points), Outcome.size))
        count = 0
        while lanes.pending:
            lanes.step(budgets[count % len(budgets)])
            labels, finished, _ = lanes.collect()
            out[labels] = finished.rows
            count += 1
        return out

    assert outcomes(budgets).tobytes() == outcomes((1_000_000,)).tobytes()


def ideal_slider(scene: Scene, time: np.ndarray) -> np.ndarray:
    """Slider position of the mechanism without play."""
    crank, rod = scene.mechanism.crank.length, scene.mechanism.rod.length
    phi = scene.drive.speed * time
    return crank * np.cos(phi) + np.sqrt(rod**2 - (crank * np.sin(phi)) ** 2)


@pytest.mark.parametrize("contact", [HUNT_CROSSLEY, LATCHED], ids=lambda c: c["law"])
@pytest.mark.shortened(1)
def test_motion_tends_to_the_ideal_mechanism(contact: dict):
    """Slowly, so that penetration stays below the clearance: the joints hold within about c."""
    for clearance in (1e-3, 1e-4, 1e-5):
        scene = paper_case(contact, clearance, 0, 1, rtol=1e-6).with_(
            {"drive.speed": 2.0 * math.pi}
        )
        steps, outcome, _ = integrate(scene)
        assert outcome["status"][0] == 0
        away = np.abs(steps.q[:, 3] - ideal_slider(scene, steps.time)).max()
        # the rod's tilt adds at most crank / sqrt(rod^2 - crank^2) times the offset across
        assert clearance < away < 2.0 * clearance * (1.0 + 0.46) * 1.05
        assert outcome["objective"][0] < clearance * math.sqrt(2.0)

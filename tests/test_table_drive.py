"""Drives that follow a table of angles, against the drives of a formula that the tables are taken from."""

import math
from pathlib import Path

import numpy as np
import pytest
from planar_scenes import without_play

from hpcclear import load_scene, simulate
from hpcclear.base.errors import InputError
from hpcclear.dynamics.linkage.loops import words_of
from hpcclear.dynamics.planar.problem import linkage_of
from hpcclear.scene.driving import PlanarTable

LINKAGES = Path(__file__).parent.parent / "jobs" / "linkages"
ROCKER = load_scene(LINKAGES / "crank_rocker.toml").with_(
    {"study": None, "numerics.transient_revolutions": 0, "numerics.averaged_revolutions": 1}
)
SPEED = ROCKER.number("mechanism.drives.motor.speed")
START = ROCKER.number("mechanism.bodies.crank.start_angle")


def driven(angle, rows=721, seconds=2 * math.pi / SPEED):
    """The crank-rocker by a table of an angle over the share of its time."""
    share = np.linspace(0.0, 1.0, rows)
    table = [[float(s * seconds), float(angle(s))] for s in share]
    motor = {"kind": "table", "body": "crank", "angle": table}
    return ROCKER.with_({"mechanism.drives": {"motor": motor}})


def pressed(scene):
    """The rocker loaded, so that it rattles less."""
    hold = {"kind": "torque", "body": "rocker", "torque": -20.0}
    return scene.with_({"mechanism.loads": {"hold": hold}, "numerics.rtol": 1e-10})


@pytest.mark.parametrize("formulation", ["minimal", "baumgarte"])
def test_a_crank_turned_by_a_table_moves_as_one_of_constant_speed(formulation):
    numerics = {"numerics.formulation": formulation}
    table = driven(lambda share: START + 2 * math.pi * share)
    ours, given = (simulate(pressed(scene.with_(numerics))) for scene in (table, ROCKER))
    # over a twentieth of a turn: contacts make more of every difference from there on
    early = slice(0, len(given["time"]) // 20)
    for name in ("point_x", "point_y", "body_angle", "crank_angle"):
        np.testing.assert_allclose(ours[name][early], given[name][early], rtol=0, atol=1e-7)
    crank = list(given["body"].to_numpy()).index("crank")
    angle = given["body_angle"][:, crank].to_numpy()
    np.testing.assert_allclose(ours["body_angle"][:, crank], angle, rtol=0, atol=1e-9)


def test_a_table_of_a_sine_is_the_harmonic_drive():
    """Without play: nothing but places, speeds, accelerations and the drive's moment."""
    mean, swing, frequency = START, 0.5, 5.0
    table = driven(lambda s: mean + swing * math.sin(2 * math.pi * s), seconds=1 / frequency)
    formula = {
        "kind": "harmonic",
        "body": "crank",
        "mean": mean,
        "amplitude": swing,
        "frequency": frequency,
    }
    harmonic = ROCKER.with_({"mechanism.drives": {"motor": formula}})
    ours, given = (simulate(without_play(scene)) for scene in (table, harmonic))
    np.testing.assert_allclose(ours["body_angle"], given["body_angle"], rtol=0, atol=1e-8)
    np.testing.assert_allclose(ours["body_spin"], given["body_spin"], rtol=0, atol=1e-5)
    largest = float(np.abs(given["crank_moment"]).max())
    np.testing.assert_allclose(
        ours["crank_moment"], given["crank_moment"], rtol=0, atol=1e-3 * largest
    )


def test_what_the_kernel_reads_is_what_numpy_is_given_and_derivatives_belong_together():
    rows = ((0.0, 0.3), (0.02, 0.9), (0.05, 0.1), (0.11, -0.4), (0.2, 0.3))
    drive = PlanarTable(name="cam", body="crank", kind="table", angle=rows)
    given = words_of(type("One", (), {"drives": (drive,)})())["table_of_cam"]  # type: ignore[arg-type]
    times = np.linspace(0.0, 0.4, 4001)
    angle, spin, turn = given(times)
    np.testing.assert_allclose(
        given(np.array([t for t, _ in rows]))[0], [a for _, a in rows], atol=1e-12
    )
    step = times[1]
    inside = slice(2, -2)
    np.testing.assert_allclose(
        np.gradient(angle, step)[inside], spin[inside], atol=2e-2 * np.ptp(spin)
    )
    np.testing.assert_allclose(
        np.gradient(spin, step)[inside], turn[inside], atol=5e-2 * np.ptp(turn)
    )
    np.testing.assert_allclose(angle[:2001], angle[2000:], atol=1e-12)


def test_tables_that_do_not_repeat_are_refused():
    table = [[0.0, 0.0], [0.1, 0.5], [0.2, 0.2], [0.3, 1.0]]
    motor = {"kind": "table", "body": "crank", "angle": table}
    with pytest.raises(InputError, match="where the motion repeats"):
        ROCKER.with_({"mechanism.drives": {"motor": motor}})
    with pytest.raises(InputError, match="must rise from row to row"):
        ROCKER.with_({"mechanism.drives": {"motor": {**motor, "angle": table[1:] + table[:1]}}})
    round_and_round = {**motor, "angle": [[0.0, 0.0], [0.1, 2.0], [0.2, 4.0], [0.3, 2 * math.pi]]}
    main = {"kind": "harmonic", "body": "rocker", "amplitude": 0.1, "frequency": 1 / 0.3}
    both = ROCKER.with_({"mechanism.drives": {"main": main, "motor": round_and_round}})
    with pytest.raises(InputError, match="goes round"):
        linkage_of(both)

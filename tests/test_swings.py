"""Mechanisms that are let go, couplings between shafts that go round, bodies without inertia, forces of pins: closed forms."""

import numpy as np
import pytest
from planar_scenes import planar_scene
from scipy.special import ellipj, ellipk

from hpcclear import evaluate, load_scene, simulate
from hpcclear.base.errors import InputError
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.planar.problem import linkage_of

G = 9.81
NUMERICS = {"rtol": 1e-9, "transient_revolutions": 0, "averaged_revolutions": 2}


def swing(start, length, inertia=0.0, drive=None):
    """A mass (1 kg) on a rod that hangs at `start` from straight below."""
    free = {"kind": "free", "body": "rod", "interval": 2.0}
    rod = {"length": length, "mass": 1.0, "mass_center": length, "inertia": inertia}
    return planar_scene(
        {"rod": {**rod, "start_angle": start - 0.5 * np.pi}},
        {"pin": {"kind": "revolute", "journal": "rod.a", "bearing": "ground.o"}},
        {"let_go": drive or free},
        effects={"gravity": G},
        numerics={**NUMERICS, "energy": True},
    )


def test_pendulums_swing_as_elliptic_functions_have_it_and_their_pins_hold_them():
    """Of any amplitude and length, the mass a point; the pin's force is that of Newton's law."""
    rng = np.random.default_rng(4)
    for start, length in zip(rng.uniform(0.1, 3.0, 5), rng.uniform(0.1, 2.0, 5), strict=True):
        found = simulate(swing(start, length))
        times = found.time.to_numpy()
        angle = found.body_angle.to_numpy()[:, 0]
        k, rate = np.sin(0.5 * start), np.sqrt(G / length)
        exact = 2.0 * np.arcsin(k * ellipj(ellipk(k * k) - rate * times, k * k)[0])  # elliptic
        np.testing.assert_allclose(angle + 0.5 * np.pi, exact, atol=2e-6)
        assert abs(found.energy_residual).max() < 1e-6 * G * length
        spin = found.body_spin.to_numpy()[:, 0]
        # 1 kg: along the rod g cos + L w^2, the rest of the weight turns it
        along = G * np.cos(angle + 0.5 * np.pi) + length * spin**2
        force = [found[f"pin_force_{axis}"].to_numpy()[:, 0] for axis in "xy"]
        atol = 1e-9 * (G + length * (spin**2).max())
        np.testing.assert_allclose(force[0], -along * np.cos(angle), atol=atol)
        np.testing.assert_allclose(force[1], -along * np.sin(angle), atol=atol)


def test_a_torque_that_turns_back_is_simulated_by_time():
    """It holds the mass aside: the same swing about another place."""
    drive = {"kind": "torque", "body": "rod", "torque": 2.0, "initial_speed": 0.0, "interval": 3.0}
    found = simulate(swing(0.0, 1.0, drive=drive))
    assert int(found.status) == 0
    work = 2.0 * (found.body_angle.to_numpy()[:, 0] + 0.5 * np.pi)
    np.testing.assert_allclose(found.driving_work, work, atol=1e-6)
    assert found.time[-1] == pytest.approx(6.0)


def coupled(stiffness, inertia, speed, torque=None, **numerics):
    """A driven shaft and a free one, 20 degrees ahead, with a torsion spring between them."""
    bodies = {
        name: {"mass": 1.0, "inertia": one, "points": {"o": [0.0, 0.0]}, "start_angle": start}
        for name, one, start in (("motor", 0.01, 0.0), ("rotor", inertia, np.radians(20.0)))
    }
    drive = {"kind": "constant-speed", "body": "motor", "speed": speed}
    free = {"kind": "torque", "body": "motor", "torque": 0.0, "initial_speed": abs(speed)}
    spring = {"kind": "torsion-spring", "body": "motor", "other": "rotor", "stiffness": stiffness}
    pins = {
        name: {"kind": "revolute", "journal": f"{name}.o", "bearing": f"ground.{name}"}
        for name in bodies
    }
    return planar_scene(
        bodies, pins, {"drive": drive if torque is None else free},
        ground={"motor": [0.0, 0.0], "rotor": [0.2, 0.0]},
        loads={"coupling": spring},
        effects={"gravity": 0.0},
        numerics={**NUMERICS, "averaged_revolutions": 8, **numerics},
    )  # fmt: skip


@pytest.mark.parametrize("kind", ["minimal", "baumgarte", "torque"])
@pytest.mark.shortened(1)
def test_the_angle_between_shafts_that_go_round_is_a_torsional_oscillator_s(kind):
    """Over many revolutions, either way round, driven at a speed or by a torque."""
    rng = np.random.default_rng(5)
    for _ in range(3):
        stiffness, inertia = rng.uniform(5.0, 50.0), rng.uniform(0.005, 0.05)
        speed = rng.uniform(40.0, 90.0) * (rng.choice([-1.0, 1.0]) if kind != "torque" else 1.0)
        free = kind == "torque"
        formulation = {"formulation": "baumgarte"} if kind == "baumgarte" else {}
        scene = coupled(stiffness, inertia, speed, 0.0 if free else None, **formulation)
        found = simulate(scene)
        times = found.time.to_numpy()
        angles, spins = found.body_angle.to_numpy(), found.body_spin.to_numpy()
        reduced = inertia * 0.01 / (inertia + 0.01) if free else inertia
        rate = np.sqrt(stiffness / reduced)
        apart = angles[:, 1] - angles[:, 0]
        begun = (spins[0, 1] - spins[0, 0]) / rate
        exact = np.radians(20.0) * np.cos(rate * times) + begun * np.sin(rate * times)
        np.testing.assert_allclose(apart, exact, atol=1e-5 * max(1.0, abs(begun)))


def test_a_sample_of_the_other_direction_has_the_bits_of_its_scene():
    scenes = (coupled(10.0, 0.01, speed, responses=True) for speed in (50.0, -50.0))
    found, own = (evaluate(one, {"mechanism.drives.drive.speed": [-50.0]}) for one in scenes)
    assert found.equals(own)


def test_springs_whose_angle_has_no_end_are_refused():
    """Between bodies that drives turn by different angles, and from one that is coupled to such a body to the ground."""
    scene = coupled(10.0, 0.01, 50.0)
    faster = {"kind": "constant-speed", "body": "rotor", "speed": 100.0}
    with pytest.raises(InputError, match="different angles"):
        linkage_of(scene.with_({"mechanism.drives.other": faster}))
    ground = {"kind": "torsion-spring", "body": "rotor", "stiffness": 1.0}
    with pytest.raises(InputError, match="no end"):
        linkage_of(scene.with_({"mechanism.loads.held": ground}))


def test_a_body_that_may_turn_about_its_mass_centre_needs_an_inertia():
    """The mass matrix is singular; off the mass centre it is not."""
    scene = swing(1.0, 1.0)
    with pytest.raises(InputError, match="inertia"):
        linkage_of(scene.with_({"mechanism.bodies.rod.mass_center": 0.0}))


def test_by_baumgarte_a_body_that_turns_needs_an_inertia_of_its_own():
    """It would be turned by one of ours; a body at a constant speed, or that cannot turn, needs none."""
    scene = swing(1.0, 1.0)
    baumgarte = {"numerics.formulation": "baumgarte"}
    with pytest.raises(InputError, match=r"bodies\.rod\.inertia.*baumgarte"):
        linkage_of(scene.with_(baumgarte))
    linkage_of(scene.with_({**baumgarte, "mechanism.bodies.rod.inertia": 1e-3}))
    drive = {"kind": "constant-speed", "body": "rod", "speed": 6.0}
    linkage_of(swing(1.0, 1.0, drive=drive).with_(baumgarte))


def test_a_spring_that_the_follower_of_a_double_crank_winds_up_is_remarked():
    """The follower goes round with the crank, which its spring to the ground does not."""
    bars = {
        name: {"length": length, "mass": 0.2, "inertia": 1e-4, "start_angle": start}
        for name, length, start in (
            ("crank", 0.1, 1.0),
            ("coupler", 0.09, 0.3),
            ("follower", 0.11, 1.2),
        )
    }
    scene = planar_scene(
        bars,
        {
            "o1": {"kind": "revolute", "journal": "crank.a", "bearing": "ground.o"},
            "o2": {"kind": "revolute", "journal": "crank.b", "bearing": "coupler.a"},
            "o3": {"kind": "revolute", "journal": "coupler.b", "bearing": "follower.b"},
            "o4": {"kind": "revolute", "journal": "follower.a", "bearing": "ground.p"},
        },
        {"motor": {"kind": "constant-speed", "body": "crank", "speed": 6.0}},
        ground={"o": [0.0, 0.0], "p": [0.04, 0.0]},
        loads={"held": {"kind": "torsion-spring", "body": "follower", "stiffness": 0.1}},
        numerics=NUMERICS,
    )
    found = simulate(scene)
    assert "held is wound up by 2 turns" in found.attrs["cautions"]
    both = {"mechanism.loads.held.other": "crank"}
    assert "cautions" not in simulate(scene.with_(both)).attrs


def many(count):
    """So many pendulums beside a crank."""
    rods = {
        f"rod{k}": {"length": 1.0, "mass": 1.0, "inertia": 0.1, "start_angle": 0.02 * k}
        for k in range(count)
    }
    crank = {"crank": {"length": 0.1, "mass": 1.0, "inertia": 0.1}}
    pins = {
        f"pin_{name}": {"kind": "revolute", "journal": f"{name}.a", "bearing": "ground.o"}
        for name in (*crank, *rods)
    }
    motor = {"kind": "constant-speed", "body": "crank", "speed": 6.0}
    numerics = {**NUMERICS, "averaged_revolutions": 1}
    return planar_scene(
        {**crank, **rods}, pins, {"motor": motor}, effects={"gravity": G}, numerics=numerics
    )


def test_more_coordinates_than_there_is_room_for_are_one_message():
    """Before anything is compiled."""
    with pytest.raises(InputError, match=f"{at.MAX_COORDINATES + 1} coordinates"):
        linkage_of(many(at.MAX_COORDINATES + 1))


def test_a_chain_that_is_too_long_is_refused_before_its_text_is_written():
    """Each of its bodies is coupled with all others: it needs more room than as many bodies beside each other."""
    content = many(40).resolved()
    for k in range(1, 40):
        content["mechanism"]["joints"][f"pin_rod{k}"]["bearing"] = f"rod{k - 1}.b"
    with pytest.raises(InputError, match="shorter chains"):
        linkage_of(load_scene(content))


@pytest.mark.nightly
@pytest.mark.parametrize("method", ["auto", "radau"])
def test_sixty_four_coordinates_move_as_each_by_itself(method):
    """By explicit and implicit steps."""
    found = simulate(many(64).with_({"numerics.method": method}))
    assert int(found.status) == 0
    for k in (0, 40, 63):
        start = {"mechanism.bodies.rod0.start_angle": 0.02 * k}
        alone = simulate(many(1).with_(start))
        np.testing.assert_allclose(
            found.body_angle.to_numpy()[:, 1 + k], alone.body_angle.to_numpy()[:, 1], atol=1e-6
        )


def test_kept_revolutions_are_the_last_of_all():
    """The same numbers, and the same objective."""
    scene = swing(1.0, 1.0).with_({"numerics.averaged_revolutions": 5})
    whole, kept = simulate(scene), simulate(scene.with_({"output.keep_revolutions": 2}))
    assert len(kept.time) == 2 * 720 + 1
    for name in kept:
        both = [one[name].to_numpy() for one in (whole, kept)]
        if "time" in kept[name].dims:
            both[0] = both[0][-len(kept.time) :]
        np.testing.assert_array_equal(*both)

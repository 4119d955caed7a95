"""Sliding work of worn joints, through every stepper, against closed forms and an integration of its own."""

import math
from pathlib import Path

import commands
import numpy as np
import opened
import pytest
from margins import at_most, bootstrap
from oracle import SliderCrank
from refusals import refused
from running import HUNT_CROSSLEY, run, scene_with

import hpcclear
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.setup.problem import effects_of
from hpcclear.scene import load_scene

WEAR = {"length": "20 mm", "bearing": {"coefficient": 1e-15}}
WORN = {
    "effects.contact": HUNT_CROSSLEY,
    "joints.crank_rod.wear": WEAR,
    "joints.rod_slider.wear": {"length": 0.02, "journal": {"dimensionless": 1e-6, "hardness": "2 GPa"}},
}  # fmt: skip


class Sliding(SliderCrank):
    """The oracle, with normal force times sliding speed in the place of the gaps."""

    def derivative(self, t, y):
        powers = []
        for joint, (journal, bearing, speeds, spins) in zip(
            self.joints, self.ends(t, y), strict=True
        ):
            force, point = joint.forces(journal, bearing, speeds, spins)
            n = (journal - bearing) / max(abs(journal - bearing), 1e-300)
            slip = speeds[0] + 1j * spins[0] * (point - journal)
            slip -= speeds[1] + 1j * spins[1] * (point - bearing)
            powers.append(-(force * n.conjugate()).real * abs((slip * (1j * n).conjugate()).real))
        return [*super().derivative(t, y)[:8], *powers]


@pytest.fixture(scope="module")
def reference():
    """Sliding work of O12 and O23 over one revolution, J."""
    y, _ = Sliding(scene_with(WORN).resolved()).run(0, 1, "DOP853", 1e-13)
    return y[8:]


@pytest.mark.parametrize("method", ["dormand-prince", "radau", "prince-dormand"])
@pytest.mark.shortened(1)
def test_sliding_work_is_that_of_an_independent_integration(method, reference):
    """O23 slides back and forth: where its slip turns within a step, the error is by chance, whatever the tolerance."""
    errors = []
    for k in range(9):  # other steps each time
        scene = scene_with({**WORN, "numerics.method": method}, rtol=1e-12 * (1.0 + 0.02 * k))
        found = run(scene).out.sliding_work
        assert (found[2:] == 0.0).all()
        errors.append(np.abs(found[:2] / reference - 1.0))
    steady, turning = np.array(errors).T
    np.testing.assert_array_less(steady, 1e-10)
    at_most(bootstrap(np.median, turning, side="lower"), 1e-8)


ROTOR = {
    "format_version": 2,
    "mechanism": {
        "kind": "planar",
        "bodies": {"shaft": {"mass": 1.0, "inertia": 1e-3, "points": {"o": [0.0, 0.0]}}},
        "joints": {
            "main": {
                "kind": "clearance", "journal": "shaft.o", "bearing": "ground.o", "clearance": 1e-4,
                "bearing_radius": 0.02, "wear": WEAR,
                "materials": {
                    name: {"youngs_modulus": 2e11, "poisson_ratio": 0.3} for name in ("bearing", "journal")
                },
            }
        },
        "drives": {"motor": {"kind": "constant-speed", "body": "shaft", "speed": 100.0, "period": True}},
        "loads": {"weight": {"kind": "force", "place": "shaft.o", "force": [0.0, -500.0]}},
    },
    "effects": {"contact": {"law": "hunt-crossley", "damping": 1.0}},
    "numerics": {"rtol": 1e-12, "transient_revolutions": 40, "averaged_revolutions": 10},
}  # fmt: skip


QUICK = {
    "numerics.rtol": 1e-8, "numerics.transient_revolutions": 10, "numerics.averaged_revolutions": 2,
}  # fmt: skip
"""Of the rotor's lives."""


def sliding_radius(c):
    """Radius at which the rotor slides, m, with a bearing that wear has widened to a clearance; the depth is Hertz's."""
    radius, softness = 0.02 + c - 1e-4, 2.0 * (1.0 - 0.3**2) / 2e11
    stiffness = 4.0 / (3.0 * softness) * np.sqrt(radius * (radius - c) / c)
    depth = (500.0 / stiffness) ** (2.0 / 3.0)
    return radius - c - 0.5 * depth


def widening(coefficient):
    """Growth of its clearance in a revolution, m, as an equation for scipy."""
    slope = coefficient / (2.0 * math.pi * 0.02 * 0.02)
    return lambda _, c: slope * 500.0 * 2.0 * math.pi * sliding_radius(c)


def worn(folder, scene, *options):
    """What `wear` writes of a scene, and what it prints."""
    file = folder / "scene.toml"
    file.write_text(scene.to_toml(), encoding="utf-8")
    code, output = commands.run(["wear", str(file), "-o", str(folder / "out.nc"), *options], 0)
    assert code == 0, output
    return opened.read(folder / "out.nc", "wear"), output


@pytest.mark.parametrize("revolutions", [10, 20])
def test_a_journal_that_turns_under_a_constant_load_does_linear_work(revolutions):
    """F omega (R_J - d/2) for all the time; d is what Hertz's law says."""
    scene = load_scene(ROTOR).with_({"numerics.averaged_revolutions": revolutions})
    found = run(scene)
    power = 500.0 * 100.0 * sliding_radius(1e-4)
    assert float(found.out.sliding_power[0]) == pytest.approx(power, rel=1e-10)


INCH, POUND = 0.0254, 4.4482216152605
BUSHING = Path(__file__).parent.parent / "jobs" / "worn_bushing.toml"


@pytest.mark.parametrize(
    ("changes", "life"),
    [
        ({}, 16.7e6),
        ({
            "mechanism.joints.main.wear.length": 0.80 * INCH,
            "mechanism.joints.main.wear.bearing.coefficient": 4.0 / math.pi * 0.6e-10 / 720.0 * INCH**2 / POUND,
            "mechanism.drives.motor.speed": "400 rpm",
            "mechanism.loads.radial.force": [0.0, -200.0 * POUND],
            "wear.cycles": 30e6, "wear.limit.clearance": 25e-6 + 0.002 * INCH / math.pi,
         }, 24e6),
    ],
    ids=["12-22", "12-23"],
)  # fmt: skip
def test_bushings_of_a_textbook_wear_as_its_solutions_say(changes, life, tmp_path):
    """Shigley's Mechanical Engineering Design, 8th edition, solutions manual: 0.005 in after 16.7 million revolutions (1388 h);
    0.80 in of length for 0.002 in in 1000 h at 400 rev/min.

    Its depth goes with cos x over half of the bore: pi times the mean around it, of the same lost volume. Its numbers have
    two or three digits, and it leaves the play out, which takes 0.2 % off the sliding speed.
    """
    found, _ = worn(tmp_path, load_scene(BUSHING).with_(changes))
    assert float(found.lifetime[0]) == pytest.approx(life, rel=0.005)


@pytest.mark.parametrize(
    ("threshold", "share"), [(7e5, 0.0), (5e5, 1.0), (500.0 / (8e-4 * 1.05), 0.5)]
)
def test_a_pressure_below_the_threshold_does_no_work_that_wears(threshold, share):
    """The load's pressure is F/(2 R L) = 625 kPa; from a threshold to a tenth more the share that counts goes from 0 to 1."""
    plain = load_scene(ROTOR).with_({"numerics.transient_revolutions": 60})
    worn = plain.with_({"mechanism.joints.main.wear.threshold": threshold})
    (before, after) = (float(run(one).out.sliding_power[0]) for one in (plain, worn))
    assert after == pytest.approx(share * before, rel=1e-8)
    assert effects_of(plain).threshold is None


def test_work_above_a_threshold_is_that_of_an_independent_integration():
    """Two joints, one with a threshold that half of its work is below."""
    threshold = 5e6
    size = 2.0 * 0.02 * 0.02

    class Above(Sliding):
        def derivative(self, t, y):
            found = super().derivative(t, y)
            (journal, bearing, speeds, spins) = self.ends(t, y)[0]
            force, _ = self.joints[0].forces(journal, bearing, speeds, spins)
            n = (journal - bearing) / max(abs(journal - bearing), 1e-300)
            pressure = abs((force * n.conjugate()).real) / size
            found[8] *= min(max((pressure / threshold - 1.0) / 0.1, 0.0), 1.0)
            return found

    scenes = [
        scene_with({**WORN, "joints.crank_rod.wear.threshold": threshold}, rtol=rtol)
        for rtol in (1e-14, 2e-14, 4e-14, 1e-13, 1e-12)
    ]
    y, _ = Above(scenes[0].resolved()).run(0, 1, "DOP853", 1e-11)
    works = np.array([run(scene).out.sliding_work[:2] for scene in scenes])
    # the ramp ends within steps: the first error is by chance, about 1e-6 whatever the tolerance
    errors = np.abs(works / y[8:] - 1.0)
    at_most(np.median(errors[:, 0]), 5e-6)
    at_most(errors[:, 1].max(), 1e-6)
    found = works[0]
    all_of_it = float(run(scene_with(WORN, rtol=1e-11)).out.sliding_work[0])
    assert 0.1 * all_of_it < found[0] < 0.95 * all_of_it


def test_sliding_work_is_told_where_a_joint_wears_and_nothing_else_changes():
    plain = hpcclear.evaluate(scene_with({"effects.contact": HUNT_CROSSLEY}), {"m3": [0.14]})
    worn = hpcclear.evaluate(scene_with(WORN), {"m3": [0.14]})
    assert "sliding_work" not in plain
    assert float(worn.objective[0]) == float(plain.objective[0])
    assert (worn.sliding_work.values > 1.0).all()


def test_wear_is_an_effect_of_scenes_with_a_worn_joint():
    assert effects_of(scene_with(WORN)).wear == 1
    assert effects_of(scene_with()).wear is None
    ideal = scene_with({**WORN, "joints.crank_rod": {"kind": "ideal"}})
    assert ideal.worn_joints() == ("rod_slider",)
    assert "wear of joint rod_slider" in ideal.effects_on()
    assert len(at.measures_of(effects_of(ideal))) == 1


@pytest.mark.parametrize(
    ("entry", "key"),
    [
        ({"length": 0.02, "bearing": {"coefficient": -1e-15}}, "bearing.coefficient"),
        ({"length": 0.02, "journal": {"dimensionless": 1e-6}}, "journal.hardness"),
        ({"length": 0.02, "journal": {"hardness": 1e9}}, "journal.coefficient"),
        (
            {"length": 0.02, "journal": {"coefficient": 1e-15, "dimensionless": 1e-6}},
            "journal.coefficient",
        ),
        ({"length": 0.02}, "bearing"),
        ({**WEAR, "threshold": 0.0}, "threshold"),
        ({**WEAR, "running_in": {"factor": 0.5, "work": 1e6}}, "running_in.factor"),
        ({**WEAR, "running_in": {"factor": 2.0, "work": 0.0}}, "running_in.work"),
        ({**WEAR, "running_in": {"factor": 2.0}}, "running_in.work"),
        ({"length": 0.0, "bearing": {"coefficient": 1e-15}}, "length"),
        ({"bearing": {"coefficient": 1e-15}}, "length"),
    ],
)
def test_what_is_no_wear_is_refused(entry, key):
    with refused(f"joints.crank_rod.wear.{key}"):
        scene_with({"joints.crank_rod.wear": entry})

"""Surfaces that are out of round, and where around them work is done: an integration of its own, energies, closed forms."""

import cmath
import math
from dataclasses import replace

import numpy as np
import pytest
from oracle import SliderCrank
from refusals import refused
from running import HUNT_CROSSLEY, run, scene_with
from scipy.optimize import brentq
from some_laws import row
from test_wear import QUICK, ROTOR, WEAR, worn

from hpcclear.base.asking import answered
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout.views import Outcome
from hpcclear.dynamics.planar import energy
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.problem import problem_of
from hpcclear.dynamics.setup.start import start_states
from hpcclear.dynamics.wear.curves import curves, lifetime
from hpcclear.dynamics.wear.law import Joints
from hpcclear.dynamics.wear.life import LifePlan, WearOutcome, life
from hpcclear.dynamics.wear.relief import Relief, kernel
from hpcclear.report import profile_figure
from hpcclear.scene import load_scene

WAVES = {
    "crank_rod": {
        "bearing": {"cosine_1": 2e-5, "sine_1": -1e-5, "cosine_2": "30 um", "sine_3": 1e-5},
        "journal": {"sine_2": 2e-5},
    },
    "rod_slider": {"bearing": {"sine_1": 3e-5, "cosine_3": -1e-5}, "journal": {"cosine_1": 1e-5}},
}
WAVY = {
    "effects.contact": HUNT_CROSSLEY,
    "effects.friction": {"law": "coulomb", "coefficient": 0.05},
    **{f"joints.{name}.out_of_round": waves for name, waves in WAVES.items()},
}
WORN = {f"joints.{name}.wear": WEAR for name in WAVES}
ANGULAR = {"wear": {"profile": "angular", "harmonics": 3}}


class Wavy(SliderCrank):
    """The oracle with surfaces out of round: the normal force acts by the derivatives of the gap, by complex steps, and
    friction at a point of the bearing. In the places of the integrals of gaps stand those of sliding work of O12 times one and
    times the cosine of three times the contact's angle in the rod."""

    waves: tuple = ()

    def depth(self, waves, direction, turn):
        """Sum of waves of a surface; `direction`: (cosine, sine), complex numbers where a step is taken."""
        total = 0.0
        own = (
            direction[0] * np.cos(turn) + direction[1] * np.sin(turn),
            direction[1] * np.cos(turn) - direction[0] * np.sin(turn),
        )
        c, s = 1.0, 0.0
        for n in range(1, 9):
            c, s = c * own[0] - s * own[1], s * own[0] + c * own[1]
            total = total + waves.get(f"cosine_{n}", 0.0) * c + waves.get(f"sine_{n}", 0.0) * s
        return total

    def gap_of(self, k, x, y, bearing_turn, journal_turn):
        length = np.sqrt(x * x + y * y + 1e-300)  # journals start centred
        waves, direction = self.waves[k], (x / length, y / length)
        round_gap = length - self.joints[k].clearance
        deep = self.depth(waves.get("bearing", {}), direction, bearing_turn)
        return round_gap - deep - self.depth(waves.get("journal", {}), direction, journal_turn)

    def derivative(self, t, y):
        total, moment, on_slider = 0j, 0.0, 0.0
        centre = complex(y[0], y[1])
        turns = ((y[2], self.speed * t), (y[2], 0.0))
        works = []
        for k, (journal, bearing, speeds, spins) in enumerate(self.ends(t, y)):
            joint, e = self.joints[k], journal - bearing
            at_, step = [e.real, e.imag, *turns[k]], 1e-25
            gap = self.gap_of(k, *at_)
            slopes = []
            for entry in range(4):
                moved = [complex(value) for value in at_]
                moved[entry] += 1j * step
                slopes.append(self.gap_of(k, *moved).imag / step)
            v = speeds[0] - speeds[1]
            rate = slopes[0] * v.real + slopes[1] * v.imag
            rate += slopes[2] * spins[1] + slopes[3] * spins[0]
            depth = max(gap, 0.0)
            normal = max(joint.stiffness * depth**1.5 * (1.0 + joint.damping * rate), 0.0)
            n = e / max(abs(e), 1e-150)
            deep = self.depth(self.waves[k].get("bearing", {}), (n.real, n.imag), turns[k][0])
            point = bearing + n * (joint.bearing_radius + deep + 0.5 * depth)
            slip = v + 1j * spins[0] * (point - journal) - 1j * spins[1] * (point - bearing)
            sliding = (slip * (1j * n).conjugate()).real
            tangential = joint.friction * normal * max(-1.0, min(1.0, sliding / joint.ramp))
            push = -normal * complex(slopes[0], slopes[1])  # on the journal
            rub = -tangential * 1j * n
            total -= push + rub
            moment -= normal * slopes[2] + ((bearing - centre).conjugate() * push).imag
            moment -= ((point - centre).conjugate() * rub).imag
            on_slider = (push + rub).real
            if k == 0:
                angle = cmath.phase(e) - turns[k][0]
                works = [normal * abs(sliding), normal * abs(sliding) * math.cos(3.0 * angle)]
        a = total / self.mass
        return [
            *y[4:8], a.real, a.imag - self.gravity, moment / self.inertia, on_slider / self.slider_mass, *works,
        ]  # fmt: skip


@pytest.fixture(scope="module")
def reference():
    """State after a revolution, and the two works."""
    scene = scene_with(WAVY).resolved()
    oracle = Wavy(scene)
    oracle.waves = tuple(scene["joints"][name]["out_of_round"] for name in WAVES)
    y, _ = oracle.run(0, 1, "DOP853", 1e-12)
    return y


SHARE = {"dormand-prince": 2e-6, "radau": 2e-6, "prince-dormand": 2e-3}
METHODS = [
    "dormand-prince",
    pytest.param("radau", marks=pytest.mark.full),
    pytest.param("prince-dormand", marks=pytest.mark.full),
]


@pytest.mark.parametrize("method", METHODS)
def test_motion_and_profile_are_those_of_an_independent_integration(method, reference):
    scene = scene_with({**WAVY, **WORN, **ANGULAR, "numerics.method": method}, rtol=1e-12)
    found = run(scene).out
    np.testing.assert_allclose(found.coordinates(4), reference[:4], rtol=1e-9, atol=1e-11)
    np.testing.assert_allclose(found.velocities(4), reference[4:8], rtol=1e-8, atol=1e-6)
    profile = found.profile * float(found.time)
    np.testing.assert_allclose(found.sliding_work[0], reference[8], rtol=1e-8)
    # told at one angle a step: the longer steps are, the less exactly
    assert profile[4] == pytest.approx(reference[9], abs=SHARE[method] * reference[8])
    assert abs(profile[4]) > 0.1 * reference[8]


@pytest.mark.parametrize(
    "entries",
    [
        {},
        {"numerics.formulation": "baumgarte"},
        pytest.param({"joints.crank_rod": {"kind": "ideal"}}, marks=pytest.mark.full),
        pytest.param(
            {"drive": {"kind": "torque", "initial_speed": "5000 rpm", "torque": 5.0}},
            marks=pytest.mark.full,
        ),
    ],
)
def test_waves_take_nothing_from_the_energy(entries):
    changes = {**WAVY, **entries, "numerics.energy": True}
    if "joints.crank_rod" in entries:
        changes.pop("joints.crank_rod.out_of_round")
    scene = scene_with(changes, rtol=1e-11)
    n, par = problem_of(scene).coordinates, parameters(scene)
    start = start_states(scene, par)
    out = Outcome(run(scene).out.rows[None])
    assert (
        float(energy.errors(scene, par, energy.of_starts(scene, par, start, n), out, n)[0]) < 1e-9
    )


# ---- a turning journal under a constant load ---------------------------------------------------


def rotor(**entries):
    return load_scene(ROTOR).with_(entries)


def test_a_journal_rests_where_an_oval_bearing_is_lowest():
    """h = a cos 2 x + b sin 2 x under a load (0, -F): N = -F sin x along e, N h'/|e| = F cos x across it."""
    a, b, force = 1e-5, 6e-6, 500.0
    round_one = rotor()
    first = row("contact", round_one.effects.contact.law, "stiffness")
    stiffness = parameters(round_one)[0, at.JOINT_BLOCKS + first]

    def rest(angle):
        """What is left across e, N, and |e|."""
        h = a * math.cos(2 * angle) + b * math.sin(2 * angle)
        slope = 2.0 * (b * math.cos(2 * angle) - a * math.sin(2 * angle))
        normal = -force * math.sin(angle)
        e = 1e-4 + h + (normal / stiffness) ** (2.0 / 3.0)
        return normal * slope / e - force * math.cos(angle), e

    angle = brentq(lambda z: rest(z)[0], -2.0, -1.2, xtol=1e-15)
    place = cmath.rect(rest(angle)[1], angle)
    scene = rotor(**{
        "mechanism.joints.main.out_of_round": {"bearing": {"cosine_2": a, "sine_2": b}},
        "mechanism.joints.main.start_eccentricity": {"x": place.real, "y": place.imag},
        "numerics.transient_revolutions": 0,
    })  # fmt: skip
    found = run(scene)
    assert np.abs(found.q - [place.real, place.imag]).max() < 1e-12
    assert abs(angle + 0.5 * math.pi) > 0.02  # it is not below the centre


def test_the_work_of_a_journal_at_rest_is_done_in_one_place():
    """Under a constant load a round bearing is worn at its lowest angle, the journal that turns all around."""
    wear = {**WEAR, "journal": WEAR["bearing"]}
    scene = rotor(
        **{"mechanism.joints.main.wear": wear, "wear": {"profile": "angular", "harmonics": 3}}
    )
    out = run(scene).out
    bearing = out.profile[:6] / out.sliding_power[0]
    journal = out.profile[6:12] / out.sliding_power[0]
    angles = -0.5 * math.pi * np.arange(1, 4)
    np.testing.assert_allclose(
        bearing, np.stack([np.cos(angles), np.sin(angles)], -1).ravel(), atol=1e-6
    )
    np.testing.assert_allclose(journal, 0.0, atol=1e-6)


@pytest.mark.parametrize(
    ("entry", "key"),
    [
        ({"joints.crank_rod.out_of_round": {"bearing": {"cosine_1": "0.4 mm"}}},
         "joints.crank_rod.out_of_round.bearing"),
        ({"joints.crank_rod.out_of_round": {"bearing": {"cosine_9": 1e-6}}},
         "joints.crank_rod.out_of_round.bearing.cosine_9"),
        ({"joints.crank_rod.out_of_round": {"journal": {"sine_1": 1e-6}},
          "joints.crank_rod.film": {"viscosity": 1e-3, "length": 0.02, "model": "short"}},
         "joints.crank_rod.out_of_round"),
        ({"wear": {"profile": "lumpy"}}, "wear.profile"),
        ({"wear": {"profile": "angular"}, "joints.crank_rod.wear": WEAR,
          "joints.crank_rod.film": {"viscosity": 1e-3, "length": 0.02, "model": "short"}}, "wear.profile"),
        ({"wear": {"harmonics": 0}}, "wear.harmonics"),
    ],
)  # fmt: skip
def test_what_is_no_wave_is_refused(entry, key):
    with refused(key):
        scene_with({"effects.contact": HUNT_CROSSLEY, **entry})


# ---- lives -------------------------------------------------------------------------------------


def test_patches_take_nothing_on_and_are_the_narrowest():
    """The kernel is never negative, its mean is 1, and l_1 = cos(pi/(H + 2))."""
    angles = np.linspace(0.0, 2.0 * np.pi, 10_000, endpoint=False)
    for waves in range(1, 9):
        weights = kernel(waves)
        every = 1.0 + 2.0 * weights @ np.cos(np.outer(np.arange(1, waves + 1), angles))
        assert every.min() > -1e-12
        assert weights[0] == pytest.approx(math.cos(math.pi / (waves + 2)), rel=1e-12)


ONE = Joints(*(np.array([x]) for x in (3e-4, 0.02, 2e-12, 1e-12, 0.0, 1.0)))
PLAN = LifePlan(cycles=1e6, tolerance=0.01, shortest=5.0, copies=4, most_copies=16)


def followed(joints, relief, rate, share):
    """A life whose work and its moments are functions of the state: rate(clearance), share(moments) (joints, size)."""

    def seen(asked):
        n = len(asked.copies)
        work = np.repeat(rate(joints.worn(asked.work)[0])[None], n, axis=0)
        moments = None
        if relief.size:
            moments = work[..., None] * share(asked.moments)
        return WearOutcome(work, np.ones(n), np.ones((n, 1)), np.zeros(n, int), moments)

    return answered(life(joints, PLAN, relief), seen)


def test_a_life_without_waves_in_its_work_is_an_even_one():
    def rate(clearance):
        return 50.0 * (clearance / 3e-4) ** 1.3

    relief = Relief(3, 2)
    even = followed(ONE, Relief(), rate, None)
    found = followed(ONE, relief, rate, lambda moments: np.zeros_like(moments))
    at_ = np.linspace(0.0, 1e6, 9)
    seen, plain = curves(found, ONE, at_, relief), curves(even, ONE, at_)
    np.testing.assert_array_equal(seen.clearance, plain.clearance)
    np.testing.assert_allclose(seen.local, plain.clearance, rtol=1e-14)
    assert found.simulations == even.simulations


def test_work_in_one_place_digs_as_the_kernel_says():
    """Constant work at 1 rad of the bearing and 2 rad of the journal, running in: depths at their deepest."""
    relief = Relief(3, 2)
    joints = replace(ONE, excess=np.array([4.0]), fading=np.array([1e7]))
    share = np.concatenate(
        [np.stack([np.cos(n * x), np.sin(n * x)]) for x, count in ((1.0, 3), (2.0, 2)) for n in range(1, count + 1)]
    )[None]  # fmt: skip
    found = followed(joints, relief, lambda c: np.array([50.0]), lambda moments: share)
    cycles = np.linspace(0.0, 1e6, 2001)
    seen = curves(found, joints, cycles, relief, np.array([1.0, 2.0, 4.0]))
    counted = joints.counted(50.0 * cycles[:, None])[:, 0]
    deep = [1.0 + 2.0 * kernel(count).sum() for count in (3, 2)]
    truth = 3e-4 + (2e-12 * deep[0] + 1e-12 * deep[1]) * counted
    np.testing.assert_allclose(seen.local[:, 0], truth, rtol=1e-10)
    over = float(np.interp(4e-4, truth, cycles))
    assert lifetime(found, joints, {"clearance": 4e-4}, relief) == pytest.approx(over, rel=1e-3)


def test_grooves_that_turn_their_own_work_aside_are_followed():
    """Work whose share of one wave falls as the wave grows, against a fine integration."""
    relief = Relief(1, 0)
    found = followed(
        ONE, relief, lambda c: np.array([50.0]), lambda m: np.exp(-m / 2e7) * np.array([1.0, 0.0])
    )
    work = 50.0 * 1e6
    truth = 2e7 * math.log1p(work / 2e7)  # dm = exp(-m/2e7) dW
    end = found.nodes[-1].moments[0]
    depth = 2.0 * kernel(1)[0] * 2e-12
    assert abs(end[0] - truth) * depth <= found.error[0]
    assert found.error[0] < 0.02 * 3e-4
    assert end[1] == 0.0


def test_an_angular_life_of_a_turning_journal(tmp_path):
    """Its bearing is worn in one place, its journal evenly: closed forms, and the same clearance as of even wear."""
    wear = {**WEAR, "journal": {"coefficient": 5e-16}}
    lives = {"cycles": 1e6, "tolerance": 1e-3, "points": 3, "profile": "angular", "harmonics": 2}
    scene = rotor(**QUICK, **{"mechanism.joints.main.wear": wear, "wear": lives})
    found, output = worn(tmp_path, scene, "--details")
    assert "with uniform wear" in " ".join(output.split())
    np.testing.assert_allclose(found.clearance, found.even_clearance, rtol=1e-5)
    assert (found.local_clearance >= found.clearance).all()
    end = found.isel(cycle=-1, joint=0, quantile=2)
    assert float(end.bearing_depth[0]) > 1e-5
    deep = 1.0 + 2.0 * kernel(2) @ np.cos(np.outer([1.0, 2.0], found.angle + 0.5 * math.pi))
    np.testing.assert_allclose(end.bearing_profile, float(end.bearing_depth[0]) * deep, atol=1e-9)
    np.testing.assert_allclose(end.journal_profile, float(end.journal_depth[0]), rtol=1e-5)
    assert profile_figure(found) is not None

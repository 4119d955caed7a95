"""Andrews' squeezer (IFToMM's benchmark A03): seven bodies, three loops without clearance, a spring and a torque.

Data and the state at 0.03 s are those of the Test Set for Initial Value Problem Solvers (Mazzia and Magherini 2008).
"""

import numpy as np
import pytest
from linkages import load, revolute, torque_drive
from plain_lane import Lane
from scipy.integrate import solve_ivp

from hpcclear.dynamics.linkage.assembly import assemble
from hpcclear.dynamics.linkage.generator import On
from hpcclear.dynamics.linkage.mechanism import Mechanism
from hpcclear.dynamics.linkage.parts import Body

D, DA, E, EA, ZF, FA, RR, RA = 0.028, 0.0115, 0.02, 0.01421, 0.02, 0.01421, 0.007, 0.00092
SS, SA, SB, SC, SD, TA, TB = 0.035, 0.01874, 0.01043, 0.018, 0.02, 0.02308, 0.00916
U, UA, UB, ZT = 0.04, 0.01228, 0.00449, 0.04
ORIGIN = (0.0, 0.0)
# the test set's angles at the start; beta and Theta, gamma, Phi, delta, Omega, epsilon
BETA, THETA, GAMMA, PHI, DELTA, OMEGA, EPSILON = (
    -0.0617138900142764496358948458001, 0.0, 0.455279819163070380255912382449,
    0.222668390165885884674473185609, 0.487364979543842550225598953530,
    -0.222668390165885884674473185609, 1.23054744454982119249735015568,
)  # fmt: skip
END = np.array([
    0.1581077119629904e2, -0.1575637105984298e2, 0.4082224013073101e-1, -0.5347301163226948,
    0.5244099658805304, 0.5347301163226948, 0.1048080741042263e1,
])  # fmt: skip
END_RATES = np.array([
    0.1139920302151208e4, -0.1424379294994111e4, 0.1103291221937134e2, 0.1929337464421385e2,
    0.5735699284790808, -0.1929337464421385e2, 0.3231791658026955,
])  # fmt: skip
NAMES = ("k1", "k2", "k3", "k4", "k5", "k6", "k7")


def squeezer():
    bodies = (
        Body("k1", 0.04325, 2.194e-6, (RA, 0.0), {"o": ORIGIN, "b": (RR, 0.0)}, BETA),
        Body("k2", 0.00365, 4.410e-7, (-DA, 0.0), {"b": ORIGIN, "f": (-D, 0.0)}, BETA + THETA),
        Body("k3", 0.02373, 5.255e-6, (SB, -SA), {"o": ORIGIN, "f": (0.0, -SS), "d": (SD, -SC)}, GAMMA),
        Body("k4", 0.00706, 5.667e-7, (0.0, EA - E), {"g": ORIGIN, "f": (0.0, -E)}, PHI + DELTA),
        Body("k5", 0.07050, 1.169e-5, (TA, TB), {"o": ORIGIN, "g": (ZT, 0.0)}, DELTA),
        Body("k6", 0.00706, 5.667e-7, (ZF - FA, 0.0), {"h": ORIGIN, "f": (ZF, 0.0)}, OMEGA + EPSILON),
        Body("k7", 0.05498, 1.912e-5, (-UB, -UA), {"o": ORIGIN, "h": (0.0, -U)}, EPSILON),
    )  # fmt: skip
    pins = (
        ("o", "k1.o", "ground.o"), ("b", "k2.b", "k1.b"), ("at_b", "k3.o", "ground.b"),
        ("at_a", "k5.o", "ground.a"), ("also_at_a", "k7.o", "ground.a"), ("g", "k4.g", "k5.g"),
        ("h", "k6.h", "k7.h"), ("f3", "k2.f", "k3.f"), ("f4", "k2.f", "k4.f"), ("f6", "k2.f", "k6.f"),
    )  # fmt: skip
    ground = {"o": ORIGIN, "a": (-0.06934, -0.00227), "b": (-0.03635, 0.03273), "c": (0.014, 0.072)}
    return Mechanism(
        bodies, tuple(revolute(*pin) for pin in pins), (torque_drive("motor", "k1", 0.033, 1.0),),
        ground, (load("spring", "spring", first="k3.d", second="ground.c", stiffness=4530.0, length=0.07785),),
    )  # fmt: skip


def test_assembly_is_the_test_set_s_start():
    assembly = assemble(squeezer())
    angles = [assembly.angle(name) for name in NAMES]
    meant = [body.start_angle for body in squeezer().bodies]
    np.testing.assert_allclose(angles, meant, atol=1e-12)


@pytest.mark.parametrize("feedback", [0.0, 200.0])
def test_state_at_the_end_is_the_test_set_s(feedback):
    """Lanes' text, integrated by Dormand and Prince's eighth order; both loops of K2 to K6 as multipliers."""
    lane = Lane(squeezer(), On(), feedback=(feedback, feedback))
    names = [one.body for one in lane.text.forest.coordinates]
    assert len(lane.text.constraints) == 6
    assert sorted(names) == sorted(NAMES)
    start = np.array([squeezer().body(name).start_angle for name in names])

    def rates(t, y):
        return np.concatenate([y[7:], lane(y[:7], y[7:], t)[0]])

    y0 = np.concatenate([start, np.zeros(7)])
    y = solve_ivp(rates, (0.0, 0.03), y0, "DOP853", rtol=1e-11, atol=1e-11).y[:, -1]
    angle, rate = ({n: y[7 * k + names.index(n)] for n in NAMES} for k in (0, 1))
    for values, expected, tolerance in ((angle, END, 1e-8), (rate, END_RATES, 1e-6)):
        found = [
            values["k1"], values["k2"] - values["k1"], values["k3"], values["k4"] - values["k5"],
            values["k5"], values["k6"] - values["k7"], values["k7"],
        ]  # fmt: skip
        np.testing.assert_allclose(found, expected, rtol=tolerance, atol=tolerance)

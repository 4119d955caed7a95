"""Bars that bend between their ends: terms of the motion's text, their numbers, and the energy.

The axis of a bar of length L, seen from the line between its ends a (s = 0) and b, is displaced across by
w = sum of q_i sin(i pi s/L), and along by u(s) = -1/2 of the integral of w'^2 from a to s: bending does not lengthen it, so b
comes nearer to a by delta = sum of kappa_i q_i^2/2. Kinetic energy is kept to second order in w, as of which u counts,
strain energy is that of Euler and Bernoulli's beam. With P the place of the straight bar's mass centre, (e, n) the axes
along and across,

    T = T_rigid + P'.D' + theta' sum X_i q_i' + M/4 sum q_i'^2 + theta'^2 q.B q/2,    D = U e + W n,
    W = sum S_i q_i,    U = -q.G q/2,    V = sum k_i q_i^2/2.

The axial force is in it: of inertia by G and B, of what pulls at b by delta. Whatever the stated mass, mass centre and
inertia leave beside the uniform bar (`uniform_share`) is rigid: big ends, bosses.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.terms import ZERO, Term, Vector, named
from hpcclear.dynamics.linkage.expression import Writer
from hpcclear.dynamics.linkage.parts import Body, Number

SHORTEST = 0.005
"""By how much of its length a bar may get shorter: 4.5 % of deflection in the first mode.

Beyond that deflections are not small. The kinetic energy that is kept is none any more, for some velocities, from 12 % on with
one mode, and from 6 or 7 % with four: steps end before."""
_HALF, _TWO = named("0.5"), named("2.0")


def kind_of(mode: int) -> str:
    """The kind of a mode's coordinate; modes count from 1."""
    return f"bend{mode}"


class Bend:
    """Terms of one bar; vectors are held in its frame. What several places need is written down once.

    `kinds`: of its coordinates; `q`, `v`: amplitudes, m, and their velocities.
    """

    def __init__(self, body: Body, writer: Writer) -> None:
        assert body.bending is not None
        self.name, self.writer = body.name, writer
        self.modes = range(1, body.bending.modes + 1)
        self.kinds = tuple(kind_of(mode) for mode in self.modes)
        self.q = tuple(named(f"{kind}_{body.name}") for kind in self.kinds)
        self.v = tuple(named(f"v{kind}_{body.name}") for kind in self.kinds)
        self._bound: Term | None = None

    def number(self, entry: str) -> Term:
        """A number of the bar, as `entries` has them."""
        return self.writer.parameter(f"{self.name}_bend_{entry}")

    def _let(self, name: str, term: Term) -> Term:
        return self.writer.let(f"{name}_{self.name}", term)

    def lateral(self, mode: int) -> Term:
        """S of a mode: first moment across; even ones have none."""
        return self.number(f"lateral_{mode}") if mode % 2 else ZERO

    def _pair(self, entry: str, i: int, j: int) -> Term:
        if entry == "axial" and i != j and (i - j) % 2 == 0:
            return ZERO
        return self.number(f"{entry}_{min(i, j)}{max(i, j)}")

    def _sum(
        self, factor: Callable[[int], Term], others: Sequence[Term], start: Term = ZERO
    ) -> Term:
        """Factors by mode times amplitudes or velocities, added to a term."""
        both = zip(self.modes, others, strict=True)
        return sum((factor(mode) * other for mode, other in both), start)

    def _times(self, entry: str, mode: int) -> Term:
        """Row of G ("axial") or B ("spun") times the amplitudes."""
        return self._let(f"{entry}{mode}", self._sum(lambda k: self._pair(entry, mode, k), self.q))

    def _dotted(self, entry: str, others: Sequence[Term]) -> Term:
        return self._sum(lambda mode: self._times(entry, mode), others)

    # ---- places -------------------------------------------------------------------------------------
    def shortening(self) -> Term:
        """delta, m."""
        total = self._sum(lambda k: self.number(f"nearer_{k}") * self.q[k - 1], self.q)
        return self._let("shorter", _HALF * total)

    def nearer(self, mode: int) -> tuple[Term, Term]:
        """Derivatives of delta by an amplitude: first and second."""
        second = self.number(f"nearer_{mode}")
        return self._let(f"nearer{mode}", second * self.q[mode - 1]), second

    def slope(self, mode: int, point: str) -> Term:
        """By how much the end at a point turns with an amplitude, rad/m."""
        slope = self.number(f"slope_{mode}")
        return -slope if point == "b" and mode % 2 else slope

    def end_spin(self, spin: Term, point: str) -> Term:
        """Angular velocity of the end at a point."""
        turned = self._sum(lambda mode: self.slope(mode, point), self.v, spin)
        return self._let(f"spin_{point}", turned)

    # ---- inertia ------------------------------------------------------------------------------------
    def moved(self) -> Vector:
        """D, kg m."""
        across = self._sum(self.lateral, self.q)
        along = -(_HALF * self._dotted("axial", self.q))
        return Vector(self._let("along", along), self._let("across", across))

    def moved_by(self, mode: int) -> Vector:
        """Derivative of D by an amplitude."""
        return Vector(-self._times("axial", mode), self.lateral(mode))

    def moving(self) -> Vector:
        """Rate of D while the bar does not turn."""
        across = self._let("vacross", -self._sum(self.lateral, self.v))
        return Vector(across, self._let("valong", -self._dotted("axial", self.v)))

    def gathering(self) -> Term:
        """Second derivative of D along the bar while no amplitude accelerates."""
        rows = partial(self._pair, "axial")
        total = self._sum(lambda i: self._sum(partial(rows, i), self.v), self.v)
        return self._let("gathering", -total)

    def spun(self) -> Term:
        """q.B q, by how much its inertia has grown."""
        return self._let("spun", self._dotted("spun", self.q))

    # ---- forces -------------------------------------------------------------------------------------
    def braking(self, spin: Term) -> Term:
        """Moment that turning needs since the inertia grows."""
        return -(_TWO * spin * self._dotted("spun", self.v))

    def _beyond(self) -> Term:
        """Zero as long as deflections are small, else what no step gets through."""
        if self._bound is None:
            shorter, most = (self.writer.text(t) for t in (self.shortening(), self.number("most")))
            self._bound = named(self.writer.fresh(f"beyond_{self.name}"))
            self.writer.line(f"{self._bound.name} = 0.0 if {shorter} < {most} else 1e300")
        return self._bound

    def restoring(self, mode: int, spin: Term) -> Term:
        """Force on an amplitude: what turning throws outwards, less spring and damper."""
        thrown = self._times("spun", mode) * spin * spin - self._beyond()
        spring = self.number(f"stiffness_{mode}") * self.q[mode - 1]
        return thrown - spring - self.number(f"damping_{mode}") * self.v[mode - 1]

    def loss(self) -> Term:
        """Power that damping takes, W."""
        return self._sum(lambda k: self.number(f"damping_{k}") * self.v[k - 1], self.v)


# ---- numbers --------------------------------------------------------------------------------------------


def entries(modes: int) -> tuple[str, ...]:
    """Names of a bar's numbers, without ``NAME_bend_``."""
    rows = range(1, modes + 1)
    single = ("lateral", "turned", "nearer", "slope", "stiffness", "damping")
    pairs = [f"{i}{j}" for i in rows for j in rows if i <= j]
    by_mode = (f"{entry}_{i}" for entry in single for i in rows)
    by_pair = (f"{entry}_{pair}" for entry in ("axial", "spun") for pair in pairs)
    return ("mass", "inverse_mass", "most", *by_mode, *by_pair)


def uniform_share(mass: Number, inertia: Number, length: Number, center: Number) -> Number:
    """Mass of the largest uniform bar that leaves a rigid body, kg: of a uniform bar, all of it.

    What it leaves of mass, first moment and inertia is that of a body as long as no mass is negative:
    (m - M)(J - M L^2/3) >= (m c - M L/2)^2, with J about a. `center`: from a, m.
    """
    own = mass * length * length / 12.0
    shifted = mass * (center - 0.5 * length) ** 2
    root = np.sqrt((inertia - own) ** 2 + shifted * (2.0 * (inertia + own) + shifted))
    return 2.0 * mass * inertia / (inertia + own + shifted + root)


def numbers(bar: Body) -> dict[str, Number]:
    """Values of `entries`, SI, single ones or of samples (m,), of a body with bending."""
    bending, length, c = bar.bending, bar.points["b"][0], bar.center[0]
    share, modes = uniform_share(bar.mass, bar.inertia, length, c), bending.modes
    density = share / length
    found: dict[str, Number] = {"mass": 0.5 * share, "inverse_mass": 2.0 / share}
    found["most"] = SHORTEST * length
    wave = {i: i * np.pi / length for i in range(1, modes + 1)}
    for i, a in wave.items():
        sign = -1.0 if i % 2 else 1.0
        lateral = density * (1.0 - sign) / a
        rate = a * a * np.sqrt(bending.stiffness / density)  # rad/s, of the bar held at its ends
        found |= {
            f"lateral_{i}": lateral,
            f"turned_{i}": -sign * density * length / a - c * lateral,
            f"nearer_{i}": 0.5 * a * a * length,
            f"slope_{i}": a,
            f"stiffness_{i}": 0.5 * bending.stiffness * a**4 * length,
            f"damping_{i}": bending.damping * rate * share,
        }
        for j in range(i, modes + 1):
            scale = density * a * wave[j]
            zeroth = 0.5 * length if i == j else 0.0 * length
            first = _moment(i, j, length, 1)
            second = _moment(i, j, length, 2)
            # tension of what lies beyond s, per acceleration and per squared turning
            found[f"axial_{i}{j}"] = scale * (length * zeroth - first)
            pulled = scale * (0.5 * length * (length - 2.0 * c) * zeroth - 0.5 * second + c * first)
            found[f"spun_{i}{j}"] = (0.5 * share if i == j else 0.0) - pulled
    return found


def _moment(i: int, j: int, length: Number, power: int) -> Number:
    """Integral of s^power cos(i pi s/L) cos(j pi s/L) over the bar; power 1 or 2."""

    def one(k: int) -> Number:
        if k == 0:
            return length ** (power + 1) / (power + 1)
        sign = -1.0 if k % 2 else 1.0
        wave = k * np.pi / length
        return (sign - 1.0) / wave**2 if power == 1 else 2.0 * length * sign / wave**2

    return 0.5 * (one(i - j) + one(i + j))


class Bent(NamedTuple):
    """What bending adds: kinetic and strain energy, J, first moments along and across, kg m, and delta, m."""

    kinetic: Array
    strain: Array
    moved: tuple[Array, Array]
    shorter: Array

    def raised(self, angle: Array) -> Array:
        """First moment against y = 0 that bending adds, kg m, with the bar at angles (m,)."""
        return np.sin(angle) * self.moved[0] + np.cos(angle) * self.moved[1]


def bent(
    found: Mapping[str, Number], q: Array, v: Array, turning: tuple[Array, Array, Array]
) -> Bent:
    """Of amplitudes and velocities (modes, m), with what `numbers` found.

    `turning`: velocities along and across of the straight bar's mass centre, m/s, and the angular velocity, rad/s; (m,).
    """
    rows = range(1, len(q) + 1)
    along, across, spin = turning

    def quadratic(entry: str, a: Array, b: Array) -> Array:
        pairs = ((found[f"{entry}_{min(i, j)}{max(i, j)}"], i, j) for i in rows for j in rows)
        return np.asarray(sum(one * a[i - 1] * b[j - 1] for one, i, j in pairs))

    def linear(entry: str, a: Array) -> Array:
        return np.asarray(sum(found[f"{entry}_{i}"] * a[i - 1] for i in rows))

    sideways, inwards = linear("lateral", q), -0.5 * quadratic("axial", q, q)
    rate_across = linear("lateral", v) + spin * inwards
    rate_along = -quadratic("axial", q, v) - spin * sideways
    kinetic = (
        along * rate_along + across * rate_across + spin * linear("turned", v)
        + 0.5 * found["mass"] * (v * v).sum(axis=0) + 0.5 * spin * spin * quadratic("spun", q, q)
    )  # fmt: skip
    strain = 0.5 * linear("stiffness", q * q)
    delta = 0.5 * sum(found[f"nearer_{i}"] * q[i - 1] * q[i - 1] for i in rows)
    return Bent(kinetic, strain, (inwards, sideways), np.asarray(delta))

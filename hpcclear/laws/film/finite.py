"""Oil in a bearing of its own length: Reynolds' equation solved once, and what differs from a short film as polynomials.

Pressure is a sum over cosines along the axis, each with an equation around the bearing alone, solved by Fourier sums: even
in the angle for what is squeezed along the eccentricity, odd for what is squeezed across. Where their sum is below ambient
there is no pressure. A film's force over that of a short bearing, along w and across, is s^2/P with s^2 = 1 - e^2 and
polynomials P in s and in sin(psi/2) of `laws.reynolds`, in which it is smooth up to touching.
"""

import math
from functools import lru_cache

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.jit import lane_function
from hpcclear.laws.declared import FilmLaw
from hpcclear.laws.film import short
from hpcclear.laws.reynolds import along_and_across, short_impedance, turned_against

LEAST_S = 0.19899748742132398
"""s at an eccentricity of 0.98, up to which finite bearings are fitted."""

SHORT_TO = 1.5  # length over diameter up to which a short film is nearer to the finite one, and from which a long one

DEGREES = (5, 14)  # in s, in sin(psi/2)
_MODES, _ACROSS, _AROUND = 32, 64, 2048
_NODES = (16, 28)  # eccentricities, angles of w
_BELOW = tuple(range(13, -1, -1))


def pressures(eccentricity: float, ratio: float) -> tuple[Array, Array]:
    """Pressure over mu |w| R^2/c^3 of films squeezed along the eccentricity (over c) and across, whole, by mode (modes,
    _AROUND).

    At even angles from the thinnest film, each mode over cos((2 j + 1) pi z/L); `ratio`: length over diameter.
    """
    s = np.sqrt(1.0 - eccentricity**2)
    decay = (1.0 - s) / eccentricity if eccentricity > 0.0 else 0.0
    n = int(min(400, 24 + 40.0 / -np.log(max(decay, 1e-9))))
    angle = 2.0 * np.pi * np.arange(4 * n) / (4 * n)
    h3 = (1.0 - eccentricity * np.cos(angle)) ** 3
    found = []
    for shape, slope, k in ((np.cos, np.sin, np.arange(n)), (np.sin, np.cos, np.arange(1, n))):
        values = shape(np.outer(k, angle))
        slopes = k[:, None] * slope(np.outer(k, angle))  # but for a sign, which is squared
        weight = 2.0 * np.pi / (4 * n)
        stiff = (slopes * h3) @ slopes.T * weight
        mass = (values * h3) @ values.T * weight
        load = values @ shape(angle) * weight
        around = shape(np.outer(k, 2.0 * np.pi * np.arange(_AROUND) / _AROUND))
        rows = []
        for j in range(_MODES):
            order = 2 * j + 1
            share = 48.0 * (-1) ** j / (order * np.pi)
            leaking = (0.5 * order * np.pi / ratio) ** 2 * mass
            rows.append(np.linalg.solve(stiff + leaking, share * load))
        found.append(np.array(rows) @ around)
    return found[0], found[1]


def forces(eccentricity: float, ratio: float, angles: Array) -> Array:
    """Force against w and across it over mu |w| R L^3/c^3, of w at angles (m,) from the eccentricity; shape (m, 2)."""
    along, across = pressures(eccentricity, ratio)
    z, weights = np.polynomial.legendre.leggauss(2 * _ACROSS)
    z, weights = z[_ACROSS:], weights[_ACROSS:]
    modes = np.cos(np.outer(2 * np.arange(_MODES) + 1, 0.5 * np.pi * z))
    along, across = along.T @ modes, across.T @ modes
    around = 2.0 * np.pi * np.arange(_AROUND) / _AROUND
    rows = []
    for angle in angles:
        c, s = np.cos(angle), np.sin(angle)
        pressure = np.maximum(c * along + s * across, 0.0) @ weights * (2.0 * np.pi / _AROUND)
        x, y = pressure @ np.cos(around), pressure @ np.sin(around)
        rows.append((c * x + s * y, c * y - s * x))
    return np.array(rows) / (4.0 * ratio**2)


@lru_cache(maxsize=64)
def correction(ratio: float) -> Array:
    """Coefficients (layout.FURTHER_ROWS,) of P along w, then across, by powers of s, then of the sine; `ratio` as above."""
    k = np.arange(_NODES[0])
    s = 0.5 * (1.0 + LEAST_S) + 0.5 * (1.0 - LEAST_S) * np.cos((k + 0.5) * np.pi / len(k))
    inner = (np.arange(_NODES[1]) + 0.5) * np.pi / _NODES[1]
    angles = np.array([0.01, *inner, np.pi - 0.01])
    places, sides, weights = [], [], []
    for s2 in s**2:
        e = float(np.sqrt(1.0 - s2))
        for angle, force in zip(angles, forces(e, ratio, angles), strict=True):
            a = e * np.cos(angle)
            along, across = short_impedance(a, -e * np.sin(angle), s2)
            places.append(finite_scales(a, s2))
            sides.append(s2 * np.array([along, across]) / force)
            weights.append(np.abs(force) / np.hypot(*force))
    x, y = np.array(places).T
    terms = np.polynomial.chebyshev.chebvander2d(x, y, list(DEGREES))
    found = []
    for side, weight in zip(np.array(sides).T, np.array(weights).T, strict=True):
        fitted = np.linalg.lstsq(terms * (weight / side)[:, None], weight, rcond=None)[0]
        found.append(_in_powers(fitted.reshape(DEGREES[0] + 1, DEGREES[1] + 1)))
    return np.array(found).ravel()


def _in_powers(fitted: Array) -> Array:
    """Coefficients of Chebyshev's polynomials as those of powers, in both variables."""
    for axis, degree in enumerate(DEGREES):
        units = (np.eye(k + 1)[k] for k in range(degree + 1))
        each = map(np.polynomial.chebyshev.cheb2poly, units)
        powers = np.array([np.pad(one, (0, degree + 1 - len(one))) for one in each])
        fitted = np.moveaxis(np.tensordot(fitted, powers, (axis, 0)), -1, axis)
    return fitted


@lane_function
def half_angle_sine(a, s, r):
    """sin(psi/2) for r = sqrt(a^2 + s^2)."""
    far = r + abs(a)
    less = far if a <= 0.0 else s * s / far  # r - a = r (1 + cos psi)
    return s / math.sqrt(2.0 * r * less)


@lane_function
def finite_scales(a, s2):
    """s and sin(psi/2) as the polynomials of finite bearings take them, from -1 to 1; s no less than is fitted."""
    s = math.sqrt(s2)
    sine = half_angle_sine(a, s, math.sqrt(s2 + a * a))
    return (2.0 * max(s, LEAST_S) - (1.0 + LEAST_S)) / (1.0 - LEAST_S), 2.0 * sine - 1.0


@lane_function
def polynomial(par, row, y, i, W):
    """Of degree 14, from coefficients in the rows from `row` on."""
    p = par[(row + 14) * W + i]
    for k in _BELOW:
        p = p * y + par[(row + k) * W + i]
    return p


@lane_function
def corrected(par, row, s2, x, y, i, W):
    """Force of a finite film over that of a short one, by 6 times 15 coefficients from `row` on (`correction`)."""
    p = polynomial(par, row + 75, y, i, W)
    for first in (60, 45, 30, 15, 0):
        p = p * x + polynomial(par, row + first, y, i, W)
    return s2 / p


@lane_function
def force(par, row, scale, place, w, s2, i, W):
    """See `FilmLaw.force`."""
    wx, wy = w
    a, b = along_and_across(place, w)
    along, across = short_impedance(a, b, s2)
    x, y = finite_scales(a, s2)
    along = along * corrected(par, row, s2, x, y, i, W)
    across = across * corrected(par, row + 90, s2, x, y, i, W)
    return turned_against(scale, along, across, wx, wy)


def simpler(slender):
    """A film in closed form."""
    yield "finite length of the film", "short" if slender < SHORT_TO else "long"


LAW = FilmLaw(
    words="film of a bearing of finite length, solved once a bearing",
    source="Reynolds 1886; half-Sommerfeld",
    formula="short's, times factors along and across w that are fitted to the solution",
    valid="bearings of 0.05 to 3 diameters in length; within 0.1 % of the solution up to an eccentricity of 0.95",
    force=force,
    scale=short.scale,
    lengths=(0.05, 3.0),
    further=correction,
    simpler=simpler,
)

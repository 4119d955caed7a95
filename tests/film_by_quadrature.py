"""Film forces by quadrature of a pressure that is cut off below ambient: shares no formula with the package.

All for mu = R = L = c = 1 but for those factors that the models give: `short` over mu R L^3/c^3, `long` over 12 mu L R^3/c^3.
"""

import numpy as np
from scipy.optimize import brentq

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(400)


def thickness(e, angle):
    """Film thickness over the clearance at angles from the bearing's centre."""
    return 1.0 - e[0] * np.cos(angle) - e[1] * np.sin(angle)


def short(e, w):
    """Force on the journal of a short film, whose pressure is as the rate at which it is squeezed."""
    middle = np.arctan2(w[1], w[0])
    angle = middle + 0.5 * np.pi * _NODES
    pressure = (w[0] * np.cos(angle) + w[1] * np.sin(angle)) / thickness(e, angle) ** 3
    assert (pressure >= 0.0).all()
    return -0.5 * np.pi * np.array([np.cos(angle), np.sin(angle)]) @ (pressure * _WEIGHTS)


def long_pressure(e, w, count):
    """Pressure of the whole long film but for a constant, at `count` even angles."""
    angle = np.arange(count) * 2.0 * np.pi / count
    h = thickness(e, angle)
    flow = -w[0] * np.sin(angle) + w[1] * np.cos(angle)
    slope = (flow - (flow / h**3).sum() / (1.0 / h**3).sum()) / h**3
    waves = np.fft.rfft(slope)
    waves[0] = 0.0
    waves[1:] /= 1j * np.arange(1, len(waves))
    return angle, waves / count


def long(e, w, count=4096):
    """Force on the journal of a long film that is at ambient pressure at both ends of a half circle."""
    _, waves = long_pressure(e, w, count)
    k = np.arange(len(waves))

    def pressure(angle):
        terms = np.exp(1j * np.multiply.outer(angle, k)) * waves
        return 2.0 * terms.real.sum(axis=-1) - waves[0].real

    def unlike(angle):
        return float(pressure(np.array(angle)) - pressure(np.array(angle + np.pi)))

    begin = brentq(unlike, 0.3, 0.3 + np.pi, xtol=1e-15, rtol=1e-15)
    ambient = pressure(np.array(begin))
    if pressure(np.array(begin + 0.5 * np.pi)) < ambient:
        begin += np.pi
    angle = begin + 0.5 * np.pi * (1.0 + _NODES)
    over = pressure(angle) - ambient
    assert (over >= -1e-9 * np.abs(over).max()).all()
    return -0.5 * np.pi * np.array([np.cos(angle), np.sin(angle)]) @ (over * _WEIGHTS)

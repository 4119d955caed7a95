"""A disc in a hole of an elastic plane, without friction: an independent solution of the conformal contact problem.

Displacements of both circles under a pressure p_n cos(n t) follow from Muskhelishvili's potentials; the contact is where a
pressure on a fine grid is positive (an active set). Nothing of the package is used. Unit of pressure E* c/R, of force per
length E* c, of depth c; c is the radial clearance, small beside R.
"""

import math

import numpy as np


def influence(size, alpha, beta):
    """Matrix (size, size): radial displacements (c) of both circles together by pressures on strips around the circle."""
    n = np.arange(2, size // 2)
    whole = 1.0 + alpha - 2.0 * beta  # of a uniform pressure
    # depth of small contacts as by Johnson
    first = 2.0 * math.log(2.0) - 1.5 - 0.5 * (alpha + beta)
    harmonics = np.zeros(size // 2 + 1)
    harmonics[0] = 0.5 * whole
    # cos t: of (2 sum cos nt n/(n^2-1)) a point load has none; the rigid shift is told by `first`
    harmonics[1] = first + 0.5
    harmonics[2 : size // 2] = 2.0 * n / (n**2 - 1.0) + 2.0 * beta / (n**2 - 1.0)
    angles = 2.0 * np.pi * np.arange(size) / size
    kernel = np.cos(np.outer(angles, np.arange(len(harmonics)))) @ harmonics / np.pi
    places = np.arange(size)
    return kernel[(places[:, None] - places[None, :]) % size] * (2.0 * np.pi / size)


def solve(depth, alpha=0.0, beta=0.0, size=2048):
    """(force per length, peak pressure, half angle of contact) at a depth, in the units above."""
    angles = 2.0 * np.pi * (np.arange(size) - size // 2) / size
    near = np.abs(angles) < np.radians(85.0)
    angles = angles[near]
    matrix = influence(size, alpha, beta)[np.ix_(near, near)]
    overlap = depth * np.cos(angles) - (1.0 - np.cos(angles))
    on = overlap > 0.0
    for _ in range(200):
        pressure = np.zeros(len(angles))
        pressure[on] = np.linalg.solve(matrix[np.ix_(on, on)], overlap[on])
        gap = matrix @ pressure - overlap
        wrong = (on & (pressure < 0.0)) | (~on & (gap < 0.0))
        if not wrong.any():
            break
        on = on ^ wrong
    step = 2.0 * np.pi / size
    force = float(np.sum(pressure * np.cos(angles)) * step)
    return force, float(pressure.max()), 0.5 * step * float(np.count_nonzero(on))


def persson(half_angle):
    """E* c L/F of equal materials at a half angle of contact, rad (Persson 1964; Ciavarella and Decuzzi 2001, eq. 4)."""
    from scipy.integrate import quad

    b = math.tan(0.5 * half_angle)

    def inside(t):
        far, near = math.sqrt(b * b + 1.0), math.sqrt(b * b - t * t)
        return math.log((far + near) / (far - near)) / (1.0 + t * t)

    integral = quad(inside, -b, b)[0]
    both = 2.0 / math.pi * (1.0 - b * b) / b**2 - integral / (math.pi * b) ** 2 / (b * b + 1.0)
    return 0.5 * both

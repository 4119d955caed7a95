"""Fit the formulae of line contact to the plane elastic problem: `python analysis/line_contact.py`.

The problem is a disc in a hole of an elastic plane without friction. Its pressure is a polynomial over sqrt(1 - x^2), for
which the integral with the logarithm is known term by term, so that a few points give ten digits. Prints the coefficients
that stand in `hpcclear/laws/geometry/line.py` and their largest errors. The tests have a second solution by other
means.
"""

import math

import numpy as np
from scipy.optimize import least_squares

POINTS = 50
NARROWEST, WIDEST = 1e-3, math.radians(76.0)
DEEPEST = 3.0
"""Over the clearance; from 2 on a result is flagged."""


def solve(half_angle, alpha, beta):
    """(depth/c, force per length/(E* c), peak pressure R/(E* c)) where the contact has this half angle, rad."""
    n = POINTS
    places = (np.arange(n) + 0.5) * np.pi / n
    waves = np.cos(np.outer(np.arange(n), places))
    to_waves = 2.0 / n * waves
    to_waves[0] /= 2.0
    of_waves = np.r_[-np.pi * math.log(2.0), -np.pi / np.arange(1, n)]
    logarithm = waves.T @ (of_waves[:, None] * to_waves)
    t = half_angle * np.cos(places)
    apart = np.abs(t[:, None] - t[None, :])
    half = 0.5 * apart
    ratio = np.where(half > 1e-9, np.sin(half) / np.where(half > 1e-9, half, 1.0), 1.0)
    cosine = np.cos(apart)
    # cos t: so that the depth of small contacts is Johnson's; 2 ln 2 - 3/2 where materials are the same
    shift = 2.0 * math.log(2.0) - 1.5 - 0.5 * (alpha + beta)
    smooth = (
        -2.0 * cosine * np.log(half_angle * ratio)
        + 0.5 * (alpha - 2.0 * beta - 1.0)
        + shift * cosine
    )
    smooth += 2.0 * beta * (0.5 + 0.25 * cosine - 0.5 * (np.pi - apart) * np.sin(apart))
    along, across = np.cos(t), np.sin(t)
    whole = -2.0 * (along[:, None] * logarithm * along + across[:, None] * logarithm * across)
    system = np.zeros((n + 1, n + 1))
    system[:n, :n] = half_angle / np.pi * (whole + smooth * np.pi / n)
    system[:n, n], system[n, :n] = -along, to_waves.sum(axis=0)
    found = np.linalg.solve(system, np.r_[along - 1.0, 0.0])
    height = to_waves @ found[:n]
    force = half_angle * np.pi / n * float(found[:n] @ along)
    return found[n], force, float(height @ np.cos(0.5 * np.pi * np.arange(n)))


def table():
    """Rows of alpha, beta, half angle, depth, force, pressure over pairs of materials with Poisson's ratios up to 0.5."""
    rows = []
    angles = np.r_[np.geomspace(NARROWEST, 0.5, 50), np.linspace(0.52, WIDEST, 25)]
    for share in (0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99):  # of the bearing in the compliance
        for journal in (0.0, 0.35, 0.6):  # (1 - 2 nu)/(1 - nu)
            for bearing in (0.0, 0.35, 0.6):
                alpha = 2.0 * share - 1.0
                beta = 0.5 * (bearing * share - journal * (1.0 - share))
                rows += [(alpha, beta, a, *solve(a, alpha, beta)) for a in angles]
    found = np.array(rows)
    depth, force = found[:, 3], found[:, 4]
    return found[
        (force > 0.0) & (depth < DEEPEST)
    ].T  # loads cannot widen some contacts beyond 75 degrees


def fitted(model, first, target, columns):
    """Coefficients with the least largest relative error, (3, columns): of 1, of beta, of alpha; and that error."""
    x = np.r_[first, np.zeros(2 * columns)]
    weight, best = np.ones(len(target)), (np.inf, x)
    for _ in range(60):
        x = least_squares(lambda y, w=weight: w * (model(y) / target - 1.0), x, max_nfev=300).x
        errors = np.abs(model(x) / target - 1.0)
        best = min(best, (errors.max(), x), key=lambda one: one[0])
        weight = weight * (0.3 + errors / errors.max())
        weight /= weight.mean()
    return best[1].reshape(3, columns), best[0]


def main():
    alpha, beta, angle, depth, force, peak = table()
    wide, x = np.log1p(1.0 / depth), np.sqrt(force)

    def mixed(y, columns):
        c = y.reshape(3, columns)
        return c[0][:, None] + c[1][:, None] * beta + c[2][:, None] * alpha

    def depth_model(y):
        c = mixed(y, 6)
        return (((wide + c[0]) * wide + c[1]) * wide + c[2]) / ((c[3] * wide + c[4]) * wide + c[5])

    def ratio_model(y):
        c = mixed(y, 3)
        return (1.0 + c[0] * x + c[1] * x * x) / (1.0 + c[2] * x)

    hertz = np.sqrt(force / np.pi)
    cases = {
        "depth": (depth_model, [1.77, 0.56, 3.3, 0.93, -0.36, 2.33], np.pi * depth / force, 6),
        "pressure": (ratio_model, [0.56, 0.77, 0.63], peak / hertz, 3),
        "half angle": (ratio_model, [0.56, 0.48, 0.59], 2.0 * hertz / angle, 3),
    }
    for name, (model, first, target, columns) in cases.items():
        found, error = fitted(model, first, target, columns)
        print(f"{name}: largest error {100 * error:.2f} %")
        print(np.array2string(found, precision=8, separator=", "))


if __name__ == "__main__":
    main()

"""Films of finite length: the solution of Reynolds' equation, and what lanes evaluate of it."""

import film_by_quadrature as quadrature
import numpy as np
import pytest
import rotors
from scipy.sparse import diags, identity, kron
from scipy.sparse.linalg import spsolve

from hpcclear import simulate
from hpcclear.dynamics import layout as at
from hpcclear.laws.film import finite as bearing

ANGLES = np.array([0.0, 0.4, 1.2, 1.7, 2.4, 3.0, 3.14])


def by_differences(eccentricity, ratio, angle, around, along):
    """As `bearing.forces`, of one w: central differences on a grid around the bearing and along half of it."""
    theta = np.arange(around) * 2 * np.pi / around
    step, rise = 2 * np.pi / around, 1.0 / along
    e = (eccentricity, 0.0)
    h3 = quadrature.thickness(e, theta) ** 3
    between = quadrature.thickness(e, theta + 0.5 * step) ** 3
    before = np.roll(between, 1)
    turn = diags([-(between + before), between[:-1], before[1:]], [0, 1, -1]).tolil()
    turn[0, -1], turn[-1, 0] = before[0], between[-1]
    # cells from the middle, where nothing flows across, to the end, which is at ambient pressure
    main = np.full(along, -2.0)
    main[0], main[-1] = -1.0, -3.0
    out = diags([main, np.ones(along - 1), np.ones(along - 1)], [0, 1, -1])
    system = kron(turn / step**2, identity(along)) + kron(diags(h3), out / (ratio * rise) ** 2)
    pushed = np.repeat(np.cos(theta - angle), along)
    pressure = np.maximum(spsolve(system.tocsc(), -12.0 * pushed), 0.0).reshape(around, along)
    whole = pressure.sum(axis=1) * rise * step / (4 * ratio**2)
    return np.array([whole @ np.cos(theta - angle), whole @ np.sin(theta - angle)])


@pytest.mark.parametrize(
    ("eccentricity", "ratio", "angle"), [(0.3, 0.5, 1.5), (0.8, 1.0, 1.0), (0.6, 2.0, 2.6)]
)
@pytest.mark.shortened(1)
def test_the_solution_is_that_of_differences(eccentricity, ratio, angle):
    """Two grids, extrapolated; the cut at ambient pressure costs differences some of their order."""
    coarse, fine = (by_differences(eccentricity, ratio, angle, n, n // 8) for n in (192, 384))
    extrapolated = fine + (fine - coarse) / 3
    found = bearing.forces(eccentricity, ratio, np.array([angle]))[0]
    assert np.abs(found - extrapolated).max() < 2e-4 * np.hypot(*found)


def test_a_very_short_bearing_is_ocvirk_s():
    solved = bearing.forces(0.5, 0.01, ANGLES[1:-1])
    for angle, force in zip(ANGLES[1:-1], solved, strict=True):
        e = 0.5 * np.array([np.cos(angle), -np.sin(angle)])
        assert force == pytest.approx(-quadrature.short(e, np.array([1.0, 0.0])), rel=5e-3)


def evaluated(coefficients, eccentricity, angle):
    """What a lane makes of the coefficients, over mu R L^3/c^3: force against w and across it, of w along x."""
    par = np.zeros(at.PARAMETERS)
    row = at.JOINTS[0].further
    par[row : row + at.FURTHER_ROWS] = coefficients
    e = (eccentricity * np.cos(angle), -eccentricity * np.sin(angle))
    x, y = bearing.force(par, row, 1.0, e, (1.0, 0.0), 1.0 - eccentricity**2, 0, 1)
    return -np.array([x, y])


@pytest.mark.parametrize(
    "ratio",
    [
        pytest.param(r, marks=[] if r in (0.25, 2.0) else pytest.mark.full)
        for r in (0.25, 0.5, 1.0, 1.5, 2.0)
    ],
)
def test_lanes_evaluate_the_solution_within_a_thousandth(ratio):
    """Length over diameter from 0.25 to 2, eccentricities up to 0.95, any direction of squeeze."""
    coefficients = bearing.correction(ratio)
    for eccentricity in (0.0, 0.2, 0.5, 0.7, 0.85, 0.95):
        solved = bearing.forces(eccentricity, ratio, ANGLES)
        for angle, force in zip(ANGLES, solved, strict=True):
            off = evaluated(coefficients, eccentricity, angle) - force
            assert np.hypot(*off) < 1e-3 * np.hypot(*force)


@pytest.mark.parametrize("ratio", [0.05, 1.0, 3.0])
def test_beyond_what_is_fitted_a_film_still_pushes(ratio):
    """Up to touching: never less than at a smaller eccentricity, while the film is squeezed."""
    coefficients = bearing.correction(ratio)
    for angle in (0.0, 0.5, 1.5, 3.0):
        pushes = [evaluated(coefficients, e, angle)[0] for e in (0.9, 0.95, 0.98, 0.99, 0.999)]
        assert min(pushes) > 0.0
        if angle < 2.0:
            assert (np.diff(pushes) > 0.0).all()


@pytest.mark.parametrize("length", [pytest.param(0.01, marks=pytest.mark.nightly), 0.04])
@pytest.mark.nightly
def test_a_journal_settles_where_the_solution_carries_the_load(length):
    """Force as large as the load, against it; of a pure wedge w points across the eccentricity."""
    load, speed = 200.0, 150.0
    response = simulate(rotors.rotor(speed, load, 60, model="finite", length=length))
    x, y = (float(response[f"eccentricity_{axis}"][-1, 0]) / rotors.CLEARANCE for axis in "xy")
    eccentricity, ratio = np.hypot(x, y), 0.5 * length / rotors.RADIUS
    force = bearing.forces(eccentricity, ratio, np.array([-0.5 * np.pi]))[0]
    force *= rotors.VISCOSITY * rotors.RADIUS * (length / rotors.CLEARANCE) ** 3
    force *= 0.5 * speed * eccentricity * rotors.CLEARANCE
    assert np.hypot(*force) == pytest.approx(load, rel=1e-3)
    # against w, and across it: w is a quarter turn clockwise of the eccentricity
    w = np.array([y, -x]) / eccentricity
    across = np.array([-w[1], w[0]])
    assert -force[0] * w - force[1] * across == pytest.approx([0.0, load], abs=1e-3 * load)

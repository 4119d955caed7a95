"""A slider-crank with a rod that bends by Lagrange's equations from the velocities of its points, for comparison.

Shares no formula with the package: the rod is a set of points, whose velocities are linear in those of the coordinates (end
a, angle, amplitudes); kinetic energy is summed over them by Gauss's rule, its terms of third order in the amplitudes are left
out by their orders, and derivatives of the mass matrix are taken by complex steps. Pins are multipliers.
"""

import numpy as np
from scipy.optimize import brentq

NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)


def share_of(mass, inertia, length, center):
    """Mass of the largest uniform bar that can be taken out of a body and leaves one."""

    def left(m):
        about_a = inertia + mass * center**2 - m * length**2 / 3
        return np.array(
            [[mass - m, mass * center - m * length / 2], [mass * center - m * length / 2, about_a]]
        )

    def least(m):
        return np.linalg.eigvalsh(left(m) / mass)[0]

    uniform = np.isclose(center, length / 2) and np.isclose(inertia, mass * length**2 / 12)
    return mass if uniform else brentq(least, 1e-9 * mass, mass * (1 + 1e-9), xtol=1e-16)


class Rod:
    """Coordinates: x and y of end a, angle, amplitudes of the modes. `exact`: nothing is left out."""

    def __init__(self, mass, inertia, length, center, stiffness, damping, modes, exact=False):
        self.rigid = (mass, inertia, center)
        self.length, self.exact = length, exact
        self.modes = np.arange(1, modes + 1)
        self.n = 3 + modes
        self.x = 0.5 * length * (NODES + 1)
        self.share = share_of(mass, inertia, length, center)
        self.masses = self.share * 0.5 * WEIGHTS
        wave = self.modes * np.pi / length
        self.shape = np.sin(np.outer(self.x, wave))  # (points, modes)
        # slopes' products integrated from a to each point, and to b
        ends = np.append(self.x, length)
        inner = 0.5 * ends[:, None] * (NODES + 1)
        slope = wave * np.cos(inner[..., None] * wave)
        weights = 0.5 * ends[:, None] * WEIGHTS
        self.slopes = np.einsum("pk,pki,pkj->pij", weights, slope, slope)
        curved = wave**2 * np.sin(np.outer(self.x, wave))
        step = 0.5 * length * WEIGHTS
        self.stiff = stiffness * np.einsum("k,ki,kj->ij", step, curved, curved)
        modal = np.einsum("k,ki,kj->ij", self.masses, self.shape, self.shape)
        self.damp = np.diag(2 * damping * np.sqrt(np.diag(self.stiff) * np.diag(modal)))
        self.end_slopes = {"a": wave, "b": wave * np.cos(wave * length)}

    def jacobian(self, y, x, shape, slopes):
        """Velocities of points by those of the coordinates, by order in the amplitudes: (3, points, 2, n)."""
        q = y[3:]
        c, s = np.cos(y[2]), np.sin(y[2])
        e, n = np.array([c, s]), np.array([-s, c])
        found = np.zeros((3, len(x), 2, self.n), complex)
        found[0, :, 0, 0] = found[0, :, 1, 1] = 1.0
        found[0, :, :, 2] = np.multiply.outer(x, n)
        found[1, :, :, 2] = -np.multiply.outer(shape @ q, e)
        drawn = -0.5 * np.einsum("pij,i,j->p", slopes, q, q)
        found[2, :, :, 2] = np.multiply.outer(drawn, n)
        found[1, :, :, 3:] = np.einsum("pi,d->pdi", shape, n)
        found[2, :, :, 3:] = -np.einsum("pij,j,d->pdi", slopes, q, e)
        return found

    def mass_matrix(self, y):
        J = self.jacobian(y, self.x, self.shape, self.slopes[:-1])
        total = np.zeros((self.n, self.n), complex)
        for a in range(3):
            for b in range(3):
                if (a or b) and (self.exact or a + b <= 2):
                    total += np.einsum("p,pdi,pdj->ij", self.masses, J[a], J[b])
        mass, inertia, center = self.rigid
        middle = self.jacobian(y, np.array([center]), 0 * self.shape[:1], 0 * self.slopes[:1])[0, 0]
        total += mass * middle.T @ middle
        total[2, 2] += inertia
        return total

    def end(self, y):
        """Derivative of end b's place by the coordinates, (2, n); nothing is left out."""
        J = self.jacobian(y, np.array([self.length]), 0 * self.shape[:1], self.slopes[-1:])
        return J.sum(axis=0)[0]

    def place_of_end(self, y):
        drawn = -0.5 * np.einsum("ij,i,j->", self.slopes[-1], y[3:], y[3:])
        return y[:2] + (self.length + drawn) * np.array([np.cos(y[2]), np.sin(y[2])])

    def moment_of(self, y):
        """Derivative of the first moment's y by the coordinates, kg: what gravity acts on."""
        J = self.jacobian(y, self.x, self.shape, self.slopes[:-1])
        mass, _, center = self.rigid
        found = np.einsum("p,pi->i", self.masses, (J[1] + J[2])[:, 1])
        middle = self.jacobian(y, np.array([center]), 0 * self.shape[:1], 0 * self.slopes[:1])
        return (found + mass * middle[0, 0, 1]).real

    def raised(self, y):
        """First moment against y = 0 that bending adds, kg m."""
        c, s = np.cos(y[2]), np.sin(y[2])
        drawn = -0.5 * np.einsum("pij,i,j->p", self.slopes[:-1], y[3:], y[3:])
        return self.masses @ (drawn * s + self.shape @ y[3:] * c)

    def momentum_rates(self, y, v):
        """d/dt (M v) - dT/dy without accelerations, (n,)."""
        h = 1e-30
        moved = self.mass_matrix(y + 1j * h * v).imag @ v / h
        slopes = np.zeros(self.n)
        for k in range(2, self.n):
            z = y.astype(complex)
            z[k] += 1j * h
            slopes[k] = 0.5 * v @ self.mass_matrix(z).imag @ v / h
        return moved - slopes

    def forces(self, y, v, gravity):
        found = -self.momentum_rates(y, v) - gravity * self.moment_of(y)
        found[3:] -= self.stiff @ y[3:] + self.damp @ v[3:]
        return found

    def energy(self, y, v, gravity=0.0):
        """Kinetic and strain energy."""
        return 0.5 * v @ self.mass_matrix(y).real @ v, 0.5 * y[3:] @ self.stiff @ y[3:]


class IdealSliderCrank:
    """Crank at constant speed, pins without play: amplitudes and the slider by multipliers. State: rod (n), slider."""

    def __init__(self, rod, crank, slider_mass, speed, gravity=0.0):
        self.rod, self.crank, self.slider_mass = rod, crank, slider_mass
        self.speed, self.gravity = speed, gravity

    def start(self):
        """Stretched out, straight, modes at rest."""
        n = self.rod.n
        y, v = np.zeros(n + 1), np.zeros(n + 1)
        y[0], y[n] = self.crank, self.crank + self.rod.length
        v[1] = self.crank * self.speed
        v[2] = -v[1] / self.rod.length
        return np.concatenate([y, v])

    def constraints(self, y, t):
        """Places that are to be nought: end a on the crank pin, end b on the slider."""
        pin = self.crank * np.array([np.cos(self.speed * t), np.sin(self.speed * t)])
        end = self.rod.place_of_end(y[:-1])
        return np.array([*(y[:2] - pin), end[0] - y[-1], end[1]])

    def derivative(self, t, state):
        return np.concatenate([state[len(state) // 2 :], self.solved(t, state)[0]])

    def solved(self, t, state):
        """Accelerations, and the forces of the pins that act against the constraints: on the rod at a and at b, negative."""
        n = self.rod.n
        y, v = np.split(state, 2)
        M = np.zeros((n + 1, n + 1))
        M[:n, :n], M[n, n] = self.rod.mass_matrix(y[:n]).real, self.slider_mass
        Q = np.append(self.rod.forces(y[:n], v[:n], self.gravity), 0.0)

        def jacobian(z):
            J = np.zeros((4, n + 1), complex)
            J[0, 0] = J[1, 1] = 1.0
            J[2:, :n] = self.rod.end(z[:n])
            J[2, n] = -1.0
            return J

        J = jacobian(y).real
        turning = jacobian(y + 1e-30j * v).imag @ v / 1e-30
        pin = self.crank * np.array([np.cos(self.speed * t), np.sin(self.speed * t)])
        asked = np.concatenate([-(self.speed**2) * pin, [0.0, 0.0]]) - turning
        # drift is pulled back as slowly as it grows
        rates = J @ v - np.array([*(self.speed * np.array([-pin[1], pin[0]])), 0.0, 0.0])
        asked -= 200.0 * rates + 1e4 * self.constraints(y, t)
        K = np.block([[M, J.T], [J, np.zeros((4, 4))]])
        found = np.linalg.solve(K, np.concatenate([Q, asked]))
        return found[: n + 1], found[n + 1 :]

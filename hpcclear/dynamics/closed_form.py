"""Scenes without clearance at prescribed speed: outcomes and time series in closed form."""

import numpy as np

from hpcclear.base.arrays import Array, Integers
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.lanes import Problem
from hpcclear.dynamics.linkage import ideal
from hpcclear.dynamics.lowering import parameters, problem_of
from hpcclear.scene import Scene

_CONTACT = ("eccentricity_x", "eccentricity_y", "penetration", "contact_force", "friction_force")


class ClosedForm:
    """Stands in for `kernel.lanes.Lanes` where no coordinate is left to integrate: every sample is done when queued."""

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._labels: list[Integers] = []
        self._par: list[Array] = []

    @property
    def pending(self) -> int:
        """Samples queued and not collected."""
        return sum(map(len, self._labels))

    def queue(self, par: Array, state: Array, labels: Integers) -> None:
        """Add samples: parameters (m, PARAMETERS), labels (m,); there is no start state to heed."""
        self._par.append(par)
        self._labels.append(labels)

    def advance(self, seconds: float) -> None:
        """Nothing takes time."""

    def collect(self) -> tuple[Integers, Array, Array]:
        """Labels (m,), outcome rows (m, OUT) and parameters (m, PARAMETERS) since the last call."""
        labels = np.concatenate([np.zeros(0, np.int64), *self._labels])
        par = np.concatenate([np.zeros((0, at.PARAMETERS)), *self._par])
        self._labels, self._par = [], []
        p = self._problem
        return (
            labels,
            ideal.ideal_outcomes(p.effects, par, p.load_table, p.transient, p.averaged),
            par,
        )


def ideal_series(scene: Scene) -> tuple[Array, dict[str, Array]]:
    """Instants (t,) and the time series of a response without clearance.

    Parameters
    ----------
    scene : Scene
        Both joints ideal, crank speed prescribed. Where every step is asked for (0 instants a revolution) there is
        none, and 720 instants are taken.

    Returns
    -------
    times : ndarray, shape (t,)
        s.
    series : dict
        Names as in the response dataset. There is no contact: ``reaction_x`` and ``reaction_y`` (t, 2) are the
        forces on the rod at O12 and O23, ``bearing_x`` and ``bearing_y`` those of the frame on the crank,
        ``guide_force`` that of the guide on the slider, N.
    """
    problem = problem_of(scene, ledger=True, series=True)
    par = parameters(scene)[0]
    turns = problem.transient + problem.averaged
    count = scene.output.instants_per_revolution or 720
    angle = np.linspace(0.0, turns * at.TURN, turns * count + 1)
    seen = ideal.ideal_response(problem.effects, par, problem.load_table, angle)
    drive, _, lost, load = ideal.ideal_works(problem.effects, par, problem.load_table, angle)
    omega = np.full_like(angle, par[at.SPEED])
    kinetic = 0.5 * (
        par[at.ROD_MASS] * (seen[ideal.ROD_VX] ** 2 + seen[ideal.ROD_VY] ** 2)
        + par[at.ROD_INERTIA] * seen[ideal.ROD_SPIN] ** 2
        + par[at.SLIDER_MASS] * seen[ideal.SLIDER_V] ** 2
        + par[at.CRANK_INERTIA] * omega**2
    )
    height = par[at.CRANK_MOMENT] * np.sin(angle) + par[at.ROD_MASS] * seen[ideal.ROD_Y]
    potential = scene.effects.gravity * height
    total = kinetic + potential
    none = np.zeros((len(angle), 2))
    return angle / par[at.SPEED], {
        "crank_angle": angle,
        "slider_position": seen[ideal.SLIDER_X],
        "slider_velocity": seen[ideal.SLIDER_V],
        "slider_acceleration": seen[ideal.SLIDER_A],
        "rod_x": seen[ideal.ROD_X],
        "rod_y": seen[ideal.ROD_Y],
        "rod_angle": seen[ideal.ROD_ANGLE],
        **dict.fromkeys(_CONTACT, none),
        "reaction_x": seen[[ideal.FORCE_12_X, ideal.FORCE_23_X]].T,
        "reaction_y": seen[[ideal.FORCE_12_Y, ideal.FORCE_23_Y]].T,
        "bearing_x": seen[ideal.BEARING_X],
        "bearing_y": seen[ideal.BEARING_Y],
        "guide_force": seen[ideal.GUIDE_FORCE],
        "crank_moment": seen[ideal.CRANK_MOMENT],
        "kinetic_energy": kinetic,
        "elastic_energy": np.zeros_like(angle),
        "potential_energy": potential,
        "driving_work": drive,
        "load_work": load,
        "dissipated_energy": lost,
        "energy_residual": total - total[0] - drive - load + lost,
    }

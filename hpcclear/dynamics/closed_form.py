"""Scenes without clearance at prescribed speed: outcomes and time series in closed form."""

import numpy as np

from hpcclear.base.arrays import Array, Integers
from hpcclear.dynamics.layout import TURN
from hpcclear.dynamics.linkage import ideal
from hpcclear.dynamics.parameters import parameters
from hpcclear.dynamics.planar.prescribed import outcomes
from hpcclear.dynamics.problem import Problem, problem_of
from hpcclear.dynamics.views import Outcome, Parameters, Start
from hpcclear.scene import Scene

_CONTACT = ("eccentricity_x", "eccentricity_y", "penetration", "contact_force", "friction_force")


class ClosedForm:
    """Stands in for `lanes.Lanes` where no coordinate is left to integrate: every sample is done when queued."""

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._labels: list[Integers] = []
        self._par: list[Array] = []
        self._starts: list[Array] = []

    @property
    def pending(self) -> int:
        """Samples queued and not collected."""
        return sum(map(len, self._labels))

    def queue(self, par: Array, start: Start, labels: Integers) -> None:
        """Add samples: parameters (m, PARAMETERS), m starts, of which only failures count, labels (m,)."""
        self._par.append(par)
        self._starts.append(start.rows)
        self._labels.append(labels)

    def advance(self, seconds: float) -> None:
        """Nothing takes time."""

    def collect(self) -> tuple[Integers, Outcome, Array]:
        """Labels (m,), outcomes and parameters (m, PARAMETERS) since the last call."""
        labels = np.concatenate([np.zeros(0, np.int64), *self._labels])
        par = np.concatenate([np.zeros((0, self._problem.parameter_rows)), *self._par])
        start = Start(np.concatenate([Start.at_rest(0).rows, *self._starts]))
        self._labels, self._par, self._starts = [], [], []
        return labels, self.run(par, start), par

    def run(self, par: Array, start: Start) -> Outcome:
        """Outcomes of samples, in their order: parameters (m, PARAMETERS) and m starts, of which only failures count."""
        p = self._problem
        if p.linkage is not None:
            return p.marked(Outcome(outcomes(p, par)), par, start)
        rows = ideal.ideal_outcomes(p.effects, par, p.load_table, p.transient, p.averaged)
        return p.marked(Outcome(rows), par, start)


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
    p = Parameters(par)
    turns = problem.transient + problem.averaged
    count = scene.output.instants_per_revolution or 720
    angle = np.linspace(0.0, turns * TURN, turns * count + 1)
    seen = ideal.ideal_response(problem.effects, par, problem.load_table, angle)
    drive, _, lost, load = ideal.ideal_works(problem.effects, par, problem.load_table, angle)
    omega = np.full_like(angle, p.speed)
    kinetic = 0.5 * (
        p.rod_mass * (seen[ideal.ROD_VX] ** 2 + seen[ideal.ROD_VY] ** 2)
        + p.rod_inertia * seen[ideal.ROD_SPIN] ** 2
        + p.slider_mass * seen[ideal.SLIDER_V] ** 2
        + p.crank_inertia * omega**2
    )
    height = p.crank_moment * np.sin(angle) + p.rod_mass * seen[ideal.ROD_Y]
    potential = scene.effects.gravity * height
    total = kinetic + potential
    none = np.zeros((len(angle), 2))
    return angle / p.speed, {
        "crank_angle": angle,
        "crank_speed": omega,
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

"""Tolerance and revolutions for an error of the objective that the user names (``numerics.target_error``).

A rule calibrated on random scenes gives the first guess of the tolerance; a pilot then checks it on the scene at hand.
Half of the target is for the revolutions, against a long run; the tolerance has to meet the whole, over the chosen
revolutions, against a run at `STRICT`.
"""

from dataclasses import dataclass

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.dynamics.evaluator import DEFAULT_LANES
from hpcclear.dynamics.lanes import Lanes
from hpcclear.dynamics.parameters import parameters
from hpcclear.dynamics.problem import Problem, problem_of
from hpcclear.dynamics.revolutions import gaps_of_revolutions, objective
from hpcclear.dynamics.start import start_states
from hpcclear.dynamics.views import Start
from hpcclear.scene import Scene
from hpcclear.scene.points import Points

SHARE = 0.1
"""First guess of rtol over the target error.

On 200 random scenes of the paper's design space (Hunt-Crossley, 0.5 s/m) the error of f was below 10 rtol in 95 % for
rtol from 5e-4 to 3e-5, and below 6 rtol at 1e-5.
"""

STRICT = 1e-12
"""Tolerance of the run that the others are compared with."""

TIGHTEST = 1e-11
RUNG = 10.0**0.5
"""Factor between two tolerances that are tried."""

MET = 0.95
"""Share of the pilot's designs that has to meet the target."""

DESIGNS = 16
"""Designs of the pilot, spread over the points at hand."""

LONG = 64
"""Revolutions of the long run; its second half is the truth about averages."""

SPANS = (1, 2, 3, 5, 8, 12, 16, 20)
"""Revolutions that are tried, for the transient and for the average."""

LATER = 8
"""Starts of the average, one revolution after the other, that all have to meet the target: one may do so by luck."""


@dataclass(frozen=True)
class _Pilot:
    """The designs at hand, and how they are run."""

    scene: Scene
    par: Array
    start: Start
    width: int

    def problem(self, rtol: float, transient: int, averaged: int) -> Problem:
        changes = {
            "numerics.rtol": rtol,
            "numerics.atol": None,
            "numerics.transient_revolutions": transient,
            "numerics.averaged_revolutions": averaged,
            "numerics.energy": False,
        }
        return problem_of(self.scene.with_(changes))

    def objectives(self, rtol: float, transient: int, averaged: int) -> Array:
        """f of every design, NaN where it failed."""
        lanes = Lanes(self.problem(rtol, transient, averaged), self.width)
        outcome = lanes.run(self.par, self.start)
        return np.where(outcome.status == 0, outcome.objective, np.nan)


def resolve(scene: Scene, points: Points | None = None) -> tuple[Scene, str]:
    """The scene with tolerance and revolutions in place of a target error, and why these.

    Parameters
    ----------
    scene : Scene
    points : Points, optional
        Designs that will be simulated; the settings are chosen on some of them. By default on the scene itself.

    Returns
    -------
    Scene
        The scene as it is if it names no target error, or if there is nothing to choose (both joints ideal).
    str
        Which settings, and what was measured; empty if nothing was chosen.

    Raises
    ------
    InputError
        If the scene asks for what the kernel cannot do.
    """
    target = scene.numerics.target_error
    if target is None or not scene.clearance_joints():
        return scene, ""
    plain = scene.with_({"numerics.target_error": None, "numerics.uncertainty": False})
    pilot = _pilot(plain, points)
    guess = SHARE * target
    transient, averaged, scatter = choose_revolutions(pilot, target, guess)
    rtol, share, silent = choose_tolerance(pilot, target, guess, transient, averaged)
    changes = {
        "numerics.target_error": None,
        "numerics.rtol": rtol,
        "numerics.atol": None,
        "numerics.transient_revolutions": transient,
        "numerics.averaged_revolutions": averaged,
    }
    count = len(pilot.par)
    verdict = (
        f"met on {share:.0%} of {count - silent} designs tried" if silent < count else "not checked"
    )
    if silent:
        verdict += f"; {silent} chaotic at that level, where no tolerance meets it"
    reason = (
        f"target_error {target:g}: rtol {rtol:.2g} ({verdict}; against rtol {STRICT:g}), {transient} + {averaged} "
        f"revolutions (off by {scatter:.1e} from the average of {LONG - LONG // 2} later ones)"
    )
    return scene.with_(changes), reason


def recorded(reason: str) -> dict[str, str]:
    """The attribute of a dataset that keeps the reason, if there is one."""
    return {"target_error_choice": reason} if reason else {}


def _pilot(scene: Scene, points: Points | None) -> _Pilot:
    if points is not None:
        rows = np.unique(np.linspace(0, len(points) - 1, DESIGNS).round().astype(int))
        points = points.take(rows)
    par = parameters(scene, points)
    return _Pilot(scene, par, start_states(scene, par), 1 if points is None else DEFAULT_LANES)


def choose_revolutions(pilot: _Pilot, target: float, rtol: float) -> tuple[int, int, float]:
    """Fewest transient and averaged revolutions, and the relative error of the average that they leave."""
    lanes = Lanes(pilot.problem(rtol, 0, 1), pilot.width)
    gaps = gaps_of_revolutions(lanes, pilot.par, pilot.start, LONG)
    gaps = gaps[:, np.isfinite(gaps[-1]).all(axis=1)]
    if gaps.shape[1] == 0:
        return SPANS[-1], SPANS[-1], np.nan
    truth = objective(gaps[LONG // 2 :].mean(axis=0))
    sums = np.concatenate([np.zeros((1, *gaps.shape[1:])), gaps.cumsum(axis=0)])
    found = []
    for averaged in SPANS:
        windows = (sums[averaged:] - sums[:-averaged]) / averaged
        errors = np.abs(objective(windows) / truth - 1.0)
        for transient in SPANS:
            worst = errors[transient : transient + LATER].max(axis=0)
            found.append((transient, averaged, float(np.quantile(worst, MET))))
    enough = [one for one in found if one[2] <= 0.5 * target]
    if enough:
        return min(enough, key=lambda one: (one[0] + one[1], one[2]))
    return min(found, key=lambda one: one[2])


def choose_tolerance(
    pilot: _Pilot, target: float, guess: float, transient: int, averaged: int
) -> tuple[float, float, int]:
    """Loosest tolerance, from the guess on, that meets the target on enough designs.

    Designs on which two strict runs differ by more than the target are chaotic at that level: no tolerance meets it
    there, and they have no say. Where no design is left, or none of the tolerances meets the target, the guess stays.

    Returns
    -------
    float
        rtol
    float
        Share of the designs with a say that meet the target; NaN if there are none.
    int
        Designs without a say.
    """
    truth, twin = (pilot.objectives(r, transient, averaged) for r in (STRICT, 10.0 * STRICT))
    sayers = np.abs(twin / truth - 1.0) <= target
    silent = int(np.count_nonzero(~sayers))
    if not sayers.any():
        return guess, np.nan, silent
    shares: list[tuple[float, float]] = []
    while not shares or guess / RUNG ** len(shares) >= TIGHTEST:
        rtol = guess / RUNG ** len(shares)
        error = np.abs(pilot.objectives(rtol, transient, averaged) / truth - 1.0)
        shares.append((rtol, float(np.mean(error[sayers] <= target))))
        if shares[-1][1] >= MET:
            return *shares[-1], silent
    return *shares[0], silent

"""Work and precision: error of one revolution against time and force evaluations, over a ladder of tolerances.

One revolution from the start, so that errors are those of the integrator: over many revolutions rattling contacts
amplify any error to the same size (the averaging panel shows that bound).
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from hpcclear.accuracy.looked_at import OF_A_BODY, QUANTITIES
from hpcclear.accuracy.methods import kernel_method, methods_of, solve_turn, systems, timed
from hpcclear.accuracy.profile import Profile, Variables
from hpcclear.base.arrays import Array
from hpcclear.report.targets import MARGIN
from hpcclear.scene import Scene

REFERENCE_RTOL = 1e-13
LOST = 10.0
"""Error of the position, in lengths of the crank, above which a method has lost the motion: its errors are not reported."""


class Reference(NamedTuple):
    """Values (designs, 4) as in `QUANTITIES`, what errors are divided by, and the reference's own relative error (4,)."""

    values: Array
    scale: Array
    error: Array


def reference_of(scene: Scene, designs: int) -> Reference:
    """One revolution, solved two ways.

    scipy's DOP853, restarted wherever a gap changes sign, gives the values; the kernel's pair at the
    same tolerance is the second way. On the largest force LSODA is, since the kernel reports it at steps' ends.
    """
    made = systems(scene, designs)
    values = np.array([solve_turn(scene, one, "DOP853", REFERENCE_RTOL)[0] for one in made])
    method = kernel_method("second", scene, designs, 1, "minimal", "tsitouras")
    second = method.prepare(REFERENCE_RTOL)[0]().values
    second[:, 2] = [solve_turn(scene, one, "LSODA", 10 * REFERENCE_RTOL)[0][2] for one in made]
    scale = np.abs(values)
    scale[:, 0] = [one.named.driven_length for one in made]
    scale[:, 1] = [one.named.driven_length * one.named.speed for one in made]
    scale = np.where(scale > 0.0, scale, np.nan)
    return Reference(values, scale, rms((second - values) / scale))


def rms(errors: Array) -> Array:
    """Root mean square over the first axis of any shape."""
    return np.sqrt(np.mean(np.square(errors), axis=0))


def measure(scene: Scene, profile: Profile, notify: Callable[[str], object]) -> Variables:
    """Measure every method that can integrate this scene; `notify` gets the name of each as its turn comes."""
    notify("integration: reference")
    reference = reference_of(scene, profile.designs)
    methods = methods_of(scene, profile.designs, profile.more_methods)
    shape = (len(methods), len(profile.tolerances))
    seconds, evaluations = (np.full(shape, np.nan) for _ in range(2))
    setting = np.tile(profile.tolerances, (len(methods), 1))
    error = np.full((*shape, len(QUANTITIES)), np.nan)
    for m, method in enumerate(methods):
        notify(f"integration: {method.name}")
        repeats = profile.repeats if method.compiled else profile.outside_repeats
        for r, rtol in enumerate(profile.tolerances):
            run, share = method.prepare(rtol)
            outcome, total = timed(run, repeats)
            seconds[m, r] = total * share
            evaluations[m, r] = outcome.evaluations.mean()
            # a method may be better than the reference: no error is stated that the reference cannot show
            off = rms((outcome.values - reference.values) / reference.scale)
            lost = not off[0] < LOST  # nor a number
            error[m, r] = np.nan if lost else np.fmax(off, reference.error)
    floor = MARGIN * reference.error
    order = np.array([[observed_order(n, e[:, k], floor[k]) for k in range(len(QUANTITIES))]
                      for n, e in zip(evaluations, error, strict=True)])  # fmt: skip
    return {
        "integrator": np.array([method.name for method in methods]),
        "rung": np.arange(len(profile.tolerances)),
        "quantity": np.array(OF_A_BODY if scene.template is None else QUANTITIES),
        "setting": setting,
        "error": error,
        "seconds": seconds,
        "evaluations": evaluations,
        "order": order,
        "reference_error": reference.error,
    }


def observed_order(evaluations: Array, errors: Array, floor: float) -> float:
    """Slope of error against force evaluations (shape (levels,) each), both logarithmic: the median over all pairs of
    tolerance levels (Theil and Sen).

    Levels count whose error lies above `floor` and below a tenth, and that are at least a factor of two apart in cost.

    Returns NaN where fewer than two count.
    """
    good = (errors > floor) & (errors < 0.1)
    x, y = np.log(evaluations[good]), np.log(errors[good])
    apart = x[:, None] - x > np.log(2.0)
    slopes = (y[:, None] - y)[apart] / (x[:, None] - x)[apart]
    return -float(np.median(slopes)) if slopes.size else np.nan

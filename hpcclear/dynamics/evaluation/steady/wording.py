"""What steady means to a target error come to, in words: for terminals, pages and attributes of files."""

from typing import Any

import numpy as np

from hpcclear.base.arrays import Booleans, Records
from hpcclear.base.outcome import Flag, Regime, Status
from hpcclear.dynamics.evaluation.steady.judging import objective
from hpcclear.scene import Scene

NAMED = 8  # samples that are named at most


def missed(records: Records) -> Booleans:
    """Which samples ended without a failure and do not know their steady mean to the target, shape (n,)."""
    short: Booleans = (records["flags"] & int(Flag.TARGET_MISSED)) > 0
    return short & (records["status"] == Status.OK)


def why_missed(record: Any, target: float | None) -> str:
    """Why the target of one record, or of a dataset of it, is missed, in one sentence."""
    regime, spent = Regime(int(record["regime"])), int(record["steady_revolutions"])
    if regime is Regime.UNSTEADY:
        return f"there is no steady mean: f still drifts after {spent} revolutions"
    if not np.isfinite(float(record["objective_limit"])):
        return f"{spent} revolutions are too few for a confidence interval of f; raise numerics.target_revolutions"
    share = float(record["objective_limit"]) / float(record["objective"])
    return (
        f"the relative half-width of f is {share:.1e} after {spent} revolutions, above the target {target:g} "
        f"({regime.meaning}); raise numerics.target_revolutions or numerics.target_error"
    )


def in_a_line(record: Any) -> str:
    """f of one record, or of a dataset of it, with its half-width: "3.36 +- 0.03 um (chaotic, 6200 revolutions)"."""
    f = float(objective(np.asarray(record["mean_gap"]))) * 1e6
    limit = float(record["objective_limit"]) * 1e6
    regime, period = Regime(int(record["regime"])), float(record["period"])
    parts = [regime.name.lower()]
    if np.isfinite(period):
        parts.append(f"period {period:.0f}")
    if regime in (Regime.CHAOTIC, Regime.SEVERAL):
        exponent = float(record["lyapunov_exponent"])
        parts.append(f"perturbations grow by e^{exponent:.2g} per revolution")
    parts.append(f"{int(record['steady_revolutions'])} revolutions")
    if not np.isfinite(limit):
        return f"{f:.4g} um, interval not known ({', '.join(parts)})"
    digits = max(1 - int(np.floor(np.log10(limit))), 0) if limit > 0.0 else 6
    return f"{f:.{digits}f} +- {limit:.{digits}f} um ({', '.join(parts)})"


def reached(records: Records) -> tuple[str, list[str]]:
    """How many samples (n,) of a scene met its target error, and a line for each kind of motion in which some did not."""
    short, good = missed(records), records["status"] == Status.OK
    lines = []
    for regime in Regime:
        which = records["sample"][short & (records["regime"] == regime)]
        if len(which):
            names = ", ".join(str(number) for number in which[:NAMED])
            more = ", ..." if len(which) > NAMED else ""
            lines.append(f"{len(which)} {regime.name.lower()} (samples {names}{more})")
    return f"met on {int(good.sum() - short.sum())} of {len(records)}", lines


def recorded(scene: Scene, records: Records) -> dict[str, str]:
    """The attribute of a dataset that says what came of a target error, if there was one."""
    target = scene.numerics.target_error
    if target is None or not scene.clearance_joints():
        return {}
    met, lines = reached(records)
    missing = f"; missed: {'; '.join(lines)}" if lines else ""
    return {"target_error_reached": f"{target:g} {met}{missing}"}


def in_short(scene: Scene, records: Records) -> str:
    """What a trial came to: share of samples that met their target, their intervals, share that is chaotic; else ""."""
    if scene.numerics.target_error is None or not scene.clearance_joints():
        return ""
    good = records[records["status"] == Status.OK]
    if len(good) == 0:
        return "no sample finished"
    limit = np.nanmedian(good["objective_limit"] / good["objective"])
    met = (len(good) - missed(good).sum()) / len(records)  # what failed has met nothing
    text = f"half-width {limit:.0e}, met by {100 * met:.0f} %"
    chaotic = np.isin(good["regime"], (Regime.CHAOTIC, Regime.SEVERAL)).mean()
    return text + (f", {100 * chaotic:.0f} % chaotic" if chaotic else "")

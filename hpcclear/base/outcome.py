"""How a simulation ended: one code a sample, each with a message and a remedy, and the record it fills.

A failed simulation is an outcome, not an exception: its numbers are NaN and its status says why.
"""

from enum import IntEnum

import numpy as np

JOINTS = ("crank_rod", "rod_slider")
"""Joint labels in every dataset of a slider-crank: O12 and O23 of the paper."""

MAX_JOINTS = 8
"""Largest number of joints of a record; datasets contain those of the scene."""

WAVE_ROWS = 32
"""Largest number of profile coefficients of all joints."""


class Status(IntEnum):
    """Outcome of one simulation. Numbers are NaN unless it is `valid`."""

    OK = 0
    STEP_CAP = 1
    STEP_TOO_SMALL = 2
    NOT_FINITE = 3
    STALLED = 4
    AVERAGE_CAP = 5
    NEAR_SINGULAR = 6
    WORN_THROUGH = 7
    JUMP_TOO_SHORT = 8
    CANNOT_TURN = 9
    TORN_THROUGH = 10

    @property
    def valid(self) -> bool:
        """Whether the simulation ran to its end, so that its numbers mean something."""
        return self in (Status.OK, Status.AVERAGE_CAP)

    @property
    def message(self) -> str:
        """What happened, in one sentence."""
        return _TEXT[self][0]

    @property
    def remedy(self) -> str:
        """What to change, in one sentence."""
        return _TEXT[self][1]


_TEXT = {
    Status.OK: ("finished", "nothing to do"),
    Status.STEP_CAP: (
        "numerics.max_steps was reached before the last revolution ended",
        "see with hpcclear check that nothing locks, and check masses, stiffness and clearance; "
        "if all are correct, raise numerics.max_steps",
    ),
    Status.STEP_TOO_SMALL: (
        "the step size fell below the resolution of the time",
        "loosen numerics.rtol; if that does not help, the stiffness of the contact is out of range, or a bar bends too far",
    ),
    Status.NOT_FINITE: (
        "the state became infinite or undefined",
        "check masses, stiffness and clearance of this sample",
    ),
    Status.STALLED: (
        "the crank stopped before the requested revolutions were complete",
        "raise the drive torque, the initial speed or the flywheel inertia",
    ),
    Status.AVERAGE_CAP: (
        "an automatic average of an earlier version was still above its target at the last revolution allowed",
        "set numerics.target_error; see objective_spread",
    ),
    Status.NEAR_SINGULAR: (
        "the ideal joints come to a change point, where their constraints depend on one another: forces grow without bound, "
        "or the motion is not determined",
        'change a length (lengthen the rod), or give a joint of that loop kind = "clearance"',
    ),
    Status.WORN_THROUGH: (
        "a clearance has grown to a quarter of its bearing's radius, so the bearing is worn through",
        "give wear.limit a threshold that ends a service life earlier, or check wear coefficients and lengths of bearings",
    ),
    Status.JUMP_TOO_SHORT: (
        "no extrapolation jump over the averaged revolutions meets wear.tolerance",
        "loosen wear.tolerance, lower numerics.averaged_revolutions, or check the wear coefficients",
    ),
    Status.CANNOT_TURN: (
        "the linkage cannot turn: without clearance it locks within a turn of its drives, or cannot be assembled",
        "change lengths, points or angles so that it turns; hpcclear check of this design shows where it locks",
    ),
    Status.TORN_THROUGH: (
        "a journal penetrated its bearing by more than a quarter of the bearing's radius",
        "check masses, speed, loads and contact stiffness, and whether the mechanism can move",
    ),
}


class Flag(IntEnum):
    """Bits of `flags`: the result is valid, but read it with care."""

    LATCHED = 1  # a joint stayed in contact for whole revolutions with a frozen impact speed
    BEYOND_HERTZ = 2  # penetration beyond the range of Hertz theory
    STIFF = 4  # the implicit method was used for part of the run
    TARGET_MISSED = 8  # the steady mean is not known to the target error, or there is none


class Regime(IntEnum):
    """What kind of motion a steady mean was looked for in."""

    UNJUDGED = 0
    REGULAR = 1
    SETTLING = 2
    UNSTEADY = 3
    CHAOTIC = 4
    SEVERAL = 5

    @property
    def meaning(self) -> str:
        """What it says about the motion, in a few words."""
        return _REGIMES[self]


_REGIMES = {
    Regime.UNJUDGED: "not judged",
    Regime.REGULAR: "regular: the motion repeats itself",
    Regime.SETTLING: "still settling: the average has not converged",
    Regime.UNSTEADY: "unsteady: the average drifts, there is no steady mean",
    Regime.CHAOTIC: "chaotic: the smallest perturbation grows to the size of the motion",
    Regime.SEVERAL: "several orbits: the smallest perturbation decides which one is reached",
}


RESPONSES = (
    "mean_contact_force",
    "peak_crank_moment",
    "slider_acceleration_deviation",
    "point_acceleration_deviation",
    "peak_point_acceleration",
)
"""Fields of `OUTCOME` that a study of one of them records."""

ON_REQUEST = (*RESPONSES, "rate_of_objective", "sliding_work", "sliding_waves", "energy_error")
"""Fields of `OUTCOME` that are NaN, and left out of datasets, unless a scene requests them."""

STEADY = ("objective_limit", "lyapunov_exponent", "period", "steady_rtol", "steady_revolutions")
"""Fields of `OUTCOME` that a target error fills in, and that datasets hold where a `regime` was judged."""

MAPPED = ("lyapunov_exponent_limit", "attractors")
"""Fields that a map fills in besides."""

JUDGED = (*STEADY, *MAPPED, "regime")
"""All that stands in datasets only where a `regime` was judged."""

OUTCOME = np.dtype(
    [
        ("sample", np.int64),  # index in the design; -1 never leaves the evaluator
        ("objective", np.float64),  # m, eq. 13
        ("objective_spread", np.float64),  # m, standard deviation between averaged revolutions
        (
            "objective_uncertainty",
            np.float64,
        ),  # m, its half-width: over perturbed copies, or of the steady mean; NaN where nothing checked it
        ("mean_gap", np.float64, MAX_JOINTS),  # m, time mean of | |e| - c | at each joint
        (
            "peak_contact_force",
            np.float64,
            MAX_JOINTS,
        ),  # N, at each joint over the averaged revolutions
        (
            "mean_contact_force",
            np.float64,
            MAX_JOINTS,
        ),  # N; NaN unless the study's objective asks for it,
        ("peak_crank_moment", np.float64),  # N m, likewise
        ("slider_acceleration_deviation", np.float64),  # m/s^2, likewise
        ("point_acceleration_deviation", np.float64),  # m/s^2, of the followed point of a linkage
        ("peak_point_acceleration", np.float64),  # m/s^2, likewise
        (
            "rate_of_objective",
            np.float64,
            MAX_JOINTS,
        ),  # what is made of the objective's own rate; NaN without one
        ("sliding_work", np.float64, MAX_JOINTS),  # J a revolution; NaN unless a joint wears
        (
            "sliding_waves",
            np.float64,
            WAVE_ROWS,
        ),  # likewise, by the contact's angle; NaN unless recorded
        ("energy_error", np.float64),  # of the balance, relative; NaN unless asked for
        ("objective_limit", np.float64),  # m, 95 % half-width of the steady mean's limits
        ("lyapunov_exponent", np.float64),  # largest Lyapunov exponent, per revolution
        ("lyapunov_exponent_limit", np.float64),  # of its limits; NaN outside maps
        ("attractors", np.float64),  # kinds of motion found from several starts; NaN outside maps
        ("period", np.float64),  # revolutions; NaN where none was found
        ("steady_rtol", np.float64),  # the tightest tolerance used
        ("steady_revolutions", np.float64),  # of all copies, spin-up included
        ("regime", np.int8),
        ("latched", np.int8, MAX_JOINTS),
        ("rhs_evaluations", np.int64),
        ("status", np.int8),
        ("flags", np.int8),
    ]
)
"""The record of one finished sample, as it travels over ranks and into datasets."""


def failed(sample: int, status: Status, rhs_evaluations: int = 0) -> np.ndarray:
    """A record of one failed sample: numbers NaN, never 0 (shape ``(1,)`` of `OUTCOME`)."""
    record = np.zeros(1, OUTCOME)
    for name in OUTCOME.names or ():
        if OUTCOME[name].base.kind == "f":
            record[name] = np.nan
    record["sample"], record["status"], record["rhs_evaluations"] = sample, status, rhs_evaluations
    return record

"""How a simulation ended: one code a sample, each with a message and a remedy, and the record it fills.

A failed simulation is an outcome, not an exception: its numbers are NaN and its status says why.
"""

from collections.abc import Callable, Collection
from enum import IntEnum
from typing import Any, NamedTuple, Self

import numpy as np

JOINTS = ("crank_rod", "rod_slider")
"""Joint labels in every dataset of a slider-crank: O12 and O23 of the paper."""

MAX_JOINTS = 8
"""Largest number of contacts of a record, one in a pin, two in a slot, four in a guide; datasets contain those of the scene."""

MAX_BANDS = 4
"""Largest number of third-octave bands whose levels a record has."""

WAVE_ROWS = 32
"""Largest number of profile coefficients of all joints."""


class Status(IntEnum):
    """Outcome of one simulation, with `message` and `remedy`, a sentence each. Numbers are NaN unless it is `valid`."""

    message: str
    remedy: str

    def __new__(cls, code: int, message: str = "", remedy: str = "") -> Self:
        """A code and its words."""
        one = int.__new__(cls, code)
        one._value_, one.message, one.remedy = code, message, remedy
        return one

    OK = 0, "finished", "Nothing to do"
    STEP_CAP = (
        1,
        "numerics.max_steps was reached before the last revolution ended",
        "See with hpcclear check that nothing locks, and check masses, stiffness and clearance; "
        "if all are correct, raise numerics.max_steps",
    )
    STEP_TOO_SMALL = (
        2,
        "the step size fell below the resolution of the time",
        "Loosen numerics.rtol; if that does not help, the stiffness of the contact is out of range, or a bar bends too far",
    )
    NOT_FINITE = (
        3, "the state became infinite or undefined", "Check masses, stiffness and clearance of this sample"
    )  # fmt: skip
    STALLED = (
        4,
        "the crank stopped before the requested revolutions were complete",
        "Raise the drive torque, the initial speed or the flywheel inertia; a drive with an interval may swing",
    )
    NEAR_SINGULAR = (
        6,
        "the ideal joints come to a change point, where their constraints depend on one another: forces grow without bound, "
        "or the motion is not determined",
        'Change a length (lengthen the rod), or give a joint of that loop kind = "clearance"',
    )
    WORN_THROUGH = (
        7,
        "a clearance has grown to a quarter of its bearing's radius, so the bearing is worn through",
        "Give wear.limit a threshold that ends a service life earlier, or check wear coefficients and lengths of bearings",
    )
    JUMP_TOO_SHORT = (
        8,
        "no extrapolation jump over the averaged revolutions meets wear.tolerance",
        "Loosen wear.tolerance, lower numerics.averaged_revolutions, or check the wear coefficients",
    )
    CANNOT_TURN = (
        9,
        "the linkage cannot turn: without clearance it locks within a turn of its drives, or cannot be assembled",
        "Change lengths, points or angles so that it turns; hpcclear check of this design shows where it locks",
    )
    TORN_THROUGH = (
        10,
        "a journal penetrated its bearing by more than a quarter of the bearing's radius",
        "Check masses, speed, loads and contact stiffness, and whether the mechanism can move",
    )

    @property
    def valid(self) -> bool:
        """Whether the simulation ran to its end, so that its numbers mean something."""
        return self is Status.OK


class Flag(IntEnum):
    """Bits of `flags`: the result is valid, but read it with care."""

    LATCHED = 1  # a joint stayed in contact for whole revolutions with a frozen impact speed
    BEYOND_HERTZ = 2  # penetration beyond the range of Hertz theory
    STIFF = 4  # the implicit method was used for part of the run
    TARGET_MISSED = 8  # the steady mean is not known to the target error, or there is none


class Regime(IntEnum):
    """What kind of motion a steady mean was looked for in; `meaning`: what it says about the motion, in a few words."""

    meaning: str

    def __new__(cls, code: int, meaning: str = "") -> Self:
        """A code and its words."""
        one = int.__new__(cls, code)
        one._value_, one.meaning = code, meaning
        return one

    UNJUDGED = 0, "not judged"
    REGULAR = 1, "regular: the motion repeats itself"
    SETTLING = 2, "still settling: the average has not converged"
    UNSTEADY = 3, "unsteady: the average drifts, there is no steady mean"
    CHAOTIC = 4, "chaotic: the smallest perturbation grows to the size of the motion"
    SEVERAL = 5, "several motions: the smallest change of the start decides which one runs"


class Field(NamedTuple):
    """A number of a record: all that datasets, objectives and statistics know of it."""

    unit: str
    """SI, "1" of a plain number, "" of a code, "objective" of the study's objective, "rate" of what is made of its rate."""
    words: str
    kind: str = "f8"
    """As of numpy."""
    per: str = ""
    """"joint", "wave", "band" or "joint band": what there is one for each of; "" for one a sample."""
    when: str = ""
    """What a scene has to require, so that it is no NaN and stands in datasets: "response" or "impact" (an objective of it),
    "level" (levels in some band), "pressure", "rate" (of the objective), "wear", "energy" (other effects), "steady" (a target
    error), "map"; "" of what always does."""
    required: bool = False
    """Whether every file with the outcome of a simulation has it."""
    goal: str = ""
    """What a study makes small by it, in words (`hpcclear.base.objectives.OURS`); "" for no objective."""
    of: str | Callable[[Any], Any] | None = None
    """Its values from what the kernel averaged, by a name or formula: of a `hpcclear.dynamics.layout.views.Outcome`, or of
    the revolutions of one response; ``in_revolution("NAME")`` is an integral over one. None where it is filled in later."""

    def values(self, outcome: Any) -> Any:
        """What `of` gives."""
        return self.of(outcome) if callable(self.of) else getattr(outcome, str(self.of))


_IMPACTS = {
    "impacts": Field("1", "number of contacts that begin in a revolution", per="joint", when="impact",
        goal="number of impacts in a revolution",
        of=lambda o: o.in_revolution("begun")),
    "impact_energy": Field("J", "energy lost by damping of the contact in a revolution", per="joint", when="impact",
        goal="energy lost in impacts in a revolution, of all joints",
        of=lambda o: o.in_revolution("impact_power")),
    "contact_impulse": Field("N s", "impulse of the normal force in a revolution", per="joint", when="impact",
        goal="impulse of the contact force in a revolution",
        of=lambda o: o.in_revolution("mean_force")),
    "contact_loss": Field("rad", "angle of a revolution without contact", per="joint", when="impact",
        goal="angle of the drive without contact in a revolution",
        of=lambda o: o.flight * o.cycle[:, None]),
    "rms_contact_force": Field("N", "root mean square of the normal force", per="joint", when="impact",
        goal="root mean square of the contact force",
        of=lambda o: np.sqrt(np.maximum(o.square_force, 0.0))),
    "rms_frame_force": Field("N", "root mean square about its mean of the force on the frame", when="impact",
        goal="root mean square about its mean of the force on the frame",
        of=lambda o: np.sqrt(np.maximum(o.square_frame_force - (o.frame_force**2).sum(axis=1), 0.0))),
}  # fmt: skip
"""Measures of impact and noise; angles without contact go by time."""

_LEVELS = {
    "frame_force_level": Field("1", "third-octave level of the force on the frame, dB re 1e-6 N", per="band", when="level"),
    "contact_force_level": Field("1", "third-octave level of the contact force, dB re 1e-6 N", per="joint band", when="level"),
}  # fmt: skip

FIELDS = {
    "sample": Field("1", "number of the sample in the design", "i8"),  # -1 never leaves the evaluator
    "objective": Field("objective", "objective f, mean gap between journal and bearing", required=True,  # eq. 13
        of="objective"),
    "objective_spread": Field("objective", "cycle-to-cycle standard deviation of f", required=True, of="spread"),
    "objective_uncertainty": Field("objective", "half-width of f, by replicas or of its steady mean"),
    "mean_gap": Field("m", "time mean of the distance from the clearance circle", per="joint", of="mean_gap"),
    "peak_contact_force": Field("N", "largest contact force over the averaged revolutions", per="joint",
        goal="peak contact force", of="peak_force"),
    "mean_contact_force": Field("N", "mean contact force over the averaged revolutions", per="joint", when="response",
        goal="mean contact force", of="mean_force"),
    "peak_crank_moment": Field("N m", "largest absolute torque of the drive on the crank", when="response",
        goal="peak torque of the drive on the crank", of="peak_moment"),
    "slider_acceleration_deviation": Field("m/s^2", "standard deviation of the slider acceleration in time", when="response",
        goal="standard deviation in time of the slider acceleration", of="acceleration_deviation"),
    "point_acceleration_deviation": Field(
        "m/s^2", "root mean square of the acceleration of the followed point about its mean", when="response",
        goal="root mean square about its mean of the acceleration of the followed point", of="acceleration_deviation"),
    "peak_point_acceleration": Field("m/s^2", "largest acceleration of the followed point", when="response",
        goal="largest acceleration of the followed point", of="peak_acceleration"),
    **_IMPACTS,
    "band": Field("Hz", "middle of the third-octave band", per="band", when="level"),
    **_LEVELS,
    **{
        f"{name}_limit": Field(
            one.unit, f"half-width of the 95 % confidence interval of {name}", per=one.per, when="level")
        for name, one in (_LEVELS | _IMPACTS).items()
    },
    "peak_contact_pressure": Field("Pa", "largest pressure at the peak contact force", per="joint", when="pressure",
        goal="peak contact pressure"),
    "contact_half_angle": Field("rad", "half of the angle of contact at the peak contact force", per="joint", when="pressure",
        goal="half angle of contact at the peak force"),
    "rate_of_objective": Field("rate", "mean, integral, RMS or peak of the objective's own rate", per="joint", when="rate"),
    "sliding_work": Field("J", "normal force times sliding distance in a revolution", per="joint", when="wear",
        of=lambda o: o.sliding_power * o.revolution[:, None]),
    "sliding_waves": Field(
        "J", "sliding work of a revolution times waves of the contact's angle", per="wave", when="wear",
        of=lambda o: o.profile * o.revolution[:, None]),
    "energy_error": Field("1", "energy residual over the larger of kinetic energy and driving work", when="energy"),
    "objective_limit": Field(
        "objective", "half-width of the 95 % confidence interval of f as a steady mean", when="steady"),
    "lyapunov_exponent": Field("1", "largest Lyapunov exponent, per revolution", when="steady"),
    "lyapunov_exponent_limit": Field("1", "half-width of the 95 % confidence interval of lyapunov_exponent", when="map"),
    "attractors": Field("1", "number of different motions reached from several starts", when="map"),
    "period": Field("1", "period of the motion in revolutions", when="steady"),  # NaN where none was found
    "steady_rtol": Field("1", "tightest relative tolerance used for the steady mean", when="steady"),
    "steady_revolutions": Field("1", "revolutions of all replicas used for the steady mean", when="steady"),
    "regime": Field("", "kind of motion", "i1"),
    "latched": Field("", "whether damping uses the last impact velocity, for whole revolutions", "i1", "joint"),
    "rhs_evaluations": Field("1", "number of evaluations of the equations of motion", "i8", required=True),
    "status": Field("", "outcome of the simulation", "i1", required=True),
    "flags": Field("", "validity warnings of the result", "i1"),
}  # fmt: skip
"""The record of a sample, a field each."""


def _fields(*when: str) -> tuple[str, ...]:
    return tuple(name for name, one in FIELDS.items() if one.when in when)


RESPONSES = _fields("response")
"""Fields that a study of one of them records."""

IMPACTS = _fields("impact")
"""Fields that measure impact and noise."""

WIDEST = {"peak_contact_pressure": "pressure", "contact_half_angle": "half_angle"}
"""Fields of the contact at its peak force, and what a geometry of contact calls them; not all geometries have a pressure."""

LEVELS = _fields("level")
"""Fields of recorded samples: force levels in third-octave bands, and half-widths."""

ON_REQUEST = _fields("response", "impact", "level", "pressure", "rate", "wear", "energy")
"""Fields that are NaN, and left out of datasets, unless a scene requests them."""

STEADY, MAPPED = _fields("steady"), _fields("map")
"""Fields that a target error fills in, and that datasets hold where a `regime` was judged; and those of a map besides."""

JUDGED = (*STEADY, *MAPPED, "regime")
"""All that stands in datasets only where a `regime` was judged."""


def record_type(joints: int = len(JOINTS), bands: int = 0, asked: Collection[str] = ()) -> np.dtype:
    """Type of the record of a sample, as it travels over ranks and into datasets.

    It has the fields that are always known, and those whose `Field.when` is among `asked`. `hpcclear.scene.scene.record_of`
    names the type of a scene.
    """
    sizes = {"joint": joints, "wave": WAVE_ROWS, "band": bands}
    fields = {name: one for name, one in FIELDS.items() if one.when in ("", *asked)}
    shapes = {name: tuple(sizes[per] for per in one.per.split()) for name, one in fields.items()}
    return np.dtype([(name, one.kind, shapes[name]) for name, one in fields.items()])


OUTCOME = record_type()
"""The record of a slider-crank that requests nothing further."""

NUMBERS = tuple(name for name, one in FIELDS.items() if one.kind == "f8")
"""Fields that are NaN where nothing is known, as in a failed sample."""


def unknown(count: int, record: np.dtype = OUTCOME) -> np.ndarray:
    """Records (count,) of a `record_type`: numbers NaN, codes 0."""
    records = np.zeros(count, record)
    for name in {*NUMBERS} & {*(record.names or ())}:
        records[name] = np.nan
    return records


def failed(sample: int, status: Status, work: int = 0, record: np.dtype = OUTCOME) -> np.ndarray:
    """A record of one failed sample: numbers NaN, never 0 (shape ``(1,)`` of a `record_type`); `work`: its evaluations."""
    found = unknown(1, record)
    found["sample"], found["status"], found["rhs_evaluations"] = sample, status, work
    return found


def recast(records: np.ndarray, record: np.dtype) -> np.ndarray:
    """Records (n,) in another `record_type`, unchanged if in it already: fields and joints that it adds are unknown."""
    if records.dtype == record:
        return records
    found = unknown(len(records), record)
    for name in {*(record.names or ())} & {*(records.dtype.names or ())}:
        shapes = zip(found[name].shape, records[name].shape, strict=True)
        common = tuple(slice(min(sizes)) for sizes in shapes)
        found[name][common] = records[name][common]
    return found

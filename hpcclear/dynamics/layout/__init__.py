"""Where everything stands in the kernel's flat buffers: row k of lane i is ``buffer[k * W + i]``.

Rows are numbered as they are declared (`hpcclear.base.numbered`). They are module constants, so the compiler sees every
distance between two rows and can vectorise over the lanes without run-time checks. Rows of disabled effects are never touched.
"""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from hpcclear.base.numbered import RowNumbers
from hpcclear.base.outcome import MAX_JOINTS, WAVE_ROWS
from hpcclear.laws.declared import LAW_NUMBERS

TURN = 6.283185307179586  # rad

MAX_COORDINATES = 88
"""Coordinates that a sample may have, bristles included. Moved on by a multiple of 64, as `OWN` is, rows keep their places in
the sets of a first-level cache, and a scene of few coordinates its speed. Only rows in use are touched."""


class LaneLaw(Protocol):
    """What is known here of a law or rate compiled into the lanes (`contacts.laws.InLanes`), 1 or None."""

    latched: int | None
    bristled: int | None
    whole: int | None
    largest: int | None


class Effects(NamedTuple):
    """What is on (1) and what is off (None): None prunes the branch before it is compiled."""

    joints: int = 0  # how many have clearance
    first: int = 0  # place of the first of them; the others follow
    contact: LaneLaw | None = None  # the normal force's law
    friction: LaneLaw | None = None
    torque: int | None = None  # the body that gives the period is free, driven by a torque
    energies: int | None = None  # energy balance
    series: int | None = None  # friction forces and crank moment, for time series
    responses: int | None = None  # mean forces, drive moment, followed acceleration of each sample
    impacts: int | None = None  # measures of impact and noise of each sample
    sliding: int | None = None  # kinks of the laws, for the implicit method
    wear: int | None = None  # sliding work of the joints with clearance
    waves: int | None = None  # surfaces are out of round; waves around bearing and journal:
    bearing_waves: int | None = None
    journal_waves: int | None = None
    threshold: int | None = None  # of the pressure, below which nothing wears
    profile: int | None = None  # where around these the sliding work is done
    films: tuple[str | None, ...] | None = None  # laws of oil films, by places of joints
    objective: LaneLaw | None = None  # the rate that the study's objective is made of

    @property
    def latched(self) -> int | None:
        """Whether the normal force's law requires the impact speed, which is `latched`."""
        return None if self.contact is None else self.contact.latched

    @property
    def film_at(self) -> tuple[str | None, ...]:
        """The same, of scenes without oil as well."""
        return self.films or (None,) * MAX_JOINTS

    @property
    def bristled(self) -> int | None:
        """Whether friction has bristles, a coordinate for each joint with clearance."""
        return None if self.friction is None else self.friction.bristled


def places_of(effects: Effects) -> range:
    """Places of the joints with clearance."""
    return range(effects.first, effects.first + effects.joints)


def wave_rows(effects: Effects) -> int:
    """How many of `WAVE_ROWS` are in use: of each place up to the last open one those of the bearing, then of the journal,
    cosine and sine of one wave, of two and so on."""
    waves = (effects.bearing_waves or 0) + (effects.journal_waves or 0)
    return 2 * waves * places_of(effects).stop


# ---- parameters of one sample -------------------------------------------------------------------
OF_SAMPLE = RowNumbers()
SPEED = OF_SAMPLE("of the drive: a turn over its share of the period", "rad/s")
DRIVEN_LENGTH = OF_SAMPLE("largest distance between points of the body that gives the period", "m")
PERIOD = OF_SAMPLE("one revolution at the prescribed speed", "s")
FIRST_STEP = OF_SAMPLE("first step to try", "s")
STRICTNESS = OF_SAMPLE("squared: how many times tighter than the run's its tolerances are")
EDGE = OF_SAMPLE("one over the relative tolerance of explicit steps at the edge of stability")
TURN_END = OF_SAMPLE("angle at which a revolution of a free body ends", "rad")
HELD_MOMENT = OF_SAMPLE("of a sample without anything to integrate: largest drive torque", "N m")
HELD_DEVIATION = OF_SAMPLE("likewise: standard deviation of the followed acceleration", "m/s^2")
HELD_PEAK = OF_SAMPLE("likewise: its largest size", "m/s^2")

# of coordinates, from MAX_COORDINATES on of velocities; lanes hold them times the run's. Both together
# have 320 rows, whole pages of 16 lanes, so that rows of joints keep their places in the sets of the cache
# A lane is given of these only what its coordinates need: no other row stands between them and the joints.
LEAST = OF_SAMPLE("absolute tolerances over that of lengths", size=2 * MAX_COORDINATES)
WRAPS = OF_SAMPLE("by how much coordinates are counted anew with each revolution", "rad", size=144)

OF_JOINT = RowNumbers()  # within a joint's block
CLEARANCE = OF_JOINT("radial clearance", "m")
BEARING_RADIUS = OF_JOINT("radius of the bearing", "m")
JOURNAL_RADIUS = OF_JOINT("radius of the journal", "m")
# peaks between steps are found by these two
EXPONENT = OF_JOINT("of the depth in the normal force")
DAMPING = OF_JOINT("factor of the rate in it, or of the rate over the impact speed", "s/m")
DEEPEST_VALID = OF_JOINT("depth from where on a result is flagged", "m")
INVERSE_RAMP = OF_JOINT("one over the sliding speed within which friction changes most", "s/m")
STEEPNESS = OF_JOINT("largest slope of friction over normal force", "s/m")
CONTACT_NUMBERS = OF_JOINT("of its law of contact", size=LAW_NUMBERS)
FRICTION_NUMBERS = OF_JOINT("of its law of friction", size=LAW_NUMBERS)
FILM_SCALE = OF_JOINT("of the film's force; 0 where there is none", "N s/m")
FILM_SHEAR = OF_JOINT("2 pi mu L R^3/c", "N m s")
FILM_FLOOR = OF_JOINT("least thickness over the clearance")
# with bristles next to nothing, but not nothing
FILM_STEEPNESS = OF_JOINT("the film's force over that of inertia, by the speed", "s/m")
JOINT_ROWS = OF_JOINT.end
JOINT_BLOCKS = OF_SAMPLE("of all joints, one behind the other", size=MAX_JOINTS * JOINT_ROWS)
OWN = OF_SAMPLE("what a linkage has of its own", size=192 + 16 * 64)
# in scenes that have such: those of `wave_rows`, and for each another, its slope's
WAVES = OF_SAMPLE("of surfaces that are out of round", size=2 * WAVE_ROWS)
# two a joint: (slope) F_N + (offset), between 0 and 1
THRESHOLDS = OF_SAMPLE("of what share of the normal force wears", size=2 * MAX_JOINTS)
FURTHER_ROWS = 180
FURTHER = OF_SAMPLE("what laws of films have besides", size=MAX_JOINTS * FURTHER_ROWS)
PARAMETERS = OF_SAMPLE.end


def tolerance_rows(n: int) -> np.ndarray:
    """Rows of `LEAST` in use for n coordinates, those of their velocities last."""
    return LEAST + np.r_[:n, MAX_COORDINATES : MAX_COORDINATES + n]


# ---- what the motion writes besides accelerations ---------------------------------------------
# What joints have stands side by side, so that the compiler knows the distances between one joint's rows, whichever it is.
# Rates that are integrated name the effect that requires them.
WRITTEN = RowNumbers()
EACH = MAX_JOINTS
GAP = WRITTEN("distance from the clearance circle, positive in contact", "m", EACH, "joints")
FORCE = WRITTEN("normal force", "N", EACH, "responses")
GAP_RATE = WRITTEN("rate of the gap", "m/s", EACH)
DRIVE_POWER = WRITTEN("of all drives", "W", asked_by="energies")
ABS_DRIVE_POWER = WRITTEN("its size", "W", asked_by="energies")
DISSIPATION = WRITTEN("of contacts, guides, bars", "W", asked_by="energies")
LOAD_POWER = WRITTEN("of loads and springs", "W", asked_by="energies")
FRICTIONS = WRITTEN("tangential force, for time series and objectives", "N", EACH)
DRIVE_MOMENT = WRITTEN("for time series, responses and objectives", "N m")
FOLLOWED_ACCELERATION = WRITTEN("of a body, or a point along x", "m/s^2", asked_by="responses")
FOLLOWED_SQUARE = WRITTEN("of the followed acceleration", "m^2/s^4", asked_by="responses")
FOLLOWED_ACROSS = WRITTEN("of a point along y", "m/s^2", asked_by="responses")
IMPACT_POWERS = WRITTEN("lost by the damping of contacts, friction left out", "W", EACH, "impacts")
FORCE_SQUARES = WRITTEN("of the normal force", "N^2", EACH, "impacts")
FRAME_X = WRITTEN("force of the mechanism on its frame, along x", "N", asked_by="impacts")
FRAME_Y = WRITTEN("likewise along y", "N", asked_by="impacts")
FRAME_SQUARE = WRITTEN("square of its size", "N^2", asked_by="impacts")
# no rates, their integrals are summed up at the ends of steps
FLIGHTS = WRITTEN("time without contact", "s", EACH, "steps")
BEGUN = WRITTEN("how many contacts began", "", EACH, "steps")
SLIDING_POWERS = WRITTEN("F_N |v_t|", "W", EACH, "wear")
OBJECTIVE_RATES = WRITTEN("of each joint, or the first of the whole", "", EACH, "objective")
SLIDING_SPEEDS = WRITTEN("this and normals for the objective's rate only", "m/s", EACH)
NORMALS_X = WRITTEN("from the bearing's centre to the journal's", "", EACH)
NORMALS_Y = WRITTEN("likewise", "", EACH)
# for the implicit method only
FORCE_KINKS = WRITTEN("changes its sign where the normal force is cut at 0", "", EACH)
LOW_KINKS = WRITTEN("changes its sign at the lower side of friction's ramp", "", EACH)
HIGH_KINKS = WRITTEN("and at the upper side", "", EACH)
# these and what follows are for profiles of wear only, and stand last, so that others need not pass over them
ANGLES = WRITTEN("cosine and sine of the contact's angle in bearing and journal", "", 4 * EACH)
PROFILES = WRITTEN("sliding powers times waves, as of `wave_rows`", "W", WAVE_ROWS, "profile")
MAX_CURVES = 8
PLACES = WRITTEN("of tabulated curves: shares of their lengths", "", MAX_CURVES)
PLACE_RATES = WRITTEN("their rates", "1/s", MAX_CURVES)
RATES = WRITTEN.end


class Integrated(NamedTuple):
    """A rate that every stepper integrates over a step: its row, and the effect that requires it. A gap's absolute value is
    integrated, and the error of its integral, relative to the clearance times a revolution, counts for the step's."""

    rate: int
    asked_by: str


_PLACES = range(MAX_JOINTS)
GAPS = tuple(Integrated(GAP + k, "joints") for k in _PLACES)
_OTHERS = [row for row in WRITTEN.declared if row.asked_by and row.first != GAP]
_STEPPED = {row.asked_by for row in _OTHERS} - {"profile", "steps"}
_PROFILES, MEASURES, _SUMMED = (
    tuple(
        Integrated(row.first + k, row.asked_by)
        for row in _OTHERS
        if row.asked_by in groups
        for k in range(row.size)
    )
    for groups in (("profile",), _STEPPED, ("steps",))
)
INTEGRATED = (*GAPS, *MEASURES, *_SUMMED, *_PROFILES)
"""All that is integrated; profiles of wear at the ends of steps (`stepping.profile`).
The explicit and implicit steppers, the sums of a lane and its outcome read this."""

INTEGRATED_RATES = np.array([one.rate for one in INTEGRATED])


def _mask(largest: int) -> int:
    """All bits that numbers up to `largest` have: taken with it a number is not below 0, and no other number."""
    return (1 << largest.bit_length()) - 1


JOINT_MASK = _mask(MAX_JOINTS - 1)
COORDINATE_MASK = _mask(MAX_COORDINATES - 1)
CURVE_MASK = _mask(MAX_CURVES - 1)
MEASURE_MASK = _mask(max(one.rate for one in MEASURES))


def measures_of(effects: Effects) -> np.ndarray:
    """Rates besides the gaps that are integrated with these effects."""
    there = places_of(effects)
    whole = effects.objective is not None and effects.objective.whole
    closed: set[int] = set()
    for row in _OTHERS:
        if row.size == MAX_JOINTS:
            open_ = range(1) if whole and row.first == OBJECTIVE_RATES else there
            closed |= {row.first + k for k in _PLACES if k not in open_}
    asked = [one for one in MEASURES if getattr(effects, one.asked_by) is not None]
    return np.array([one.rate for one in asked if one.rate not in closed], np.int64)


def place(rate: int) -> int:
    """Where a rate stands in `INTEGRATED`."""
    return [one.rate for one in INTEGRATED].index(rate)


WORKS = place(DRIVE_POWER)  # the first of four: drive, its absolute value, losses, load

# ---- lane state and scratch ---------------------------------------------------------------------
OF_LANE = RowNumbers()
Q = OF_LANE("coordinates at the start of the step", size=MAX_COORDINATES)
V = OF_LANE("velocities", size=MAX_COORDINATES)
QS = OF_LANE("coordinates of the stage", size=MAX_COORDINATES)
VS = OF_LANE("velocities", size=MAX_COORDINATES)
ACC = OF_LANE("accelerations of the stage", size=MAX_COORDINATES)
MAX_PINS = 96
# of observed motions only
PINS = OF_LANE("forces of ideal pins on their journals, along x, then along y", "N", 2 * MAX_PINS)
RATE_NOW = OF_LANE("rates of the stage", size=RATES)
RATE_OLD = OF_LANE("rates at the start of the step", size=RATES)
RATE_SUM = OF_LANE("weighted by the method: h * sum is the integral over the step", size=RATES)
RATE_ERROR = OF_LANE("weighted by the difference of the pair", size=RATES)
INTEGRAL = OF_LANE("since the start of the revolution (gaps: of their absolute values)", size=RATES)
TIME = OF_LANE("since the start of this revolution", "s")
STEP = OF_LANE("the step being tried", "s")
NEXT_STEP = OF_LANE("step that the controller proposes", "s")
STAGE_TIME = OF_LANE("of the stage", "s")
BEGAN = OF_LANE("when this revolution began, since the sample's start", "s")
ERROR = OF_LANE("mean square of the scaled error")
LOG_ERROR = OF_LANE("log2 of the last accepted one")
ACCEPT = OF_LANE("1 or 0")
PEAK_MOMENT = OF_LANE("of the drive, its size")
PEAK_FOLLOWED = OF_LANE("of the square of the followed acceleration")
AVERAGING = OF_LANE("1 once the transient is over")
ATTEMPTS = OF_LANE("steps tried, accepted or not")
EVALUATIONS = OF_LANE("of the motion")
RUNNING = OF_LANE("1 while the lane holds a sample")
FRESH = OF_LANE("1 while the accelerations at the start of the step are not known")
REJECTED = OF_LANE("1 after a rejection: the next step must not grow")
SPECIAL = OF_LANE("1 when this step needs a look by the scalar code")
ENDING = OF_LANE("1 when this step ends the revolution")
STIFF = OF_LANE("1 while the implicit method runs this lane")
EDGE_EXCESS = OF_LANE("positive where the step is at the edge of stability")
EDGE_SCORE = OF_LANE("of explicit steps at the edge of stability")
REJECTION_SCORE = OF_LANE("of rejected explicit steps")
STIFF_STEPS_HERE = OF_LANE("implicit steps tried since it took the lane over")
STIFF_STEPS = OF_LANE("implicit steps tried for this sample")
CALM = OF_LANE("implicit steps in a row that the explicit method could have taken")
STRICTER = OF_LANE("squared: how many times tighter than the run's explicit tolerances are")
STRICTER_WITHIN = OF_LANE("that within the range of stability")
STRICTER_AT_EDGE = OF_LANE("and at the edge of it")
CURVES = OF_LANE("values of tabulated curves at the stage", size=MAX_CURVES)
NEXT_ROW = OF_LANE("of a table above its place, where a step ends; 0: not known", size=MAX_CURVES)
LAST_ROW = OF_LANE("and below it", size=MAX_CURVES)
RESUMED = OF_LANE("step proposed before it was shortened to end at such a row, or 0", "s")
ACTIVE = OF_LANE("contact whose impact speed is kept (1), or flight (0)", "", EACH)
INVERSE_IMPACT = OF_LANE("1 / d'_0", "s/m", EACH)
PEAK = OF_LANE("largest contact force", "N", EACH)
DEEPEST = OF_LANE("largest penetration", "m", EACH)
ENDED = OF_LANE("contacts ended in this revolution", "", EACH)
LARGEST_RATE = OF_LANE("of the objective's", "", EACH)
TOUCHES = OF_LANE("whether the last step ended in contact; below 0 at the start", "", EACH)
WORK = OF_LANE.end

BANK = WORK + PARAMETERS
"""Rows of what a motion reads and writes: those of `work`, then the parameters."""

STAGES = BANK
"""First row of the explicit method's stage accelerations, behind them: row STAGES + s MAX_COORDINATES + k."""

# ---- bookkeeping of a lane, touched at the end of a revolution ---------------------------------
OF_BOOK = RowNumbers()
SAMPLE = OF_BOOK("slot of the sample in the queue")
REVOLUTION = OF_BOOK("revolutions finished")
TIME_SUM = OF_BOOK("over the averaged revolutions", "s")
MEAN_F = OF_BOOK("Welford mean of the revolution's objective")
M2_F = OF_BOOK("sum of squares about it")
COUNT_F = OF_BOOK("how many")
ELAPSED = OF_BOOK("whole revolutions so far", "s")
LATCHED = OF_BOOK("whole revolutions in contact", "", EACH)
AVERAGED = OF_BOOK("integrals of INTEGRATED over the averaged revolutions", size=len(INTEGRATED))
TOTAL = OF_BOOK("and over all revolutions", size=len(INTEGRATED))
BOOK = OF_BOOK.end


@dataclass(frozen=True)
class Joint:
    """Where the motion finds and leaves the numbers of one joint with clearance; steppers count from its place."""

    place: int

    block = property(lambda self: JOINT_BLOCKS + JOINT_ROWS * self.place)  # of parameters
    further = property(lambda self: FURTHER + FURTHER_ROWS * self.place)
    gap = property(lambda self: GAP + self.place)  # rates
    force = property(lambda self: FORCE + self.place)
    rate = property(lambda self: GAP_RATE + self.place)
    friction = property(lambda self: FRICTIONS + self.place)
    sliding_speed = property(lambda self: SLIDING_SPEEDS + self.place)
    normal_x = property(lambda self: NORMALS_X + self.place)
    normal_y = property(lambda self: NORMALS_Y + self.place)
    active = property(lambda self: ACTIVE + self.place)  # rows of `work`
    inverse_impact = property(lambda self: INVERSE_IMPACT + self.place)


JOINTS = tuple(map(Joint, _PLACES))

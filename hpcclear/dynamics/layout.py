"""Where everything stands in the kernel's flat buffers: row k of lane i is ``buffer[k * W + i]``.

Rows are module constants, so the compiler sees every distance between two rows and can vectorise over
the lanes without run-time checks. Rows of effects that are off are never touched.
"""

from typing import Any, NamedTuple

import numpy as np

from hpcclear.base.outcome import MAX_JOINTS, WAVE_ROWS

TURN = 6.283185307179586  # rad

MAX_COORDINATES = 24


class Effects(NamedTuple):
    """What is on (1) and what is off (None): None prunes the branch before it is compiled."""

    joints: Any = None  # how many have clearance
    first: Any = 0  # place of the first of them; the others follow
    contact: Any = None  # the normal force's law and friction's, as `laws.lanes.InLanes`
    friction: Any = None
    torque: Any = None  # the body that gives the period is free, driven by a torque
    baumgarte: Any = None  # Cartesian coordinates with multipliers instead of minimal ones
    ledger: Any = None  # energies
    series: Any = None  # friction forces and crank moment, for time series
    responses: Any = None  # mean contact forces, drive moment, followed acceleration of each sample
    sliding: Any = None  # kinks of the laws, for the implicit method
    swinging: Any = None  # the drive that gives the period does not turn round
    wear: Any = None  # sliding work of the joints with clearance
    waves: Any = (
        None  # surfaces that are out of round; how many waves around bearing and journal have:
    )
    bearing_waves: Any = None
    journal_waves: Any = None
    threshold: Any = None  # of the pressure, below which nothing wears
    profile: Any = None  # where around these the sliding work is done
    film: Any = None  # oil in joints with clearance
    short_film: Any = None
    long_film: Any = None
    finite_film: Any = None
    objective: Any = None  # the rate that the study's objective is made of, as `laws.lanes.InLanes`

    @property
    def latched(self) -> Any:
        """Whether the normal force's law asks for the impact speed, which is latched."""
        return None if self.contact is None else self.contact.latched

    @property
    def bristled(self) -> Any:
        """Whether friction has bristles, a coordinate for each joint with clearance."""
        return None if self.friction is None else self.friction.bristled


class Open(NamedTuple):
    """Which places of joints hold one with clearance (1), and which none (None)."""

    joint_0: Any = None
    joint_1: Any = None
    joint_2: Any = None
    joint_3: Any = None
    joint_4: Any = None
    joint_5: Any = None
    joint_6: Any = None
    joint_7: Any = None


def bristles_of(effects: Effects) -> int:
    """How many coordinates the bristles of friction take: one for each joint with clearance, before those of the mechanism.

    A bristle's deflection is the velocity of its coordinate, so that steppers need no other kind of state.
    """
    return 0 if effects.bristled is None else sum(flag is not None for flag in open_of(effects))


def open_of(effects: Effects) -> Open:
    """Those of a set of effects."""
    return Open(*[None] * effects.first, *[1] * (effects.joints or 0))


class Waves(NamedTuple):
    """Where the waves around both surfaces of a joint stand among `WAVE_ROWS`: cosine and sine of one, of two and so on."""

    bearing: int  # first row
    bearing_count: int
    journal: int
    journal_count: int

    def rows(self) -> range:
        """All of them."""
        return range(self.bearing, self.journal + 2 * self.journal_count)


def waves_of(effects: Effects) -> tuple[Waves, ...]:
    """Those of each place of joints, up to the last open one."""
    bearing, journal = effects.bearing_waves or 0, effects.journal_waves or 0
    stride = 2 * (bearing + journal)
    places = [k for k, flag in enumerate(open_of(effects)) if flag is not None]
    return tuple(
        Waves(k * stride, bearing, k * stride + 2 * bearing, journal)
        for k in range(max(places, default=-1) + 1)
    )


# ---- parameters of one sample -------------------------------------------------------------------
(
    SPEED,  # rad/s, of the drive: a turn over its share of the period
    DRIVEN_LENGTH,  # m, largest distance between points of the body that gives the period
    PERIOD,  # s, one revolution at the prescribed speed
    FIRST_STEP,  # s
    STRICTNESS,  # squared: how many times tighter this sample's tolerances are than the run's
    EDGE,  # one over the relative tolerance that explicit steps need at the edge of stability
    TURN_END,  # rad, angle of the free body that gives the period at which its revolution ends: its start and all its turns
    HELD_MOMENT,  # N m, of a sample without anything to integrate: largest moment of the drive,
    HELD_DEVIATION,  # m/s^2, deviation of the followed acceleration
    HELD_PEAK,  # m/s^2, and its largest size
) = range(10)
JOINT_ROWS = 30
LAW_NUMBERS = 8
"""Rows of a joint for the numbers of its law of contact, and as many for friction's: which is which, the law says."""
JOINT_BLOCKS = 10  # of all joints, one behind the other
# within a joint's block
(
    CLEARANCE,
    BEARING_RADIUS,
    JOURNAL_RADIUS,
    EXPONENT,  # of the depth in the normal force, and the factor of its rate: what peaks between steps are found by
    DAMPING,
    DEEPEST_VALID,  # m, from where on a result is flagged
    INVERSE_RAMP,  # s/m, one over the sliding speed within which friction changes most
    STEEPNESS,  # s/m, largest slope of friction over normal force
) = range(8)
CONTACT_NUMBERS = 8
FRICTION_NUMBERS = CONTACT_NUMBERS + LAW_NUMBERS
(
    FILM_SHORT,  # mu R L^3/c^3, N s/m; 0 where there is no such film
    FILM_FINITE,  # as of a short one
    FILM_LONG,  # 12 mu L R^3/c^3, N s/m
    FILM_SHEAR,  # 2 pi mu L R^3/c, N m s
    FILM_FLOOR,  # least thickness over the clearance
    FILM_STEEPNESS,  # s/m, of the film's force over that of inertia; with bristles next to nothing, but not nothing
) = range(FRICTION_NUMBERS + LAW_NUMBERS, JOINT_ROWS)
OWN = JOINT_BLOCKS + MAX_JOINTS * JOINT_ROWS
"""First row of what a linkage has of its own."""
WAVES = OWN + 192
"""First row of the waves of surfaces that are out of round, in scenes that have such: those of `waves_of`, and for each number
of them another, its slope's."""
THRESHOLDS = WAVES + 2 * WAVE_ROWS
"""First row of what share of the normal force wears, two a joint: (slope) F_N + (offset), between 0 and 1."""
FINITE = THRESHOLDS + 2 * MAX_JOINTS
"""First row of what films of finite length have besides, joint by joint, in scenes that have such a film."""
FINITE_ROWS = 180
PARAMETERS = FINITE + MAX_JOINTS * FINITE_ROWS

# ---- what the motion writes besides accelerations ---------------------------------------------
# of each joint: its gap, its normal force and the rate of its gap, rows of all joints side by side like all that joints have:
# so the compiler knows the distances between one joint's rows, whichever it is
GAP = 0
FORCE = GAP + MAX_JOINTS
GAP_RATE = FORCE + MAX_JOINTS
(DRIVE_POWER, ABS_DRIVE_POWER, DISSIPATION, LOAD_POWER) = range(3 * MAX_JOINTS, 3 * MAX_JOINTS + 4)
FRICTIONS = LOAD_POWER + 1  # of each joint, for time series
DRIVE_MOMENT = FRICTIONS + MAX_JOINTS  # for time series and for responses
FOLLOWED_ACCELERATION = DRIVE_MOMENT + 1  # of a guided body, or of a point along x; responses only
FOLLOWED_SQUARE = FOLLOWED_ACCELERATION + 1
FOLLOWED_ACROSS = FOLLOWED_SQUARE + 1  # of a point along y
SLIDING_POWERS = FOLLOWED_ACROSS + 1  # of each joint, F_N |v_t|; for wear only
OBJECTIVE_RATES = SLIDING_POWERS + MAX_JOINTS  # of each joint, or the first of the whole mechanism
SLIDING_SPEEDS = (
    OBJECTIVE_RATES + MAX_JOINTS
)  # of each joint; these and normals for the objective's rate only
NORMALS_X = SLIDING_SPEEDS + MAX_JOINTS
NORMALS_Y = NORMALS_X + MAX_JOINTS
FORCE_KINKS = NORMALS_Y + MAX_JOINTS
"""Of each joint, for the implicit method only: functions whose signs change where the normal force is cut at 0, and at both
sides of friction's ramp."""
LOW_KINKS = FORCE_KINKS + MAX_JOINTS
HIGH_KINKS = LOW_KINKS + MAX_JOINTS
ANGLES = HIGH_KINKS + MAX_JOINTS
"""Of each joint cosine and sine of the contact's angle in the bearing, then in the journal; these and what follows are for
profiles of wear only, and stand last, so that others need not pass over them."""
PROFILES = (
    ANGLES + 4 * MAX_JOINTS
)  # sliding powers times waves of these angles, in the order of `waves_of`
RATES = PROFILES + WAVE_ROWS


class Integrated(NamedTuple):
    """A rate that every stepper integrates over a step: its row, and the effect that asks for it. A gap's absolute value is
    integrated, and the error of its integral, relative to the clearance times a revolution, counts for the step's."""

    rate: int
    asked_by: str


_PLACES = range(MAX_JOINTS)
GAPS = tuple(Integrated(GAP + k, f"joint_{k}") for k in _PLACES)
_FORCES = tuple(Integrated(FORCE + k, "responses") for k in _PLACES)
_SLIDING = tuple(Integrated(SLIDING_POWERS + k, "wear") for k in _PLACES)
_OBJECTIVES = tuple(Integrated(OBJECTIVE_RATES + k, "objective") for k in _PLACES)
_PROFILES = tuple(Integrated(PROFILES + k, "profile") for k in range(WAVE_ROWS))
MEASURES = (
    Integrated(DRIVE_POWER, "ledger"),
    Integrated(ABS_DRIVE_POWER, "ledger"),
    Integrated(DISSIPATION, "ledger"),
    Integrated(LOAD_POWER, "ledger"),
    *_FORCES,
    Integrated(FOLLOWED_ACCELERATION, "responses"),
    Integrated(FOLLOWED_SQUARE, "responses"),
    Integrated(FOLLOWED_ACROSS, "responses"),
    *_SLIDING,
    *_OBJECTIVES,
)
INTEGRATED = (*GAPS, *MEASURES, *_PROFILES)
"""All that is integrated; profiles of wear at the ends of steps (`stepping.profile`).
The explicit and implicit steppers, the books of a lane and its outcome read this."""

INTEGRATED_RATES = np.array([one.rate for one in INTEGRATED])


def _mask(largest: int) -> int:
    """All bits that numbers up to `largest` have: taken with it a number is not below 0, and no other number."""
    return (1 << largest.bit_length()) - 1


JOINT_MASK = _mask(MAX_JOINTS - 1)
COORDINATE_MASK = _mask(MAX_COORDINATES - 1)
MEASURE_MASK = _mask(max(one.rate for one in MEASURES))


def measures_of(effects: Effects) -> np.ndarray:
    """Rates besides the gaps that are integrated with these effects."""
    places = open_of(effects)
    whole = effects.objective is not None and effects.objective.whole
    closed = {
        one.rate
        for of_joints, there in (
            (_FORCES, places),
            (_SLIDING, places),
            (_OBJECTIVES, Open(1) if whole else places),
        )
        for one, flag in zip(of_joints, there, strict=True)
        if flag is None
    }
    asked = [one for one in MEASURES if getattr(effects, one.asked_by) is not None]
    return np.array([one.rate for one in asked if one.rate not in closed], np.int64)


def place(rate: int) -> int:
    """Where a rate stands in `INTEGRATED`."""
    return [one.rate for one in INTEGRATED].index(rate)


WORKS = place(DRIVE_POWER)  # the first of four: drive, its absolute value, losses, load

# ---- lane state and scratch ---------------------------------------------------------------------
Q = 0  # coordinates at the start of the step
V = Q + MAX_COORDINATES
QS = V + MAX_COORDINATES  # coordinates of the stage
VS = QS + MAX_COORDINATES
ACC = VS + MAX_COORDINATES  # accelerations of the stage
RATE_NOW = ACC + MAX_COORDINATES  # rates of the stage
RATE_OLD = RATE_NOW + RATES  # rates at the start of the step
RATE_SUM = RATE_OLD + RATES  # weighted by the method: h * sum is the integral over the step
RATE_ERROR = RATE_SUM + RATES  # weighted by the difference of the pair
INTEGRAL = RATE_ERROR + RATES  # since the start of the revolution (gaps: of their absolute values)
(
    TIME,  # s, since the start of this revolution
    STEP,  # s, the step being tried
    NEXT_STEP,  # s, what the controller asks for
    STAGE_TIME,
    ERROR,  # mean square of the scaled error
    LOG_ERROR,  # log2 of the last accepted one
    ACCEPT,  # 1 or 0
    PEAK_MOMENT,  # of the drive, its size
    PEAK_FOLLOWED,  # of the square of the followed acceleration
    AVERAGING,  # 1 once the transient is over
    ATTEMPTS,  # steps tried, accepted or not
    EVALUATIONS,
    RUNNING,  # 1 while the lane holds a sample
    FRESH,  # 1 while the accelerations at the start of the step are not known
    REJECTED,  # 1 after a rejection: the next step must not grow
    SPECIAL,  # 1 when this step needs a look by the scalar code
    ENDING,  # 1 when this step ends the revolution
    STIFF,  # 1 while the implicit method runs this lane
    EDGE_EXCESS,  # positive where the step is at the edge of stability
    EDGE_SCORE,  # of explicit steps at the edge of stability
    REJECTION_SCORE,  # of rejected explicit steps
    STIFF_STEPS_HERE,  # implicit steps tried since it took the lane over
    STIFF_STEPS,  # implicit steps tried for this sample
    CALM,  # implicit steps in a row that the explicit method could have taken
    STRICTER,  # squared: how many times tighter than the run's the tolerances of this lane's explicit steps are
    STRICTER_WITHIN,  # that within the range of stability
    STRICTER_AT_EDGE,  # and at the edge of it
) = range(INTEGRAL + RATES, INTEGRAL + RATES + 27)
MAX_CURVES = 8
CURVES = STRICTER_AT_EDGE + 1  # values of tabulated curves at the stage
# of each joint
ACTIVE = CURVES + MAX_CURVES  # contact latched (1) or flight (0)
INVERSE_IMPACT = ACTIVE + MAX_JOINTS  # 1 / d'_0
PEAK = INVERSE_IMPACT + MAX_JOINTS
DEEPEST = PEAK + MAX_JOINTS  # largest penetration
ENDED = DEEPEST + MAX_JOINTS  # contacts ended in this revolution
LARGEST_RATE = ENDED + MAX_JOINTS  # of the objective's
WORK = LARGEST_RATE + MAX_JOINTS

BANK = WORK + PARAMETERS
"""Rows of what a motion reads and writes: those of `work`, then the parameters."""

STAGES = BANK
"""First row of the explicit method's stage accelerations, behind them: row STAGES + s MAX_COORDINATES + k."""

# ---- tabulated curves, one behind the other -----------------------------------------------------
CELLS = 2048  # cubic cells over one turn, 4 coefficients each
TABLES = 4 * MAX_CURVES * CELLS  # at most

# ---- bookkeeping of a lane, touched at the end of a revolution ---------------------------------
(
    SAMPLE,  # slot of the sample in the queue
    REVOLUTION,  # revolutions finished
    TIME_SUM,  # s, over the averaged revolutions
    MEAN_F,  # Welford mean of the revolution's objective
    M2_F,
    COUNT_F,
    ELAPSED,  # s, whole revolutions so far
) = range(7)
LATCHED = 7  # of each joint
AVERAGED = (
    LATCHED + MAX_JOINTS
)  # integrals over the averaged revolutions, in the order of INTEGRATED
TOTAL = AVERAGED + len(INTEGRATED)  # integrals over all revolutions, likewise
BOOK = TOTAL + len(INTEGRATED)

# ---- one finished sample --------------------------------------------------------------------------
(
    OUT_STATUS,
    OUT_OBJECTIVE,
    OUT_SPREAD,
    OUT_EVALUATIONS,
    OUT_REVOLUTIONS,
    OUT_TIME,
    OUT_ATTEMPTS,
    OUT_STIFF_STEPS,
    OUT_MOMENT,
    OUT_ACCELERATION,
    OUT_FOLLOWED,
) = range(11)
# of each joint
OUT_PEAK = 11
OUT_LATCHED = OUT_PEAK + MAX_JOINTS
OUT_DEEPEST = OUT_LATCHED + MAX_JOINTS
OUT_ACTIVE = OUT_DEEPEST + MAX_JOINTS
OUT_INVERSE_IMPACT = OUT_ACTIVE + MAX_JOINTS
OUT_LARGEST_RATE = OUT_INVERSE_IMPACT + MAX_JOINTS
OUT_MEAN = (
    OUT_LARGEST_RATE + MAX_JOINTS
)  # time means over the averaged revolutions, in the order of INTEGRATED
OUT_TOTAL = OUT_MEAN + len(INTEGRATED)  # integrals over all revolutions, likewise
OUT_STATE = OUT_TOTAL + len(INTEGRATED)
OUT = OUT_STATE + 2 * MAX_COORDINATES

# ---- one sample to come ---------------------------------------------------------------------------
START_CONTACTS = 2 * MAX_COORDINATES  # after coordinates and velocities: active flags, then 1/d'_0
START = START_CONTACTS + 2 * MAX_JOINTS


# ---- what the steppers hand on as one -------------------------------------------------------------
class Joint(NamedTuple):
    """Where the motion finds and leaves the numbers of one joint with clearance; steppers count from its place."""

    place: int
    block: int  # of parameters
    finite: int
    gap: int  # rates
    force: int
    rate: int
    friction: int
    force_kink: int
    low_kink: int
    high_kink: int
    sliding_power: int
    objective_rate: int
    sliding_speed: int
    normal_x: int
    normal_y: int
    active: int  # rows of `work`
    inverse_impact: int


JOINTS = tuple(
    Joint(
        k, JOINT_BLOCKS + JOINT_ROWS * k, FINITE + FINITE_ROWS * k, GAP + k, FORCE + k, GAP_RATE + k, FRICTIONS + k,
        FORCE_KINKS + k, LOW_KINKS + k, HIGH_KINKS + k, SLIDING_POWERS + k,
        OBJECTIVE_RATES + k, SLIDING_SPEEDS + k, NORMALS_X + k, NORMALS_Y + k,
        ACTIVE + k, INVERSE_IMPACT + k,
    )
    for k in _PLACES
)  # fmt: skip


class Block(NamedTuple):
    """The lanes of a stepper, flat: state and scratch, stage accelerations, parameters, books.

    `work`, `par` and `stages` are neighbours in memory, in this order, at distances that the compiler knows."""

    work: Any
    stages: Any
    par: Any
    book: Any


class Queue(NamedTuple):
    """Samples to come and samples done: parameters, starts, outcomes, slots in the order they finished, counters."""

    par: Any
    start: Any
    out: Any
    finished: Any
    counters: Any


class Method(NamedTuple):
    """What a run is integrated with: its settings, the packed tableau, tabulated curves, what is measured, and the numbers by
    which a stepper asks for what is compiled apart from it (`stepping.special`)."""

    settings: Any
    weights: Any
    tables: Any  # (TABLES,)
    measures: Any  # as `measures_of`
    numbers: Any


class Rules(NamedTuple):
    """What a stepper has to know of the effects, as numbers 0 and 1: none of them has it compiled anew."""

    latched: Any  # impacts are located, and their speed is kept
    free: Any  # a torque drives the crank: its angle is the last coordinate, and its turn ends a revolution
    turning: Any  # its angle is a coordinate, whoever drives it
    responses: Any
    profile: Any  # where around joints sliding work is done is told
    largest: Any  # the objective is made of the largest value of its rate
    begin: Any  # places of open joints, from `begin` on
    end: Any  # and before `end`


def rules_of(effects: Effects) -> Rules:
    """Those of a set of effects."""
    e = effects
    turning = e.torque or (None if e.swinging else e.baumgarte)
    largest = None if e.objective is None else e.objective.largest
    flags = (e.latched, e.torque, turning, e.responses, e.profile, largest)
    places = [k for k, flag in enumerate(open_of(e)) if flag is not None] or [0, -1]
    return Rules(*[int(flag is not None) for flag in flags] + [places[0], places[-1] + 1])


class Stepped(NamedTuple):
    """What the functions of a stepper read: rules and measures."""

    rules: Rules
    measures: Any

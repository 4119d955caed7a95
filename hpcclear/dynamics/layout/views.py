"""The kernel's rows of numbers by name: starts, outcomes, settings, parameters, rates; elsewhere nobody counts columns.

A view holds rows, shape (..., columns), and reads and writes what it names in place: ``outcome.objective`` has shape (...),
``outcome.mean_gap`` shape (..., MAX_JOINTS); places without a joint hold 0.
"""

from typing import Any, Self, overload

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.numbered import RowNumbers
from hpcclear.base.outcome import Status
from hpcclear.dynamics import layout as at

EACH = at.MAX_JOINTS


class Column:
    """`size` columns of a view's rows, every `step`-th; of the class itself the number of the first, as the kernel has it."""

    def __init__(self, first: int, size: int = 1, step: int = 1) -> None:
        self.first, self.size = first, size
        self.column = first if size == 1 else slice(first, first + step * size, step)

    @overload
    def __get__(self, view: None, owner: type) -> int: ...

    @overload
    def __get__(self, view: "View", owner: type) -> Array: ...

    def __get__(self, view: "View | None", owner: type) -> int | Array:
        if view is None:
            return self.first
        return view.rows[..., self.column]

    def __set__(self, view: "View", values: Array | float) -> None:
        view.rows[..., self.column] = values


class Declared(RowNumbers):
    """Columns numbered one behind the other as they are declared."""

    def column(self, words: str, unit: str = "", size: int = 1) -> Column:
        """The next ones."""
        return Column(self(words, unit, size), size)


def _entry(entry: int) -> Column:
    return Column(at.JOINT_BLOCKS + entry, EACH, at.JOINT_ROWS)


class View:
    """Rows of numbers, shape (..., `size`). Raises ValueError if the rows have another length."""

    size: int
    most = 0  # length of a row where it may be longer

    def __init__(self, rows: Array) -> None:
        if not self.size <= rows.shape[-1] <= max(self.size, self.most):
            name = type(self).__name__
            raise ValueError(f"a row of {name} holds {self.size} numbers, not {rows.shape[-1]}")
        self.rows = rows

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, which: Any) -> Self:
        """Some of the rows."""
        return type(self)(self.rows[which])


class Moving(View):
    """Rows with states in them: coordinates, then velocities, of those that the topology has; all places of either."""

    moving: Column

    def coordinates(self, n: int) -> Array:
        """The n coordinates of a topology, shape (..., n)."""
        return self.moving[..., :n]

    def velocities(self, n: int) -> Array:
        """Their velocities, shape (..., n)."""
        return self.moving[..., at.MAX_COORDINATES : at.MAX_COORDINATES + n]


class Start(Moving):
    """Starts of samples: states, and those of contacts."""

    _rows = Declared()
    moving = _rows.column("coordinates, then velocities, all places", "", 2 * at.MAX_COORDINATES)
    contacts = Column(_rows.end, 2 * EACH)
    active = _rows.column("contact whose impact speed is kept (1), or flight (0)", "", EACH)
    inverse_impact = _rows.column("1 / d'_0 there", "s/m", EACH)
    size = _rows.end

    @classmethod
    def at_rest(cls, samples: int) -> "Start":
        """Starts that are all zero."""
        return cls(np.zeros((samples, cls.size)))

    def fail(self, statuses: Array) -> None:
        """Let samples (m,) with another status than OK fail at the start, without a step."""
        self.moving[np.asarray(statuses) == Status.CANNOT_TURN] = np.nan
        self.moving[np.asarray(statuses) == Status.NEAR_SINGULAR] = np.inf

    @property
    def failed(self) -> Array:
        """Statuses (...) of samples that fail at the start, OK of the others."""
        turns = np.where(np.isinf(self.moving).any(axis=-1), Status.NEAR_SINGULAR, Status.OK)
        return np.where(np.isnan(self.moving).any(axis=-1), Status.CANNOT_TURN, turns)

    def state(self, n: int) -> Array:
        """Coordinates, then velocities, shape (..., 2 n); a copy."""
        return np.concatenate([self.coordinates(n), self.velocities(n)], axis=-1)


class Outcome(Moving):
    """Outcomes of samples; numbers of a failed one are what it had got to, or NaN.

    Means are over the averaged revolutions, totals over all of them; those of rates that no effect requested are 0.
    """

    _rows = Declared()
    status = _rows.column("how it ended")
    objective = _rows.column("f of eq. 13", "m")
    spread = _rows.column("standard deviation of f between averaged revolutions", "m")
    evaluations = _rows.column("of the motion")
    revolutions = _rows.column("all that were simulated")
    time = _rows.column("of these", "s")
    attempts = _rows.column("steps tried")
    stiff_steps = _rows.column("implicit steps tried")
    peak_moment = _rows.column("largest size of the drive's moment", "N m")
    acceleration_deviation = _rows.column("standard deviation of what is followed", "m/s^2")
    peak_acceleration = _rows.column("its largest size", "m/s^2")
    period = _rows.column("mean length of an averaged revolution", "s")
    cycle = _rows.column("angle of the drive in a revolution", "rad")
    peak_force = _rows.column("largest contact force", "N", EACH)
    latched = _rows.column("whole revolutions in contact", "", EACH)
    deepest = _rows.column("largest penetration", "m", EACH)
    contacts = Column(_rows.end, 2 * EACH)  # as of a start
    active = _rows.column("contact whose impact speed is kept, at the end", "", EACH)
    inverse_impact = _rows.column("1 / d'_0 there", "s/m", EACH)
    largest_rate = _rows.column("of the objective's", "", EACH)
    # in the order of INTEGRATED
    mean = _rows.column("time means over the averaged revolutions", "", len(at.INTEGRATED))
    total = _rows.column("integrals over all revolutions", "", len(at.INTEGRATED))
    moving = _rows.column("at the end, as of a start", "", 2 * at.MAX_COORDINATES)
    size = _rows.end

    mean_gap = Column(mean.first, EACH)  # m
    mean_force = Column(mean.first + at.place(at.FORCE), EACH)  # N
    impact_power = Column(mean.first + at.place(at.IMPACT_POWERS), EACH)  # W
    square_force = Column(mean.first + at.place(at.FORCE_SQUARES), EACH)  # N^2, mean square
    flight = Column(mean.first + at.place(at.FLIGHTS), EACH)  # share of the time without contact
    begun = Column(mean.first + at.place(at.BEGUN), EACH)  # 1/s, contacts that begin
    frame_force = Column(mean.first + at.place(at.FRAME_X), 2)  # N, along x and y
    square_frame_force = Column(mean.first + at.place(at.FRAME_SQUARE))  # N^2
    sliding_power = Column(mean.first + at.place(at.SLIDING_POWERS), EACH)  # W, mean of F_N |v_t|
    mean_rate = Column(mean.first + at.place(at.OBJECTIVE_RATES), EACH)  # of the objective
    profile = Column(mean.first + at.place(at.PROFILES), at.WAVE_ROWS)
    """W, means of F_N |v_t| times waves of the contact's angle, as of `layout.wave_rows`; NaN of those that are not there"""
    sliding_work = Column(total.first + at.place(at.SLIDING_POWERS), EACH)  # J
    drive_work = Column(total.first + at.WORKS)  # J; with its size, losses and load work: four
    absolute_drive_work = Column(drive_work.first + 1)
    dissipated = Column(drive_work.first + 2)
    load_work = Column(drive_work.first + 3)

    @property
    def revolution(self) -> Array:
        """How long one of all revolutions lasts, s, (m,)."""
        return self.time / self.revolutions

    def in_revolution(self, name: str) -> Array:
        """Integral of a rate, by the name of its mean, over an averaged revolution."""
        mean: Array = getattr(self, name)
        return mean * self.period[:, None]

    def end(self) -> Start:
        """Where the samples ended, to go on from; places that no coordinate has are 0."""
        start = Start(np.empty((*self.rows.shape[:-1], Start.size)))
        start.moving = np.nan_to_num(self.moving)
        start.contacts = self.contacts
        return start


class RunSettings(View):
    """Numbers that steer a run, one row."""

    _rows = Declared()
    rtol = _rows.column("relative tolerance")
    gap_tolerance = _rows.column("an impact is located this well", "m")
    angle_tolerance = _rows.column("likewise, for the end of a revolution of a free crank", "rad")
    impact_floor = _rows.column("least latched impact speed", "m/s")
    transient = _rows.column("revolutions")
    averaged = _rows.column("revolutions")
    max_steps = _rows.column("of a sample")
    smallest_step = _rows.column("relative to the time")
    exponent = _rows.column("of the step-size control")
    beta = _rows.column("likewise, of the error before")
    implicit = _rows.column("0 never, 1 where the motion is stiff, 2 always")
    cycle = _rows.column("turn of the driven body in a revolution; negative clockwise", "rad")
    parameter_rows = _rows.column("how many parameters a sample has")
    profiled = _rows.column("how many rates of profiles of wear there are to integrate")
    at_rest = _rows.column("within which a crank that starts from rest may turn back", "rad")
    senses = _rows.column("1 where explicit steps look out for the edge of stability")
    chosen = _rows.column("of each joint: 1 where its gap counts for the objective", "", EACH)
    atol = _rows.column("absolute tolerance of lengths", "m")
    size = _rows.end


class Parameters(View):
    """Parameters of samples, SI; a linkage has rows of its own behind these."""

    size, most = at.OWN, at.PARAMETERS

    speed = Column(at.SPEED)
    period = Column(at.PERIOD)
    first_step = Column(at.FIRST_STEP)
    strictness = Column(at.STRICTNESS)  # squared: how many times tighter than the run's tolerances
    turn_end = Column(at.TURN_END)  # rad
    driven_length = Column(at.DRIVEN_LENGTH)
    wraps = Column(at.WRAPS, at.MAX_COORDINATES)  # rad; 0 where nothing goes round
    # of all joints, shape (..., MAX_JOINTS)
    clearance = _entry(at.CLEARANCE)
    damping = _entry(at.DAMPING)
    deepest_valid = _entry(at.DEEPEST_VALID)  # m
    bearing_radius = _entry(at.BEARING_RADIUS)
    journal_radius = _entry(at.JOURNAL_RADIUS)
    inverse_ramp = _entry(at.INVERSE_RAMP)
    steepness = _entry(at.STEEPNESS)  # s/m

    def tolerances(self, n: int) -> Array:
        """Absolute tolerances of n coordinates, then velocities, over that of lengths, shape (..., 2 n)."""
        return self.rows[..., at.tolerance_rows(n)]

    @property
    def contact_numbers(self) -> Array:
        """Numbers of the law of contact, shape (..., MAX_JOINTS, LAW_NUMBERS), in the order of its ``read``."""
        blocks = self.rows[..., at.JOINT_BLOCKS : at.OWN]
        blocks = blocks.reshape(*blocks.shape[:-1], at.MAX_JOINTS, at.JOINT_ROWS)
        return blocks[..., at.CONTACT_NUMBERS : at.CONTACT_NUMBERS + at.LAW_NUMBERS]


class Rates(View):
    """What the motion finds at an instant besides accelerations, shape (instants, RATES)."""

    size = at.RATES

    gap = Column(at.GAP, EACH)  # m
    force = Column(at.FORCE, EACH)  # N, normal
    friction = Column(at.FRICTIONS, EACH)  # N
    drive_moment = Column(at.DRIVE_MOMENT)  # N m
    followed_x = Column(at.FOLLOWED_ACCELERATION)  # m/s^2, of the followed point
    followed_y = Column(at.FOLLOWED_ACROSS)
    frame_x = Column(at.FRAME_X)  # N
    frame_y = Column(at.FRAME_Y)
    powers = Column(at.DRIVE_POWER, 4)  # W: drive, its size, losses, load

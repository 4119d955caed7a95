"""The kernel's rows of numbers by name: starts, outcomes, settings, parameters, rates; elsewhere nobody counts columns.

A view holds rows, shape (..., columns), and reads and writes what it names in place: ``outcome.objective`` has shape (...),
``outcome.mean_gap`` shape (..., MAX_JOINTS); places without a joint hold 0.
"""

from collections.abc import Sequence
from typing import Any, Self

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.outcome import Status
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout import settings


class Column:
    """One column of a view's rows, or several."""

    def __init__(self, column: int | Sequence[int] | slice) -> None:
        self.column = list(column) if isinstance(column, Sequence) else column

    def __get__(self, view: Any, owner: type) -> Array:
        values: Array = view.rows[..., self.column]
        return values

    def __set__(self, view: Any, values: Any) -> None:
        view.rows[..., self.column] = values


def _of_joints(first: int, step: int = 1) -> Column:
    return Column(slice(first, first + step * at.MAX_JOINTS, step))


def _mean(rate: int) -> Column:
    return Column(at.OUT_MEAN + at.place(rate))


def _entry(entry: int) -> Column:
    return _of_joints(at.JOINT_BLOCKS + entry, at.JOINT_ROWS)


def _total(rate: int) -> Column:
    return Column(at.OUT_TOTAL + at.place(rate))


class View:
    """Rows of numbers, shape (..., `size`).

    Raises
    ------
    ValueError
        If the rows have another length.
    """

    size: int

    def __init__(self, rows: Array) -> None:
        if not self.fits(rows.shape[-1]):
            name = type(self).__name__
            raise ValueError(f"a row of {name} holds {self.size} numbers, not {rows.shape[-1]}")
        self.rows = rows

    @classmethod
    def fits(cls, size: int) -> bool:
        """Whether a row may have that length."""
        return size == cls.size

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, which: Any) -> Self:
        """Some of the rows."""
        return type(self)(self.rows[which])


class Start(View):
    """Starts of samples: coordinates and velocities (of those the topology has), contact states."""

    size = at.START

    contacts = Column(slice(at.START_CONTACTS, at.START))  # active flags, then 1/d'_0
    active = _of_joints(at.START_CONTACTS)
    inverse_impact = _of_joints(at.START_CONTACTS + at.MAX_JOINTS)
    moving = Column(slice(0, at.START_CONTACTS))  # all places of coordinates and velocities

    @classmethod
    def at_rest(cls, samples: int) -> "Start":
        """Starts that are all zero."""
        return cls(np.zeros((samples, at.START)))

    def coordinates(self, n: int) -> Array:
        """The n coordinates of a topology, shape (..., n)."""
        return self.rows[..., :n]

    def velocities(self, n: int) -> Array:
        """Their velocities, shape (..., n)."""
        return self.rows[..., at.MAX_COORDINATES : at.MAX_COORDINATES + n]

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


class Outcome(View):
    """Outcomes of samples; numbers of a failed one are what it had got to, or NaN.

    Means are over the averaged revolutions, totals over all of them; those of rates that no effect requested are 0.
    """

    size = at.OUT

    status = Column(at.OUT_STATUS)
    objective = Column(at.OUT_OBJECTIVE)  # m
    spread = Column(at.OUT_SPREAD)  # m, between averaged revolutions
    period = Column(at.OUT_PERIOD)  # s, mean of the averaged revolutions
    cycle = Column(at.OUT_CYCLE)  # rad of a revolution
    mean_gap = _of_joints(at.OUT_MEAN)  # m
    peak_force = _of_joints(at.OUT_PEAK)  # N
    latched = _of_joints(at.OUT_LATCHED)
    deepest = _of_joints(at.OUT_DEEPEST)  # m
    evaluations = Column(at.OUT_EVALUATIONS)
    revolutions = Column(at.OUT_REVOLUTIONS)
    time = Column(at.OUT_TIME)  # s
    drive_work = _total(at.DRIVE_POWER)  # J
    absolute_drive_work = _total(at.ABS_DRIVE_POWER)
    dissipated = _total(at.DISSIPATION)
    load_work = _total(at.LOAD_POWER)
    active = _of_joints(at.OUT_ACTIVE)
    contacts = Column(slice(at.OUT_ACTIVE, at.OUT_INVERSE_IMPACT + at.MAX_JOINTS))  # as of a start
    attempts = Column(at.OUT_ATTEMPTS)
    stiff_steps = Column(at.OUT_STIFF_STEPS)
    mean_force = _of_joints(at.OUT_MEAN + at.place(at.FORCE))  # N
    impact_power = _of_joints(at.OUT_MEAN + at.place(at.IMPACT_POWERS))  # W
    square_force = _of_joints(at.OUT_MEAN + at.place(at.FORCE_SQUARES))  # N^2, mean square
    flight = _of_joints(at.OUT_MEAN + at.place(at.FLIGHTS))  # share of the time without contact
    begun = _of_joints(at.OUT_MEAN + at.place(at.BEGUN))  # 1/s, contacts that begin
    frame_force = Column([at.OUT_MEAN + at.place(row) for row in (at.FRAME_X, at.FRAME_Y)])  # N
    square_frame_force = _mean(at.FRAME_SQUARE)  # N^2
    sliding_power = _of_joints(at.OUT_MEAN + at.place(at.SLIDING_POWERS))  # W, mean of F_N |v_t|
    mean_rate = _of_joints(at.OUT_MEAN + at.place(at.OBJECTIVE_RATES))  # of the objective
    largest_rate = _of_joints(at.OUT_LARGEST_RATE)
    profile = Column(
        slice(at.OUT_MEAN + at.place(at.PROFILES), at.OUT_MEAN + len(at.INTEGRATED))
    )  # W, means of F_N |v_t| times waves of the contact's angle, as of `layout.waves_of`; NaN of those that are not there
    sliding_work = _of_joints(at.OUT_TOTAL + at.place(at.SLIDING_POWERS))  # J
    peak_moment = Column(at.OUT_MOMENT)  # N m
    acceleration_deviation = Column(
        at.OUT_ACCELERATION
    )  # m/s^2, of the slider or of the followed point
    peak_acceleration = Column(at.OUT_FOLLOWED)  # m/s^2, likewise
    moving = Column(slice(at.OUT_STATE, at.OUT))  # all places of coordinates and velocities

    def coordinates(self, n: int) -> Array:
        """The n coordinates of a topology at the end, shape (..., n)."""
        return self.rows[..., at.OUT_STATE : at.OUT_STATE + n]

    def velocities(self, n: int) -> Array:
        """Their velocities, shape (..., n)."""
        first = at.OUT_STATE + at.MAX_COORDINATES
        return self.rows[..., first : first + n]

    def end(self) -> Start:
        """Where the samples ended, to go on from; places that no coordinate has are 0."""
        start = Start(np.empty((*self.rows.shape[:-1], at.START)))
        start.moving = np.nan_to_num(self.moving)
        start.contacts = self.contacts
        return start


class RunSettings(View):
    """Numbers that steer a run, one row."""

    size = settings.SETTINGS

    rtol = Column(settings.RTOL)
    gap_tolerance = Column(settings.GAP_TOLERANCE)  # m
    angle_tolerance = Column(settings.ANGLE_TOLERANCE)  # rad
    impact_floor = Column(settings.IMPACT_FLOOR)  # m/s
    transient = Column(settings.TRANSIENT)  # revolutions
    averaged = Column(settings.AVERAGED)
    max_steps = Column(settings.MAX_STEPS)
    smallest_step = Column(settings.SMALLEST_STEP)
    exponent = Column(settings.EXPONENT)  # of the step-size control
    beta = Column(settings.BETA)
    implicit = Column(settings.IMPLICIT)
    cycle = Column(settings.CYCLE)  # rad
    parameter_rows = Column(settings.PARAMETER_ROWS)
    profiled = Column(settings.PROFILED)
    senses = Column(settings.SENSES)
    at_rest = Column(settings.AT_REST)  # rad
    chosen = _of_joints(settings.CHOSEN)
    atol = Column(slice(settings.ATOL, settings.WRAPS))  # all places
    atol_coordinates = Column(slice(settings.ATOL, settings.ATOL + at.MAX_COORDINATES))
    atol_velocities = Column(slice(settings.ATOL + at.MAX_COORDINATES, settings.WRAPS))
    wraps = Column(slice(settings.WRAPS, settings.SETTINGS))


class Parameters(View):
    """Parameters of samples, SI; a linkage has rows of its own behind these."""

    size = at.OWN

    @classmethod
    def fits(cls, size: int) -> bool:
        """Whether a row may have that length."""
        return cls.size <= size <= at.PARAMETERS

    speed = Column(at.SPEED)
    period = Column(at.PERIOD)
    first_step = Column(at.FIRST_STEP)
    strictness = Column(at.STRICTNESS)  # squared: how many times tighter than the run's tolerances
    turn_end = Column(at.TURN_END)  # rad
    driven_length = Column(at.DRIVEN_LENGTH)
    # of all joints, shape (..., MAX_JOINTS)
    clearance = _entry(at.CLEARANCE)
    damping = _entry(at.DAMPING)
    deepest_valid = _entry(at.DEEPEST_VALID)  # m
    bearing_radius = _entry(at.BEARING_RADIUS)
    journal_radius = _entry(at.JOURNAL_RADIUS)
    inverse_ramp = _entry(at.INVERSE_RAMP)
    steepness = _entry(at.STEEPNESS)  # s/m
    film_scale = _entry(at.FILM_SCALE)
    film_shear = _entry(at.FILM_SHEAR)
    film_floor = _entry(at.FILM_FLOOR)

    @property
    def contact_numbers(self) -> Array:
        """Numbers of the law of contact, shape (..., MAX_JOINTS, LAW_NUMBERS), in the order of its ``read``."""
        blocks = self.rows[..., at.JOINT_BLOCKS : at.OWN]
        blocks = blocks.reshape(*blocks.shape[:-1], at.MAX_JOINTS, at.JOINT_ROWS)
        found: Array = blocks[..., at.CONTACT_NUMBERS : at.CONTACT_NUMBERS + at.LAW_NUMBERS]
        return found


class Rates(View):
    """What the motion finds at an instant besides accelerations, shape (instants, RATES)."""

    size = at.RATES

    gap = _of_joints(at.GAP)  # m
    force = _of_joints(at.FORCE)  # N, normal
    friction = _of_joints(at.FRICTIONS)  # N
    drive_moment = Column(at.DRIVE_MOMENT)  # N m
    followed_x = Column(at.FOLLOWED_ACCELERATION)  # m/s^2, of the followed point
    followed_y = Column(at.FOLLOWED_ACROSS)
    frame_x = Column(at.FRAME_X)  # N
    frame_y = Column(at.FRAME_Y)
    powers = Column(slice(at.DRIVE_POWER, at.LOAD_POWER + 1))  # W: drive, its size, losses, load

"""What the steppers and what is compiled apart from them are given: lanes, queue, method, rules; counters and numbers."""

from typing import Any, NamedTuple

import numpy as np

from hpcclear.base.arrays import Array, Integers
from hpcclear.base.bits import carray
from hpcclear.base.jit import lane_function
from hpcclear.dynamics import layout as at


class Counter:
    """Places of the counters that all lanes share."""

    NEXT_SLOT, SLOTS, FINISHED, RECORDED, KEPT = range(5)
    COUNT = 5


class Asking:
    """Places of the numbers by which a stepper asks for what is compiled apart from it; the rules come last."""

    (ASKED, LANE, FOUND, WIDTH, COORDINATES, MEASURES, MOTION, MOTION_OF_EIGHT, OBSERVING, OBSERVING_EIGHT, PROFILE,
     RULES) = range(12)  # fmt: skip


class Block(NamedTuple):
    """The lanes of a stepper, flat: state and scratch, stage accelerations, parameters, sums.

    `work`, `par` and `stages` are neighbours in memory, in this order, at distances that the compiler knows."""

    work: Array
    stages: Array
    par: Array
    book: Any  # None where it is not needed


class Queue(NamedTuple):
    """Samples to come and samples done: parameters, starts, outcomes, slots in the order they finished, counters."""

    par: Array
    start: Array
    out: Array
    finished: Integers
    counters: Integers


class Method(NamedTuple):
    """What a run is integrated with: its settings, the packed tableau, tabulated curves, what is measured, and the numbers by
    which a stepper calls what is compiled apart from it (`stepping.special`)."""

    settings: Array
    weights: Array
    tables: Array  # as `layout.curves.packed`
    measures: Array  # as `measures_of`
    numbers: Integers


class Rules(NamedTuple):
    """What a stepper has to know of the effects, as numbers 0 and 1: they change no compiled code."""

    latched: int  # impacts are located, and their speed is kept
    free: int  # a torque drives the crank: its angle is the last coordinate, and its turn ends a revolution
    responses: int
    impacts: int  # contacts are counted
    profile: int  # where around joints sliding work is done is recorded
    largest: int  # the objective is made of the largest value of its rate
    begin: int  # places of open joints, from `begin` on
    end: int  # and before `end`
    curves: int  # tabulated ones, if steps end at rows of any


def rules_of(effects: at.Effects, curves: int = 0) -> Rules:
    """Those of a set of effects, and of so many tabulated curves at whose rows steps end."""
    e = effects
    largest = None if e.objective is None else e.objective.largest
    flags = (e.latched, e.torque, e.responses, e.impacts, e.profile, largest)
    places = at.places_of(e)
    return Rules(*[int(flag is not None) for flag in flags] + [places.start, places.stop, curves])


class Stepped(NamedTuple):
    """What the functions of a stepper read: rules and measures."""

    rules: Rules
    measures: Array


NUMBERS = Asking.RULES + len(Rules._fields)


def numbers_of(rules: Rules, width: int, n: int, measures: int) -> Integers:
    """Those of a stepper of `width` lanes, whose motions have no addresses yet."""
    numbers = np.zeros(NUMBERS, np.int64)
    numbers[[Asking.WIDTH, Asking.COORDINATES, Asking.MEASURES]] = width, n, measures
    numbers[Asking.RULES :] = rules
    return numbers


@lane_function
def block_at(W, work, stages, par, book):
    """W lanes at these addresses; `book` may be None."""
    return Block(
        carray(work, at.WORK * W), carray(stages, at.MAX_COORDINATES * W), carray(par, at.PARAMETERS * W),
        None if book is None else carray(book, at.BOOK * W),
    )  # fmt: skip


@lane_function
def rules_in(numbers):
    """The rules among such numbers."""
    r = Asking.RULES
    return Rules(
        numbers[r], numbers[r + 1], numbers[r + 2], numbers[r + 3], numbers[r + 4], numbers[r + 5],
        numbers[r + 6], numbers[r + 7], numbers[r + 8],
    )  # fmt: skip

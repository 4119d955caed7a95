"""Verdicts by confidence intervals: of a constraint on a design, of an effect against its tolerance, of a claim of a paper."""

from collections.abc import Sequence
from enum import IntEnum

import numpy as np

from hpcclear.base.arrays import Booleans


class Verdict(IntEnum):
    """Whether a statement holds; the codes of files, whose words stand with each variable."""

    HOLDS = 0
    FAILS = 1
    UNDECIDED = 2


def together(verdicts: Sequence[int]) -> Verdict:
    """The verdict that all of some statements hold: it fails where one fails, and is undecided where one is not decided."""
    found = set(verdicts)
    if Verdict.FAILS in found:
        return Verdict.FAILS
    return Verdict.HOLDS if found <= {Verdict.HOLDS} else Verdict.UNDECIDED


def best(verdicts: Sequence[Verdict]) -> tuple[Verdict, Booleans]:
    """The best verdict of some (n,), and which have it, (n,); without any `Verdict.HOLDS`."""
    order = (Verdict.HOLDS, Verdict.UNDECIDED, Verdict.FAILS)
    found = min(verdicts, key=order.index, default=Verdict.HOLDS)
    return found, np.array([one is found for one in verdicts], bool)

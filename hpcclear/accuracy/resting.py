"""Batches on fewer ranks than there are: the others rest. Light to import, for the rank boundary."""

import time
from collections.abc import Mapping
from typing import Any

import numpy as np

from hpcclear.base.arrays import Array, Integers, Records
from hpcclear.base.outcome import OUTCOME
from hpcclear.ensemble.simulate import MAKERS as WORK_MAKERS
from hpcclear.ensemble.simulate import make_evaluator
from hpcclear.ranks.schedule import Worker
from hpcclear.ranks.team import Maker, Ranks

SOME_RANKS = "points on some ranks"


class Resting:
    """A rank's worker that takes no samples, so that a batch runs on fewer ranks than there are."""

    lanes = 1
    pending = 1 << 40  # never hungry

    def submit(self, index: Integers, points: Array) -> None:
        """Nothing is ever submitted to it: no index, no points."""
        raise AssertionError("a resting rank was given samples")

    def advance(self, seconds: float) -> Records:
        """Rest; no records."""
        time.sleep(seconds)
        return np.zeros(0, OUTCOME)


def make_on_some(payload: Mapping[str, Any], ranks: Ranks) -> Worker:
    """The worker of a rank among the first ``payload["ranks"]``; the others rest."""
    evaluator = make_evaluator(payload, ranks)  # everywhere: one rank of each node compiles first
    return evaluator if ranks.rank < payload["ranks"] else Resting()


MAKERS: Mapping[str, Maker] = {**WORK_MAKERS, SOME_RANKS: make_on_some}
"""For `hpcclear.ranks.boundary.run_on_ranks`."""

"""Other last bits of f, as another processor, library or Python leaves them.

    TEST_LAST_BITS=3 python -m pytest tests/test_rare.py -k edge     f times 1 + `SIZE` u, u in -1 to 1 by the seed 3
    python tests/repeat_statistical.py --last-bits 5                 tests of chosen designs, five seeds each

u depends on f and the seed alone: a sample has the same f on every rank and in every run. Only tests read the variable.
"""

import os
from typing import Any

import numpy as np

NAME = "TEST_LAST_BITS"
SIZE = 1e-12
"""Largest relative change."""


def seed() -> int:
    """The seed of this run; 0: f is as it was computed."""
    return int(os.environ.get(NAME, "0"))


def disturbed(f: np.ndarray) -> np.ndarray:
    """Values of f with other last bits; those that failed (NaN) and 0 stay."""
    if not seed():
        return f
    kept = np.atleast_1d(np.asarray(f, np.float64))
    bits = kept.view(np.uint64) + np.uint64(seed() * 0x9E3779B97F4A7C15 % 2**64)
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):  # splitmix64
        bits = (bits ^ (bits >> np.uint64(shift))) * np.uint64(factor)
    u = (bits >> np.uint64(11)) * 2.0**-52 - 1.0
    return np.reshape(kept * (1.0 + SIZE * u), np.shape(f))


def disturb(set_attribute: Any = setattr) -> None:
    """Let the package's own simulations have other last bits, if this run has a seed; formulas of tests ask for it."""
    if not seed():
        return
    from hpcclear.dynamics import response
    from hpcclear.dynamics.evaluation import evaluator
    from hpcclear.dynamics.evaluation.steady import evaluator as steady

    original = evaluator.outcome_records

    def outcome_records(*arguments: Any, **options: Any) -> Any:
        records = original(*arguments, **options)
        records["objective"] = disturbed(records["objective"])
        return records

    for module in (evaluator, steady, response):
        set_attribute(module, "outcome_records", outcome_records)

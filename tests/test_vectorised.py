"""The lanes are vectors in the machine code, and the counter that says so can tell."""

import pytest
from assembly import (
    Arithmetic,
    executed_arithmetic,
    force_evaluation,
)
from scenes import LAWS, scene, single

from hpcclear.dynamics.evaluation.evaluator import DEFAULT_LANES


def arithmetic(law: str, width: int) -> Arithmetic:
    """Of the force evaluation, as the compiler emits it for this processor."""
    problem = single(scene(law, 1e-6, 1, 1)).problem
    return executed_arithmetic(force_evaluation(problem, width))


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.shortened(1)
def test_force_evaluation_is_packed(law):
    found = arithmetic(law, DEFAULT_LANES)
    assert found.packed.total() >= 100
    assert found.packed_share >= 0.9

"""The lanes are vectors in the machine code, and the counter that says so can tell."""

import sys
from pathlib import Path

import numba
import numpy as np
import pytest

from hpcclear.dynamics.evaluation.evaluator import DEFAULT_LANES

ANALYSIS = Path(__file__).parents[1] / "analysis"
sys.path.insert(0, str(ANALYSIS))

from assembly import (  # noqa: E402
    Arithmetic,
    count_arithmetic,
    executed_arithmetic,
    force_evaluation,
    innermost_loops,
)
from scenes import LAWS, scene, single  # noqa: E402


def arithmetic(law: str, width: int) -> Arithmetic:
    """Of the force evaluation, as the compiler emits it for this processor."""
    problem = single(scene(law, 1e-6, 1, 1)).problem
    return executed_arithmetic(force_evaluation(problem, width))


@pytest.mark.parametrize("law", LAWS)
def test_force_evaluation_is_packed(law):
    found = arithmetic(law, DEFAULT_LANES)
    assert found.packed.total() >= 100
    assert found.packed_share >= 0.9


def test_the_counter_tells_scalar_code():
    found = arithmetic("hunt-crossley", 1)
    assert found.scalar.total() >= 100
    assert found.packed_share < 0.5


def test_the_counter_on_a_loop_with_known_code():
    @numba.njit(error_model="numpy")
    def scale(x, y):
        for i in range(1024):
            y[i] = x[i] * 3.0 + 1.0

    @numba.njit(error_model="numpy")
    def chain(x, y):
        for i in range(1, 1024):
            y[i] = y[i - 1] * x[i] + 1.0  # each needs the one before

    shares = []
    for function in (scale, chain):
        function(np.zeros(1024), np.zeros(1024))
        shares.append(count_arithmetic(function.inspect_asm(function.signatures[0])))
    assert shares[0].packed.total() >= 2
    assert shares[1].scalar.total() >= 2
    assert shares[1].packed.total() == 0


LOOP = """
.LBB0_1:
\tvaddpd\t%zmm1, %zmm2, %zmm3
\tvmulpd\t%zmm1, %zmm2, %zmm3
\tjne\t.LBB0_1
\tretq
.LBB0_2:
\tvaddsd\t%xmm1, %xmm2, %xmm3
\tvmulsd\t%xmm1, %xmm2, %xmm3
\tjne\t.LBB0_2
"""


def test_only_an_exact_scalar_copy_of_a_vector_loop_is_left_out():
    assert len(innermost_loops(LOOP)) == 2
    found = executed_arithmetic(LOOP)
    assert (found.packed.total(), found.scalar.total(), found.fallback) == (2, 0, 2)
    more = executed_arithmetic(LOOP.replace("\tvmulsd", "\tvaddsd\t%xmm1, %xmm2, %xmm3\n\tvmulsd"))
    assert (more.scalar.total(), more.fallback) == (3, 0)
    alone = executed_arithmetic(LOOP[LOOP.index(".LBB0_2") :])
    assert (alone.packed.total(), alone.scalar.total()) == (0, 2)


@pytest.mark.parametrize(
    ("line", "packed", "scalar"),
    [
        ("\tvaddpd\t%zmm1, %zmm2, %zmm3", 1, 0),
        ("\tvfmadd213pd\t8(%rax){1to8}, %zmm2, %zmm3", 1, 0),
        ("\tvrndscalepd\t$9, %ymm1, %ymm2", 1, 0),
        ("\tsqrtsd\t%xmm0, %xmm0", 0, 1),
        ("\tvfnmadd231sd\t%xmm0, %xmm1, %xmm2", 0, 1),
        ("\tvmovupd\t%zmm1, (%rax)", 0, 0),
        ("\tvcvtsi2sd\t%rax, %xmm1, %xmm1", 0, 0),
        ("\tfmla\tv0.2d, v1.2d, v2.2d", 1, 0),
        ("\tfadd\td0, d1, d2", 0, 1),
    ],
)
def test_the_counter_on_single_instructions(line, packed, scalar):
    found = count_arithmetic(line)
    assert (found.packed.total(), found.scalar.total()) == (packed, scalar)

"""A stepper's arrays without their counts of references.

Every function that is not inlined counts each array it is given up and down with atomic instructions, which took a fifth of an
implicit step, and an eighth of a single response.
"""

from typing import Any

from hpcclear.base.bits import beyond, borrowed
from hpcclear.base.jit import lane_function
from hpcclear.dynamics import layout as at


@lane_function
def borrowed_all(block, queue, method, W):
    """The same arrays without their counts of references, which functions that are not inlined would keep; what stands behind
    `work` at distances from it."""
    lent: Any = borrowed
    work = lent(block.work)
    return (
        at.Block(work, beyond(work, at.STAGES * W), beyond(work, at.WORK * W), lent(block.book)),
        at.Queue(
            lent(queue.par), lent(queue.start), lent(queue.out),
            lent(queue.finished), lent(queue.counters),
        ),
        at.Method(
            lent(method.settings), lent(method.weights), lent(method.tables), lent(method.measures),
            lent(method.numbers),
        ),
    )  # fmt: skip

"""One thread for linear algebra: more are slower at the sizes of this package, and change last bits from machine to machine."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController


@cache
def _controller() -> "ThreadpoolController":
    """What sets threads of the BLAS of numpy and of scipy. To look for them takes 25 ms, as long as a fit of a search."""
    import scipy.linalg  # noqa: F401 (loads the one of scipy)
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


@contextmanager
def one_thread() -> Iterator[None]:
    """Let BLAS have one thread inside, or in the function that this decorates."""
    with _controller().limit(limits=1, user_api="blas"):
        yield

"""Where time goes."""

import contextlib
import time
from collections.abc import Iterator


class Stopwatch:
    """Wall time that was spent within `running`, s."""

    def __init__(self) -> None:
        self.seconds = 0.0

    @contextlib.contextmanager
    def running(self) -> Iterator[None]:
        """Counts what happens inside, whatever becomes of it."""
        started = time.perf_counter()
        try:
            yield
        finally:
            self.seconds += time.perf_counter() - started

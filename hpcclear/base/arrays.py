"""Types of the arrays that are passed about; what shape they have is said where they are."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Booleans = NDArray[np.bool_]
Records = NDArray[np.void]
"""Structured: one record an element, its fields named where the dtype is."""

LINE = 8
"""Doubles in a line of the cache."""


def aligned(count: int) -> Array:
    """Zeros, shape (count,), that begin where a line of the cache does: vectors across two lines take twice as long to fetch,
    and where NumPy puts an array is left to chance."""
    room = np.zeros(count + LINE)
    first = -(room.ctypes.data // room.itemsize) % LINE
    return room[first : first + count]

"""Types of the arrays that are passed about; what shape they have is said where they are."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Booleans = NDArray[np.bool_]
Records = NDArray[np.void]
"""Structured: one record an element, its fields named where the dtype is."""

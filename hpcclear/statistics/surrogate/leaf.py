"""What surrogates of all kinds have in common: their box, their samples, what is stored of them."""

from collections.abc import Mapping, Sequence

import numpy as np

from hpcclear.base.arrays import Array, Booleans
from hpcclear.base.errors import InputError

Columns = Mapping[str, tuple[str, str]]
"""Variables of a dataset of kind ``kriging``: the dimension of each in a model's row ("point", "parameter" or ""), and the
attribute of the model that it holds."""


def checked_samples(
    points: Array, values: Array, bounds: Array, names: Sequence[str] | None, needed: int
) -> tuple[tuple[str, ...], Booleans]:
    """Return the inputs' names (default x1, x2, ...), and which of the samples (n,) count; NaN values are failed samples.

    Raises InputError: points outside the bounds, or fewer valid samples than needed.
    """
    labels = tuple(names or (f"x{k + 1}" for k in range(points.shape[1])))
    inside(points, labels, *bounds.T)
    valid = np.isfinite(values)
    if valid.sum() < needed:
        reason = f"too few valid samples for {points.shape[1]} inputs ({values.size} given)"
        remedy = f"give at least {needed}, better ten times the number of inputs"
        raise InputError("values", int(valid.sum()), reason, remedy)
    return labels, valid


def inside(points: Array, names: Sequence[str], lower: Array, upper: Array) -> Array:
    """Points ``(n, d)`` as floats, after checking that none lies outside the box.

    Raises InputError naming the first variable and value outside.
    """
    points = np.asarray(points, dtype=np.float64)
    slack = 8 * np.finfo(float).eps * np.maximum(abs(lower), abs(upper))
    good = (points >= lower - slack) & (points <= upper + slack)  # False for NaN too
    if not good.all():
        row, column = np.argwhere(~good)[0]
        domain = f"the surrogate's domain [{lower[column]:.9g}, {upper[column]:.9g}]"
        remedy = "evaluate inside the domain, or fit the surrogate on a wider one"
        reason = f"outside {domain}; it does not extrapolate"
        raise InputError(names[column], float(points[row, column]), reason, remedy)
    return points

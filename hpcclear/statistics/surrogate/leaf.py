"""Interface of a surrogate: how it is fitted to points in a box, and what the fitted model returns.

`Method` is what a study knows of a kind of surrogate; `hpcclear.statistics.surrogate.regression` makes one of anything with
`fit` and `predict`.
"""

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np

from hpcclear.base.arrays import Array, Booleans
from hpcclear.base.errors import InputError

Columns = Mapping[str, tuple[str, str]]
"""Variables of a dataset of kind ``kriging``: the dimension of each in a model's row ("point", "parameter" or ""), and the
attribute of the model that it holds."""
Fields = Mapping[str, tuple[str, ...]]
"""Names of arrays, and the dimensions of each: "parameter" and "training_point"."""


class Leaf(Protocol):
    """A model fitted to points in a box."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the d inputs."""

    @property
    def lower(self) -> Array:
        """Lower corner of the box, (d,)."""

    @property
    def upper(self) -> Array:
        """Upper corner, (d,)."""

    @property
    def inputs(self) -> Array:
        """Training points that were used, (n, d)."""

    @property
    def values(self) -> Array:
        """Their values, (n,)."""

    @property
    def dropped(self) -> int:
        """Samples that had failed and were left out."""

    @property
    def label(self) -> str:
        """What it is, where it is not Kriging with the squared exponential; else empty."""

    @property
    def separable(self) -> bool:
        """Whether it is a sum of products over the inputs: moments have tensor rules then, and are averages over draws else."""

    @property
    def columns(self) -> Columns:
        """What is stored of it beside names, box and training points."""

    def predict(self, points: Array) -> Array:
        """Values at points in the box, (n, d) to (n,); InputError outside it."""

    def leave_one_out(self) -> Array:
        """At each training point what a model without that point predicts, (n,)."""

    def steepest(self) -> int:
        """The input it varies fastest in: where a box is cut."""

    def moments(self, points: Array) -> Array | None:
        """Mean and standard deviation over equally likely points of n designs, (n, s, d) to (n, 2); None: those of
        `predict`."""

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Return the model as plain arrays of numbers and text, of any shapes, without pickle."""


class Method(Protocol):
    """A kind of surrogate with its settings."""

    @property
    def label(self) -> str:
        """What it is called; empty for Kriging with the squared exponential."""

    def fit(
        self,
        points: Array,
        values: Array,
        bounds: Array,
        *,
        rng: np.random.Generator,
        names: Sequence[str] | None = None,
    ) -> Leaf:
        """A model of values (n,), NaN where a sample failed, at points (n, d) within bounds (d, 2)."""

    def restored(self, arrays: Mapping[str, np.ndarray]) -> Leaf:
        """Return the model of the arrays that `Leaf.to_arrays` gave, shapes as there; it predicts the same to the last bit."""


def checked_samples(
    points: Array,
    values: Array,
    bounds: Array,
    names: Sequence[str] | None,
    needed: int,
) -> tuple[tuple[str, ...], Booleans]:
    """Return the inputs' names (default x1, x2, ...), and which of the samples (n,) count; NaN values are failed samples.

    Raises
    ------
    InputError
        Points outside the bounds, or fewer valid samples than needed.
    """
    labels = tuple(names or (f"x{k + 1}" for k in range(points.shape[1])))
    inside(points, labels, *bounds.T)
    valid = np.isfinite(values)
    if valid.sum() < needed:
        raise InputError(
            "values",
            int(valid.sum()),
            f"too few valid samples for {points.shape[1]} inputs ({values.size} given)",
            f"give at least {needed}, better ten times the number of inputs",
        )
    return labels, valid


def inside(
    points: np.ndarray, names: Sequence[str], lower: np.ndarray, upper: np.ndarray
) -> np.ndarray:
    """Points ``(n, d)`` as floats, after checking that none lies outside the box.

    Raises
    ------
    InputError
        Naming the first variable and value outside.
    """
    points = np.asarray(points, dtype=np.float64)
    slack = 8 * np.finfo(float).eps * np.maximum(abs(lower), abs(upper))
    good = (points >= lower - slack) & (points <= upper + slack)  # False for NaN too
    if not good.all():
        row, column = np.argwhere(~good)[0]
        raise InputError(
            names[column],
            float(points[row, column]),
            f"outside the surrogate's domain [{lower[column]:.9g}, {upper[column]:.9g}]; "
            "it does not extrapolate",
            "evaluate inside the domain, or fit the surrogate on a wider one",
        )
    return points

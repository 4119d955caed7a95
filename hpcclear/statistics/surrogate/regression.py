"""Surrogates made of anything that fits and predicts as scikit-learn's regressors do.

A regressor gets inputs scaled to the unit cube of its box and outputs of mean 0 and standard deviation 1, so that its own
settings need no units. Shapes and numbers of its answers are checked. Each fit must
come out again bit for bit, because a study that goes on after an interruption fits it again to the stored training points.
"""

import copy
import inspect
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.plugins.sources import in_use
from hpcclear.statistics.surrogate.leaf import Columns, checked_samples, inside

KEY = "study.surrogate.model"
FOLDS = 5
"""Parts of the training points that are left out one after the other; also the fewest points there may be."""
LEVELS = 5
"""Values of an input at which it is seen how much predictions vary with it."""

COLUMNS: Columns = {
    "cross_validated": ("point", "left_out"),
    "dropped": ("", "dropped"),
    "surrogate": ("", "label"),
}
RESTORED: Columns = {**COLUMNS, "seed": ("", "seed"), "fitted": ("point", "fitted")}
"""The same, with what a fit to the same points needs to be the same one."""
PREDICTED: tuple[str, ...] = ("left_out", "fitted")
"""Predictions at the training points, which a model that was read knows."""


@dataclass(frozen=True)
class RegressionMethod:
    """A regressor as a kind of surrogate; `label` is what it is called.

    `source`: a class or a function that needs no arguments, or an object that is copied for each fit. What it makes has
    ``fit(X, y)`` and ``predict(X)``, X of shape (n, d), y of shape (n,); it may have ``moments(X)``, for X of shape
    (n, s, d) mean and standard deviation over the s equally likely points of each of n designs, shape (n, 2). A
    `random_state` that is None is set, as scikit-learn's `set_params` does, or as an argument of that name.
    """

    source: object
    label: str

    def fit(
        self,
        points: Array,
        values: Array,
        bounds: Array,
        *,
        rng: np.random.Generator,
        names: Sequence[str] | None = None,
    ) -> "Regression":
        """Fit a new regressor.

        Raises InputError as `hpcclear.statistics.surrogate.leaf.checked_samples`, or the regressor failed; the message says
        in what.
        """
        points, values, bounds = (np.asarray(a, dtype=np.float64) for a in (points, values, bounds))
        labels, valid = checked_samples(points, values, bounds, names, FOLDS)
        seed, lost = int(rng.integers(2**31)), int((~valid).sum())
        (lower, upper), kept = bounds.T, (points[valid], values[valid])
        return Regression(labels, lower, upper, *kept, lost, self.label, seed, self.source)

    def restored(self, model: "Regression") -> "Regression":
        """Fit a model of a checkpoint again to its training points.

        Raises InputError: the fit does not come out as it did.
        """
        found = replace(model, source=self.source)
        if not np.array_equal(found.fitted, model.stored["fitted"]):
            reason = "fitted twice to the same points it is two models"
            remedy = "Give it a fixed random_state, and let nothing else in it be random"
            raise InputError(KEY, self.label, reason, remedy)
        return found


@dataclass(frozen=True, eq=False)
class Regression:
    """A regressor fitted in the box from `lower` to `upper` (d,); without a source it only knows what was stored.

    `inputs` (n, d), `values` (n,): training points, without the failed samples that were `dropped`; `seed`: of the
    regressor's own random numbers; `source`: of `RegressionMethod`; `stored`: `PREDICTED` (n,).
    """

    names: tuple[str, ...]
    lower: Array
    upper: Array
    inputs: Array
    values: Array
    dropped: int = 0
    label: str = ""
    seed: int = 0
    source: object = None
    stored: Mapping[str, Array] = field(default_factory=dict)

    separable = False  # moments are averages over draws
    columns = COLUMNS

    @cached_property
    def _scale(self) -> tuple[float, float]:
        """Mean and standard deviation of the training values, 1 if they are all equal."""
        mean, scale = float(self.values.mean()), float(self.values.std())
        return mean, scale if scale > 10 * np.finfo(float).eps * abs(mean) else 1.0

    @cached_property
    def _model(self) -> object:
        return self._fitted_to(np.ones(len(self.values), bool))

    def _fitted_to(self, rows: Array) -> object:
        """A new regressor fitted to some of the training points."""
        if self.source is None:
            reason = "the file holds its training points, but no model that predicts"
            raise InputError("surrogate", self.label, reason, "Fit it to them again")
        model = made(self.source, self.label, self.seed)
        mean, scale = self._scale
        points = self._to_unit(self.inputs[rows])
        _ask(model, self.label, "fit", points, (self.values[rows] - mean) / scale)
        return model

    def _to_unit(self, points: Array) -> Array:
        return (points - self.lower) / (self.upper - self.lower)

    def predict(self, points: Array) -> Array:
        """Values at points, (n, d) to (n,). Raises InputError: a point outside the box, or the regressor failed."""
        return self._predicted(self._model, inside(points, self.names, self.lower, self.upper))

    def _predicted(self, model: object, points: Array) -> Array:
        mean, scale = self._scale
        found = _ask(model, self.label, "predict", self._to_unit(points))
        return mean + scale * _numbers(found, (len(points),), self.label, "predict")

    @cached_property
    def fitted(self) -> Array:
        """Predictions at the training points, shape (n,)."""
        return self.predict(self.inputs)

    @cached_property
    def left_out(self) -> Array:
        """Prediction at each training point, shape (n,), of a model without a fifth of the points, this one among them."""
        if "left_out" in self.stored:
            return self.stored["left_out"]
        fold, found = np.arange(len(self.values)) % FOLDS, np.empty(len(self.values))
        for k in range(FOLDS):
            model = self._fitted_to(fold != k)
            found[fold == k] = self._predicted(model, self.inputs[fold == k])
        return found

    def leave_one_out(self) -> Array:
        """Return `left_out`, shape (n,)."""
        return self.left_out

    def steepest(self) -> int:
        """The input with which predictions vary most, the others as in the training points."""
        spread = []
        for column, ends in enumerate(zip(self.lower, self.upper, strict=True)):
            rows = np.repeat(self.inputs[None], LEVELS, axis=0)
            rows[:, :, column] = np.linspace(*ends, LEVELS)[:, None]
            found = self.predict(rows.reshape(-1, len(self.names)))
            spread.append(found.reshape(LEVELS, -1).std(axis=0).mean())
        return int(np.argmax(spread))

    def moments(self, points: Array) -> Array | None:
        """Mean and standard deviation over equally likely points of n designs, (n, s, d) to (n, 2), by the regressor if it
        has them."""
        if not hasattr(self._model, "moments"):
            return None
        mean, scale = self._scale
        shape = (len(points), 2)
        found = _ask(self._model, self.label, "moments", self._to_unit(points))
        return scale * _numbers(found, shape, self.label, "moments") + [mean, 0.0]


def made(source: object, label: str, seed: int) -> Any:
    """A regressor that is not fitted yet.

    Raises InputError: it cannot be made without arguments, or has no `fit` or no `predict`.
    """
    if isinstance(source, type) or not hasattr(source, "predict"):
        model = _called(source, label, seed)
    else:
        model = copy.deepcopy(source)
    missing = [name for name in ("fit", "predict") if not callable(getattr(model, name, None))]
    if missing:
        reason = f"has no {' and no '.join(missing)}"
        raise InputError(KEY, label, reason, "Give it fit(X, y) and predict(X)")
    if hasattr(model, "get_params") and hasattr(model, "set_params"):
        free = [name for name, value in model.get_params().items() if value is None]
        own = [name for name in free if name.rpartition("__")[2] == "random_state"]
        model.set_params(**dict.fromkeys(own, seed))
    return model


def _called(source: object, label: str, seed: int) -> object:
    """What a class or a function makes."""
    if not callable(source):
        reason = "is no class, no function and has no predict"
        raise InputError(KEY, label, reason, "Give it fit(X, y) and predict(X)")
    with in_use(KEY, label, "could not be made"):
        own = inspect.signature(source).parameters
        if "random_state" in own and own["random_state"].default in (None, inspect.Parameter.empty):
            return source(random_state=seed)
        return source()


def _ask(model: object, label: str, what: str, *arguments: Array) -> object:
    """What a method of the regressor returns, with one thread: more would change last bits."""
    from threadpoolctl import threadpool_limits

    with in_use(KEY, label, f"failed in {what}"), threadpool_limits(limits=1):
        return getattr(model, what)(*arguments)


def _numbers(found: object, shape: tuple[int, ...], label: str, what: str) -> Array:
    """What a method returned, as finite numbers of this shape."""
    remedy = f"Let it return an array of shape {shape}, finite everywhere in the unit cube"
    try:
        array = np.asarray(found, dtype=np.float64)
    except (TypeError, ValueError):
        words = type(found).__name__
    else:
        count, words = np.count_nonzero(~np.isfinite(array)), f"shape {array.shape}, not {shape}"
        if array.shape == shape and not count:
            return array
        if array.shape == shape:
            words = f"{count} of {array.size} numbers that are not finite"
    raise InputError(KEY, label, f"its {what} returned {words}", remedy)

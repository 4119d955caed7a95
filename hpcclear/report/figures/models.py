"""Kriging models as they stand in a file (kind ``kriging``): enough to draw them, with NumPy alone.

The predictor of the optimiser is `hpcclear.statistics.surrogate`; drawing needs a few thousand points and no compiler.
"""

from dataclasses import dataclass

import numpy as np
import xarray as xr

from hpcclear.base.arrays import Array
from hpcclear.report.figures import labels


@dataclass(frozen=True)
class Model:
    """One model: a squared-exponential kernel over inputs scaled to the unit cube, and noise."""

    inputs: tuple[str, ...]
    lower: Array
    upper: Array
    lengths: Array
    signal: float
    noise: float
    mean: float
    scale: float
    points: Array  # (n, d), user's units
    values: Array  # (n,)
    weights: Array  # (n,)

    def _features(self, points: Array) -> Array:
        return (points - self.lower) / (self.upper - self.lower) / self.lengths

    def _covariance(self, first: Array, second: Array) -> Array:
        """Covariance between points (n, d) and (m, d), in units of scale^2: shape (n, m)."""
        steps = self._features(first)[:, None, :] - self._features(second)[None, :, :]
        return self.signal * np.exp(-0.5 * np.einsum("ijk,ijk->ij", steps, steps))

    def predict(self, points: Array) -> Array:
        """The Kriging mean at points (m, d)."""
        return self.mean + self.scale * (self._covariance(points, self.points) @ self.weights)

    def leave_one_out(self) -> Array:
        """At each training point, what the model without that point predicts, shape (n,).

        Closed form: the error is weight over the diagonal of the inverse covariance (Rasmussen and Williams,
        Gaussian Processes for Machine Learning, 2006, eq. 5.12).
        """
        matrix = self._covariance(self.points, self.points)
        inverse = np.linalg.inv(matrix + self.noise * np.eye(len(self.values)))
        return self.values - self.scale * self.weights / np.diag(inverse)


def families(kriging: xr.Dataset) -> dict[str, list[Model]]:
    """The models of a file by family, each for one subinterval."""
    found: dict[str, list[Model]] = {}
    for k in range(kriging.sizes["model"]):
        row = kriging.isel(model=k)
        name = str(row["family"].item()) if "family" in row else str(row["model"].item())
        found.setdefault(name, []).append(_model(row))
    return found


def _model(row: xr.Dataset) -> Model:
    used = (
        row["used"].to_numpy() != 0
        if "used" in row
        else np.isfinite(row["length_scale"].to_numpy())
    )
    by_path = {str(v.attrs["scene_path"]): v for v in labels.design_variables(row)}
    found = [str(name) for name in row["parameter"].to_numpy()]
    order = str(row["family"].item()).split() if "family" in row else []
    own = [found[k] for k in np.flatnonzero(used)]
    inputs = tuple(order if sorted(order) == sorted(own) else own)
    columns = [by_path[name] for name in inputs]
    points = np.column_stack([column.to_numpy() for column in columns])
    values = row["training_output"].to_numpy()
    good = np.isfinite(values) & np.isfinite(points).all(axis=1)
    lower, upper = (
        np.array([float(row[f"{column.name}_{side}"]) for column in columns])
        for side in ("lower", "upper")
    )
    numbers = ("signal_variance", "noise_variance", "output_mean", "output_scale")
    signal, noise, mean, scale = (float(row[name]) for name in numbers)
    lengths = row["length_scale"].to_numpy()[[found.index(name) for name in inputs]]
    fit = lengths, signal, noise, mean, scale
    weights = row["weight"].to_numpy()[good]
    return Model(inputs, lower, upper, *fit, points[good], values[good], weights)


def predict(models: list[Model], points: Array) -> Array:
    """The family's prediction at points (m, d), each by the model of its subinterval; NaN outside all of them."""
    found = np.full(len(points), np.nan)
    for model in models:
        slack = 1e-9 * (model.upper - model.lower)
        inside = np.all((points >= model.lower - slack) & (points <= model.upper + slack), axis=1)
        todo = inside & np.isnan(found)
        if todo.any():
            found[todo] = model.predict(points[todo])
    return found

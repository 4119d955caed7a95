"""Kriging over a wide domain as a product of models, each on its own subinterval of the inputs.

The domain is cut into prod_i L_i / L'_i boxes (L_i the length of an input's interval, L'_i that of
its subintervals). A query uses the model of the box it is in. A single model is the case of one box.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.statistics.surrogate.kriging import FIELDS, Kriging, inside

SHARED = ("names",)
RAGGED = ("inputs", "values", "alpha")
PIECEWISE_FIELDS: dict[str, tuple[str, ...]] = {
    name: dims if name in SHARED + RAGGED else ("leaf", *dims) for name, dims in FIELDS.items()
} | {"training_points": ("leaf",), "r2": ("leaf",), "rmae": ("leaf",), "accepted": ("leaf",)}
"""What is stored, with dimensions; the leaves' training points lie end to end."""


@dataclass(frozen=True, eq=False)
class PiecewiseKriging:
    """Kriging models on boxes that tile a domain.

    Attributes
    ----------
    leaves : tuple of Kriging
        One model a box, all with the same names.
    r2, rmae : (l,) arrays
        Accuracy of each on its own test points (NaN where the test values do not vary).
    accepted : (l,) array of bool
        Whether it met the targets; a False is the best that could be had within the limits.

    Raises
    ------
    InputError
        No boxes, different names, or boxes that overlap or leave gaps.
    """

    leaves: tuple[Kriging, ...]
    r2: np.ndarray
    rmae: np.ndarray
    accepted: np.ndarray

    def __post_init__(self) -> None:
        if not self.leaves or any(leaf.names != self.leaves[0].names for leaf in self.leaves):
            raise InputError("leaves", len(self.leaves), "no models of one kind", "give some")
        for name in ("r2", "rmae", "accepted"):
            if np.shape(getattr(self, name)) != (len(self.leaves),):
                raise InputError(name, np.shape(getattr(self, name)), "not one per box", "give all")
        lower, upper = self._corners
        volume = np.prod((upper - lower) / (self.upper - self.lower), axis=1).sum()
        shared = np.minimum(upper[:, None], upper) - np.maximum(lower[:, None], lower)
        overlaps = (shared > 0).all(axis=-1).sum() > len(self.leaves)  # each overlaps itself
        if overlaps or abs(volume - 1.0) > 1e-9:
            raise InputError("leaves", len(self.leaves), "boxes do not tile the domain", "refit")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the inputs."""
        return self.leaves[0].names

    @cached_property
    def _corners(self) -> tuple[np.ndarray, np.ndarray]:
        return np.array([k.lower for k in self.leaves]), np.array([k.upper for k in self.leaves])

    @cached_property
    def lower(self) -> np.ndarray:
        """Lower corner of the domain, ``(d,)``."""
        return np.asarray(self._corners[0].min(axis=0))

    @cached_property
    def upper(self) -> np.ndarray:
        """Upper corner of the domain, ``(d,)``."""
        return np.asarray(self._corners[1].max(axis=0))

    def locate(self, points: np.ndarray) -> np.ndarray:
        """Index of the box that each of ``(n, d)`` points is in; a border belongs to the upper box.

        Raises
        ------
        InputError
            A point lies outside the domain.
        """
        points = inside(points, self.names, self.lower, self.upper)
        points = np.clip(points, self.lower, self.upper)  # round-off beyond the outer border
        index = np.full(len(points), -1)
        for k, (low, high) in enumerate(zip(*self._corners, strict=True)):
            below = (points < high) | (high == self.upper)
            index[((points >= low) & below).all(axis=1)] = k
        return index

    def predict(self, points: np.ndarray) -> np.ndarray:
        """Kriging mean at ``(n, d)`` points, each by its box's model; see `Kriging.predict`."""
        return self._by_leaf(points, lambda leaf, part: leaf.predict(part))

    def variance(self, points: np.ndarray, *, noise: bool = False) -> np.ndarray:
        """Kriging variance at ``(n, d)`` points; see `Kriging.variance`."""
        return self._by_leaf(points, lambda leaf, part: leaf.variance(part, noise=noise))

    def _by_leaf(self, points: np.ndarray, answer) -> np.ndarray:  # type: ignore[no-untyped-def]
        index = self.locate(points)
        points, out = np.asarray(points, dtype=np.float64), np.empty(len(index))
        for k in np.unique(index):
            leaf, here = self.leaves[k], index == k
            out[here] = answer(leaf, np.clip(points[here], leaf.lower, leaf.upper))
        return out

    def to_arrays(self) -> dict[str, np.ndarray]:
        """The models as plain arrays, without pickle; `PIECEWISE_FIELDS` names their dimensions."""
        parts = [leaf.to_arrays() for leaf in self.leaves]
        arrays = {
            name: np.stack([part[name] for part in parts]) for name in FIELDS if name not in RAGGED
        }
        arrays["names"] = parts[0]["names"]
        arrays |= {name: np.concatenate([part[name] for part in parts]) for name in RAGGED}
        arrays["training_points"] = np.array([part["values"].size for part in parts])
        return arrays | {
            name: np.asarray(getattr(self, name)) for name in ("r2", "rmae", "accepted")
        }

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, np.ndarray]) -> "PiecewiseKriging":
        """The models that `to_arrays` stored; they predict the same to the last bit.

        Raises
        ------
        InputError
            An array is missing, has the wrong shape, or is not finite; the boxes do not tile.
        """
        remedy = "use a file written by this package"
        for name in PIECEWISE_FIELDS:
            if name not in arrays:
                raise InputError(name, None, "missing from the stored model", remedy)
        counts = np.asarray(arrays["training_points"])
        stored = np.shape(arrays["values"])
        if counts.ndim != 1 or counts.dtype.kind not in "iu" or (counts < 1).any():
            raise InputError("training_points", counts, "not one count per box", remedy)
        if stored != (counts.sum(),):
            raise InputError("values", stored, "not as many as training_points says", remedy)
        ends = np.cumsum(counts)
        leaves = []
        for k, (count, end) in enumerate(zip(counts, ends, strict=True)):
            part = {name: np.asarray(arrays[name]) for name in SHARED}
            part |= {name: np.asarray(arrays[name])[end - count : end] for name in RAGGED}
            for name in FIELDS:
                if name not in part:
                    if np.shape(arrays[name])[:1] != counts.shape:
                        raise InputError(name, np.shape(arrays[name]), "not one per box", remedy)
                    part[name] = np.asarray(arrays[name])[k]
            leaves.append(Kriging.from_arrays(part))
        r2, rmae = (np.asarray(arrays[name], dtype=np.float64) for name in ("r2", "rmae"))
        return cls(tuple(leaves), r2, rmae, np.asarray(arrays["accepted"], dtype=bool))

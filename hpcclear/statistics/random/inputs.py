"""Random inputs of a surrogate, and how they and the design reach the surrogate's inputs."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import prod

import numpy as np

from hpcclear.base.quantiles import Quantiles


@dataclass(frozen=True)
class RandomVariable:
    """An input that scatters, independently of the others."""

    name: str
    law: Quantiles
    """Of the value, or of the offset from the design."""
    about_design: bool = False
    """Whether it is an offset added to the design variable of this name."""


@dataclass(frozen=True)
class DerivedInput:
    """A model input computed from others."""

    name: str
    """The model's input."""
    of: tuple[str, ...]
    """What it depends on: design variables and random inputs."""
    function: Callable[..., np.ndarray]
    """Arrays of those, in this order, to an array of the same (broadcast) shape. It must take its extremes at the corners
    of the random inputs' box (be monotone in each), since there it is checked that the support stays inside the model's
    domain."""


@dataclass(frozen=True)
class Group:
    """Model inputs that share random sources: one tensor rule."""

    dims: tuple[int, ...]
    sources: tuple[str, ...]  # the random inputs
    moves: bool  # with the design


class Wiring:
    """Who feeds whom: design variables and random inputs to the model's inputs."""

    def __init__(
        self,
        names: Sequence[str],
        design_names: Sequence[str],
        random_inputs: Sequence[RandomVariable],
        derived: Sequence[DerivedInput],
    ) -> None:
        self.names = tuple(names)
        self.column = {name: k for k, name in enumerate(design_names)}
        self.random = {one.name: one for one in random_inputs}
        self.derived = {one.name: one for one in derived}
        self.groups = self._grouped()

    def _sources(self, name: str) -> tuple[str, ...]:
        return self.derived[name].of if name in self.derived else (name,)

    def _grouped(self) -> tuple[Group, ...]:
        """Inputs joined while they share a random source; those without any are taken together."""
        parts: list[tuple[list[int], set[str]]] = []
        calm: list[int] = []
        for dim, name in enumerate(self.names):
            sources = {source for source in self._sources(name) if source in self.random}
            if not sources:
                calm.append(dim)
                continue
            joined = [part for part in parts if part[1] & sources]
            parts = [part for part in parts if not part[1] & sources]
            dims = sorted([dim, *(d for part in joined for d in part[0])])
            parts.append((dims, sources.union(*(part[1] for part in joined))))
        groups = []
        for dims, shared in parts:
            own = tuple(name for name in self.random if name in shared)
            moves = any(s in self.column for d in dims for s in self._sources(self.names[d]))
            groups.append(Group(tuple(dims), own, moves))
        return (*groups, *([Group(tuple(calm), (), True)] if calm else ()))

    def corners(self, group: Group) -> dict[str, np.ndarray]:
        """The corners of a group's box of random inputs, as draws: an array of shape (corners,) for each input."""
        ends = [np.array([self.random[name].law.span]) for name in group.sources]
        return dict(zip(group.sources, tensor(ends), strict=True))

    def places(
        self, dims: Sequence[int], designs: np.ndarray, draws: Mapping[str, np.ndarray]
    ) -> np.ndarray:
        """Model inputs `dims`, ``(n, s, len(dims))``, of n designs and draws ``(n or 1, s)``."""

        def value(name: str) -> np.ndarray:
            if name in self.random and not self.random[name].about_design:
                return draws[name]
            at_design = designs[:, self.column[name], None]
            return at_design + draws[name] if name in self.random else at_design

        size = max((array.shape[1] for array in draws.values()), default=1)
        out = np.empty((len(designs), size, len(dims)))
        for k, dim in enumerate(dims):
            name = self.names[dim]
            arguments = [value(source) for source in self._sources(name)]
            derived = self.derived.get(name)
            out[:, :, k] = arguments[0] if derived is None else derived.function(*arguments)
        return out


def tensor(axes: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Node arrays of shape ``(n or 1, N_k)`` of several axes over their tensor, last axis fastest."""
    out = []
    for k, axis in enumerate(axes):
        after = prod(other.shape[1] for other in axes[k + 1 :])
        before = prod(other.shape[1] for other in axes[:k])
        out.append(np.tile(np.repeat(axis, after, axis=1), (1, before)))
    return out

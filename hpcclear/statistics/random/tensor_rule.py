"""Tensor Gauss rules on a Kriging model: which nodes, and what of them can be made ready."""

from functools import reduce
from itertools import product
from math import prod, sqrt

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.statistics.random.inputs import Group, Wiring, tensor
from hpcclear.statistics.random.rules import nodes_needed, rule
from hpcclear.statistics.surrogate.kriging import Kriging
from hpcclear.statistics.surrogate.predictor import tensor_moments

MOST_NODES = 48
"""For one random input; needing more means that it spans many length scales of the surrogate."""
MOST_TENSOR = 200_000
"""Nodes of a whole tensor rule; beyond, Monte Carlo is the better way."""


class TensorRule:
    """The tensor rule on one model, with all that does not depend on the design made ready."""

    def __init__(
        self, leaf: Kriging, wiring: Wiring, tolerance: float, probes: np.ndarray | None
    ) -> None:
        self.leaf, self.wiring = leaf, wiring
        self.counts = self._choose(tolerance, probes)
        if prod(self.counts.values()) > MOST_TENSOR:
            raise InputError("random_inputs", self.counts, "too many nodes", "give draws")
        self.moving = [group for group in wiring.groups if group.moves]
        sizes = [prod(self.counts[name] for name in group.sources) for group in self.moving]
        self.sizes = np.array(sizes, dtype=np.int64)
        self.starts = np.cumsum([0, *(len(group.dims) for group in self.moving)])
        self.dims = np.array([dim for group in self.moving for dim in group.dims], dtype=np.int64)
        self.steady, self.steady_shares = self._still()

    def moments(self, designs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean and variance, ``(n,)`` each."""
        leaf, count = self.leaf, len(designs)
        places, shares = [], []
        for group in self.moving:
            at, weights = self._nodes(group, designs)
            shares.append(weights)
            places.append(self._in_unit(group, at).reshape(count, at.shape[1] * at.shape[2]))
        nodes, chances = (np.concatenate(one, axis=1) for one in (places, shares))
        groups = self.sizes, self.starts, self.dims, self.steady, self.steady_shares
        found = tensor_moments(nodes, chances, *groups, leaf.packed[0], leaf.length_scales)
        return leaf.mean + found[:, 0], found[:, 1]

    def _nodes(self, group: Group, designs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Places ``(n, N, D)`` of a group's nodes and their probabilities ``(n, N)``."""
        rules = [rule(self.wiring.random[name].law, self.counts[name]) for name in group.sources]
        nodes = tensor([places[None] for places, _ in rules])
        weights = reduce(np.multiply, tensor([one[None] for _, one in rules]), np.ones((1, 1)))
        draws = dict(zip(group.sources, nodes, strict=True))
        places = self.wiring.places(group.dims, designs, draws)
        return places, np.broadcast_to(weights, places.shape[:2])

    def _in_unit(self, group: Group, places: np.ndarray) -> np.ndarray:
        """Places (..., D) of a group's inputs in the unit cube."""
        lower, dims = self.leaf.lower, list(group.dims)
        return np.asarray((places - lower[dims]) / (self.leaf.upper[dims] - lower[dims]))

    def _still(self) -> tuple[np.ndarray, np.ndarray]:
        """Kernel rows times weights, and node probabilities of what never moves."""
        leaf = self.leaf
        scaled, weights = leaf.packed
        rows, shares = weights[None], np.ones(1)
        for group in self.wiring.groups:
            if group.moves:
                continue
            places, chances = self._nodes(group, np.empty((1, len(self.wiring.column))))
            dims = list(group.dims)
            unit = self._in_unit(group, places[0])
            steps = (unit / leaf.length_scales[dims])[:, :, None] - scaled[dims]
            kernels = np.exp(-0.5 * np.square(steps).sum(axis=1))
            rows = (rows[:, None, :] * kernels).reshape(-1, scaled.shape[1])
            shares = (shares[:, None] * chances[0]).ravel()
        missing = -len(rows) % 4
        rows = np.concatenate([rows, np.zeros((missing, rows.shape[1]))])
        return rows, np.concatenate([shares, np.zeros(missing)])

    def _choose(self, tolerance: float, probes: np.ndarray | None) -> dict[str, int]:
        """Nodes of each random input."""
        lengths = self.leaf.length_scales * (self.leaf.upper - self.leaf.lower)
        counts = {}
        for group in self.wiring.groups:
            simple = not any(self.wiring.names[dim] in self.wiring.derived for dim in group.dims)
            for name in group.sources:
                if simple:
                    law, length = self.wiring.random[name].law, float(lengths[group.dims[0]])
                    counts[name] = nodes_needed(law, length, tolerance, MOST_NODES)
                else:
                    counts[name] = self._probed(group, name, lengths, tolerance, probes)
                if counts[name] == 0:
                    reason = f"needs more than {MOST_NODES} nodes: it spans many length scales"
                    remedy = "narrow it, loosen the tolerance, or give draws"
                    raise InputError(name, self.wiring.random[name].law, reason, remedy)
        return counts

    def _probed(
        self,
        group: Group,
        name: str,
        lengths: np.ndarray,
        tolerance: float,
        probes: np.ndarray | None,
    ) -> int:
        """Nodes of a random input behind derived inputs, by trial on kernels at the probes."""
        wiring, dims = self.wiring, list(group.dims)
        if group.moves and probes is None:
            raise InputError("probes", None, f"needed for {name}, which is derived", "give designs")
        designs = np.zeros((1, len(wiring.column))) if probes is None else np.asarray(probes, float)
        narrow = lengths[dims] / sqrt(2)
        others = [other for other in group.sources if other != name]
        ends = [wiring.random[other].law.span for other in others]
        levels = list(product(*((low, 0.5 * (low + high), high) for low, high in ends)))

        def averaged(count: int) -> np.ndarray:
            nodes, weights = rule(wiring.random[name].law, count)
            out = []
            for level in levels:
                draws = {k: np.array([[value]]) for k, value in zip(others, level, strict=True)}
                both = (draws | {name: one[None]} for one in (nodes, centres))
                at, about = (wiring.places(dims, designs, one) / narrow for one in both)
                squares = ((at[:, :, None] - about[:, None]) ** 2).sum(-1)
                out.append(np.einsum("j,njc->nc", weights, np.exp(-0.5 * squares)))
            return np.array(out)

        centres = np.linspace(*wiring.random[name].law.span, 5)
        exact = averaged(MOST_NODES)
        for count in range(1, MOST_NODES):
            if abs(averaged(count) - exact).max() <= tolerance:
                return count
        return 0

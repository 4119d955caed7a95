"""Mean and standard deviation of a Kriging mean under random inputs (eqs. 19 to 21).

Three ways, each a check on the others:

- tensor Gauss rules (`RobustObjective`, the default): the kernel is a product over the inputs, so
  N1 x N2 x ... nodes cost little more than N1 + N2 + ... kernels; no sampling noise;
- Monte Carlo with standard errors, the paper's way, and the one of a kernel that is no product (Matern) and of models on
  several boxes;
- the closed form in error functions, for independent inputs of one model.

Random inputs are independent, unless their draws are given. They may stand for the model's inputs themselves or act through
`DerivedInput` ones: a model trained in the ratio r2 = I2 / (m2 L^2 / 12), say, under tolerances of m2
and I2. Inputs that share a random source form a group with a tensor rule of its own, and the kernel
is still a product over the groups.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.statistics.random.inputs import DerivedInput, RandomVariable, Wiring
from hpcclear.statistics.random.rules import kernel_integral
from hpcclear.statistics.random.tensor_rule import TensorRule
from hpcclear.statistics.surrogate.kriging import Kriging
from hpcclear.statistics.surrogate.leaf import inside
from hpcclear.statistics.surrogate.piecewise import Piecewise

Drawn = Callable[[np.ndarray], Mapping[str, np.ndarray]]
"""Designs (n, k) to draws (n or 1, s) of each random input."""

MOST_PLACES = 2**16
"""Points at which a surrogate is evaluated at a time."""


@dataclass(frozen=True, eq=False)
class SampledMoments:
    """Monte Carlo estimates, an array over the designs each."""

    mean: np.ndarray
    deviation: np.ndarray
    mean_error: np.ndarray
    deviation_error: np.ndarray
    """mean_error and deviation_error: standard errors."""


def sample_moments(values: np.ndarray) -> SampledMoments:
    """Mean and standard deviation, with standard errors, of s independent samples of each of n quantities, (n, s).

    The variance of the variance estimate is (m4 - s^4 (s - 3) / (s - 1)) / s, m4 the fourth central
    moment; that of the standard deviation follows to first order. Raises InputError for fewer than four samples.
    """
    count = values.shape[1]
    if count < 4:
        raise InputError("samples", count, "too few for a standard error", "draw at least 4")
    mean = values.mean(axis=1)
    steps = values - mean[:, None]
    variance = np.square(steps).sum(axis=1) / (count - 1)
    fourth = np.square(np.square(steps)).mean(axis=1)
    spread = np.maximum(fourth - variance**2 * (count - 3) / (count - 1), 0.0) / count
    deviation = np.sqrt(variance)
    twice = np.where(deviation > 0, 2 * deviation, 1.0)
    return SampledMoments(mean, deviation, deviation / sqrt(count), np.sqrt(spread) / twice)


class RobustObjective:
    """Mean and standard deviation of a surrogate under random inputs, for whole swarms of designs.

    Called with designs ``(n, k)``, columns in the order of `design_names`, it returns ``(n, 2)``: mean and standard deviation,
    in the unit of the surrogate. The result of a design does not depend on the others in the call.

    `derived`: model inputs that are computed from designs and random inputs. The nodes of derived inputs that depend on a
    random one are chosen at the designs `probes` (m, k): spread them over the design space. `tolerance`: absolute error allowed
    in the integral of any kernel (at most 1) over one random input. `draws`: Monte Carlo in place of quadrature, by a function
    of designs (n, k) that returns draws (n or 1, s) of each random input, which may vary together then. Designs that see the
    same ones are ranked without noise.

    Raises InputError: a random input too wide for the tolerance, a model that is no product over the inputs; and on a call, a
    support that leaves the surrogate's domain.
    """

    def __init__(
        self,
        model: Kriging | Piecewise,
        design_names: Sequence[str],
        random_inputs: Sequence[RandomVariable],
        *,
        derived: Sequence[DerivedInput] = (),
        probes: np.ndarray | None = None,
        tolerance: float = 1e-8,
        draws: Drawn | None = None,
    ) -> None:
        self.model = model
        self._wiring = Wiring(model.names, design_names, random_inputs, derived)
        self._draws = draws
        if draws is not None:
            return
        if not model.separable:
            label = model.leaves[0].label
            reason = "the model is not a product of functions of single inputs"
            raise InputError("surrogate", label, reason, "give draws")
        (leaf,) = model.leaves
        self._rule = TensorRule(leaf, self._wiring, tolerance, probes)  # type: ignore[arg-type]

    def __call__(self, designs: np.ndarray) -> np.ndarray:
        """Return mean and standard deviation of each design (n, k), shape (n, 2)."""
        designs = self._checked(designs)
        if self._draws is not None:
            return self._averaged(designs, self._draws(designs))
        mean, variance = self._rule.moments(designs)
        return np.stack([mean, np.sqrt(variance)], axis=1)

    def sampled(self, designs: np.ndarray, draws: Mapping[str, np.ndarray]) -> np.ndarray:
        """The surrogate at given draws of the random inputs, (s,) each, or (n, s): ``(n, s)``.

        Raises InputError as on a call.
        """
        rows = {name: np.atleast_2d(draws[name]) for name in self._wiring.random}
        found = [
            self.model.predict(places.reshape(-1, places.shape[2])).reshape(places.shape[:2])
            for places in self._places(self._checked(designs), rows)
        ]
        return np.concatenate(found) if found else np.empty((0, 1))

    def closed_form(self, designs: np.ndarray) -> np.ndarray:
        """The same in error functions, ``(n, 2)``: of what has a quadrature rule, without derived inputs."""
        designs = self._checked(designs)
        leaf = self.model.leaves[0]
        if not isinstance(leaf, Kriging) or self._draws is not None or self._wiring.derived:
            reason = "the model has no closed form"
            raise InputError("model", self.model.names, reason, "compare with Monte Carlo")
        return np.array([self._closed(leaf, design) for design in designs]).reshape(-1, 2)

    def _checked(self, designs: np.ndarray) -> np.ndarray:
        """Designs as floats, after checking that their random inputs stay inside the domain."""
        designs = np.ascontiguousarray(designs, dtype=np.float64)
        wiring, model = self._wiring, self.model
        low, high = (np.empty((len(designs), len(model.names))) for _ in range(2))
        for group in wiring.groups:
            corners = wiring.places(group.dims, designs, wiring.corners(group))
            low[:, group.dims], high[:, group.dims] = corners.min(axis=1), corners.max(axis=1)
        for ends in (low, high):
            inside(ends, model.names, model.lower, model.upper)
        return designs

    def _averaged(self, designs: np.ndarray, draws: Mapping[str, np.ndarray]) -> np.ndarray:
        """Mean and standard deviation over draws, ``(n, 2)``: the model's own, if it has any."""
        found = []
        for places in self._places(designs, draws):
            own = self.model.moments(places)
            if own is None:
                values = self.model.predict(places.reshape(-1, places.shape[2]))
                moments = sample_moments(values.reshape(places.shape[:2]))
                own = np.stack([moments.mean, moments.deviation], axis=1)
            found.append(own)
        return np.concatenate(found) if found else np.empty((0, 2))

    def _places(self, designs: np.ndarray, draws: Mapping[str, np.ndarray]) -> Iterator[np.ndarray]:
        """Model inputs of all draws, ``(k, s, d)``, of so many designs at a time as memory holds."""
        dims = range(len(self.model.names))
        size = max((array.shape[1] for array in draws.values()), default=1)
        step = max(MOST_PLACES // size, 1)
        for k in range(0, len(designs), step):
            own = {n: one[k : k + step] if len(one) > 1 else one for n, one in draws.items()}
            yield self._wiring.places(dims, designs[k : k + step], own)

    def _closed(self, leaf: Kriging, design: np.ndarray) -> tuple[float, float]:
        wiring = self._wiring
        weights = leaf.scale * leaf.signal_variance * leaf.alpha
        lengths = leaf.length_scales * (leaf.upper - leaf.lower)
        single, double = np.ones(weights.size), np.ones((weights.size, weights.size))
        for dim, name in enumerate(leaf.names):
            length, about = lengths[dim], leaf.inputs[:, dim]
            if name in wiring.random:
                one = wiring.random[name]
                if one.about_design:
                    about = about - design[wiring.column[name]]
                single *= kernel_integral(one.law, about, length)
                apart = np.exp(-0.25 * ((about[:, None] - about) / length) ** 2)
                middle = 0.5 * (about[:, None] + about)
                double *= apart * kernel_integral(one.law, middle, length / sqrt(2))
            else:
                row = np.exp(-0.5 * ((design[wiring.column[name]] - about) / length) ** 2)
                single *= row
                double *= row[:, None] * row
        mean = float(weights @ single)
        return leaf.mean + mean, sqrt(max(float(weights @ double @ weights) - mean**2, 0.0))

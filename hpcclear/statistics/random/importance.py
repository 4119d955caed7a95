"""Probabilities of rare failures by adaptive importance sampling, with confidence intervals from independent repeats.

Inputs are independent standard normals u. A pilot moves a mixture of normal densities, by a few levels of f, to where f exceeds
the limit (cross-entropy method); failures may lie in several places. Then values are drawn from a mixture of it, of a wide
density and of the inputs' own one, and weighted by the ratio of densities, so that the mean of the weights of those beyond the
limit is the probability without bias, however rough f is. The share of the inputs' own density bounds the weights, and finds
regions that the pilot missed. What the repeats disagree by is the error.

Where (nearly) no value lies beyond the limit, what is known of the largest lower level that enough values exceed is an upper
limit for it. Where f is so rough that the levels of a pilot rise no further and weighted draws are worth hardly more than
plain ones, draws are plain, and are counted with all earlier ones of the design (Clopper and Pearson).

Sources: R. Y. Rubinstein and D. P. Kroese, "The Cross-Entropy Method" (2004), doi:10.1007/978-1-4757-4321-0; of
mixtures that bound weights T. Hesterberg, "Weighted average importance sampling and defensive mixture distributions",
Technometrics 37 (1995), doi:10.1080/00401706.1995.10484303; A. Owen and Y. Zhou, "Safe and effective importance sampling",
J. Amer. Stat. Assoc. 95 (2000), doi:10.1080/01621459.2000.10473909.
"""

from collections.abc import Generator, Sequence
from dataclasses import dataclass, field

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.student import student
from hpcclear.statistics.random.replicates import Limited, spread
from hpcclear.statistics.random.survival import share_interval

REPEATS = 16
"""Independent repeats, whose disagreement is the error."""

LEVELS, PILOT, ELITE = 8, 1024, 0.1
"""Levels of a pilot at most, its draws at each, and the share of them that the next density is fitted to."""

PARTS, STEPS = 4, 20
"""Normal densities of a mixture, and steps of its fit."""

WIDE = 2.0
"""Standard deviations of the wide density, and of a pilot's first."""

OWN, SPREAD = 0.1, 0.2
"""Shares of the draws from the inputs' own density and from the wide one; the others come from the fitted one."""

CLIPPED = 5.0
"""Largest weight in a fit, over their mean: one draw makes no density."""

PRIOR = 0.3
"""Variance that the covariances of a fit are drawn to, as by so many draws as there are inputs."""

ANEW = 2
"""How often draws may be dropped because the pilot had missed where most failures are."""

WIDER = 1.4
"""Of intervals: what repeats share, the density of one pilot, they do not disagree about. Of functions whose failures lie in
separate regions intervals of 95 % held 87 to 88 % of the time without it, as 1.96/1.53 of the width would mend."""

PAIRED = 16
"""Draws of each repeat that are taken again at a stricter tolerance of the integration."""

MOST = 100.0
"""Largest factor that this widens an interval by: nothing is known where no failure is left at the stricter one."""

ENOUGH = 20.0
"""Equally weighted draws that those beyond a level are worth, at least, for an interval of its probability."""

WORTH, FEW = (2.0, 6.0), 8
"""Plain draws that a weighted one is worth, at least, or plain ones are drawn: by failures, and by the last level where a pilot
meets none. By a lower level a bound of p takes `ENOUGH` draws of about p / 2; by plain draws without any failure 4 to 6 over p.
`FEW` failures show it."""


class Density:
    """A mixture of the inputs' own density, a wide one and fitted ones; of their own one alone if none is fitted.

    `shares` (k,): of the fitted ones, of sum 1, with `centres` (k, d) and `covariances` (k, d, d).
    """

    def __init__(self, shares: Array, centres: Array, covariances: Array) -> None:
        size, self.plain = centres.shape[1], not len(shares)
        own = np.zeros((2, size)), np.stack([np.eye(size), WIDE**2 * np.eye(size)])
        first = [1.0, 0.0] if self.plain else [OWN, SPREAD]
        self._shares = np.concatenate([first, (1.0 - sum(first)) * shares])
        self._centres = np.concatenate([own[0], centres])
        self._factors = np.linalg.cholesky(np.concatenate([own[1], covariances]))

    @classmethod
    def own(cls, dimensions: int) -> "Density":
        """That of the inputs alone."""
        none = [np.empty((0,) + (dimensions,) * k) for k in range(3)]
        return cls(*none)

    def draw(self, count: int, rng: np.random.Generator) -> Array:
        """So many draws, (count, d)."""
        u = rng.standard_normal((count, self._centres.shape[1]))
        ends = np.cumsum(self._shares)
        kind = np.searchsorted(ends[:-1], rng.random(count), side="right")
        return np.asarray(self._centres[kind] + np.einsum("nij,nj->ni", self._factors[kind], u))

    def weights(self, u: Array) -> Array:
        """Density of the inputs over this one, (n,), at most 1 / `OWN`."""
        own = _logs(u, self._centres[:1], self._factors[:1])
        logs = _logs(u, self._centres, self._factors) - own
        return np.asarray(1.0 / (np.exp(np.minimum(logs, 700.0)) @ self._shares))


def _logs(u: Array, centres: Array, factors: Array) -> Array:
    """Logarithms of normal densities at u, (n, k), up to a constant."""
    found = np.empty((len(u), len(centres)))
    for k, (centre, factor) in enumerate(zip(centres, factors, strict=True)):
        steps = np.linalg.solve(factor, (u - centre).T)
        found[:, k] = -0.5 * (steps**2).sum(axis=0) - np.log(np.diag(factor)).sum()
    return found


def fitted(u: Array, weights: Array) -> Density:
    """The density that fits weighted draws, (n, d) and (n,), by expectation and maximisation."""
    share = np.minimum(weights, CLIPPED * weights.mean())
    share = share / share.sum()
    whole = _covariance(u, share, share @ u)
    rows = [int(share.argmax())]
    scaled = np.linalg.solve(np.linalg.cholesky(whole), u.T).T
    while len(rows) < min(PARTS, len(u)):  # the farthest ones, as far as they are worth something
        away = np.linalg.norm(scaled[:, None] - scaled[rows], axis=2).min(axis=1)
        rows.append(int((away * np.sqrt(share)).argmax()))
    centres, count = u[rows], len(rows)
    covariances = np.tile(whole, (count, 1, 1))
    parts = np.full(count, 1.0 / count)
    for _ in range(STEPS):
        factors = np.asarray(np.linalg.cholesky(covariances), float)
        logs = _logs(u, centres, factors) + np.log(parts)
        belongs = np.exp(logs - logs.max(axis=1, keepdims=True))
        belongs *= (share / belongs.sum(axis=1))[:, None]
        parts = (belongs.sum(axis=0) + 0.02) / (1.0 + 0.02 * count)
        centres = (belongs.T @ u + 1e-6 * centres) / (belongs.sum(axis=0)[:, None] + 1e-6)
        each = zip(belongs.T, centres, strict=True)
        covariances = np.array([_covariance(u, *one) for one in each])
    return Density(parts, centres, covariances)


def _covariance(u: Array, share: Array, centre: Array) -> Array:
    """Covariance of weighted draws; as few of them are worth little, drawn to `PRIOR`."""
    size, total = u.shape[1], share.sum()
    if total <= 0.0:
        return PRIOR * np.eye(size)
    worth = total**2 / (share**2).sum()
    steps = u - centre
    own = (steps.T * (share / total)) @ steps
    return np.asarray((worth * own + size * PRIOR * np.eye(size)) / (worth + size))


def pilot(
    dimensions: int, limit: float, rng: np.random.Generator, negligible: float = 0.0, draws: int = PILOT
) -> Generator[Array, Array, Density]:  # fmt: skip
    """Yield draws u, (n, d), take f there, (n,), NaN where it failed, and return a density near where f exceeds the limit, or
    a lower level whose probability is `negligible` already; the inputs' own one where neither is reached and that is about as
    good."""
    density = Density(np.ones(1), np.zeros((1, dimensions)), WIDE**2 * np.eye(dimensions)[None])
    reached, last = -np.inf, False
    for _ in range(LEVELS):
        u = density.draw(draws, rng)
        f = yield u
        known = np.isfinite(f)
        if known.sum() < 4 * dimensions:
            break
        level = min(float(np.quantile(f[known], 1.0 - ELITE)), limit)
        elite = known & (f >= level)
        weights = density.weights(u[elite])
        density = fitted(u[elite], weights)
        if last or weights.sum() / known.sum() < negligible:
            break
        if level <= reached:
            little = _little(weights, weights[f[elite] > limit])
            return Density.own(dimensions) if little else density
        reached, last = level, level >= limit  # once more at the limit
    return density


def _little(weights: Array, failing: Array) -> bool:
    """Whether weighted draws are worth hardly more than plain ones, by weights of those beyond a level and of failures."""
    if 0 < len(failing) < FEW:
        return False
    least, weights = (WORTH[0], failing) if len(failing) else (WORTH[1], weights)
    return bool(weights.sum() < least * (weights**2).sum())


@dataclass
class Rare:
    """A probability of exceeding a limit in the making.

    `negligible`: a probability below which its upper limit is enough; `before`: failures of earlier plain draws, and their
    number, which count with plain ones; `f`, `weights` (REPEATS, n): all draws of the repeats so far.
    """

    dimensions: int
    limit: float
    negligible: float = 0.0
    before: tuple[int, int] = 0, 0
    density: Density | None = None
    f: Array = field(default_factory=lambda: np.empty((REPEATS, 0)))
    weights: Array = field(default_factory=lambda: np.empty((REPEATS, 0)))
    simulations: int = 0
    factor: float = 1.0
    """What the tolerance of f may change the probability by, part of all intervals."""
    _first: Array = field(default_factory=lambda: np.empty((0, 0)))
    _failing: list[tuple[Array, Array]] = field(default_factory=list)
    _anew: int = 0

    def prepared(self, rng: np.random.Generator) -> Generator[Array, Array, None]:
        """Yield the draws of the pilot, and take f there."""
        going = pilot(self.dimensions, self.limit, rng, self.negligible)
        u = next(going)
        while self.density is None:
            f = yield u
            self.simulations += len(f)
            try:
                u = going.send(f)
            except StopIteration as end:
                self.density = end.value

    def lengthened(
        self, length: int, rngs: Sequence[np.random.Generator]
    ) -> Generator[Array, Array, None]:
        """Yield `length` draws more of each repeat, and take f there."""
        draws = [self.drawn_from.draw(length, rng) for rng in rngs]
        f = yield np.concatenate(draws)
        self.simulations += len(f)
        weights = np.array([self.drawn_from.weights(u) for u in draws])
        if not self.f.size:
            self._first = np.concatenate([u[:PAIRED] for u in draws])
        self.f = np.concatenate([self.f, f.reshape(REPEATS, length)], axis=1)
        self.weights = np.concatenate([self.weights, weights], axis=1)
        beyond = f > self.limit
        self._failing.append((np.concatenate(draws)[beyond], weights.ravel()[beyond]))

    def begun_anew(self) -> bool:
        """Drop draws of which a few are worth nearly all, for a density that is fitted to them, too; whether that was done."""
        u, weights = (np.concatenate(part) for part in zip(*self._failing, strict=True))
        if self._anew == ANEW or len(u) < self.dimensions or self.known or self.plain:
            return False
        self._anew += 1
        self.density = fitted(u, weights)
        self.f = self.weights = np.empty((REPEATS, 0))
        return True

    def paired(self, left: float) -> Generator[Array, Array, None]:
        """Yield the first draws of each repeat, take f of a stricter tolerance there, which leaves a share of the bias."""
        theirs = (yield self._first).reshape(REPEATS, -1)
        count = theirs.shape[1]
        self.simulations += theirs.size
        ours, weights = self.f[:, :count], self.weights[:, :count]
        both = np.isfinite(ours) & np.isfinite(theirs)
        beyond = (np.where(both & (f > self.limit), weights, 0.0) for f in (ours, theirs))
        each = [one.mean(axis=1) for one in beyond]
        apart, least = each[0] - each[1], min(one.mean() for one in each)
        error = float(spread((apart - apart.mean())[None])[0])
        # a bias that chance may have made counts for nothing
        bias = np.sqrt(max(apart.mean() ** 2 - error**2, 0.0)) / (1.0 - left)
        self.factor = float(min(1.0 + bias / least, MOST)) if least > 0.0 else MOST

    @property
    def drawn_from(self) -> Density:
        """What is drawn from, once that is known."""
        assert self.density is not None  # after the pilot
        return self.density

    @property
    def plain(self) -> bool:
        """Whether draws are those of the inputs' own density."""
        return self.density is not None and self.density.plain

    @property
    def draws(self) -> int:
        """Draws behind the probability: of all repeats, and the earlier ones that count."""
        if self.plain:
            return self.before[1] + int(np.isfinite(self.f).sum())
        return self.f.size

    @property
    def known(self) -> bool:
        """Whether those beyond the limit are worth enough draws."""
        return _worth(self.f, self.weights, self.limit) >= ENOUGH

    def interval(self, confidence: float) -> Limited:
        """The probability with confidence intervals, at a two-sided confidence."""
        one = weighted(self.f, self.weights, self.limit, confidence)
        if self.plain:
            hits = self.before[0] + int((self.f > self.limit).sum())
            ends = share_interval(hits, self.draws, confidence)
            one = Limited(hits / self.draws, one.shifts, *map(float, ends))
        if self.plain or self.known:
            upper = min(self.factor * one.upper, 1.0)
            return Limited(one.value, one.shifts, one.lower / self.factor, upper)
        known = np.sort(self.f[np.isfinite(self.f)])[::-1]
        for level in known[known < self.limit][:: max(len(known) // 64, 1)]:
            if _worth(self.f, self.weights, float(level)) >= ENOUGH:
                upper = weighted(self.f, self.weights, float(level), confidence).upper
                return Limited(one.value, one.shifts, 0.0, upper)
        return Limited(one.value, one.shifts, 0.0, 1.0)

    def taken(self, most: float) -> float:
        """How far the tolerance alone may move the probability towards one."""
        value = weighted(self.f, self.weights, self.limit, 0.95).value
        off = value * (self.factor - 1.0 if value <= most else 1.0 - 1.0 / self.factor)
        return off if self.known else 0.0


def _worth(f: Array, weights: Array, level: float) -> float:
    """Equally weighted draws that those beyond a level are worth."""
    beyond = np.where(f > level, weights, 0.0)
    return float(beyond.sum() ** 2 / max((beyond**2).sum(), 1e-300))


def weighted(f: Array, weights: Array, level: float, confidence: float) -> Limited:
    """The probability of exceeding a level from weighted draws, (repeats, n): mean of the repeats, interval symmetric in its
    logarithm."""
    known = np.isfinite(f)
    counts = known.sum(axis=1)
    nothing = np.full(len(f), np.nan)
    if (counts > 0).sum() < 2:
        return Limited(np.nan, nothing, np.nan, np.nan)
    with np.errstate(invalid="ignore", divide="ignore"):
        each = np.where(known & (f > level), weights, 0.0).sum(axis=1) / counts
    value = float(np.nanmean(each))
    shifts = each - value
    if value <= 0.0:
        return Limited(0.0, shifts, 0.0, 1.0)
    error = float(spread(shifts[None])[0])
    reach = error / value * WIDER * student(confidence, int((counts > 0).sum()) - 1)
    factor = float(np.exp(min(reach, 500.0)))
    return Limited(value, shifts, value / factor, min(value * factor, 1.0))

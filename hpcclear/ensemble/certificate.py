"""Which effects a scene can do without: what is requested, and what follows from the answers.

An effect screening is a generator. It yields the variants it wants simulated, a variant being the effects that are off, over
so many replicates of the points; it is sent what came of them, and returns what it found. It knows no scene: effects are
numbers.

Singly at first: replicates double until each effect's change is significantly within the tolerance, significantly beyond it,
or undecided. What is within it singly is then left out together; where that fails, pairs show which effects are more
together than alone. What is recommended has been simulated: the most effects whose own change together is within the
tolerance.

What an effect saves depends on the others: a film saves nothing while another one calls for implicit steps. So where leaving
out all rids the scene of these, what is more expensive by itself goes with the others first.
"""

import itertools
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array, Booleans, Integers
from hpcclear.base.verdict import Verdict, together
from hpcclear.statistics.random import paired
from hpcclear.statistics.random.paired import Change

Variant = tuple[int, ...]
"""Effects that are off, ascending; () is the whole scene."""

FIRST = 16
"""Replicates that are looked at first."""

MOST_PAIRS = 10
"""Pairs that are simulated at most, when all together have failed."""

MORE_WORK = 1.02
"""Work above which a scene is more expensive without an effect, which then stays on: contacts without damping bounce on,
say."""

LEAST_WORK = 1e-3
"""What work counts as at least: a mechanism without clearance is known in closed form and takes none."""

MUCH_LESS = 0.9
"""Work of a set over that of another below which it is cheaper: work is not known better. Of sets alike the one with more
effects is recommended, then the one whose effects come first: an effect stands before what it has beyond a model."""

SINGLY = 0.6
"""Of the budget that single effects may take; the rest is for sets."""


class VariantRequest(NamedTuple):
    """A variant over replicates `first` to `last`."""

    off: Variant
    first: int
    last: int


class VariantResult(NamedTuple):
    """What came of it: objective (r, s); peak contact force (r, s, joints) by the whole scene's joints, NaN where there is
    none; evaluations (r, s), and their work (r, s), which goes by the size of the motion and the kind of step as well."""

    objective: Array
    force: Array
    evaluations: Integers
    work: Array


@dataclass(frozen=True)
class Screening:
    """What is required of an effect screening."""

    effects: int
    tolerance: float
    """Relative change that is allowed."""
    confidence: float
    """Confidence level of each change."""
    most: int
    """Replicates of a variant at most."""
    scattered: bool
    """Whether replicates have scatter in them, so that the standard deviation counts."""
    forces: bool
    """Whether peak forces count."""
    possible: Callable[[Variant], bool]
    """Whether such effects can be off together."""
    implicit: Callable[[Variant], bool]
    """Whether a variant calls for implicit steps, which cost far more."""
    budget: float = np.inf
    """Replicates of the whole scene that all may come to, by work; first looks are always taken."""

    @property
    def counted(self) -> Booleans:
        """Whether mean, standard deviation and peak force count."""
        return np.array([True, self.scattered, self.forces])


class Changes(NamedTuple):
    """Of one variant: changes of mean and standard deviation of the objective and of the peak force, and of single points."""

    mean: Change
    deviation: Change
    force: Change
    point: float


@dataclass(frozen=True)
class Certificate:
    """What was found."""

    variants: tuple[Variant, ...]
    """All that were simulated, the whole scene first, in the order of asking."""
    recommended: Variant
    """Effects to leave out; () if none."""
    book: "Book"


class Book:
    """What is known of each variant."""

    def __init__(self, plan: Screening) -> None:
        self.plan = plan
        self.seen: dict[Variant, list[VariantResult]] = {}

    def replicates(self, off: Variant) -> int:
        """Replicates that were simulated."""
        return sum(len(one.objective) for one in self.seen.get(off, ()))

    def all(self, off: Variant) -> VariantResult:
        """All that was seen of a variant."""
        return VariantResult(*map(np.concatenate, zip(*self.seen[off], strict=True)))

    def changes(self, off: Variant) -> Changes:
        """By how much a variant differs from the whole scene, over the replicates of both."""
        here, whole, level = self.all(off), self.all(()), self.plan.confidence
        both = whole.objective[: len(here.objective)], here.objective
        return Changes(
            paired.mean_change(*both, level),
            paired.deviation_change(*both, level) if self.plan.scattered else paired.UNKNOWN,
            paired.mean_change(*_largest(whole.force[: len(here.force)], here.force), level),
            paired.point_change(*both),
        )

    def verdict(self, off: Variant) -> Verdict:
        """Whether the changes that count are within the tolerance."""
        counted = itertools.compress(self.changes(off)[:3], self.plan.counted)
        return together([one.verdict(self.plan.tolerance) for one in counted])

    def work(self, off: Variant) -> float:
        """Mean work of a sample, over that of the whole scene."""
        return float(self.all(off).work.mean()) / (float(self.all(()).work.mean()) or 1.0)

    def spent(self) -> float:
        """Replicates of the whole scene that all so far come to, by work."""
        return sum(self.replicates(one) * self.work(one) for one in self.seen)


def _largest(on: Array, off: Array) -> tuple[Array, Array]:
    """Largest force at each point (r, s) over the joints that have one in both."""
    shared = np.isfinite(on).any(axis=(0, 1)) & np.isfinite(off).any(axis=(0, 1))
    if not shared.any():
        return np.full(on.shape[:2], np.nan), np.full(off.shape[:2], np.nan)
    return on[..., shared].max(axis=2), off[..., shared].max(axis=2)


Asking = Generator[list[VariantRequest], list[VariantResult], Certificate]
Part = Generator[list[VariantRequest], list[VariantResult], None]


def certificate(plan: Screening) -> Asking:
    """The procedure; see the module."""
    book = Book(plan)
    singles = [(k,) for k in range(plan.effects) if plan.possible((k,))]
    yield from _judge(book, [()], plan.budget)
    yield from _judge(book, singles, SINGLY * plan.budget)
    good = [one for one in singles if book.verdict(one) is Verdict.HOLDS]
    yield from _together(book, [one[0] for one in good])
    return Certificate(tuple(book.seen), _recommended(book), book)


def _judge(book: Book, variants: Sequence[Variant], budget: float) -> Part:
    """Simulate variants, more and more replicates of those that are undecided, as far as a budget goes."""
    count = min(FIRST, book.plan.most)
    pending = [one for one in variants if book.replicates(one) < count]
    while pending:
        names = dict.fromkeys([(), *pending])
        every = (VariantRequest(one, book.replicates(one), count) for one in names)
        asked = [one for one in every if one.first < count]
        for one, seen in zip(asked, (yield asked), strict=True):
            book.seen.setdefault(one.off, []).append(seen)
        # where too many have failed more decide nothing
        known = [one for one in pending if one and np.isfinite(book.changes(one).mean.value)]
        pending = [one for one in known if book.verdict(one) is Verdict.UNDECIDED]
        if count >= book.plan.most:
            return
        count = min(2 * count, book.plan.most)
        pending = _afforded(book, pending, count, budget)


def _afforded(book: Book, pending: list[Variant], count: int, budget: float) -> list[Variant]:
    """Those whose replicates may come to so many within a budget; what saves least is given up first."""
    kept = sorted(pending, key=lambda one: (book.work(one), one))
    left = budget - book.spent()
    while kept:
        more = [(count - book.replicates(one)) * book.work(one) for one in [(), *kept]]
        if sum(more) <= left:
            break
        kept.pop()
    return [one for one in pending if one in kept]


def _together(book: Book, good: list[int]) -> Part:
    """Leave out all at once what is within the tolerance singly, pairs where that fails; then all but what pairs refuse."""
    plan = book.plan
    cheap = [k for k in good if book.work((k,)) <= MORE_WORK]
    explicit = plan.implicit(()) and not plan.implicit(_set(book, good))
    for effects in [good, cheap] if explicit else [cheap]:  # what is stiff saves nothing alone
        chosen = _set(book, effects)
        yield from _judge(book, [chosen], plan.budget)
        if len(chosen) < 3 or book.verdict(chosen) is Verdict.HOLDS or book.spent() > plan.budget:
            continue
        pairs = [p for p in itertools.combinations(chosen, 2) if plan.possible(p)]
        yield from _judge(book, pairs[:MOST_PAIRS], plan.budget)
        yield from _judge(book, [_set(book, effects)], plan.budget)


def _set(book: Book, effects: list[int]) -> Variant:
    """Effects that can be off together and whose changes, as far as they are known, stay within the tolerance: those that save
    the most first, and of those alike the first."""

    def saving(k: int) -> tuple[int, int]:
        work = max(book.work((k,)), LEAST_WORK)
        return round(float(np.log(work) / -np.log(MUCH_LESS))), k

    chosen: Variant = ()
    for k in sorted(effects, key=saving):
        more = tuple(sorted((*chosen, k)))
        if book.plan.possible(more) and _may_pass(book, more):
            chosen = more
    return chosen


def _may_pass(book: Book, chosen: Variant) -> bool:
    """Whether changes that add up, with what pairs are known to be more than that, stay within the tolerance."""
    total = sum((_values(book, (k,)) for k in chosen), np.zeros(3))
    for pair in itertools.combinations(chosen, 2):
        if pair in book.seen:
            total += _values(book, pair) - sum((_values(book, (k,)) for k in pair), np.zeros(3))
    return bool((np.abs(total[book.plan.counted]) <= book.plan.tolerance).all())


def _recommended(book: Book) -> Variant:
    """Of all that was simulated and passes the largest, unless another one is much cheaper; () where none does."""
    cheap = (one for one in book.seen if one and book.work(one) <= MORE_WORK)
    passed = [one for one in cheap if book.verdict(one) is Verdict.HOLDS]
    if not passed:
        return ()
    least = min(book.work(one) for one in passed)
    near = [one for one in passed if book.work(one) * MUCH_LESS <= least]
    return min(near, key=lambda one: (-len(one), one))


def _values(book: Book, off: Variant) -> Array:
    return np.array([one.value for one in book.changes(off)[:3]])

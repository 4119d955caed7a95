"""What the procedures of steady means share: a design, the segments of it that are requested, what was found.

Each procedure is a generator: it yields the `Segment` it wants simulated, is sent its `Outcome`, and returns a `Mean`. So
that thousands of designs share the lanes, and a design's numbers depend on nothing but the design.
"""

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.outcome import Regime, Status
from hpcclear.dynamics.evaluation.steady.copies import perturbed
from hpcclear.dynamics.layout.views import Outcome, Parameters, Start

STRICTER = 10.0  # how many times tighter than the others' the tolerances of half of the copies are
TIGHTEST = 1e-11  # looser of two tolerances, at least
SPEED = 2.0  # relative movement of f, at most, over that of a free crank's mean speed

STEADY = 0.8
"""Change of the average over a doubling of the revolutions, over that of the doubling before, that shows no settling."""


@dataclass(frozen=True)
class Sample:
    """A design: parameters (1, PARAMETERS), one start, scale of perturbations (2 n,), kinds of damping and drive."""

    par: Array
    start: Start
    scale: Array
    latched: bool
    free: bool  # crank: its speed is the last velocity

    def speeds(self, outcomes: "list[Outcome]") -> Array | None:
        """Of a free crank at the ends of segments, shape (segments, copies)."""
        if not self.free:
            return None
        n = len(self.scale) // 2
        return np.stack([outcome.velocities(n)[..., -1] for outcome in outcomes])


@dataclass(frozen=True)
class Segment:
    """Revolutions of some copies to simulate, the average over all of them.

    Parameters of a copy hold how many times stricter than `rtol` its own tolerance is.
    """

    rtol: float
    revolutions: int
    par: Array
    start: Start


@dataclass
class Mean:
    """What was found."""

    regime: Regime
    limit: float  # half-width of the confidence interval of f, m; NaN where there is no steady mean
    outcomes: Outcome  # what the average is made of, (segments, copies)
    segment: int  # revolutions of each of these
    rtol: float  # the looser of the two tolerances, the other one is `STRICTER` times tighter
    met: bool
    period: int | None = None
    growth: float = np.nan
    """Of a perturbation, per revolution: mean logarithm, as far as the look showed."""
    growth_limit: float = np.nan  # half-width of its confidence interval, if measured on purpose
    attractors: int | None = None  # kinds of motion from several starts, if they were looked for
    status: Status = Status.OK
    revolutions: int = 0  # all that were simulated, and their evaluations
    evaluations: float = 0.0

    @property
    def tightest(self) -> float:
        """The tightest tolerance among the copies."""
        return self.rtol / STRICTER if np.isnan(self.growth_limit) else self.rtol

    @property
    def gaps(self) -> Array:
        """Mean gaps, m, shape (2,)."""
        return self.outcomes.mean_gap.mean(axis=(0, 1))


@dataclass
class Effort:
    """What was simulated so far, and how a segment of it is requested."""

    sample: Sample
    budget: int
    revolutions: int = 0
    evaluations: float = 0.0
    failed: Status | None = None
    perturbations: int = 0

    def more_starts(self, count: int) -> Start:
        """Starts of so many copies, each with a perturbation that none had before."""
        numbers = range(self.perturbations, self.perturbations + count)
        self.perturbations += count
        return perturbed(self.sample.start, self.sample.scale, numbers)

    def run(
        self, rtol: float, revolutions: int, start: Start, strictness: Array
    ) -> Generator[Segment, Outcome, Outcome]:
        """A segment of each of these copies; how many times stricter each one's tolerance is, shape (copies,)."""
        par = np.repeat(self.sample.par, len(start), axis=0)
        Parameters(par).strictness = strictness**2  # squared, as the kernel keeps it
        outcome = yield Segment(rtol, revolutions, par, start)
        self.revolutions += revolutions * len(start)
        self.evaluations += float(outcome.evaluations.sum())
        bad = outcome.status[outcome.status != Status.OK]
        if len(bad):
            self.failed = Status(int(bad[0]))
        return outcome

    def mean(self, **found: object) -> Mean:
        """What was found, with what it took."""
        return Mean(**found, revolutions=self.revolutions, evaluations=self.evaluations)  # type: ignore[arg-type]

    def failure(self, outcome: Outcome, rtol: float) -> Mean:
        """Some copy did not reach its end."""
        assert self.failed is not None
        unknown = {"regime": Regime.UNJUDGED, "limit": np.nan, "met": False, "status": self.failed}
        return self.mean(**unknown, outcomes=outcome[None], segment=1, rtol=rtol)

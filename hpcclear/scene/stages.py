"""Settings of the study's stages.

Sizes and weights default to the values of the paper this program began with where it states
them; names never decide a default, only what a variable drives does.
"""

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

from pydantic import StrictBool

from hpcclear.base.errors import InputError
from hpcclear.plugins import SEARCHES, SURROGATES
from hpcclear.scene.fields import Count, Quantity, Table, invalid
from hpcclear.scene.plugged import PluginName

Names = tuple[str, ...]
Share = Annotated[float, Quantity("", above=0, below=1)]
Factor = Annotated[float, Quantity("", least=0, most=4)]
Accuracy = Annotated[float, Quantity("", most=1)]
Positive = Annotated[float, Quantity("", above=0)]


class Sensitivity(Table):
    """Response surfaces and first-order sensitivities (the paper's sections 4.2 and 5)."""

    groups: tuple[Names, ...] | None = None
    """Groups of inputs, each with a response surface. Default: masses, mass centres and inertias of each pair of joined
    links, if they are study variables; for a linkage the variables of each pair of bodies."""
    parameter: str | None = None
    """Study variable with a fixed value in each surface; default: the one that sets clearances, if there is only one."""
    levels: Annotated[int, Count(1, 1000)] = 8
    """Number of values of the parameter, evenly spaced over its range."""
    samples: Annotated[int, Count(1, 10**6)] = 45
    """Number of points to which a surface is fitted."""
    test_samples: Annotated[int, Count(2, 10**6)] = 5
    """Number of points on which it is tested."""
    order: Annotated[int, Count(1, 6)] = 3
    """Order of the polynomial."""
    terms: Literal["all", "chosen"] | None = None
    """Terms of each surface: "all" up to its order, or "chosen": all linear terms and those that cross-validation
    selects. Default: "all" if there are more points than terms, else "chosen"."""
    together_samples: Annotated[int, Count(1, 10**6)] = 150
    """Number of points for the surface in all inputs together."""
    together_order: Annotated[int, Count(1, 6)] = 2
    """Order of that surface."""
    r2: Accuracy = 0.9
    """Lowest acceptable R2 = 1 - SSE/SST on the test points. Below it more points are simulated."""
    rmae: Positive = 0.3
    """Largest acceptable error on the test points, divided by their standard deviation."""
    resamplings: Annotated[int, Count(0, 20)] = 3
    """Number of times the points are doubled before a surface is rejected."""
    shrink: Share = 0.3
    """Fraction by which each interval is shortened about its midpoint in a round of the convergence loop."""
    rounds: Annotated[int, Count(1, 50)] = 6
    """Number of intervals, including the global one."""
    influence: Share = 0.1
    """Inputs whose range times sensitivity is at least this fraction of the largest are selected (X_G-I in the paper)."""
    sobol_samples: Annotated[int, Count(0, 2**24)] = 2**10
    """Base samples of the Sobol indices, a power of two. Each requires as many simulations as there are variables, plus
    two. 0: no indices."""

    def chooses(self, inputs: int, order: int, samples: int) -> bool:
        """Whether a surface of that order on so many samples chooses its terms."""
        many = math.comb(inputs + order, order) >= samples
        return self.terms == "chosen" or (self.terms is None and many)

    def _check(self) -> None:
        if self.sobol_samples & (self.sobol_samples - 1):
            reason = "must be a power of two: other lengths unbalance the sequence"
            raise invalid(reason, "Write 4096, for example", "sobol_samples")


class Surrogate(Table):
    """Surrogates of the objective: Kriging models (the paper's section 4.2), or others in their place."""

    model: Annotated[str, PluginName(SURROGATES)] | None = None
    """Surrogate model; default "kriging". Also "module:Name" of a Python file beside the scene (an object with the
    `fit` and `predict` of scikit-learn), or the name that an installed package offers."""
    models: tuple[Names, ...] | None = None
    """Inputs of each model; default: each group of `sensitivity` with its parameter."""
    optimisation: Names | None = None
    """Inputs of the model that the swarm searches; default: all study variables."""
    r2: Accuracy = 0.99
    """Lowest acceptable R2 = 1 - SSE/SST on the test points."""
    rmae: Positive = 0.4
    """Largest acceptable error on the test points, divided by their standard deviation."""
    resamplings: Annotated[int, Count(0, 20)] | None = None
    """Number of times the points are doubled before an interval is halved; default as `cuts`."""
    cuts: Annotated[int, Count(0, 6)] | None = None
    """Number of times an interval may be halved if a model is rejected; default 1, but 0 for the model of the swarm
    where a search by simulation follows, which the swarm only begins."""
    restarts: Annotated[int, Count(0, 100)] = 2
    """Number of additional starts of the search for the maximum likelihood."""
    kernel: Literal["squared-exponential", "matern-5/2"] | None = None
    """Covariance function: "squared-exponential", the default, for smooth f; or "matern-5/2", twice differentiable, for f with
    kinks. With the latter the swarm averages over 256 points of a Sobol sequence."""


class CertificateOfEffects(Table):
    """Effect screening before the study: effects that can be neglected. The study itself uses all effects."""

    tolerance: Annotated[float, Quantity("", above=0, below=1)] = 0.01
    """Largest relative change of mean and standard deviation of f that counts as negligible."""
    samples: Annotated[int, Count(64, 10**9)] | None = None
    """Largest number of simulations of each variant; default: a twentieth of the study in total."""
    forces: StrictBool = False
    """Whether peak contact forces must stay within the tolerance, too."""


FEWEST = 8
"""Fewest designs at a time for an algorithm of pymoo; some never end with fewer."""


class Swarm(Table):
    """Multi-objective particle swarm (eqs. 22 and 23), or another search in its place."""

    algorithm: Annotated[str, PluginName(SEARCHES)] | None = None
    """Search algorithm; default "swarm". Also "pymoo:NSGA2" and others of pymoo with their own settings (`pip install
    pymoo`), "module:Name" of a Python file beside the scene, or the name of an installed plug-in. Each evaluates
    `particles` designs per iteration."""
    particles: Annotated[int, Count(2, 10**6)] = 100
    """Number of designs per iteration."""
    iterations: Annotated[int, Count(1, 10**6)] = 100
    """Number of iterations of a run."""
    runs: Annotated[int, Count(1, 10**4)] = 4
    """Number of independent runs of each case."""
    c1: Factor = 1.8
    """Coefficient of attraction to the particle's own best design."""
    c2: Factor = 1.8
    """Coefficient of attraction to a leader of the archive."""
    inertia: tuple[Factor, Factor] = (1.2, 0.1)
    """Inertia weight at the first and at the last iteration; linear in between."""
    archive: Annotated[int, Count(2, 10**5)] = 100
    """Largest number of solutions of a front."""

    def _check(self) -> None:
        if (self.algorithm or "").startswith("pymoo:") and self.particles < FEWEST:
            reason = f"{self.algorithm} recombines designs and needs at least {FEWEST} of them"
            raise invalid(reason, f"Request {FEWEST} or more", "particles")


class MomentAccuracy(Table):
    """Half-widths of confidence intervals, relative: of the recommended design in what its case requires, and of the best in
    each objective. Others are simulated as long as they may be better."""

    mean: Share = 0.002
    """Half-width of the mean, relative."""
    deviation: Share = 0.005
    """Half-width of the standard deviation, relative."""
    quantile: Share | None = None
    """Half-width of quantiles, relative, if a case has one; default: that of the standard deviation."""
    exceedance: Share | None = None
    """Half-width of exceedance probabilities, absolute, if a case has one; default 0.01."""


MOMENTS = ("mean", "deviation")


def of_both(entry: object) -> object:
    """The accuracy of mean and deviation, of one number for both; an error for validators where it is not between 0 and 1."""
    if entry is None:
        return None
    if not isinstance(entry, Mapping):
        try:
            return dict.fromkeys(MOMENTS, Quantity("", above=0, below=1).convert(entry))
        except InputError as error:
            remedy = 'Write 0.005 or "0.5 %", say, or { mean = 0.002, deviation = 0.005 }'
            raise invalid(error.reason, remedy, "accuracy", entry) from None
    given = [entry[name] for name in MOMENTS if name in entry]
    return dict.fromkeys(MOMENTS, given[0]) | dict(entry) if len(given) == 1 else entry


REPLICATES = 16
"""Independently randomised Sobol sequences of equal length: enough to estimate their scatter, few enough to be long."""


class Verification(Table):
    """Full simulation of the selected designs."""

    method: Literal["qmc", "monte-carlo"] | None = None
    """Sampling of the random inputs: "qmc", 16 randomised Sobol sequences, of the length that `study.accuracy` requires; or
    "monte-carlo", `samples` independent draws. Default "qmc", unless `samples` is given."""
    least_samples: Annotated[int, Count(REPLICATES * 4, 2**30)] | None = None
    """First number of simulations of a design, from which its accuracy is estimated, for "qmc"; default 512, at most
    `most_samples`."""
    most_samples: Annotated[int, Count(REPLICATES * 4, 2**30)] = 2**14
    """Largest number of simulations of a design, for "qmc"."""
    contest: Annotated[int, Count(1, 2**10)] = 4
    """Factor on the simulations of the best design, for "qmc". Designs that may still be optimal within their confidence
    interval are simulated with up to this factor, unless they are within 0.4 of the target of the lowest value."""
    samples: Annotated[int, Count(2, 10**9)] | None = None
    """Number of draws per design, for "monte-carlo"; default 10 000."""
    designs: Annotated[int, Count(0, 10**5)] = 10
    """Number of designs along each front, besides alpha, beta and the baseline design."""
    confidence: Share = 0.95
    """Level of the confidence intervals."""
    tolerance: Share = 0.02
    """Relative surrogate error of the mean of alpha and beta above which a warning is printed."""
    deviation_tolerance: Share = 0.05
    """Relative surrogate error of the standard deviation of alpha and beta above which a warning is printed."""
    infill_rounds: Annotated[int, Count(0, 100)] = 8
    """Rounds of the search by simulation, at most: further designs are simulated where they may change the front.
    0: only designs of the swarm are verified."""
    infill_designs: Annotated[int, Count(1, 10**4)] = 12
    """Number of designs of a case in each round."""
    infill_samples: Annotated[int, Count(REPLICATES * 2, 10**9)] = 512
    """Largest number of simulations of each of these designs in the search, by randomised Sobol sequences; at most
    `samples` if that is given. A design begins with 32; only contenders get more."""
    response_clearance: Annotated[float, Quantity("m", above=0)] | None = None
    """Clearance of all joints in the compared responses, m; default the clearances of scene and design."""
    response_revolutions: Annotated[int, Count(1, 1000)] = 2
    """Number of steady revolutions in each interval of these responses."""
    response_windows: Annotated[int, Count(2, 1000)] = 10
    """Number of intervals, to estimate the scatter of averages, fluctuations and peaks."""
    response_copies: Annotated[int, Count(2, 1000)] = 8
    """Replicas of each response with perturbed starts. If they differ, the motion is chaotic, and their scatter is the
    uncertainty of averages, fluctuations and peaks."""
    audit_samples: Annotated[int, Count(0, 10**6)] = 256
    """Largest number of simulations of each of the paper's designs under each interpretation of its text (at least 16);
    0: no comparison."""

    elsewhere: ClassVar = {"accuracy": ("stands in [study] already", "Remove one of them")}

    def _check(self) -> None:
        if self.method == "qmc" and self.samples is not None:
            remedy = 'Set study.accuracy or most_samples, or write method = "monte-carlo"'
            raise invalid("a Sobol sequence's size follows from the accuracy", remedy, "samples")
        if (self.least_samples or 0) > self.most_samples:
            raise invalid("is more than most_samples", "Lower it, or raise that", "least_samples")

    @property
    def draws(self) -> int | None:
        """Independent draws of a design; None for randomised Sobol sequences."""
        if self.method in (None, "qmc") and self.samples is None:
            return None
        return self.samples or 10_000

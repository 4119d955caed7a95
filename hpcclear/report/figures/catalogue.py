"""Every figure by the name that `hpcclear plot` gives it, with the caption that it has on the page."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

from hpcclear.base.errors import InputError
from hpcclear.report.figures import (
    accuracy,
    curves,
    designs,
    effects,
    guides,
    identified,
    maps,
    motion,
    noise,
    portraits,
    response,
    samples,
    surrogates,
    timing,
    wear,
)
from hpcclear.results.content import Results

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CROSSINGS = 200
"""Fewest points of a Poincaré section: with fewer, a cloud and a long period look alike."""


class Entry(NamedTuple):
    """A figure of one file."""

    name: str
    kind: str
    """Of the file."""
    draw: "Callable[[Results], Figure]"
    caption: str
    along: str = "time"
    """A dimension that the file must have; any file of a response has instants."""


def section_figure(found: Results) -> "Figure":
    """Return the Poincaré section of a response over its averaged revolutions; raises InputError of fewer than `CROSSINGS`."""
    count = motion.whole_turns(found) - int(found.attrs.get("transient_turns", 0))
    if count < CROSSINGS:
        reason = f"a Poincaré section takes at least {CROSSINGS} revolutions"
        remedy = f"Simulate with --set numerics.averaged_revolutions={CROSSINGS}"
        raise InputError("revolutions", count, reason, remedy)
    return portraits.poincare_figure(found, revolutions=count)


RESULTS: tuple[Entry, ...] = (
    Entry(
        "samples",
        "samples",
        samples.samples_figure,
        "Objective against each design variable, its cycle-to-cycle standard deviation and histogram.",
    ),
    Entry(
        "map",
        "map",
        maps.map_figure,
        "Largest Lyapunov exponent, period and regime of each cell of the map; along a line also f with its 95 % CI.",
    ),
    Entry(
        "bifurcation",
        "bifurcation",
        maps.bifurcation_figure,
        "One value for each revolution against the varied entry: n dots where the motion repeats every n revolutions.",
    ),
    Entry(
        "sensitivities",
        "sensitivity",
        surrogates.sensitivity_figure,
        "First-order sensitivities against clearance, with two standard errors. Lines: from the full ranges. Marks: "
        "from the ranges at which they converged.",
    ),
    Entry(
        "sobol",
        "sensitivity",
        surrogates.sobol_figure,
        "Global sensitivities with two standard errors: first-order Sobol indices (each variable alone) and total "
        "indices (with interactions; their sum may exceed 1).",
    ),
    Entry(
        "surface-fit",
        "sensitivity",
        surrogates.fit_figure,
        "Fit of the response surfaces on test points, against clearance and length of the ranges.",
    ),
    Entry(
        "surrogates",
        "kriging",
        surrogates.surfaces_figure,
        "Objective by Kriging over pairs of design variables, at the smallest and the largest clearance.",
    ),
    Entry(
        "parity",
        "kriging",
        surrogates.parity_figure,
        "Surrogate against simulation: leave-one-out predictions; R² on test points.",
    ),
    Entry(
        "wear",
        "wear",
        wear.fan_figure,
        "Clearance and objective over the service life: median, 50 % and 90 % bands; individual runs in grey.",
    ),
    Entry(
        "survival",
        "wear",
        wear.survival_figure,
        "Survival, with 95 % confidence interval (Clopper and Pearson).",
    ),
    Entry(
        "wear-profile",
        "wear",
        wear.profile_figure,
        "Depth of wear around bearings and journals, at several ages (medians over all runs).",
    ),
    Entry(
        "posterior",
        "identify",
        identified.posterior_figure,
        "Posterior of each unknown with its calibrated 95 % interval.",
    ),
    Entry(
        "features",
        "identify",
        identified.features_figure,
        "Measured less predicted features of the last record, in standard deviations of the prediction.",
    ),
    Entry(
        "growth",
        "identify",
        identified.growth_figure,
        "Unknowns over the dates of the records, with 95 % intervals and the median rate.",
    ),
    Entry("timing", "timing", timing.timing_figure, "Time of the ranks, by rank and by stage."),
)
"""Of files other than responses."""

RESPONSE: tuple[Entry, ...] = (
    Entry(
        "orbit", "response", portraits.orbit_figure, "journal-centre orbits in the clearance circle"
    ),
    Entry(
        "force-direction",
        "response",
        portraits.force_polar_figure,
        "contact force by its direction",
    ),
    Entry("penetration", "response", response.penetration_figure, "penetration"),
    Entry("guide", "response", guides.guide_figure, "offset, tilt and contacts in guides", "guide"),
    Entry("phase", "response", portraits.phase_figure, "phase portraits"),
    Entry("poincare", "response", section_figure, "Poincaré section, once a revolution"),
    Entry("spectrum", "response", response.spectrum_figure, "spectra"),
    Entry("noise", "response", noise.noise_figure, "force levels and orders", "band"),
    Entry("energy", "response", response.energy_figure, "energy balance"),
    Entry("tables", "response", curves.tables_figure, "tables of the scene, as they are simulated"),
)
"""Of a response, beside `response_figure`."""


def drawings(
    found: Mapping[str, Results], responses: Mapping[str, Results]
) -> "dict[str, Callable[[], Figure]]":
    """Return what draws each figure that results allow, by its name.

    Parameters
    ----------
    found : mapping of str to xarray.Dataset
        Files by their kinds, without responses.
    responses : mapping of str to xarray.Dataset
        By the names of designs; the figures of a single one are those of "original", else of the first.
    """
    made: dict[str, Callable[[], Figure]] = {
        one.name: partial(one.draw, found[one.kind]) for one in RESULTS if one.kind in found
    }
    if "effects" in found:
        made["effects"] = partial(effects.effects_figure, found["effects"], found.get("timing"))
    if "front" in found:
        made["front"] = partial(designs.front_figure, found["front"], found.get("verification"))
    for name, draw in accuracy.FIGURES.items() if "accuracy" in found else ():
        made[f"accuracy-{name.replace('_', '-')}"] = partial(draw, found["accuracy"])
    if len(responses) > 1:
        made["comparison"] = partial(designs.comparison_figure, responses)
    if responses:
        one = responses.get("original", next(iter(responses.values())))
        made["response"] = partial(response.response_figure, one)
        made |= {
            entry.name: partial(entry.draw, one) for entry in RESPONSE if entry.along in one.sizes
        }
    return made

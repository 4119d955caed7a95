"""Every figure that a directory of results allows, with its caption."""

import base64
import functools
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from hpcclear.base.errors import InputError
from hpcclear.base.objectives import ENDS
from hpcclear.report.figures import (
    designs,
    effects,
    fits,
    labels,
    motion,
    portraits,
    response,
    samples,
    style,
    surrogates,
    wear,
)
from hpcclear.report.html.content import Content
from hpcclear.report.html.guard import attempt

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Drawing = tuple[str, "Callable[[xr.Dataset], Figure]", str]

_RESULTS: tuple[Drawing, ...] = (
    (
        "samples",
        samples.samples_figure,
        "Objective against each design variable, its cycle-to-cycle standard deviation and histogram.",
    ),
    (
        "sensitivity",
        surrogates.sensitivity_figure,
        "Sensitivities against clearance: lines with bands over the whole interval, marks with bars where they "
        "stopped changing; two standard errors.",
    ),
    (
        "sensitivity",
        surrogates.sobol_figure,
        "Global sensitivities: first-order Sobol indices (a variable by itself) and total ones (with interactions, "
        "so that their sum may exceed 1), with two standard errors.",
    ),
    (
        "sensitivity",
        surrogates.fit_figure,
        "Fit of the response surfaces on test points, against clearance and length of the interval.",
    ),
    (
        "kriging",
        surrogates.surfaces_figure,
        "Objective over pairs of design variables at the least and the largest clearance, by Kriging.",
    ),
    (
        "kriging",
        surrogates.parity_figure,
        "Surrogate against simulation: each point predicted without itself; R² on test points.",
    ),
    (
        "wear",
        wear.fan_figure,
        "Clearance and objective over the service life: median, 50 % and 90 % bands; individual runs in grey.",
    ),
    (
        "wear",
        wear.survival_figure,
        "Survival, with 95 % confidence interval (Clopper and Pearson).",
    ),
    (
        "wear",
        wear.profile_figure,
        "Depth of wear around bearings and journals by the angle in their bodies, at several ages: medians over all runs.",
    ),
)
"""Kind of file, figure, caption."""

_FITS = (
    surrogates.sensitivity_figure,
    surrogates.fit_figure,
    surrogates.surfaces_figure,
    surrogates.parity_figure,
)
"""Figures of surrogates: the captions name those that do not fit."""

_RESPONSE = (
    (portraits.orbit_figure, "journal-centre orbits in the clearance circle"),
    (portraits.force_polar_figure, "contact force by its direction"),
    (response.penetration_figure, "penetration"),
    (portraits.phase_figure, "phase portraits"),
    (portraits.poincare_figure, "Poincaré section, once a revolution"),
    (response.spectrum_figure, "spectra"),
    (response.energy_figure, "energy balance"),
)


def figures(content: Content, troubles: list[str]) -> list[dict[str, str]] | None:
    """All figures: their pictures (PNG, base64) and captions; in `troubles`, why one was left out."""
    made = [attempt(f"The figure “{what}”", draw, troubles) for what, draw in _drawings(content)]
    return [figure for figure in made if figure is not None] or None


Maker = Callable[[], dict[str, str] | None]


def _drawings(content: Content) -> Iterator[tuple[str, Maker]]:
    """Every figure that there may be: what it shows, and what makes its picture and caption."""
    for kind, draw, caption in _RESULTS:
        caption += _warnings(kind, content.get(kind)) if draw in _FITS else ""
        yield from _of_file(draw, content.get(kind), caption)
    certificate, times = content.get("effects"), content.get("timing")
    if certificate is not None:
        told = "Change of f with each effect off, with confidence interval and tolerance, and the run time saved."
        yield told, lambda: _shown(effects.effects_figure(certificate, times), told)
    front = content.get("front")
    if front is not None:
        verified = content.get("verification")
        caption = (
            "Pareto fronts of all runs as predicted by the surrogate, and the simulated designs."
        )
        yield caption, lambda: _shown(designs.front_figure(front, verified), caption)
    found = content.responses
    for first in range(0, len(ENDS), 2):  # two columns a picture
        pair = ENDS[first : first + 2]
        shown = {name: r for name, r in found.items() if designs.end_of(name) in ("", *pair)}
        asked = first == 0 or any(designs.end_of(name) for name in shown)
        if asked and len(shown) > 1:
            yield "responses of the designs", functools.partial(_comparison, shown)
    if found:
        name = "original" if "original" in found else next(iter(found))
        if len(found) == 1:
            yield f"{name}: response", lambda: _response_alone(name, found[name])
        for draw, what in _RESPONSE:
            yield from _of_file(draw, found[name], f"{name}: {what}.")


def _comparison(found: Mapping[str, xr.Dataset]) -> dict[str, str]:
    caption = f"Responses of the designs, two revolutions{_plays(*found.values())}."
    return _shown(designs.comparison_figure(found), caption)


def _response_alone(name: str, found: xr.Dataset) -> dict[str, str]:
    caption = f"{name}: response, two revolutions{_plays(found)}."
    return _shown(response.response_figure(found), caption)


def _shown(figure: "Figure", caption: str) -> dict[str, str]:
    """A picture with its caption, for the template."""
    picture = base64.b64encode(style.render(figure, dpi=220)).decode("ascii")
    return {"png": picture, "caption": caption}


def _of_file(
    draw: "Callable[[xr.Dataset], Figure]", found: xr.Dataset | None, caption: str
) -> Iterator[tuple[str, Maker]]:
    """A figure of one file, unless that is missing."""
    if found is not None:
        yield caption, functools.partial(picture, draw, found, caption)


def _warnings(kind: str, content: xr.Dataset | None) -> str:
    """Which surrogates do not fit, behind a caption."""
    found = fits.warnings(kind, content)
    return f" Warning: {'; '.join(found)}." if found else ""


def _plays(*responses: xr.Dataset) -> str:
    """At which clearances these were simulated, where that is the same for all."""
    told = []
    for joint, name in enumerate(motion.joints(responses[0]).values()):
        known = [motion.clearances(one)[joint] for one in responses]
        shown = {labels.quantity(float(c), "m") for c in known if np.isfinite(c)}
        if len(shown) == 1:
            told.append(f"{shown.pop()} in {name}")
    return f", at radial clearances of {' and '.join(told)}" if told else ""


def picture(
    draw: "Callable[[xr.Dataset], Figure]", found: xr.Dataset, caption: str
) -> dict[str, str] | None:
    """Draw a figure of one file with its caption; None if the file has not what it needs (no Sobol indices, say)."""
    try:
        made = draw(found)
    except InputError as error:
        if error.key == "matplotlib":
            raise
        return None
    return _shown(made, caption)

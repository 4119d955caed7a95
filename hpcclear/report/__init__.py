"""Figures, each a function of a dataset, and the HTML page.

A figure is loaded when it is first used: a command that prints a few numbers of a response needs none. Figures need matplotlib
(the extra ``analysis``), which is imported when the first one is drawn.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hpcclear.report.figures.compared import overlay_figure
    from hpcclear.report.figures.designs import comparison_figure, front_figure
    from hpcclear.report.figures.effects import effects_figure
    from hpcclear.report.figures.identified import (
        features_figure,
        growth_figure,
        posterior_figure,
    )
    from hpcclear.report.figures.maps import bifurcation_figure, map_figure
    from hpcclear.report.figures.portraits import (
        force_polar_figure,
        orbit_figure,
        phase_figure,
        poincare_figure,
    )
    from hpcclear.report.figures.response import (
        energy_figure,
        penetration_figure,
        response_figure,
        spectrum_figure,
    )
    from hpcclear.report.figures.samples import samples_figure
    from hpcclear.report.figures.sketch import sketch_figure
    from hpcclear.report.figures.style import save
    from hpcclear.report.figures.surrogates import (
        fit_figure,
        parity_figure,
        sensitivity_figure,
        sobol_figure,
        surfaces_figure,
    )
    from hpcclear.report.figures.timing import timing_figure
    from hpcclear.report.figures.wear import fan_figure, profile_figure, survival_figure

__all__ = [
    "bifurcation_figure",
    "comparison_figure",
    "effects_figure",
    "energy_figure",
    "fan_figure",
    "features_figure",
    "fit_figure",
    "force_polar_figure",
    "front_figure",
    "growth_figure",
    "map_figure",
    "orbit_figure",
    "overlay_figure",
    "parity_figure",
    "penetration_figure",
    "phase_figure",
    "poincare_figure",
    "posterior_figure",
    "profile_figure",
    "response_figure",
    "samples_figure",
    "save",
    "sensitivity_figure",
    "sketch_figure",
    "sobol_figure",
    "spectrum_figure",
    "surfaces_figure",
    "survival_figure",
    "timing_figure",
]

_IN = {
    "compared": ("overlay_figure",),
    "designs": ("comparison_figure", "front_figure"),
    "effects": ("effects_figure",),
    "identified": ("features_figure", "growth_figure", "posterior_figure"),
    "maps": ("bifurcation_figure", "map_figure"),
    "portraits": ("force_polar_figure", "orbit_figure", "phase_figure", "poincare_figure"),
    "response": ("energy_figure", "penetration_figure", "response_figure", "spectrum_figure"),
    "samples": ("samples_figure",),
    "sketch": ("sketch_figure",),
    "style": ("save",),
    "surrogates": (
        "fit_figure",
        "parity_figure",
        "sensitivity_figure",
        "sobol_figure",
        "surfaces_figure",
    ),
    "timing": ("timing_figure",),
    "wear": ("fan_figure", "profile_figure", "survival_figure"),
}
"""Modules of `figures`, and what is public of each."""


def __getattr__(name: str) -> object:
    for module, names in _IN.items():
        if name in names:
            return getattr(import_module(f"{__name__}.figures.{module}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*globals(), *__all__]

"""Figures, each a function of a dataset, and the HTML page.

Figures need matplotlib (the extra ``analysis``), which is imported when the first one is drawn.
"""

from .designs import comparison_figure, front_figure
from .portraits import force_polar_figure, orbit_figure, phase_figure, poincare_figure
from .response import (
    bifurcation_figure,
    energy_figure,
    penetration_figure,
    response_figure,
    spectrum_figure,
)
from .samples import samples_figure
from .style import save
from .surrogates import (
    fit_figure,
    parity_figure,
    sensitivity_figure,
    sobol_figure,
    surfaces_figure,
)
from .timing import timing_figure

__all__ = [
    "bifurcation_figure",
    "comparison_figure",
    "energy_figure",
    "fit_figure",
    "force_polar_figure",
    "front_figure",
    "orbit_figure",
    "parity_figure",
    "penetration_figure",
    "phase_figure",
    "poincare_figure",
    "response_figure",
    "samples_figure",
    "save",
    "sensitivity_figure",
    "sobol_figure",
    "spectrum_figure",
    "surfaces_figure",
    "timing_figure",
]

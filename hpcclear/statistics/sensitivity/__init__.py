"""Sensitivity of a function to its inputs: derivatives at a point, their trust, global indices."""

from hpcclear.statistics.sensitivity.convergence import (
    ConvergenceIntervals,
    best_estimates,
    convergence_intervals,
)
from hpcclear.statistics.sensitivity.intervals import (
    IntervalDesign,
    IntervalSettings,
    SensitivityHistory,
    analyse_intervals,
    design_intervals,
)
from hpcclear.statistics.sensitivity.selection import Influence, Selection, select_influential
from hpcclear.statistics.sensitivity.sobol import (
    SobolIndices,
    analyse_sobol,
    noise_share,
    sobol_design,
)

__all__ = [
    "ConvergenceIntervals",
    "Influence",
    "IntervalDesign",
    "IntervalSettings",
    "Selection",
    "SensitivityHistory",
    "SobolIndices",
    "analyse_intervals",
    "analyse_sobol",
    "best_estimates",
    "convergence_intervals",
    "design_intervals",
    "noise_share",
    "select_influential",
    "sobol_design",
]

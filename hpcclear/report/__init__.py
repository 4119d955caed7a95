"""Figures, each a function of a dataset, and the HTML page; see `hpcclear.report.page`."""

from .samples import samples_figure
from .style import save

__all__ = ["samples_figure", "save"]

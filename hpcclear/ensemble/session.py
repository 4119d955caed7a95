"""What a command that simulates leaves behind."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr


@dataclass(frozen=True)
class Finished:
    """A command's results, for whoever prints them.

    Attributes
    ----------
    content : xarray.Dataset
    output, timing : Path
        Files of the content and of the times.
    seconds : float
        Wall time of the command.
    spent : ndarray, shape (ranks, 4)
        Seconds of every rank, columns as in `hpcclear.ranks.team.COLUMNS`.
    """

    content: xr.Dataset
    output: Path
    timing: Path
    seconds: float
    spent: np.ndarray

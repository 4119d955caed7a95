"""Why simulations failed, and where in the ranges of the study variables: words from numbers alone."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array, Booleans
from hpcclear.base.outcome import Status
from hpcclear.report.figures import labels
from hpcclear.report.parts import LinesOf, Recommended
from hpcclear.report.spread import Line
from hpcclear.results.content import Results

CLEAR = 0.3
"""Largest distance of two distributions (Kolmogorov's) below which a variable is not named at all."""

SURE = 1.63
"""The same of two samples by chance, times sqrt(1/n + 1/m), in 1 of 100 cases (Smirnov 1948, doi:10.1214/aoms/1177730256)."""

NAMED = 2
"""Variables that are named for each status."""


class SampledVariable(NamedTuple):
    """A variable: its name, SI unit, and value in each sample, shape (n,)."""

    name: str
    unit: str
    values: Array


def variables(samples: Results) -> list[SampledVariable]:
    """Return the design variables of samples (kind ``samples``)."""
    return [
        SampledVariable(labels.words(one), str(one.attrs.get("units", "1")), one.values)
        for one in labels.design_variables(samples)
    ]


def explained(samples: Results) -> list[str]:
    """Return `sentences` of samples (kind ``samples``)."""
    return list(sentences(samples["status"].values, variables(samples)))


def sentences(
    status: Array, columns: Sequence[SampledVariable], what: str = "samples"
) -> Iterator[str]:
    """Yield a sentence for each failure among outcomes (n,): how many, why, in which ranges of which variables, what to do."""
    for code in Status:
        failed = status == code
        if code is Status.OK or not failed.any():
            continue
        place = where(failed, columns)
        count = f"{int(failed.sum())} of {failed.size} {what}"
        yield f"{count} {code.name.lower()}: {code.message}{place and f'; {place}'}. {code.remedy}"


def where(failed: Booleans, columns: Sequence[SampledVariable]) -> str:
    """Return the ranges of failures (n,) in variables that are distributed otherwise in the rest; "" if all failed."""
    if failed.all():
        return ""
    from scipy.stats import ks_2samp  # loads for half a second, where something failed

    least = min(max(CLEAR, SURE * np.sqrt(1.0 / failed.sum() + 1.0 / (~failed).sum())), 0.99)
    apart = {
        one.name: ks_2samp(one.values[failed], one.values[~failed], method="asymp").statistic
        for one in columns
    }
    ranked = sorted(columns, key=lambda one: -apart[one.name])
    shown = [one for one in ranked if apart[one.name] > least][:NAMED]
    if not shown:
        return "spread over the ranges of all variables"
    inside, ranges = np.ones(len(failed), bool), []
    for one in shown:
        low, high = (float(end(one.values[failed])) for end in (np.min, np.max))
        inside &= (one.values >= low) & (one.values <= high)
        whole = labels.between(float(one.values.min()), float(one.values.max()), one.unit)
        ranges.append(f"{one.name} {labels.between(low, high, one.unit)} (range {whole})")
    return f"all at {', '.join(ranges)}, where {int(failed.sum())} of {int(inside.sum())} failed"


def _lines(of: Recommended) -> Iterator[Line]:
    """Why samples failed, where, and what to do; none where all succeeded."""
    if (samples := of.files.get("samples")) is not None:
        yield from (Line("failed", text) for text in explained(samples))


PARTS = (LinesOf(70, _lines),)

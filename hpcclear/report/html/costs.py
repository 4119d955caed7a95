"""The section on accuracy against run time (kind ``accuracy``): cheapest settings and their errors."""

from collections.abc import Iterator

import numpy as np

from hpcclear.base.plain import counted
from hpcclear.report import targets
from hpcclear.report.html.content import Content
from hpcclear.report.html.markup import Number, PageTable, folded
from hpcclear.report.parts import SectionOf
from hpcclear.results.content import Results, Variable, each

TARGETS = (1e-2, 1e-3, 1e-4, 1e-6)


def accuracy(found: Results, content: Content) -> list[object]:
    """Cheapest settings for three errors in words, then tables; the figures show every other source of error."""
    two, here = ["setting", "result"], "Cheapest integrator for an error of f over one revolution"
    mean = "Cheapest settings for a standard error of f as a steady mean"
    wait = f"the {float(found['spin_up']):.0f} transient revolutions of {targets.REPLICAS} replicas"
    steady = [[f"{100 * float(k['aim']):.1f} %", cheapest(k)] for k in each(found, "aim")]
    steady.append(["time", f"averaged revolutions and {wait}"])
    tables = [_spending(found), PageTable(two, steady, mean), PageTable(two, advice(found), here)]
    measured = f"{found.attrs['repeats']}; f: {found.attrs['motion']}."
    return [*targets.sentences(found), measured, folded("Integration and averaging", tables)]


def _spending(found: Results) -> PageTable:
    """A row a tolerance."""
    rows: list[list[object]] = []
    with np.errstate(invalid="ignore", divide="ignore"):
        holds = found["spent_error"].values / found["spent_model"].values
    for k, rtol in enumerate(found["tolerance"].values):
        known = holds[k][np.isfinite(holds[k])]
        cells = (
            _known(found["tolerance_bias"][k], "+.1e"),
            _known(2.0 * found["tolerance_bias_error"][k], ".0e"),
            f"{float(found['turn_variance'][k]):.1e}",
            f"{1e3 * float(found['tolerance_seconds'][k]):.3g}",
            f"{known.min():.2f} to {known.max():.2f}" if known.size else "",
        )
        rows.append([f"{rtol:.0e}", *map(Number, cells)])
    header = ["rtol", "bias of f", "± 2 s.e.", "variance/rev.", "ms/rev.", "error/formula"]
    title = "Steady mean: relative bias and variance of f, and run time, by tolerance"
    return PageTable(header, rows, title)


def _known(value: Variable, digits: str) -> str:
    """A number, a dash where there is none: at the reference."""
    return format(float(value), digits) if np.isfinite(float(value)) else "–"


def cheapest(here: Results) -> str:
    """Return tolerance, revolutions and core time that reach a relative standard error, one ``aim``, at the least cost."""
    seconds = float(here["cheapest_seconds"])
    if not np.isfinite(seconds):
        return "not resolved by the measured revolutions"
    count = counted(int(here["cheapest_revolutions"]), "revolution")
    return f"rtol {float(here['cheapest_tolerance']):.0e}, {count}, {seconds:.2g} s"


def advice(found: Results) -> Iterator[list[str]]:
    """Yield the cheapest method and setting for each target error of f, and what the reference resolves."""
    here = found.sel(quantity="objective")
    error, seconds = here["error"].values, here["seconds"].values
    for target in TARGETS:
        price = np.where(error <= target, seconds, np.inf)
        text = "not reached by the measured tolerances"
        if np.isfinite(price).any():
            m, r = np.unravel_index(price.argmin(), price.shape)
            setting = float(here["setting"][m, r])
            text = f"{here['integrator'].values[m]}, {setting:.0e}: {1e3 * price[m, r]:.3g} ms"
        yield [f"{target:.0e}", text]
    yield ["reference", resolution(found)]


def resolution(found: Results) -> str:
    """Return what the reference of f can distinguish, in words."""
    own = float(found["reference_error"].sel(quantity="objective"))
    least = float(np.nanmin(found["error"].sel(quantity="objective")))
    if own * targets.MARGIN <= least:
        return f"its own error is {own:.0e}, {targets.MARGIN:.0f} times below all errors shown"
    return f"its own error is {own:.0e}: errors below {targets.MARGIN * own:.0e} are not resolved"


PARTS = (SectionOf(10, "accuracy", "costs", "Accuracy and run time", accuracy, "accuracy"),)

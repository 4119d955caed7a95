"""The output of `accuracy`: recommended settings, then a table for each source of error."""

from pathlib import Path

import numpy as np
from rich import box
from rich.table import Table

from hpcclear.accuracy import spending
from hpcclear.accuracy.integration import MARGIN
from hpcclear.cli.terminal import console, fitting, table
from hpcclear.report import targets
from hpcclear.report.figures.accuracy import AIM
from hpcclear.results.content import Results, Variable

TARGETS = (1e-2, 1e-3, 1e-4, 1e-6)


def describe(found: Results, files: dict[str, Path]) -> None:
    """Print every panel as a table, the cheapest settings, and where the files are."""
    out = console()
    for text in targets.sentences(found):
        out.print(text)
    out.print()
    out.print(_spending(found))
    out.print(
        table("Cheapest settings for a standard error of f as a steady mean", _cheapest(found))
    )
    out.print(_integration(found))
    out.print(table("Cheapest integrator for an error of f over one revolution", advice(found)))
    out.print(table("Averaging", _averaging(found)))
    out.print(_surrogates(found))
    out.print(
        table("Random inputs, at the middle of the design space: relative errors", _random(found))
    )
    out.print(table("Ranks", _ranks(found)))
    out.print(f"{found.attrs['versions']}\n{found.attrs['processor']}; {found.attrs['repeats']}")
    for what, path in files.items():
        out.print(f"{what:14} {path}", soft_wrap=True)
    out.print(fitting(f"f              {found.attrs['motion']}"), soft_wrap=True)
    out.print(f"steady mean    {result(found)}", soft_wrap=True)


def _integration(found: Results) -> Table:
    made = _grid("One revolution: error of f, force evaluations, time")
    for name in ("integrator", "order", "rtol", "error of f", "evaluations", "ms"):
        made.add_column(name, no_wrap=True, justify="left" if name == "integrator" else "right")
    for method in found["integrator"].to_numpy():
        row = found.sel(integrator=method, quantity="objective")
        for k in range(0, row.sizes["rung"], 2):
            made.add_row(
                method if k == 0 else "",
                f"{float(row['order']):.1f}" if k == 0 else "",
                f"{float(row['setting'][k]):.1e}",
                f"{float(row['error'][k]):.1e}",
                f"{float(row['evaluations'][k]):.0f}",
                f"{1e3 * float(row['seconds'][k]):.3g}",
            )
    return made


def _spending(found: Results) -> Table:
    """A row a tolerance."""
    made = _grid("Steady mean: relative bias and variance of f, and run time, by tolerance")
    for name in ("rtol", "bias of f", "± 2 s.e.", "variance/rev.", "ms/rev.", "error/formula"):
        made.add_column(fitting(name), no_wrap=True, justify="right")
    with np.errstate(invalid="ignore", divide="ignore"):
        holds = found["spent_error"].to_numpy() / found["spent_model"].to_numpy()
    for k, rtol in enumerate(found["tolerance"].to_numpy()):
        known = holds[k][np.isfinite(holds[k])]
        made.add_row(
            f"{rtol:.0e}",
            _known(found["tolerance_bias"][k], "+.1e"),
            _known(2.0 * found["tolerance_bias_error"][k], ".0e"),
            f"{float(found['turn_variance'][k]):.1e}",
            f"{1e3 * float(found['tolerance_seconds'][k]):.3g}",
            f"{known.min():.2f} to {known.max():.2f}" if known.size else "",
        )
    return made


def _known(value: Variable, digits: str) -> str:
    """A number, a dash where there is none: at the reference."""
    return format(float(value), digits) if np.isfinite(float(value)) else "–"


def _cheapest(found: Results) -> list[tuple[str, str]]:
    wait = f"the {float(found['spin_up']):.0f} transient revolutions of {spending.COPIES} replicas"
    rows = [(f"{aim:.1%}", cheapest(found, float(aim))) for aim in found["aim"].to_numpy()]
    return [*rows, ("time", f"averaged revolutions and {wait}")]


def cheapest(found: Results, aim: float) -> str:
    """Tolerance, revolutions and core time that reach a relative standard error at the least cost."""
    here = found.isel(aim=int(np.abs(found["aim"].to_numpy() - aim).argmin()))
    seconds = float(here["cheapest_seconds"])
    if not np.isfinite(seconds):
        return "not resolved by the measured revolutions"
    spent = int(here["cheapest_revolutions"])
    count = f"{spent} revolution{'s' if spent > 1 else ''}"
    return f"rtol {float(here['cheapest_tolerance']):.0e}, {count}, {seconds:.2g} s"


def result(found: Results) -> str:
    """The cheapest settings for one error, in one line."""
    return f"cheapest settings for a standard error of {AIM:.0%}, all replicas together: {cheapest(found, AIM)} of one core"


def _grid(title: str) -> Table:
    return Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False)


def advice(found: Results) -> list[tuple[str, str]]:
    """The cheapest method and setting for each target error of f, and what the reference resolves."""
    here = found.sel(quantity="objective")
    error, seconds = here["error"].to_numpy(), here["seconds"].to_numpy()
    rows = []
    for target in TARGETS:
        price = np.where(error <= target, seconds, np.inf)
        if np.isfinite(price).any():
            m, r = np.unravel_index(price.argmin(), price.shape)
            setting = float(here["setting"][m, r])
            text = f"{here['integrator'].to_numpy()[m]}, {setting:.0e}: {1e3 * price[m, r]:.3g} ms"
        else:
            text = "not reached by the measured tolerances"
        rows.append((f"{target:.0e}", text))
    return [*rows, ("reference", resolution(found))]


def resolution(found: Results, quantity: str = "objective") -> str:
    """What the reference of one quantity can distinguish, in words."""
    own = float(found["reference_error"].sel(quantity=quantity))
    least = float(np.nanmin(found["error"].sel(quantity=quantity)))
    if own * MARGIN <= least:
        return f"its own error is {own:.0e}, {MARGIN:.0f} times below all errors shown"
    return f"its own error is {own:.0e}: errors below {MARGIN * own:.0e} are not resolved"


def _averaging(found: Results) -> list[tuple[str, str]]:
    error, floor = found["averaging_error"], float(found["averaging_floor"])
    rows = []
    for transient in (0, 2, 8):
        for averaged in (1, 8):
            if transient in found["transient"].values and averaged in found["averaged"].values:
                value = float(error.sel(transient=transient, averaged=averaged))
                rows.append((f"{transient} + {averaged} revolutions", f"error of f {value:.1e}"))
    text = f"{floor:.1e}: scatter of long averages between replicas, which no average removes"
    return [*rows, ("lower bound", text)]


def _surrogates(found: Results) -> Table:
    made = _grid("Surrogates")
    for name in ("surrogate", "samples", "simulation", "R2", "RMAE", "leave-one-out"):
        made.add_column(name, no_wrap=True, justify="left" if name == "surrogate" else "right")
    each = float(found["sample_seconds"])
    for surrogate in found["surrogate"].to_numpy():
        row = found.sel(surrogate=surrogate)
        for k, size in enumerate(found["training"].to_numpy()):
            values = [f"{float(row[name][k]):.3g}" for name in ("r2", "rmae", "leave_one_out")]
            made.add_row(surrogate if k == 0 else "", str(size), f"{each * size:.2g} s", *values)
    return made


def _random(found: Results) -> list[tuple[str, str]]:
    rows = []
    for estimate in found["estimate"].to_numpy():
        error = found["moment_error"].sel(estimate=estimate)
        known = np.flatnonzero(np.isfinite(error.sel(moment="mean").to_numpy()))
        for k in {known[0], known[-1]} if known.size else ():
            mean, deviation = (float(error.sel(moment=m)[k]) for m in ("mean", "deviation"))
            seconds = float(found["moment_seconds"].sel(estimate=estimate)[k])
            what = f"{estimate}, {int(found['draws'][k])} draws"
            rows.append((what, f"mean {mean:.1e}, std. deviation {deviation:.1e}, {seconds:.2g} s"))
    for moment in found["moment"].to_numpy():
        bias, own = (float(found[n].sel(moment=moment)) for n in ("moment_bias", "bias_error"))
        rows.append(
            (
                f"bias, {'std. ' * (moment == 'deviation')}{moment}",
                fitting(f"{bias:+.1e} ± {own:.1e} (standard error), surrogate against simulation"),
            )
        )
    text = f"{1e3 * float(found['quadrature_seconds']):.2g} ms, no sampling error"
    return [*rows, ("quadrature", text)]


def _ranks(found: Results) -> list[tuple[str, str]]:
    strong, weak = found["strong_seconds"].to_numpy(), found["weak_seconds"].to_numpy()
    rows = []
    for number, one, other in zip(found["ranks"].to_numpy(), strong, weak, strict=True):
        text = f"speed-up {strong[0] / one:.2f}, weak efficiency {weak[0] / other:.2f}"
        rows.append((f"{number} rank{'s' if number > 1 else ''}", text))
    if len(rows) == 1:
        rows.append(("more ranks", "start with mpiexec -n N to measure them"))
    for loss, seconds in zip(
        found["loss"].to_numpy(), found["lost_seconds"].to_numpy(), strict=True
    ):
        rows.append((f"lost to {loss}", f"{seconds:.2g} core-seconds"))
    return rows

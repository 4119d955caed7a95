"""The section of the page on what accuracy costs (kind ``accuracy``)."""

import numpy as np
import xarray as xr

from hpcclear.report.html.content import Content
from hpcclear.report.html.markup import Number, Table

TARGETS = (1e-2, 1e-3, 1e-4, 1e-6)


def accuracy(content: Content) -> list[object] | None:
    """The cheapest way to each error of f, and the errors of everything that follows."""
    found = content.get("accuracy")
    if found is None:
        return None
    header = ["relative error of f", "integrator", "tolerance or step", "time of a revolution (ms)"]
    cheapest = Table(
        header, _cheapest(found), "The cheapest way to an error of f over one revolution"
    )
    rows = [*_steady(found), *_averaging(found), *_surrogates(found), *_moments(found)]
    others = Table(
        ["what", "relative error", "cost"], rows, "Errors of what comes after, and their price"
    )
    words = "Errors are against references far tighter than what is measured; times are of one core, on this machine."
    return [words, cheapest, others]


def words(content: Content) -> list[str]:
    """What was measured, in a sentence or two for the summary."""
    found = content.get("accuracy")
    if found is None:
        return []
    told = []
    for target, name, setting, milliseconds in _cheapest(found):
        if name != "not reached":
            told.append(f"{target} costs {milliseconds} ms of a core ({name}, {setting})")
    reached = "; ".join(told) if told else "no error of f down to 1% was reached"
    floor = float(found["averaging_floor"])
    return [
        f"The cost of accuracy was measured. For one revolution, an error of f of {reached}.",
        f"Means of f over long intervals differ by {floor:.1e}, at any tolerance.",
    ]


def _cheapest(found: xr.Dataset) -> list[list[object]]:
    here = found.sel(quantity="objective")
    error, seconds = here["error"].to_numpy(), here["seconds"].to_numpy()
    rows: list[list[object]] = []
    for target in TARGETS:
        price = np.where(error <= target, seconds, np.inf)
        if not np.isfinite(price).any():
            rows.append([f"{target:.0e}", "not reached", Number("–"), Number("–")])
            continue
        k, rung = np.unravel_index(int(price.argmin()), price.shape)
        name = here["integrator"].to_numpy()[k]
        setting = float(here["setting"].to_numpy()[k, rung])
        rows.append(
            [f"{target:.0e}", name, Number(f"{setting:.0e}"), Number(f"{1e3 * price[k, rung]:.3g}")]
        )
    return rows


def _steady(found: xr.Dataset) -> list[list[object]]:
    rows: list[list[object]] = []
    for aim in found["aim"].to_numpy():
        one = found.sel(aim=aim)
        if np.isfinite(float(one["cheapest_seconds"])):
            spent, rtol = int(one["cheapest_revolutions"]), float(one["cheapest_tolerance"])
            words = f"steady mean over {spent} revolutions after a spin-up, tolerance {rtol:.0e}"
            rows.append([words, *_cells(float(aim), float(one["cheapest_seconds"]))])
    return rows


def _averaging(found: xr.Dataset) -> list[list[object]]:
    error = found["averaging_error"]
    rows: list[list[object]] = []
    for place in (0, -1):
        one = error.isel(transient=-1, averaged=place)
        count = int(one["averaged"])
        cost = count * float(found["turn_seconds"])
        rows.append([f"average over {count} revolutions", *_cells(float(one), cost)])
    rows.append(
        [
            "scatter between replicas (lower bound of the averaging error)",
            Number(f"{float(found['averaging_floor']):.1e}"),
            "",
        ]
    )
    return rows


def _surrogates(found: xr.Dataset) -> list[list[object]]:
    each = float(found["sample_seconds"])
    rows: list[list[object]] = []
    for name in found["surrogate"].to_numpy():
        one = found.sel(surrogate=name).isel(training=-1)
        size = int(one["training"])
        rows.append([f"{name}, {size} points: RMAE", *_cells(float(one["rmae"]), size * each)])
    return rows


def _moments(found: xr.Dataset) -> list[list[object]]:
    rows: list[list[object]] = []
    for moment in found["moment"].to_numpy():
        for estimate in found["estimate"].to_numpy():
            error = found["moment_error"].sel(moment=moment, estimate=estimate).to_numpy()
            known = np.flatnonzero(np.isfinite(error))
            if known.size:
                k = int(known[-1])
                cost = float(found["moment_seconds"].sel(estimate=estimate).to_numpy()[k])
                draws = int(found["draws"].to_numpy()[k])
                words = f"{moment} by Monte Carlo, {estimate}, {draws} draws"
                rows.append([words, *_cells(float(error[k]), cost)])
        bias = float(found["moment_bias"].sel(moment=moment))
        cost = float(found["quadrature_seconds"])
        rows.append([f"{moment} by quadrature on the surrogate: bias", *_cells(abs(bias), cost)])
    return rows


def _cells(error: float, seconds: float) -> tuple[Number, Number]:
    shown = f"{seconds:.3g} s" if seconds >= 0.1 else f"{1e3 * seconds:.3g} ms"
    return Number(f"{error:.1e}"), Number(shown)

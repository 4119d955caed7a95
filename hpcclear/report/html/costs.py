"""The section of the page on accuracy against run time (kind ``accuracy``)."""

import numpy as np

from hpcclear.report import targets
from hpcclear.report.figures import accuracy as figures
from hpcclear.report.html import gallery
from hpcclear.report.html.content import Content
from hpcclear.report.html.markup import Number, Table, folded
from hpcclear.report.parts import SectionOf
from hpcclear.results.content import Results

TARGETS = (1e-2, 1e-3, 1e-4, 1e-6)


def accuracy(content: Content) -> list[object] | None:
    """Cheapest settings for three errors in one figure and in words, then the sources of error, folded."""
    found = content.get("accuracy")
    if found is None:
        return None
    header = ["relative error of f", "integrator", "tolerance or step", "time of a revolution (ms)"]
    cheapest = Table(
        header, _cheapest(found), "Cheapest integrator for an error of f over one revolution"
    )
    rows = [*_steady(found), *_averaging(found), *_surrogates(found), *_moments(found)]
    others = Table(
        ["approximation", "relative error", "run time"],
        rows,
        "Errors of the other approximations, and their run time",
    )
    note = "Errors are relative to references with much tighter settings. Times are those of one core of this machine."
    total, *drawn, ranks = (
        gallery.picture(one.draw, found, one.captioned({"accuracy": found}))
        for one in figures.PARTS
    )
    sources: list[object] = [cheapest, others, *(one for one in drawn if one)]
    return [
        *([total] if total else []),
        *targets.sentences(found),
        note,
        folded("Sources of error, one by one", sources),
        *([folded("Ranks", [ranks])] if ranks else []),
    ]


def _cheapest(found: Results) -> list[list[object]]:
    here = found.sel(quantity="objective")
    error, seconds = here["error"].to_numpy(), here["seconds"].to_numpy()
    rows: list[list[object]] = []
    for target in TARGETS:
        price = np.where(error <= target, seconds, np.inf)
        if not np.isfinite(price).any():
            rows.append([f"{target:.0e}", "not reached", Number("–"), Number("–")])
            continue
        k, level = np.unravel_index(int(price.argmin()), price.shape)
        name = here["integrator"].to_numpy()[k]
        setting = float(here["setting"].to_numpy()[k, level])
        rows.append(
            [
                f"{target:.0e}",
                name,
                Number(f"{setting:.0e}"),
                Number(f"{1e3 * price[k, level]:.3g}"),
            ]
        )
    return rows


def _steady(found: Results) -> list[list[object]]:
    rows: list[list[object]] = []
    for aim in found["aim"].to_numpy():
        one = found.sel(aim=aim)
        if np.isfinite(float(one["cheapest_seconds"])):
            spent, rtol = int(one["cheapest_revolutions"]), float(one["cheapest_tolerance"])
            words = f"steady mean over {spent} revolutions after a spin-up, tolerance {rtol:.0e}"
            rows.append([words, *_cells(float(aim), float(one["cheapest_seconds"]))])
    return rows


def _averaging(found: Results) -> list[list[object]]:
    error = found["averaging_error"]
    rows: list[list[object]] = []
    for place in (0, -1):
        one = error.isel(transient=-1, averaged=place)
        count = int(found["averaged"][place])
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


def _surrogates(found: Results) -> list[list[object]]:
    each = float(found["sample_seconds"])
    rows: list[list[object]] = []
    for name in found["surrogate"].to_numpy():
        one = found.sel(surrogate=name).isel(training=-1)
        size = int(one["training"])
        rows.append([f"{name}, {size} points: RMAE", *_cells(float(one["rmae"]), size * each)])
    return rows


def _moments(found: Results) -> list[list[object]]:
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


PARTS = (SectionOf(90, "accuracy", "Accuracy and run time", "parts.html", accuracy),)

"""First screens of many simulations: samples, their sums, maps of motion and bifurcation diagrams."""

from collections.abc import Iterator, Mapping

import numpy as np

from hpcclear.base.outcome import Flag, Regime, Status
from hpcclear.base.plain import counted
from hpcclear.base.student import student
from hpcclear.report import bearings, failures, spread
from hpcclear.report.answer import MANY
from hpcclear.report.figures import labels
from hpcclear.report.html.content import Content
from hpcclear.report.screen import Screen, ScreenRow, Tile, Trust, amber, green, red, trusted
from hpcclear.results.content import Results
from hpcclear.statistics.random.survival import CONFIDENCE

MOST = 0.5
"""Share of samples with a warning from which on it is red."""


def _compared(content: Content) -> Screen:
    """The first screen of several samples beside each other."""
    every = {name: own["samples"] for name, own in content.samples.items()}
    names = "samples", "P95 of f", "mean of f", "std. deviation of f"
    rows = [row for row in spread.rows_of(spread.side_by_side(every)) if row[0] in names]
    worries = [one for found in every.values() for one in _trust(found)]
    return Screen(
        f"{len(every)} files of samples, beside each other",
        header=("quantity", *every),
        rows=tuple(ScreenRow(label, tuple(cells)) for label, *cells in rows),
        trust=trusted(dict.fromkeys(worries)),
    )


def samples(found: Results, content: Content) -> Screen:
    """Return the first screen of samples, of several beside each other."""
    if content.samples:
        return _compared(content)
    f, unit = found["objective"].values, str(found["objective"].attrs["units"])
    names = ", ".join(labels.words(v) for v in labels.design_variables(found))
    varied = f"varied: {names}" if names else ""
    shown = {line.label: line for line in spread.statistics(found) if line.estimate.known}
    stated = {label: _stated(line) for label, line in shown.items()}
    first = "mean of f", "std. deviation of f", "P95 of f", "median of f"
    rows = [ScreenRow(*one) for one in stated.items() if one[0].startswith(("P95 peak", "P99"))]
    headline = "Every simulation failed"
    if np.isfinite(f).any():
        headline = f"mean of f {labels.quantity(float(np.nanmean(f)), unit)}"
        ends = labels.between(float(np.nanmin(f)), float(np.nanmax(f)), unit)
        rows.insert(0, ScreenRow("range of f", (ends, "")))
    if "mean of f" in shown:
        headline = f"mean of f {shown['mean of f'].text}, standard deviation {shown['std. deviation of f'].text}"
    share = _share(found, Flag.BEYOND_HERTZ)
    return Screen(
        labels.sentence(headline, found),
        (f"f: {labels.objective(found)}", counted(len(f), "simulation"), varied),
        _doubt(share, int((found["status"].values != Status.OK).sum()), len(f)),
        tuple(Tile(name, one[0], within=one[1]) for name, one in stated.items() if name in first),
        rows=tuple(rows),
        trust=trusted(_trust(found), share > MOST),
        figures=("samples",),
    )


def _stated(line: spread.Line) -> tuple[str, str]:
    value, low, high, unit = line.estimate
    if not np.isfinite([low, high]).all():
        return labels.quantity(value, unit), "interval not stated"
    shown, within = labels.stated(*line.estimate)
    return shown, f"95 % CI {within}" if value else ""


def _doubt(outside: float, failed: int = 0, total: int = 0) -> str:
    """Why results are indicative only: of simulations a share outside the contact model's range, and some that failed."""
    found = ["the contact model is outside its range"] if outside > MOST else []
    if MANY * total < failed < total:
        found.append(f"{failed} of {total} simulations failed")
    return "; ".join(found)


def _share(found: Results, flag: Flag) -> float:
    return float(((found["flags"].values & int(flag)) != 0).mean()) if "flags" in found else 0.0


def _trust(found: Results) -> Iterator[Trust]:
    yield from _failed(found)
    outside = bearings.outside(found) or "forces are indicative"
    yield from _flagged({flag: _share(found, flag) for flag in Flag}, outside)
    name = "objective_limit" if "objective_limit" in found else "objective_uncertainty"
    if not np.isfinite(found[name].values).any():
        text = "The half-width of a single f was not checked (numerics.target_error)"
        yield amber(text, "quality")
    if "sampling" not in found.attrs:
        yield amber("The designs were chosen, not drawn: no intervals", "quality")


def _failed(found: Results, what: str = "samples") -> Iterator[Trust]:
    """How many simulations failed, why, and where; that none did."""
    lost, columns = found["status"].values != Status.OK, failures.variables(found)
    for text in list(failures.sentences(found["status"].values, columns, what))[:2]:
        yield (red if lost.mean() > MANY else amber)(text, "quality")
    if not lost.any():
        yield green("No simulation failed", "quality")


def _flagged(shares: Mapping[Flag, float], outside: str, what: str = "samples") -> Iterator[Trust]:
    """What flags say, by the share of samples that have each; `outside`: of the contact model's range, in words."""
    for flag, text in (
        (Flag.BEYOND_HERTZ, f"contact model outside its range, {outside}"),
        (Flag.LATCHED, "a joint never left contact, f may depend on the integration tolerance"),
        (Flag.TARGET_MISSED, "f is not known to numerics.target_error"),
    ):
        if share := shares.get(flag):
            level = red if share > MOST and flag is not Flag.LATCHED else amber
            yield level(f"{spread.percent(share)} of the {what}: {text}", "quality")


def map_of_motion(found: Results, content: Content) -> Screen:
    """Return the first screen of a map."""
    good = found["status"].values == Status.OK
    regimes = found["regime"].values
    cells = counted(len(good), "cell")
    kinds = [(regime, int(((regimes == regime) & good).sum())) for regime in Regime]
    kinds = sorted((one for one in kinds if one[1]), key=lambda one: -one[1])
    growth = found["lyapunov_exponent"].values[good]
    periods = np.unique(found["period"].values[good])
    known = ", ".join(f"{one:.0f}" for one in periods[np.isfinite(periods)][:6])
    f, unit = found["objective"].values[good], str(found["objective"].attrs["units"])
    headline = "Every cell failed"
    if kinds:
        (most, _, why), *rest = (regime.meaning.partition(":") for regime, _ in kinds[:2])
        headline = f"{most.capitalize()} at {kinds[0][1]} of {cells}{why and ':'}{why}"
        headline += "".join(f"; {kind} at {kinds[1][1]}" for kind, *_ in rest)
    tiles: tuple[Tile, ...] = ()
    if len(growth):
        tiles = (
            Tile("largest Lyapunov exponent", f"{growth.max():.3g}", within="per revolution"),
            Tile("period", known or "none", within="revolutions"),
            Tile("range of f", labels.between(float(f.min()), float(f.max()), unit)),
        )
    axes = ", ".join(labels.words(v) for v in labels.design_variables(found))
    trust = [*_failed(found, "cells")]
    moving = (Regime.SETTLING, Regime.UNSTEADY, Regime.UNJUDGED)
    if open_ := sum(n for regime, n in kinds if regime in moving):
        text = f"{counted(open_, 'cell')} not settled: longer transients would decide"
        trust.append(amber(text, "quality"))
    share = _share(found, Flag.BEYOND_HERTZ)
    trust += _flagged({Flag.BEYOND_HERTZ: share}, bearings.outside(found), "cells")
    rows = tuple(ScreenRow(regime.meaning, (f"{n}",)) for regime, n in kinds)
    return Screen(
        headline, (f"{cells} over {axes}", f"f: {labels.objective(found)}"),
        _doubt(share),
        tiles, ("motion", "cells") if rows else (), rows, trust=trusted(trust, share > MOST),
        figures=("map",),
    )  # fmt: skip


def bifurcation(found: Results, content: Content) -> Screen:
    """Return the first screen of a bifurcation diagram."""
    seen = found["observed"]
    count, crossings = seen.shape
    failed = int(np.isnan(seen.values).all(axis=1).sum())
    what, unit = str(seen.attrs["long_name"]), str(seen.attrs["units"])
    headline = "Every value failed"
    if failed < count:
        ends = float(np.nanmin(seen.values)), float(np.nanmax(seen.values))
        headline = f"{what}: {labels.between(*ends, unit)}"
    trust = [*_failed(found, "values")] if "status" in found else []  # older files
    share = _share(found, Flag.BEYOND_HERTZ)
    trust += _flagged({Flag.BEYOND_HERTZ: share}, bearings.outside(found), "values")
    return Screen(
        headline, (f"{count} values, {crossings} revolutions each",),
        _doubt(share),
        trust=trusted(trust, share > MOST), figures=("bifurcation",),
    )  # fmt: skip


def statistics(found: Results, content: Content) -> Screen:
    """Return the first screen of samples that were summed up and not kept."""
    by_status = found["samples_by_status"]
    total, good = int(np.sum(by_status.values)), int(by_status.sel(outcome=int(Status.OK)))
    number = int(found["objective_count"])
    headline = "Every simulation failed"
    if number > 1:
        mean, deviation = (float(found[f"objective_{n}"]) for n in ("mean", "deviation"))
        unit = str(found["objective_mean"].attrs["units"])
        errors = deviation / number**0.5, _error_of_deviation(found)
        halves = (student(CONFIDENCE, number - 1) * error for error in errors)
        pairs = zip((mean, deviation), halves, strict=True)
        shown = [labels.with_half_width(*one, unit) for one in pairs]
        headline = f"mean of f {shown[0]}, standard deviation {shown[1]}"
    level = green if good == total else red if total - good > MANY * total else amber
    counts = found["samples_by_flag"]
    shares = {flag: float(counts.sel(flags=int(flag))) / max(total, 1) for flag in Flag}
    lost = level(f"{good} of {total} simulations without failure", "quality")
    single = amber("The half-width of a single f was not checked", "quality")
    trust = [lost, *_flagged(shares, "forces are indicative"), single]
    outside = shares[Flag.BEYOND_HERTZ]
    about, headline = (f"f: {labels.objective(found)}",), labels.sentence(headline, found)
    doubt = _doubt(outside, total - good, total)
    return Screen(headline, about, doubt, trust=trusted(trust, outside > MOST))


def _error_of_deviation(found: Results) -> float:
    """Standard error of the standard deviation of f, by the fourth moment of its histogram."""
    parts = ("mean", "deviation", "count", "minimum", "maximum", "edges", "histogram")
    mean, deviation, count, least, most, edges, histogram = (
        found[f"objective_{part}"].values for part in parts
    )
    places = np.concatenate([[least], (edges[1:] + edges[:-1]) / 2.0, [most]])
    fourth = float(histogram @ (places - mean) ** 4 / count)
    square = max(fourth - float(deviation) ** 4, 0.0) / float(count)
    return float(square**0.5 / (2.0 * deviation)) if deviation > 0.0 else 0.0

"""The output of `wear`: service lives, final clearances, and their main cause."""

from typing import TYPE_CHECKING

import numpy as np

from hpcclear.base.outcome import Status
from hpcclear.cli.options import say
from hpcclear.cli.printing import _load
from hpcclear.cli.terminal import console, table
from hpcclear.ensemble.lives import HOUR, doubts
from hpcclear.ranks.stopping import Exit
from hpcclear.report.figures.labels import quantity
from hpcclear.results.content import Results
from hpcclear.statistics.random.survival import order_interval, quantiles

if TYPE_CHECKING:
    from hpcclear.ensemble.session import Finished

DOMINATES = 0.5
"""Share of the variance of ranks from which on an input is said to decide."""


def describe(found: "Finished") -> int:
    """Print lives and their statistics; the exit code."""
    out, content = console(), found.content
    codes = content["ending"].to_numpy()
    good = np.isin(codes, [int(status) for status in Status if status.valid])
    rows = [("service lives", f"{int(good.sum())} of {len(good)} without failure")]
    for status in Status:
        count = int((codes == status).sum())
        if count and not status.valid:
            rows.append((status.name.lower(), f"{count}: {status.message}. {status.remedy}"))
    rows += [("ended", text) for text in _endings(content)]
    rows += [("warning", text) for text in doubts(content)]
    rows += [*_ends(content), *_lifetimes(content), *_profiles(content), *_causes(content)]
    out.print(table("Wear", rows))
    out.print(table("Run", _load(found)))
    out.print(f"written  {found.output}")
    if good.any() or np.isfinite(content["lifetime"]).any():
        return Exit.DONE
    say("Error: every service life failed")
    return Exit.FAILED


REASONS = {
    "cycles": "after wear.cycles, no limit reached",
    "clearance": "at wear.limit.clearance",
    "peak_contact_force": "at wear.limit.peak_contact_force",
    "objective": "at wear.limit.objective",
}
"""How lives end, by what the file has as their reason; failures have rows of their own."""


def _endings(content: Results) -> list[str]:
    """How many lives ended in which way."""
    reasons = content["end_reason"].to_numpy()
    counts = {name: int((reasons == name).sum()) for name in REASONS}
    return [f"{count} {REASONS[name]}" for name, count in counts.items() if count]


def _ends(content: Results) -> list[tuple[str, str]]:
    """Clearances of new and of worn joints."""
    rows = []
    at_end = quantiles(content["end_clearance"].to_numpy(), np.array([0.05, 0.5, 0.95]))
    for k, name in enumerate(content["joint"].to_numpy()):
        new = float(np.nanmedian(content["clearance"].isel(cycle=0).sel(joint=name)))
        low, middle, high = (quantity(float(value), "m") for value in at_end[:, k])
        text = f"median initial {quantity(new, 'm')}, final {middle}"
        rows.append(
            (f"clearance {name}", text + (f" (5 to 95 %: {low} to {high})" if low != high else ""))
        )
    return rows


def _spread(content: Results, name: str, beyond: float) -> str:
    """Median and nine tenths of lives, each with its confidence interval; lives that failed may be of any length."""
    lives = content[name].to_numpy()
    known = lives[~np.isnan(lives)]

    def one(value: float) -> str:
        return f"{value:.4g}" if value < np.inf else f"beyond {beyond:.4g}"

    shown = []
    for level in (0.5, 0.05, 0.95):
        low, high = order_interval(known, level, len(lives) - len(known))
        ends = one(0.0 if np.isnan(low) else low), one(np.inf if np.isnan(high) else high)
        value = one(float(content[f"{name}_quantile"].sel(quantile=level)))
        interval = "" if ends[0] == ends[1] == value else f" (95 % CI {ends[0]} to {ends[1]})"
        shown.append(f"{value}{interval}")
    return f"median {shown[0]}; 5th percentile {shown[1]}; 95th percentile {shown[2]}"


def _lifetimes(content: Results) -> list[tuple[str, str]]:
    """How long lives last, where a limit was given, and the share that is above the clearance's limit."""
    cycles, last = float(content["cycle"][-1]), content.isel(cycle=-1)
    each = content["revolution_time"].to_numpy() / HOUR
    followed = content["ended"].to_numpy()
    rows = [
        (
            "simulated",
            f"at most {followed.max():.4g} revolutions, or {(followed * each).max():.4g} h",
        )
    ]
    given = [name for name in content.attrs if name.startswith("limit_")]
    if not given:
        return [*rows, ("service life", "no threshold given (wear.limit)")]
    rows += [
        ("service life, revolutions", _spread(content, "lifetime", cycles)),
        (
            "service life, h",
            _spread(content, "lifetime_hours", float((cycles * each).min())),
        ),
    ]
    interval = f"95 % CI {float(last['survival_lower']):.3g} to {float(last['survival_upper']):.3g}"
    rows.append(
        (
            f"survival, {cycles:.4g} rev.",
            f"{float(last['survival']):.3g} of the service lives ({interval})",
        )
    )
    if "exceedance" in content:
        for name in content["joint"].to_numpy():
            one = last.sel(joint=name)
            low, high = float(one["exceedance_lower"]), float(one["exceedance_upper"])
            text = f"{float(one['exceedance']):.3g} (95 % CI {low:.3g} to {high:.3g})"
            rows.append((f"P(clearance {name} > limit)", text))
    return rows


def _profiles(content: Results) -> list[tuple[str, str]]:
    """What it makes that surfaces wear where they touch: the largest clearance around, and lives, beside even wear."""
    if "local_clearance" not in content:
        return []
    rows = []
    for k, name in enumerate(content["joint"].to_numpy()):
        largest = quantity(float(np.nanmedian(content["end_clearance"][:, k])), "m")
        even = content["even_clearance"].isel(cycle=-1).sel(joint=name).to_numpy()
        beside = (
            f"; {quantity(float(np.median(even)), 'm')} with uniform wear"
            if np.isfinite(even).all()
            else ""
        )
        rows.append((f"largest clearance, {name}", f"{largest} at the end{beside} (medians)"))
    if any(name.startswith("limit_") for name in content.attrs):
        cycles, parts = float(content["cycle"][-1]), []
        for name in ("lifetime_quantile", "even_lifetime_quantile"):
            value = float(content[name].sel(quantile=0.5))
            parts.append(f"{value:.4g}" if np.isfinite(value) else f"beyond {cycles:.4g}")
        rows.append(("median service life", f"{parts[0]}; {parts[1]} with uniform wear"))
    return rows


def _causes(content: Results) -> list[tuple[str, str]]:
    """Which random input decides how fast a joint wears, where one does."""
    rows = []
    for name in content["joint"].to_numpy():
        share = content["rank_correlation"].sel(joint=name).to_numpy() ** 2
        if len(share) and np.isfinite(share).any():
            k = int(np.nanargmax(share))
            word = "dominant" if share[k] >= DOMINATES else "largest"
            text = (
                f"{content['random_input'].to_numpy()[k]}, squared rank correlation {share[k]:.2f}"
            )
            rows.append((f"{word} input, {name}", text))
    return rows

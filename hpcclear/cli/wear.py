"""What `wear` prints: how long lives last, what they come to, and what decides it."""

from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from hpcclear.base.outcome import Status
from hpcclear.cli.options import say
from hpcclear.cli.printing import _load, console, table
from hpcclear.ensemble.lives import doubts
from hpcclear.ranks.stopping import Exit
from hpcclear.report.figures.labels import quantity

if TYPE_CHECKING:
    from hpcclear.ensemble.session import Finished

DOMINATES = 0.5
"""Share of the variance of ranks from which on an input is said to decide."""


def describe(found: "Finished") -> int:
    """Print lives and their statistics; the exit code."""
    out, content = console(), found.content
    codes = content["ending"].to_numpy()
    good = np.isin(codes, [int(status) for status in Status if status.valid])
    rows = [("lives", f"{int(good.sum())} of {len(good)} without failure")]
    for status in Status:
        count = int((codes == status).sum())
        if count and not status.valid:
            rows.append((status.name.lower(), f"{count}: {status.message}. {status.remedy}"))
    rows += [("unsure", text) for text in doubts(content)]
    rows += [*_ends(content), *_lifetimes(content), *_profiles(content), *_causes(content)]
    out.print(table("Wear", rows + _load(found)))
    out.print(f"wear     {found.output}")
    if good.any() or np.isfinite(content["lifetime"]).any():
        return Exit.DONE
    say("Error: every life failed")
    return Exit.FAILED


def _ends(content: xr.Dataset) -> list[tuple[str, str]]:
    """Clearances of new and of worn joints."""
    rows = []
    quantiles = content["clearance_quantile"].isel(cycle=-1)
    for name in content["joint"].to_numpy():
        new = float(np.nanmedian(content["clearance"].isel(cycle=0).sel(joint=name)))
        low, middle, high = (
            quantity(float(quantiles.sel(joint=name, quantile=level)), "m")
            for level in (0.05, 0.5, 0.95)
        )
        text = f"{quantity(new, 'm')} new; at the end {middle}"
        rows.append(
            (f"clearance {name}", text + (f" (5 to 95 %: {low} to {high})" if low != high else ""))
        )
    return rows


def _lifetimes(content: xr.Dataset) -> list[tuple[str, str]]:
    """How long lives last, where a limit was given, and the share that is above the clearance's limit."""
    given = [name for name in content.attrs if name.startswith("limit_")]
    if not given:
        return [("life", "no limit was given (wear.limit)")]
    cycles = float(content["cycle"][-1])
    told = []
    for level in (0.05, 0.5, 0.95):
        value = float(content["lifetime_quantile"].sel(quantile=level))
        told.append(f"{value:.4g}" if np.isfinite(value) else f"beyond {cycles:.4g}")
    rows = [("life, revolutions", f"{told[1]} (5 to 95 %: {told[0]} to {told[2]})")]
    last = content.isel(cycle=-1)
    limits = (
        f"95 % limits {float(last['survival_lower']):.3g} to {float(last['survival_upper']):.3g}"
    )
    rows.append((f"survive {cycles:.4g}", f"{float(last['survival']):.3g} of the lives ({limits})"))
    if "exceedance" in content:
        for name in content["joint"].to_numpy():
            one = last.sel(joint=name)
            low, high = float(one["exceedance_lower"]), float(one["exceedance_upper"])
            text = f"{float(one['exceedance']):.3g} (95 % limits {low:.3g} to {high:.3g})"
            rows.append((f"P(clearance {name} > limit)", text))
    return rows


def _profiles(content: xr.Dataset) -> list[tuple[str, str]]:
    """What it makes that surfaces wear where they touch: the largest clearance around, and lives, beside even wear."""
    if "local_clearance" not in content:
        return []
    rows = []
    for name in content["joint"].to_numpy():
        last = content.isel(cycle=-1).sel(joint=name)
        largest, even = (
            quantity(float(np.nanmedian(last[one])), "m")
            for one in ("local_clearance", "even_clearance")
        )
        rows.append(
            (f"largest around {name}", f"{largest} at the end; {even} worn evenly (medians)")
        )
    if any(name.startswith("limit_") for name in content.attrs):
        cycles, told = float(content["cycle"][-1]), []
        for name in ("lifetime_quantile", "even_lifetime_quantile"):
            value = float(content[name].sel(quantile=0.5))
            told.append(f"{value:.4g}" if np.isfinite(value) else f"beyond {cycles:.4g}")
        rows.append(("median life", f"{told[0]}; {told[1]} worn evenly"))
    return rows


def _causes(content: xr.Dataset) -> list[tuple[str, str]]:
    """Which random input decides how fast a joint wears, where one does."""
    rows = []
    for name in content["joint"].to_numpy():
        share = content["rank_correlation"].sel(joint=name).to_numpy() ** 2
        if len(share) and np.isfinite(share).any():
            k = int(np.nanargmax(share))
            word = "dominates" if share[k] >= DOMINATES else "leads"
            text = f"{content['random_input'].to_numpy()[k]} {word}: {share[k]:.0%} of the variance of ranks"
            rows.append((f"scatter of {name}", text))
    return rows

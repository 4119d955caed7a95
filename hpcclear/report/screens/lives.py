"""Service lives of joints that wear (kind ``wear``): their first screen, and everything in lines."""

from collections.abc import Iterator

import numpy as np

from hpcclear.base.arrays import Booleans
from hpcclear.base.outcome import Flag, Status
from hpcclear.base.plain import counted
from hpcclear.report.figures.labels import between, quantity, stated
from hpcclear.report.html.content import Content
from hpcclear.report.html.markup import PageTable
from hpcclear.report.parts import SectionOf
from hpcclear.report.screen import (
    Screen,
    ScreenRow,
    ShareBar,
    Tile,
    Trust,
    amber,
    green,
    red,
    trusted,
    upper,
)
from hpcclear.results.content import Results, texts_in
from hpcclear.statistics.random.survival import fewest, order_interval, quantiles

HOUR = 3600.0
LIVES = ("service life", "service lives")

REASONS = {
    "cycles": "after wear.cycles, no limit reached",
    "clearance": "at wear.limit.clearance",
    "peak_contact_force": "at wear.limit.peak_contact_force",
    "objective": "at wear.limit.objective",
}
"""How lives end, by what the file has as their reason."""


def screen(lives: Results, content: Content) -> Screen:
    """Return the first screen of service lives."""
    if not followed(lives).any():
        failed = (red(text, "lives") for text in _failed(lives))
        return Screen("Every service life failed", trust=trusted(failed))
    rows = tuple(ScreenRow(name, tuple(cells)) for name, *cells in _clearances(lives))
    causes = [ShareBar(f"{name}, {joint}", share, np.nan) for joint, name, share in _inputs(lives)]
    named = ", ".join(f"{one.label} {one.share:.2f}" for one in causes)
    length = f"up to {_long(float(lives['cycle'][-1]))} revolutions"
    return Screen(
        _headline(lives),
        (f"{lives.sizes['life']} service lives", length),
        tiles=tuple(_tiles(lives)),
        header=("radial clearance", "new (median)", "final (median)", "5 to 95 %"),
        rows=rows,
        trust=trusted(_trust(lives)),
        bars=tuple(causes),
        causes=f"Squared rank correlation of wear with its main input: {named}." if named else "",
        figures=("wear", "survival"),
    )


def followed(lives: Results) -> Booleans:
    """Return which lives did not fail, (lives,)."""
    return np.isin(lives["ending"].values, [int(one) for one in filter(_lived, Status)])


def _lived(status: Status) -> bool:
    return status.valid or status is Status.WORN_THROUGH


def _is_limited(lives: Results) -> bool:
    return any(name.startswith("limit_") for name in lives.attrs)


def _headline(lives: Results) -> str:
    cycles = float(lives["cycle"][-1])
    if not _is_limited(lives):
        worst = int(np.argmax(np.nanmedian(lives["end_clearance"].values, axis=0)))
        name, _, end, _ = _clearances(lives)[worst]
        return f"After {_long(cycles)} revolutions the clearance of {name} is {end}"
    value, low, high = spread(lives, "lifetime", cycles)[0]
    if not value.startswith("beyond"):
        return f"Half of the machines reach {_limit(lives)} within {value} revolutions (95 % CI {low} to {high})"
    return f"More than half of the machines do not reach {_limit(lives)} within {_long(cycles)} revolutions"


def _limit(lives: Results) -> str:
    """The limit of a service life, where there is one of a clearance or a force."""
    limits = {name: float(lives.attrs[name]) for name in lives.attrs if name.startswith("limit_")}
    if list(limits) == ["limit_clearance"]:
        return f"a clearance of {quantity(limits['limit_clearance'], 'm')}"
    if list(limits) == ["limit_peak_contact_force"]:
        return f"a contact force of {quantity(limits['limit_peak_contact_force'], 'N')}"
    return "a limit"


def _long(count: float) -> str:
    """Four digits of a number of revolutions or hours, without an exponent, in groups of three."""
    short = float(f"{count:.4g}")
    return f"{short:.4g}" if short < 1e4 else f"{short:,.0f}".replace(",", "\N{NO-BREAK SPACE}")


def _tiles(lives: Results) -> Iterator[Tile]:
    cycles, last = float(lives["cycle"][-1]), lives.isel(cycle=-1)
    if _is_limited(lives):
        (median, low, high), (early, least, most), _ = spread(lives, "lifetime", cycles)
        yield Tile("median life, revolutions", median, within=f"95 % CI {low} to {high}")
        yield Tile("5th percentile, revolutions", early, within=f"95 % CI {least} to {most}")
        ends = (float(last[f"survival_{end}"]) for end in ("lower", "upper"))
        within = " to ".join(f"{100 * end:.0f} %" for end in ends)
        label, share = f"no limit reached, {_long(cycles)} rev.", 100 * float(last["survival"])
        yield Tile(label, f"{share:.0f} %", within=f"95 % CI {within}")
    for name, new, end, reach in _clearances(lives)[:1]:
        yield Tile(f"final clearance, {name}", end, new, within=reach and f"5 to 95 %: {reach}")


def _trust(lives: Results) -> Iterator[Trust]:
    count = lives.sizes["life"]
    yield from (amber(upper(text), "lives") for text in doubts(lives))
    failed = _failed(lives)
    yield from (amber(text, "lives") for text in failed)
    if not failed:
        yield green("No simulation failed", "lives")
    open_ = int((lives["end_reason"].values == "cycles").sum())
    if open_ and _is_limited(lives):
        text = f"{open_} of {count} lives reached no limit: raise wear.cycles for their length"
        yield amber(text, "lives")
    if count < (least := fewest(0.05)):
        text = f"the 5th percentile has no lower bound from {counted(count, *LIVES)}; {least} would give one"
        yield amber(f"{text} (wear.lives)", "lives")


def _failed(lives: Results) -> list[str]:
    """How many lives failed with each status, and the remedy."""
    codes = lives["ending"].values
    return [
        f"{count} of {len(codes)} lives {status.name.lower()}: {status.message}. {status.remedy}"
        for status in Status
        if not _lived(status) and (count := int((codes == status).sum()))
    ]


def doubts(content: Results) -> Iterator[str]:
    """Yield warnings on service lives, a sentence each: scatter of wear rates, motion before its steady state, grooves."""
    if unsure := int((content["flags"].values == Flag.TARGET_MISSED).sum()):
        yield f"in {counted(unsure, *LIVES)} wear rate or f scatters more than wear.tolerance; see clearance_limit"
    drift = content["drift"].values
    if moving := int((drift > content.attrs["tolerance"]).sum()):
        change = f"{100 * drift.max():.1f} % change with a longer transient"
        yield f"{counted(moving, *LIVES)} had not reached steady state ({change}); raise numerics.transient_revolutions"
    if "sharpest" in content and (narrow := int((content["sharpest"].values > 1.0).sum())):
        text = f"in {counted(narrow, *LIVES)} a groove is worn narrower than the journal, which would touch both of its edges"
        yield f"{text}; lower wear.harmonics"


def section(lives: Results, content: Content) -> list[object]:
    """What is known of service lives besides the first screen, in lines."""
    if not followed(lives).any():
        return []
    reasons = lives["end_reason"].values.tolist()
    ends = ((reasons.count(name), words) for name, words in REASONS.items())
    ended = [["ended", f"{count} {words}"] for count, words in ends if count]
    rows = [*ended, *_lifetimes(lives), *_profiles(lives)]
    return [PageTable(["quantity", "result"], rows, "Service lives")]


def _clearances(lives: Results) -> list[tuple[str, str, str, str]]:
    """Each joint with its new and final clearance, medians, and the range of the final one, "" where it has none."""
    rows = []
    at_end = quantiles(lives["end_clearance"].values, np.array([0.05, 0.5, 0.95]))
    (fresh,) = quantiles(lives["clearance"].isel(cycle=0).values, np.array([0.5]))
    for k, name in enumerate(texts_in(lives, "joint")):
        new = quantity(float(fresh[k]), "m")
        low, middle, high = map(float, at_end[:, k])
        ends = between(low, high, "m") if low < high else ""
        rows.append((name, new, quantity(middle, "m"), ends))
    return rows


def spread(lives: Results, name: str, beyond: float) -> list[tuple[str, str, str]]:
    """Return median, 5th and 95th percentile of lives in words, each with its interval; failed lives may be of any length."""
    every = lives[name].values
    known = every[~np.isnan(every)]

    def one(value: float) -> str:
        return _long(value) if value < np.inf else f"beyond {_long(beyond)}"

    shown = []
    for level in (0.5, 0.05, 0.95):
        low, high = order_interval(known, level, len(every) - len(known))
        ends = one(0.0 if np.isnan(low) else low), one(np.inf if np.isnan(high) else high)
        value = float(lives[f"{name}_quantile"].sel(quantile=level))
        if value < np.inf:
            value = float(stated(value, np.fmax(low, 0.0), np.fmin(high, beyond), "1")[0])
        shown.append((one(value), *ends))
    return shown


def _lifetimes(lives: Results) -> Iterator[list[str]]:
    """How long lives last, where a limit was given, and the share that is above the clearance's limit."""
    cycles, last = float(lives["cycle"][-1]), lives.isel(cycle=-1)
    each, followed = lives["revolution_time"].values / HOUR, lives["ended"].values
    text = f"at most {followed.max():.4g} revolutions, or {(followed * each).max():.4g} h"
    yield ["simulated", text]
    if not _is_limited(lives):
        yield ["service life", "no threshold given (wear.limit)"]
        return
    hours = float((cycles * each).min())
    for name, unit, beyond in ("lifetime", "revolutions", cycles), ("lifetime_hours", "h", hours):
        texts = []
        for value, least, most in spread(lives, name, beyond):
            within = "" if least == most == value else f" (95 % CI {least} to {most})"
            texts.append(value + within)
        text = "median {}; 5th percentile {}; 95th percentile {}".format(*texts)
        yield [f"service life, {unit}", text]
    for name in lives["joint"].values if "exceedance" in lives else ():
        one = last.sel(joint=name)
        low, high = float(one["exceedance_lower"]), float(one["exceedance_upper"])
        text = f"{float(one['exceedance']):.3g} (95 % CI {low:.3g} to {high:.3g})"
        yield [f"P(clearance {name} > limit)", text]


def _profiles(lives: Results) -> Iterator[list[str]]:
    """Wear where surfaces touch: the largest clearance around, and lives, beside uniform wear."""
    if "local_clearance" not in lives:
        return
    for k, name in enumerate(lives["joint"].values):
        largest = quantity(float(np.nanmedian(lives["end_clearance"][:, k])), "m")
        even = lives["even_clearance"].isel(cycle=-1).sel(joint=name).values
        known = np.isfinite(even).all()
        beside = f"; {quantity(float(np.median(even)), 'm')} with uniform wear" if known else ""
        yield [f"largest clearance, {name}", f"{largest} at the end{beside} (medians)"]
    if _is_limited(lives):
        cycles, parts = float(lives["cycle"][-1]), []
        for name in ("lifetime_quantile", "even_lifetime_quantile"):
            value = float(lives[name].sel(quantile=0.5))
            parts.append(f"{value:.4g}" if np.isfinite(value) else f"beyond {cycles:.4g}")
        yield ["median service life", f"{parts[0]}; {parts[1]} with uniform wear"]


def _inputs(lives: Results) -> Iterator[tuple[str, str, float]]:
    """The random input that decides most how fast each joint wears: joint, input, squared rank correlation."""
    for joint in texts_in(lives, "joint"):
        share = lives["rank_correlation"].sel(joint=joint).values ** 2
        if len(share) and np.isfinite(share).any():
            k = int(np.nanargmax(share))
            yield joint, str(lives["random_input"].values[k]), float(share[k])


PARTS = (SectionOf(10, "lives", "lives", "Service lives", section, "wear"),)

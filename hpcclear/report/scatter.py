"""Lines on the scatter of f: what contributes to it at one design and over the ranges, what tighter tolerances bring, chaos."""

from collections.abc import Iterator

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.report.figures.labels import quantity
from hpcclear.report.parts import LinesOf, Recommended
from hpcclear.report.spread import Line
from hpcclear.results.content import Results, number_in, texts_in

HALF_WIDTH = 1.96
"""Half-width of a 95 % confidence interval, standard errors."""


TIGHTENED = 3
"""Inputs that are named as those to tighten first."""

WORTH = 0.01
"""Reduction of the standard deviation below which an input is not named."""

COARSE = 0.00995
"""Half-width of a share from which on no decimal is printed."""

SMALL = 0.005
"""Share below which, half-width included, an input is listed without a number."""


def lines(of: Recommended) -> Iterator[Line]:
    """Yield what halving each tolerance brings, the largest first, and what the fit lacks; none where they are not known."""
    own = of.of_best("contributions")
    if own is None or not shares(own):
        return
    names, falls, errors, _ = _inputs(own, "halved")
    listed = _listed(list(zip(names, falls, HALF_WIDTH * errors, strict=True)))
    text = f"halving the scatter of one input lowers the standard deviation of f by: {listed}"
    if (rest := float(own["unexplained"])) >= 0.005:
        text += f". The cubic fit does not explain {100 * rest:.0f} % of the variance"
    yield Line("tolerances", text)


def _inputs(own: Results, kind: str) -> tuple[list[str], np.ndarray, np.ndarray, np.ndarray]:
    """Names of the random inputs that are known, a number of each, its standard error, and their rows, each (n,)."""
    rows = np.flatnonzero(np.isfinite(own["contribution"].values))
    values, errors = (own[f"{kind}{end}"].values[rows] for end in ("", "_error"))
    return [str(name) for name in own["input"].values[rows]], values, errors, rows


def shares(own: Results) -> list[tuple[str, float, float]]:
    """Return random inputs with shares of the variance and half-widths, the largest first; correlated ones together."""
    names, values, errors, rows = _inputs(own, "contribution")
    groups = own["group"].values[rows]
    parts = []
    for k, group in enumerate(groups.tolist()):
        its = np.flatnonzero(groups == group) if group > 0 else [k]
        if k == its[0]:
            joined = "+".join(names[i] for i in its) + (" (correlated)" if group > 0 else "")
            parts.append((joined, float(values[k]), HALF_WIDTH * float(errors[k])))
    return sorted(parts, key=lambda one: -one[1])


def tighten(own: Results) -> str:
    """Return which inputs to tighten first, and by how much the scatter then falls; "" where there are not several."""
    names, falls, errors, rows = _inputs(own, "halved")
    if len(rows) < 2:
        return ""
    prices = own["halving_cost"].values[rows] if "halving_cost" in own else np.array([])
    chosen, known = to_tighten(falls, errors, prices)
    if not chosen:
        return "none: no single input makes a significant part of the scatter"
    listed = ", ".join(f"{names[k]} (cost {prices[k]:+.3g})" if known else names[k] for k in chosen)
    fall, error = (number_in(own, f"halved_together{end}") for end in ("", "_error"))
    if not np.isfinite(fall):
        return listed  # a file of an earlier version lacks it
    text = f"{listed}: halving {'them together' if len(chosen) > 1 else 'it'} lowers the standard deviation of f by "
    text += f"{100 * fall:.0f} % ± {100 * _upwards(HALF_WIDTH * error, 0.01):.0f} %"
    return text + (", most for its cost" if known else "")


def to_tighten(falls: Array, errors: Array, prices: Array) -> tuple[list[int], bool]:
    """Return up to three inputs that bring most, or most for their prices, and whether these are known; arguments (n,)."""
    brings = falls > np.maximum(HALF_WIDTH * errors, WORTH)
    known = prices.size > 0 and bool((prices[brings] > 0.0).all())
    merit = falls / np.where(prices > 0.0, prices, 1.0) if known else falls
    return [int(k) for k in np.argsort(-merit, kind="stable") if brings[k]][:TIGHTENED], known


def _worst(of: Recommended) -> Iterator[Line]:
    """Yield the worst case of a design, and where it lies; none where it was not searched."""
    own = of.of_best("worst")
    if own is None:
        return
    value, corner = float(own["worst"]), float(own["worst_corner"])
    if not np.isfinite(value):
        return
    unit = str(own["worst"].attrs["units"])
    there = zip(*(own[key].values for key in ("input", "searched_at", "input_unit")), strict=True)
    listed = ", ".join(f"{n} = {quantity(float(x), str(u))}" for n, x, u in there if np.isfinite(x))
    text = f"f reaches at least {quantity(value, unit)} within the bounds of the random inputs, at {listed} "
    text += f"({int(own['tried'])} simulations"
    if np.isfinite(corner) and corner < value:
        text += f"; {quantity(corner, unit)} at their corners"
    text += "; the largest value found is a lower bound of the worst case)"
    loose = [str(one) for one in own["input"].values[own["without_bounds"].values != 0]]
    if loose:
        text += f". Without bounds, taken within three standard deviations: {', '.join(loose)}"
    yield Line("worst case", text)


def _listed(parts: list[tuple[str, float, float]]) -> str:
    """Names with shares and half-widths, the largest first."""
    ranked = sorted(parts, key=lambda one: -one[1])
    small = [name for name, value, width in ranked if value + width < SMALL]
    shown = [share(*one) for one in ranked if one[0] not in small]
    return ", ".join([*shown, *[f"{', '.join(small)} below {100 * SMALL:.1f} %"] * bool(small)])


def share(name: str, value: float, half_width: float) -> str:
    """Return a share with its half-width; one that is no larger than it is stated as not different from 0."""
    if value > half_width:
        places = 0 if half_width >= COARSE else 1
        shown = _upwards(half_width, 10.0 ** -(places + 2))
        return f"{name} {100 * value:.{places}f} ± {100 * shown:.{places}f} %"
    return f"{name} below {100 * max(half_width, value):.1f} %"


def _upwards(half_width: float, step: float) -> float:
    """A half-width in whole steps, no narrower than it is."""
    return float(max(np.ceil(half_width / step - 1e-9), 1.0) * step)


LITTLE = 0.01
"""Share of the variance of f below which chaotic scatter is not named."""

UNSURE = 0.1
"""Half-width of a Sobol index above which more samples are advised."""


def _indices(of: Recommended) -> Iterator[Line]:
    """Total Sobol indices with their errors, the largest first; none where they are not known."""
    found = of.files.get("sensitivity")
    if found is None or "sobol_total" not in found:
        return
    total, error = (found[f"sobol_total{end}"].values for end in ("", "_error"))
    if not total.size or not np.isfinite([total, error]).all():
        return
    parts = list(zip(texts_in(found, "parameter"), total, HALF_WIDTH * error, strict=True))
    words = "total Sobol indices, with all interactions (their sum may exceed 100 %)"
    yield Line("interactions", f"{words}: {_listed(parts)}")
    noise, doubt = (number_in(found, f"sobol_noise{end}") for end in ("", "_error"))
    if noise > HALF_WIDTH * doubt and noise > LITTLE:
        text = f"{share('chaotic scatter', noise, HALF_WIDTH * doubt)} of the variance over the study's ranges, "
        yield Line("chaotic scatter", text + "by perturbed runs; the total indices are without it")


def half_width(found: Results | None) -> float:
    """Return the largest half-width of a Sobol index of a file (kind ``sensitivity``); 0 where it has none."""
    names = [f"sobol_{kind}_error" for kind in ("first", "total")]
    errors = [found[name].values for name in names if found is not None and name in found]
    return max((HALF_WIDTH * float(np.nanmax(one)) for one in errors if one.size), default=0.0)


SOME = 0.05
"""Share of samples that change with a perturbation above which a design is called sensitive to initial conditions."""

LARGE = 0.1
"""Share of the variance above which chaotic scatter is worth more revolutions."""


def _chaos(of: Recommended) -> Iterator[Line]:
    """Share of the design's variance that is chaos, and how many designs are chaotic; none if it was not simulated."""
    own = of.of_best("chaos")
    if own is None:
        return
    moved = of.files["chaos"]["chaotic"].values > SOME
    text = f"{int(moved.sum())} of {moved.size} designs are sensitive to initial conditions"
    if not float(own["chaotic"]) > SOME:
        text += "; this one is not: perturbations of 1e-9, relative, leave its samples unchanged"
    else:
        changed, explained = (100 * float(own[name]) for name in ("chaotic", "chaos_share"))
        text += f". Relative perturbations of 1e-9 change {changed:.0f} % of this design's samples"
        text += f" and explain {explained:.0f} % of its variance"
    yield Line("chaos", text)


def _steps(of: Recommended) -> Iterator[str]:
    own = of.of_best("chaos")
    if own is not None and float(own["chaos_share"]) > LARGE:
        yield "a larger numerics.averaged_revolutions, since chaotic scatter decreases with it"


PARTS = (
    LinesOf(20, lines),
    LinesOf(30, _worst),
    LinesOf(40, _indices),
    LinesOf(80, _chaos, _steps),
)

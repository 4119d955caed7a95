"""Lines on the scatter of one design: which random inputs contribute to its variance, and what tighter tolerances bring."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from hpcclear.report.figures.labels import quantity
from hpcclear.report.spread import Line
from hpcclear.results.content import Results

if TYPE_CHECKING:
    from hpcclear.statistics.sensitivity.contributions import Falls

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


def lines(files: Mapping[str, Results], best: Results) -> Iterator[Line]:
    """Yield contributions to the variance at a design, and what halving each tolerance brings, the largest first; none where
    they are not known."""
    found, name = files.get("contributions"), str(best["design"].item())
    if found is None or name not in found["design"].to_numpy():
        return
    own = found.sel(design=name)
    rows = np.flatnonzero(np.isfinite(own["contribution"].to_numpy()))
    if not len(rows):
        return
    names = own["input"].to_numpy()[rows]
    groups = (own["group"] if "group" in own else own["together"]).to_numpy()[rows]
    shares, falls = (
        (own[kind].to_numpy()[rows], own[f"{kind}_error"].to_numpy()[rows])
        for kind in ("contribution", "halved")
    )
    parts = [(str(names[k]), *(one[k] for one in shares)) for k in np.flatnonzero(groups == 0)]
    for group in dict.fromkeys(groups[groups > 0].tolist()):
        its = groups == group
        joined = "+".join(map(str, names[its])) + " (correlated)"
        parts.append((joined, *(one[its][0] for one in shares)))
    text = (
        f"random inputs to the variance of f at this design (± 95 % half-width): {_listed(parts)}"
    )
    if (rest := float(own["unexplained"])) >= 0.005:
        text += (
            f". The cubic fit does not explain {rest:.0%}: finer structure of f, interactions of three inputs, chaotic "
            "motion"
        )
    yield Line("contributions", text)
    each = [(str(names[k]), *(one[k] for one in falls)) for k in range(len(rows))]
    yield Line(
        "tolerances",
        f"halving the scatter of one input lowers the standard deviation of f by: {_listed(each)}",
    )
    prices = own["halving_cost"].to_numpy()[rows] if "halving_cost" in own else np.array([])
    if len(rows) > 1:
        joint = [float(own.get(f"halved_together{end}", np.nan)) for end in ("", "_error")]
        from hpcclear.statistics.sensitivity.contributions import Falls  # loads SciPy

        singly = Falls.of(falls[0], lambda _: (joint[0], joint[1]))
        yield Line("tighten first", _first(list(map(str, names)), singly, falls[1], prices))


def to_tighten(
    falls: np.ndarray, errors: np.ndarray, prices: np.ndarray
) -> tuple[list[int], bool]:  # fmt: skip
    """Return which inputs to tighten first, three at most, and whether by their prices: those that bring most, or most for
    what it costs where that is known; `falls`, their `errors` and `prices` (n,)."""
    brings = falls > np.maximum(HALF_WIDTH * errors, WORTH)
    known = prices.size > 0 and bool((prices[brings] > 0.0).all())
    merit = falls / np.where(prices > 0.0, prices, 1.0) if known else falls
    return [int(k) for k in np.argsort(-merit, kind="stable") if brings[k]][:TIGHTENED], known


def _first(names: list[str], falls: "Falls", errors: np.ndarray, prices: np.ndarray) -> str:
    """Which inputs to tighten first, and by how much the scatter then falls."""
    chosen, known = to_tighten(falls, errors, prices)
    if not chosen:
        return "none: no single input makes a significant part of the scatter"
    listed = ", ".join(f"{names[k]} (cost {prices[k]:+.3g})" if known else names[k] for k in chosen)
    fall, error = falls.together(chosen)
    if not np.isfinite(fall):
        return listed  # a file of an earlier version lacks it
    text = f"{listed}: halving {'them together' if len(chosen) > 1 else 'it'} lowers the standard deviation of f by "
    text += f"{fall:.0%} ± {_upwards(HALF_WIDTH * error, 0.01):.0%}"
    return text + (", most for its cost" if known else "")


def worst(files: Mapping[str, Results], best: Results) -> Iterator[Line]:
    """Yield the worst case of a design, and where it lies; none where it was not searched."""
    found, name = files.get("worst"), str(best["design"].item())
    if found is None or name not in found["design"].to_numpy():
        return
    own = found.sel(design=name)
    value, corner = float(own["worst"]), float(own["worst_corner"])
    if not np.isfinite(value):
        return
    unit = str(own["worst"].attrs["units"])
    there = zip(
        *(own[key].to_numpy() for key in ("input", "searched_at", "input_unit")), strict=True
    )
    listed = ", ".join(f"{n} = {quantity(float(x), str(u))}" for n, x, u in there if np.isfinite(x))
    text = f"f reaches at least {quantity(value, unit)} within the bounds of the random inputs, at {listed} "
    text += f"({int(own['tried'])} simulations"
    if np.isfinite(corner) and corner < value:
        text += f"; {quantity(corner, unit)} at their corners"
    text += "; the largest value found is a lower bound of the worst case)"
    loose = [str(one) for one in own["input"].to_numpy()[own["without_bounds"].to_numpy() != 0]]
    if loose:
        text += f". Without bounds, taken within three standard deviations: {', '.join(loose)}"
    yield Line("worst case", text)


def _listed(parts: list[tuple[str, float, float]]) -> str:
    """Names with shares and half-widths, the largest first."""
    ranked = [(n, v, HALF_WIDTH * e) for n, v, e in sorted(parts, key=lambda one: -one[1])]
    small = [name for name, value, width in ranked if value + width < SMALL]
    shown = [share(*one) for one in ranked if one[0] not in small]
    return ", ".join([*shown, *[f"{', '.join(small)} below {SMALL:.1%}"] * bool(small)])


def share(name: str, value: float, half_width: float) -> str:
    """Return a share with its half-width; one that is no larger than it is stated as not different from 0."""
    if value > half_width:
        places = 0 if half_width >= COARSE else 1
        shown = _upwards(half_width, 10.0 ** -(places + 2))
        return f"{name} {value:.{places}%} ± {shown:.{places}%}"
    return f"{name} below {max(half_width, value):.1%}"


def _upwards(half_width: float, step: float) -> float:
    """A half-width in whole steps, no narrower than it is."""
    return float(max(np.ceil(half_width / step - 1e-9), 1.0) * step)

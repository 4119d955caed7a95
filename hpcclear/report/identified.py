"""What a file of kind ``identify`` says, in lines for the terminal and the page."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from hpcclear.report.figures.labels import quantity, stated
from hpcclear.report.spread import Line
from hpcclear.results.content import Results

NARROWED = 0.8
"""Share of the bounds' range above which an interval says next to nothing."""

TOGETHER = 0.9
"""Correlation of two unknowns from which on the signal gives their combination only."""

DAY = 86400.0


def lines(content: Results) -> Iterator[Line]:
    """Yield what was identified: unknowns by record, fit, growth, and what to measure."""
    if "interval" in content:
        yield from _records(content)
    if "rate" in content:
        yield from _growth(content)
    if "expected_half_width" in content:
        yield from _advice(content)


def short(name: object) -> str:
    """Return a scene path without its first table, to leave space on a terminal."""
    return str(name).removeprefix("mechanism.").removeprefix("joints.").removesuffix(".clearance")


def named(name: object) -> str:
    """Return what an unknown is called where it stands alone."""
    kind = "radial clearance of " if str(name).endswith(".clearance") else ""
    return kind + short(name)


def _records(content: Results) -> Iterator[Line]:
    for k, record in enumerate(content["record"].values):
        before = f"{Path(str(record)).name}: " if content.sizes["record"] > 1 else ""
        for u, name in enumerate(content["unknown"].values):
            yield Line(named(name), before + interval(content, k, u))
        if content.sizes["unknown"] > 1 and int(content["explained"][k]):
            yield Line("together", before + _together(content, k))
        share, factor = (content[name].values[k] for name in ("coverage", "widening"))
        shown = " and ".join(f"{100 * one:.0f} %" for one in share)
        wider = " and ".join(f"{one:.2g}" for one in factor)
        text = f"{shown} of simulated machines lie in their 95 % interval; intervals widened by the factor {wider}"
        yield Line("calibration", before + text)


def _together(content: Results, record: int) -> str:
    """Say whether unknowns are identified separately; where they are not, the combination that is."""
    related = float(content["correlation"][record])
    if abs(related) <= TOGETHER:
        return f"identified separately (correlation {related:.2f})"
    names = [short(name) for name in content["unknown"].values]
    (unit, *other) = set(content["unit"].values.astype(str))
    text = f"not identified separately (correlation {related:.2f})"
    if other:
        return text
    places = content["posterior"].values[record, :, : len(names)]
    weights = np.linalg.eigh(np.cov(places.T))[1][:, 0]  # the direction of the least variance
    weights = weights / np.abs(weights).sum() * np.sign(weights[np.argmax(np.abs(weights))])
    low, middle, high = np.quantile(places @ weights, (0.025, 0.5, 0.975))
    signed = (f"{'-' if weight < 0.0 else '+'} {abs(weight):.2f}" for weight in weights)
    terms = " ".join(map(" ".join, zip(signed, names, strict=True)))
    shown, ends = stated(middle, low, high, unit)
    return f"{text}, only {terms.removeprefix('+ ')} = {shown} (95 % interval {ends})"


def interval(content: Results, record: int, unknown: int) -> str:
    """Return the median and interval of an unknown, no more digits than the interval allows; a bound where it is cut off."""
    unit = str(content["unit"].values[unknown])
    if not int(content["explained"][record]):
        return "not identified: the model does not explain this signal"
    low, middle, high = (float(one) for one in content["interval"][record, unknown])
    least, most = (float(content[f"prior_{end}"][unknown]) for end in ("lower", "upper"))
    span = most - least
    shown, ends = stated(middle, low, high, unit)
    if high - low > NARROWED * span:
        return f"not determined: 95 % interval {ends}"
    if low - least < 0.02 * span:
        shown, ends = f"at most {quantity(high, unit, 2)}", f"{ends}; the lower bound cuts it off"
    elif most - high < 0.02 * span:
        shown, ends = f"at least {quantity(low, unit, 2)}", f"{ends}; the upper bound cuts it off"
    return f"{shown} (95 % interval {ends})"


def _growth(content: Results) -> Iterator[Line]:
    used, every = int(content["explained"].values.sum()), content.sizes["record"]
    of = f", from the {used} of {every} records that the model explains" if used < every else ""
    for u, name in enumerate(content["unknown"].values):
        unit = str(content["unit"].values[u])
        low, middle, high = (float(one) * DAY for one in content["rate"][:, u])
        shown, ends = stated(middle, low, high, unit)
        text = f"{shown} per day (95 % interval {ends}){of}"
        yield Line(f"growth, {named(name)}", text)
        if "limit" in content.attrs:
            times = content["time_to_limit"].values[:, u] / DAY
            days = [f"{quantity(t, '1', 2)} days" if np.isfinite(t) else "never" for t in times]
            limit = quantity(float(content.attrs["limit"]), unit)
            text = f"{days[1]} (95 % interval {days[0]} to {days[2]}), if it grows as before"
            yield Line(f"time to {limit}, {named(name)}", text)


def _advice(content: Results) -> Iterator[Line]:
    counts = content["revolutions"].values
    for k, name in enumerate(content["candidate"].values):
        parts = []
        for u, unknown in enumerate(content["unknown"].values):
            unit = str(content["unit"].values[u])
            pairs = zip(content["expected_half_width"].values[k, :, u], counts, strict=True)
            shown = (f"{quantity(float(width), unit, 2)} ({count})" for width, count in pairs)
            parts.append(f"{short(unknown)} ± {', '.join(shown)}")
        if len(parts) > 1:
            related = float(content["expected_correlation"][k, -1])
            parts.append(f"correlation of errors {related:.2f} ({counts[-1]})")
        yield Line(f"by {name}", f"{'; '.join(parts)} revolutions")


def warnings(content: Results) -> Iterator[str]:
    """Yield what makes a result doubtful."""
    for k, record in enumerate(content["record"].values if "record" in content else ()):
        doubt = float(content["doubt"][k])
        worst = str(content["feature"].values[int(content["worst_feature"][k])])
        if not int(content["explained"][k]):
            text = f"this model does not explain the signal {record} (standard score {doubt:.1f}); the feature that fits "
            yield f"{text}least is the {worst}. Check the scene, the sensor and the bounds"
        related = float(content["correlation"][k])
        if abs(related) > TOGETHER:
            text = f"the unknowns are not identified separately from {record}: their largest correlation is "
            yield f"{text}{related:.2f}"

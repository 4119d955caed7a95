"""Numbers of a report's page, and of the files it is made of. Only of three digits and more: shorter ones are in any file."""

import json
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
import opened
import xarray as xr
from scipy import stats
from test_report import Tree

from hpcclear.base.arrays import Array
from hpcclear.report.html.page import write_report
from hpcclear.report.scatter import HALF_WIDTH

NUMBER = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?)(?:e([-+]?\d+))?(?![\w.]*\d)")
TELLING = 3
LISTED = ("samples", "kriging", "front", "response")
"""Kinds whose numbers are drawn, or told in sum: in so many any number would be found."""


class Cells(Tree):
    """Its texts apart, cells and tiles too."""

    def handle_data(self, text: str) -> None:
        super().handle_data(f" {text} ")


GoalValue = tuple[str, float, float]


def told(text: str) -> Iterator[GoalValue]:
    """Numbers of a text that tell something, and from where to where what they stand for lies, as 1 to 10."""
    for match in NUMBER.finditer(text):
        digits = match[1].replace(".", "").lstrip("0")
        if len(digits) >= TELLING:
            unit = 10.0 ** (1 - len(digits))
            value = int(digits) * unit
            yield match[0], value - 0.501 * unit, value + 0.501 * unit


def held(content: xr.Dataset) -> Iterator[float]:
    """All that a file says as a number or in words; of long lists only how long they are."""
    texts = [str(text) for text in content.attrs.values()]
    yield from map(float, content.sizes.values())
    for variable in content.variables.values():
        texts += [str(text) for text in variable.attrs.values()]
        if variable.dtype.kind not in "fiu":
            texts += [str(text) for text in np.ravel(variable.to_numpy())]
        elif content.attrs["hpcclear_kind"] not in LISTED:
            yield from np.ravel(variable.to_numpy()).astype(float)
    for text in texts:
        yield from (0.5 * (low + high) for _, low, high in told(text))


def summed(content: xr.Dataset) -> Iterator[float]:
    """What the page works out of a file: each line is a number that a reader can work out again."""
    kind = content.attrs["hpcclear_kind"]
    if kind == "samples":
        for name in ("objective", "rhs_evaluations"):
            yield from (float(content[name].min()), float(content[name].max()))
        yield float(content["rhs_evaluations"].sum())
        f = content["objective"].to_numpy()
        f = f[np.isfinite(f)]
        if len(f) > 1:
            yield from (float(f.mean()), float(f.std(ddof=1)))
            yield float(np.quantile(f, 0.5, method="hazen"))
    if kind == "verification":
        for name in ("mean", "deviation"):  # half as wide as limits, and against the original
            yield from np.ravel(0.5 * (content[f"{name}_upper"] - content[f"{name}_lower"]))
            true = content[f"{name}_true"].to_numpy()
            yield from np.ravel(true[:, None] / true[None, :] - 1.0)
    if kind == "contributions":
        for name in ("contribution_error", "halved_error"):  # half-widths at 95 %
            yield from np.ravel(HALF_WIDTH * content[name])
    if kind == "timing":
        parts = [content[name] for name in ("busy", "idle", "compile", "write")]
        for part in (*parts, *([content["samples"]] if "samples" in content else [])):
            yield from np.ravel(part.sum("stage"))
        yield from np.ravel(sum(part.sum("stage") for part in parts))
        if "samples" in content:
            simulated = content["samples"] > 0
            yield float(content["samples"].sum() / content["busy"].where(simulated).sum())
        yield from _savings(json.loads(content.attrs.get("seconds_per_sample_by_round", "{}")))
    if kind == "response":
        yield from _loads(content)
    if kind == "accuracy":
        yield from np.ravel(content["averaged"] * content["turn_seconds"])
        yield from np.ravel(content["training"] * content["sample_seconds"])


def _savings(times: dict[str, list[float]]) -> Iterator[float]:
    """Run time saved in pairs of a round, and its half-width at 95 %, which is rounded up."""
    for name, here in times.items():
        shares = 1.0 - np.array(here) / times["all on"]
        if name != "all on":
            error = shares.std(ddof=1) / len(shares) ** 0.5
            half = float(stats.t.ppf(0.975, len(shares) - 1) * error)
            yield from (float(shares.mean()), half, np.ceil(100.0 * half))


def _loads(content: xr.Dataset) -> Iterator[float]:
    """Forces, contact and torque over the averaged revolutions, work over angle, and the recorded peaks and gaps."""
    first = int(content.attrs.get("transient_turns", 0))
    angle = content["crank_angle"].to_numpy()
    inside = np.abs(angle - angle[0]) / (2.0 * np.pi) > first - 1e-6
    time = content["time"].to_numpy()[inside]
    for name in ("contact_force", "crank_moment"):
        values = content[name].to_numpy()[inside]
        yield from np.ravel(np.trapezoid(values, time, axis=0) / (time[-1] - time[0]))
        yield from np.ravel(np.abs(values).max(axis=0))
    work = content["driving_work"].to_numpy()[inside]
    turned = angle[inside]
    yield float((work[-1] - work[0]) / (turned[-1] - turned[0]))
    touching = (content["penetration"].to_numpy()[inside] > 0.0).astype(float)
    yield from np.ravel(np.trapezoid(touching, time, axis=0) / (time[-1] - time[0]))
    for name in ("peak_contact_force", "mean_gap", "objective", "objective_uncertainty"):
        yield from np.ravel(content[name].to_numpy()).astype(float)
    at = content["contact_force"].to_numpy()[inside].argmax(axis=0)
    yield from np.degrees(content["crank_angle"].to_numpy()[inside][at] % (2.0 * np.pi))


def contents(place: Path) -> list[xr.Dataset]:
    return [opened.read(path) for path in sorted(place.rglob("*.nc"))]


def shown(place: Path) -> str:
    return Cells(write_report(place).read_text(encoding="utf-8")).text


def leading(values: Iterable[float]) -> Array:
    """Values as 1 to 10, in order."""
    sizes = np.abs(np.fromiter(values, float))
    return np.sort(10.0 ** (np.log10(sizes[np.isfinite(sizes) & (sizes > 0.0)]) % 1.0))


def foreign(numbers: Iterable[GoalValue], known: Array) -> list[str]:
    """Numbers that are none of the known ones."""
    return [
        text
        for text, low, high in numbers
        if np.searchsorted(known, low) == np.searchsorted(known, high, side="right")
    ]


def check(place: Path) -> None:
    """That every number of the page is found in its files, or worked out of them."""
    numbers = list(told(shown(place)))
    assert len(numbers) > 10
    known = leading(x for one in contents(place) for x in (*held(one), *summed(one)))
    assert foreign(numbers, known) == []

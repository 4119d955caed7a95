"""How the results of a batch of samples are spread: statistics with confidence intervals, and warnings of its samples.

The `sample` command prints these lines, and the page shows them. No number is stated that the samples do not determine.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError, at, nearest
from hpcclear.base.objectives import Objective
from hpcclear.base.outcome import FIELDS, Status
from hpcclear.base.plain import counted
from hpcclear.base.student import student
from hpcclear.base.units import to_si
from hpcclear.report import bearings
from hpcclear.report.figures import labels
from hpcclear.report.html.content import scene_of
from hpcclear.results.content import Results, texts_in
from hpcclear.results.names import KINDS
from hpcclear.scene.study_tables import DRAWN
from hpcclear.statistics.random.survival import CONFIDENCE, fewest, order_interval, share_interval

LEVELS = (0.5, 0.95, 0.99)
"""Probabilities of the quantiles that are stated."""

INDEPENDENT = "computed for independent samples"
USUALLY_WIDER = f"{INDEPENDENT}; with this sampling true intervals are usually narrower"
CHOSEN = "none: the designs were chosen, not sampled at random"


class StatedValue(NamedTuple):
    """A statistic with its confidence interval, in a unit of the result file; NaN where not stated."""

    value: float = np.nan
    lower: float = np.nan
    upper: float = np.nan
    unit: str = ""

    @property
    def known(self) -> bool:
        """Whether there is a number."""
        return bool(np.isfinite(self.value))


class Line(NamedTuple):
    """One line: its subject, its text, and the numbers of the text where there are some."""

    label: str
    text: str
    estimate: StatedValue = StatedValue()


Lines = Mapping[str, Mapping[str, Line]]
"""Lines of several samples: by the name of each, then by label."""


class Beyond(NamedTuple):
    """A threshold of a result: a variable of the samples, the value to exceed, SI, and a joint; "" for the largest of all."""

    name: str
    value: float
    joint: str = ""


def beyond(units: Mapping[str, str], words: str, joints: Sequence[str] = ()) -> Beyond:
    """Return the threshold that a user writes as ``"3 kN"`` (of f) or ``"peak_contact_force crank_rod=3 kN"``.

    `units`: SI unit of each result, by its name; `joints`: those that may follow the name, as in the headings of tables. Raises
    InputError: there is no such result or joint, or the value has another unit or none.
    """
    heading, equals, text = (part.strip().strip("\"'") for part in words.rpartition("="))
    name, _, joint = (heading if equals else "objective").partition(" ")
    if name not in units:
        remedy = nearest(name, sorted(units))
        raise InputError("--beyond", words, f"samples have no result {name!r}", remedy)
    known = joints if _of_joints(name) else ()
    if joint and joint not in known:
        remedy = nearest(joint, list(known)) if known else "Leave the joint out"
        raise InputError("--beyond", words, f"{name} has no joint {joint!r}", remedy)
    unit = units[name].removeprefix("1")
    plain = np.nan
    with suppress(ValueError):
        plain = float(text)
    if np.isfinite(plain) and unit:
        usual = {"m": "mm", "N": "kN", "Pa": "MPa"}.get(unit, unit)
        remedy = f'Write it with a unit that fits {unit}, such as "{text} {usual}"'
        raise InputError("--beyond", words, "the value has no unit", remedy)
    if np.isfinite(plain):
        return Beyond(name, plain, joint)
    with at("--beyond", words):
        return Beyond(name, to_si(text, unit), joint)


def _of_joints(name: str) -> bool:
    return name in FIELDS and "joint" in FIELDS[name].per


def units_of(objective: Objective) -> dict[str, str]:
    """Return the SI unit of each result that samples may have, by its name, for an objective."""
    rows = {name: row.of(objective) for name, row in KINDS["samples"].data.items()}
    return {name: row.units for name, row in rows.items() if row.dtype == "f8"}


def statistics(samples: Results, thresholds: Sequence[Beyond] = ()) -> list[Line]:
    """Return mean, standard deviation and quantiles of f, the 95th percentile of each peak force, and shares beyond thresholds,
    of samples (kind ``samples``); none where fewer than two succeeded.

    Failed samples are left out of moments; the intervals of quantiles and shares hold whatever these were. Without the
    attribute ``sampling`` there are no intervals.
    """
    method = str(samples.attrs.get("sampling", ""))
    f = _values(samples, "objective")
    known = f[np.isfinite(f)]
    if len(known) < 2:
        return []
    unit, drawn = str(samples["objective"].attrs["units"]), method in DRAWN
    lines = [Line("sampling", DRAWN[method])] if drawn else []
    lines += _moments(known, unit, drawn)
    for level in LEVELS if drawn else LEVELS[:1]:
        label = f"P{100 * level:.0f} of f" if level != 0.5 else "median of f"
        lines.append(Line(label, *_quantile(f, level, unit, drawn)))
    for joint in samples["joint"].values if drawn else ():
        peak = samples["peak_contact_force"].sel(joint=joint).values
        if np.nanmax(peak, initial=0.0) > 0.0:
            lines.append(Line(f"P95 peak force, {joint}", *_quantile(peak, 0.95, "N", drawn)))
    lines += shares(samples, thresholds)
    lines += _length_of_peaks(samples)
    if len(known) < len(f):
        left_out = f"{len(f) - len(known)} of {len(f)}, left out of mean and standard deviation"
        lines.append(Line("failed", left_out))
    how = (INDEPENDENT if method == "monte-carlo" else USUALLY_WIDER) if drawn else CHOSEN
    return [*lines, Line("intervals", how)]


def in_time(samples: Results) -> Iterator[Line]:
    """Yield how well f is known in each sample: its half-width, and its standard deviation between revolutions."""
    name = "objective_limit" if "objective_limit" in samples else "objective_uncertainty"
    f, remedy = np.abs(samples["objective"].values), "a response has one (hpcclear simulate)"
    if "objective" not in samples.attrs:
        remedy = "set numerics.target_error for one of each sample"
    columns = {"half-width of f": name, "cycle-to-cycle std. dev.": "objective_spread"}
    for label, column in columns.items():
        parts = samples[column].values / f if column in samples else np.array([])
        if np.isfinite(parts).any():
            text = f"median {100 * np.nanmedian(parts):.2f} %, largest {100 * np.nanmax(parts):.2f} % of f"
            yield Line(label, text)
        elif column == name:
            yield Line(label, f"{labels.NOT_CHECKED}; {remedy}")


def shares(samples: Results, thresholds: Sequence[Beyond]) -> list[Line]:
    """Return the share of samples beyond each threshold."""
    drawn = str(samples.attrs.get("sampling", "")) in DRAWN
    return [_share(samples, one, drawn) for one in thresholds]


def side_by_side(
    every: Mapping[str, Results], thresholds: Sequence[str] = ()
) -> dict[str, dict[str, Line]]:
    """Return the lines of `statistics` of several samples, by their names, then by label; thresholds as `beyond` reads them."""
    found = {}
    for name, samples in every.items():
        units = {str(key): row.attrs.get("units", "1") for key, row in samples.data_vars.items()}
        levels = [beyond(units, words, texts_in(samples, "joint")) for words in thresholds]
        count = samples.sizes["sample"]
        lines = [Line("samples", str(count), StatedValue(count)), *statistics(samples, levels)]
        found[name] = {line.label: line for line in lines}
    return found


def rows_of(found: Lines) -> list[list[str]]:
    """Return the texts of `side_by_side` in rows: a label, then a text of each samples, "" where one has no such line."""
    names = dict.fromkeys(label for lines in found.values() for label in lines)
    every = ([lines.get(label, Line("", "")).text for lines in found.values()] for label in names)
    return [[label, *texts] for label, texts in zip(names, every, strict=True)]


def remarks(samples: Results) -> list[str]:
    """Return what the warnings of `simulate` say of these samples, each with the number of samples that it is about."""
    good = samples["status"].values == Status.OK
    found = []
    f, half_width = (_values(samples, f"objective{end}") for end in ("", "_uncertainty"))
    sensitive = half_width > bearings.SENSITIVE * np.abs(f)
    if "regime" not in samples and sensitive.any():
        worst = float(np.nanmax((half_width / np.abs(f))[sensitive]))
        found.append((int(sensitive.sum()), bearings.sensitive_words(worst, samples)))
    flags = samples["flags"].values
    counts = [(int((good & ((flags & flag) != 0)).sum()), flag) for flag in bearings.WARNED]
    found += [(count, bearings.REMARKS[flag]) for count, flag in counts if count]
    return [f"{count} of {len(f)} samples: {text}" for count, text in found]


def _length_of_peaks(samples: Results) -> Iterator[Line]:
    """Of how many revolutions each peak is the largest, since it grows with their number."""
    scene = scene_of(samples)
    if scene is not None and scene.numerics.target_error is None:
        count = scene.numerics.averaged_revolutions
        yield Line("peaks", f"largest of {counted(count, 'revolution')}")


def _values(samples: Results, name: str) -> Array:
    """A result of each sample, shape (n,); at joints the largest."""
    values = samples[name].values
    return values.max(axis=1) if values.ndim > 1 else values


def _moments(known: Array, unit: str, drawn: bool) -> list[Line]:
    # loads SciPy, which a page without samples does not need
    from hpcclear.statistics.random.replicates import moments

    mean, deviation = moments(known[:, None])  # each sample is a replicate
    if not drawn or not np.isfinite(mean.value):
        plain = (float(known.mean()), float(known.std(ddof=1)))
        found = [StatedValue(value, unit=unit) for value in plain]
        texts = [labels.quantity(value, unit) for value in plain]
        texts = [f"{t}, interval not stated: too few samples" for t in texts] if drawn else texts
    else:
        pairs = [(m.value, student(CONFIDENCE, mean.freedom) * m.error) for m in (mean, deviation)]
        found = [StatedValue(value, value - half, value + half, unit) for value, half in pairs]
        texts = [labels.with_half_width(value, half, unit) for value, half in pairs]
    names = ("mean of f", "std. deviation of f")
    return [Line(*one) for one in zip(names, texts, found, strict=True)]


def _quantile(values: Array, level: float, unit: str, drawn: bool) -> tuple[str, StatedValue]:
    """A quantile with its confidence interval by the order of the values; not stated where the samples do not reach so far."""
    known = values[np.isfinite(values)]
    value = float(np.quantile(known, level, method="hazen"))
    if not drawn:
        return labels.quantity(value, unit), StatedValue(value, unit=unit)
    failed = len(values) - len(known)
    low, high = order_interval(known, level, failed)
    if np.isfinite([low, high]).all():
        shown, ends = labels.stated(value, low, high, unit)
        return f"{shown} ({ends})", StatedValue(value, low, high, unit)
    if failed and len(values) >= fewest(level):
        return "not stated: too many samples failed", StatedValue()
    return f"not stated: it needs {fewest(level)} samples", StatedValue()


def _share(samples: Results, one: Beyond, drawn: bool) -> Line:
    """Share of samples beyond a threshold, with Clopper and Pearson's confidence interval."""
    if one.name not in samples:
        return Line(one.name, "not recorded in these samples")
    chosen = samples.sel(joint=[one.joint]) if one.joint else samples
    values = _values(chosen, one.name)
    failed, total = int(np.isnan(values).sum()), len(values)
    above = int((values > one.value).sum())
    name = "f" if one.name == "objective" else one.name.replace("_", " ")
    if _of_joints(one.name):
        name += f" {one.joint or 'in any joint'}"
    label = f"{name} > {labels.quantity(one.value, str(samples[one.name].attrs['units']))}"
    share, low, high = above / (total - failed) if total > failed else np.nan, np.nan, np.nan
    text = f"{percent(share)} of the samples" if total > failed else "–"
    if drawn and total > failed:
        low = float(share_interval(above, total)[0])
        high = float(share_interval(above + failed, total)[1])
        text = f"{text} ({percent(low)} to {percent(high)})"
    return Line(label, text, StatedValue(100.0 * share, 100.0 * low, 100.0 * high, "%"))


def percent(share: float) -> str:
    """Return a share in per cent, three digits."""
    return f"{100.0 * share:.3g} %"

"""What the commands that simulate many designs print."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich import box
from rich.table import Table

from hpcclear.base.outcome import Regime, Status
from hpcclear.cli.terminal import console, counted, fitting, objective_of, quantity, remark, table
from hpcclear.ranks.progress import duration
from hpcclear.report import spread
from hpcclear.report.answer import answer
from hpcclear.report.beside import beside_original
from hpcclear.report.failures import explained
from hpcclear.report.figures import labels
from hpcclear.report.parts import LinesOf, declared
from hpcclear.results import dataset
from hpcclear.results.content import Results

if TYPE_CHECKING:
    from hpcclear.ensemble.session import Finished


def _load(found: "Finished") -> list[tuple[str, str]]:
    """Wall time, and how every rank spent it."""
    words = "busy {:.2f} s, idle {:.2f} s, compile {:.2f} s, write {:.2f} s"
    ranks = [(f"rank {rank}", words.format(*row)) for rank, row in enumerate(found.spent)]
    return [("wall time", f"{found.seconds:.1f} s"), *ranks]


def describe_statistics(found: "Finished") -> None:
    """Print mean and standard deviation of f, the error of the mean, failures and load of a streamed Monte Carlo."""
    out, content = console(), found.content
    by_status = content["samples_by_status"]
    total, good = int(np.sum(by_status)), int(by_status.sel(outcome=int(Status.OK)))
    rows = [("simulated", f"{good} of {total} without failure")]
    if int(content["objective_count"]) > 1:
        mean, deviation = (float(content[f"objective_{n}"]) for n in ("mean", "deviation"))
        error = deviation / int(content["objective_count"]) ** 0.5
        words, unit = objective_of(content)
        rows.append(("f", words))
        shown = f"{quantity(mean, unit, 6)}, standard error {quantity(error, unit, 2)}"
        rows.append(("mean of f", shown))
        rows.append(("std. deviation of f", quantity(deviation, unit)))
        rows.append(("half-width of a single f", labels.NOT_CHECKED))
    out.print(table("Statistics", rows))
    out.print(table("Run", _load(found)))
    out.print(f"statistics {found.output}")


def describe_study(place: Path) -> None:
    """Print the ends of its fronts beside the baseline, the answer of a finished study, its run time, and its files."""
    kinds = {"timing", *(kind for part in declared(LinesOf) for kind in part.kinds)}
    paths = {kind: place / f"{kind}.nc" for kind in kinds}
    found = {kind: dataset.read(path, kind) for kind, path in paths.items() if path.exists()}
    out = console()
    level = float(found["verification"].attrs.get("confidence", 0.95))
    for case, designs, rows in beside_original(found["verification"]):
        beside = Table(
            title=f"Case {case}: simulated designs against the baseline (± {level:.0%} half-width)",
            title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False,
        )  # fmt: skip
        beside.add_column(
            "", min_width=11 if len(designs) > 4 else None
        )  # "constraints" in one line
        for header in designs:
            beside.add_column(header)
        for row in rows:
            beside.add_row(*(fitting(text) for text in row))
        out.print(beside)
    lines = [(line.label, fitting(line.text)) for line in answer(found, str(place))]
    timing = found["timing"]
    spent = np.sum(
        [timing[name].to_numpy().sum(1) for name in ("busy", "idle", "compile", "write")], axis=0
    )
    lines.append(("run time", f"{duration(float(spent.max()))} on {counted(timing.sizes['rank'])}"))
    out.print(table("Result", lines))
    out.print(f"designs  {place / 'verification.nc'}", soft_wrap=True)


def describe_samples(found: "Finished", thresholds: Sequence[spread.Beyond] = ()) -> None:
    """Print throughput, range and statistics of f, failures, warnings and load of a batch of samples.

    `thresholds`: values whose exceedance is printed.
    """
    out, samples = console(), found.content
    f = samples["objective"].to_numpy()
    status = samples["status"].to_numpy()
    good = f[status == Status.OK]
    made = f"{len(good)} of {len(f)}"
    rows = [("simulated", f"{made} without failure")]
    rows += [("failed", fitting(text)) for text in explained(samples)]
    if len(good):
        words, unit = objective_of(samples)
        low, high, middle = (quantity(x, unit) for x in (good.min(), good.max(), np.median(good)))
        rows += [("f", words), ("range of f", f"{low} to {high}, median {middle}")]
        rows.append(("half-width of f", _half_widths(samples)))
        in_time = samples["objective_spread"].to_numpy()[status == Status.OK] / good
    if len(good) and np.isfinite(in_time).any():
        rows.append(
            (
                "cycle-to-cycle std. dev.",
                f"median {np.median(in_time):.2%}, largest {in_time.max():.2%} of f",
            )
        )
    if "target_error_reached" in samples.attrs:
        rows.append(("target error", str(samples.attrs["target_error_reached"])))
    speed, busy = [], found.spent[:, 0]
    evaluations = int(np.sum(samples["rhs_evaluations"]))
    if busy.sum() > 0.0:
        throughput = f"{len(f) / busy.sum():.0f} samples per second and core"
        if evaluations:  # without clearance there is nothing to integrate
            throughput += f", {busy.sum() / evaluations * 1e9:.1f} ns per force evaluation"
        speed = [("throughput", throughput)]
    out.print(table("Samples", rows))
    if lines := spread.statistics(samples, thresholds):
        rows = [(line.label, fitting(line.text)) for line in lines]
        out.print(table("Statistics, with 95 % confidence intervals", rows))
    for text in spread.remarks(samples):
        out.print(remark("Warning", text))
    out.print(table("Run", speed + _load(found)))
    for what, path in (("samples", found.output), ("timing", found.timing)):
        if path.exists():  # what was merged has its times beside the parts
            out.print(f"{what:8} {path}")


def _half_widths(samples: Results) -> str:
    """Median and largest half-width of f over f, or "not checked"."""
    name = "objective_limit" if "objective_limit" in samples else "objective_uncertainty"
    good = samples["status"].to_numpy() == Status.OK
    shares = (samples[name].to_numpy() / abs(samples["objective"].to_numpy()))[good]
    if not np.isfinite(shares).any():
        if "objective" in samples.attrs:
            return f"{labels.NOT_CHECKED}; a response has one (hpcclear simulate)"
        return f"{labels.NOT_CHECKED}; set numerics.target_error to estimate it for each sample"
    return f"median {np.nanmedian(shares):.2%}, largest {np.nanmax(shares):.2%} of f"


def describe_map(found: "Finished") -> None:
    """Print how many cells are of which kind, and the load."""
    out, content = console(), found.content
    good = content["status"].to_numpy() == Status.OK
    rows = [("cells", f"{int(good.sum())} of {len(good)} without failure")]
    for regime in Regime:
        count = int(((content["regime"].to_numpy() == regime) & good).sum())
        if count and regime is not Regime.UNJUDGED:
            name, _, meaning = regime.meaning.partition(": ")
            rows.append((name, f"{count} cells: {meaning}"))
    periods, counts = np.unique(content["period"].to_numpy()[good], return_counts=True)
    parts = [
        f"{p:.0f} in {n} cells" for p, n in zip(periods, counts, strict=True) if np.isfinite(p)
    ]
    rows.append(("period, revolutions", ", ".join(parts) or "none found"))
    growth = content["lyapunov_exponent"].to_numpy()[good]
    if len(growth):
        text = f"{growth.min():.3g} to {growth.max():.3g} per revolution"
        rows.append(("largest Lyapunov exponent", text))
    out.print(table("Map", rows))
    out.print(table("Run", _load(found)))
    out.print(f"map      {found.output}")


def describe_bifurcation(found: "Finished") -> None:
    """Print what was observed, its range, failures and load."""
    out, seen = console(), found.content["observed"]
    count, crossings = seen.shape
    failed = int(np.isnan(seen).all(axis=1).sum())
    rows = [
        ("values", f"{count - failed} of {count} without failure"),
        ("observed", f"{seen.attrs['long_name']}, {crossings} revolutions each"),
    ]
    if failed < count:
        unit = str(seen.attrs["units"])
        low, high = (quantity(float(end), unit) for end in (np.nanmin(seen), np.nanmax(seen)))
        rows.append(("range", f"{low} to {high}"))
    out.print(table("Bifurcation", rows))
    out.print(table("Run", _load(found)))
    out.print(f"written  {found.output}")

"""The output of `accuracy --plan`: cost of several errors, and the job to request."""

import math
from collections.abc import Iterator

import numpy as np

from hpcclear.accuracy.plan import Plan, Row
from hpcclear.base.plain import counted
from hpcclear.cli.options import detailed
from hpcclear.cli.tables import console, table
from hpcclear.cli.terminal import show_rows
from hpcclear.ranks.progress import duration
from hpcclear.ranks.terminal import WIDTH

RESERVE = 1.5
"""Requested wall time over expected wall time."""


def preview(plan: Plan) -> str:
    """Return what the latest row means for the job, in a line: the answer so far, while the next row is measured."""
    row = plan.rows[-1]
    name = "settings of the file" if row.error is None else f"error {row.error:g}"
    name = f"first look, {name}" if plan.first else name
    doubts = [f"± {100.0 * row.spread:.2g} % between designs"] if np.isfinite(row.spread) else []
    doubts += ["probably less"] if plan.first else []
    wall = duration(plan.wall_seconds(row, plan.simulations, plan.workers))
    text = f"{name}: {1e3 * row.seconds:.3g} ms per sample, {plan.simulations} simulations take"
    text = f"{text} {wall} on {counted(plan.workers, 'rank')}"
    return f"{text} ({'; '.join(doubts)})" if doubts else text


def describe(plan: Plan, file: str, error: float | None) -> None:
    """Print the costs of several errors, the resources of the requested one, and the Slurm lines to paste."""
    out = console()
    row = next((row for row in plan.rows if row.error == error), plan.rows[0])
    job = plan.simulations, plan.workers
    command, about = ("sample", "") if plan.study is None else ("run", "about ")
    rows = []
    for one in plan.rows:
        reached = "as in file" if one.error is None else f"{one.error:.0e}"
        spread = f" ± {100.0 * one.spread:.2g} %" if np.isfinite(one.spread) else ""
        hours = f"{plan.core_seconds(one, *job) / 3600:.2g}"
        wall = duration(plan.wall_seconds(one, *job))
        rows.append((reached, one.settings(), f"{1e3 * one.seconds:.3g}{spread}", hours, wall))
    title = f"{command}: {about}{plan.simulations} simulations on {counted(plan.workers, 'rank')}"
    header = ("error of f", "settings", "ms/sample", "core-h", "wall time")
    out.print(table(title, rows, header))
    # without --details the memory alone: the time stands in the table above
    show_rows("The job", [one for one in _needs(plan, row) if detailed() or one[0] == "memory"])
    overrides = "" if row.error is None else f" --set numerics.target_error={row.error:g}"
    for line in slurm(plan, row):
        out.print(line, markup=False, soft_wrap=True)
    place = "results/samples.nc" if command == "sample" else "results"
    line = f"srun hpcclear {command} {file} -o {place}"
    between = " \\\n    " if len(line + overrides) > WIDTH else ""
    out.print(f"{line}{between}{overrides}", markup=False, soft_wrap=True)


def _needs(plan: Plan, row: Row) -> Iterator[tuple[str, str]]:
    count, ranks = plan.simulations, plan.workers
    yield "core-seconds", f"{plan.core_seconds(row, count, ranks):.3g}"
    yield "wall time", duration(plan.wall_seconds(row, count, ranks))
    yield "start-up", f"{plan.startup:.1f} s per rank, and once per node up to a minute to compile"
    yield "memory", f"{plan.memory / 2**20:.0f} MB per rank, {count * 1e-6:.2g} GB more on rank 0"
    yield "disk", f"{plan.disk(count) / 2**20:.3g} MB"
    if row.reached:
        yield "reached", row.reached
    if plan.study is not None:
        text = f"{count}, and {plan.responses} single responses; rejected surrogates and tight constraints need more"
        yield "simulations", f"{text}. Single responses, fits and search run on one core"
        yield "hpcclear sample", f"{plan.samples} simulations"


def slurm(plan: Plan, row: Row) -> list[str]:
    """The head of a batch script for this job."""
    wall = plan.wall_seconds(row, plan.simulations, plan.workers)
    minutes = math.ceil((RESERVE * wall + 120.0) / 60.0)
    memory = 256 * math.ceil(1.5 * plan.memory / 2**20 / 256)
    return [
        "#!/bin/bash",
        f"#SBATCH --ntasks={plan.workers}",
        "#SBATCH --cpus-per-task=1",
        f"#SBATCH --mem-per-cpu={memory}M",
        f"#SBATCH --time={minutes // 60:02d}:{minutes % 60:02d}:00",
        "#SBATCH --signal=USR1@60  # saves before the limit; the same command resumes",
    ]

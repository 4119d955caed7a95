"""What the commands print: tables that fit 80 columns, plain when piped."""

import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from hpcclear.base.errors import InputError
from hpcclear.base.outcome import Regime, Status
from hpcclear.base.plain import plain
from hpcclear.dynamics.steady.wording import in_a_line
from hpcclear.ranks.progress import duration
from hpcclear.report import spread
from hpcclear.report.answer import answer
from hpcclear.report.beside import beside_original
from hpcclear.report.failures import explained
from hpcclear.report.figures import labels
from hpcclear.results import dataset
from hpcclear.scene import Scene

if TYPE_CHECKING:
    from hpcclear.ensemble.session import Finished
    from hpcclear.ranks.team import Ranks

WIDTH = 80


class _PlainConsole(Console):
    """Shows texts as they are: nothing in them is markup, and nothing commands the terminal."""

    def render_str(self, text: str, **options: Any) -> Text:
        """Make a text of a string, for lines, titles and cells alike."""
        return super().render_str(plain(text), **{**options, "markup": False, "emoji": False})


def console() -> Console:
    """Standard output; at most 80 columns, colours only on a terminal."""
    screen = Console(highlight=False, soft_wrap=False)
    width = min(WIDTH, screen.width) if screen.is_terminal else WIDTH
    return _PlainConsole(highlight=False, width=width)


def remark(label: str, text: str) -> Text:
    """A line that begins with a label in colour."""
    return Text.assemble((f"{label}:", "yellow"), f" {plain(text)}")


def table(title: str, rows: list[tuple[str, str]]) -> Table:
    """Two columns: what, and its value."""
    made = Table(
        title=title, title_justify="left", box=box.SIMPLE_HEAD, show_header=False, pad_edge=False
    )
    made.add_column(no_wrap=True)
    made.add_column(overflow="fold")
    for row in rows:
        made.add_row(*row)
    return made


def quantity(value: float, unit: str, digits: int = 4) -> str:
    """A number for people in a unit of a readable size, "nan" where there is none."""
    return fitting(labels.quantity(value, unit, digits)) if np.isfinite(value) else "nan"


def fitting(text: str) -> str:
    """A text as the terminal can show it: units in plain letters where it has no others."""
    if "utf" in (sys.stdout.encoding or "").lower():
        return text
    return text.replace("µ", "u").replace("²", "^2").replace("–", "-").replace("±", "+-")


def objective_of(content: xr.Dataset) -> tuple[str, str]:
    """What f is in a file of results, in words, and its unit."""
    unit = content.get("objective", content.get("objective_mean")).attrs["units"]  # type: ignore[union-attr]
    return labels.objective(content), str(unit)


def describe_scene(scene: Scene, cost: bool, ranks: "Ranks | None" = None) -> bool:
    """Print effects, states, warnings, the study, the MPI library, and the measured cost of a sample; return whether the
    scene's own design can turn."""
    out = console()
    from hpcclear.dynamics.problem import coordinate_count, integrator_of, problem_of

    problem_of(scene)  # refuses what cannot be simulated
    locked = _locked(scene)
    if scene.study is not None:
        from hpcclear.study import lives  # loads the statistics: not for every command

        lives.check(scene)
    states = 2 * (coordinate_count(scene) - scene.bristles)
    bristles = f" + {scene.bristles} bristle deflections" if scene.bristles else ""
    open_joints = len(scene.contact_labels())
    rows = [(f"effect {k}", text) for k, text in enumerate(scene.effects_on(), 1)]
    method = integrator_of(scene)
    rows += [
        (
            "states",
            f"{states} (positions and velocities){bristles} + {open_joints} integrals of the gaps",
        ),
        ("method", f"{method}, rtol {scene.numerics.rtol:g}"),
        (
            "revolutions",
            f"{scene.numerics.transient_revolutions} transient + {scene.numerics.averaged_revolutions} averaged",
        ),
        *_speeds(scene),
        *_assembly(scene),
        ("scene hash", scene.hash[:16]),
        ("MPI", _mpi(ranks)),
    ]
    out.print(table("Model", rows))
    for text in scene.readings:
        out.print(remark("Note", text))
    for warning in (*locked, *scene.warnings):
        out.print(remark("Warning", warning))
    if scene.study is not None:
        out.print(table("Study", _study_rows(scene)))
    if cost and not locked:
        out.print(table("Run time of a sample on this machine", _cost_rows(scene)))
    return not locked


def turning(value: float, unit: str) -> str:
    """A number with its unit; an angular speed in rpm too."""
    if unit == "rad/s":
        return f"{30.0 * value / np.pi:.6g} rpm ({value:.6g} rad/s)"
    return quantity(value, unit)


def _speeds(scene: Scene) -> list[tuple[str, str]]:
    """Every angular speed and frequency of the mechanism, a row each."""
    words = {"rad/s": "speed", "Hz": "frequency"}
    return [
        (words[unit], f"{path}: {turning(scene.number(path), unit)}")
        for path in scene.numeric_paths()
        if (unit := scene.unit(path)) in words
    ]


def _assembly(scene: Scene) -> list[tuple[str, str]]:
    """How a linkage was put together, a row a body; refuses one that does not close."""
    from hpcclear.dynamics.planar.problem import linkage_of, put_together
    from hpcclear.dynamics.planar.tables import mechanism_of

    linkage_of(scene)
    lines = put_together(mechanism_of(scene.linkage)).report()
    return [(f"start of {line.partition(': ')[0]}", line.partition(": ")[2]) for line in lines]


def _locked(scene: Scene) -> list[str]:
    """That the scene's own linkage cannot turn, where its study varies what that depends on; refuses it otherwise."""
    from hpcclear.dynamics.planar.problem import refused_of, varies_geometry

    refusal = refused_of(scene)
    if refusal is None:
        return []
    if not varies_geometry(scene):
        raise refusal[1]
    return [f"the scene's own design {refusal[1].reason}; its run time is not measured"]


def _mpi(ranks: "Ranks | None") -> str:
    """The MPI library; the ranks that met in it, where a launcher started them; cores of this node."""
    from hpcclear.ranks.boundary import alone, describe_mpi

    try:
        library = describe_mpi()
    except InputError:
        return "none found: one process"
    mail = (ranks or alone()).mail
    met = f"; {mail.size} ranks connected" if mail.size > 1 else ""
    crowded = (
        f"; {mail.node_size} ranks on {mail.node_cores} cores: more ranks than cores are slower"
        if mail.node_size > mail.node_cores
        else ""
    )
    return f"{library}{met}; {mail.node_cores} cores on this node{crowded}"


def _study_rows(scene: Scene) -> list[tuple[str, str]]:
    study = scene.study
    assert study is not None
    rows = [
        ("samples", f"{study.samples} ({spread.DRAWN[study.method]}), seed {study.seed}"),
        ("objective", f"{study.objective}: {scene.objective.words}"),
    ]
    for variable in study.variables:
        loads = "" if variable.over is None else f" (load cases, {_over(variable.over)})"
        if variable.rows:
            named = ", ".join(row.name for row in variable.rows)
            rows.append((variable.name, f"{named}: {variable.words}{loads}"))
        elif variable.values is not None:
            listed = ", ".join(turning(one, variable.unit) for one in variable.values)
            rows.append((variable.name, f"{listed}: {variable.words}{loads}"))
        elif variable.range is not None:
            lower, upper = (turning(end, variable.unit) for end in variable.range)
            step = "" if variable.step is None else f" by {turning(variable.step, variable.unit)}"
            rows.append((variable.name, f"{lower} to {upper}{step}: {variable.words}"))
        elif variable.ratio is not None:
            rows.append(
                (
                    variable.name,
                    f"{variable.ratio[0]:g} to {variable.ratio[1]:g}: {variable.ratio_words}",
                )
            )
    for row in study.random:
        if row.parameters is not None:
            unit = "" if scene.unit(row.paths[0]) == "" else f" {scene.unit(row.paths[0])}"
            least, most = row.span
            text = f"{row.shape_words}, {least:g} to {most:g}{unit}"
            rows.append(
                (f"{row.name} random", text + ("" if row.absolute else " about the design"))
            )
    if any(case.kept for case in study.cases):
        from hpcclear.study import verdicts

        rows += [("constraint", text) for text in verdicts.costs(study, scene.objective.unit)]
    for row in study.worn:
        from hpcclear.study import lives

        assert scene.wear is not None  # by validation
        text = f"clearance after {row.cycles:g} revolutions of {scene.wear.lives} service lives, "
        text += f"simulated first (about {lives.simulations(scene)} simulations)"
        rows.append((f"{row.name} random", text))
    return rows


def _over(over: str | tuple[float, ...]) -> str:
    """How load cases make one f, in words."""
    weights = "" if over == "worst" else ", ".join(f"{float(one):g}" for one in over)
    return f"weights {weights}" if weights else "f of the worst"


def _cost_rows(scene: Scene) -> list[tuple[str, str]]:
    """Simulate the scene once in all lanes of an ensemble, after a run that compiles."""
    from hpcclear.dynamics.evaluation import evaluate_records
    from hpcclear.dynamics.evaluator import DEFAULT_LANES
    from hpcclear.scene.points import Points

    path = next(path for path in scene.numeric_paths() if path.endswith(".mass"))
    columns = Points(("mass",), np.full((DEFAULT_LANES, 1), scene.number(path)), ((path,),))
    start = time.perf_counter()
    record = evaluate_records(scene, columns)[0]
    first = time.perf_counter() - start
    start = time.perf_counter()
    evaluate_records(scene, columns)
    each = (time.perf_counter() - start) / DEFAULT_LANES
    evaluations = int(record["rhs_evaluations"])
    rows = [("f, steady mean", in_a_line(record))] if record["regime"] else []
    rows += [
        ("force evaluations", f"{evaluations}"),
        ("run time per sample", f"{each * 1e3:.3g} ms on one core ({DEFAULT_LANES} per batch)"),
        ("compilation", f"{max(first - each * DEFAULT_LANES, 0.0):.1f} s (stored for later runs)"),
    ]
    if scene.study is None:
        return rows
    whole = 0
    if scene.study.cases:
        from hpcclear.base.objectives import asked
        from hpcclear.study.forecast import expected

        def evaluated(points: Points) -> np.ndarray:
            return asked(evaluate_records(scene, points), scene.objective)

        whole, each = expected(scene, evaluated, each)
    rows.append(("hpcclear sample", _all(scene.study.samples, each)))
    if whole:
        rows.append(("hpcclear run", f"about {_all(whole, each)}; more exact: hpcclear plan"))
    return rows


def counted(ranks: int) -> str:
    """A number of ranks in words."""
    return f"{ranks} rank{'' if ranks == 1 else 's'}"


def _all(count: int, each: float) -> str:
    """Number of samples and their time on one core; `each`: s."""
    seconds = count * each
    shown = "less than 1 s" if seconds < 1.0 else duration(seconds)
    return f"{count} samples, {shown} of one core"


def _load(found: "Finished") -> list[tuple[str, str]]:
    """Wall time, and how every rank spent it."""
    words = "busy {:.2f} s, idle {:.2f} s, compile {:.2f} s, write {:.2f} s"
    ranks = [(f"rank {rank}", words.format(*row)) for rank, row in enumerate(found.spent)]
    return [("wall time", f"{found.seconds:.1f} s"), *ranks]


def describe_statistics(found: "Finished") -> None:
    """Print mean and standard deviation of f, the error of the mean, failures and load of a streamed Monte Carlo."""
    out, content = console(), found.content
    by_status = content["samples_by_status"]
    total, good = int(by_status.sum()), int(by_status.sel(outcome=int(Status.OK)))
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
    kinds = (
        "samples",
        "sensitivity",
        "kriging",
        "verification",
        "contributions",
        "worst",
        "chaos",
        "timing",
    )
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
        [timing[name].sum("stage") for name in ("busy", "idle", "compile", "write")], axis=0
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
    evaluations = int(samples["rhs_evaluations"].sum())
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


def _half_widths(samples: xr.Dataset) -> str:
    """Median and largest half-width of f over f, or "not checked"."""
    name = "objective_limit" if "objective_limit" in samples else "objective_uncertainty"
    good = (samples["status"] == Status.OK).to_numpy()
    shares = (samples[name] / abs(samples["objective"])).to_numpy()[good]
    if not np.isfinite(shares).any():
        return f"{labels.NOT_CHECKED}; set numerics.target_error to estimate it for each sample"
    return f"median {np.nanmedian(shares):.2%}, largest {np.nanmax(shares):.2%} of f"


def describe_map(found: "Finished") -> None:
    """Print how many cells are of which kind, and the load."""
    out, content = console(), found.content
    good = (content["status"] == Status.OK).to_numpy()
    rows = [("cells", f"{int(good.sum())} of {len(good)} without failure")]
    for regime in Regime:
        count = int(((content["regime"] == regime).to_numpy() & good).sum())
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
    failed = int(seen.isnull().all("crossing").sum())
    rows = [
        ("values", f"{seen.sizes['value'] - failed} of {seen.sizes['value']} without failure"),
        ("observed", f"{seen.attrs['long_name']}, {seen.sizes['crossing']} revolutions each"),
    ]
    if failed < seen.sizes["value"]:
        unit = str(seen.attrs["units"])
        low, high = (quantity(float(end), unit) for end in (seen.min(), seen.max()))
        rows.append(("range", f"{low} to {high}"))
    out.print(table("Bifurcation", rows))
    out.print(table("Run", _load(found)))
    out.print(f"written  {found.output}")

"""The library of hard scenes at several tolerances: outcome, f and how far to trust it, energy, cost.

    python analysis/hard_cases.py                    # tests/hard_cases/*.toml, 10 revolutions, about 10 min
    python analysis/hard_cases.py --quick            # 4 revolutions, no uncertainty, about 3 min
    python analysis/hard_cases.py mine/*.toml        # your own scenes

Prints one table, writes hard_cases.nc and hard_cases.png. The reference is the same scene at rtol 1e-10; the energy
residual is relative to the largest of kinetic energy and integral of |driving power|.
"""

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from drawing import described

from hpcclear import __version__
from hpcclear.base.errors import InputError
from hpcclear.base.outcome import Flag, Status
from hpcclear.dynamics.evaluation import evaluate_records
from hpcclear.dynamics.evaluation.evaluator import PERTURBATIONS, outcome_records
from hpcclear.dynamics.planar.energy import energies
from hpcclear.dynamics.response import simulate
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.problem import effects_of, problem_of
from hpcclear.dynamics.setup.start import start_states
from hpcclear.dynamics.stepping import record as rec
from hpcclear.dynamics.stepping.lanes import Lanes
from hpcclear.results.rows import FileVariables, number
from hpcclear.scene import Scene, load_scene
from hpcclear.scene.points import Points
from hpcclear.scene.scene import record_of

LIBRARY = Path(__file__).parent.parent / "tests" / "hard_cases"
TOLERANCES = (1e-3, 1e-6, 1e-8)
REFERENCE = 1e-10
CHUNK = 8192  # steps

NOTHING = Points((), np.empty((1, 0)), ())


@dataclass(frozen=True)
class Run:
    """What one simulation came to."""

    outcome: np.void  # a record of `hpcclear.scene.scene.record_of`
    residual: float
    implicit: float  # share of implicit steps
    seconds: float

    @property
    def status(self) -> Status:
        """How it ended."""
        return Status(self.outcome["status"])

    @property
    def flags(self) -> set[Flag]:
        """What to mind."""
        return {flag for flag in Flag if self.outcome["flags"] & flag}


def cut(scene: Scene, rtol: float, longest: int) -> Scene:
    """The scene at another tolerance, over so many revolutions at most, half of them averaged."""
    numerics = scene.numerics
    transient, averaged = numerics.transient_revolutions, numerics.averaged_revolutions
    if transient + averaged > longest:
        transient = min(transient, longest // 2)
        averaged = longest - transient
    return scene.with_(
        {
            "numerics.rtol": rtol,
            "numerics.transient_revolutions": transient,
            "numerics.averaged_revolutions": averaged,
        }
    )


def balance(
    scene: Scene, par: np.ndarray, rows: np.ndarray, n: int
) -> tuple[np.ndarray, np.ndarray]:
    """Energy less all work done at recorded steps, and the size to measure it by, J (steps,)."""
    kinetic, total = energies(
        scene,
        par,
        rows[:, rec.STATE : rec.STATE + n].T,
        rows[:, rec.STATE + n : rec.STATE + 2 * n].T,
        rows[:, rec.CONTACTS : rec.CONTACTS + 2],
        rows[:, rec.TURN_TIME],
    )
    works = rows[:, rec.DRIVE_WORK] + rows[:, rec.LOAD_WORK] - rows[:, rec.DISSIPATED]
    return total - works, np.maximum(kinetic, rows[:, rec.ABS_DRIVE_WORK])


def chunks(lanes: Lanes) -> Iterator[np.ndarray]:
    """Recorded steps as they come."""
    while lanes.pending:
        lanes.advance(0.5)
        yield lanes.take_record()


def recorded(scene: Scene) -> tuple[Lanes, np.ndarray, np.ndarray]:
    """One lane that keeps every step, its parameters (1, PARAMETERS) and its start as a row of the record (1, columns)."""
    problem = replace(problem_of(scene), effects=effects_of(scene, recorded=True))
    n, par = problem.coordinates, parameters(scene)
    start = start_states(scene, par)
    lanes = Lanes(problem, 1, np.zeros((CHUNK, rec.columns(n))))
    lanes.queue(par, start, np.zeros(1, np.int64))
    row = np.zeros((1, rec.columns(n)))
    row[:, rec.STATE : rec.STATE + 2 * n] = start.state(n)
    row[:, rec.CONTACTS : rec.CONTACTS + rec.JOINTS] = start.active
    return lanes, par, row


def run(scene: Scene) -> Run:
    """Simulate one scene with its energy balance; every accepted step counts, none is kept."""
    if not scene.clearance_joints() and scene.drive.kind == "constant-speed":
        return closed_form(scene)
    lanes, par, start = recorded(scene)
    n = lanes.problem.coordinates
    first, largest = balance(scene, par[0], start, n)
    off, size = 0.0, largest[0]
    began = time.perf_counter()
    for rows in chunks(lanes):
        if len(rows):
            total, largest = balance(scene, par[0], rows, n)
            off = max(off, float(np.abs(total - first).max()))
            size = max(size, float(largest.max()))
    labels, outcome, finished = lanes.collect()
    return Run(
        outcome_records(labels, outcome, finished, record_of(scene))[0],
        off / size,
        float(outcome.stiff_steps[0] / max(outcome.attempts[0], 1.0)),
        time.perf_counter() - began,
    )


def closed_form(scene: Scene) -> Run:
    """Both joints ideal: nothing is integrated."""
    began = time.perf_counter()
    response = simulate(scene)
    outcome = np.zeros(1, record_of(scene))[0]
    if not Status(int(response["status"])).valid:  # numbers of joints that are not there, too
        for name in outcome.dtype.names:
            if outcome[name].dtype.kind == "f":
                outcome[name] = np.nan
    for name in outcome.dtype.names:
        if name in response:
            value = response[name].values
            if value.ndim:  # of joints
                outcome[name][: len(value)] = value
            else:
                outcome[name] = value
    size = max(response.kinetic_energy.max(), np.abs(np.diff(response.driving_work)).sum())
    residual = float(np.abs(response.energy_residual).max() / size)
    return Run(outcome, residual, 0.0, time.perf_counter() - began)


def uncertainty(scene: Scene) -> float:
    """How far f may be off, by perturbed and stricter copies, m."""
    return float(evaluate_records(scene, NOTHING, 1, PERTURBATIONS)["objective_uncertainty"][0])


CASES = "case rtol"
VARIABLES: FileVariables = {
    "objective": number(CASES, "m", "objective f"),
    "objective_spread": number(CASES, "m", "standard deviation of f between revolutions"),
    "objective_uncertainty": number(
        CASES, "m", "how far f may be off, by perturbed and stricter copies"
    ),
    "off_reference": number(CASES, "1", "f over f at rtol 1e-10, less 1"),
    "energy_residual": number(
        CASES, "1", "largest energy residual over max(kinetic energy, driving work)"
    ),
    "rhs_evaluations": number(CASES, "1", "force evaluations a revolution"),
    "implicit_share": number(CASES, "1", "share of implicit steps"),
    "seconds": number(CASES, "s", "wall time"),
    "status": number(CASES, "1", "status code"),
    "flags": number(CASES, "1", "flag bits"),
}


def measure(paths: list[Path], revolutions: int, trust: bool) -> xr.Dataset:
    """Every scene at every tolerance."""
    scenes = {}
    for path in paths:
        try:
            scenes[path.stem] = load_scene(path)
        except InputError as error:
            print(f"  {path.stem}: refused, {error}", flush=True)
    result = {name: np.full((len(scenes), len(TOLERANCES)), np.nan) for name in VARIABLES}
    for k, (name, scene) in enumerate(scenes.items()):
        reference = run(cut(scene, REFERENCE, revolutions)).outcome["objective"]
        for j, rtol in enumerate(TOLERANCES):
            at_rtol = cut(scene, rtol, revolutions)
            done = run(at_rtol)
            turns = at_rtol.numerics.transient_revolutions + at_rtol.numerics.averaged_revolutions
            row = {
                "objective": done.outcome["objective"],
                "objective_spread": done.outcome["objective_spread"],
                "objective_uncertainty": uncertainty(at_rtol) if trust else np.nan,
                "off_reference": done.outcome["objective"] / reference - 1.0 if reference else 0.0,
                "energy_residual": done.residual,
                "rhs_evaluations": done.outcome["rhs_evaluations"] / turns,
                "implicit_share": done.implicit,
                "seconds": done.seconds,
                "status": done.outcome["status"],
                "flags": done.outcome["flags"],
            }
            for key, value in row.items():
                result[key][k, j] = value
        print(f"  {name} done", flush=True)
    return xr.Dataset(
        described(result, VARIABLES),
        coords={"case": list(scenes), "rtol": list(TOLERANCES)},
        attrs={"title": "Hard scenes at several tolerances", "versions": f"hpcclear {__version__}"},
    )


def count(number: float) -> str:
    """A count in five characters."""
    for size, letter in ((1e6, "M"), (1e3, "k")):
        if number >= size:
            return f"{number / size:.2g}{letter}"
    return f"{number:.0f}"


def table(result: xr.Dataset) -> str:
    """One row a case and tolerance, 80 columns at most."""
    lines = [
        "L latched, H beyond Hertz, S implicit steps; spread, +-, off: relative to f",
        f"{'case':26s}{'rtol':>6s} {'end':8s}{'f mm':>8s}{'spread':>7s}{'+-':>6s}{'off':>6s}"
        f"{'energy':>7s}{'evals':>6s}",
    ]
    for case in result.case.values:
        for j, rtol in enumerate(result.rtol.values):
            row = result.sel(case=case, rtol=rtol)
            status = Status(int(row.status))
            letters = "".join(
                x for x, flag in zip("LHS", Flag, strict=True) if int(row.flags) & flag
            )
            end = f"ok {letters}" if status is Status.OK else status.name.lower().replace("_", "-")
            f = float(row.objective)
            parts = [abs(float(x)) for x in (row.objective_spread, row.objective_uncertainty)]
            cells = [part / f if f else part for part in parts] + [abs(float(row.off_reference))]
            shown = "".join(f"{cell:>{w}.0e}" for cell, w in zip(cells, (7, 6, 6), strict=True))
            lines.append(
                f"{case if j == 0 else '':26.26s}{rtol:>6.0e} {end:8.8s}{1e3 * f:>8.5f}{shown}"
                f"{float(row.energy_residual):>7.0e}{count(float(row.rhs_evaluations)):>6s}"
            )
    return "\n".join(lines)


def figure(result: xr.Dataset, path: Path) -> None:
    """Energy residual, error of f beside its stated uncertainty, and cost, a row a case."""
    cases = [c for c in result.case.values if result.status.sel(case=c).isel(rtol=-1) == Status.OK]
    chosen = result.sel(case=cases)
    rows = np.arange(len(cases))
    sheet, axes = plt.subplots(1, 3, figsize=(11, 1.5 + 0.2 * len(cases)), sharey=True)
    f = chosen.objective.where(chosen.objective > 0)
    panels = (
        (chosen.energy_residual, "energy residual"),
        (abs(chosen.off_reference), "|f / f(1e-10) - 1|, bar: stated uncertainty"),
        (chosen.rhs_evaluations, "force evaluations a revolution"),
    )
    for axis, (values, title) in zip(axes, panels, strict=True):
        for rtol, colour, marker in zip(
            TOLERANCES, ("#e69f00", "#0072b2", "#009e73"), "os^", strict=True
        ):
            shown = values.sel(rtol=rtol).where(lambda x: x > 0)
            axis.plot(shown, rows, marker, color=colour, ms=4.5, label=f"rtol {rtol:.0e}")
        axis.set_xscale("log")
        axis.set_xlabel(title)
        axis.grid(alpha=0.3)
    for rtol, bound, colour in ((1e-6, 2e-5, "#0072b2"), (1e-8, 1e-7, "#009e73")):
        axes[0].axvline(bound, color=colour, ls="--", lw=1)
        stated = (chosen.objective_uncertainty / f).sel(rtol=rtol)
        axes[1].plot(stated, rows, "|", color=colour, ms=9, mew=1.5)
    axes[0].set_yticks(rows, [str(c).replace("_", " ") for c in cases])
    axes[0].invert_yaxis()
    sheet.legend(*axes[0].get_legend_handles_labels(), loc="upper center", ncols=3, frameon=False)
    sheet.tight_layout(rect=(0.0, 0.0, 1.0, 1.0 - 0.35 / sheet.get_size_inches()[1]))
    sheet.savefig(path, dpi=150)
    plt.close(sheet)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="*", type=Path, help="scene files (default: the library)")
    parser.add_argument("--quick", action="store_true", help="4 revolutions, no uncertainty")
    parser.add_argument("-o", "--output", type=Path, default=Path("results"), help="folder")
    options = parser.parse_args()
    paths = options.scenes or sorted(LIBRARY.glob("*.toml"))
    result = measure(paths, 4 if options.quick else 10, not options.quick)
    print(table(result))
    options.output.mkdir(parents=True, exist_ok=True)
    result.to_netcdf(options.output / "hard_cases.nc", engine="h5netcdf")
    figure(result, options.output / "hard_cases.png")
    print(f"wrote {options.output / 'hard_cases.nc'} and {options.output / 'hard_cases.png'}")


if __name__ == "__main__":
    main()

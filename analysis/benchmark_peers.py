"""The same scene in this package and in everything a user might take instead.

    python analysis/benchmark_peers.py            # about 15 minutes on a quiet machine
    python analysis/benchmark_peers.py --quick    # one round, fewer tolerances
    python analysis/benchmark_peers.py --record   # also writes the rows of this processor to analysis/results/peers.csv

Peers: pip install 'hpcclear[bench]'; numbalsoda is built from source and needs gfortran
(apt-get install gfortran). One that does not load is listed as missing.

Single response: the paper's mechanism, clearance 0.3 mm, one revolution and ten; time against error of the slider's
position, the error measured from one reference (scipy's DOP853 at its tightest, from event to event where the
law has memory). For every decade of error the fastest run of each code that is at least as good.
Ensemble: the box of the paper's Table 3, first revolution; every code at the loosest tolerance whose median
error is at most the required one. All on one core, in processor time, everything in one run: paired rounds,
each a pass over all codes; medians of the ratios within a round. Writes benchmark_peers.nc and .png.

Before anything is timed, every code must solve the same equations: a code whose error does not fall with its
tolerance, or stays tenfold above the required error of an ensemble, ends the run with exit code 1.
"""

import argparse
import csv
import datetime
import importlib
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib
import numpy as np
import xarray as xr
from drawing import by_code, error_panels
from matplotlib.axes import Axes
from scenes import LAWS, ROOT, Setup, ensemble, scene, single

from hpcclear.base import host
from hpcclear.dynamics.evaluation.evaluator import DEFAULT_LANES
from hpcclear.results.provenance import program

MODULES = ("own", "numbalsoda", "cyrk", "heyoka", "scipy", "sundae", "exudyn")
OWN = "hpcclear"
OWN_SINGLE = "hpcclear prince-dormand"  # numerics.method for one response
REVOLUTIONS = {"hunt-crossley": (1, 10), "frictionless": (1, 10), "lankarani-nikravesh": (1,)}
"""Of a single response. Over ten, Lankarani and Nikravesh's law has no error: the motion depends on the tolerance."""
DECADES = 10.0 ** -np.arange(5.0, 13.0)
ENSEMBLES = {"lankarani-nikravesh": 1e-5, "frictionless": 1e-7}  # m, median error asked for
TOLERANCES = 10.0 ** -np.arange(
    3.0, 11.5, 0.5
)  # tried from the loosest on, until the error is small enough
SHORTEST = 5e-3  # s, calls are repeated to last as long
FEW = 16  # samples for codes that take them one by one
SLOWEST = 0.3  # s a revolution, tighter tolerances are left out beyond
LONGEST = 6.0  # s of all tolerances of a code
FALL = 0.1  # to which part of the largest error at loose tolerances the error must fall


class Solver(NamedTuple):
    """A code with its settings, for one law."""

    name: str
    law: str
    solve: Callable[[Setup, int], float]


def load() -> tuple[list[Any], dict[str, str]]:
    """The modules of peers, and why others are missing."""
    found, missing = [], {}
    for name in MODULES:
        try:
            found.append(importlib.import_module(f"peers.{name}_peer"))
        except (ImportError, OSError) as error:
            missing[name] = str(error).splitlines()[0]
    return found, missing


def solvers_of(modules: list[Any], law: str) -> list[Solver]:
    """Every code that runs this law."""
    return [
        Solver(name, law, solve)
        for module in modules
        for name, solve in module.SOLVERS.items()
        if law in getattr(module, "LAWS_OF", {}).get(name, module.LAWS)
    ]


def setup_of(law: str, rtol: float, revolutions: int = 1) -> Setup:
    """Some revolutions of the paper's mechanism."""
    return single(scene(law, rtol, 0, revolutions, clearance=3e-4))


def reference(law: str, revolutions: int) -> float:
    """Slider position by a code that is nobody's own here, at its tightest."""
    from peers.scipy_peer import SOLVERS

    return SOLVERS["scipy DOP853"](setup_of(law, 3e-14, revolutions), 0)


def distrust(name: str, errors: np.ndarray) -> str:
    """Why a code does not solve the reference's equations, "" if it does: its errors (m), loosest tolerance first, must fall.

    A failed run (NaN) and a tolerance that was left out count as no error.
    """
    known = errors[np.isfinite(errors)]
    if len(known) < 4:
        return f"{name}: results at {len(known)} tolerances only"
    most, least = known[: len(known) // 3].max(), known[len(known) // 2 :].min()
    if least > FALL * most:
        return f"{name}: error {most:.1e} m at loose tolerances, {least:.1e} m at tight ones"
    return ""


# ---- single response --------------------------------------------------------------------------


def seconds_of(call: Callable[[], Any], repeats: int) -> float:
    """Processor seconds of one call."""
    started = time.process_time()
    for _ in range(repeats):
        call()
    return (time.process_time() - started) / repeats


def errors_of(solvers: list[Solver], law: str, revolutions: int, rtols: np.ndarray) -> xr.Dataset:
    """Error of every code at every tolerance, and how often it is repeated to be timed, 0 where it is too slow."""
    exact = reference(law, revolutions)
    setups = [setup_of(law, float(rtol), revolutions) for rtol in rtols]
    shape = (len(solvers), len(rtols))
    error, repeats = np.full(shape, np.nan), np.zeros(shape, int)
    for i, solver in enumerate(solvers):
        spent = 0.0
        for j, setup in enumerate(setups):
            error[i, j] = abs(solver.solve(setup, 0) - exact)  # compiles as well
            first = seconds_of(lambda solver=solver, setup=setup: solver.solve(setup, 0), 1)
            repeats[i, j] = max(1, int(SHORTEST / max(first, 1e-6)))
            spent += first
            if first > SLOWEST * revolutions or spent > LONGEST:
                break
    return xr.Dataset(
        {
            "error": (("code", "rtol"), error, {"units": "m"}),
            "repeats": (("code", "rtol"), repeats, {"units": "1"}),
        },
        coords={"code": [solver.name for solver in solvers], "rtol": rtols},
        attrs={"law": law, "revolutions": revolutions, "reference": exact},
    )


def timed(runs: xr.Dataset, solvers: list[Solver], rounds: int) -> xr.Dataset:
    """The same with processor seconds a revolution in every round."""
    law, revolutions = runs.attrs["law"], runs.attrs["revolutions"]
    setups = [setup_of(law, float(rtol), revolutions) for rtol in runs["rtol"].values]
    repeats = runs["repeats"].values
    seconds = np.full((*repeats.shape, rounds), np.nan)
    for k in range(rounds):
        for i in np.roll(np.arange(len(solvers)), k):
            for j in np.flatnonzero(repeats[i]):
                call = lambda i=i, j=j: solvers[i].solve(setups[j], 0)  # noqa: E731
                seconds[i, j, k] = seconds_of(call, int(repeats[i, j])) / revolutions
    return runs.assign(seconds=(("code", "rtol", "round"), seconds, {"units": "s"}))


def fastest(runs: xr.Dataset) -> xr.DataArray:
    """Seconds of the fastest run of each code that is at least as good, (code, decade, round); NaN: none is."""
    pieces = [runs["seconds"].where(runs["error"] <= decade).min("rtol") for decade in DECADES]
    return xr.concat(pieces, xr.DataArray(DECADES, dims="decade", name="decade"))


# ---- ensemble --------------------------------------------------------------------------------------


def first_of(setup: Setup, samples: int) -> Setup:
    """The first samples of a setup."""
    return setup._replace(par=setup.par[:samples], start=setup.start[:samples])


def batches_of(modules: list[Any], law: str) -> dict[str, tuple[Callable, int]]:
    """Every code as a function from a setup to slider positions, and the most samples it is given.

    Codes that take one sample after the other need no more than a few for their mean.
    """
    batches: dict[str, tuple[Callable, int]] = {}
    for module in modules:
        if law in module.LAWS:
            batches |= {
                name: (batch, 10**9) for name, batch in getattr(module, "BATCH", {}).items()
            }
    for solver in solvers_of(modules, law):
        if not solver.name.startswith((OWN, "plain")):
            one_by_one = lambda setup, solve=solver.solve: np.array(  # noqa: E731
                [solve(setup, k) for k in range(len(setup.par))]
            )
            batches[solver.name] = (one_by_one, FEW)
    return batches


def well_posed(law: str, samples: int) -> tuple[np.ndarray, np.ndarray]:
    """Slider positions of an ensemble by the plain loop, and on which samples two tight tolerances agree.

    A latched impact speed makes some designs depend on the tolerance itself: they have no defined error.
    """
    from peers.own_peer import plain_positions

    tight, tighter = (
        plain_positions(ensemble(scene(law, rtol, 0, 1), samples)) for rtol in (1e-10, 1e-11)
    )
    return tighter, np.abs(tight - tighter) < 1e-2 * ENSEMBLES[law]


class Chosen(NamedTuple):
    """A code at the loosest tolerance with which it reaches the required median error."""

    batch: Callable[[Setup], np.ndarray]
    setup: Setup
    error: float


def chosen_of(
    modules: list[Any], law: str, wanted: float, samples: int
) -> tuple[dict[str, Chosen], list[str], int]:
    """Every code as it is to be timed, why others are not to be trusted, and how many samples have an error.

    A code that comes close to the required error is left out with a line; one that does not solves other equations.
    """
    exact, agreed = well_posed(law, samples)
    setups = [ensemble(scene(law, float(rtol), 0, 1), samples) for rtol in TOLERANCES]
    chosen, faults = {}, []
    for name, (batch, most) in batches_of(modules, law).items():
        best = np.inf
        for setup in setups:
            part = first_of(setup, most)
            count = len(part.par)
            misses = np.abs(batch(part) - exact[:count])[agreed[:count]]
            error = float(np.median(np.nan_to_num(misses, nan=np.inf)))  # a failure is no success
            best = min(best, error)
            if error <= wanted:
                chosen[name] = Chosen(batch, part, error)
                break
        else:
            fault = f"{name}: median error {best:.1e} m at best, required {wanted:.0e} m"
            if best > wanted / FALL:
                faults.append(fault)
            print(f"ensemble, {law}: not timed, {fault}")
    return chosen, faults, int(agreed.sum())


def run_ensemble(chosen: dict[str, Chosen], rounds: int, attrs: dict[str, Any]) -> xr.Dataset:
    """Milliseconds a trajectory and revolution at equal error."""
    seconds = np.full((len(chosen), rounds), np.nan)
    runs = list(chosen.values())
    for k in range(rounds):
        for i in np.roll(np.arange(len(runs)), k):
            call = lambda run=runs[i]: run.batch(run.setup)  # noqa: E731
            seconds[i, k] = seconds_of(call, 1)
    counts = np.array([len(run.setup.par) for run in runs])
    rtols = [run.setup.problem.rtol for run in runs]
    return xr.Dataset(
        {
            "each": (("code", "round"), seconds / counts[:, None] * 1e3, {"units": "ms"}),
            "error": (("code",), [run.error for run in runs], {"units": "m"}),
            "rtol": (("code",), rtols, {"units": "1"}),
        },
        coords={"code": list(chosen)},
        attrs=attrs,
    )


# ---- what is printed ----------------------------------------------------------------------------------


def single_table(runs: xr.Dataset) -> list[str]:
    """Times by decade of error, then how many times longer than this package."""
    best = fastest(runs)
    ratio = (best / best.sel(code=OWN_SINGLE)).median("round")
    tables = {"ms a revolution": best.median("round") * 1e3, "times ours": ratio}
    lines = []
    for title, table in tables.items():
        of = f"{runs.attrs['law']}, {runs.attrs['revolutions']} revolutions"
        lines += ["", f"single response, {of}: {title}, error up to ... m"]
        lines.append(f"{'':<24}" + "".join(f"{f'{decade:.0e}':>7}" for decade in DECADES))
        for code in runs["code"].values:
            values = table.sel(code=code).transpose("decade").values
            cells = ["-" if np.isnan(value) else f"{value:.3g}" for value in values]
            lines.append(f"{code:<24}" + "".join(f"{cell:>7}" for cell in cells))
    return lines


def ensemble_table(runs: xr.Dataset) -> list[str]:
    """Times a trajectory, and how many times longer than this package."""
    lines = ["", f"ensemble, {runs.attrs['law']}: median error up to {runs.attrs['wanted']:.0e} m"]
    lines.append(f"{'':<24}{'ms a revolution':>16}{'times ours':>12}{'error m':>10}{'rtol':>8}")
    lines.append(
        f"({runs.attrs['agreed']} of {runs.attrs['samples']} samples have a defined error)"
    )
    own = runs["each"].sel(code=f"{OWN} lanes")
    for code, row in by_code(runs):
        lines.append(
            f"{code:<24}{float(row['each'].median()):>16.4f}"
            f"{float((row['each'] / own).median()):>12.2f}{float(row['error']):>10.0e}"
            f"{float(row['rtol']):>8.0e}"
        )
    return lines


def draw(runs: dict[str, xr.Dataset], path: Path) -> None:
    """Time against error, a panel for each law."""

    def curve(panel: Axes, k: int, code: str, row: xr.Dataset) -> None:
        panel.plot(
            np.maximum(row["error"], 1e-15), row["seconds"].median("round") * 1e3,
            marker="osv^D"[k % 5], markersize=2.5, label=code,
            linewidth=2.0 if code.startswith(OWN) else 0.9,
            color=matplotlib.colormaps["tab20"](k % 20),
        )  # fmt: skip

    figure, axes = error_panels(runs, 3.4, 4.6, curve)
    for panel in axes:
        panel.legend(fontsize=5.5, loc="upper center", bbox_to_anchor=(0.5, -0.2), ncol=2)
    axes[0].set_ylabel("ms a revolution")
    figure.tight_layout()
    figure.savefig(path, dpi=200)


RESULTS = ROOT / "analysis" / "results" / "peers.csv"
RECORDED = 1e-8  # m, error of the single responses that are recorded


def summary(runs: dict[str, xr.Dataset], ensembles: dict[str, xr.Dataset]) -> list[dict[str, str]]:
    """A row for each comparison: the fastest of the other codes, and the plain loop, in times of this package's run time."""
    rows = []
    for name, found in runs.items():
        ratio = fastest(found) / fastest(found).sel(code=OWN_SINGLE)
        near = ratio.sel(decade=RECORDED, method="nearest").median("round")
        rows.append({"comparison": f"response, {name}", **_row(near, f"{RECORDED:.0e} m")})
    for law, found in ensembles.items():
        ratio = (found["each"] / found["each"].sel(code=f"{OWN} lanes")).median("round")
        rows.append({"comparison": f"ensemble, {law}", **_row(ratio, f"{ENSEMBLES[law]:.0e} m")})
    return rows


def _row(ratio: xr.DataArray, error: str) -> dict[str, str]:
    others = ratio.sel(code=[str(c) for c in ratio["code"].values if OWN not in str(c)])
    peers = others.sel(code=others["code"] != "plain loop").dropna("code")
    best = str(peers["code"].values[int(peers.argmin())])
    return {
        "error": error,
        "plain loop": f"{float(ratio.sel(code='plain loop')):.2g}",
        "fastest other code": best,
        "times ours": f"{float(peers.min()):.2g}",
    }


def record(rows: list[dict[str, str]]) -> None:
    """Write this processor's rows into the table of results, in place of its earlier ones."""
    same = {
        "processor": host.processor(), "lanes": str(DEFAULT_LANES),
        "bits": os.environ.get("HPCCLEAR_VECTOR_BITS", "widest"),
    }  # fmt: skip
    kept = []
    if RESULTS.exists():
        with RESULTS.open(newline="", encoding="utf-8") as file:
            kept = [row for row in csv.DictReader(file) if any(row[k] != same[k] for k in same)]
    today = datetime.date.today().isoformat()
    kept += [{**same, "date": today, **row} for row in rows]
    with RESULTS.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(kept[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(kept)


def main() -> None:
    """Load, compare with the reference, measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--record", action="store_true")
    parser.add_argument("--samples", type=int, default=512)
    parser.add_argument("-o", "--output", type=Path, default=Path("benchmark_peers.nc"))
    options = parser.parse_args()
    rounds, per_decade = (1, 1) if options.quick else (5, 2)
    rtols = 10.0 ** -np.arange(4.0, 13.5, 1.0 / per_decade)
    modules, missing = load()
    for name, reason in missing.items():
        print(f"missing: {name} ({reason})")
    solvers = {law: solvers_of(modules, law) for law in LAWS}
    runs = {
        f"{law}, {count} revolutions": errors_of(solvers[law], law, count, rtols)
        for law, counts in REVOLUTIONS.items()
        for count in counts
    }
    chosen = {
        law: chosen_of(modules, law, wanted, options.samples) for law, wanted in ENSEMBLES.items()
    }
    faults = [
        f"{name}: {fault}"
        for name, found in runs.items()
        for code in found["code"].values
        if (fault := distrust(str(code), found["error"].sel(code=code).values))
    ]
    faults += [f"ensemble, {law}: {fault}" for law, (_, why, _) in chosen.items() for fault in why]
    if faults:
        sys.exit("\n".join(["not timed, these codes solve other equations:", *faults]))
    tree = xr.DataTree(xr.Dataset(attrs={**program(), "missing": str(missing)}))
    for name, found in runs.items():
        runs[name] = timed(found, solvers[found.attrs["law"]], rounds)
        tree[f"single/{name}"] = xr.DataTree(runs[name])
        print("\n".join(single_table(runs[name])), flush=True)
    ensembles = {}
    for law, (codes, _, agreed) in chosen.items():
        attrs = {"law": law, "wanted": ENSEMBLES[law], "samples": options.samples, "agreed": agreed}
        ensembles[law] = run_ensemble(codes, rounds, attrs)
        tree[f"ensemble/{law}"] = xr.DataTree(ensembles[law])
        print("\n".join(ensemble_table(ensembles[law])), flush=True)
    tree.to_netcdf(options.output, engine="h5netcdf")
    draw(runs, options.output.with_suffix(".png"))
    if options.record:
        record(summary(runs, ensembles))


if __name__ == "__main__":
    main()

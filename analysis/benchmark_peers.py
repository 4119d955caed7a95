"""The same scene in this package and in everything a user might take instead.

    python analysis/benchmark_peers.py            # about 15 minutes on a quiet machine
    python analysis/benchmark_peers.py --quick    # one round, fewer tolerances

Peers: pip install 'hpcclear[bench]'; numbalsoda is built from source and needs gfortran
(apt-get install gfortran). One that does not load is listed as missing.

Single response: the paper's mechanism, clearance 0.3 mm, first revolution; time against error of the slider's
position, the error measured from one reference (scipy's DOP853 at its tightest, from event to event where the
law has memory). For every decade of error the fastest run of each code that is at least as good.
Ensemble: the box of the paper's Table 3, first revolution; every code at the loosest tolerance whose median
error is at most the one asked for. All on one core, in processor time, everything in one run: paired rounds,
each a pass over all codes; medians of the ratios within a round. Writes benchmark_peers.nc and .png.
"""

import argparse
import importlib
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib
import numpy as np
import xarray as xr
from drawing import by_code, error_panels
from matplotlib.axes import Axes
from scenes import LAWS, Setup, ensemble, scene, single

from hpcclear.results.provenance import provenance

MODULES = ("own", "numbalsoda", "cyrk", "heyoka", "scipy", "sundae", "exudyn")
OWN = "hpcclear"
OWN_SINGLE = "hpcclear prince-dormand"  # numerics.method for one response
DECADES = 10.0 ** -np.arange(5.0, 13.0)
ENSEMBLES = {"lankarani-nikravesh": 1e-5, "frictionless": 1e-7}  # m, median error asked for
TOLERANCES = 10.0 ** -np.arange(
    3.0, 11.5, 0.5
)  # tried from the loosest on, until the error is small enough
SHORTEST = 5e-3  # s, calls are repeated to last as long
FEW = 16  # samples for codes that take them one by one
SLOWEST = 0.3  # s, tighter tolerances are left out beyond


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


def setup_of(law: str, rtol: float) -> Setup:
    """One revolution of the paper's mechanism."""
    return single(scene(law, rtol, 0, 1, clearance=3e-4))


def reference(law: str) -> float:
    """Slider position by a code that is nobody's own here, at its tightest."""
    from peers.scipy_peer import SOLVERS

    return SOLVERS["scipy DOP853"](setup_of(law, 3e-14), 0)


# ---- single response --------------------------------------------------------------------------


def seconds_of(call: Callable[[], Any], repeats: int) -> float:
    """Processor seconds of one call."""
    started = time.process_time()
    for _ in range(repeats):
        call()
    return (time.process_time() - started) / repeats


def work_precision(solvers: list[Solver], law: str, rtols: np.ndarray, rounds: int) -> xr.Dataset:
    """Error, and seconds in every round, of every code at every tolerance."""
    exact = reference(law)
    setups = [setup_of(law, float(rtol)) for rtol in rtols]
    shape = (len(solvers), len(rtols))
    error, seconds = np.full(shape, np.nan), np.full((*shape, rounds), np.nan)
    repeats = np.zeros(shape, int)
    for i, solver in enumerate(solvers):
        for j, setup in enumerate(setups):
            error[i, j] = abs(solver.solve(setup, 0) - exact)  # compiles as well
            first = seconds_of(lambda solver=solver, setup=setup: solver.solve(setup, 0), 1)
            repeats[i, j] = max(1, int(SHORTEST / max(first, 1e-6)))
            if first > SLOWEST:
                break
    for k in range(rounds):
        for i in np.roll(np.arange(len(solvers)), k):
            for j in np.flatnonzero(repeats[i]):
                call = lambda i=i, j=j: solvers[i].solve(setups[j], 0)  # noqa: E731
                seconds[i, j, k] = seconds_of(call, int(repeats[i, j]))
    return xr.Dataset(
        {
            "error": (("code", "rtol"), error, {"units": "m"}),
            "seconds": (("code", "rtol", "round"), seconds, {"units": "s"}),
        },
        coords={"code": [solver.name for solver in solvers], "rtol": rtols},
        attrs={"law": law, "reference": exact},
    )


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

    A latched impact speed makes some designs depend on the tolerance itself: no error can be told there.
    """
    from peers.own_peer import plain_positions

    tight, tighter = (
        plain_positions(ensemble(scene(law, rtol, 0, 1), samples)) for rtol in (1e-10, 1e-11)
    )
    return tighter, np.abs(tight - tighter) < 1e-2 * ENSEMBLES[law]


def run_ensemble(
    modules: list[Any], law: str, wanted: float, samples: int, rounds: int
) -> xr.Dataset:
    """Milliseconds a trajectory and revolution at equal error."""
    exact, agreed = well_posed(law, samples)
    setups = [ensemble(scene(law, float(rtol), 0, 1), samples) for rtol in TOLERANCES]
    chosen, errors = {}, {}
    for name, (batch, most) in batches_of(modules, law).items():
        for setup in setups:
            part = first_of(setup, most)
            count = len(part.par)
            misses = np.abs(batch(part) - exact[:count])[agreed[:count]]
            error = float(np.median(np.nan_to_num(misses, nan=np.inf)))  # a failure is no success
            if error <= wanted:
                chosen[name], errors[name] = (batch, part), error
                break
    seconds = np.full((len(chosen), rounds), np.nan)
    names = list(chosen)
    for k in range(rounds):
        for i in np.roll(np.arange(len(names)), k):
            batch, setup = chosen[names[i]]
            seconds[i, k] = seconds_of(lambda batch=batch, setup=setup: batch(setup), 1)
    counts = np.array([len(chosen[name][1].par) for name in names])
    return xr.Dataset(
        {
            "each": (("code", "round"), seconds / counts[:, None] * 1e3, {"units": "ms"}),
            "agreed": ((), int(agreed.sum()), {"units": "1"}),
            "error": (("code",), [errors[name] for name in names], {"units": "m"}),
            "rtol": (("code",), [chosen[name][1].problem.rtol for name in names], {"units": "1"}),
        },
        coords={"code": names},
        attrs={"law": law, "wanted": wanted, "samples": samples},
    )


# ---- what is told ----------------------------------------------------------------------------------


def single_table(runs: xr.Dataset) -> list[str]:
    """Times by decade of error, then how many times longer than this package."""
    best = fastest(runs)
    ratio = (best / best.sel(code=OWN_SINGLE)).median("round")
    tables = {"ms a revolution": best.median("round") * 1e3, "times ours": ratio}
    lines = []
    for title, table in tables.items():
        lines += ["", f"single response, {runs.attrs['law']}: {title}, error up to ... m"]
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
        f"({int(runs['agreed'])} of {runs.attrs['samples']} samples have an error to tell)"
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


def main() -> None:
    """Load, measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--samples", type=int, default=512)
    parser.add_argument("-o", "--output", type=Path, default=Path("benchmark_peers.nc"))
    options = parser.parse_args()
    rounds, per_decade = (1, 1) if options.quick else (5, 2)
    rtols = 10.0 ** -np.arange(4.0, 13.5, 1.0 / per_decade)
    modules, missing = load()
    for name, reason in missing.items():
        print(f"missing: {name} ({reason})")
    tree = xr.DataTree(xr.Dataset(attrs={**provenance("", ""), "missing": str(missing)}))
    runs = {}
    for law in LAWS:
        runs[law] = work_precision(solvers_of(modules, law), law, rtols, rounds)
        tree[f"single/{law}"] = xr.DataTree(runs[law])
        print("\n".join(single_table(runs[law])), flush=True)
    for law, wanted in ENSEMBLES.items():
        found = run_ensemble(modules, law, wanted, options.samples, rounds)
        tree[f"ensemble/{law}"] = xr.DataTree(found)
        print("\n".join(ensemble_table(found)), flush=True)
    tree.to_netcdf(options.output, engine="h5netcdf")
    draw(runs, options.output.with_suffix(".png"))


if __name__ == "__main__":
    main()

"""Does anything drift? Energy residual and Baumgarte's constraint violation of each of 10 000 revolutions.

    python analysis/long_run.py -o results

writes long_run.nc and long_run.png: for each revolution the largest of all steps, in minimal coordinates (rtol 1e-8)
and in nine with multipliers. The energy residual is relative to max(kinetic energy, integral of |driving power|) so far,
so that round-off which adds up in proportion to the work leaves it level. Less than two minutes.
"""

import argparse
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from hard_cases import balance, chunks, recorded

from hpcclear import __version__
from hpcclear.dynamics.planar.problem import linkage_of
from hpcclear.dynamics.stepping import record as rec
from hpcclear.scene import Scene, load_scene

JOB = Path(__file__).parent.parent / "jobs" / "slider_crank.toml"
FORMULATIONS = ("minimal", "baumgarte")
CHUNK = 20_000
FIRST = 100  # revolutions that later ones are compared with


def largest_by_revolution(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Relative energy residual and constraint violation in m, the largest of each revolution."""
    lanes, par, start = recorded(scene)
    n = lanes.problem.coordinates
    turns = scene.numerics.transient_revolutions + int(scene.numerics.averaged_revolutions)
    begun, sizes = balance(scene, par[0], start, n)
    size = sizes[0]
    residual, violation = np.zeros(turns), np.full(turns, np.nan)
    for rows in filter(len, chunks(lanes)):
        total, sizes = balance(scene, par[0], rows, n)
        turn = rows[:, rec.REVOLUTION].astype(int)
        sizes = np.maximum.accumulate(np.r_[size, sizes])[1:]
        size = sizes[-1]
        np.maximum.at(residual, turn, np.abs(total - begun) / sizes)
        if scene.numerics.formulation == "baumgarte":
            q, v = (rows[:, rec.STATE + k * n : rec.STATE + (k + 1) * n].T for k in range(2))
            unmet = violation(linkage_of(scene), q, v, rows[:, rec.TURN_TIME])
            violation[turn] = np.fmax(violation[turn], 0.0)
            np.maximum.at(violation, turn, unmet)
    return residual, violation


def measure(revolutions: int) -> xr.Dataset:
    """Both formulations of the paper's case with one of its joints ideal, for the constraints, and both open."""
    data = {}
    for formulation in FORMULATIONS:
        scene = load_scene(JOB).with_(
            {
                "joints.crank_rod": {"kind": "ideal"},
                "numerics.formulation": formulation,
                "numerics.rtol": 1e-8,
                "numerics.transient_revolutions": 0,
                "numerics.averaged_revolutions": revolutions,
                "numerics.max_steps": 10**9,
            }
        )
        data[formulation] = largest_by_revolution(scene)
    coords = {"formulation": list(FORMULATIONS), "revolution": np.arange(1, revolutions + 1)}
    residual, violation = (np.stack([data[f][k] for f in FORMULATIONS]) for k in range(2))
    dims = ("formulation", "revolution")
    words = "energy residual over max(kinetic energy, driving work)", "constraint violation"
    return xr.Dataset(
        {
            "energy_residual": (dims, residual, {"long_name": words[0], "units": "1"}),
            "constraint_violation": (dims, violation, {"long_name": words[1], "units": "m"}),
        },
        coords,
        {"source": f"hpcclear {__version__}, analysis/long_run.py"},
    )


def figure(result: xr.Dataset, path: Path) -> None:
    """Both against the revolution; the dashed line is the largest of the first revolutions."""
    sheet, axes = plt.subplots(2, 1, figsize=(7.0, 5.0), sharex=True)
    for axis, name in zip(axes, ("energy_residual", "constraint_violation"), strict=True):
        for formulation, colour in zip(FORMULATIONS, ("#0072b2", "#e69f00"), strict=True):
            values = result[name].sel(formulation=formulation).dropna("revolution")
            if values.size:
                axis.plot(values.revolution, values, ".", color=colour, ms=2, label=formulation)
                early = float(values.isel(revolution=slice(FIRST)).max())
                axis.axhline(early, color=colour, ls="--", lw=1)
        axis.set_ylabel(
            f"{result[name].attrs['long_name'].split(' over')[0]}, {result[name].units}"
        )
        axis.set_yscale("log")
        axis.grid(alpha=0.3)
    axes[0].legend(frameon=False, markerscale=4)
    axes[1].set_xscale("log")
    axes[1].set_xlabel("revolution")
    sheet.tight_layout()
    sheet.savefig(path, dpi=150)
    plt.close(sheet)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--revolutions", type=int, default=10_000)
    parser.add_argument("-o", "--output", type=Path, default=Path("results"), help="folder")
    options = parser.parse_args()
    result = measure(options.revolutions)
    options.output.mkdir(parents=True, exist_ok=True)
    result.to_netcdf(options.output / "long_run.nc", engine="h5netcdf")
    figure(result, options.output / "long_run.png")
    for name, values in result.data_vars.items():
        for formulation in FORMULATIONS:
            chosen = values.sel(formulation=formulation)
            if chosen.notnull().any():
                early, late = chosen[:FIRST].max(), chosen[FIRST:].max()
                print(f"{name}, {formulation}: {early:.1e} to revolution {FIRST}, {late:.1e} later")


if __name__ == "__main__":
    main()

"""Stiff scenes: the automatic choice of method against the explicit pair alone and against LSODA, time at equal error.

    python analysis/benchmark_stiff.py              # about 4 min; needs `pip install "hpcclear[bench]"` and gfortran
    python analysis/benchmark_stiff.py --quick      # one round, about 1 min

Every revolution starts from a state of a long tight run, since from rest such scenes are ill-posed. The error is the root mean
square over the revolutions of the slider's position at their ends, against a run at rtol 1e-12. LSODA gets the same compiled
mechanics; where the law remembers impact speeds it is also told, free of charge, when the impacts happen, and starts anew at
each. Two of the scenes marked `tuning` served to choose the thresholds of the switch, the others did not.

Prints the times at 1e-6, 1e-7 and 1e-8 m and their ratios; writes benchmark_stiff.nc and benchmark_stiff.png.
"""

import argparse
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import NamedTuple

import hpcclear.base.jit  # before numbalsoda, which compiles as it is imported: then vectors' width is decided  # noqa: F401

# isort: split
import numpy as np
import xarray as xr
from drawing import error_panels
from matplotlib.axes import Axes
from numba import carray, cfunc, njit
from numbalsoda import lsoda, lsoda_sig
from plain_loop import motion
from scenes import JOB, Setup, single

from hpcclear.base.arrays import Array
from hpcclear.base.jit import FASTMATH
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout.views import Parameters, Start
from hpcclear.dynamics.stepping import record as rec
from hpcclear.dynamics.stepping.lanes import Lanes
from hpcclear.results.provenance import program
from hpcclear.scene import load_scene

SCENES = {
    # name: contact, friction coefficient, ramp speed in m/s, whether thresholds were chosen on it
    "friction 0.3, LN 0.9": ("lankarani-nikravesh", "restitution=0.9", 0.3, 1e-4, True),
    "friction 0.3, HC 0.5 s/m": ("hunt-crossley", "damping=0.5", 0.3, 1e-4, False),
    "HC 50 s/m": ("hunt-crossley", "damping=50.0", 0.01, 0.01, False),
    "HC 500 s/m": ("hunt-crossley", "damping=500.0", 0.01, 0.01, True),
    "paper's case": ("lankarani-nikravesh", "restitution=0.9", 0.01, 0.01, False),
}
METHODS = ("auto", "tsitouras")
LSODA = "LSODA"
TARGETS = np.array([1e-6, 1e-7, 1e-8])
REVOLUTIONS = 10
SETTLED = 3  # revolutions before the first that counts
SLIDER = 3
STATES = 8
SHORTEST = 0.02  # s a measurement lasts at least


class Case(NamedTuple):
    """Revolutions of one scene: their start states, where the slider is at their ends, and the impacts on the way."""

    setups: dict[tuple[str, float], Setup]
    exact: Array  # (revolutions,)
    pieces: list[list[tuple[float, Array]]]  # of each: start of the piece in s, its 1/d'_0 (2,)


def scene_of(name: str, method: str, rtol: float):
    """One revolution of a scene of `SCENES` with c = 0.3 mm."""
    law, damping, friction, ramp, _ = SCENES[name]
    return load_scene(JOB, [
        f"effects.contact={{law='{law}', {damping}}}",
        f"effects.friction={{law='coulomb', coefficient={friction}, ramp_speed={ramp}}}",
        "joints.crank_rod.clearance=3e-4", "joints.rod_slider.clearance=3e-4",
        "numerics.transient_revolutions=0", "numerics.averaged_revolutions=1",
        "numerics.max_steps=1000000000", f"numerics.rtol={float(rtol)!r}", f"numerics.method='{method}'",
    ])  # fmt: skip


def ends(lanes: Lanes, given: Setup) -> Array:
    """Slider positions (revolutions,) after one revolution from each start."""
    outcome = lanes.run(given.par[: len(given.start)], given.start)
    return outcome.coordinates(4)[:, SLIDER]


def impacts(given: Setup, row: int) -> list[tuple[float, Array]]:
    """Pieces of one revolution between impacts, from a recorded tight run."""
    lanes = Lanes(given.problem, 1, np.zeros((1 << 20, rec.columns(4))))
    lanes.queue(given.par[:1], given.start[row : row + 1], np.zeros(1, np.int64))
    parts = []
    while lanes.pending:
        lanes.advance(10.0)
        parts.append(lanes.take_record())
    rows = np.concatenate(parts)
    inverse = given.start[row].inverse_impact[:2].copy()
    pieces = [(0.0, inverse)]
    for after in rows[1:]:
        new = (after[rec.CONTACTS : rec.CONTACTS + 2] == 1.0) & (
            after[rec.CONTACTS + rec.JOINTS : rec.CONTACTS + rec.JOINTS + 2] != pieces[-1][1]
        )
        if new.any() and after[rec.REVOLUTION] == 0.0:
            inverse = np.where(
                new, after[rec.CONTACTS + rec.JOINTS : rec.CONTACTS + rec.JOINTS + 2], pieces[-1][1]
            )
            pieces.append((float(after[rec.TURN_TIME]), inverse))
    return pieces


def prepare(name: str, revolutions: int, rtols: Array) -> Case:
    """Start states from a tight run, the exact ends, and the set-ups of every method and tolerance."""

    def at_tolerance(method: str, rtol: float) -> Setup:
        return single(scene_of(name, method, rtol))

    tight = at_tolerance("tsitouras", 1e-11)
    lanes = Lanes(tight.problem, 1)
    start, starts = tight.start, []
    for k in range(SETTLED + revolutions):
        if k >= SETTLED:
            starts.append(start.rows)
        start = lanes.run(tight.par, start).end()
    start = Start(np.concatenate(starts))
    par = np.repeat(tight.par, revolutions, axis=0)

    def with_start(given: Setup) -> Setup:
        return given._replace(par=par, start=start)

    sharp = with_start(at_tolerance("tsitouras", 1e-12))
    exact = ends(Lanes(sharp.problem, 1), sharp)
    latched = sharp.problem.effects.latched is not None
    none = [(0.0, np.zeros(2))]
    pieces = [impacts(sharp, k) if latched else none for k in range(revolutions)]
    setups = {(m, r): with_start(at_tolerance(m, r)) for m in METHODS for r in rtols}
    return Case(setups, exact, pieces)


# ---- LSODA -----------------------------------------------------------------------------------------


@cache
def mechanics(latched: bool):
    """The plain loop's right-hand side for LSODA, compiled; 1/d'_0 of both joints follow the parameters."""
    size = at.OWN + 2

    @njit(error_model="numpy", fastmath=FASTMATH)
    def rates(t, y, dy, p):
        gaps = np.empty(4)
        motion(t, y, dy, p, latched, np.ones(2, np.bool_), p[at.OWN :], gaps)

    @cfunc(lsoda_sig)
    def right_hand_side(t, u, du, p):
        rates(t, carray(u, (STATES,)), carray(du, (STATES,)), carray(p, (size,)))

    return right_hand_side


def lsoda_solver(case: Case, given: Setup, rtol: float) -> Callable[[], Array]:
    """All revolutions by LSODA: slider positions at their ends."""
    address = mechanics(given.problem.effects.latched is not None).address
    period = float(Parameters(given.par[0]).period)
    work = []
    for k, pieces in enumerate(case.pieces):
        times = [piece[0] for piece in pieces[1:]] + [period]
        spans = [
            (np.array([a, b]), np.concatenate([given.par[k], inverse]))
            for (a, inverse), b in zip(pieces, times, strict=True)
        ]
        work.append((given.start[k].state(4), spans))

    def solve() -> Array:
        found = np.full(len(work), np.nan)
        for k, (y, spans) in enumerate(work):
            for times, p in spans:
                states, success = lsoda(
                    address, y, times, p, rtol=rtol, atol=1e-3 * rtol, mxstep=10**8
                )
                y = states[-1]
                if not success:
                    break
            else:
                found[k] = y[SLIDER]
        return found

    return solve


# ---- measuring -------------------------------------------------------------------------------------


def own_solver(given: Setup) -> Callable[[], Array]:
    """All revolutions by this package, one lane."""
    lanes = Lanes(given.problem, 1)
    return lambda: ends(lanes, given)


def seconds_of(call: Callable[[], Array], repeats: int) -> float:
    """Processor seconds of one call."""
    started = time.process_time()
    for _ in range(repeats):
        call()
    return (time.process_time() - started) / repeats


def measure(name: str, revolutions: int, rtols: Array, rounds: int) -> xr.Dataset:
    """Error and seconds a revolution of every method at every tolerance, in every round."""
    case = prepare(name, revolutions, rtols)
    solvers = {key: own_solver(given) for key, given in case.setups.items()}
    for rtol in rtols:
        solvers[LSODA, rtol] = lsoda_solver(case, case.setups["auto", rtol], float(rtol))
    names = [*METHODS, LSODA]
    error = np.full((len(names), len(rtols)), np.nan)
    seconds = np.full((*error.shape, rounds), np.nan)
    repeats = np.ones(error.shape, int)
    for i, method in enumerate(names):
        for j, rtol in enumerate(rtols):
            off = solvers[method, rtol]() - case.exact  # compiles as well
            error[i, j] = np.sqrt(np.mean(off**2))
            first = seconds_of(solvers[method, rtol], 1)
            repeats[i, j] = max(1, int(SHORTEST / max(first, 1e-6)))
    for k in range(rounds):
        for i in np.roll(np.arange(len(names)), k):
            for j, rtol in enumerate(rtols):
                each = seconds_of(solvers[names[i], rtol], int(repeats[i, j]))
                seconds[i, j, k] = each / revolutions
    return xr.Dataset(
        {
            "error": (("code", "rtol"), error, {"units": "m"}),
            "seconds": (("code", "rtol", "round"), seconds, {"units": "s"}),
        },
        coords={"code": names, "rtol": rtols},
        attrs={"scene": name, "tuning": int(SCENES[name][-1])},
    )


def fastest(runs: xr.Dataset) -> xr.DataArray:
    """Seconds of the fastest run at least as good as each target, (method, target, round); NaN: none is."""
    pieces = [runs["seconds"].where(runs["error"] <= target).min("rtol") for target in TARGETS]
    return xr.concat(pieces, xr.DataArray(TARGETS, dims="target", name="target"))


def table(runs: xr.Dataset) -> list[str]:
    """Times at the targets, and how many times longer than the automatic choice."""
    best = fastest(runs)
    ratio = (best / best.sel(code="auto")).median("round")
    tuned = ", tuning" if runs.attrs["tuning"] else ""
    lines = ["", f"{runs.attrs['scene']}{tuned}: ms a revolution (times the automatic choice)"]
    lines.append(f"{'error up to, m':<20}" + "".join(f"{target:>18.0e}" for target in TARGETS))
    for method in runs["code"].values:
        cells = [
            f"{float(best.sel(code=method, target=t).median('round')) * 1e3:.3g}"
            f" ({float(ratio.sel(code=method, target=t)):.2f})"
            for t in TARGETS
        ]
        lines.append(f"{method:<20}" + "".join(f"{cell:>18}" for cell in cells))
    return lines


def draw(all_runs: dict[str, xr.Dataset], path: Path) -> None:
    """Time against error, a panel for each scene."""

    def curve(panel: Axes, k: int, method: str, row: xr.Dataset) -> None:
        panel.plot(
            row["error"], row["seconds"].median("round") * 1e3, marker="osv"[k],
            markersize=3, color=("#0072b2", "#d55e00", "#009e73")[k], label=method,
        )  # fmt: skip

    figure, axes = error_panels(all_runs, 2.6, 3.2, curve)
    axes[0].set_ylabel("processor time a revolution, ms")
    axes[0].legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(path, dpi=200)


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--scene", choices=SCENES, action="append")
    parser.add_argument("-o", "--output", type=Path, default=Path("benchmark_stiff.nc"))
    options = parser.parse_args()
    rounds = 1 if options.quick else 5
    rtols = 10.0 ** -np.arange(2.0, 11.01, 0.25)
    tree = xr.DataTree(xr.Dataset(attrs=program()))
    all_runs = {}
    for name in options.scene or SCENES:
        all_runs[name] = measure(name, REVOLUTIONS, rtols, rounds)
        print("\n".join(table(all_runs[name])), flush=True)
        tree[name.replace("/", " per ")] = xr.DataTree(all_runs[name])
    tree.to_netcdf(options.output, engine="h5netcdf")
    draw(all_runs, options.output.with_suffix(".png"))


if __name__ == "__main__":
    main()

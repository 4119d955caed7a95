"""The kernel alone: milliseconds a revolution, nanoseconds a force evaluation, and what the assembly holds.

    python analysis/benchmark_kernel.py                  # about 3 minutes, most of it compiling
    python analysis/benchmark_kernel.py --samples 64     # shorter
    python analysis/benchmark_kernel.py --lanes 8 16     # other numbers of lanes

Lanes of W = 1, 16, 32 and the number that the package chooses beside the plain loop of `plain_loop.py`, all on one core and
in one run: Latin hypercube of the paper's Table 3, Lankarani-Nikravesh, rtol 1e-6, 10 revolutions. Paired rounds in
changing order; medians of the ratios within a round. Writes benchmark_kernel.nc. A step that lasts longer than `LONGEST`
ends the run with a traceback.
"""

import argparse
import faulthandler
import math
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import plain_loop
import xarray as xr
from assembly import Arithmetic, executed_arithmetic, force_evaluation
from drawing import by_code
from numba import njit
from scenes import Setup, ensemble, scene

from hpcclear.base.jit import FASTMATH
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.evaluation.evaluator import DEFAULT_LANES
from hpcclear.dynamics.layout.views import Outcome, Parameters
from hpcclear.dynamics.linkage.rhs import run_motion
from hpcclear.dynamics.stepping.lanes import Lanes
from hpcclear.results.provenance import program

WIDTHS = tuple(sorted({1, 16, 32, DEFAULT_LANES}))
LONGEST = 600.0  # s, of one task or one compilation
YARDSTICK = "plain loop"
REVOLUTIONS = (5, 5)  # transient, averaged


def guarded() -> None:
    """Let the process end with a traceback if what follows takes longer than `LONGEST`."""
    faulthandler.dump_traceback_later(LONGEST, exit=True)


def run_lanes(setup: Setup, width: int) -> Outcome:
    """Simulate a setup on lanes; outcomes in the order of the samples."""
    return Lanes(setup.problem, width).run(setup.par, setup.start)


def run_plain(setup: Setup) -> np.ndarray:
    """The same by the plain loop."""
    p = setup.problem
    latched = p.effects.latched is not None
    return plain_loop.run(
        setup.par,
        setup.start.rows,
        p.rtol,
        tuple(p.atol * Parameters(setup.par[0]).tolerances(4)),
        (p.transient, p.averaged),
        latched,
        p.impact_floor,
    )


def paired_rounds(tasks: Mapping[str, Callable[[], Any]], rounds: int) -> dict[str, np.ndarray]:
    """Processor seconds of every task in every round; the order changes from round to round."""
    names = list(tasks)
    seconds: dict[str, list[float]] = {name: [] for name in names}
    for round_number in range(rounds):
        shift = round_number % len(names)
        for name in names[shift:] + names[:shift]:
            guarded()
            started = time.process_time()  # one core's, whatever else runs
            tasks[name]()
            seconds[name].append(time.process_time() - started)
    return {name: np.array(values) for name, values in seconds.items()}


def _force_loop(width: int) -> Callable[..., Any]:
    """Repeats the force evaluation of all lanes, each at a state that depends on the one before."""

    @njit(error_model="numpy", fastmath=FASTMATH)
    def repeat(motion, work, tables, count):
        for _ in range(count):
            run_motion(motion, work, tables)
            for i in range(width):
                work[(at.QS + 3) * width + i] += 1e-14 * work[(at.ACC + 3) * width + i]

    return repeat


@njit(error_model="numpy", fastmath=FASTMATH)
def _plain_force_loop(y, p, latched, count):
    dy, gaps = np.empty(plain_loop.STATES), np.empty(4)
    active, inverse = np.ones(2, np.bool_), np.ones(2)
    for _ in range(count):
        plain_loop.rates(1e-3, y, dy, p, latched, active, inverse, gaps)
        y[3] += 1e-14 * dy[7]
    return gaps


def force_tasks(setup: Setup, widths: Sequence[int], count: int) -> dict[str, Callable[[], Any]]:
    """Force evaluations in contact, `count` a lane, compiled already."""
    tasks: dict[str, Callable[[], Any]] = {}
    q, v = setup.start[0].coordinates(4).copy(), setup.start[0].velocities(4)
    q[3] += 4e-4  # O23 well in contact
    for width in widths:
        guarded()
        repeat = _force_loop(width)
        work = np.zeros((at.BANK, width))
        rows = setup.par.shape[1]  # only those that the scene has
        work[at.WORK : at.WORK + rows] = np.repeat(setup.par[:1].T, width, 1)
        work[at.QS : at.QS + 4], work[at.VS : at.VS + 4] = q[:, None], v[:, None]
        work[[at.ACTIVE, at.ACTIVE + 1, at.INVERSE_IMPACT, at.INVERSE_IMPACT + 1]] = 1.0
        motion = setup.problem.motion(setup.problem.effects, width).address
        arguments = (motion, work.ravel(), setup.problem.tables)
        repeat(*arguments, 1)
        tasks[f"W = {width}"] = lambda f=repeat, a=arguments: f(*a, count)
    y = np.concatenate([q, v, [0.0, 0.0]])
    latched = setup.problem.effects.latched is not None
    _plain_force_loop(y.copy(), setup.par[0], latched, 1)
    tasks[YARDSTICK] = lambda: _plain_force_loop(y.copy(), setup.par[0], latched, count)
    return tasks


def assembly_of(setup: Setup, width: int) -> Arithmetic:
    """The force evaluation's arithmetic as emitted for this processor."""
    return executed_arithmetic(force_evaluation(setup.problem, width))


@njit(error_model="numpy", fastmath=FASTMATH)
def _roots(x, y, rounds):
    for _ in range(rounds):
        for i in range(x.size):
            y[i] = math.sqrt(x[i])
        x[0] = y[1]


@njit(error_model="numpy")
def _quotients(x, y, rounds):
    for _ in range(rounds):
        for i in range(x.size):
            y[i] = 1.0 / x[i]
        x[0] = y[1]


@njit(error_model="numpy", fastmath=FASTMATH)
def _products(x, y, rounds):
    for _ in range(rounds):
        for i in range(x.size):
            z = x[i]
            a, b, c, d = (
                z,
                z + 1.0,
                z + 2.0,
                z + 3.0,
            )  # chains side by side hide each other's latency
            for _ in range(8):
                a, b, c, d = a * z + 0.5, b * z + 0.25, c * z + 0.125, d * z + 0.0625
            y[i] = (a + b) + (c + d)
        x[0] = y[1]


def throughput() -> dict[str, float]:
    """Nanoseconds a lane that a square root, a quotient, and a product with a sum take this processor at best."""
    x, y, rounds = np.full(512, 0.5), np.empty(512), 20_000
    found = {}
    for name, loop, each in (
        ("root", _roots, 1),
        ("quotient", _quotients, 1),
        ("product", _products, 32),
    ):
        loop(x, y, 1)
        seconds = []
        for _ in range(5):
            x[:] = 0.5
            started = time.process_time()
            loop(x, y, rounds)
            seconds.append(time.process_time() - started)
        found[name] = min(seconds) / (rounds * x.size * each) * 1e9
    return found


def floor_of(arithmetic: Arithmetic, speed: Mapping[str, float]) -> tuple[float, float]:
    """Least nanoseconds of a force evaluation, per lane: by roots and quotients, by products and sums.

    The divider works beside the multipliers: the larger of the two bounds the whole. Sums are counted with
    the products, two at a time, which adders of their own would better.
    """
    kinds = arithmetic.packed
    divider = kinds["sqrt"] * speed["root"] + kinds["div"] * speed["quotient"]
    plain = kinds.total() - kinds["sqrt"] - kinds["div"]
    return divider, plain * speed["product"]


def measure(samples: int, widths: Sequence[int], rounds: int) -> xr.Dataset:
    """All measurements of this benchmark."""
    setup = ensemble(scene("lankarani-nikravesh", 1e-6, *REVOLUTIONS), samples)
    tasks: dict[str, Callable[[], Any]] = {
        f"W = {width}": lambda width=width: run_lanes(setup, width) for width in widths
    }
    tasks[YARDSTICK] = lambda: run_plain(setup)
    results = {}
    for name, task in tasks.items():  # compiles as well
        guarded()
        results[name] = task()
    seconds = paired_rounds(tasks, rounds)
    count = 200_000
    force = paired_rounds(force_tasks(setup, widths, count), rounds)
    lanes = [*widths, 1]
    found = [assembly_of(setup, width) for width in widths]
    agreement = np.abs(results[YARDSTICK][:, 0] / results[f"W = {widths[0]}"].objective - 1.0)
    table = np.array([seconds[name] for name in tasks])
    ns = np.array([force[name] for name in tasks]) / (np.array(lanes)[:, None] * count) * 1e9
    plain_evaluations = results[YARDSTICK][:, 3].sum()
    evaluations = [results[f"W = {w}"].evaluations.sum() for w in widths]
    divider, multipliers = floor_of(found[-1], throughput())
    unit = {"units": "1"}
    return xr.Dataset(
        {
            "time": (
                ("code", "round"),
                table / (samples * sum(REVOLUTIONS)) * 1e3,
                {"units": "ms"},
            ),
            "force_time": (("code", "round"), ns, {"units": "ns"}),
            "evaluations": (("code",), [*evaluations, plain_evaluations], unit),
            "packed_share": (("width",), [part.packed_share for part in found], unit),
            "packed": (("width",), [part.packed.total() for part in found], unit),
            "vector_bits": (("width",), [part.vector_bits for part in found], unit),
            "floor_divider": ((), divider, {"units": "ns"}),
            "floor_multipliers": ((), multipliers, {"units": "ns"}),
            "disagreement": ((), float(np.median(agreement)), unit),
        },
        coords={"code": list(tasks), "width": list(widths)},
        attrs={
            "samples": samples,
            **program(),
            "packed_kinds": str(dict(found[-1].packed)),
        },
    )


def report(data: xr.Dataset) -> str:
    """80-column table."""
    lines = [
        f"{'':<12}{'ms a revolution':>16}{'of plain':>10}{'evaluations':>13}{'ns a force':>12}"
    ]
    ratio = data["time"] / data["time"].sel(code=YARDSTICK)
    for code, row in by_code(data):
        lines.append(
            f"{code:<12}{float(row['time'].median()):>16.4f}"
            f"{1.0 / float(ratio.sel(code=code).median()):>9.2f}x"
            f"{int(row['evaluations']):>13}{float(row['force_time'].median()):>12.1f}"
        )
    shares = ", ".join(
        f"W = {int(w)}: {float(s):.0%}"
        for w, s in zip(data["width"], data["packed_share"], strict=True)
    )
    lines.append(f"packed arithmetic in the force evaluation: {shares}")
    lines.append(f"W = {int(data['width'][-1])} emits {data.attrs['packed_kinds']}")
    floors = float(data["floor_divider"]), float(data["floor_multipliers"])
    lines.append(
        f"floor of a force evaluation: {max(floors):.1f} ns a lane"
        f" (divider {floors[0]:.1f}, multipliers {floors[1]:.1f})"
    )
    lines.append(
        f"median disagreement with the plain loop: {float(data['disagreement']):.1e} of the objective"
    )
    return "\n".join(lines)


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, default=256)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument(
        "--lanes", type=int, nargs="+", default=list(WIDTHS), help="numbers of lanes"
    )
    parser.add_argument("-o", "--output", type=Path, default=Path("benchmark_kernel.nc"))
    options = parser.parse_args()
    data = measure(options.samples, options.lanes, options.rounds)
    print(report(data))
    data.to_netcdf(options.output, engine="h5netcdf")


if __name__ == "__main__":
    main()

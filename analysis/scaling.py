"""How far the hand-out of samples carries: a model of the package's own policy on up to 100 000 ranks.

    python analysis/scaling.py            # about 5 minutes; writes scaling.nc and scaling.png
    python analysis/scaling.py --quick    # up to 1 000 ranks, a minute

Measured on this machine, in the same run: what samples cost (the paper's box, ten revolutions), what root spends on
each message, each sample handed out and each record taken in (statistics and checkpoints included), and
start-up. A discrete-event simulation (`scaling_model.py`) then lets ranks ask, root answer one message after the
other between quanta of its own work, and ranks run dry, with `hpcclear.ranks.schedule.allot` as the policy and
others beside it. Start-up is shown apart: it is paid once, whatever the work.
"""

import argparse
import os
import pickle
import subprocess
import sys
import time
from pathlib import Path

import matplotlib
import numpy as np
import xarray as xr
from many_ranks import fitted
from scaling_model import POLICIES, WORK, Costs, Outcome, simulate

from hpcclear.base.outcome import OUTCOME
from hpcclear.ranks.schedule import HandOut, Need
from hpcclear.results.provenance import program

LANES = 32
RANKS = (2, 8, 32, 100, 300, 1000, 3000, 10_000, 100_000)
LONGER = {"measured samples": 1, "10 times as long": 10, "100 times as long": 100}
LIMIT = 0.9


# ---- measurements ------------------------------------------------------------------------------------


def sample_costs(samples: int) -> np.ndarray:
    """Seconds of one core for each sample: its share of the run by force evaluations, shape (samples,)."""
    from benchmark_kernel import run_lanes
    from scenes import ensemble, scene

    setup = ensemble(scene("lankarani-nikravesh", 1e-6, 5, 5), samples)
    run_lanes(setup, LANES)
    started = time.process_time()
    evaluations = run_lanes(setup, LANES).evaluations
    return evaluations * (time.process_time() - started) / evaluations.sum()


def message_cost(messages: int = 3000) -> float:
    """Seconds of root for a message: between two ranks under mpiexec, by this script itself."""
    mpiexec = Path(sys.executable).parent / "mpiexec"
    command = [str(mpiexec), "-n", "2", sys.executable, __file__, "--messages", str(messages)]
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[1])}
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
    return float(done.stdout.split()[-1])


def exchange(messages: int) -> None:
    """Both ranks of `message_cost`: one asks, root answers and prints the median of what it took."""
    from mpi4py import MPI

    from hpcclear.ranks.mailbox import Mail, Tag

    mail = Mail(MPI, finalizes=False)
    if mail.rank == 1:
        for _ in range(messages):
            mail.send(0, Tag.ASK, (np.zeros(1, OUTCOME), Need(LANES, 5, 1000.0)))
            while mail.poll() is None:
                pass
        return
    book, seconds = HandOut(10**6, np.empty(0, np.int64), 1000), []
    while len(seconds) < messages:
        started = time.perf_counter()
        message = mail.poll()
        if message is not None:
            index, ask_below = book.grant(message.body[1])
            mail.send(1, Tag.BLOCK, (index[:1], np.zeros((1, 5)), ask_below))
            seconds.append(time.perf_counter() - started)
    print(np.median(seconds))


def seconds_each(action, repeats: int, items: int) -> float:
    """Seconds of this process for one item of an action that handles `items`."""
    action()
    started = time.process_time()
    for _ in range(repeats):
        action()
    return (time.process_time() - started) / (repeats * items)


def handed_cost() -> float:
    """Seconds of root for a sample handed out: its point made and pickled."""
    from scenes import scene

    from hpcclear.scene import load_scene
    from hpcclear.scene.sampling import MonteCarloPoints

    content = scene("lankarani-nikravesh", 1e-6, 5, 5).resolved()
    content["study"]["method"] = "monte-carlo"
    points = MonteCarloPoints(load_scene(content), 10**7)
    first = iter(range(0, 10**7, 500))

    def hand_out() -> None:
        index = np.arange(500) + next(first)
        pickle.dumps((index, points[index]))

    return seconds_each(hand_out, 200, 500)


def start_up() -> float:
    """Seconds from the start of a process to its first finished simulation, compiled code on disk."""
    program = (
        f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r})\n"
        "from scenes import scene\nfrom hpcclear import evaluate\n"
        "from hpcclear.dynamics.evaluation.evaluator import Evaluator\nfrom hpcclear.scene.points import Points\n"
        "import numpy as np\n"
        "e = Evaluator(scene('lankarani-nikravesh', 1e-6, 0, 1), Points(('m3',), np.empty((0, 1)), "
        "(('mechanism.slider.mass',),)))\n"
        "e.submit(np.arange(1), np.array([[0.14]]))\nwhile e.pending: e.advance(0.1)\n"
    )
    seconds = []
    for _ in range(3):
        started = time.perf_counter()
        subprocess.run([sys.executable, "-c", program], check=True)
        seconds.append(time.perf_counter() - started)
    return min(seconds)


def measure(samples: int) -> Costs:
    """All costs, on this machine."""
    line, message, handed = fitted(), message_cost(), handed_cost()
    return Costs(
        samples=sample_costs(samples),
        message=message,
        record=max(line.sample - handed, 0.0),
        handed=handed,
        start=start_up(),
        batch=max(line.message - message, 0.0),
    )


# ---- model and figure ---------------------------------------------------------------------------


def model(costs: Costs, ranks: tuple[int, ...], seed: int = 1) -> xr.Dataset:
    """Every policy on every number of ranks, for samples as measured and for longer ones."""
    names = list(POLICIES)
    shape = (len(LONGER), len(names), len(ranks))
    table = {name: np.full(shape, np.nan) for name in Outcome._fields}
    for a, longer in enumerate(LONGER.values()):
        chosen = costs._replace(samples=costs.samples * longer)
        for b, name in enumerate(names):
            for c, count in enumerate(ranks):
                found = simulate(chosen, count, POLICIES[name], seed=seed)
                for key, value in found._asdict().items():
                    table[key][a, b, c] = value
    dims = ("samples", "policy", "ranks")
    units = {"efficiency": "1", "root_load": "1", "makespan": "s", "requests": "1"}
    words = {
        "efficiency": "busy time over ranks times makespan",
        "root_load": "root's time on messages",
    }
    data = {
        key: (dims, value, {"units": units[key], "long_name": words.get(key, key)})
        for key, value in table.items()
    }
    measured = {f"cost_{k}": v for k, v in costs._asdict().items() if k != "samples"}
    spread = np.quantile(costs.samples, [0.0, 0.5, 1.0])
    return xr.Dataset(
        {
            **data,
            **{name: ((), value, {"units": "s"}) for name, value in measured.items()},
            "cost_sample": (("quantile",), spread, {"units": "s"}),
        },
        coords={
            "samples": list(LONGER), "policy": names, "ranks": list(ranks), "quantile": [0, 0.5, 1],
        },
        attrs={**program(), "work_of_a_rank": f"{WORK:g} s"},
    )  # fmt: skip


def draw(data: xr.Dataset, path: Path) -> None:
    """Efficiency against ranks, a panel for each length of samples, and start-up."""
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 3, figsize=(9.0, 3.0), sharey=True, layout="constrained")
    for axis, length in zip(axes, data["samples"].values, strict=True):
        for style, policy in zip(("-o", "-s", "-^", "-v"), data["policy"].values, strict=True):
            shown = data["efficiency"].sel(samples=length, policy=policy)
            axis.plot(data["ranks"], shown, style, markersize=3, linewidth=1, label=policy)
        start = WORK / (WORK + data["cost_start"].item())
        axis.axhline(start, color="0.6", linestyle=":", linewidth=1)
        axis.annotate("start-up alone", (2, start), fontsize=7, color="0.4", va="top")
        axis.set(xscale="log", xlabel="ranks", ylim=(0, 1.03))
        mean = float(data["cost_sample"].sel(quantile=0.5)) * LONGER[str(length)]
        axis.set_title(f"{length}: {mean * 1e3:.3g} ms each", fontsize=8)
    axes[0].set_ylabel("busy time / (ranks x makespan)")
    axes[0].legend(fontsize=7, loc="lower left")
    figure.savefig(path, dpi=200)


def bottleneck(data: xr.Dataset, length: str) -> str:
    """Where the package's policy falls below the limit, and what root does there."""
    chosen = data.sel(samples=length, policy="package")
    short = chosen["efficiency"].values < LIMIT
    if not short.any():
        return f"above {LIMIT} up to {int(chosen['ranks'][-1])} ranks"
    first = int(np.argmax(short))
    ranks = int(chosen["ranks"][first])
    mean = float(data["cost_sample"].sel(quantile=0.5)) * LONGER[length]
    message = float(data["cost_message"]) + float(data["cost_batch"])
    each = {
        "records taken in": float(data["cost_record"]) * WORK / mean,
        "points handed out": float(data["cost_handed"]) * WORK / mean,
        "messages": message * float(chosen["requests"][first]) / ranks,
    }
    name = max(each, key=lambda key: each[key])
    load = float(chosen["root_load"][first])
    return (
        f"below {LIMIT} from {ranks} ranks on; root is busy {load:.0%} of the time,\n"
        f"  most of it with {name} ({each[name] * 1e3:.2g} ms for each rank and {WORK:g} s of work)"
    )


def report(data: xr.Dataset) -> str:
    """80-column tables."""
    lines = ["measured: " + ", ".join(
        f"{name.removeprefix('cost_')} {float(data[name]):.2g} s"
        for name in data if str(name).startswith("cost_") and data[name].ndim == 0
    )]  # fmt: skip
    for length in data["samples"].values:
        lines += ["", f"{length}: efficiency, {WORK:g} s of work a rank"]
        widths = [len(str(name)) + 2 for name in data["policy"].values]
        named = zip(data["policy"].values, widths, strict=True)
        lines.append(f"{'ranks':>8}" + "".join(f"{name:>{width}}" for name, width in named))
        for count in data["ranks"].values:
            row = data["efficiency"].sel(samples=length, ranks=count).values
            shown = zip(row, widths, strict=True)
            lines.append(f"{count:>8}" + "".join(f"{value:>{width}.3f}" for value, width in shown))
        lines.append(bottleneck(data, str(length)))
    return "\n".join(lines)


def main() -> None:
    """Measure, model, print, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("-o", "--output", type=Path, default=Path("scaling.nc"))
    parser.add_argument("--messages", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.messages is not None:
        exchange(options.messages)
        return
    costs = measure(256 if options.quick else 1024)
    data = model(costs, tuple(r for r in RANKS if not options.quick or r <= 1000))
    print(report(data))
    data.to_netcdf(options.output, engine="h5netcdf")
    draw(data, options.output.with_suffix(".png"))


if __name__ == "__main__":
    main()

"""Made machines identified from made signals: do 95 % intervals hold, and is what the model lacks noticed?

    nice -n 15 python analysis/identify_machines.py OUT [--machines 200] [--seed 2] [--rows ROWS.json]
    python analysis/identify_machines.py --table ROWS.json
    python analysis/identify_machines.py OUT --advise
    python analysis/identify_machines.py OUT --raw

Three mechanisms, one and two unknown clearances, random masses, friction and restitution, noise of 2, 10 and 30 %. All signals
are made at another integration tolerance than the ensemble's; in a third of the machines there is an effect that the model
lacks. Each mechanism, number of unknowns and noise has the same share of these. A machine follows from the seed and its number.

One ensemble serves all machines of a mechanism and number of unknowns. Ensembles, signals and machines are kept in OUT as they
finish: the same command continues. Tables are written to `analysis/results`. `--advise`
compares signals for two unknowns. `--raw` fits the raw signal by least squares.
"""

import argparse
import json
import tempfile
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from recorded import record

from hpcclear import load_scene, simulate
from hpcclear.dynamics.response import simulate_together
from hpcclear.ensemble.single import SHORTEST
from hpcclear.identify import training
from hpcclear.identify.advice import advice
from hpcclear.identify.features import Layout
from hpcclear.identify.inputs import Inputs
from hpcclear.identify.judgement import features_of, judged, prepare
from hpcclear.identify.made import write_made
from hpcclear.identify.measured import Measured, read_measured
from hpcclear.identify.signals import Sensor
from hpcclear.identify.training import Ensemble, prepared_scene
from hpcclear.ranks.boundary import alone

JOBS = Path(__file__).resolve().parent.parent / "jobs"
NOISE = (0.02, 0.1, 0.3)
SIGNALS = ("crank_moment", "frame_force_x")
SHORT = {"crank_moment": "torque", "frame_force_x": "frame force"}
MECHANISMS = ("slider-crank", "crank-rocker", "press")
SOFT = {"youngs_modulus": 1e9, "poisson_ratio": 0.38}  # polymer bushes: fewer steps than bronze


def normal(path: str, deviation: float) -> dict[str, Any]:
    return {"path": path, "distribution": "normal", "deviation": deviation}


def uniform(path: str, half_width: float) -> dict[str, Any]:
    return {"path": path, "distribution": "uniform", "half_width": half_width}


def linkage(name: str, first: str, random: dict[str, Any]) -> Any:
    scene = load_scene(JOBS / "linkages" / f"{name}.toml")
    study = {"seed": 1, "variables": {"C": {"range": [1e-5, 2e-4]}}, "random": random}
    softer = {f"mechanism.joints.{first}.materials.bearing.{k}": v for k, v in SOFT.items()}
    numerics = {"rtol": 1e-5, "averaged_revolutions": 20, "max_steps": 10_000_000}
    own = {f"numerics.{name}": value for name, value in numerics.items()}
    return scene.with_({"study": study, **own, **softer})


def mechanisms() -> dict[str, dict[str, Any]]:
    """Scenes, their unknowns, and effects that machines have and models lack."""
    pin = {"kind": "clearance", "clearance": 6e-5, "bearing_radius": 0.02}
    pin |= {"bearing": {"youngs_modulus": 1e11, "poisson_ratio": 0.3}}
    pin |= {"journal": {"youngs_modulus": 2.068e11, "poisson_ratio": 0.29}}
    slider = load_scene(JOBS / "identify.toml")
    hunt = {"effects.contact": {"law": "hunt-crossley", "damping": 0.4}}
    latched = {"effects.contact": {"law": "lankarani-nikravesh", "restitution": 0.7}}
    friction = "effects.friction.coefficient"
    rocker = linkage("crank_rocker", "o2", {
        "m": normal("mechanism.bodies.rocker.mass", 1.25e-3), "mu": uniform(friction, 0.015),
        "d": uniform("effects.contact.damping", 0.1),
    })  # fmt: skip
    press = linkage("press", "o3", {
        "m": normal("mechanism.bodies.ram.mass", 7.5e-3), "mu": uniform(friction, 0.009),
        "d": uniform("effects.contact.damping", 0.1),
    })  # fmt: skip
    drag = {"mechanism.loads.drag": {"kind": "torque", "body": "rocker", "torque": -0.3}}
    few = ["joints.crank_rod.clearance=10um:150um"]
    wild = {"drive.speed": 1500 * np.pi / 30, "effects.contact.restitution": 0.9}
    wild |= {friction: 0.01, "study.random.friction.half_width": 0.004}
    wild |= {"study.random.restitution.half_width": 0.03}
    return {
        "chaotic": {"scene": slider.with_(wild), "unknowns": few, "two": {}, "lacks": []},
        "slider-crank": {
            "scene": slider,
            "unknowns": ["joints.crank_rod.clearance=10um:150um", "joints.rod_slider.clearance=10um:150um"],
            "two": {"joints.rod_slider": pin},
            "lacks": [{"effects.gravity": 9.81}, hunt, {"effects.slider_load": 30.0}],
        },
        "crank-rocker": {
            "scene": rocker,
            "unknowns": ["mechanism.joints.o2.clearance=30um:300um", "mechanism.joints.o3.clearance=30um:300um"],
            "two": {},
            "lacks": [drag, latched, {"effects.gravity": 0.0}],
        },
        "press": {
            "scene": press,
            "unknowns": ["mechanism.joints.o3.clearance=30um:200um", "mechanism.joints.o5.clearance=30um:200um"],
            "two": {},
            "lacks": [drag, latched, {"mechanism.joints.guide.friction.coefficient": 0.2}],
        },
    }  # fmt: skip


def group_of(seed: int, k: int) -> tuple[str, int, str, float]:
    """Mechanism, number of unknowns, signal and noise of machine k."""
    rng = np.random.default_rng([seed, k, 0])
    count = 1 + (k // 3) % 2
    signal = SIGNALS[0] if count == 2 else SIGNALS[int(rng.random() < 0.33)]
    return MECHANISMS[k % 3], count, signal, NOISE[(k // 6) % 3]


def model_of(name: str, count: int) -> tuple[Any, Inputs]:
    kind = mechanisms()[name]
    scene = kind["scene"]
    if count == 2:
        scene = scene.with_(kind["two"])
    return scene, Inputs.of(scene, kind["unknowns"][:count])


def ensemble_of(folder: Path, name: str, count: int, members: int) -> Ensemble:
    """The training ensemble of a mechanism, simulated once."""
    scene, inputs = model_of(name, count)
    plain = prepared_scene(scene)
    place = folder / f"ensemble-{name}-{count}-{members}.npz"
    if not place.exists():
        made = training.ensemble_of(plain, inputs, SIGNALS, members, 1, alone())
        with tempfile.NamedTemporaryFile(dir=folder, suffix=".npz", delete=False) as file:
            np.savez(file, places=made.places, spectra=made.spectra, failed=made.failed)
        Path(file.name).rename(place)
        print(f"{place.name}: {len(made.places)} members", flush=True)
    found = np.load(place)
    revolutions = plain.numerics.averaged_revolutions
    return Ensemble(inputs, found["places"], SIGNALS, found["spectra"], revolutions, int(found["failed"]))  # fmt: skip


class Machine(NamedTuple):
    """A machine: its scene, with the effect that the model lacks, its clearances, and its measurement."""

    scene: Any
    truth: list[float]
    lacks: list[str]
    revolutions: int


def machine(seed: int, k: int) -> Machine:
    """Return machine k."""
    name, count, _, _ = group_of(seed, k)
    scene, inputs = model_of(name, count)
    rng = np.random.default_rng([seed, k, 1])
    place = rng.random((1, inputs.size))
    effects = mechanisms()[name]["lacks"]
    effect = effects[rng.integers(len(effects))] if (k + k // 18) % 3 == 0 else {}
    revolutions = int(rng.integers(15, 41))
    real = prepared_scene(scene).with_(inputs.variants(place)[0])
    real = real.with_({**effect, "numerics.rtol": scene.numerics.rtol * 1e-2})
    truth = [float(f"{v:.6g}") for v in inputs.values(place)[0, :count]]
    return Machine(real, truth, list(effect), revolutions)


def tables_of(folder: Path, seed: int, numbers: list[int]) -> list[Path]:
    """Measured tables of machines of one group, simulated eight at a time where they are not there yet."""
    tables = [folder / f"machine-{seed}-{k:04d}.csv" for k in numbers]
    missing = [i for i, table in enumerate(tables) if not table.exists()]
    for begin in range(0, len(missing), 8):
        own = missing[begin : begin + 8]
        made = [machine(seed, numbers[i]) for i in own]
        most = {"numerics.averaged_revolutions": max(one.revolutions for one in made) + 1}
        for j, response in simulate_together(
            [one.scene.with_(most) for one in made], [0] * len(made)
        ):
            _, _, signal, noise = group_of(seed, numbers[own[j]])
            write_made(
                made[j].scene, tables[own[j]], [signal], noise=noise, revolutions=made[j].revolutions,
                seed=seed + numbers[own[j]], response=response,
            )  # fmt: skip
    return tables


def run_group(folder: Path, seed: int, numbers: list[int], members: int) -> None:
    """Identify the machines of one group."""
    name, count, signal, _ = group_of(seed, numbers[0])
    places = [folder / f"row-{seed}-{k:04d}-{members}.json" for k in numbers]
    if all(place.exists() for place in places):
        return
    ensemble = ensemble_of(folder, name, count, members)
    plain = prepared_scene(model_of(name, count)[0])
    response = short_response(plain)
    frequency, unit = frequency_in(response), str(response[signal].attrs["units"])
    for k, table, place in zip(numbers, tables_of(folder, seed, numbers), places, strict=True):
        if not place.exists():
            read = read_measured(table, signal, unit, frequency)
            place.write_text(json.dumps(row_of(seed, k, ensemble, read)))
    print(f"{name}, {count}: {time.process_time():.0f} s of processor time so far", flush=True)


def row_of(seed: int, k: int, ensemble: Ensemble, read: Measured) -> dict[str, Any]:
    """Identify machine k from its signal."""
    layout = Layout.of(read, Sensor())
    values, variance = features_of([read], [layout])
    prepared = prepare(ensemble, [layout], Sensor(), read.frequency, variance, 1)
    verdict, one = judged(prepared, values, 1), machine(seed, k)
    return {
        "machine": k, "group": group_of(seed, k), "truth": one.truth,
        "revolutions": one.revolutions, "lacks": one.lacks,
        "interval": [[float(f"{v:.5g}") for v in ends] for ends in verdict.interval.T.tolist()],
        "explained": verdict.explained, "doubt": round(verdict.doubt, 3),
        "worst": prepared.labels[verdict.worst],
        "widening": [round(v, 3) for v in prepared.calibration.widening.tolist()],
    }  # fmt: skip


def short_response(scene: Any) -> Any:
    return simulate(scene.with_(SHORTEST), checked=False)


def frequency_in(response: Any) -> float:
    return 1.0 / float(response["time"][-1])


def held(row: dict[str, Any]) -> list[bool]:
    return [low <= t <= high for (low, _, high), t in zip(row["interval"], row["truth"], strict=True)]  # fmt: skip


def counted(rows: list[dict[str, Any]]) -> list[str]:
    """Cells of a table: machines of right models and intervals that hold, other machines, refused, and neither."""
    right, other = ([row for row in rows if bool(row["lacks"]) is lacks] for lacks in (False, True))
    hits = [hit for row in right for hit in held(row)]
    refused = [row for row in other if not row["explained"]]
    lost = [row for row in other if row["explained"] and not all(held(row))]
    wrongly = sum(not row["explained"] for row in right)
    return [
        f"{len(right)}", f"{sum(hits)} of {len(hits)}", f"{wrongly}", f"{len(other)}", f"{len(refused)}",
        f"{len(other) - len(refused) - len(lost)}", f"{len(lost)}",
    ]  # fmt: skip


def error(rows: list[dict[str, Any]]) -> list[str]:
    """Cells of a table: machines of right models, median error and median half-width over the clearance."""
    right = [row for row in rows if not row["lacks"]]
    ends = [(*i, t) for row in right for i, t in zip(row["interval"], row["truth"], strict=True)]
    off = np.median([abs(middle - t) / t for _, middle, _, t in ends])
    width = np.median([(high - low) / 2 / t for low, _, high, t in ends])
    return [f"{len(right)}", f"{off:.1%}", f"{width:.0%}"]


def tables(rows: list[dict[str, Any]]) -> None:
    """Record the tables of the page on `identify`."""
    found = [
        ["unknowns", "mechanism", "machines, right model", "intervals hold", "machines refused",
         "machines, model lacks an effect", "refused", "hold", "neither refused nor hold"]
    ]  # fmt: skip
    for count in (1, 2):
        for name in MECHANISMS:
            own = [row for row in rows if row["group"][:2] == [name, count]]
            found.append([f"{count}", name, *counted(own)])
    record("identify_intervals", [*found, ["all", "", *counted(rows)]])
    found = [["signal", "unknowns", "noise", "machines", "median error", "median half-width"]]
    for signal, count in ((SIGNALS[0], 1), (SIGNALS[0], 2), (SIGNALS[1], 1)):
        for noise in NOISE:
            own = [row for row in rows if row["group"][1:] == [count, signal, noise]]
            words = signal.replace("crank_moment", "torque").replace("_x", "").replace("_", " ")
            found.append([words, f"{count}", f"{noise:.0%}", *error(own)])
    torque = [row for row in rows if row["group"][2:] == [SIGNALS[0], 0.1]]
    record("identify_errors", [*found, ["torque", "1 and 2", "10%", *error(torque)]])


def advised(folder: Path, members: int) -> None:
    """Record the half-widths to expect of two unknowns from 20 revolutions with 10 % noise, by signal."""
    rows = [("mechanism", "signal", "first clearance", "second clearance", "correlation of errors")]
    for name in MECHANISMS:
        ensemble = ensemble_of(folder, name, 2, members)
        frequency = frequency_in(short_response(prepared_scene(model_of(name, 2)[0])))
        found = advice(ensemble, SIGNALS, Sensor(), frequency, 0.1, 1)
        for k, signal in enumerate(found.names):
            first, second = (f"± {1e6 * width:.0f} µm" for width in found.half_width[k, 1])
            rows.append((name, SHORT[signal], first, second, f"{found.correlation[k, 1]:.2f}"))
    record("identify_advice", rows)


def raw(folder: Path, members: int) -> None:
    """Least squares on the raw signal, and features, of a chaotic machine of 42 um with more friction and a heavier piston."""
    scene, _ = model_of("chaotic", 1)
    plain = prepared_scene(scene)
    grid = np.arange(20e-6, 80e-6, 2.5e-6)
    place = folder / "raw.npz"
    if not place.exists():
        curves = []
        for clearance in grid:
            changed = plain.with_({"joints.crank_rod.clearance": float(clearance)})
            response = simulate(changed, checked=False)
            names = ("slider_acceleration", "crank_moment")
            curves.append({name: response[name].to_numpy()[-5 * 1024 :] for name in names})
        np.savez(place, **{n: np.array([c[n] for c in curves]) for n in curves[0]})
    stored = np.load(place)
    change = {"joints.crank_rod.clearance": 42e-6, "numerics.rtol": 1e-8}
    change |= {"mechanism.slider.mass": 0.14 * 1.005, "effects.friction.coefficient": 0.01 * 1.3}
    real = plain.with_(change)
    response = simulate(real, checked=False)
    ensemble = ensemble_of(folder, "chaotic", 1, members)
    frequency = frequency_in(short_response(plain))
    for noise in NOISE:
        for name in ("slider_acceleration", "crank_moment"):
            own = response[name].to_numpy()[-5 * 1024 :]
            sigma = noise * own.std()
            noisy = [
                own + sigma * np.random.default_rng(seed).standard_normal(len(own))
                for seed in range(20)
            ]
            errors = [((stored[name] - one) ** 2).sum(axis=1) for one in noisy]
            best = np.array([grid[np.argmin(e)] for e in errors]) * 1e6
            print(f"raw {name}, noise {noise:.0%}: {best.mean():.1f} +- {best.std():.1f} um")
        signal = "crank_moment"
        table = folder / f"raw-{noise}.csv"
        if not table.exists():
            write_made(real, table, [signal], noise=noise, revolutions=5, seed=7)
        read = read_measured(table, signal, "N m", frequency)
        layout = Layout.of(read, Sensor())
        values, variance = features_of([read], [layout])
        verdict = judged(
            prepare(ensemble, [layout], Sensor(), frequency, variance, 1, 64), values, 1
        )
        low, middle, high = 1e6 * verdict.interval[:, 0]
        print(
            f"identify {signal}, 5 revolutions, noise {noise:.0%}: {middle:.1f} um, 95 % interval {low:.1f} to "
            f"{high:.1f}, explained {verdict.explained}"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)  # fmt: skip
    parser.add_argument("folder", type=Path, nargs="?", default=Path("results/machines"))
    parser.add_argument("--machines", type=int, default=200)
    parser.add_argument("--members", type=int, default=256)
    parser.add_argument("--seed", type=int, default=2)
    parser.add_argument("--rows", type=Path, help="file of all rows")
    parser.add_argument("--table", type=Path, help="record the tables of such a file")
    parser.add_argument("--advise", action="store_true", help="half-widths to expect, by signal")
    parser.add_argument("--raw", action="store_true")
    words = parser.parse_args()
    if words.table:
        tables(json.loads(words.table.read_text()))
        return
    words.folder.mkdir(exist_ok=True, parents=True)
    if words.raw or words.advise:
        (raw if words.raw else advised)(words.folder, words.members)
        return
    groups: dict[tuple[str, int, str, float], list[int]] = {}
    for k in range(words.machines):
        groups.setdefault(group_of(words.seed, k), []).append(k)
    for _, numbers in sorted(groups.items()):
        run_group(words.folder, words.seed, numbers, words.members)
    files = (
        words.folder / f"row-{words.seed}-{k:04d}-{words.members}.json"
        for k in range(words.machines)
    )
    rows = [json.loads(one.read_text()) for one in files]
    if words.rows:
        words.rows.write_text("[\n" + ",\n".join(json.dumps(row) for row in rows) + "\n]\n")
    tables(rows)
    for row in rows:
        if (not row["lacks"] and not all(held(row))) or (row["explained"] and not all(held(row))):
            print("missed:", row)


if __name__ == "__main__":
    main()

"""Made machines identified from made signals: do 95 % intervals hold, and is what the model lacks noticed?

    nice -n 15 python analysis/identify_machines.py OUT [--machines 200] [--members 256]
    python analysis/identify_machines.py OUT --summary
    python analysis/identify_machines.py OUT --raw

Three mechanisms, one and two unknown clearances, random masses, friction and restitution, noise of 2, 10 and 30 %. All signals
are made at another integration tolerance than the ensemble's; in a third of the machines there is an effect that the model
lacks. Machine k follows from its number alone. Ensembles and groups of machines are kept in OUT as they finish: the same
command goes on. `--raw` fits the raw signal by least squares for comparison.
"""

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from hpcclear import load_scene, simulate
from hpcclear.identify.features import Layout
from hpcclear.identify.inputs import Inputs
from hpcclear.identify.judgement import features_of, judged, prepare
from hpcclear.identify.made import write_made
from hpcclear.identify.measured import read_measured
from hpcclear.identify.signals import Sensor
from hpcclear.identify.training import Ensemble, prepared_scene, simulated, units_of
from hpcclear.ranks.boundary import alone

JOBS = Path(__file__).resolve().parent.parent / "jobs"
NOISE = (0.02, 0.1, 0.3)
SIGNALS = ("crank_moment", "frame_force_x")
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


def group_of(k: int) -> tuple[str, int, str, float]:
    """Mechanism, number of unknowns, signal and noise of machine k."""
    rng = np.random.default_rng([k, 0])
    name = ("slider-crank", "crank-rocker", "press")[k % 3]
    count = 1 + (k // 3) % 2
    signal = SIGNALS[0] if count == 2 else SIGNALS[int(rng.random() < 0.33)]
    return name, count, signal, NOISE[(k // 6) % 3]


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
        made = simulated(plain, inputs, SIGNALS, members, 1, alone())
        with tempfile.NamedTemporaryFile(dir=folder, suffix=".npz", delete=False) as file:
            np.savez(file, places=made.places, spectra=made.spectra, failed=made.failed)
        Path(file.name).rename(place)
        print(f"{place.name}: {len(made.places)} members", flush=True)
    found = np.load(place)
    revolutions = plain.numerics.averaged_revolutions
    return Ensemble(inputs, found["places"], SIGNALS, found["spectra"], revolutions, int(found["failed"]))  # fmt: skip


def machine(folder: Path, k: int) -> tuple[dict[str, Any], Path]:
    """What machine k is, and its measured table, made on the way."""
    name, count, signal, noise = group_of(k)
    scene, inputs = model_of(name, count)
    rng = np.random.default_rng([k, 1])
    place = rng.random((1, inputs.size))
    lacks = mechanisms()[name]["lacks"] if k % 9 in (0, 4, 8) else []
    effect = lacks[(k // 9) % len(lacks)] if lacks else {}
    table = folder / f"machine-{k:04d}.csv"
    if not table.exists():
        real = prepared_scene(scene).with_(inputs.variants(place)[0])
        real = real.with_({**effect, "numerics.rtol": scene.numerics.rtol * 1e-2})
        revolutions = int(rng.integers(15, 41))
        write_made(real, table, [signal], noise=noise, revolutions=revolutions, seed=k)
    truth = inputs.values(place)[0, :count].tolist()
    facts = {"machine": k, "group": [name, count, signal, noise], "truth": truth}
    return facts | {"lacks": list(effect)}, table


def run_group(folder: Path, numbers: list[int], members: int) -> None:
    """Identify the machines of one group, by one preparation at the largest noise of theirs."""
    name, count, signal, _ = group_of(numbers[0])
    place = folder / f"group-{numbers[0]:04d}-{len(numbers)}-{members}.json"
    if place.exists():
        return
    ensemble = ensemble_of(folder, name, count, members)
    plain = prepared_scene(model_of(name, count)[0])
    unit = units_of(plain, [signal])[0]
    frequency = float(frequency_of(plain))
    made = [machine(folder, k) for k in numbers]
    read = [read_measured(table, signal, unit, frequency) for _, table in made]
    layout = Layout.of(min(read, key=lambda one: one.highest), Sensor())
    pairs = [features_of([one], [layout]) for one in read]
    variance = np.max([own for _, own in pairs], axis=0)
    prepared = prepare(ensemble, [layout], Sensor(), frequency, variance, 1, 64)
    rows = []
    for (facts, _), (values, _) in zip(made, pairs, strict=True):
        verdict = judged(prepared, values, 1)
        rows.append(
            facts | {
                "interval": verdict.interval.T.tolist(), "explained": verdict.explained,
                "doubt": verdict.doubt.tolist(), "worst": prepared.labels[verdict.worst],
                "widening": prepared.calibration.widening.tolist(),
            }
        )  # fmt: skip
    place.write_text(json.dumps(rows))
    print(f"{place.name}: {name}, {count} unknown, {signal}", flush=True)


def frequency_of(scene: Any) -> float:
    short = {"numerics.transient_revolutions": 0, "numerics.averaged_revolutions": 1}
    response = simulate(scene.with_(short), checked=False)
    return 1.0 / float(response["time"][-1])


def rows_of(folder: Path) -> list[dict[str, Any]]:
    found = [row for path in sorted(folder.glob("group-*.json")) for row in json.loads(path.read_text())]  # fmt: skip
    return sorted(found, key=lambda row: row["machine"])


def held(row: dict[str, Any]) -> list[bool]:
    return [low <= t <= high for (low, _, high), t in zip(row["interval"], row["truth"], strict=True)]  # fmt: skip


def share(hits: list[bool]) -> str:
    return f"{sum(hits)} of {len(hits)} ({sum(hits) / max(len(hits), 1):.1%})"


def summary(folder: Path) -> None:
    """Print the figures of all machines that are finished."""
    rows = rows_of(folder)
    right = [row for row in rows if not row["lacks"]]
    other = [row for row in rows if row["lacks"]]
    print(f"machines: {len(rows)}, of these {len(other)} with an effect that the model lacks")
    print(f"right model: intervals hold {share([h for r in right for h in held(r)])}")
    print(f"right model: refused {share([not r['explained'] for r in right])}")
    fine = [not r["explained"] or all(held(r)) for r in other]
    print(f"other machines: hold or are refused {share(fine)}")
    print(f"other machines: refused {share([not r['explained'] for r in other])}")
    for name in sorted({r["group"][0] for r in rows}):
        own = [r for r in right if r["group"][0] == name]
        lost = [not r["explained"] or all(held(r)) for r in other if r["group"][0] == name]
        print(f"  {name}: hold {share([h for r in own for h in held(r)])}; others {share(lost)}")
    for group in sorted({tuple(r["group"][1:]) for r in right}):
        own = [r for r in right if tuple(r["group"][1:]) == group]
        ends = [(*i, t) for r in own for i, t in zip(r["interval"], r["truth"], strict=True)]
        error = np.median([abs(middle - t) / t for _, middle, _, t in ends])
        width = np.median([(high - low) / 2 / t for low, _, high, t in ends])
        print(
            f"  {group[0]} unknown, {group[1]}, noise {group[2]:.0%}: {len(own)} machines, median error {error:.1%}, "
            f"median half-width {width:.1%}"
        )
    for row in other:
        if row["explained"] and not all(held(row)):
            print("  lost:", row)


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
    frequency = frequency_of(plain)
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
    parser.add_argument("folder", type=Path)
    parser.add_argument("--machines", type=int, default=200)
    parser.add_argument("--members", type=int, default=256)
    parser.add_argument("--summary", action="store_true")
    parser.add_argument("--raw", action="store_true")
    words = parser.parse_args()
    words.folder.mkdir(exist_ok=True)
    if words.raw:
        raw(words.folder, words.members)
    elif not words.summary:
        groups: dict[tuple[str, int, str, float], list[int]] = {}
        for k in range(words.machines):
            groups.setdefault(group_of(k), []).append(k)
        for _, numbers in sorted(groups.items(), key=lambda one: (one[0][1], one[0][0])):
            run_group(words.folder, numbers, words.members)
    if not words.raw:
        summary(words.folder)


if __name__ == "__main__":
    main()

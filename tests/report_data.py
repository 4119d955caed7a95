"""Small result files with known content, for the tests of figures and of the report."""

from pathlib import Path
from typing import Any

import numpy as np
import opened
import xarray as xr

from hpcclear.base.outcome import JOINTS, OUTCOME, Flag, Status
from hpcclear.base.verdict import Verdict
from hpcclear.results import dataset
from hpcclear.results.provenance import program
from hpcclear.statistics.surrogate.fitting import fit_kriging

NAMES = ("m2", "m3", "u2", "I2", "C")
LOWER = np.array([0.105, 0.07, 0.0, 1.3e-4, 0.3e-3])
UPPER = np.array([0.42, 0.28, 0.12, 2.0e-3, 1.0e-3])
SCENE = """# <script>window.hostile = 1</script>
name = "</pre><b onclick=alert(1)>&amp;"
[effects]
"<u>contact" = "<img src=y onerror=alert(1)>"
"""
CASES = ("deterministic", "robust")
ATTRIBUTES = {"scene": SCENE, "scene_hash": "0" * 64, **program()}


def objective(points: np.ndarray) -> np.ndarray:
    """A smooth stand-in for f, m; points of shape (n, 5) in the order of `NAMES`."""
    m2, m3, u2, inertia, clearance = ((points - LOWER) / (UPPER - LOWER)).T
    return (2 + 2 * m2 + 1.5 * m3 - 0.5 * u2 + inertia * m3 + clearance * (1 + m2)) * 1e-4


def noisy(points: np.ndarray, seed: int) -> np.ndarray:
    """`objective` with a scatter of 5 µm, as f has it."""
    return objective(points) + 5e-6 * np.random.default_rng(seed).normal(size=len(points))


def design(count: int, seed: int = 0) -> np.ndarray:
    """Points spread over the box."""
    return LOWER + np.random.default_rng(seed).random((count, 5)) * (UPPER - LOWER)


def samples(count: int = 60, failed: int = 3) -> xr.Dataset:
    """A design with failures, latched joints and penetrations beyond Hertz."""
    points = design(count)
    records = np.zeros(count, OUTCOME)
    records["sample"] = np.arange(count)
    records["objective"] = objective(points)
    records["objective_spread"] = 1e-7 + 1e-3 * points[:, 4] ** 1.5
    records["objective_uncertainty"] = np.nan
    records["mean_gap"] = records["objective"][:, None] / np.sqrt(2)
    records["peak_contact_force"] = 5e3
    records["rhs_evaluations"] = 25_000
    records["latched"][: count // 3, 0] = 1
    records["flags"][: count // 3] = Flag.LATCHED
    records["flags"][:5] |= Flag.BEYOND_HERTZ
    for name in ("objective", "objective_spread", "mean_gap", "peak_contact_force"):
        records[name][-failed:] = np.nan
    records["latched"][-failed:] = 0
    records["status"][-failed:] = Status.STEP_CAP
    return dataset.samples_dataset(NAMES, points, {}, records, ATTRIBUTES).to_xarray()


def kriging(points: int = 40) -> xr.Dataset:
    """Three models: two of two variables and the clearance, one of all five."""
    inputs = [("m2", "m3", "C"), ("u2", "I2", "C"), NAMES]
    shape = (len(inputs), points)
    data = {name: np.full(shape, np.nan) for name in ("training_output", "weight", *NAMES)}
    data |= {
        f"{n}_{end}": np.full(len(inputs), np.nan) for n in NAMES for end in ("lower", "upper")
    }
    data["length_scale"] = np.full((len(inputs), len(NAMES)), np.nan)
    data["used"] = np.zeros((len(inputs), len(NAMES)), np.int8)
    numbers = ("signal_variance", "noise_variance", "output_mean", "output_scale")
    data |= {name: np.zeros(len(inputs)) for name in numbers}
    for row, names in enumerate(inputs):
        columns = [NAMES.index(name) for name in names]
        full = np.tile(0.5 * (LOWER + UPPER), (points, 1))
        full[:, columns] = design(points, row)[:, columns]
        bounds = np.column_stack([LOWER, UPPER])[columns]
        values = noisy(full, row)
        model = fit_kriging(full[:, columns], values, bounds, rng=np.random.default_rng(row))
        data["training_output"][row], data["weight"][row] = model.values, model.alpha
        data["signal_variance"][row], data["noise_variance"][row] = (
            model.signal_variance,
            model.noise_variance,
        )
        data["output_mean"][row], data["output_scale"][row] = model.mean, model.scale
        for k, name in enumerate(names):
            data["length_scale"][row, columns[k]] = model.length_scales[k]
            data["used"][row, columns[k]] = 1
            data[name][row] = model.inputs[:, k]
            data[f"{name}_lower"][row], data[f"{name}_upper"][row] = bounds[k]
    words = np.array([" ".join(names) for names in inputs])
    data |= {"points": np.full(len(inputs), points), "dropped": np.zeros(len(inputs), int)}
    data["accepted"] = np.ones(len(inputs), np.int8)
    data |= {"family": words, "r2": np.full(len(inputs), 0.997), "rmae": np.full(len(inputs), 0.2)}
    coords = {"model": words, "point": np.arange(points), "parameter": np.array(NAMES)}
    return dataset.dataset("kriging", coords, data, ATTRIBUTES).to_xarray()


def sensitivity() -> xr.Dataset:
    """Two surfaces, three intervals, four clearances, one derivative that is not determined."""
    surfaces = np.array(["m2 m3", "u2 I2"])
    parameters = np.array(["m2", "m3", "u2", "I2"])
    clearance = np.linspace(0.3e-3, 1e-3, 4)
    interval = np.array([1.0, 0.7, 0.49])
    shape = (2, 3, 4, 4)
    slope = np.full(shape, np.nan)
    slope[0, ..., :2] = (0.5 + clearance[:, None] * 500) * np.array([2e-4, 1.5e-4])
    slope[1, ..., 2:] = (0.5 + clearance[:, None] * 500) * np.array([-0.5e-4, 1e-4])
    error = np.where(np.isnan(slope), np.nan, 1e-5)
    converged = np.isfinite(slope[:, 0]).astype(np.int8)
    converged[1, 2:, 2] = 0
    best = np.where(converged, slope[:, 1], np.nan)
    fit = np.broadcast_to(1.0 - 0.1 * interval[:, None], shape[:3])
    data = {
        "sensitivity": slope,
        "standard_error": error,
        "converged": converged,
        "best_sensitivity": best,
        "uncertainty": np.where(converged, 1.2e-5, np.nan),
        "r2": fit,
        "rmae": 1.0 - fit,
        "sobol_first": np.array([0.5, 0.25, 0.05, 0.1]),
        "sobol_first_error": np.full(4, 0.01),
        "sobol_total": np.array([0.55, 0.3, 0.06, 0.12]),
        "sobol_total_error": np.full(4, 0.01),
        "influence": np.array([2e-4, 1.5e-4, 0.5e-4, 1e-4]),
        "selected": np.array([1, 1, 0, 1], np.int8),
    }
    coords = {
        "surface": surfaces,
        "interval": interval,
        "clearance": clearance,
        "parameter": parameters,
    }
    return dataset.dataset("sensitivity", coords, data, ATTRIBUTES).to_xarray()


def front(runs: int = 2, solutions: int = 12) -> xr.Dataset:
    """Two cases; the last solution of the second run does not exist."""
    along = np.linspace(0.0, 1.0, solutions)
    shape = (len(CASES), runs, solutions)
    mean = np.broadcast_to(2.4e-4 + 1.2e-4 * along, shape) + 1e-6 * np.arange(runs)[:, None]
    deviation = (
        np.broadcast_to(5e-5 - 2e-5 * np.sqrt(along), shape) * np.array([1.0, 1.1])[:, None, None]
    )
    data = {"mean": mean.copy(), "deviation": deviation.copy()}
    for k, name in enumerate(NAMES[:4]):
        data[name] = np.broadcast_to(LOWER[k] + along * 0.8 * (UPPER[k] - LOWER[k]), shape).copy()
    for values in data.values():
        values[:, 1:, -1] = np.nan
    data["verified"] = np.zeros(shape, np.int8)
    data["verified"][:, 0, ::3] = 1
    coords = {"case": np.array(CASES), "run": np.arange(runs), "solution": np.arange(solutions)}
    return dataset.dataset("front", coords, data, ATTRIBUTES).to_xarray()


def simulated(names: list[str], samples: int) -> tuple[dict[str, Any], dict[str, Any]]:
    """Coordinates of verified designs, and what each has besides its moments: none failed, no two are equivalent."""
    none = np.zeros(len(names), int)
    data = {"simulations": 18372, "samples": none + samples, "failed": none, "beyond_hertz": none}
    data["equivalence"] = np.zeros((len(names), len(names)), np.int8)
    return dict.fromkeys(("design", "rival"), np.array(names)), data


def verification() -> xr.Dataset:
    """The original, alpha, beta, two designs of the front and the paper's for each case."""
    fronts = front()
    rows = []
    for case in CASES:
        one = fronts.sel(case=case, run=0)
        places = {"alpha": 0, "front 1": 3, "front 2": 6, "best beta": 9, "beta": 9, "original": 5}
        rows += [
            (f"{case} {name}", case, one.isel(solution=k), np.nan) for name, k in places.items()
        ]
        rows += [(f"{case} paper alpha", case, one.isel(solution=2), 1.8e-4)]
    data: dict[str, np.ndarray] = {"case": np.array([row[1] for row in rows])}
    for name, factor in (("mean", 1.01), ("deviation", 0.97)):
        guess = np.array([float(row[2][name]) for row in rows])
        data |= {f"{name}_surrogate": guess, f"{name}_true": guess * factor}
        data |= {f"{name}_lower": guess * factor * 0.99, f"{name}_upper": guess * factor * 1.01}
        data[f"{name}_error"] = np.full(len(rows), 1 / factor - 1)
        data[f"{name}_paper"] = np.array([row[3] for row in rows]) * (
            1.0 if name == "mean" else 2e-4
        )
    data |= {name: np.array([float(row[2][name]) for row in rows]) for name in NAMES[:4]}
    coords, more = simulated([row[0] for row in rows], 10_000)
    data |= more | {"random": np.array([f"C {row[1]}" for row in rows])}
    return dataset.dataset("verification", coords, data, ATTRIBUTES).to_xarray()


def claims() -> xr.Dataset:
    """One claim of each verdict, one with hostile text."""
    data = {
        "text": np.array(["f grows with C", "f <b>hardly</b> moves with m1", "the order stays"]),
        "verdict": np.array([0, 1, 2], np.int8),
        "figure": np.array(
            ["slope 0.3 ± 0.01", "<img src=x onerror=alert(1)>", "2 of 8 clearances"]
        ),
    }
    return dataset.dataset("claims", {"claim": np.arange(1, 4)}, data, ATTRIBUTES).to_xarray()


def accuracy() -> xr.Dataset:
    """What accuracy costs: errors that fall as powers of the work, with a floor."""
    draws, spent = 10 ** np.arange(2, 6), 10 * 2 ** np.arange(7)
    training = np.array([50, 100, 200])
    data = _spent(spent) | _integration() | _surrogates(training) | _moments(draws)
    data |= {
        "strong_seconds": np.array([10.0, 5.2]),
        "weak_seconds": np.array([10.0, 10.4]),
        "lost_seconds": np.array([0.5, 2.0, 0.3, 0.1]),
    }
    coords = {
        "tolerance": 10.0 ** -np.arange(3, 7),
        "spent": spent,
        "aim": np.array([0.1, 0.01, 0.001]),
        "integrator": np.array(
            [
                "Dormand-Prince 5(4), minimal",
                "adaptive order 4, Baumgarte",
                "fixed steps, order 4",
                "Radau IIA",
            ]
        ),
        "rung": np.arange(5),
        "quantity": np.array(
            ["slider_position", "slider_velocity", "peak_contact_force", "objective"]
        ),
        "transient": np.array([0, 2, 8]),
        "averaged": np.array([1, 4, 16, 64]),
        "surrogate": np.array(["response surface", "kriging"]),
        "training": training,
        "estimate": np.array(["surrogate", "simulation"]),
        "moment": np.array(["mean", "deviation"]),
        "draws": draws,
        "ranks": np.array([1, 2]),
        "loss": np.array(["start-up", "compilation", "imbalance", "writing"]),
    }
    words = {
        "designs": "16 designs over the box",
        "repeats": "median of 5 repeats",
        "motion": "3.36 +- 0.03 um (chaotic)",
        "copies": "16 copies",
        "study": "m2, m3, u2, I2, C",
        "batch": "512 samples",
    }
    return dataset.dataset("accuracy", coords, data, ATTRIBUTES | words).to_xarray()


def _spent(spent: np.ndarray) -> dict[str, object]:
    """Error of a mean against the revolutions spent on it, by tolerance."""
    price = 1e-4 * np.array([1.0, 1.2, 1.5, 2.0])
    bias = np.array([-0.2, 1e-3, np.nan, np.nan])
    model = np.hypot(np.nan_to_num(bias)[:, None], 0.3 / np.sqrt(spent))
    return {
        "spent_error": 1.1 * model,
        "spent_model": model,
        "spent_seconds": price[:, None] * (spent + 640),
        "tolerance_bias": bias,
        "tolerance_bias_error": np.array([1e-3, 1e-3, np.nan, np.nan]),
        "turn_variance": np.full(4, 0.09),
        "tolerance_seconds": price,
        "spin_up": 20.0,
        "cheapest_tolerance": np.array([1e-4, 1e-4, np.nan]),
        "cheapest_revolutions": np.array([9.0, 910.0, np.nan]),
        "cheapest_seconds": np.array([0.08, 0.2, np.nan]),
    }


def _integration() -> dict[str, object]:
    """Errors of methods against their work, and of averages over revolutions."""
    setting = np.tile(10.0 ** -(3.0 + np.arange(5)), (4, 1))
    evaluations = 600 * setting**-0.2 * np.arange(1, 5)[:, None]
    return {
        "setting": setting,
        "error": setting[..., None] * np.array([1e-2, 0.1, 1.0, 0.3]) + 1e-9,
        "seconds": 1e-7 * evaluations,
        "evaluations": evaluations,
        "order": np.full((4, 4), 5.0),
        "reference_error": np.full(4, 1e-10),
        "averaging_error": np.outer([0.3, 0.02, 0.001], 1 / np.sqrt([1, 4, 16, 64])) + 1e-3,
        "averaging_floor": 1e-3,
        "turn_seconds": 2e-4,
    }


def _surrogates(training: np.ndarray) -> dict[str, object]:
    """Errors of two surrogates against their training points."""
    return {
        "r2": 1 - np.outer([1.0, 0.3], 10.0 / training),
        "rmae": np.outer([1.0, 0.3], 30.0 / training),
        "leave_one_out": np.outer([1.0, 0.3], 20.0 / training),
        "fit_seconds": np.full((2, 3), 0.5),
        "sample_seconds": 1e-3,
    }


def _moments(draws: np.ndarray) -> dict[str, object]:
    """Errors of mean and deviation against draws, on the surrogate and by simulation."""
    moments = np.stack([1.0 / np.sqrt(draws), 0.7 / np.sqrt(draws)])
    moment = np.stack([moments, np.where(draws > 10**4, np.nan, moments)])
    return {
        "moment_error": moment,
        "moment_lower": 0.9 * moment,
        "moment_upper": 1.1 * moment,
        "moment_seconds": np.outer([1e-7, 1e-3], draws),
        "moment_bias": np.array([2e-3, -1e-2]),
        "bias_error": np.array([1e-4, 1e-3]),
        "quadrature_seconds": 1e-5,
        "closed_form": np.array([1e-9, 1e-8]),
    }


def timing(ranks: int = 2) -> xr.Dataset:
    """Two ranks, two stages."""
    busy = np.array([[10.0, 5.0], [9.5, 0.0]])[:ranks]
    data = {"busy": busy, "idle": 0.1 * busy + 0.2, "compile": 0.2 * busy, "write": 0.01 * busy}
    command = "mpiexec -n 2 hpcclear run jobs/<i>x</i>.toml -o results/x"
    coords = {"rank": np.arange(ranks), "stage": ["samples", "kriging"]}
    return dataset.dataset("timing", coords, {**data, "command": command}, ATTRIBUTES).to_xarray()


def response(revolutions: int = 4, clearance: float = 3e-4, instants: int = 200) -> xr.Dataset:
    """A made-up motion: journals that orbit at 1.2 clearances, and lift off for a tenth of each turn."""
    turn = np.linspace(0.0, revolutions, revolutions * instants + 1)
    angle = 2.0 * np.pi * turn
    speed = 2.0 * np.pi * 5000 / 60
    reach = clearance * np.where(np.mod(turn, 1.0) < 0.1, 0.5, 1.2)
    depth = np.maximum(reach - clearance, 0.0)
    two = np.ones(2)
    position = 0.12 + 0.05 * np.cos(angle)
    data = {
        "crank_angle": angle,
        "slider_position": position,
        "slider_velocity": -0.05 * speed * np.sin(angle),
        "slider_acceleration": -0.05 * speed**2 * np.cos(angle),
        "rod_x": 0.05 * np.cos(angle) + 0.06,
        "rod_y": 0.025 * np.sin(angle),
        "rod_angle": np.arcsin(-0.05 / 0.12 * np.sin(angle)),
        "eccentricity_x": np.outer(reach * np.cos(angle), two),
        "eccentricity_y": np.outer(reach * np.sin(angle), two),
        "penetration": np.outer(depth, two),
        "contact_force": np.outer(3e7 * depth, [1.0, 0.7]),
        "friction_force": np.outer(3e5 * depth, two),
        "crank_moment": 100.0 * np.sin(2.0 * angle),
        "kinetic_energy": 100.0 + 50.0 * np.cos(2.0 * angle),
        "elastic_energy": 1e4 * depth,
        "potential_energy": 0.0 * angle,
        "driving_work": 8.0 * turn + 50.0 * np.cos(2.0 * angle) - 50.0,
        "load_work": 0.0 * angle,
        "dissipated_energy": 8.0 * turn,
        "energy_residual": 1e-6 * turn,
        "objective": clearance * 0.23 * np.sqrt(2.0),
        "objective_spread": 0.0,
        "objective_uncertainty": np.nan,
        "mean_gap": clearance * 0.23 * two,
        "peak_contact_force": np.array([1800.0, 1260.0]),
        "latched": np.zeros(2, np.int8),
        "rhs_evaluations": 25_000,
        "status": 0,
        "flags": 0,
    }
    coords = {"time": angle / speed, "joint": JOINTS}
    return dataset.dataset("response", coords, data, ATTRIBUTES).to_xarray()


def write_study(directory: Path) -> Path:
    """A whole results directory."""
    makers = (samples, kriging, sensitivity, front, verification, claims, timing)
    for maker in makers:
        opened.write(maker(), directory / f"{maker.__name__}.nc")
    (directory / "responses").mkdir()
    for k, name in enumerate(("original", *(f"{c} {s}" for c in CASES for s in ("alpha", "beta")))):
        content = response(2, clearance=3e-4 * (1.0 - 0.1 * k), instants=120)
        content.attrs["design"] = name
        opened.write(content, directory / "responses" / f"{name.replace(' ', '_')}.nc")
    return directory


def constrained(verdicts: list[Verdict], prices: list[float] | None = None) -> dict[str, Any]:
    """Columns of one constraint of each design, by the verdicts on it, with its coordinate ``constraint``."""
    values = {Verdict.HOLDS: 0.01, Verdict.FAILS: 0.09, Verdict.UNDECIDED: 0.05}
    shape = (len(verdicts), 1)
    found = np.array([values[one] for one in verdicts]).reshape(shape)
    return {
        "constraint_goal": np.full(shape, "probability of f above 1 N"),
        "constraint_unit": np.full(shape, ""),
        "constraint_true": found, "constraint_lower": found, "constraint_upper": found,
        "constraint_most": np.full(shape, 0.05),
        "constraint_verdict": np.array(verdicts, np.int8).reshape(shape),
        "constraint_price": np.reshape(np.full(shape, np.nan) if prices is None else prices, shape),
    }  # fmt: skip

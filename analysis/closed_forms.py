"""Random studies whose f is a formula: carried out by a study's own machinery in seconds, and judged exactly.

Masses, a mass centre and two clearances are varied, some of them random. f is a random quadratic in them with a wave, at choice
rough (waves too short for any model), with a second mode of failure, or scattered by chaos: by a number that changes when an
input changes by 1e-12.
"""

import sys
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import ndtr, ndtri
from scipy.stats import qmc

from hpcclear.results.checkpoint import Checkpoint
from hpcclear.scene import Scene, load_scene
from hpcclear.scene.sampling import offsets

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "mpi_programs"))

import formula

Columns = dict[str, np.ndarray]

PATHS = {
    "m2": ("mechanism.rod.mass", 0.12, 0.4),
    "m3": ("mechanism.slider.mass", 0.08, 0.28),
    "u2": ("mechanism.rod.mass_center", 0.01, 0.11),
    "C12": ("joints.crank_rod.clearance", 1e-4, 6e-4),
    "C23": ("joints.rod_slider.clearance", 1e-4, 6e-4),
}
"""Paths of the variables, and their ranges."""

DESIGN = "m2", "m3", "u2"
SCALE = 1e-3

ROUGH = {"rough": (0.02, 0.08), "very rough": (0.4, 0.8), "wild": (0.05, 0.15)}
CHAOS = {"chaotic": (0.02, 0.08), "wild": (0.15, 0.4)}
"""Amplitudes of short waves, and standard deviations of what chaos adds, by kinds of forms."""

WIDE = 2.0
"""Standard deviations that a judge draws with: a probability of 1e-4 to 1 or 2 % by 200 000 draws."""


@dataclass(frozen=True)
class Form:
    """f of one study, over variables scaled to their ranges.

    Attributes
    ----------
    slopes : array, shape (5,)
    curves : array, shape (5, 5)
    wave : array, shape (5,)
        Phase per variable of a sine of amplitude 0.1.
    rough, chaos : float
        Amplitude of the short waves, and standard deviation of what chaos adds.
    second : float
        Slope of a second mode of failure, beside which the first counts where it is larger; 0 if there is none.
    """

    slopes: np.ndarray
    curves: np.ndarray
    wave: np.ndarray
    rough: float = 0.0
    chaos: float = 0.0
    second: float = 0.0

    def __call__(self, column: Columns) -> np.ndarray:
        """f, (n,), from values by scene path."""
        rows = [
            (np.asarray(column[path]) - low) / (high - low) for path, low, high in PATHS.values()
        ]
        x = np.column_stack(np.broadcast_arrays(*rows)) - 0.5
        f = (
            3.0
            + x @ self.slopes
            + ((x @ self.curves) * x).sum(axis=1)
            + 0.1 * np.sin(x @ self.wave)
        )
        if self.second:
            other = 3.0 + self.slopes[:3] @ x[:, :3].T + self.second * (x[:, 3] - x[:, 4])
            f = np.maximum(f, other)
        if self.rough:
            f = f + self.rough * np.sin(400.0 * x.sum(axis=1) + 90.0 * x[:, 3])
        if self.chaos:
            f = f + self.chaos * np.sqrt(2.0) * np.sin(
                1e13 * (x @ np.array([1.0, 1.7, 2.3, 3.1, 4.3]))
            )
        return np.asarray(SCALE * f).reshape(np.broadcast_shapes(*(np.shape(row) for row in rows)))


def form_of(rng: np.random.Generator, kind: str) -> Form:
    """A form that rises with masses and clearances: "smooth", "rough", "two modes", "chaotic", "very rough" (of a
    model's R2 below 0.9), or "wild": rough and chaotic, as peak forces of joints are, of which no model explains much."""
    slopes = rng.uniform([0.5, 0.5, -0.4, 0.4, 0.4], [1.2, 1.2, 0.4, 1.2, 1.2])
    curves = np.diag([0.0, 0.0, rng.uniform(0.8, 2.0), 0.0, 0.0]) + 0.15 * rng.standard_normal(
        (5, 5)
    )
    wave = rng.uniform(-4.0, 4.0, 5)
    return Form(
        slopes,
        curves,
        wave,
        rough=rng.uniform(*ROUGH[kind]) if kind in ROUGH else 0.0,
        chaos=rng.uniform(*CHAOS[kind]) if kind in CHAOS else 0.0,
        second=rng.uniform(0.6, 1.2) if kind == "two modes" else 0.0,
    )


def random_inputs(rng: np.random.Generator) -> dict[str, dict[str, Any]]:
    """Laws of clearances, wherever the design is, and of masses about it."""
    rows: dict[str, dict[str, Any]] = {}
    for name in ("C12", "C23"):
        middle, share = rng.uniform(2.2e-4, 3.2e-4), rng.uniform(0.15, 0.25)
        rows[name] = (
            {"distribution": "lognormal", "mean": middle, "deviation": share * middle, "range": [1.05e-4, 5.95e-4]},
            {"distribution": "beta", "shapes": [2.0, 5.0], "range": [1.05e-4, 3.6 * share * middle + 3e-4]},
            {"distribution": "uniform", "range": [middle * (1 - 2 * share), middle * (1 + 2 * share)]},
        )[int(rng.integers(3))]  # fmt: skip
    for name in [n for n in ("m2", "m3") if rng.random() < 0.6]:
        rows[name] = {"distribution": "normal", "deviation": float(rng.uniform(0.002, 0.008))}
    return rows


SETTINGS: dict[str, Any] = {
    "samples": 60,
    "test_samples": 20,
    "sensitivity": {"groups": []},
    "surrogate": {"models": [], "restarts": 0, "cuts": 0},
    "swarm": {"particles": 24, "iterations": 20, "runs": 1, "archive": 12},
}


def scene_of(seed: int, random: dict[str, Any], case: dict[str, Any], **study: Any) -> Scene:
    """A study of these variables with one case."""
    content = tomllib.loads(formula.PHYSICS)
    for joint in content["joints"].values():
        joint["clearance"] = 3e-4
    variables = {
        name: {"path": path, "range": [low, high]} for name, (path, low, high) in PATHS.items()
    }
    rows = {"random": random, "cases": {"made": {"random": list(random), **case}}}
    return load_scene(
        content | {"study": {"seed": seed, "variables": variables, **SETTINGS, **study, **rows}}
    )


@contextmanager
def dynamics(form: Form) -> Iterator[None]:
    """Samples by a form in place of the kernel."""
    replaced: list[tuple[Any, str, Any]] = []

    def put(where: Any, name: str, value: Any) -> None:
        replaced.append((where, name, getattr(where, name)))
        setattr(where, name, value)

    formula.replace_dynamics(put)
    put(formula, "objective", form)
    put(formula, "CHUNK", 20_000)
    put(Checkpoint, "flush_when_due", lambda checkpoint: None)  # seconds are no loss
    try:
        yield
    finally:
        for where, name, value in reversed(replaced):
            setattr(where, name, value)


class Judge:
    """Probabilities of failure by weighted draws of a wide normal density, the same draws for all designs; a power of two of
    them is a scrambled Sobol sequence.

    Parameters
    ----------
    scene : Scene
        Whose random inputs do not depend on the design, or are relative to it.
    wide : float
        Standard deviations of the draws; 1 for plain ones.
    """

    def __init__(self, scene: Scene, form: Form, draws: int, seed: int, wide: float = WIDE) -> None:
        self._scene, self._form = scene, form
        self._random = scene.required_study.cases[0].random
        rng = np.random.default_rng([97, seed])
        if draws & (draws - 1):
            u = wide * rng.standard_normal((draws, len(self._random)))
        else:  # as a verified mean of smooth f is known better than plain draws tell
            u = wide * ndtri(qmc.Sobol(len(self._random), rng=rng, bits=60).random(draws))
        chances = list(np.clip(ndtr(u), 1e-16, 1.0 - 1e-16).T)
        self._moved = offsets(scene, self._random, chances, {})
        self._weights = wide ** len(self._random) * np.exp(
            -0.5 * (u**2).sum(axis=1) * (1.0 - wide**-2)
        )

    def values(self, design: dict[str, float]) -> np.ndarray:
        """f at all draws, (draws,)."""
        column: Columns = {path: np.array(self._scene.number(path)) for path, *_ in PATHS.values()}
        column |= {PATHS[name][0]: np.array(value) for name, value in design.items()}
        for name, moved in self._moved.items():
            about = not self._scene.required_study.random_input(name).absolute
            column[PATHS[name][0]] = column[PATHS[name][0]] + moved if about else moved
        return self._form(column)

    def probability(self, design: dict[str, float], limit: float) -> tuple[float, float]:
        """Probability of exceeding a limit, and its standard error."""
        each = np.where(self.values(design) > limit, self._weights, 0.0)
        return float(each.mean()), float(each.std() / len(each) ** 0.5)

    def quantile(self, design: dict[str, float], above: float) -> float:
        """The limit that f exceeds with a probability."""
        f = self.values(design)
        order = np.argsort(f)[::-1]
        beyond = np.cumsum(self._weights[order]) / len(f)
        return float(f[order][np.searchsorted(beyond, above)])

"""Three and more things made small: fronts that are surfaces, from the scene to the page, on a front that is known."""

import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from hpcclear.ranks.boundary import alone
from hpcclear.results import dataset
from hpcclear.scene import Scene, load_scene
from hpcclear.study import run_study

sys.path.insert(0, str(Path(__file__).parent / "mpi_programs"))

import formula  # noqa: E402

UNIT = 1e-4  # m, of mean and deviation on the sphere
MEAN, DEVIATION = 2.0, 1.0  # where its centre lies
RIM = 0.9  # the formula is no larger, so that nothing has an infinite slope
THIRD = f"{RIM} * (m3 - 0.07) / 0.21"
LOW, HIGH = 3e-4, 1e-3  # C


def on_sphere(m2, m3, u2):
    """DTLZ2 (Deb et al. 2002): the front is an octant of the unit sphere, where u2 is 0.06; (..., 3)."""
    angle = 0.5 * np.pi * (m2 - 0.105) / 0.315
    third = RIM * (m3 - 0.07) / 0.21
    reach = np.sqrt(1.0 - third**2) * (1.0 + ((u2 - 0.06) / 0.06) ** 2)
    return np.stack([reach * np.cos(angle), reach * np.sin(angle), third], axis=-1)


def sphere(column: dict[str, np.ndarray]) -> np.ndarray:
    """f whose mean and deviation over C are the first two, in `UNIT`, off their centre; the third is a formula."""
    clearance = column["joints.crank_rod.clearance"]
    slider, rod = column["mechanism.slider.mass"], column["mechanism.rod.mass"]
    place = on_sphere(rod, slider, column["mechanism.rod.mass_center"])
    off = (clearance - 0.5 * (LOW + HIGH)) / ((HIGH - LOW) / 12**0.5)
    return UNIT * (MEAN + place[..., 0] + (DEVIATION + place[..., 1]) * off)


STUDY = (
    "study.sensitivity.groups=[]", "study.sensitivity.sobol_samples=0", "study.samples=80", "study.test_samples=20",
    'study.surrogate.models=[]', 'study.surrogate.optimisation=["m2", "m3", "u2", "C"]', "study.surrogate.r2=0.9",
    "study.swarm.particles=50", "study.swarm.iterations=40", "study.swarm.runs=2", "study.swarm.archive=60",
    'study.verification={accuracy={mean=0.005, deviation=0.01}, designs=12, infill_rounds=4, infill_samples=64, infill_designs=12, response_copies=2, '
    'response_windows=2, audit_samples=0, most_samples=1024}',
    f'study.cases={{three={{random=["C"], objectives=["mean", "deviation", {{formula="{THIRD}"}}]}}}}',
)  # fmt: skip


def scene_of(*overrides: str) -> Scene:
    return load_scene(tomllib.loads(formula.PHYSICS + formula.STUDY), [*STUDY, *overrides])


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("three") / "whole"
    patch = pytest.MonkeyPatch()
    formula.replace_dynamics(patch.setattr)
    patch.setattr(formula, "objective", sphere)
    run_study(scene_of(), place, alone(), progress_style="quiet")
    patch.undo()
    return place

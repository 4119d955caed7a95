"""A mechanism that is a formula: studies with known answers, without compiling a kernel.

f = 1e-4 (4 - 5 m2 + 3 m3 - 10 u2 + 500 I2) + (0.1 + 0.5 m2) C, in SI. Mean and deviation over C
conflict in m2; m1, u1 and I1 have no influence. Samples with m3 above `FAILS_ABOVE` fail. A tolerance makes f
too large by `BIAS` times itself, `worse` times as much at m2 and C, and costs evaluations by the law of a method
of order 5.
"""

import sys
from collections.abc import Callable, Sequence

import last_bits
import numpy as np

from hpcclear.base.objectives import asked
from hpcclear.base.outcome import JOINTS, Status, failed
from hpcclear.ensemble import compiling, simulate, single
from hpcclear.ensemble.simulate import Payload
from hpcclear.ranks.stopping import Stopped
from hpcclear.ranks.team import Ranks
from hpcclear.results import dataset
from hpcclear.scene import Scene, load_scene
from hpcclear.scene.scene import record_of
from hpcclear.study import responses, run_study
from hpcclear.study.run import StudyRun

JOINT = """\
kind = "clearance"
clearance = "0.3 mm"
bearing_radius = "20 mm"
bearing = { youngs_modulus = "0.5 GPa", poisson_ratio = 0.38 }
journal = { youngs_modulus = "206.8 GPa", poisson_ratio = 0.29 }
"""
PHYSICS = """
format_version = 1
[mechanism]
kind = "slider-crank"
crank = { length = 0.05, mass = 0.3, inertia = 1.0e-4, mass_center = 0.025 }
rod = { length = 0.12, mass = 0.21, inertia = 2.6e-4, mass_center = 0.06 }
slider = { mass = 0.14 }
[drive]
kind = "constant-speed"
speed = "5000 rpm"
[joints.crank_rod]
JOINT[joints.rod_slider]
JOINT[effects]
contact = { law = "lankarani-nikravesh", restitution = 0.9 }
""".replace("JOINT", JOINT)

STUDY = """
[study]
seed = 3
samples = 30
test_samples = 12
[study.variables]
m1 = { range = [0.15, 0.6] }
u1 = { range = [0.0, 0.05] }
I1 = { ratio = [1, 4] }
m2 = { range = [0.105, 0.42] }
u2 = { range = [0.0, 0.12] }
I2 = { ratio = [1, 4] }
m3 = { range = [0.07, 0.28] }
C = { range = ["0.3 mm", "1 mm"] }
[study.random]
C = { distribution = "uniform", range = ["0.3 mm", "1 mm"] }
m2 = { distribution = "uniform", half_width = 0.005 }
m3 = { distribution = "uniform", half_width = 0.005 }
u2 = { distribution = "uniform", half_width = 0.02 }
I2 = { distribution = "uniform", half_width = 0.5e-4 }
[study.cases]
first = ["C"]
second = ["C", "m2", "m3", "u2", "I2"]
[study.sensitivity]
levels = 3
rounds = 3
samples = 24
order = 2
together_samples = 60
sobol_samples = 16
resamplings = 1
[study.surrogate]
models = [["m2", "m3", "C"]]
optimisation = ["m2", "m3", "u2", "I2", "C"]
r2 = 0.9
restarts = 0
cuts = 0
[study.swarm]
particles = 20
iterations = 12
runs = 2
archive = 12
[study.verification]
samples = 200
designs = 4
audit_samples = 20
response_windows = 3
response_copies = 3
infill_rounds = 1
infill_designs = 6
"""

CHUNK = 200  # samples that a call evaluates
FIELD = ""  # of a record that gets the objective as well
FAILS_ABOVE = np.inf
BIAS = 0.0


def worse(mass: np.ndarray, play: np.ndarray) -> np.ndarray:
    """Times the bias, at m2 and C."""
    return np.ones_like(mass)


def objective(column: dict[str, np.ndarray]) -> np.ndarray:
    """The formula, from values by scene path."""
    mass = column["mechanism.rod.mass"]
    constant = 4 - 5 * mass + 3 * column["mechanism.slider.mass"]
    constant = constant - 10 * column["mechanism.rod.mass_center"]
    constant = constant + 500 * column["mechanism.rod.inertia"]
    return 1e-4 * constant + (0.1 + 0.5 * mass) * column["joints.crank_rod.clearance"]


def f(column: dict[str, np.ndarray]) -> np.ndarray:
    """The objective, with the last bits of this run."""
    return last_bits.disturbed(objective(column))


class FormulaWorker:
    """Evaluates a few samples a call, the last ones first."""

    lanes = 4

    def __init__(self, payload: Payload) -> None:
        self._scene = payload.scene  # as the evaluators of the package
        self._objective, self._record = self._scene.objective, record_of(self._scene)
        self._paths = payload.paths
        self._index, self._points = np.empty(0, int), np.empty((0, len(self._paths)))

    @property
    def pending(self) -> int:
        return len(self._index)

    def submit(self, index: np.ndarray, points: np.ndarray) -> None:
        self._index = np.concatenate([self._index, index])
        self._points = np.concatenate([self._points, points])

    def advance(self, seconds: float) -> np.ndarray:
        taken, values = self._index[-CHUNK:], self._points[-CHUNK:]
        self._index, self._points = self._index[:-CHUNK], self._points[:-CHUNK]
        if not len(taken):
            return np.zeros(0, self._record)
        column = {path: np.full(len(taken), x) for path, x in numbers(self._scene).items()}
        for k, paths in enumerate(self._paths):
            column |= dict.fromkeys(paths, values[:, k])
        records = np.repeat(failed(0, Status.STEP_CAP, record=self._record), len(taken))
        records["sample"] = taken
        fine = column["mechanism.slider.mass"] <= FAILS_ABOVE
        records["objective"][fine], records["objective_spread"][fine] = f(column)[fine], 0.0
        for name in ("mean_gap", "peak_contact_force"):
            records[name][fine] = 1.0
        if FIELD:
            like = (-1, *(1 for _ in self._record[FIELD].shape))
            records[FIELD][fine] = f(column)[fine].reshape(like)
        at = column["mechanism.rod.mass"], column["joints.crank_rod.clearance"]
        bias = BIAS * worse(*np.broadcast_arrays(*at))
        records["objective"] *= 1.0 + bias * self._scene.numerics.rtol
        records["rhs_evaluations"] = round(100 * self._scene.numerics.rtol**-0.2)
        records["status"][fine] = Status.OK
        return asked(records, self._objective)


def numbers(scene: Scene) -> dict[str, float]:
    """All physical numbers of a scene."""
    return {path: scene.number(path) for path in scene.numeric_paths()}


def make_formula(payload: Payload, ranks: Ranks) -> FormulaWorker:
    """Maker of the ranks' workers."""
    return FormulaWorker(payload)


def compile_nothing(payload: Payload, ranks: Ranks) -> None:
    """Takes the place of the compilers."""


def respond(scene: Scene, copy: int = 0, *, checked: bool = True):
    """A response whose forces and accelerations are the objective times a wave."""
    turns = scene.numerics.transient_revolutions + int(scene.numerics.averaged_revolutions)
    angle = np.linspace(0.0, 2 * np.pi * turns, 40 * turns + 1)
    column = {path: np.array(x) for path, x in numbers(scene).items()}
    size = float(f(column)) * 1e4
    wave = size * (2.0 + np.cos(angle))
    series = dict.fromkeys(("crank_moment", "slider_acceleration"), wave)
    pair = np.column_stack([wave, 2 * wave])
    data = {**series, "crank_angle": angle, "contact_force": pair}
    data |= {"eccentricity_x": 1e-4 * pair, "eccentricity_y": 0 * pair}
    scalars = {"objective": size, "objective_spread": 0.0, "rhs_evaluations": 7, "status": 0}
    coords = {"time": angle / 523.0, "joint": JOINTS}
    return dataset.dataset("response", coords, data | scalars, objective=scene.objective)


def respond_together(scenes: Sequence[Scene], copies: Sequence[int]):
    """Those of a batch, each by what simulates one."""
    for k, (scene, copy) in enumerate(zip(scenes, copies, strict=True)):
        yield k, responses.simulated(scene, copy=copy, checked=False)


def replace_dynamics(set_attribute: Callable[[object, str, object], None] = setattr) -> None:
    """Samples and responses by formula, and nothing is compiled."""
    set_attribute(simulate, "make_evaluator", make_formula)
    set_attribute(compiling, "compile_share", compile_nothing)
    set_attribute(responses, "simulated", respond)
    set_attribute(single, "simulate_together", respond_together)


def run_in_pieces(scene: Scene, directory: str, ranks: Ranks) -> int:
    """StudyRun a study that is stopped after every stage it completes; how many stages that took."""
    stages, go_on = 0, StudyRun.stage

    def stop_after(run: StudyRun, name: str, work, *arguments: object):  # type: ignore[no-untyped-def]
        known = run.checkpoint.load_stage(name) is not None
        found = go_on(run, name, work, *arguments)
        if not known:
            raise Stopped(f"after {name}")
        return found

    StudyRun.stage = stop_after  # type: ignore[method-assign]
    try:
        while True:
            try:
                run_study(scene, directory, ranks, progress_style="quiet")
                return stages
            except Stopped:
                stages += 1
    finally:
        StudyRun.stage = go_on  # type: ignore[method-assign]


if __name__ == "__main__":
    from hpcclear.ranks.boundary import run_on_ranks

    replace_dynamics()
    if len(sys.argv) > 3:
        BIAS = float(sys.argv[3])
    if len(sys.argv) > 4:
        FIELD = sys.argv[4]

    def program(ranks: Ranks) -> None:
        scene = load_scene(sys.argv[1])
        run_study(scene, sys.argv[2], ranks, progress_style="quiet")

    sys.exit(run_on_ranks(program))

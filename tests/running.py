"""One sample through the kernel with W = 1, every step kept, and what its state says about the bodies."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from bending_by_lagrange import Rod
from some_laws import row

from hpcclear.base.outcome import Status
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.evaluation.recorded.steps import Recording, Steps
from hpcclear.dynamics.layout.views import Outcome
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.problem import problem_of
from hpcclear.dynamics.setup.start import start_states
from hpcclear.dynamics.stepping import record as rec
from hpcclear.dynamics.stepping.lanes import Lanes
from hpcclear.scene import Scene, load_scene

SCENE = Path(__file__).parent.parent / "jobs" / "slider_crank.toml"
HUNT_CROSSLEY = {"law": "hunt-crossley", "damping": 0.5}
LATCHED = {"law": "lankarani-nikravesh", "restitution": 0.9}
RIGID = {
    "joints.crank_rod": {"kind": "ideal"},
    "joints.rod_slider": {"kind": "ideal"},
    "effects.contact": None,
    "effects.friction": {"law": "none"},
}
"""No joint has clearance."""
BOUNDS = {1e-6: 2e-5, 1e-8: 1e-7, 1e-10: 3e-9}
"""On the energy residual of every scene over what passed, by the tolerance, over ten revolutions."""
# coordinates of crank, rod and slider
X1, Y1, PHI, X2, Y2, THETA2, X3, Y3, THETA3 = range(9)
KERNEL_ORDER = [X1, Y1, X2, Y2, THETA2, X3, Y3, THETA3, PHI]


@dataclass
class Run:
    """Outcome, parameters, and every accepted step."""

    out: Outcome
    par: np.ndarray
    start: np.ndarray  # (2 n,)
    time: np.ndarray
    q: np.ndarray  # (steps, n)
    v: np.ndarray
    contacts: np.ndarray  # (steps, 2) active

    @property
    def evaluations(self) -> float:
        return float(self.out.evaluations)


def scene_with(changes=None, revolutions=1, rtol=1e-8) -> Scene:
    """The paper's scene without transient."""
    numerics = {
        "numerics.transient_revolutions": 0,
        "numerics.averaged_revolutions": revolutions,
        "numerics.rtol": rtol,
    }
    return load_scene(SCENE).with_(numerics | (changes or {}))


def integrate(scene: Scene):
    """All steps of a response, its outcome record (1,) and parameters, SI."""
    recording = Recording(scene)
    steps = Steps.of(np.concatenate(list(recording.chunks())))
    return steps, recording.record(), recording.samples[0].par


def run(scene: Scene, effects=None, par_changes=None, shift=None) -> Run:
    """Simulate; `effects` forces kernel flags, `par_changes` rows of parameters, `shift` adds to the start (2, n)."""
    problem = problem_of(scene)
    if effects:
        problem = replace(problem, effects=problem.effects._replace(**effects))
    par = parameters(scene)
    for column, value in (par_changes or {}).items():
        par[:, column] = value
    start = start_states(scene, par)
    n = problem.coordinates
    if shift is not None:
        start.coordinates(n)[0] += shift[0]
        start.velocities(n)[0] += shift[1]
    lanes = Lanes(problem, 1, np.zeros((4096, rec.columns(n))))
    lanes.queue(par, start, np.zeros(1, np.int64))
    chunks = []
    while lanes.pending:
        lanes.advance(1.0)
        chunks.append(lanes.take_record())
    rows = np.concatenate(chunks)
    s = rec.STATE
    return Run(
        lanes.collect()[1][0], par[0], start[0].state(n), rows[:, rec.TIME], rows[:, s : s + n],
        rows[:, s + n : s + 2 * n], rows[:, rec.CONTACTS : rec.CONTACTS + 2],
    )  # fmt: skip


def methods_agree(scene: Scene, methods: Sequence[str]) -> None:
    """That f is the same to 1e-8 whichever method integrates."""
    found = {
        name: float(run(scene.with_({"numerics.method": name})).out.objective) for name in methods
    }
    assert found == pytest.approx(dict.fromkeys(found, found[methods[0]]), rel=1e-8)


def rod_of(scene: Scene) -> Rod:
    """A slider-crank's rod that bends, as its points."""
    rod, table = scene.slider_crank.rod, scene.slider_crank.rod.bending
    bar = (rod.mass, rod.inertia, rod.length, rod.mass_center)
    return Rod(*bar, table.stiffness, table.damping, table.modes)


def bent(scene: Scene, q, v, nine, rates) -> tuple[float, float]:
    """Energy and first moment against y = 0 that bending adds to the rigid bodies, J and kg m."""
    k, rod, bar = scene.modes, rod_of(scene), scene.slider_crank.rod
    near = bar.mass_center * np.exp(1j * nine[THETA2])
    end = nine[X2] + 1j * nine[Y2] - near
    speed = rates[X2] + 1j * rates[Y2] - 1j * rates[THETA2] * near
    y = np.array([end.real, end.imag, nine[THETA2], *q[:k]])
    w = np.array([speed.real, speed.imag, rates[THETA2], *v[:k]])
    rigid = bar.mass * (rates[X2] ** 2 + rates[Y2] ** 2)
    rigid += bar.inertia * rates[THETA2] ** 2
    return sum(rod.energy(y, w)) - 0.5 * rigid, rod.raised(y)


def bodies(scene: Scene, par, q, v):
    """Nine coordinates and velocities from those of any topology, by the vectors between the joints.

    Prescribed speed: only states at the end of a revolution, where the crank angle is 0.
    """
    if scene.numerics.formulation == "baumgarte":
        nine, rates = np.zeros(9), np.zeros(9)
        nine[KERNEL_ORDER], rates[KERNEL_ORDER] = q[scene.modes :], v[scene.modes :]
        return nine, rates
    free = scene.drive.kind == "torque"
    phi, omega = (q[-1], v[-1]) if free else (0.0, par[at.SPEED])
    m = scene.slider_crank
    crank, length, near = m.crank.length, m.rod.length, m.rod.mass_center
    far, k, rate = length - near, scene.modes, 0.0
    if k:
        y, w = np.array([0, 0, 0, *q[:k]]), np.array([0, 0, 0, *v[:k]])
        rod = rod_of(scene)
        drawn, rate = rod.place_of_end(y)[0] - length, (rod.end(y).real @ w)[0]
        length, far, q, v = length + drawn, far + drawn, q[k:], v[k:]
    pin = crank * np.exp(1j * phi)
    pin_v = 1j * omega * pin
    first, second = (name in scene.clearance_joints() for name in ("crank_rod", "rod_slider"))
    if first and second:
        theta, spin, slider, slider_v = q[2], v[2], q[3], v[3]
        centre, centre_v = q[0] + 1j * q[1], v[0] + 1j * v[1]
    else:
        theta, spin, slider, slider_v = q[0], v[0], q[1], v[1]
        along = np.exp(1j * theta)
        if first:
            centre = slider - far * along
            centre_v = slider_v - (1j * spin * far + rate) * along
        else:
            centre = pin + near * along
            centre_v = pin_v + 1j * spin * near * along
    nine, rates = np.zeros(9), np.zeros(9)
    u1 = m.crank.mass_center / crank
    nine[[X1, Y1, PHI]] = (pin * u1).real, (pin * u1).imag, phi
    rates[[X1, Y1, PHI]] = (pin_v * u1).real, (pin_v * u1).imag, omega
    nine[[X2, Y2, THETA2, X3]] = centre.real, centre.imag, theta, slider
    rates[[X2, Y2, THETA2, X3]] = centre_v.real, centre_v.imag, spin, slider_v
    return nine, rates


def energy(scene: Scene, par, q, v, active) -> float:
    """Kinetic, potential and stored energy, J."""
    nine, rates = bodies(scene, par, q, v)
    m = scene.slider_crank
    m1, m2, m3 = m.crank.mass, m.rod.mass, m.slider.mass
    own = m.crank.inertia + getattr(scene.drive, "flywheel_inertia", 0.0)
    masses = np.array([m1, m1, own, m2, m2, m.rod.inertia, m3, m3, 0])
    total = 0.5 * (masses * rates**2).sum()
    total += scene.effects.gravity * (m1 * nine[Y1] + m2 * nine[Y2] + m3 * nine[Y3])
    near_end = nine[X2] + 1j * nine[Y2] - m.rod.mass_center * np.exp(1j * nine[THETA2])
    far = m.rod.length - m.rod.mass_center
    if scene.modes:
        more, moment = bent(scene, q, v, nine, rates)
        total += more + scene.effects.gravity * moment
        y = np.array([0, 0, 0, *q[: scene.modes]])
        far += rod_of(scene).place_of_end(y)[0] - m.rod.length
    far_end = nine[X2] + 1j * nine[Y2] + far * np.exp(1j * nine[THETA2])
    pin = (nine[X1] + 1j * nine[Y1]) + (m.crank.length - m.crank.mass_center) * np.exp(
        1j * nine[PHI]
    )
    latched = scene.effects.contact is not None and scene.effects.contact.latched
    for k, (name, e) in enumerate(
        (("crank_rod", pin - near_end), ("rod_slider", nine[X3] + 1j * nine[Y3] - far_end))
    ):
        base = at.JOINTS[k].block
        if name in scene.clearance_joints():
            depth = max(abs(e) - par[base + at.CLEARANCE], 0.0)
            on = active[k] if latched else 1.0
            stiffness = par[base + row("contact", scene.effects.contact.law, "stiffness")]
            total += 0.4 * stiffness * on * depth**2.5
    return float(total)


def energy_residual(scene: Scene, result: Run) -> tuple[float, float]:
    """What the energy balance misses over the run, J, and the energy that passed through."""
    out, n, first = result.out, len(result.start) // 2, scene.bristles
    touching = np.zeros(2)
    before = energy(scene, result.par, result.start[first:n], result.start[n + first :], touching)
    q, v = result.q[-1, first:], result.v[-1, first:]
    after = energy(scene, result.par, q, v, result.contacts[-1])
    drive, passed, lost, load = (
        float(x) for x in (out.drive_work, out.absolute_drive_work, out.dissipated, out.load_work)
    )
    return after - before - drive - load + lost, passed + abs(lost) + abs(load) + abs(
        after - before
    )


def closes(scene: Scene) -> Run:
    """What a scene gives that ends well, with its energy closed."""
    result = run(scene)
    assert result.out.status == Status.OK
    rest, passed = energy_residual(scene, result)
    assert abs(rest) < BOUNDS[scene.numerics.rtol] * passed
    return result

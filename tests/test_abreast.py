"""Implicit steps, eight samples abreast: each gets what it would get alone, and what a solver of scipy gets."""

from pathlib import Path

import numpy as np
import pytest

from hpcclear.base.arrays import Array
from hpcclear.base.jit import FASTMATH
from hpcclear.base.lowering.compiled import Compiled
from hpcclear.base.lowering.values import kind_of
from hpcclear.base.outcome import Status
from hpcclear.dynamics.evaluation.evaluator import DEFAULT_LANES
from hpcclear.dynamics.layout import MAX_JOINTS, RATES
from hpcclear.dynamics.layout.views import Outcome
from hpcclear.dynamics.linkage.observe import observe
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.problem import problem_of
from hpcclear.dynamics.setup.start import start_states
from hpcclear.dynamics.stepping.implicit import memory as mem
from hpcclear.dynamics.stepping.implicit.columns import new_columns
from hpcclear.dynamics.stepping.implicit.inverses import invert_complex, invert_real
from hpcclear.dynamics.stepping.lanes import Lanes
from hpcclear.scene import Scene, load_scene
from hpcclear.scene.points import latin_hypercube

JOB = Path(__file__).parent.parent / "jobs" / "quickstart.toml"
FILM = "film={model='short', viscosity='10 mPa*s', length='20 mm'}"
SCENES = {
    "friction": [
        "effects.contact={law='lankarani-nikravesh', restitution=0.9}",
        "effects.friction={law='coulomb', coefficient=0.3, ramp_speed=1e-4}",
    ],
    "ramp": [
        "effects.contact={law='hunt-crossley', damping=0.5}",
        "effects.friction={law='coulomb', coefficient=0.3, ramp_speed=1e-4}",
    ],
    "oil": [f"joints.crank_rod.{FILM}", f"joints.rod_slider.{FILM}"],
    "always": ["numerics.method='radau'"],
}


def compiled(function, *arguments) -> None:
    """Call a function of the kernel by its machine code."""
    Compiled(function, kind_of(arguments).parts, FASTMATH)(*arguments)


def scene_of(name: str) -> Scene:
    length = ["numerics.transient_revolutions=0", "numerics.averaged_revolutions=1"]
    return load_scene(JOB, [*SCENES[name], *length])


def run(scene: Scene, samples: slice, width: int) -> Outcome:
    """Outcomes of some of twelve samples."""
    points = latin_hypercube(scene, 12).take(samples)
    par = parameters(scene, points)
    return Lanes(problem_of(scene), width).run(par, start_states(scene, par, points))


@pytest.mark.parametrize("name", ["friction", "oil", "always"])
@pytest.mark.shortened(1)
def test_no_sample_depends_on_its_neighbours(name: str):
    """Three samples and many empty lanes, and eleven that take three in turn."""
    scene = scene_of(name)
    together = run(scene, slice(0, 11), DEFAULT_LANES)
    assert (together.status == Status.OK).all()
    assert (together.stiff_steps > 0).all()
    for few, width in ((slice(4, 7), DEFAULT_LANES), (slice(0, 11), 3)):
        np.testing.assert_array_equal(run(scene, few, width).rows, together.rows[few])


@pytest.mark.parametrize("model", ["short", "long", "finite"])
@pytest.mark.shortened(1)
def test_a_film_is_the_same_in_any_number_of_lanes(model: str):
    """To the last bit, at places from the middle to beyond the clearance."""
    joints = [entry.replace("short", model) for entry in SCENES["oil"]]
    scene = load_scene(JOB, joints)
    problem, par = problem_of(scene), parameters(scene)[0]
    n, count = problem.coordinates, 4096
    start = start_states(scene, parameters(scene)).state(n)
    scale = np.r_[np.full(n, 4e-4), np.full(n, 1.0)]
    states = start + scale * np.random.default_rng(5).uniform(-1.0, 1.0, (count, 2 * n))
    contacts = np.zeros((count, 2 * MAX_JOINTS))
    found = []
    for width in (1, DEFAULT_LANES):
        out = np.zeros((count, n + RATES))
        address = problem.motion(problem.effects, width).address
        observe(address, par, problem.tables, states, contacts, np.zeros((2, count)), out, width)
        found.append(out)
    assert np.isfinite(found[0][:, :n]).all()
    np.testing.assert_array_equal(*found)


@pytest.mark.parametrize(("name", "near"), [("ramp", 1e-4), ("oil", 5e-5), ("always", 1e-5)])
@pytest.mark.shortened(1)
def test_implicit_steps_agree_with_explicit_ones(name: str, near: float):
    """Which share no coefficient, and are tight: what they differ by is the error of implicit steps at rtol 1e-6 or less."""
    scene = scene_of(name)
    tight = scene.with_({"numerics.method": "dormand-prince", "numerics.rtol": 1e-9})
    abreast, exact = (run(one, slice(0, 4), DEFAULT_LANES) for one in (scene, tight))
    assert (abreast.stiff_steps > 0).all()
    assert (exact.stiff_steps == 0).all()
    np.testing.assert_allclose(abreast.objective, exact.objective, rtol=near)


def matrices(seed: int, n: int) -> Array:
    """Eight matrices whose rows have to be exchanged, each in its own way: noughts on the diagonal among them."""
    found = np.random.default_rng(seed).normal(size=(mem.COLUMNS, n, n))
    for k, matrix in enumerate(found):
        matrix[k % n, k % n] = 0.0
    return found if n > 1 else found + 2.0


@pytest.mark.parametrize("n", [1, 2, 4, 9])
def test_inverses_of_eight_matrices(n: int):
    m = new_columns(mem.COLUMNS)[0]
    real, imaginary = matrices(n, n), matrices(n + 50, n)
    held = m.reshape(-1, mem.COLUMNS)

    def place(first: int) -> Array:
        """The matrices from a row on, shape (n, n, 8)."""
        return held[first : first + mem.N**2].reshape(mem.N, mem.N, mem.COLUMNS)[:n, :n]

    place(mem.REAL)[:] = np.moveaxis(real, 0, 2)
    place(mem.COMPLEX_RE)[:] = np.moveaxis(real, 0, 2)
    place(mem.COMPLEX_IM)[:] = np.moveaxis(imaginary, 0, 2)
    compiled(invert_real, n, m, mem.REAL)
    compiled(invert_complex, n, m, mem.COMPLEX_RE, mem.COMPLEX_IM)
    both = np.moveaxis(place(mem.COMPLEX_RE) + 1j * place(mem.COMPLEX_IM), 2, 0)
    unit = np.broadcast_to(np.eye(n), real.shape)
    np.testing.assert_allclose(np.moveaxis(place(mem.REAL), 2, 0) @ real, unit, atol=1e-9)
    np.testing.assert_allclose(both @ (real + 1j * imaginary), unit, atol=1e-9)


def test_one_singular_matrix_spoils_no_other():
    m = new_columns(mem.COLUMNS)[0]
    held = m.reshape(-1, mem.COLUMNS)
    for k in range(2):
        held[mem.REAL + k * mem.N + k] = 2.0
    held[mem.REAL + mem.N + 1, 5] = 0.0
    compiled(invert_real, 2, m, mem.REAL)
    found = held[mem.REAL + mem.N + 1]
    assert not np.isfinite(found[5])
    assert (np.delete(found, 5) == 0.5).all()

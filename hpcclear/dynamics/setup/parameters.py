"""Kernel parameters of a scene's samples."""

from collections.abc import Callable
from typing import Any

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.base.outcome import WIDEST
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout.views import Parameters
from hpcclear.dynamics.planar.prescribed import held_extremes
from hpcclear.dynamics.planar.problem import is_prescribed, linkage_of, parameters_of, sample_of
from hpcclear.dynamics.planar.tolerances import SMOOTH, tolerances
from hpcclear.laws import laws, numbers
from hpcclear.laws.constant import with_constants
from hpcclear.laws.declared import JOINT
from hpcclear.laws.hertz_contact import dundurs, reduced_compliance, sphere_stiffness
from hpcclear.scene import Scene
from hpcclear.scene.points import Numbers, Points

OF_RAMP, OF_FORCE = 0.5, 0.003
"""Of friction's ramp, and of the forces of inertia: what errors of explicit steps at the edge of stability may come to."""


def parameters(scene: Scene, points: Points | None = None) -> Array:
    """Kernel parameters of each sample, shape (samples, PARAMETERS)."""
    get = Numbers(scene, points)
    p = parameters_of(scene, get, points)
    if not is_prescribed(scene):
        friction = _given(get, "friction", scene.effects.friction)
        least = tolerances(scene, sample_of(scene, points), p, friction)
        p[:, at.tolerance_rows(least.shape[1] // 2)] = least
    force = _inertia(scene, get, p)
    for k, contact in zip(scene.open_places, scene.contact_labels(), strict=True):
        block = at.JOINT_BLOCKS + k * at.JOINT_ROWS
        fill(scene, get, contact, force, p[:, block:])
        _film_parameters(scene, get, contact, p, block)
    held = scene.responses_asked() and is_prescribed(scene)
    extremes = held_extremes(scene, points, get.size) if held else np.nan
    p[:, at.HELD_MOMENT : at.HELD_PEAK + 1] = extremes
    p[:, at.EDGE] = _needed_at_edge(scene, get, p)
    p = with_waves(scene, get, p) if has_waves(scene) else p
    return with_further_numbers(scene, get, p) if further_rows(scene) else p


def joint_numbers(scene: Scene, get: Numbers, label: str) -> dict[str, Array]:
    """Numbers of a contact's samples by the names of `declared.JOINT`, (m,)."""
    key = scene.joint_key(label)
    materials = scene.path_in_scene(f"mechanism.joints.{label.partition('.')[0]}.materials")
    shape = scene.shape(label, get)
    clearance, bearing, journal = shape.radii
    moduli, ratios = (
        [get(f"{materials}.{part}.{entry}") for part in ("bearing", "journal")]
        for entry in ("youngs_modulus", "poisson_ratio")
    )
    h_bearing, h_journal = map(reduced_compliance, moduli, ratios)
    path = scene.clearance_joint(label).length_path
    length = np.full_like(clearance, np.nan) if path is None else get(f"{key}.{path}")
    stiffness = sphere_stiffness(h_bearing, h_journal, shape.radius)
    sizes = bearing, journal, clearance, length
    of_both = dundurs(moduli, ratios)
    return dict(zip(JOINT, (stiffness, h_bearing + h_journal, *sizes, *of_both), strict=True))


def _given(get: Numbers, kind: str, table: Any) -> dict[str, object]:
    """A law's parameters of samples, (m,); lists as they are."""
    values = {one.name: table.value(one.name) for one in table.declared.parameters}
    return {
        name: value if isinstance(value, tuple) else get(f"effects.{kind}.{name}")
        for name, value in values.items()
    }


def fill(scene: Scene, get: Numbers, label: str, force: Array, p: Array) -> None:
    """Fill one contact's block of parameters but for its film (a view, first column its first entry).

    `force`: what inertia comes to, N, (m,): laws whose force is no power of the depth are looked at there.
    """
    joint, shape = joint_numbers(scene, get, label), scene.shape(label, get)
    p[:, at.CLEARANCE] = shape.clearance
    p[:, at.BEARING_RADIUS] = shape.bearing_radius
    p[:, at.JOURNAL_RADIUS] = shape.journal_radius
    table: Any = scene.effects.contact
    law = with_constants(table.declared)
    found = numbers.sample_numbers(law, {**joint, **_given(get, "contact", table)})
    rows = numbers.rows_of(law, found, len(p))
    p[:, at.CONTACT_NUMBERS : at.CONTACT_NUMBERS + rows.shape[1]] = rows
    p[:, at.EXPONENT], p[:, at.DAMPING] = numbers.shape_near(law, force, found)
    p[:, at.DEEPEST_VALID] = shape.deepest
    if law.deepest is not None:
        own = numbers.evaluate(law.deepest, found)
        small = not scene.clearance_joint(label).round  # a corner
        p[:, at.DEEPEST_VALID] = np.minimum(own, shape.deepest) if small else own
    rubs = scene.effects.friction
    if rubs.law == "none":
        return
    friction = with_constants(rubs.declared)
    found = numbers.sample_numbers(friction, {**joint, **_given(get, "friction", rubs)})
    rows = numbers.rows_of(friction, found, len(p))
    p[:, at.FRICTION_NUMBERS : at.FRICTION_NUMBERS + rows.shape[1]] = rows
    p[:, at.INVERSE_RAMP], p[:, at.STEEPNESS] = numbers.steepness_of(friction, found, len(p))


def _film_parameters(scene: Scene, get: Numbers, joint: str, p: Array, block: int) -> None:
    """Fill what a joint's block of parameters (its first column) has of its film; without one its force is 0."""
    film, own = scene.films().get(joint), p[:, block:]
    own[:, at.FILM_SCALE : at.JOINT_ROWS] = 0.0
    own[:, at.FILM_FLOOR] = 0.5
    own[:, at.FILM_STEEPNESS] = SMOOTH if scene.bristles else 0.0
    if film is None:
        return
    key = scene.joint_key(joint)
    viscosity, length = get(f"{key}.film.viscosity"), get(f"{key}.film.length")
    clearance, radius = get(f"{key}.clearance"), get(f"{key}.bearing_radius")
    given = {"viscosity": viscosity, "film_length": length, "bearing_radius": radius}
    law = laws("film")[film.model]
    own[:, at.FILM_SCALE] = numbers.evaluate(law.scale, given | {"clearance": clearance})
    own[:, at.FILM_SHEAR] = at.TURN * viscosity * length * radius**3 / clearance
    own[:, at.FILM_FLOOR] = get(f"{key}.film.roughness") / clearance
    inertia = _mass(scene, get) * p[:, at.DRIVEN_LENGTH] * p[:, at.SPEED] ** 2
    own[:, at.FILM_STEEPNESS] = own[:, at.FILM_SCALE] / inertia


def _needed_at_edge(scene: Scene, get: Numbers, p: Array) -> Array:
    """One over the relative tolerance of velocities, shape (samples,), with which explicit steps at the edge of stability keep
    friction and contact forces.

    There errors grow until they meet the tolerance. Half of friction's ramp at most: beyond it the direction of friction is
    chance. And what swings in a contact under the forces of inertia, at the frequency w of small motions, w^2 = F'(d)/m,
    may add `OF_FORCE` of these.
    """
    pin = np.abs(p[:, at.SPEED]) * p[:, at.DRIVEN_LENGTH]
    mass, force = _mass(scene, get), _inertia(scene, get, p)
    needed = np.ones(len(p))
    for key in scene.joint_frictions():
        needed = np.maximum(needed, 1.0 / (OF_RAMP * get(f"{key}.ramp_speed")))
    for place in scene.open_places:
        own = p[:, at.JOINT_BLOCKS + place * at.JOINT_ROWS :]
        if scene.effects.friction.law != "none":
            needed = np.maximum(needed, own[:, at.INVERSE_RAMP] / OF_RAMP)
        law = with_constants(scene.effects.contact.declared)  # type: ignore[union-attr]
        known = numbers.read_from(law, Parameters(p).contact_numbers[..., place, :])
        frequency = np.sqrt(numbers.swing(law, force, known) / mass)
        needed = np.maximum(needed, mass * frequency / (OF_FORCE * force))
    return (1.0 + pin) * needed


def _mass(scene: Scene, get: Numbers) -> Array:
    """All masses together, kg, (samples,)."""
    masses = [path for path in scene.numeric_paths() if path.endswith(".mass")]
    return sum(map(get, masses), np.zeros(get.size))


def _inertia(scene: Scene, get: Numbers, p: Array) -> Array:
    """What the forces of inertia come to, N, (samples,)."""
    turning = np.abs(p[:, at.SPEED])
    pin = turning * p[:, at.DRIVEN_LENGTH]
    return np.maximum(_mass(scene, get) * pin * turning, 1e-300)


def widest_contact(scene: Scene, get: Numbers, forces: Array) -> dict[str, Array]:
    """Fields of `outcome.WIDEST`, (m, MAX_JOINTS) each, at normal forces (m, MAX_JOINTS) of samples; 0 without contact.

    Empty where the geometry of contact has no pressure; NaN at places without a contact.
    """
    if not scene.effects.has_pressure:
        return {}
    law: Any = scene.effects.contact.declared  # type: ignore[union-attr]
    functions = {name: getattr(law.geometry, attribute) for name, attribute in WIDEST.items()}
    by_depth = any("depth" in law.arguments(one) for one in functions.values())
    found = {name: np.full(forces.shape, np.nan) for name in WIDEST}
    for place, label in zip(scene.open_places, scene.contact_labels(), strict=True):
        given = joint_numbers(scene, get, label)
        own = numbers.sample_numbers(law, given | _given(get, "contact", scene.effects.contact))
        force = forces[:, place]
        state = {**own, "force": force}
        if by_depth:
            state["depth"] = numbers.depth_at(law, force, own)
        for name, function in functions.items():
            value = numbers.evaluate(function, state)
            found[name][:, place] = np.where(force == 0.0, 0.0, value)
    return found


# ---- what few scenes have: waves of surfaces, thresholds of wear, films that are solved for once a bearing ----
SAME_LENGTH = 0.01
"""By how much length over diameter may differ between samples of a film that is solved for one, relative: worn bearings are
wider."""

RAMP = 0.1  # of a threshold of wear, relative: beyond it by so much, all of the force wears


def parameter_rows(scene: Scene) -> int:
    """Parameters of a sample."""
    waving = at.FURTHER if has_waves(scene) else linkage_of(scene).parameter_rows
    return further_rows(scene) or waving


def has_waves(scene: Scene) -> bool:
    """Whether there are parameters of waves or of thresholds of wear."""
    return any(scene.waves().values()) or scene.has_thresholds


def with_waves(scene: Scene, get: Numbers, p: Array) -> Array:
    """Parameters (m, PARAMETERS) with the waves of surfaces that are out of round, and thresholds of wear; of joints without
    the former are 0."""
    rows = np.pad(p, ((0, 0), (0, at.FURTHER - p.shape[1])))
    for joint in scene.pins():
        own = rows[:, at.WAVES + 2 * first_wave(scene, joint) :]
        paths = wave_paths(scene, joint)
        for k in range(len(paths) // 2):
            cosine, sine = (get.known(path) for path in paths[2 * k : 2 * k + 2])
            n = int(paths[2 * k].rpartition("_")[2])
            own[:, 4 * k : 4 * k + 4] = np.stack([cosine, sine, n * sine, -n * cosine], axis=-1)
    for joint, place in zip(scene.contact_labels(), scene.open_places, strict=True):
        row = at.THRESHOLDS + 2 * place
        rows[:, row : row + 2] = _share_that_wears(scene, get, joint)
    return rows


def _share_that_wears(scene: Scene, get: Numbers, joint: str) -> Array:
    """Slope, 1/N, and offset of the share of a joint's normal force that wears, shape (samples, 2); 0 and 1 for all of it."""
    key, wear = scene.joint_key(joint), scene.clearance_joint(joint).wear
    if wear is None or wear.threshold is None:
        return np.tile([0.0, 1.0], (get.size, 1))
    size = 2.0 * get(f"{key}.bearing_radius") * get(f"{key}.wear.length")
    slope = 1.0 / (RAMP * get(f"{key}.wear.threshold") * size)
    return np.stack([slope, np.full(get.size, -1.0 / RAMP)], axis=-1)


def first_wave(scene: Scene, joint: str) -> int:
    """First row of a joint's waves among `layout.WAVE_ROWS`. Raises InputError if there are more than rows."""
    rows = 2 * sum(scene.waves().values())
    place = scene.joint_labels.index(joint)
    first = rows * place
    if first + rows > at.WAVE_ROWS:
        raise InputError(
            "wear.harmonics" if scene.wear is not None and scene.wear.waves else f"{scene.joint_key(joint)}.out_of_round",
            rows // 2, f"all joints together have more than {at.WAVE_ROWS // 2} waves",
            f"Take {at.WAVE_ROWS // 2 // (place + 1) // 2} around each surface at most",
        )  # fmt: skip
    return first


def wave_paths(scene: Scene, joint: str) -> list[str]:
    """Entries of a joint's waves, in the order of their rows."""
    return [
        f"{scene.joint_key(joint)}.out_of_round.{surface}.{part}_{n + 1}"
        for surface, count in scene.waves().items()
        for n in range(count)
        for part in ("cosine", "sine")
    ]


def _solved_films(scene: Scene) -> dict[str, Callable[[float], Array]]:
    """Joints whose films have further numbers, and the functions that give these."""
    known = {name: laws("film")[film.model].further for name, film in scene.films().items()}
    return {name: further for name, further in known.items() if further is not None}


def further_rows(scene: Scene) -> int:
    """Parameters of a sample with films that have further numbers; 0 without such films."""
    last = max((scene.joint_labels.index(joint) for joint in _solved_films(scene)), default=-1)
    return 0 if last < 0 else at.FURTHER + at.FURTHER_ROWS * (last + 1)


def with_further_numbers(scene: Scene, get: Numbers, p: Array) -> Array:
    """Parameters (m, PARAMETERS) with what films are solved for once a bearing.

    Raises InputError if samples differ in length over diameter of such a film.
    """
    rows = np.pad(p, ((0, 0), (0, further_rows(scene) - p.shape[1])))
    for joint, further in _solved_films(scene).items():
        key, table = scene.joint_key(joint), scene.pin(joint)
        ratio = 0.5 * table.film.length / table.bearing_radius  # type: ignore[union-attr]
        varied = 0.5 * get(f"{key}.film.length") / get(f"{key}.bearing_radius")
        if (np.abs(varied / ratio - 1.0) > SAME_LENGTH).any():
            raise InputError(
                f"{key}.film.model", scene.films()[joint].model,
                "the samples differ in length over diameter, but the film is solved for one ratio",
                'Vary neither film.length nor bearing_radius, or take model = "short" or "long"',
            )  # fmt: skip
        first = at.FURTHER + at.FURTHER_ROWS * scene.joint_labels.index(joint)
        rows[:, first : first + at.FURTHER_ROWS] = further(ratio)
    return rows

"""The laws of a scene's joints: their numbers in the kernel's parameters, and the energy that contacts store."""

from collections.abc import Callable
from typing import Any

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.outcome import WIDEST
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.contacts.declared import Shape
from hpcclear.dynamics.contacts.registry import GEOMETRIES
from hpcclear.dynamics.laws import numbers
from hpcclear.dynamics.laws.constant import with_constants
from hpcclear.dynamics.laws.hertz_contact import dundurs, reduced_compliance, sphere_stiffness
from hpcclear.dynamics.layout.views import Parameters
from hpcclear.scene import Scene
from hpcclear.scene.mechanism import length_path
from hpcclear.scene.record import has_pressure

Get = Callable[[str], Array]

HERTZ_RANGE = 0.25
"""Penetration over clearance (times R_J/R_B) beyond which a result is flagged, unless the law says otherwise.

Hertz's contact radius is a = sqrt(R_B R_J d/c) here; a theory of small contacts has lost its ground when a exceeds half
the journal's radius, a contact of 30 degrees to either side. That is d > 0.25 c R_J/R_B.
"""


def shape_of(scene: Scene, get: Get, label: str) -> Shape:
    """Numbers of a contact's shape."""
    key = scene.joint_key(label)
    return GEOMETRIES[scene.clearance_joint(label).geometry].shape(
        lambda name: get(f"{key}.{name}")
    )


def joint_numbers(scene: Scene, get: Get, label: str) -> dict[str, Array]:
    """Numbers of a contact's samples by the names of `declared.JOINT`, (m,)."""
    key, materials = scene.joint_key(label), scene.materials_key(label)
    shape = shape_of(scene, get, label)
    clearance, bearing, journal = shape.radii
    moduli, ratios = (
        [get(f"{materials}.{part}.{entry}") for part in ("bearing", "journal")]
        for entry in ("youngs_modulus", "poisson_ratio")
    )
    h_bearing, h_journal = map(reduced_compliance, moduli, ratios)
    alpha, beta = dundurs(moduli, ratios)
    path = length_path(scene.clearance_joint(label))
    return {
        "stiffness": sphere_stiffness(h_bearing, h_journal, shape.radius),
        "compliance": h_bearing + h_journal,
        "bearing_radius": bearing,
        "journal_radius": journal,
        "clearance": clearance,
        "length": np.full_like(clearance, np.nan) if path is None else get(f"{key}.{path}"),
        "dundurs_alpha": alpha,
        "dundurs_beta": beta,
    }


def _given(get: Get, kind: str, table: Any) -> dict[str, Any]:
    """A law's parameters of samples, (m,); lists as they are."""
    values = {one.name: table.value(one.name) for one in table.declared.parameters}
    return {
        name: tuple(value) if isinstance(value, tuple) else get(f"effects.{kind}.{name}")
        for name, value in values.items()
    }


def fill(scene: Scene, get: Get, label: str, force: Array, p: Array) -> None:
    """Fill one contact's block of parameters but for its film (a view, first column its first entry).

    `force`: what inertia comes to, N, (m,): laws whose force is no power of the depth are looked at there.
    """
    joint, shape = joint_numbers(scene, get, label), shape_of(scene, get, label)
    p[:, at.CLEARANCE] = shape.clearance
    p[:, at.BEARING_RADIUS] = shape.bearing_radius
    p[:, at.JOURNAL_RADIUS] = shape.journal_radius
    table: Any = scene.effects.contact
    law = with_constants(table.declared)
    given = {**joint, **_given(get, "contact", table)}
    rows = numbers.rows_of(law, given, len(p))
    p[:, at.CONTACT_NUMBERS : at.CONTACT_NUMBERS + rows.shape[1]] = rows
    found = numbers.sample_numbers(law, given)
    p[:, at.EXPONENT], p[:, at.DAMPING] = numbers.shape_near(law, force, found)
    if law.deepest is None:
        ratio = joint["journal_radius"] / joint["bearing_radius"]
        p[:, at.DEEPEST_VALID] = HERTZ_RANGE * ratio * joint["clearance"]
    else:
        p[:, at.DEEPEST_VALID] = numbers.evaluate(law.deepest, found)
    if GEOMETRIES[scene.clearance_joint(label).geometry].along_a_line:  # a corner is small
        p[:, at.DEEPEST_VALID] = np.minimum(p[:, at.DEEPEST_VALID], HERTZ_RANGE * shape.radius)
    rubs = scene.effects.friction
    if rubs.law == "none":
        return
    given = {**joint, **_given(get, "friction", rubs)}
    friction = with_constants(rubs.declared)
    rows = numbers.rows_of(friction, given, len(p))
    p[:, at.FRICTION_NUMBERS : at.FRICTION_NUMBERS + rows.shape[1]] = rows
    found = numbers.sample_numbers(friction, given)
    ramp, slope = numbers.steepness_of(friction, found, len(p))
    p[:, at.INVERSE_RAMP], p[:, at.STEEPNESS] = ramp, slope


def swing(scene: Scene, p: Array, place: int, force: Array) -> Array:
    """Stiffness of a joint's contact where its elastic force is `force` (m,), N/m, of parameters (m, PARAMETERS)."""
    law = with_constants(scene.effects.contact.declared)  # type: ignore[union-attr]
    found: Array = numbers.swing(law, force, _read(law, p, [place], 0))
    return found


def widest_contact(scene: Scene, get: Get, forces: Array) -> dict[str, Array]:
    """Fields of `outcome.WIDEST`, (m, MAX_JOINTS) each, at normal forces (m, MAX_JOINTS) of samples; 0 without contact.

    Empty where the geometry of contact has no pressure; NaN at places without a contact.
    """
    if not has_pressure(scene):
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


def stored_energy(scene: Scene, par: Array, gaps: Array, active: Array, places: Any) -> Array:
    """Energy stored in the contacts at `places`, J, (t,); parameters (PARAMETERS,) or (t, PARAMETERS), gaps and contact flags
    (t, places): under `latched` laws a penetration counts only while in contact."""
    table = scene.effects.contact
    if table is None or not len(places):
        return np.zeros(len(gaps))
    law = with_constants(table.declared)
    depth = np.maximum(gaps, 0.0)
    on = active if law.latched else np.ones_like(depth)
    each = on * numbers.stored(law, depth, _read(law, par, places))
    total: Array = each.sum(axis=-1)
    return total


def _read(law: Any, par: Array, places: Any, one: int | None = None) -> dict[str, Array]:
    rows = Parameters(par).contact_numbers[..., places, :]
    return numbers.read_from(law, rows if one is None else rows[..., one, :])

"""The mechanical energy of whole states, and how well a run closed its balance."""

from collections.abc import Sequence

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout.views import Outcome, Parameters, Start
from hpcclear.dynamics.linkage.parts import split
from hpcclear.dynamics.planar.problem import linkage_of
from hpcclear.laws import numbers
from hpcclear.laws.constant import with_constants
from hpcclear.scene import Scene


def energies(
    scene: Scene, par: Array, q: Array, v: Array, active: Array, turn_time: Array | float = 0.0
) -> tuple[Array, Array]:
    """Kinetic energy, and all energy: kinetic, potential and stored in the contacts, J, (m,) each.

    `par` is (PARAMETERS,), of one sample, or (m, PARAMETERS); `q`, `v` (n, m) are the kernel's coordinates and velocities in
    any formulation; `active` (m, MAX_JOINTS): contact flags. `turn_time`, s since the start of the revolution, (m,), gives
    the crank angle where it is no coordinate.
    """
    q, v = q[scene.bristles :], v[scene.bristles :]
    linkage, places = linkage_of(scene), list(scene.open_places)
    kinetic, potential, eccentricity = linkage.energies(par, q, v, turn_time, scene.effects.gravity)
    p = Parameters(par)
    contacts = linkage.mechanism.contacts
    gaps = np.empty((len(eccentricity.T), len(contacts)))
    for k, contact in enumerate(contacts):
        sizes = [one[..., places[k]] for one in (p.clearance, p.bearing_radius, p.journal_radius)]
        gaps[:, k] = contact.joint.gap(contact.part, eccentricity[k], sizes)
    if any(scene.waves().values()):
        pose = linkage.poses.at(par, q, v, turn_time)[0]
        angles = {body.name: pose.angle[k] for k, body in enumerate(linkage.mechanism.bodies)}
        for k, contact in enumerate(contacts):
            if not contact.joint.round:
                continue
            bodies = [split(place)[0] for place in (contact.bearing, contact.journal)]
            turns = tuple(angles.get(body, 0.0) for body in bodies)
            direction = np.arctan2(eccentricity[k, 1], eccentricity[k, 0])
            gaps[:, k] -= _depth(scene, par, places[k], direction, turns)
    elastic = stored_energy(scene, par, gaps, active[:, places], places)
    return kinetic, kinetic + potential + elastic


def stored_energy(
    scene: Scene, par: Array, gaps: Array, active: Array, places: Sequence[int]
) -> Array:
    """Energy stored in the contacts at `places`, J, (t,); parameters (PARAMETERS,) or (t, PARAMETERS), gaps and contact flags
    (t, places): under `latched` laws a penetration counts only while in contact."""
    table = scene.effects.contact
    if table is None or not len(places):
        return np.zeros(len(gaps))
    law = with_constants(table.declared)
    depth = np.maximum(gaps, 0.0)
    on = active if law.latched else np.ones_like(depth)
    read = numbers.read_from(law, Parameters(par).contact_numbers[..., places, :])
    return (on * numbers.stored(law, depth, read)).sum(axis=-1)


def _depth(
    scene: Scene, par: Array, place: int, direction: Array, turns: Sequence[Array | float]
) -> Array | float:
    """How much wider than round a joint is in a direction (m,), m; `turns`: angles of bearing and journal, rad."""
    counts = scene.waves()
    row = at.WAVES + 4 * sum(counts.values()) * place
    depth: Array | float = 0.0
    for count, turn in zip(counts.values(), turns, strict=True):
        for n in range(1, count + 1):
            angle = n * (direction - turn)
            depth = depth + par[..., row] * np.cos(angle) + par[..., row + 1] * np.sin(angle)
            row += 4
    return depth


def of_starts(scene: Scene, par: Array, start: Start, n: int) -> Array:
    """Energy of m starts, J, shape (m,); parameters (m, PARAMETERS), n coordinates."""
    q, v = start.coordinates(n).T, start.velocities(n).T
    with np.errstate(invalid="ignore"):  # starts that failed are not finite
        return energies(scene, par, q, v, start.active)[1]


def errors(scene: Scene, par: Array, before: Array, outcome: Outcome, n: int) -> Array:
    """What the balance leaves unexplained at the end (m,), over max(kinetic energy, integral of |driving power|).

    `par` (m, PARAMETERS); `before` (m,): energy at the start, J; `outcome`: with the energy balance on; `n`: coordinates.
    """
    q, v = outcome.coordinates(n).T, outcome.velocities(n).T
    kinetic, after = energies(scene, par, q, v, outcome.active)
    works = outcome.drive_work + outcome.load_work - outcome.dissipated
    return np.abs(after - before - works) / np.maximum(kinetic, outcome.absolute_drive_work)
